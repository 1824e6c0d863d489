"""
The answers as messages, each in two parts: its numbers, and the message made of them.

So the same numbers can go into a message, or straight into its serialized form.
"""

from array import array

import numpy as np
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, Twist, TwistStamped, VelocityStamped
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

from .. import kernel
from ..kernel import Floats
from ..kinematics import in_axes
from .messages import Report, time_message
from .settings import ROW_LABELS, Settings


def pose_numbers(report: Report) -> Floats:
    """
    Return position (3,) and quaternion (4,) x y z w of the tool in the base frame, shape (7,).

    """
    numbers = np.empty(7)
    numbers[:3] = report.answer.state.position
    numbers[3:] = report.answer.quaternion_xyzw
    return numbers


def _set_pose(pose: Pose, numbers: list[float]) -> Pose:
    position, orientation = pose.position, pose.orientation
    position.x, position.y, position.z = numbers[:3]
    orientation.x, orientation.y, orientation.z, orientation.w = numbers[3:]
    return pose


def pose_message(stamp: int, numbers: Floats, settings: Settings) -> PoseStamped:
    """
    Return the tool in the base frame.

    """
    message = PoseStamped()
    message.header.stamp = time_message(stamp)
    message.header.frame_id = settings.base_frame
    _set_pose(message.pose, numbers.tolist())
    return message


def jacobian_numbers(report: Report) -> Floats:
    """
    Return J, row-major, in the axes and row order that are set, shape (6 n,).

    """
    settings, state = report.settings, report.answer.state
    J = in_axes(state, state.jacobian, settings.jacobian_frame)
    if settings.row_order == 'angular_first':
        J = np.concatenate([J[3:], J[:3]])
    return J.ravel()


def jacobian_message(stamp: int, numbers: Floats, settings: Settings) -> Float64MultiArray:
    """
    Return J, row-major 6 x n, with labelled rows and columns.

    """
    names = ','.join(settings.joint_names)
    n = settings.robot.dof
    message = Float64MultiArray()
    message.layout.dim = [
        MultiArrayDimension(label=ROW_LABELS[settings.row_order], size=6, stride=6 * n),
        MultiArrayDimension(label=names, size=n, stride=n),
    ]
    message.data = array('d', numbers.tobytes())
    return message


def twist_numbers(report: Report) -> Floats | None:
    """
    Return J qdot in the axes that are set, shape (6,); None where the velocities are unknown.

    """
    state = report.answer.state
    if not state.moving:
        return None
    if report.settings.twist_frame == 'base':
        return state.twist
    return in_axes(state, state.twist[:, None], report.settings.twist_frame)[:, 0]


def _set_twist(message: Twist, numbers: list[float]) -> None:
    linear, angular = message.linear, message.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = numbers


def _twist_axes(settings: Settings) -> str:
    return settings.base_frame if settings.twist_frame == 'base' else settings.tool_frame


def twist_message(stamp: int, numbers: Floats, settings: Settings) -> TwistStamped:
    """
    Return J qdot.

    """
    message = TwistStamped()
    message.header.stamp = time_message(stamp)
    message.header.frame_id = _twist_axes(settings)
    _set_twist(message.twist, numbers.tolist())
    return message


def velocity_message(stamp: int, numbers: Floats, settings: Settings) -> VelocityStamped:
    """
    Return J qdot with all three frames named.

    """
    message = VelocityStamped()
    message.header.stamp = time_message(stamp)
    message.header.frame_id = _twist_axes(settings)
    message.body_frame_id = settings.tool_frame
    message.reference_frame_id = settings.base_frame
    _set_twist(message.velocity, numbers.tolist())
    return message


def scalar_message(stamp: int, numbers: Floats, settings: Settings) -> Float64:
    """
    Return a measure.

    """
    return Float64(data=float(numbers[0]))


def link_frames_numbers(report: Report) -> Floats:
    """
    Return position and quaternion x y z w of every frame of the table, shape (7 (rows + 1),).

    """
    frames = np.ascontiguousarray(report.answer.state.link_frames)
    quaternions_xyzw = np.empty((len(frames), 4))
    kernel.quaternions(frames, quaternions_xyzw)
    return np.concatenate([frames[:, :3, 3], quaternions_xyzw], axis=1).ravel()


def link_frames_message(stamp: int, numbers: Floats, settings: Settings) -> PoseArray:
    """
    Return every frame of the table in the base frame.

    """
    message = PoseArray()
    message.header.stamp = time_message(stamp)
    message.header.frame_id = settings.base_frame
    message.poses = [_set_pose(Pose(), pose) for pose in numbers.reshape(-1, 7).tolist()]
    return message
