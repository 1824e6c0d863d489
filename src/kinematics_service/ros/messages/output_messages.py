"""The answers: for each the message without stamp and numbers, and the numbers that it takes."""

from array import array
from collections.abc import Callable
from typing import NamedTuple

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
from ...kinematics.uncertainty.arm_errors import errors_of_file
from ...kinematics.uncertainty.pose_covariance import covariances
from ...robot.measures import Measure
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
        found = _covariances(self.errors, report)[int(self.of_twist)]
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


def pose_template(settings: NodeSettings) -> PoseStamped:
    """Return the tool in the base frame."""
    return PoseStamped(header=Header(frame_id=settings.base_frame))


def pose_numbers(settings: NodeSettings) -> Numbers:
    """
    Return where position (3,) and quaternion (4,) x y z w of the tool in the base frame come from.
    """
    return _pose_columns()


def _pose_columns() -> Copied:
    position = np.arange(kernel.POSE_AT + 3, kernel.POSE_AT + 12, 4)
    return Copied(np.concatenate([position, np.arange(-kernel.ROW_TAIL, 0)]))


def jacobian_template(settings: NodeSettings) -> Float64MultiArray:
    """Return J, row-major 6 x n, with labelled rows and columns."""
    names = ','.join(settings.joint_names)
    n = settings.robot.dof
    message = Float64MultiArray(data=array('d', bytes(8 * 6 * n)))
    message.layout.dim = [
        MultiArrayDimension(label=ROW_LABELS[settings.row_order], size=6, stride=6 * n),
        MultiArrayDimension(label=names, size=n, stride=n),
    ]
    return message


def jacobian_numbers(settings: NodeSettings) -> Numbers:
    """
    Return where J comes from, row-major, in the axes and row order that are set, shape (6 n,).
    """
    axes = settings.jacobian_frame
    order = [3, 4, 5, 0, 1, 2] if settings.row_order == 'angular_first' else [0, 1, 2, 3, 4, 5]
    if axes == 'base':
        n = settings.robot.dof
        return Copied(kernel.JACOBIAN_AT + np.arange(6 * n).reshape(6, n)[order].ravel())

    def numbers(report: StateReport) -> Floats:
        state = report.answer.state
        return in_axes_of(state.pose, state.jacobian)[order].ravel()

    return Computed(numbers)


def twist_numbers(settings: NodeSettings) -> Numbers:
    """Return where J qdot comes from, in the axes that are set, shape (6,)."""
    axes = settings.twist_frame
    if axes == 'base':
        return Copied(kernel.JACOBIAN_AT + 6 * settings.robot.dof + np.arange(6))

    def numbers(report: StateReport) -> Floats:
        state = report.answer.state
        return in_axes_of(state.pose, state.twist[:, None])[:, 0]

    return Computed(numbers)


def acceleration_template(settings: NodeSettings) -> AccelStamped:
    """Return J qddot + dJ/dt qdot."""
    return AccelStamped(header=_twist_header(settings))


def acceleration_numbers(settings: NodeSettings) -> Numbers:
    """Return where J qddot + dJ/dt qdot comes from, in the axes of the twist, shape (6,)."""
    point = settings.robot.point(settings.of)

    def numbers(report: StateReport) -> Floats | None:
        state, qddot = report.answer.state, report.answer.qddot
        if qddot is None:
            return None
        found = acceleration_of(state, point, qddot)
        if settings.twist_frame == TOOL:
            found = in_axes_of(state.pose, found[:, None])[:, 0]
        return found if np.isfinite(found).all() else None

    return Computed(numbers)


def wrench_template(settings: NodeSettings) -> WrenchStamped:
    """Return the wrench that the tool exerts, at the tool's origin and in its axes."""
    return WrenchStamped(header=Header(frame_id=settings.tool_frame))


def wrench_numbers(settings: NodeSettings) -> Numbers:
    """Return where force and torque come from, shape (6,)."""

    def numbers(report: StateReport) -> Floats | None:
        found = wrench_estimate(report)
        return None if found is None else found.wrench

    return Computed(numbers)


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


def null_space_template(settings: NodeSettings) -> Float64MultiArray:
    """Return a basis of the joint motions that leave the task's rows at rest, row-major n x k."""
    n, k = settings.robot.dof, _self_motions(settings)
    message = Float64MultiArray(data=array('d', bytes(8 * n * k)))
    message.layout.dim = [
        MultiArrayDimension(label=','.join(settings.joint_names), size=n, stride=n * k),
        MultiArrayDimension(label='self-motions', size=k, stride=k),
    ]
    return message


def _self_motions(settings: NodeSettings) -> int:
    return settings.robot.dof - settings.robot.task.generic_rank


def null_space_numbers(settings: NodeSettings) -> Numbers | None:
    """Return where that basis comes from, shape (n k,); None for an arm without self-motion."""

    def numbers(report: StateReport) -> Floats | None:
        basis = report.answer.null_space
        return None if basis is None else basis.ravel()

    return Computed(numbers) if _self_motions(settings) else None


def self_motion_template(settings: NodeSettings) -> Float64MultiArray:
    """Return the self-motion that raises the distance fastest, a number for each joint."""
    n = settings.robot.dof
    message = Float64MultiArray(data=array('d', bytes(8 * n)))
    message.layout.dim = [
        MultiArrayDimension(label=','.join(settings.joint_names), size=n, stride=n)
    ]
    return message


def self_motion_numbers(settings: NodeSettings) -> Numbers | None:
    """Return where that motion comes from, shape (n,); None for an arm without self-motion."""

    def numbers(report: StateReport) -> Floats | None:
        basis = report.answer.null_space
        return None if basis is None else self_motion_of(report.answer.state, basis)

    return Computed(numbers) if _self_motions(settings) else None


def pose_with_covariance_template(settings: NodeSettings) -> PoseWithCovarianceStamped:
    """Return the tool in the base frame, and how far it may be off."""
    return PoseWithCovarianceStamped(header=Header(frame_id=settings.base_frame))


def pose_with_covariance_numbers(settings: NodeSettings) -> Numbers | None:
    """
    Return where position, quaternion x y z w and covariance (36,) of the tool's pose come from.

    None where the robot file does not say what may be off.
    """
    said, errors = settings.robot.description.uncertainty, _errors(settings)
    if said is None or errors is None or not said.of_pose:
        return None
    return WithCovariance(_pose_columns(), errors)


def _errors(settings: NodeSettings) -> PoseErrors | None:
    if settings.robot.description.uncertainty is None:
        return None
    return errors_of_file(settings.robot)


def _covariances(errors: PoseErrors, report: StateReport, axes: str = BASE) -> Floats:
    return covariances(errors, report.answer.state, axes)


def twist_with_covariance_template(settings: NodeSettings) -> TwistWithCovarianceStamped:
    """Return J qdot, and how far it may be off."""
    return TwistWithCovarianceStamped(header=_twist_header(settings))


def twist_with_covariance_numbers(settings: NodeSettings) -> Numbers | None:
    """
    Return where J qdot and its covariance (36,) come from, in the axes that are set.

    None where the robot file does not say how far velocities may be off.
    """
    said, errors = settings.robot.description.uncertainty, _errors(settings)
    if said is None or errors is None or said.velocity_noise is None:
        return None
    twist = twist_numbers(settings)
    if isinstance(twist, Copied):
        return WithCovariance(twist, errors, of_twist=True)

    def numbers(report: StateReport) -> Floats:
        found = _covariances(errors, report, TOOL)[1]
        return np.concatenate([twist.of(report), found.ravel()])

    return Computed(numbers)


def _twist_header(settings: NodeSettings) -> Header:
    of_base = settings.twist_frame == 'base'
    return Header(frame_id=settings.base_frame if of_base else settings.tool_frame)


def twist_template(settings: NodeSettings) -> TwistStamped:
    """Return J qdot."""
    return TwistStamped(header=_twist_header(settings))


def velocity_template(settings: NodeSettings) -> VelocityStamped:
    """Return J qdot with all three frames named."""
    return VelocityStamped(
        header=_twist_header(settings),
        body_frame_id=settings.tool_frame,
        reference_frame_id=settings.base_frame,
    )


def scalar_template(settings: NodeSettings) -> Float64:
    """Return a measure."""
    return Float64()


def measure_numbers(measure: Measure) -> Callable[[NodeSettings], Numbers | None]:
    """Return the column of a measure; None for an arm that does not have it."""

    def numbers(settings: NodeSettings) -> Numbers | None:
        if measure.of_square and not settings.robot.task.square:
            return None
        return Copied(np.array([measure.column]), of_measures=True)

    return numbers


def link_frames_template(settings: NodeSettings) -> PoseArray:
    """Return every frame of the table in the base frame."""
    header = Header(frame_id=settings.base_frame)
    return PoseArray(header=header, poses=[Pose() for _ in range(settings.robot.chain.frames)])


def link_frames_numbers(settings: NodeSettings) -> Numbers:
    """
    Return where position and quaternion x y z w of every frame of the table come from, shape (7
    (rows + 1),).
    """

    def numbers(report: StateReport) -> Floats:
        frames = np.ascontiguousarray(report.answer.state.link_frames)
        quaternions_xyzw = np.empty((len(frames), 4))
        kernel.quaternions(frames, quaternions_xyzw)
        return np.concatenate([frames[:, :3, 3], quaternions_xyzw], axis=1).ravel()

    return Computed(numbers)
