"""The answers: for each the message without stamp and numbers, and the numbers that it takes."""

import math
from array import array
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import Pose, PoseArray, VelocityStamped
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension

from ... import kernel
from ...estimation.estimator import StreamQuantity
from ...estimation.joint_accelerations import JointAccelerations
from ...estimation.joint_efforts import JointEfforts
from ...estimation.null_space_basis import NullSpaceBasis
from ...kernel import Floats, Integers, PoseErrors
from ...kinematics.acceleration import acceleration_of
from ...kinematics.forward import BASE, in_axes_of
from ...kinematics.singularity import measured
from ...kinematics.statics import WrenchEstimate, wrench_of
from ...kinematics.tool_state import ToolState
from ...kinematics.uncertainty.arm_errors import errors_of_file
from ...kinematics.uncertainty.pose_covariance import covariances
from ...robot.measures import Measure, why_unsearched
from ...robot.points import TOOL
from ..parameters.settings import ROW_LABELS, NodeSettings
from .messages import StateReport


@dataclass(frozen=True, eq=False)  # arrays have no single truth value
class Copied:
    """
    Numbers that are copied from a state's row, or from its measures.

    Attributes
    ----------
    columns
        Their columns; negative ones count from the end.
    of_measures
        Whether these are columns of the measures.
    of_motion
        Whether there are such numbers only if the velocities are known.
    """

    columns: Integers
    of_measures: bool = False
    of_motion: bool = False

    depth: ClassVar[int] = kernel.JACOBIAN
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    def of(self, report: StateReport) -> Floats | None:
        """Return the numbers of a report; None if it has none."""
        state = report.answer.state
        if self.of_motion and not state.moving:
            return None
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return their columns in a row of so many numbers and, beyond its end, in the measures.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # of a message that is a stamp


@dataclass(frozen=True, eq=False)
class WithCovariance:
    """
    Numbers that are copied from a state's row, and the covariance of what they say behind them.

    Attributes
    ----------
    copied
        The numbers. The covariance is that of the twist if they are of the motion; otherwise it
        is that of the pose.
    errors
        What may be off in the arm.
    """

    copied: Copied
    errors: PoseErrors

    depth: ClassVar[int] = kernel.ALL_FRAMES
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    @property
    def of_motion(self) -> bool:
        """Return whether there are such numbers only if the velocities are known."""
        return self.copied.of_motion

    def of(self, report: StateReport) -> Floats | None:
        """Return the numbers of a report; None if it has none."""
        numbers = self.copied.of(report)
        if numbers is None:
            return None
        found = covariances(self.errors, report.answer.state, BASE)[int(self.of_motion)]
        return np.concatenate([numbers, found.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """Return their columns in a row, where the covariances stand beyond the measures."""
        begin = row + measures + (36 if self.of_motion else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


@dataclass(frozen=True, eq=False)
class Computed:
    """
    Numbers that are computed from a state.

    Attributes
    ----------
    of
        Returns the numbers of a report, of any shape; None if it has none.
    depth
        What the kernel must have computed of the state.
    quantities
        The kinds of quantities in the answer that it needs.
    """

    of: Callable[[StateReport], npt.ArrayLike | None]
    depth: int = kernel.JACOBIAN
    quantities: tuple[type[StreamQuantity], ...] = ()


@dataclass(frozen=True, eq=False)
class Built:
    """
    A message that is built as a whole.

    Attributes
    ----------
    message
        Returns the message of a report.
    depth
        As in `Computed`.
    period : ns
        Least difference of stamps between two messages.
    """

    message: Callable[[StateReport], Any]
    depth: int
    period: int

    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()


def flat(numbers: npt.ArrayLike) -> Floats:
    """Return numbers of any shape as a vector."""
    return np.asarray(numbers, dtype=np.float64).ravel()


Content = Copied | WithCovariance | Computed | Built
# Of the settings; None if the robot file has not what the topic needs.
ContentOf = Callable[[NodeSettings], Content | None]
SILENT = Computed(lambda report: None)  # of a topic that an arm has, but no number for it


Template = Callable[[NodeSettings], Any]


def in_base_frame(kind: Any) -> Template:
    """Return the template of a message in the base frame."""
    return lambda settings: kind(header=Header(frame_id=settings.base_frame))


def in_tool_frame(kind: Any) -> Template:
    """Return the template of a message at the tool's origin and in its axes."""
    return lambda settings: kind(header=Header(frame_id=settings.tool_frame))


def in_twist_frame(kind: Any) -> Template:
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


def computed(
    of: Callable[[StateReport], npt.ArrayLike | None],
    *quantities: type[StreamQuantity],
    depth: int = kernel.JACOBIAN,
) -> ContentOf:
    """Return that numbers are computed, whatever the settings are."""
    return lambda settings: Computed(of, depth, quantities)


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
    """Return that numbers follow from a basis of the self-motions, of arms that have some."""

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
