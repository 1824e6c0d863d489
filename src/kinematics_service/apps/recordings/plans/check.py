# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Check a plan at its points and between them: singular poses, joint limits, speeds."""

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....errors import JointVectorError, PlanError
from ....estimation.joint_memory import LIMIT_TOLERANCE
from ....kernel import Floats
from ....kinematics.arguments import check_positive, number_or_nan, numbers_of
from ....robot.measures import MEASURES
from ....robot.robot import AnyRobot, Robot, as_robot
from .bisection import Bounded, bracketed
from .closed_plan import ClosedPlan
from .point_speed import MAX_PIECES, TOOL, speed_over_plan
from .polynomials import Pieces, PolynomialMotion, moment_at, polynomial_motion
from .singular_proof import singularity_of_plan
from .verdicts import JointExtreme, PlanCheck, PlanJoint, PlanVerdict

# Tolerance of three values of each joint over a plan: largest position, least position, and
# largest speed. The tolerance is absolute (rad, m, rad/s, m/s) for values up to 1, and relative
# for larger values.
EXTREME_TOLERANCE = 1e-12
DISTANCE = 'distance'


def threshold_of_distance(robot: Robot, level: Literal['warn', 'stop'] = 'stop') -> float:
    """
    Return the threshold `warn` or `stop` of the distance to singular poses, rad. Return the
    default if the robot file has thresholds of another measure.
    """
    watched = robot.singularity.thresholds.measure == DISTANCE
    return float(getattr(robot.singularity.thresholds if watched else MEASURES[DISTANCE], level))


def check_plan(
    robot: AnyRobot,
    times: npt.ArrayLike,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike | None = None,
    qddot: npt.ArrayLike | None = None,
    distance: float | None = None,
    speed_limit: float | None = None,
    speed_of: Sequence[str] = (),
) -> PlanCheck:
    """
    Check a plan: return which claims about the plan are proved, refuted, or not decided.

    Between two points the motion is that of joint_trajectory_controller, a polynomial of time: it
    is linear if the points have only positions, cubic if they also have velocities, and quintic if
    they also have accelerations. The check is not a safety function, because it sees the plan and
    not the robot. If the arm has closed loops, only limits and speeds of the joints are proved or
    refuted. Other claims are sampled: they are refuted or not decided.

    Parameters
    ----------
    robot
        The arm.
    times : shape (N,), s
        Times of the points, which must rise.
    q : shape (N, n), rad or m
        Joint positions at the points, in the order of the arm.
    qdot, qddot : shape (N, n)
        Joint velocities, rad/s or m/s, and accelerations, rad/s^2 or m/s^2. Accelerations need
        velocities.
    distance
        The least allowed distance to a singular pose, rad, at most 1; the default is the threshold
        `stop` of the distance.
    speed_limit
        The largest allowed speed of the tool and of each point of `speed_of`, m/s.
    speed_of
        Further points whose speed is bounded, besides the tool: frames by their number in
        `link_frames`, or joints. The name of a joint means a point on the joint's axis: the point
        from which the DH parameter d of the joint is measured.

    Raises
    ------
    PlanError
        The times do not rise, a threshold or a point is unknown, or positions or speeds between
        the points exceed the largest number that the kernel accepts.
    JointVectorError
        The numbers of the points are of the wrong shape, or not finite.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> check = ks.check_plan(robot, [0.0, 2.0], [[0.1, 0.5], [0.6, 1.5]], speed_limit=2.0)
    >>> check.verdict, check.singularity.verdict
    ('proved', 'proved')
    >>> ks.check_plan(robot, [0.0, 2.0], [[0.1, 0.5], [0.6, -0.5]]).singularity.verdict
    'refuted'
    """
    robot = as_robot(robot)
    at = _times(times)
    given = [
        _table(robot, table, name, len(at))
        for name, table in (('q', q), ('qdot', qdot), ('qddot', qddot))
    ]
    if given[0] is None:
        raise JointVectorError.refused('q', f'numbers, shape ({len(at)}, {robot.dof})', q)
    if not isinstance(speed_of, Iterable):
        raise PlanError.refused('speed_of', 'names of points', speed_of)
    threshold = threshold_of_distance(robot) if distance is None else _threshold(distance)
    if speed_limit is not None:
        check_positive(PlanError, 'speed_limit', speed_limit)
    motion = polynomial_motion(at, given[0], given[1], given[2])
    points = dict.fromkeys([TOOL, *map(str, speed_of)])
    # numpy must not warn of overflows here: `_extreme` raises an error
    with np.errstate(over='ignore', invalid='ignore'):
        joints = tuple(_joint(robot, motion, j) for j in range(robot.dof))
        if robot.chain.loops:
            plan = ClosedPlan(robot, motion, threshold)
            speeds = tuple(plan.speed(of, speed_limit) for of in points)
            return PlanCheck(plan.singularity(), joints, speeds, plan.closure())
        return PlanCheck(
            singularity_of_plan(robot, motion, threshold),
            joints,
            tuple(speed_over_plan(robot, motion, of, speed_limit) for of in points),
        )


def _times(times: npt.ArrayLike) -> Floats:
    try:
        at = np.array(times, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        at = np.full(1, np.nan)
    code = ''
    if at.ndim != 1 or not len(at):
        code = 'wrong-shape'
    elif not np.all(np.isfinite(at)):
        code = 'not-finite'
    elif np.any(np.diff(at) <= 0.0):
        code = 'wrong-order'
    if code:
        message = 'times must be finite numbers that rise, one for each point'
        raise PlanError(message, 'times', ['(N,)'], at.shape, code=code)
    return at


def _table(robot: Robot, table: npt.ArrayLike | None, name: str, count: int) -> Floats | None:
    if table is None:
        return None
    expected = (count, robot.dof)
    rows = numbers_of(name, table, JointVectorError, [expected])
    if rows.shape != expected:
        joints = f'{robot.name} ({", ".join(robot.joint_names)})'
        accepted = f'of {count} points and the joints of {joints} it must be {expected}'
        message = f'{name} has shape {rows.shape}; {accepted}'
        raise JointVectorError(message, name, [expected], rows.shape, code='wrong-shape')
    bad = np.flatnonzero(~np.all(np.isfinite(rows), axis=1))
    if len(bad):
        message = f'{name} must be finite: point {bad[0]} is {rows[bad[0]].tolist()}'
        error = JointVectorError(message, name, [expected], rows.shape, code='not-finite')
        error.row = int(bad[0])
        raise error
    return rows


def _threshold(distance: float) -> float:
    if refusal := MEASURES[DISTANCE].refusal(number_or_nan(distance)):
        accepted = ['above 0, at most 1 rad']
        raise PlanError(f'distance {refusal}', 'distance', accepted, distance, code='out-of-range')
    return float(distance)


def _joint(robot: Robot, motion: PolynomialMotion, j: int) -> PlanJoint:
    q = motion.coefficients[:, :, j]
    rate = q[:, 1:] * np.arange(1, q.shape[1]) / motion.seconds(np.arange(len(q)))[:, None]
    if not rate.shape[1]:
        rate = np.zeros((len(q), 1))
    name = robot.joint_names[j]
    least = _extreme(motion, q, np.negative, name)
    least = least._replace(value=-least.value)
    greatest = _extreme(motion, q, np.positive, name)
    fastest = _extreme(motion, rate, np.abs, name)
    low, high = robot.limits[j]
    inside = least.value >= low - LIMIT_TOLERANCE and greatest.value <= high + LIMIT_TOLERANCE
    slow = fastest.value <= robot.velocity_limits[j] * (1.0 + LIMIT_TOLERANCE)
    limits: PlanVerdict = 'proved' if inside else 'refuted'
    speed: PlanVerdict = 'proved' if slow else 'refuted'
    return PlanJoint(name, least, greatest, fastest, limits, speed)


def _extreme(
    motion: PolynomialMotion, coefficients: Floats, measure: np.ufunc, name: str
) -> JointExtreme:
    # Let x be the position or the velocity of one joint. In each of the S segments of the plan, x
    # is a polynomial with one row of `coefficients` (S, degree + 1). Returns the largest value of
    # measure(x) over the plan, and when it occurs. `measure` is a function such as abs.
    polynomials = motion._replace(coefficients=coefficients[:, :, None])

    def bounded(pieces: Pieces) -> Bounded:
        taylor = polynomials.taylor(pieces)[:, :, 0]
        value = measure(taylor[:, 0])
        powers = pieces.half[:, None] ** np.arange(1, taylor.shape[1])
        upper = value + np.sum(np.abs(taylor[:, 1:]) * powers, axis=1)
        return Bounded(value, upper, pieces.half == 0.0)

    def enough(seen: float) -> float:
        return seen + EXTREME_TOLERANCE * max(1.0, abs(seen))

    seen, bound, *_ = bracketed(motion, bounded, enough, MAX_PIECES)
    if not bound.value <= kernel.LARGEST:
        message = f'between its points {name} moves too far or too fast to be judged'
        accepted = f'at most {kernel.LARGEST:g}'
        raise PlanError(message, 'q', [accepted], bound.value, code='too-large')
    return JointExtreme(seen.value, moment_at(motion, seen.segment, seen.s))
