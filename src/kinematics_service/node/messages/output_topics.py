# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
List the topics that a node publishes for each accepted message, in the order of publication.

Each entry of `TOPICS` has two functions that take the settings of the node. The first, `content`,
returns where the numbers of the messages come from, for example a function of the arm's state. The
second, `template`, returns a message that has its texts, such as the frame, but no stamp and no
numbers.
"""

import math
from array import array
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    AccelStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistStamped,
    TwistWithCovarianceStamped,
    VelocityStamped,
    WrenchStamped,
)
from std_msgs.msg import Float64, Float64MultiArray, Header, MultiArrayDimension
from visualization_msgs.msg import MarkerArray

from ... import kernel
from ...estimation.joint_accelerations import JointAccelerations
from ...estimation.joint_efforts import JointEfforts
from ...estimation.null_space_basis import NullSpaceBasis
from ...kernel import Floats
from ...kinematics.acceleration import acceleration_of
from ...kinematics.forward import BASE, in_axes_of
from ...kinematics.null_space import self_motion_of
from ...kinematics.statics import WrenchEstimate, wrench_of
from ...kinematics.tool_state import ToolState
from ...kinematics.uncertainty.arm_errors import covariances, errors_of_file
from ...robot.measures import MEASURES, Measure, why_unsearched
from ...robot.points import TOOL
from ..parameters.settings import ROW_LABELS, NodeSettings
from .content import (
    NO_NUMBERS,
    SILENT,
    Built,
    Computed,
    Content,
    ContentOf,
    Copied,
    WithCovariance,
    computed,
)
from .messages import StateReport
from .topics import POSE

Template = Callable[[NodeSettings], Any]
_Message = TypeVar('_Message')


def in_base_frame(kind: Callable[..., _Message]) -> Callable[[NodeSettings], _Message]:
    """Return a function from the settings to a message template whose frame is the base frame."""
    return lambda settings: kind(header=Header(frame_id=settings.base_frame))


def in_tool_frame(kind: Callable[..., _Message]) -> Callable[[NodeSettings], _Message]:
    """Return a function from the settings to a message template whose frame is the tool frame."""
    return lambda settings: kind(header=Header(frame_id=settings.tool_frame))


def in_twist_frame(kind: Callable[..., _Message]) -> Callable[[NodeSettings], _Message]:
    """
    Return a function from the settings to a message template whose frame is that of the twist.

    The settings choose the frame: the base frame or the tool frame.
    """
    return lambda settings: kind(header=Header(frame_id=_twist_frame(settings)))


def matrix_message(*dimensions: tuple[str, int]) -> Float64MultiArray:
    """Return a message of zeros, row-major, with a label and a size for each dimension."""
    sizes = [size for _, size in dimensions]
    message = Float64MultiArray(data=array('d', bytes(8 * math.prod(sizes))))
    message.layout.dim = [
        MultiArrayDimension(label=label, size=size, stride=math.prod(sizes[k:]))
        for k, (label, size) in enumerate(dimensions)
    ]
    return message


def _twist_frame(settings: NodeSettings) -> str:
    return settings.base_frame if settings.twist_frame == BASE else settings.tool_frame


def velocity_template(settings: NodeSettings) -> VelocityStamped:
    """
    Return the message template of the twist J qdot, with the names of three frames: axes, moving
    body, and reference.
    """
    return VelocityStamped(
        header=Header(frame_id=_twist_frame(settings)),
        body_frame_id=settings.tool_frame,
        reference_frame_id=settings.base_frame,
    )


def jacobian_template(settings: NodeSettings) -> Float64MultiArray:
    """Return the message template of J, row-major 6 x n, with labelled rows and columns."""
    return matrix_message((ROW_LABELS[settings.row_order], 6), _joints(settings))


def _joints(settings: NodeSettings) -> tuple[str, int]:
    return ','.join(settings.joint_names), settings.robot.dof


def pose_numbers(settings: NodeSettings) -> Copied:
    """
    Return the content of pose messages: position (3,) and quaternion x y z w (4,) of the tool in
    the base frame.
    """
    # Select the position: the fourth column of the pose, which is stored with shape (3, 4).
    position = np.arange(kernel.POSE_AT + 3, kernel.POSE_AT + 12, 4)
    return Copied(np.concatenate([position, np.arange(-kernel.ROW_TAIL, 0)]))


def jacobian_numbers(settings: NodeSettings) -> Content:
    """
    Return the content of Jacobian messages: J in the axes and row order of the settings,
    row-major, shape (6 n,).
    """
    order = [3, 4, 5, 0, 1, 2] if settings.row_order == 'angular_first' else [0, 1, 2, 3, 4, 5]
    if settings.jacobian_frame == BASE:
        n = settings.robot.dof
        return Copied(kernel.JACOBIAN_AT + np.arange(6 * n).reshape(6, n)[order].ravel())

    def numbers(report: StateReport) -> Floats:
        state = report.answer.state
        return in_axes_of(state.pose, state.jacobian)[order].ravel()

    return Computed(numbers)


def twist_numbers(settings: NodeSettings) -> Copied | Computed:
    """Return the content of twist messages: J qdot in the axes of the settings, shape (6,)."""
    if settings.twist_frame == BASE:
        columns = kernel.JACOBIAN_AT + 6 * settings.robot.dof + np.arange(6)
        return Copied(columns, of_motion=True)
    return Computed(_twist_in_tool_axes)


def _twist_in_tool_axes(report: StateReport) -> Floats | None:
    state = report.answer.state
    return in_axes_of(state.pose, state.twist[:, None])[:, 0] if state.moving else None


def acceleration(report: StateReport) -> Floats | None:
    """
    Return the tool's acceleration J qddot + dJ/dt qdot in the axes of the twist, shape (6,); None
    if qddot is unknown or the result is not finite.
    """
    settings, state = report.settings, report.answer.state
    qddot = report.answer.quantities.get(JointAccelerations)
    if qddot is None:
        return None
    twist_rate = acceleration_of(state, settings.robot.point(settings.of), qddot)
    if settings.twist_frame == TOOL:
        twist_rate = in_axes_of(state.pose, twist_rate[:, None])[:, 0]
    return twist_rate if np.isfinite(twist_rate).all() else None


def wrench(report: StateReport) -> Floats | None:
    """Return force and torque at the tool, shape (6,); None if the joint efforts are unknown."""
    estimate = wrench_estimate(report)
    return None if estimate is None else estimate.wrench


def wrench_estimate(report: StateReport) -> WrenchEstimate | None:
    """
    Return the wrench computed from joint efforts, in the axes and at the origin of the tool.

    The result is None if an effort is unknown or too large.
    """
    state, servo = report.answer.state, report.settings.servo
    torques = report.answer.quantities.get(JointEfforts)
    if torques is None:
        return None
    J = in_axes_of(state.pose, state.jacobian)
    estimate = wrench_of(state.robot, J, torques, servo.damping, servo.damped_below)
    return estimate if np.isfinite(estimate.wrench).all() else None


def _self_motions(settings: NodeSettings) -> int:
    return settings.robot.dof - settings.robot.singularity.task.generic_rank


def of_null_space(part: Callable[[ToolState, Floats], Floats]) -> ContentOf:
    """
    Return a function that takes the settings and returns the content of a null space topic.

    For each message, the content calls `part`. This function computes the numbers of the message
    from the arm's state and a basis of the self-motions. If the arm has no self-motions, the
    content is None.
    """

    def numbers(report: StateReport) -> Floats | None:
        basis = report.answer.quantities.get(NullSpaceBasis)
        return None if basis is None else part(report.answer.state, basis)

    content = Computed(numbers, quantities=(NullSpaceBasis,))
    return lambda settings: content if _self_motions(settings) else None


def pose_with_covariance_numbers(settings: NodeSettings) -> Content | None:
    """
    Return the content of pose messages with covariance: position (3,) and quaternion x y z w (4,)
    of the tool, and the covariance of the pose (36,).

    The result is None if the robot file has no uncertainty.
    """
    uncertainty, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if uncertainty is None or errors is None or not uncertainty.of_pose:
        return None
    return WithCovariance(pose_numbers(settings), errors)


def twist_with_covariance_numbers(settings: NodeSettings) -> Content | None:
    """
    Return the content of twist messages with covariance: J qdot (6,) in the axes of the settings,
    and the covariance of J qdot (36,).

    The result is None if the robot file has no `velocity_noise`.
    """
    uncertainty, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if uncertainty is None or errors is None or uncertainty.velocity_noise is None:
        return None
    twist = twist_numbers(settings)
    if isinstance(twist, Copied):
        return WithCovariance(twist, errors)

    def numbers(report: StateReport) -> Floats | None:
        velocity = twist.of(report)
        if velocity is None:
            return None
        covariance = covariances(errors, report.answer.state, TOOL)[1]
        return np.concatenate([velocity, covariance.ravel()])

    return Computed(numbers, kernel.ALL_FRAMES)


def measure_numbers(measure: Measure) -> ContentOf:
    """
    Return a function that takes the settings and returns the content of a measure's topic.

    The content is one number, the value of the singularity measure. If the arm does not have this
    measure, the content is `SILENT`.
    """

    def numbers(settings: NodeSettings) -> Content:
        robot = settings.robot
        unsearched = measure.name == 'distance' and why_unsearched(robot.dof)
        if unsearched or measure.of_square and not robot.singularity.task.square:
            return SILENT
        return Copied(np.array([measure.column]), of_measures=True)

    return numbers


def link_frames_template(settings: NodeSettings) -> PoseArray:
    """Return the message template for the poses of all table frames, in the base frame."""
    header = Header(frame_id=settings.base_frame)
    return PoseArray(header=header, poses=[Pose() for _ in range(settings.robot.chain.frames)])


def link_frames(report: StateReport) -> Floats:
    """
    Return position and quaternion x y z w of every frame of the table, shape (frames, 7).
    """
    frames = np.ascontiguousarray(report.answer.state.link_frames)
    quaternions_xyzw = np.empty((len(frames), 4))
    kernel.quaternions(frames, quaternions_xyzw)
    return np.concatenate([frames[:, :3, 3], quaternions_xyzw], axis=1)


class OutputTopic(NamedTuple):
    """
    A topic on which the node publishes a message for every joint state.

    Attributes
    ----------
    name, type
        The name and the message type of the topic.
    content
        A function that takes the settings and returns where the numbers of the messages come from,
        for example a function of the arm's state. If the arm does not have the topic, the result
        is None.
    template
        A function that takes the settings and returns a message that has its texts, such as the
        frame, but no stamp and no numbers.
    of
        Name of the point whose states are published on the topic; empty for the tool.
    """

    name: str
    type: Any
    content: ContentOf
    template: Template | None = None
    of: str = ''

    def blank(self, settings: NodeSettings) -> Any:
        """Return the message of the topic with texts, but without stamp and numbers."""
        return self.type() if self.template is None else self.template(settings)


def _markers(report: StateReport) -> Any:
    # Import the markers only when the first subscriber needs them.
    from .markers import markers_message

    return markers_message(report)


TOPICS = (
    OutputTopic(POSE, PoseStamped, pose_numbers, in_base_frame(PoseStamped)),
    OutputTopic('~/jacobian', Float64MultiArray, jacobian_numbers, jacobian_template),
    OutputTopic('~/jacobian/stamp', Time, lambda settings: NO_NUMBERS),
    OutputTopic('~/twist', TwistStamped, twist_numbers, in_twist_frame(TwistStamped)),
    OutputTopic('~/velocity', VelocityStamped, twist_numbers, velocity_template),
    OutputTopic(
        '~/acceleration',
        AccelStamped,
        computed(acceleration, JointAccelerations),
        in_twist_frame(AccelStamped),
    ),
    OutputTopic(
        '~/wrench', WrenchStamped, computed(wrench, JointEfforts), in_tool_frame(WrenchStamped)
    ),
    OutputTopic(
        '~/pose_with_covariance',
        PoseWithCovarianceStamped,
        pose_with_covariance_numbers,
        in_base_frame(PoseWithCovarianceStamped),
    ),
    OutputTopic(
        '~/twist_with_covariance',
        TwistWithCovarianceStamped,
        twist_with_covariance_numbers,
        in_twist_frame(TwistWithCovarianceStamped),
    ),
    *(
        OutputTopic(f'~/singularity/{measure.name}', Float64, measure_numbers(measure))
        # MEASURES begins with the distance. Reverse its order, so that the distance is last.
        for measure in reversed(MEASURES.values())
    ),
    OutputTopic(
        '~/null_space',
        Float64MultiArray,
        of_null_space(lambda state, basis: basis),
        lambda settings: matrix_message(
            _joints(settings), ('self-motions', _self_motions(settings))
        ),
    ),
    OutputTopic(
        '~/null_space/away',
        Float64MultiArray,
        of_null_space(self_motion_of),
        lambda settings: matrix_message(_joints(settings)),
    ),
    # The node computes the clearance only for subscribers, because the clearance takes ten times
    # as long as all other numbers of a state.
    OutputTopic(
        '~/singularity/clearance', Float64, computed(lambda report: report.singularity.clearance)
    ),
    OutputTopic(
        '~/link_frames',
        PoseArray,
        computed(link_frames, depth=kernel.ALL_FRAMES),
        link_frames_template,
    ),
    # Limit the rate of the markers, because 50 markers take a hundred times as long as a pose.
    # Viewers need at most 30 messages a second.
    OutputTopic(
        '~/markers',
        MarkerArray,
        lambda settings: Built(_markers, kernel.ALL_FRAMES, period=33_000_000),
    ),
)


# The topics of each point other than the tool.
OF_POINTS = tuple(
    topic
    for topic in TOPICS
    if topic.name
    in (POSE, '~/jacobian', '~/jacobian/stamp', '~/twist', '~/acceleration', '~/wrench')
)


def topics_of(settings: NodeSettings) -> tuple[OutputTopic, ...]:
    """Return the topics of a node: first the topics of the tool, then those of each point."""
    return (
        *(topic for topic in TOPICS if topic.content(settings) is not None),
        *(
            topic._replace(name=topic.name.replace('~', f'~/{point}'), of=point)
            for point in settings.points
            for topic in OF_POINTS
        ),
    )
