# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the encapsulation and the lengths of serialized messages.

ROS's deserializer writes to standard error if it refuses bytes, and no option disables this. So
this check rejects bytes that the deserializer would refuse, and passes only other bytes to the
deserializer.
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
# For each message type, a function that reads all fields of a message and raises an error if the
# bytes are too few.
WALKS: dict[type, Callable[[CdrReader], object]] = {
    JointState: fields_of,
    PoseStamped: _stamped_doubles(7),
    TwistStamped: _stamped_doubles(6),
}


def read_message(data: bytes, kind: type[_Message]) -> _Message:
    """
    Decode bytes as a message of a type in `WALKS`.

    Raises
    ------
    WireError
        The bytes are not a message of this type.
    """
    try:
        WALKS[kind](CdrReader(data))
        message: _Message = deserialize_message(data, kind)
    except Exception:  # any error means that the bytes are not a message of the type
        raise WireError(f'{len(data)} bytes are not a {kind.__name__} message') from None
    return message
