"""The answers: for each the message without stamp and numbers, and the numbers that it takes."""

import math
from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
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

from ... import kernel
from ...kernel import Floats, Integers, PoseErrors
from ...kinematics.acceleration import acceleration_of
from ...kinematics.forward import BASE, in_axes_of
from ...kinematics.null_space import self_motion_of
from ...kinematics.singularity import measured
from ...kinematics.statics import WrenchEstimate, wrench_of
from ...kinematics.tool_state import ToolState
from ...kinematics.uncertainty.arm_errors import errors_of_file
from ...kinematics.uncertainty.pose_covariance import covariances
from ...robot.measures import Measure, why_unsearched
from ...robot.points import TOOL
from ..parameters.settings import ROW_LABELS, NodeSettings
from .messages import StateReport


class Copied(NamedTuple):
    """
    Numbers that are copied from a state's row, or from its measures.

    Attributes
    ----------
    columns
        Their columns; negative ones count from the end.
    of_measures
        Whether these are columns of the measures.
    """

    columns: Integers
    of_measures: bool = False

    def of(self, report: StateReport) -> Floats:
        """Return the numbers of a report."""
        state = report.answer.state
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return their columns in a row of so many numbers and, beyond its end, in the measures.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # of a message that is a stamp


class WithCovariance(NamedTuple):
    """
    Numbers that are copied from a state's row, and the covariance of what they say behind them.

    Attributes
    ----------
    copied
        The numbers.
    errors
        What may be off in the arm.
    of_twist
        Whether the covariance is that of the twist; otherwise it is that of the pose.
    """

    copied: Copied
    errors: PoseErrors
    of_twist: bool = False

    def of(self, report: StateReport) -> Floats:
        """Return the numbers of a report."""
        found = covariances(self.errors, report.answer.state, BASE)[int(self.of_twist)]
        return np.concatenate([self.copied.of(report), found.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """Return their columns in a row, where the covariances stand beyond the measures."""
        begin = row + measures + (36 if self.of_twist else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


class Computed(NamedTuple):
    """
    Numbers that are computed from a state; `of` returns those of a report, None if it has none.
    """

    of: Callable[[StateReport], Floats | None]


Numbers = Copied | WithCovariance | Computed


Template = Callable[[NodeSettings], Any]


def stamped(kind: Any, frame: Callable[[NodeSettings], str]) -> Template:
    """Return the template of a message with a header, whose frame follows from the settings."""
    return lambda settings: kind(header=Header(frame_id=frame(settings)))


def matrix_message(*dimensions: tuple[str, int]) -> Float64MultiArray:
    """Return zeros, row-major, with the labels and sizes of their dimensions."""
    sizes = [size for _, size in dimensions]
    message = Float64MultiArray(data=array('d', bytes(8 * math.prod(sizes))))
    message.layout.dim = [
        MultiArrayDimension(label=label, size=size, stride=math.prod(sizes[k:]))
        for k, (label, size) in enumerate(dimensions)
    ]
    return message


def computed(of: Callable[[StateReport], Floats | None]) -> Callable[[NodeSettings], Numbers]:
    """Return that numbers are computed, whatever the settings are."""
    return lambda settings: Computed(of)


def _twist_frame(settings: NodeSettings) -> str:
    return settings.base_frame if settings.twist_frame == BASE else settings.tool_frame


pose_template = stamped(PoseStamped, lambda settings: settings.base_frame)
pose_with_covariance_template = stamped(
    PoseWithCovarianceStamped, lambda settings: settings.base_frame
)
twist_template = stamped(TwistStamped, _twist_frame)
twist_with_covariance_template = stamped(TwistWithCovarianceStamped, _twist_frame)
acceleration_template = stamped(AccelStamped, _twist_frame)
# The wrench that the tool exerts, at the tool's origin and in its axes.
wrench_template = stamped(WrenchStamped, lambda settings: settings.tool_frame)


def velocity_template(settings: NodeSettings) -> VelocityStamped:
    """Return J qdot with all three frames named."""
    return VelocityStamped(
        header=Header(frame_id=_twist_frame(settings)),
        body_frame_id=settings.tool_frame,
        reference_frame_id=settings.base_frame,
    )


def scalar_template(settings: NodeSettings) -> Float64:
    """Return a measure."""
    return Float64()


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


def jacobian_numbers(settings: NodeSettings) -> Numbers:
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


def twist_numbers(settings: NodeSettings) -> Numbers:
    """Return where J qdot comes from, in the axes that are set, shape (6,)."""
    if settings.twist_frame == BASE:
        return Copied(kernel.JACOBIAN_AT + 6 * settings.robot.dof + np.arange(6))

    def numbers(report: StateReport) -> Floats:
        state = report.answer.state
        return in_axes_of(state.pose, state.twist[:, None])[:, 0]

    return Computed(numbers)


def acceleration(report: StateReport) -> Floats | None:
    """Return J qddot + dJ/dt qdot in the axes of the twist, shape (6,); None if not known."""
    settings, state, qddot = report.settings, report.answer.state, report.answer.qddot
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
    state, torques, servo = report.answer.state, report.answer.torques, report.settings.servo
    if torques is None:
        return None
    J = in_axes_of(state.pose, state.jacobian)
    found = wrench_of(state.robot, J, torques, servo.damping, servo.damped_below)
    return found if np.isfinite(found.wrench).all() else None


def _self_motions(settings: NodeSettings) -> int:
    return settings.robot.dof - settings.robot.singularity.task.generic_rank


def of_null_space(
    part: Callable[[ToolState, Floats], Floats],
) -> Callable[[NodeSettings], Numbers | None]:
    """Return that numbers follow from a basis of the self-motions, of arms that have some."""

    def numbers(report: StateReport) -> Floats | None:
        basis = report.answer.null_space
        return None if basis is None else part(report.answer.state, basis)

    return lambda settings: Computed(numbers) if _self_motions(settings) else None


null_space_numbers = of_null_space(lambda state, basis: basis.ravel())
self_motion_numbers = of_null_space(self_motion_of)


def pose_with_covariance_numbers(settings: NodeSettings) -> Numbers | None:
    """
    Return where position, quaternion x y z w and covariance (36,) of the tool's pose come from.

    None where the robot file does not say what may be off.
    """
    said, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if said is None or errors is None or not said.of_pose:
        return None
    return WithCovariance(pose_numbers(settings), errors)


def twist_with_covariance_numbers(settings: NodeSettings) -> Numbers | None:
    """
    Return where J qdot and its covariance (36,) come from, in the axes that are set.

    None where the robot file does not say how far velocities may be off.
    """
    said, errors = settings.robot.description.uncertainty, errors_of_file(settings.robot)
    if said is None or errors is None or said.velocity_noise is None:
        return None
    twist = twist_numbers(settings)
    if isinstance(twist, Copied):
        return WithCovariance(twist, errors, of_twist=True)

    def numbers(report: StateReport) -> Floats:
        found = covariances(errors, report.answer.state, TOOL)[1]
        return np.concatenate([twist.of(report), found.ravel()])

    return Computed(numbers)


def measure_numbers(measure: Measure) -> Callable[[NodeSettings], Numbers | None]:
    """Return the column of a measure; None for an arm that does not have it."""

    def numbers(settings: NodeSettings) -> Numbers | None:
        robot = settings.robot
        unsearched = measure.name == 'distance' and why_unsearched(robot.dof)
        if unsearched or measure.of_square and not robot.singularity.task.square:
            return None
        return Copied(np.array([measure.column]), of_measures=True)

    return numbers


def link_frames_template(settings: NodeSettings) -> PoseArray:
    """Return every frame of the table in the base frame."""
    header = Header(frame_id=settings.base_frame)
    return PoseArray(header=header, poses=[Pose() for _ in range(settings.robot.chain.frames)])


def link_frames(report: StateReport) -> Floats:
    """
    Return position and quaternion x y z w of every frame of the table, shape (7 frames,).
    """
    frames = np.ascontiguousarray(report.answer.state.link_frames)
    quaternions_xyzw = np.empty((len(frames), 4))
    kernel.quaternions(frames, quaternions_xyzw)
    return np.concatenate([frames[:, :3, 3], quaternions_xyzw], axis=1).ravel()
