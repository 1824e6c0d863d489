# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert pose and diagnostics messages, which only `echo` and `demo` show, to plain data."""

from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped

from ...kernel import Floats
from ...node.messages.readings import Stamp, VectorPair, WarningReading, numbers_of, warned_of
from ...rigid_motion import roll_pitch_yaw, rotation_of_quaternion

ACCELERATION = VectorPair(
    'accel', {'linear': ('ax ay az', 'm/s^2'), 'angular': ('x y z', 'rad/s^2')}
)
WRENCH = VectorPair('wrench', {'force': ('x y z', 'N'), 'torque': ('x y z', 'N m')})


class PoseReading(NamedTuple):
    """
    A pose in a frame: position (3,) in m, quaternion x y z w (4,), roll pitch yaw (3,) in rad.
    """

    stamp: Stamp
    frame: str
    position: Floats
    quaternion_xyzw: Floats
    roll_pitch_yaw: Floats


class StatusesReading(NamedTuple):
    """The statuses of one node in a DiagnosticArray."""

    statuses: tuple[WarningReading, ...]


def pose_of(message: PoseStamped) -> PoseReading:
    """Return the content of a PoseStamped message as a pose with roll pitch yaw."""
    quaternion = numbers_of(message.pose.orientation)
    return PoseReading(
        Stamp.of(message.header),
        message.header.frame_id,
        numbers_of(message.pose.position),
        quaternion,
        roll_pitch_yaw(rotation_of_quaternion(quaternion)),
    )


def statuses_of(node: str, message: DiagnosticArray) -> StatusesReading:
    """
    Return the statuses of one node in a message; `node` is its full name without leading slash.
    """
    statuses = (status for status in message.status if status.name.startswith(f'{node}: '))
    return StatusesReading(tuple(map(warned_of, statuses)))
