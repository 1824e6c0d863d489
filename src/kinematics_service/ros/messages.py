"""
From JointState to plain data, and from plain data to messages: no decision is made here.

A scalar field of a message takes anything silently, so every number passes through float() or
int().
"""

from array import array
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    Pose,
    PoseArray,
    PoseStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    VelocityStamped,
)
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

from .. import kernel
from ..estimator import Answer
from ..joint_sample import JointSample
from ..kernel import Floats
from ..kinematics import in_axes
from ..notice import Notice
from ..singularities import Singularity
from .settings import ROW_LABELS, Settings

LEVELS = (
    DiagnosticStatus.OK,
    DiagnosticStatus.WARN,
    DiagnosticStatus.ERROR,
    DiagnosticStatus.STALE,
)
SECOND = 1_000_000_000
LARGEST_SECOND = 2**31 - 1


class Report(NamedTuple):
    """
    All that one accepted message leads to, for the builders of messages.

    """

    answer: Answer
    singularity: Singularity
    settings: Settings


def stamp_of(message: JointState) -> int:
    """
    Return the stamp of a message in ns; 0 where it has none.

    """
    stamp = message.header.stamp
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def sample_of(message: JointState, received: int, arrival: int) -> JointSample:
    """
    Return what a JointState says, heard at `received` (ROS clock, ns) and `arrival` (steady, ns).

    """
    return JointSample(
        message.name, message.position, message.velocity, stamp_of(message), received, arrival
    )


def time_message(stamp: int) -> Time:
    """
    Return a time in ns as a message; beyond what it can hold, the nearest it can.

    """
    seconds, nanoseconds = divmod(stamp, SECOND)
    return Time(
        sec=max(-LARGEST_SECOND - 1, min(LARGEST_SECOND, seconds)), nanosec=int(nanoseconds)
    )


def _set_pose(pose: Pose, position: Floats, quaternion_xyzw: Floats) -> Pose:
    pose.position.x, pose.position.y, pose.position.z = map(float, position)
    orientation = pose.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = map(float, quaternion_xyzw)
    return pose


def pose_message(report: Report) -> PoseStamped:
    """
    Return the tool in the base frame.

    """
    message = PoseStamped()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = report.settings.base_frame
    _set_pose(message.pose, report.answer.state.position, report.answer.quaternion_xyzw)
    return message


def jacobian_message(report: Report) -> Float64MultiArray:
    """
    Return J, row-major 6 x n, with labelled rows and columns.

    """
    settings, state = report.settings, report.answer.state
    J = in_axes(state, state.jacobian, settings.jacobian_frame)
    if settings.row_order == 'angular_first':
        J = np.concatenate([J[3:], J[:3]])
    prefix = settings.estimator.joint_prefix
    names = ','.join(prefix + name for name in settings.robot.joint_names)
    n = settings.robot.dof
    message = Float64MultiArray()
    message.layout.dim = [
        MultiArrayDimension(label=ROW_LABELS[settings.row_order], size=6, stride=6 * n),
        MultiArrayDimension(label=names, size=n, stride=n),
    ]
    message.data = array('d', J.tobytes())
    return message


def _set_twist(message: Twist, twist: Floats) -> None:
    linear, angular = message.linear, message.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = map(float, twist)


def _twist(report: Report) -> Floats:
    state = report.answer.state
    return in_axes(state, state.twist[:, None], report.settings.twist_frame)[:, 0]


def _twist_axes(settings: Settings) -> str:
    return settings.base_frame if settings.twist_frame == 'base' else settings.tool_frame


def twist_message(report: Report) -> TwistStamped | None:
    """
    Return J qdot; None where the velocities are unknown.

    """
    if report.answer.state.qdot is None:
        return None
    message = TwistStamped()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = _twist_axes(report.settings)
    _set_twist(message.twist, _twist(report))
    return message


def velocity_message(report: Report) -> VelocityStamped | None:
    """
    Return J qdot with all three frames named; None where the velocities are unknown.

    """
    if report.answer.state.qdot is None:
        return None
    message = VelocityStamped()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = _twist_axes(report.settings)
    message.body_frame_id = report.settings.tool_frame
    message.reference_frame_id = report.settings.base_frame
    _set_twist(message.velocity, _twist(report))
    return message


def scalar_message(value: float | None) -> Float64 | None:
    """
    Return a measure; None where the arm has none.

    """
    return None if value is None else Float64(data=float(value))


def link_frames_message(report: Report) -> PoseArray:
    """
    Return every frame of the table in the base frame.

    """
    message = PoseArray()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = report.settings.base_frame
    frames = np.ascontiguousarray(report.answer.state.link_frames)
    quaternions_xyzw = np.empty((len(frames), 4))
    kernel.quaternions(frames, quaternions_xyzw)
    message.poses = [
        _set_pose(Pose(), T[:3, 3], quaternion) for T, quaternion in zip(frames, quaternions_xyzw)
    ]
    return message


def transform_message(report: Report) -> TransformStamped:
    """
    Return the tool in the base frame, for /tf.

    """
    message = TransformStamped()
    message.header.stamp = time_message(report.answer.stamp)
    message.header.frame_id = report.settings.base_frame
    message.child_frame_id = report.settings.tool_frame
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = map(float, report.answer.state.position)
    rotation.x, rotation.y, rotation.z, rotation.w = map(float, report.answer.quaternion_xyzw)
    return message


def status_message(name: str, notice: Notice) -> DiagnosticStatus:
    """
    Return a notice as a DiagnosticStatus.

    """
    message = DiagnosticStatus()
    message.level = LEVELS[notice.level]
    message.name = name
    message.message = notice.sentence
    message.hardware_id = dict(notice.values).get('robot', '')
    message.values = [KeyValue(key=key, value=value) for key, value in notice.values]
    return message
