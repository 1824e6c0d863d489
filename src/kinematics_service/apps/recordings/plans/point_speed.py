# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute bounds of the largest speed of a point of the arm over a plan.

The plan is divided into pieces, which are intervals of time. Taylor's theorem with Lagrange's
remainder bounds the speed in each piece. The velocity of the point is expanded to first order in
time about the middle of the piece. The bound is the largest norm of this linear function in the
piece, plus a bound of the remainder. The remainder follows from a bound of the third time
derivative of the point's position.
"""

import math

import numpy as np

from .... import kernel
from ....errors import PlanError
from ....estimation.joint_memory import LIMIT_TOLERANCE
from ....kernel import Chain, Floats
from ....robot.robot import Robot
from .bisection import Bounded, bracketed, verdict_of
from .polynomials import Pieces, PolynomialMotion, derivative, moment_at
from .verdicts import PlanMoment, PlanSpeed

TOOL = 'tool'
# Bisection stops if upper and lower bound of the largest speed differ by at most this ratio of the
# lower bound.
RELATIVE_TOLERANCE = 0.01
# Bisection also stops if upper and lower bound of the largest speed differ by at most this, m/s.
ABSOLUTE_TOLERANCE = 1e-9
# Largest number of time intervals that bisection makes by halving. Bisection begins with one
# interval for each segment of the plan, and these first intervals are not counted.
MAX_PIECES = 500_000


def speed_over_plan(
    robot: Robot, motion: PolynomialMotion, of: str, limit: float | None
) -> PlanSpeed:
    """
    Return bounds of the largest speed of a point over a motion, and the verdict on the limit.

    Parameters
    ----------
    robot, motion
        The arm and its motion.
    of
        The point: `tool`, the number of a frame, or a joint. The name of a joint means a point on
        the joint's axis: the point from which the DH parameter d of the joint is measured.
    limit
        Largest allowed speed, m/s; None without a limit.

    Raises
    ------
    PlanError
        The point is unknown.
    """
    chain = chain_to(robot, of)
    if chain is None or len(chain.table.joint) == 0:
        return speed_between(of, 0.0, 0.0, moment_at(motion, 0, 0.0), limit)
    allowed = math.inf if limit is None else limit * (1.0 + LIMIT_TOLERANCE)

    def enough(seen: float) -> float:
        good = seen * (1.0 + RELATIVE_TOLERANCE) + ABSOLUTE_TOLERANCE
        if seen > allowed:
            return good
        # No speed above the limit was found so far. Halve time intervals of the plan until two
        # conditions hold: the lower and the upper bound of the largest speed are nearly equal, and
        # the upper bound is at most the limit. The second condition proves that the speed keeps
        # within the limit.
        return min(good, max(allowed, seen + ABSOLUTE_TOLERANCE))

    seen, bound, *_ = bracketed(motion, _Speeds(chain, motion).bounded, enough, MAX_PIECES)
    moment = moment_at(motion, seen.segment, seen.s)
    return speed_between(of, seen.value, max(bound.value, seen.value), moment, limit)


def speed_between(
    of: str, lower: float, upper: float, moment: PlanMoment, limit: float | None
) -> PlanSpeed:
    """
    Return the bounds (m/s) of a point's largest speed as a `PlanSpeed`, with the verdict on the
    speed limit. `lower` is the speed at `moment`.
    """
    # A speed counts as within the limit if it exceeds the limit by at most the ratio
    # LIMIT_TOLERANCE, because so small an excess is round-off.
    allowed = math.inf if limit is None else limit * (1.0 + LIMIT_TOLERANCE)
    verdict = None if limit is None else verdict_of(lower, upper, allowed)
    return PlanSpeed(of, lower, upper, moment, limit, verdict)


def chain_to(robot: Robot, of: str) -> Chain | None:
    """
    Return the kinematic chain from the base to a point of the arm; None if the point does not
    move.

    Raises
    ------
    PlanError
        The point is unknown.
    """
    if of == TOOL:
        return robot.chain
    if of.isdecimal() and int(of) <= robot.rows:
        chain = robot.point(int(of)).chain
        return chain if chain.entries else None
    # If the arm has closed loops, a joint's name is not accepted as a point. The table of the main
    # chain does not have the axes of joints in the other branches of a loop.
    joints = () if robot.chain.loops else robot.joint_names
    if of in joints:
        table = robot.chain.table
        entry = int(np.argmax(table.joint == joints.index(of)))
        element = int(np.searchsorted(table.first_entry, entry, side='right')) - 1
        return _shortened(robot, element - 1, table.before[element])
    frames = f'of a frame (0 to {robot.rows})'
    give = f'with closed loops give {TOOL} or the number {frames}'
    if joints:
        give = f'give {TOOL}, the number {frames}, or a joint ({", ".join(joints)})'
    message = f'{robot.name} has no point {of!r}; {give}'
    accepted = (TOOL, f'a frame from 0 to {robot.rows}', *joints)
    raise PlanError(message, 'speed_of', accepted, of, code='unknown-name')


def _shortened(robot: Robot, last: int, offset: Floats) -> Chain | None:
    # Returns the chain of the elements up to number `last`, with the tool at the pose `offset` in
    # the frame of element `last`. Returns None if `last` is negative, because then the tool does
    # not move.
    if last < 0:
        return None
    table = robot.chain.table
    entries = int(table.first_entry[last + 1])
    return Chain(
        table._replace(
            before=np.concatenate([table.before[: last + 1], offset[None]]),
            theta_0=table.theta_0[: last + 1].copy(),
            d_0=table.d_0[: last + 1].copy(),
            first_entry=table.first_entry[: last + 2].copy(),
            joint=table.joint[:entries].copy(),
            by_theta=table.by_theta[:entries].copy(),
            by_d=table.by_d[:entries].copy(),
            frame_parent=table.frame_parent[:1].copy(),
            frame_offset=table.frame_offset[:1].copy(),
        )
    )


class _Speeds:
    """The speed of a chain's tool along a motion, with upper bounds in intervals of time."""

    def __init__(self, chain: Chain, motion: PolynomialMotion) -> None:
        self._motion = motion
        self._chain = chain
        table = chain.table
        element = np.repeat(np.arange(chain.elements), np.diff(table.first_entry))
        # For each joint and each element of the chain: rotation (rad) and translation (m) of the
        # element if the joint moves by 1 rad or 1 m.
        self._by_theta = np.zeros((chain.dof, chain.elements))
        self._by_d = np.zeros((chain.dof, chain.elements))
        np.add.at(self._by_theta, (table.joint, element), table.by_theta)
        np.add.at(self._by_d, (table.joint, element), table.by_d)

    def bounded(self, pieces: Pieces) -> Bounded:
        """
        Return the speed of the tool at the middle of each piece (an interval of time), and an
        upper bound of the speed in each piece, m/s.
        """
        taylor, T = self._motion.taylor(pieces), self._motion.seconds(pieces.segment)
        v, a = self._velocity(taylor, T)
        seconds = pieces.half * T
        swing = a * seconds[:, None]
        # Let v and a be the velocity and the acceleration at the middle of a piece. At time t
        # after the middle, the velocity is v + a t to first order. The norm of v + a t is convex
        # in t, so the norm is largest at an end of the piece. Evaluate the norm at both ends.
        ends = np.maximum(np.linalg.norm(v + swing, axis=1), np.linalg.norm(v - swing, axis=1))
        upper = ends + 0.5 * self._third(taylor, pieces.half, T) * seconds**2
        upper = np.where(np.isnan(upper), np.inf, upper)
        return Bounded(np.linalg.norm(v, axis=1), upper, pieces.half == 0.0)

    def _velocity(self, taylor: Floats, T: Floats) -> tuple[Floats, Floats]:
        # Returns the linear velocity and acceleration (N, 3) of the chain's tool at the middles of
        # N time intervals. Let e and f be entries of the chain (joints that move an axis), counted
        # from base to tool. The Jacobian column of entry f has the linear part v_f (3,) and the
        # angular part w_f (3,). If e <= f, dv_f/dq_e = w_e x v_f. The acceleration follows from
        # these derivatives.
        chain, E = self._chain, self._chain.entries
        q, rates, accelerations = (derivative(taylor, order, T) for order in (0, 1, 2))
        rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
        kernel.evaluate(chain, q, rates, kernel.JACOBIAN, rows)
        screws = rows[:, chain.screws_at : chain.screws_at + 6 * E].reshape(-1, 6, E)
        v, w = np.moveaxis(screws[:, :3], 1, 2), np.moveaxis(screws[:, 3:], 1, 2)
        rate = rates[:, chain.table.joint][:, :, None]
        moved, turned = v * rate, w * rate
        before = np.cumsum(turned, axis=1) - turned
        acceleration = v * accelerations[:, chain.table.joint][:, :, None]
        acceleration += np.cross(2.0 * before + turned, moved)
        return np.sum(moved, axis=1), np.sum(acceleration, axis=1)

    def _third(self, taylor: Floats, half: Floats, T: Floats) -> Floats:
        # Returns bounds (N,) of the third time derivative of the tool's position in N time
        # intervals. The position is a sum of vectors from one element of the chain (a moving axis)
        # to the next.
        # Let R be the product of the rotations of elements 0 to k. R turns the vector that begins
        # at element k. Let s, a and j be sums over elements 0 to k: the sums of the absolute
        # first, second and third time derivatives of the rotation angles. Then the norms of the
        # first three time derivatives of R are at most s, s^2 + a and s^3 + 3 s a + j.
        table = self._chain.table
        turns, slides = taylor @ self._by_theta, taylor @ self._by_d
        s, a, j = (np.cumsum(_bound(turns, order, half, T), axis=1) for order in (1, 2, 3))
        # For each of N time intervals, bound the distance from the origin of each element of the
        # chain (a moving axis) to the origin of the next element. The distance changes only if the
        # next element slides along its axis.
        moves, axes = table.before[1:, :, 3], table.before[1:-1, :, 2]
        stroke = table.d_0[1:] + slides[:, 0, 1:]
        lengths = np.linalg.norm(moves[:-1] + axes * stroke[:, :, None], axis=2)
        lengths += _bound(slides, 0, half, T)[:, 1:] - np.abs(slides[:, 0, 1:])
        last = np.full((len(taylor), 1), np.linalg.norm(moves[-1]))
        far = np.concatenate([lengths, last], axis=1)
        d1, d2, d3 = (_bound(slides, order, half, T) for order in (1, 2, 3))
        bound = np.sum(far * (s**3 + 3.0 * s * a + j), axis=1) + np.sum(d3, axis=1)
        bound += 3.0 * np.sum(d1[:, 1:] * (s**2 + a)[:, :-1], axis=1)
        return np.asarray(bound + 3.0 * np.sum(d2[:, 1:] * s[:, :-1], axis=1))


def _bound(taylor: Floats, order: int, half: Floats, T: Floats) -> Floats:
    # Returns for each interval of time (piece) a bound of the absolute value of a function's time
    # derivative of order `order`. `taylor` has the function's Taylor coefficients about the middle
    # of each interval.
    bound = np.zeros_like(taylor[:, 0])
    for i in range(order, taylor.shape[1]):
        bound += math.perm(i, order) * np.abs(taylor[:, i]) * half[:, None] ** (i - order)
    return np.asarray(bound / T[:, None] ** order)
