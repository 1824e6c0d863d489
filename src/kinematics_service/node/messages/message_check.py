"""
Whether bytes can be a message at all: their encapsulation and their lengths.

ROS's deserializer writes to standard error whenever it refuses, which cannot be switched off; so
bytes that it would refuse are not given to it. It still reads all bytes that pass here.
"""

from collections.abc import Callable
from typing import TypeVar

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from ...errors import WireError
from ...estimation.cdr import STAMP, CdrReader
from ...estimation.joint_state_form import fields_of


def _stamped_doubles(count: int) -> Callable[[CdrReader], object]:
    def walk(reader: CdrReader) -> object:
        reader.skip(STAMP.size)
        reader.text()
        return reader.doubles(count)

    return walk


_Message = TypeVar('_Message')
# The function that walks over a message of each type.
WALKS: dict[type, Callable[[CdrReader], object]] = {
    JointState: fields_of,
    PoseStamped: _stamped_doubles(7),
    TwistStamped: _stamped_doubles(6),
}


def read_message(data: bytes, kind: type[_Message]) -> _Message:
    """
    Return the message in the bytes, of a type in `WALKS`.

    Raises
    ------
    WireError
        The bytes are no message of this type.
    """
    try:
        WALKS[kind](CdrReader(data))
        message: _Message = deserialize_message(data, kind)
    except Exception:  # of any kind: these bytes are not a message
        raise WireError(f'{len(data)} bytes that are no {kind.__name__}') from None
    return message
