"""
Whether bytes can be a message at all: their encapsulation and their lengths.

The official deserializer writes to standard error whenever it refuses, and nobody can stop it; so
bytes that it would refuse are not given to it. What passes here is still read by it.
"""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from ...errors import CdrError, WireError
from ...estimation.cdr import STAMP, CdrReader
from ...estimation.joint_state_form import fields_of


def _stamped_doubles(count: int) -> Callable[[CdrReader], object]:
    def walk(reader: CdrReader) -> object:
        reader.skip(STAMP.size)
        reader.text()
        return reader.doubles(count)

    return walk


# What walks over a message of each type.
WALKS: dict[Any, Callable[[CdrReader], object]] = {
    JointState: fields_of,
    PoseStamped: _stamped_doubles(7),
    TwistStamped: _stamped_doubles(6),
}


def read_message(data: bytes, kind: Any) -> Any:
    """
    Return the message that bytes are, one of `WALKS`.

    Raises
    ------
    WireError
        The bytes are none.
    """
    if is_whole(data, kind):
        try:
            return deserialize_message(data, kind)
        except Exception:  # whatever it raises, a message it is not
            pass
    raise WireError(f'{len(data)} bytes that are no {kind.__name__}')


def is_whole(data: bytes, kind: Any) -> bool:
    """Return whether the lengths in a serialized message fit into its bytes."""
    try:
        WALKS[kind](CdrReader(data))
    except CdrError:
        return False
    return True
