# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the state of an arm's tool at joint positions and velocities, in one call of the kernel.
"""

from typing import NamedTuple, TypeGuard

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import ArgumentError, JointVectorError, LoopError
from ..kernel import Chain, Floats
from ..notebook import as_html
from ..robot.points import Point
from ..robot.robot import AnyRobot, Robot, as_robot
from .arguments import numbers_of, shape_together
from .closure import LoopClosure, closure_in, why_not_closed
from .threads import in_parts


class ToolState(NamedTuple):
    """
    The pose, Jacobian, twist and frames of an arm at joint positions `q`, computed by the kernel.

    Attributes
    ----------
    robot
        The arm.
    row : shape (..., width)
        The results of the kernel, from which the properties are read. If the state is one pose,
        `row` has three more parts at its end: q, qdot, and a second quaternion of the tool. The
        sign of the second quaternion is such that it does not jump from state to state.
    moving
        Whether the joint velocities are known.
    joints
        q and qdot of a batch; None for one pose.
    measures
        The kernel's singularity measures: one row for one pose, rows (N, width) for a batch; None
        if they were not computed.
    """

    robot: Robot
    row: Floats
    moving: bool
    joints: tuple[Floats, Floats | None] | None = None
    measures: Floats | None = None

    def __repr__(self) -> str:
        if self.row.ndim > 1:
            return f'ToolState({self.robot.name!r}, {self.row.size // self.row.shape[-1]} poses)'
        at, q = (', '.join(f'{x:.4g}' for x in values) for values in (self.position, self.q))
        return f'ToolState({self.robot.name!r}, tool at [{at}] m, q [{q}])'

    def _repr_html_(self) -> str | None:
        return as_html(self)

    @property
    def q(self) -> Floats:
        """Return the joint positions, shape (..., n), rad or m."""
        if self.joints is not None:
            return self.joints[0]
        return self.row[-2 * self.robot.chain.dof - kernel.ROW_TAIL :][: self.robot.chain.dof]

    @property
    def qdot(self) -> Floats | None:
        """Return the joint velocities, shape (..., n), rad/s or m/s; None if they are unknown."""
        if self.joints is not None:
            return self.joints[1]
        if not self.moving:
            return None
        return self.row[-self.robot.chain.dof - kernel.ROW_TAIL : -kernel.ROW_TAIL]

    @property
    def numbers(self) -> Floats:
        """
        Return the results of the kernel, shape (..., width).

        The `row` of a single pose ends with three more parts, which are left out: q, qdot, and a
        second quaternion of the tool.
        """
        if self.joints is not None:
            return self.row
        return self.row[: -2 * self.robot.chain.dof - kernel.ROW_TAIL]

    @property
    def pose(self) -> Floats:
        """Return the pose of the tool in the base frame, shape (..., 4, 4), translation in m."""
        return self.row[..., :16].reshape(*self.row.shape[:-1], 4, 4)

    @property
    def position(self) -> Floats:
        """Return the tool's origin in the base frame, shape (..., 3), m."""
        return self.row[..., 3:12:4]

    @property
    def quaternion_xyzw(self) -> Floats:
        """
        Return the tool's orientation in the base frame as unit quaternion, w >= 0, shape (..., 4).
        """
        return self.row[..., kernel.QUATERNION_AT : kernel.QUATERNION_AT + 4]

    @property
    def continuous_quaternion_xyzw(self) -> Floats:
        """
        Return the orientation of one pose as unit quaternion, shape (4,). Its sign is such that
        the quaternion does not jump from state to state of a motion.
        """
        return self.row[-kernel.ROW_TAIL :]

    @property
    def jacobian(self) -> Floats:
        """
        Return J in base axes, reference point the tool's origin, shape (..., 6, n).

        Its rows are vx vy vz wx wy wz.
        """
        n = self.robot.chain.dof
        J = self.row[..., kernel.JACOBIAN_AT : kernel.JACOBIAN_AT + 6 * n]
        return J.reshape(*self.row.shape[:-1], 6, n)

    @property
    def twist(self) -> Floats:
        """
        Return J qdot in base axes, shape (..., 6): vx vy vz (m/s) wx wy wz (rad/s).

        The twist is zero if `qdot` is None.
        """
        at = kernel.JACOBIAN_AT + 6 * self.robot.chain.dof
        return self.row[..., at : at + 6]

    @property
    def closure(self) -> LoopClosure | None:
        """
        Return the state of the arm's closed loops, with their passive joints; None for an arm
        without loops.
        """
        chain = self.robot.chain
        if not chain.loops:
            return None
        at = chain.closure_at
        return closure_in(self.robot, self.row[..., at : at + chain.closure.width])

    @property
    def link_frames(self) -> Floats:
        """
        Return the poses of the table's frames in the base frame, shape (..., rows + 1, 4, 4).

        The frames are frame 0 and the frame after each row of the table. They exist only if the
        state was evaluated at depth `kernel.ALL_FRAMES`.
        """
        chain = self.robot.chain
        at, end = chain.widths[kernel.JACOBIAN], chain.widths[kernel.ALL_FRAMES]
        return self.row[..., at:end].reshape(*self.row.shape[:-1], chain.frames, 4, 4)


_DOUBLE = np.dtype(np.float64)
# Create a ToolState by tuple.__new__, because the constructor of a NamedTuple would add 0.18 us to
# the 1.0 us of `evaluate`.
_new = tuple.__new__


def as_the_kernel_takes_it(vector: npt.ArrayLike) -> TypeGuard[Floats]:
    """
    Return whether the argument is a vector that the kernel can read: float64, aligned, in C order.
    """
    return (
        type(vector) is np.ndarray
        and vector.dtype is _DOUBLE
        and vector.ndim == 1
        and vector.flags.carray
    )


def _joint_vector(robot: Robot, q: npt.ArrayLike, name: str) -> Floats:
    # Returns a copy of joint values as float64 in C order, so that the caller cannot change the
    # state.
    array = numbers_of(name, q, JointVectorError, [(robot.dof,)], f'(..., {robot.dof})')
    if array.ndim == 0 or array.shape[-1] != robot.chain.dof:
        sentence = (
            f'{name} has shape {array.shape}; {robot.name} has {robot.dof} joints '
            f'({", ".join(robot.joint_names)}), so it must be (..., {robot.dof})'
        )
        raise JointVectorError(sentence, name, [(robot.dof,)], array.shape, code='wrong-shape')
    return array


def velocities_of(state: ToolState) -> Floats:
    """Return the joint velocities (..., n) of a state; raise JointVectorError if it has none."""
    if state.qdot is None:
        expected = f'numbers, shape (..., {state.robot.dof})'
        raise JointVectorError.refused('qdot', expected, None, code='missing-argument')
    return state.qdot


def evaluate(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike | None = None,
    depth: int = kernel.JACOBIAN,
    measured: bool = False,
    *,
    point: Point | None = None,
) -> ToolState:
    """
    Return the tool's state at joint positions q, in one call of the kernel.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities; its leading dimensions broadcast against those of `q`.
    depth
        `kernel.POSE`, `kernel.JACOBIAN` (with the twist) or `kernel.ALL_FRAMES`.
    measured
        Whether to compute the singularity measures of one pose in the same call (depth JACOBIAN or
        more).
    point
        A point of the arm instead of the tool, at depth POSE or JACOBIAN: only pose, Jacobian and
        twist are of this point.

    Raises
    ------
    JointVectorError
        The last dimension is not n, or a number is not finite.
    LoopError
        A closed loop of the arm does not close at q.
    """
    if type(robot) is not Robot:  # a call of as_robot takes longer than this check
        robot = as_robot(robot)
    chain = robot.chain if point is None else point.chain
    # Inline the checks of `as_the_kernel_takes_it`, because a function call takes longer than a
    # check.
    if type(q) is np.ndarray and q.dtype is _DOUBLE and q.ndim == 1 and q.flags.carray:
        positions = q
    else:
        positions = _joint_vector(robot, q, 'q')
    if qdot is None:
        rates = chain.at_rest
    elif (
        type(qdot) is np.ndarray and qdot.dtype is _DOUBLE and qdot.ndim == 1 and qdot.flags.carray
    ):
        rates = qdot
    else:
        rates = _joint_vector(robot, qdot, 'qdot')
    try:
        width = chain.single_widths[depth]
    except (TypeError, IndexError):
        expected = 'kernel.POSE, JACOBIAN or ALL_FRAMES'
        raise ArgumentError.refused('depth', expected, depth, code='out-of-range') from None
    if positions.ndim > 1 or rates.ndim > 1:
        return _evaluate_batch(robot, chain, positions, None if qdot is None else rates, depth)
    row, measures = np.empty(width), None
    if measured:
        measures = np.empty(robot.singularity.measure_places.width)
        bad = kernel.evaluate_and_measure_one(
            robot.singularity.arm, positions, rates, row, measures
        )
    else:
        bad = kernel.evaluate_one(chain, positions, rates, row)
    if bad != -1:
        # Raise an error if q or qdot is not n numbers.
        _joint_vector(robot, positions, 'q')
        _joint_vector(robot, rates, 'qdot')
        raise _refusal(robot, chain, 0, positions, rates, positions.shape)
    return _new(ToolState, (robot, row, qdot is not None, None, measures))


def _evaluate_batch(
    robot: Robot, chain: Chain, q: Floats, qdot: Floats | None, depth: int
) -> ToolState:
    # Evaluates many poses. Copies vectors (n,); `evaluate` has already copied arrays with more
    # dimensions.
    if q.ndim == 1:
        q = _joint_vector(robot, q, 'q')
    if qdot is not None:
        if qdot.ndim == 1:
            qdot = _joint_vector(robot, qdot, 'qdot')
        if qdot.shape != q.shape:
            names = 'q', 'qdot'
            leading = shape_together(JointVectorError, names, q.shape, qdot.shape, q.shape)
            # Copy in C order, because np.array by default keeps the memory order of broadcast
            # axes.
            shape = *leading, q.shape[-1]
            q, qdot = (np.array(np.broadcast_to(x, shape), order='C') for x in (q, qdot))
    flat = q.reshape(-1, chain.dof)
    rates = (qdot if qdot is not None else chain.at_rest).reshape(-1, chain.dof)
    table = np.empty((len(flat), chain.widths[depth]))

    def part(begin: int, end: int) -> int:
        bad = kernel.evaluate(
            chain,
            flat[begin:end],
            rates[begin:end] if len(rates) == len(flat) else rates,
            depth,
            table[begin:end],
        )
        return bad if bad < 0 else begin + bad

    bad = in_parts(len(flat), part)
    if bad >= 0:
        qdot_bad = rates[bad if len(rates) > 1 else 0]
        raise _refusal(robot, chain, bad, flat[bad], qdot_bad, q.shape)
    row = table.reshape(*q.shape[:-1], table.shape[1])
    return ToolState(robot, row, qdot is not None, (q, qdot))


def _refusal(
    robot: Robot, chain: Chain, row: int, q: Floats, qdot: Floats, shape: tuple[int, ...]
) -> JointVectorError:
    # Returns the error for a pose that the kernel could not compute.
    if chain.loops and np.isfinite(q).all() and np.isfinite(qdot).all():
        loop, sentence = why_not_closed(robot, q)
        if loop:
            closed = LoopError(sentence, 'q', [shape], shape)
            closed.row, closed.loop = row, loop
            return closed
    # If q and qdot are finite but the results are not, the error sentence names neither q nor
    # qdot.
    name, values, code = '', q, 'too-large'
    sentence = 'joint values are too large to compute with'
    for key, given in (('qdot', qdot), ('q', q)):
        if not np.isfinite(given).all():
            name, values, code = key, given, 'not-finite'
            sentence = f'{name} must be finite'
    sentence += f': row {row} is {values.tolist()}'
    error = JointVectorError(sentence, name, [q.shape], shape, code=code)
    error.row = row
    return error
