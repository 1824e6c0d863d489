# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert JointState to plain data, and plain data to messages.

A scalar field of a message silently accepts a value of any type. So every number is converted by
float() or int().
"""

import time
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ...estimation.cdr import SECOND
from ...estimation.estimator import EstimatorOutput
from ...estimation.joint_sample import JointSample
from ...estimation.status_text import StatusText
from ...kernel import LARGEST_SECOND
from ...kinematics.singularity import Singularity, singularity_of
from ..parameters.settings import NodeSettings


class StateReport(NamedTuple):
    """
    All results that the node has computed for one accepted joint state, and the settings in force.
    """

    answer: EstimatorOutput
    settings: NodeSettings

    @property
    def singularity(self) -> Singularity:
        """
        Return the singularity measures of the state. Only the tool's report has them; reports for
        other points do not.
        """
        return singularity_of(self.answer.state)


def stamp_of(message: Any) -> int:
    """Return the stamp of a message with a header, ns; 0 if the stamp is not set."""
    stamp = message.header.stamp
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def sample_of(message: JointState, clock: Clock) -> JointSample:
    """
    Return the content of a JointState that arrives now; the clock's time replaces a stamp of 0.
    """
    stamp = stamp_of(message)
    received = stamp or int(clock.now().nanoseconds)
    now = time.monotonic_ns()
    content = message.name, message.position, message.velocity
    return JointSample(*content, stamp, received, now, message.effort)


def set_time(message: Time, stamp: int) -> Time:
    """Set a time message to a time in ns, or to the nearest time in its range, and return it."""
    seconds, nanoseconds = divmod(stamp, SECOND)
    message.sec = max(-LARGEST_SECOND - 1, min(LARGEST_SECOND, seconds))
    message.nanosec = int(nanoseconds)
    return message


def time_message(stamp: int) -> Time:
    """Return a time in ns as a message; a time out of range becomes the nearest time in range."""
    return set_time(Time(), stamp)


def transform_message(report: StateReport) -> TransformStamped:
    """Return the pose of the tool in the base frame as a message for /tf."""
    message = TransformStamped()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = report.settings.base_frame
    message.child_frame_id = report.settings.tool_frame
    translation, rotation = message.transform.translation, message.transform.rotation
    state = report.answer.state
    translation.x, translation.y, translation.z = map(float, state.position)
    rotation.x, rotation.y, rotation.z, rotation.w = map(float, state.continuous_quaternion_xyzw)
    return message


def full_name(node: Node) -> str:
    """
    Return the name of a node with its namespace, which distinguishes two arms on /diagnostics.
    """
    return str(node.get_fully_qualified_name()).lstrip('/')


def status_message(name: str, status_text: StatusText) -> DiagnosticStatus:
    """Return a status text as a DiagnosticStatus."""
    message = DiagnosticStatus()
    message.level = bytes([status_text.level])  # the field is of type byte
    message.name = name
    message.message = status_text.sentence
    message.hardware_id = dict(status_text.values).get('robot', '')
    message.values = [KeyValue(key=key, value=value) for key, value in status_text.values]
    return message
