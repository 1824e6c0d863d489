"""A plan checked between its points too: singular poses, limits, speeds."""

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....errors import JointVectorError, PlanError
from ....kernel import Floats
from ....kinematics.arguments import check_positive, number_or_nan, numbers_of, refused
from ....robot.measures import MEASURES
from ....robot.robot import AnyRobot, Robot, as_robot
from .closed_plan import ClosedPlan
from .extremes import largest
from .point_speed import TOOL, speed_over_plan
from .polynomials import PolynomialMotion, moment_at, polynomial_motion
from .singular_proof import singularity_of_plan
from .verdicts import JointExtreme, PlanCheck, PlanJoint

# As the estimator has it: a position beyond its limit by less is at the limit, rad or m; and as a
# share of velocity limits.
LIMIT_SLACK = 1e-6
DISTANCE = 'distance'


def threshold_of_distance(robot: Robot, which: Literal['warn', 'stop'] = 'stop') -> float:
    """Return a threshold of the distance, rad: the default where another measure is watched."""
    watched = robot.singularity.thresholds.measure == DISTANCE
    return float(getattr(robot.singularity.thresholds if watched else MEASURES[DISTANCE], which))


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
    Return what is proved of a plan between its points too, and what is refuted by a pose.

    Between two points the motion is that of joint_trajectory_controller: straight with positions
    alone, cubic with velocities, quintic with accelerations. It is no safety function: what a
    robot does is not looked at. Of an arm with closed loops limits and speeds of the joints are
    decided; all else is looked at where the plan is sampled, and refuted or not decided.

    Parameters
    ----------
    robot
        The arm.
    times : shape (N,), s
        Rising.
    q : shape (N, n), rad or m
        Joint positions at the points, in the order of the arm.
    qdot, qddot : shape (N, n)
        Joint velocities, rad/s or m/s, and accelerations, rad/s^2 or m/s^2, which count only with
        velocities.
    distance
        How near a singular pose the plan may not come, at most 1 rad; the default is the threshold
        `stop` of the distance.
    speed_limit
        The largest speed allowed of each point of `speed_of`, m/s.
    speed_of
        Points whose speed is looked at besides the tool's: frames by their number as
        `link_frames` has them, or joints, for the point of their axis where their row begins.

    Raises
    ------
    PlanError
        The times do not rise, a number means nothing, there is no such point, or the motion
        between the points is larger than the kernel takes.
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
        raise refused('q', f'numbers, shape ({len(at)}, {robot.dof})', q, JointVectorError)
    if not isinstance(speed_of, Iterable):
        raise refused('speed_of', 'names of points', speed_of, PlanError)
    asked = threshold_of_distance(robot) if distance is None else _threshold(distance)
    limit = speed_limit
    if limit is not None:
        check_positive(PlanError, 'speed_limit', limit)
    motion = polynomial_motion(at, given[0], given[1], given[2])
    points = dict.fromkeys([TOOL, *map(str, speed_of)])
    with np.errstate(over='ignore', invalid='ignore'):  # what is too large is refused
        joints = tuple(_joint(robot, motion, j) for j in range(robot.dof))
        if robot.chain.loops:
            plan = ClosedPlan(robot, motion)
            speeds = tuple(plan.speed(of, limit) for of in points)
            return PlanCheck(plan.singularity(asked), joints, speeds, plan.closure())
        return PlanCheck(
            singularity_of_plan(robot, motion, asked),
            joints,
            tuple(speed_over_plan(robot, motion, of, limit) for of in points),
        )


def _times(times: npt.ArrayLike) -> Floats:
    try:
        at = np.array(times, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        at = np.full(1, np.nan)
    if at.ndim != 1 or not len(at) or not np.all(np.isfinite(at)) or np.any(np.diff(at) <= 0.0):
        raise PlanError(
            'times must be finite numbers that rise, one for each point',
            'times',
            ['(N,)'],
            at.shape,
        )
    return at


def _table(robot: Robot, table: npt.ArrayLike | None, name: str, count: int) -> Floats | None:
    if table is None:
        return None
    expected = (count, robot.dof)
    rows = numbers_of(name, table, JointVectorError, [expected])
    if rows.shape != expected:
        raise JointVectorError(
            f'{name} has shape {rows.shape}; of {count} points and the joints of {robot.name} '
            f'({", ".join(robot.joint_names)}) it must be {expected}',
            name,
            [expected],
            rows.shape,
        )
    bad = np.flatnonzero(~np.all(np.isfinite(rows), axis=1))
    if len(bad):
        raise JointVectorError(
            f'{name} must be finite: point {bad[0]} is {rows[bad[0]].tolist()}',
            name,
            [expected],
            rows.shape,
            int(bad[0]),
        )
    return rows


def _threshold(distance: float) -> float:
    if refusal := MEASURES[DISTANCE].refusal(number_or_nan(distance)):
        raise PlanError(f'distance {refusal}', 'distance', ['above 0, at most 1 rad'], distance)
    return float(distance)


def _joint(robot: Robot, motion: PolynomialMotion, j: int) -> PlanJoint:
    q = motion.coefficients[:, :, j]
    powers = np.arange(1, q.shape[1])
    rate = q[:, 1:] * powers / motion.seconds(np.arange(len(q)))[:, None]
    if not len(powers):
        rate = np.zeros((len(q), 1))
    least, greatest = _extreme(motion, -q, -1.0), _extreme(motion, q, 1.0)
    fastest = max(
        _extreme(motion, rate, 1.0), _extreme(motion, -rate, 1.0), key=lambda one: one.value
    )
    for extreme in (least, greatest, fastest):
        if not abs(extreme.value) <= kernel.LARGEST:
            raise PlanError(
                f'between its points {robot.joint_names[j]} moves too far or too fast to be '
                'judged',
                'q',
                [f'at most {kernel.LARGEST:g}'],
                extreme.value,
            )
    low, high = robot.limits[j]
    inside = least.value >= low - LIMIT_SLACK and greatest.value <= high + LIMIT_SLACK
    slow = fastest.value <= robot.velocity_limits[j] * (1.0 + LIMIT_SLACK)
    return PlanJoint(
        robot.joint_names[j],
        least,
        greatest,
        fastest,
        'proved' if inside else 'refuted',
        'proved' if slow else 'refuted',
    )


def _extreme(motion: PolynomialMotion, coefficients: Floats, sign: float) -> JointExtreme:
    found = largest(coefficients)
    return JointExtreme(sign * found.value, moment_at(motion, found.segment, found.s))
