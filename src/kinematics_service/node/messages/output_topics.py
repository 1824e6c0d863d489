"""
The topics a node publishes for each accepted message: one row each, in the order they go out.

A row names the function that returns its content, and one that returns its blank message.
"""

import math
from array import array
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

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
from ...kinematics.uncertainty.arm_errors import errors_of_file
from ...kinematics.uncertainty.covariances import covariances
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
    """Return the template of a message in the base frame."""
    return lambda settings: kind(header=Header(frame_id=settings.base_frame))


def in_tool_frame(kind: Callable[..., _Message]) -> Callable[[NodeSettings], _Message]:
    """Return the template of a message at the tool's origin and in its axes."""
    return lambda settings: kind(header=Header(frame_id=settings.tool_frame))


def in_twist_frame(kind: Callable[..., _Message]) -> Callable[[NodeSettings], _Message]:
    """Return the template of a message in the axes of the twist."""
    return lambda settings: kind(header=Header(frame_id=_twist_frame(settings)))


def matrix_message(*dimensions: tuple[str, int]) -> Float64MultiArray:
    """Return zeros, row-major, with the labels and sizes of their dimensions."""
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
    """Return J qdot with all three frames named."""
    return VelocityStamped(
        header=Header(frame_id=_twist_frame(settings)),
        body_frame_id=settings.tool_frame,
        reference_frame_id=settings.base_frame,
    )


def jacobian_template(settings: NodeSettings) -> Float64MultiArray:
    """Return J, row-major 6 x n, with labelled rows and columns."""
    return matrix_message((ROW_LABELS[settings.row_order], 6), _joints(settings))


def null_space_template(settings: NodeSettings) -> Float64MultiArray:
    """Return a basis of the joint motions that leave the task's rows at rest, row-major n x k."""
    return matrix_message(_joints(settings), ('self-motions', _self_motions(settings)))


def self_motion_template(settings: NodeSettings) -> Float64MultiArray:
    """Return the self-motion that raises the distance fastest, a number for each joint."""
    return matrix_message(_joints(settings))


def _joints(settings: NodeSettings) -> tuple[str, int]:
    return ','.join(settings.joint_names), settings.robot.dof


def pose_numbers(settings: NodeSettings) -> Copied:
    """
    Return where position (3,) and quaternion (4,) x y z w of the tool in the base frame come from.
    """
    # The fourth column of the pose, which stands in the row as (3, 4).
    position = np.arange(kernel.POSE_AT + 3, kernel.POSE_AT + 12, 4)
    return Copied(np.concatenate([position, np.arange(-kernel.ROW_TAIL, 0)]))


def jacobian_numbers(settings: NodeSettings) -> Content:
    """
    Return where J comes from, row-major, in the axes and row order that are set, shape (6 n,).
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
    """Return where J qdot comes from, in the axes that are set, shape (6,)."""
    if settings.twist_frame == BASE:
        columns = kernel.JACOBIAN_AT + 6 * settings.robot.dof + np.arange(6)
        return Copied(columns, of_motion=True)
    return Computed(_twist_in_tool_axes)


def _twist_in_tool_axes(report: StateReport) -> Floats | None:
    state = report.answer.state
    return in_axes_of(state.pose, state.twist[:, None])[:, 0] if state.moving else None


def acceleration(report: StateReport) -> Floats | None:
    """Return J qddot + dJ/dt qdot in the axes of the twist, shape (6,); None if not known."""
    settings, state = report.settings, report.answer.state
    qddot = report.answer.quantities.get(JointAccelerations)
    if qddot is None:
        return None
    found = acceleration_of(state, settings.robot.point(settings.of), qddot)
    if settings.twist_frame == TOOL:
        found = in_axes_of(state.pose, found[:, None])[:, 0]
    return found if np.isfinite(found).all() else None


def wrench(report: StateReport) -> Floats | None:
    """Return force and torque, shape (6,), None if joint efforts are not known."""
    found = wrench_estimate(report)
    return None if found is None else found.wrench


def wrench_estimate(report: StateReport) -> WrenchEstimate | None:
    """
    Return what the joint efforts of a report say of the wrench, in the axes of the tool and at its
    origin; None where an effort is not known, or one is too large.
    """
    state, servo = report.answer.state, report.settings.servo
    torques = report.answer.quantities.get(JointEfforts)
    if torques is None:
        return None
    J = in_axes_of(state.pose, state.jacobian)
    found = wrench_of(state.robot, J, torques, servo.damping, servo.damped_below)
    return found if np.isfinite(found.wrench).all() else None


def _self_motions(settings: NodeSettings) -> int:
    return settings.robot.dof - settings.robot.singularity.task.generic_rank


def of_null_space(part: Callable[[ToolState, Floats], Floats]) -> ContentOf:
    """Return content computed from a basis of the self-motions; none if the arm has none."""

    def numbers(report: StateReport) -> Floats | None:
        basis = report.answer.quantities.get(NullSpaceBasis)
        return None if basis is None else part(report.answer.state, basis)

    content = Computed(numbers, quantities=(NullSpaceBasis,))
    return lambda settings: content if _self_motions(settings) else None


def pose_with_covariance_numbers(settings: NodeSettings) -> Content | None:
    """
    Return where position, quaternion x y z w and covariance (36,) of the tool's pose come from.

    None where the robot file does not say what may be off.
    """
    said, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if said is None or errors is None or not said.of_pose:
        return None
    return WithCovariance(pose_numbers(settings), errors)


def twist_with_covariance_numbers(settings: NodeSettings) -> Content | None:
    """
    Return where J qdot and its covariance (36,) come from, in the axes that are set.

    None where the robot file does not say how far velocities may be off.
    """
    said, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if said is None or errors is None or said.velocity_noise is None:
        return None
    twist = twist_numbers(settings)
    if isinstance(twist, Copied):
        return WithCovariance(twist, errors)

    def numbers(report: StateReport) -> Floats | None:
        velocity = twist.of(report)
        if velocity is None:
            return None
        found = covariances(errors, report.answer.state, TOOL)[1]
        return np.concatenate([velocity, found.ravel()])

    return Computed(numbers, kernel.ALL_FRAMES)


def measure_numbers(measure: Measure) -> ContentOf:
    """Return the column of a measure; nothing for an arm that does not have it."""

    def numbers(settings: NodeSettings) -> Content:
        robot = settings.robot
        unsearched = measure.name == 'distance' and why_unsearched(robot.dof)
        if unsearched or measure.of_square and not robot.singularity.task.square:
            return SILENT
        return Copied(np.array([measure.column]), of_measures=True)

    return numbers


def link_frames_template(settings: NodeSettings) -> PoseArray:
    """Return every frame of the table in the base frame."""
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


@dataclass(frozen=True)
class OutputTopic:
    """
    A topic that answers every joint state.

    Attributes
    ----------
    name, type
        Its name and message type.
    content
        A function of the settings that returns the content; None if the robot file lacks what it
        needs: then the topic is not offered.
    template
        A function of the settings that returns the message without stamp and numbers.
    of
        The point it is about; empty for the tool.
    """

    name: str
    type: Any
    content: ContentOf
    template: Template | None = None
    of: str = ''

    def blank(self, settings: NodeSettings) -> Any:
        """Return the message without stamp and numbers."""
        return self.type() if self.template is None else self.template(settings)


def _markers(report: StateReport) -> Any:
    # Imported when somebody subscribes: the node itself needs no scene.
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
        for measure in reversed(MEASURES.values())  # the distance last
    ),
    OutputTopic(
        '~/null_space',
        Float64MultiArray,
        of_null_space(lambda state, basis: basis),
        null_space_template,
    ),
    OutputTopic(
        '~/null_space/away',
        Float64MultiArray,
        of_null_space(self_motion_of),
        self_motion_template,
    ),
    # Not among the numbers of a state: it takes ten times as long as all of them.
    OutputTopic(
        '~/singularity/clearance', Float64, computed(lambda report: report.singularity.clearance)
    ),
    OutputTopic(
        '~/link_frames',
        PoseArray,
        computed(link_frames, depth=kernel.ALL_FRAMES),
        link_frames_template,
    ),
    # Markers are for viewers: some fifty of them are a hundred times the work of a pose.
    OutputTopic(
        '~/markers',
        MarkerArray,
        lambda settings: Built(_markers, kernel.ALL_FRAMES, period=33_000_000),
    ),
)


# What there is of a point besides the tool.
OF_POINTS = tuple(
    topic
    for topic in TOPICS
    if topic.name
    in (POSE, '~/jacobian', '~/jacobian/stamp', '~/twist', '~/acceleration', '~/wrench')
)


def topics_of(settings: NodeSettings) -> tuple[OutputTopic, ...]:
    """Return the topics of a node: those of the tool, then those of each point."""
    return (
        *(topic for topic in TOPICS if topic.content(settings) is not None),
        *(
            replace(topic, name=topic.name.replace('~', f'~/{point}'), of=point)
            for point in settings.points
            for topic in OF_POINTS
        ),
    )
