"""
Inverse kinematics: candidates, each proved by forward kinematics, sorted by what they are.

"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import JointVectorError
from ..kernel import Floats
from ..kinematics import forward_kinematics
from ..robot import Robot
from .aim import Aim, aim_at, parts_of_error
from .families import Family, isolated_or_not, nearer
from .plan import ClosedForm, Plan, plan_for
from .redundant import redundant_family
from .representatives import representatives
from .result import IkFamily, IkResult, IkSolution, Method, NearestPose, Posture, Status
from .search import PROVED, Best, Found, distinct, refined, search, starts

# Starts, inside the limits, for the nearest pose.
NEAREST_STARTS = 64
# By their signs, as the kernel says them.
POSTURES = {
    (a - 1, b - 1, c - 1): Posture(shoulder, elbow, wrist)
    for a, shoulder in enumerate(('left', '', 'right'))
    for b, elbow in enumerate(('down', '', 'up'))
    for c, wrist in enumerate(('flip', '', 'no_flip'))
}


@dataclass(frozen=True, eq=False)
class _Task:
    robot: Robot
    aim: Aim
    plan: Plan
    near: Floats
    seed: int

    def random(self) -> np.random.Generator:
        return np.random.default_rng(self.seed)


def inverse_kinematics(
    robot: Robot,
    target: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    respect_limits: bool = True,
    rows: Sequence[str] | None = None,
    seed: int = 0,
) -> IkResult:
    """
    Return all joint positions that bring the tool to a target in the base frame.

    A target that cannot be reached is no error: the result is empty, says why, and carries the
    nearest pose found.

    Parameters
    ----------
    robot
        The arm.
    target : shape (4, 4) or (3,)
        Pose of the tool, or its position (m), in the base frame.
    near : shape (n,), rad or m
        Of positions that differ by full turns the nearest to this is returned, and the nearest
        solutions first; default: the middle of the limits, 0 where there are none.
    respect_limits
        Whether solutions outside the limits are left out.
    rows
        Which of x y z rx ry rz count (axes of the table's frame 0; rx ry rz: the rotation vector
        from pose to target); default: all of a pose, x y z of a position.
    seed
        Of the search, where there is no closed form: the same seed, the same answer.

    Raises
    ------
    TargetError
        The target is neither a pose nor a position, or not finite.
    JointVectorError
        `near` is not n finite numbers.

    """
    aim = aim_at(robot, target, rows)
    plan = plan_for(robot, aim.rows)
    task = _Task(robot, aim, plan, _near(robot, plan, near), seed)
    if plan.redundant:
        family, best = redundant_family(robot, aim, plan, task.near, task.random())
        alone = () if family is None else (family,)
        return _result(task, _nothing(robot), alone, 'search', best, respect_limits)
    method: Method = 'search' if plan.closed is None else 'closed form'
    best = Best(task.near, np.inf)
    if plan.closed is not None:
        found = _closed(task, plan.closed)
    else:
        found, best = search(robot, aim, plan, task.near, task.random())
    return _sorted(task, found, method, best, respect_limits)


def _sorted(
    task: _Task, found: Found, method: Method, best: Best, respect_limits: bool
) -> IkResult:
    robot, aim, plan = task.robot, task.aim, task.plan
    families: tuple[Family, ...] = ()
    isolated = found
    if len(found.q):
        isolated, families = isolated_or_not(robot, aim, plan, found)
    result = _result(task, isolated, families, method, best, respect_limits)
    nearest = result.nearest
    if nearest is None or nearest.residual >= PROVED or result.status == 'family':
        return result
    # The search for the nearest pose met the target inside the limits.
    q = np.concatenate([found.q, nearest.q[None]])
    more = Found(q, np.append(found.errors, nearest.residual))
    isolated, families = isolated_or_not(robot, aim, plan, more)
    return _result(task, isolated, families, 'search', best, respect_limits)


def _nothing(robot: Robot) -> Found:
    return Found(np.empty((0, robot.dof)), np.empty(0))


def _near(robot: Robot, plan: Plan, near: npt.ArrayLike | None) -> Floats:
    if near is None:
        return np.array(plan.middle)
    try:
        q = np.array(near, dtype=np.float64)
    except (TypeError, ValueError):
        raise JointVectorError(f'near must be {robot.dof} numbers') from None
    if q.shape != (robot.dof,) or not np.all(np.isfinite(q)):
        raise JointVectorError(
            f'near must be {robot.dof} finite numbers ({", ".join(robot.joint_names)}), '
            f'not {q.tolist()}'
        )
    return q


def _closed(task: _Task, closed: ClosedForm) -> Found:
    psi = np.empty((kernel.MOST_CANDIDATES, len(closed.table)))
    count = kernel.inverse_candidates(
        closed.way,
        closed.table,
        closed.point,
        closed.motion(task.aim.pose),
        closed.to_screws @ task.near,
        psi,
    )
    if not count:
        return _nothing(task.robot)
    q = psi[:count] @ closed.to_joints.T
    candidates = refined(task.robot, task.aim, task.plan, q)
    return distinct(task.robot, task.aim, task.plan, candidates)[0]


def _result(
    task: _Task,
    found: Found,
    families: tuple[Family, ...],
    method: Method,
    best: Best,
    respect_limits: bool,
) -> IkResult:
    solutions = _solutions(task, found)
    continua = tuple(_family(task, family) for family in families)
    inside = tuple(solution for solution in solutions if solution.feasible)
    status, reason = _status(task, solutions, inside, continua, method)
    wanted = inside if respect_limits else solutions
    nearest = None
    if not inside:
        nearest = _nearest(task, solutions, continua, best)
    if respect_limits:
        continua = tuple(family for family in continua if family.feasible)
    return IkResult(wanted, continua, status, reason, method, nearest)


def _status(
    task: _Task,
    solutions: tuple[IkSolution, ...],
    inside: tuple[IkSolution, ...],
    families: tuple[IkFamily, ...],
    method: Method,
) -> tuple[Status, str]:
    # A search that found nothing is no proof that there is nothing.
    searched = ' (by search, which proves nothing)' if method == 'search' else ''
    if inside:
        word = 'solution' if len(inside) == 1 else 'solutions'
        count = sum(family.feasible for family in families)
        more = f', and {count} continuous {"family" if count == 1 else "families"}'
        more = more if count else ''
        return 'solved', f'{len(inside)} {word} inside the limits{more}'
    if any(family.feasible for family in families):
        joints = ', '.join(dict.fromkeys(name for f in families for name in f.joints))
        return 'family', f'the target leaves joints free to move: {joints}'
    beyond: list[IkSolution | IkFamily] = [*solutions, *families]
    if beyond:
        names = ', '.join(dict.fromkeys(name for one in beyond for name in one.beyond))
        return 'outside_limits', f'reached only beyond the limits of {names}{searched}'
    return 'unreachable', (
        f'no joint positions bring the tool there ({" ".join(task.aim.rows)}){searched}'
    )


def _solutions(task: _Task, found: Found) -> tuple[IkSolution, ...]:
    if not len(found.q):
        return ()
    chosen = representatives(task.robot, task.plan, found.q, task.near)
    away = np.maximum.reduce(np.abs((chosen.q - task.near) / task.plan.scales), axis=1)
    postures = _postures(task, found.q)
    errors, margins = found.errors.tolist(), chosen.margin.tolist()
    feasible = (~np.logical_or.reduce(chosen.outside, axis=1)).tolist()
    return tuple(
        IkSolution(
            q=chosen.q[k],
            residual=errors[k],
            feasible=feasible[k],
            beyond=() if feasible[k] else _named(task.robot, chosen.outside[k]),
            margin=margins[k],
            posture=postures[k],
        )
        for k in away.argsort(kind='stable').tolist()
    )


def _named(robot: Robot, which: npt.NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(robot.joint_names[j] for j in np.flatnonzero(which))


def _family(task: _Task, family: Family) -> IkFamily:
    robot, plan = task.robot, task.plan
    if not plan.redundant:
        q = representatives(robot, plan, family.q[None], task.near).q[0]
        limits = np.array(robot.limits)
        inside = bool(np.all((q >= limits[:, 0]) & (q <= limits[:, 1])))
        if not inside:
            limits = np.full_like(limits, np.inf) * [-1.0, 1.0]
        family = nearer(robot, task.aim, plan, family._replace(q=q), task.near, limits)
    chosen = representatives(robot, plan, family.q[None], task.near)
    outside = chosen.outside[0]
    moving = np.any(np.abs(family.motions) > 1e-6, axis=0)
    return IkFamily(
        q=chosen.q[0].copy(),
        motions=family.motions.copy(),
        straight=family.straight,
        joints=_named(robot, moving),
        residual=family.error,
        feasible=not bool(np.any(outside)),
        beyond=_named(robot, outside),
        margin=float(chosen.margin[0]),
        posture=_postures(task, family.q[None])[0],
        scales=plan.scales.copy(),
        periods=plan.periods.copy(),
    )


def _postures(task: _Task, q: Floats) -> list[Posture]:
    closed = task.plan.closed
    if closed is None or not closed.has_postures:
        return [Posture()] * len(q)
    signs = np.zeros((len(q), 3), dtype=np.int64)
    kernel.postures(closed.way, closed.table, closed.point, q @ closed.to_screws.T, signs)
    return [POSTURES[a, b, c] for a, b, c in signs.tolist()]


def _nearest(
    task: _Task,
    solutions: tuple[IkSolution, ...],
    families: tuple[IkFamily, ...],
    best: Best,
) -> NearestPose:
    robot, aim, plan = task.robot, task.aim, task.plan
    good = next((family for family in families if family.feasible), None)
    if good is not None:
        return _nearest_pose(task, good.q, good.residual)
    q = starts(robot, plan, task.random(), NEAREST_STARTS)
    known = [*(one.q for one in solutions), *(one.q for one in families)]
    q = np.vstack([task.near, best.q, *known, q])
    q = np.clip(q, *robot.limits.T)
    arrived = refined(robot, aim, plan, q, True, plan.limits)
    k = int(np.argmin(arrived.errors))
    q = representatives(robot, plan, arrived.q[k][None], task.near).q[0]
    return _nearest_pose(task, q, float(arrived.errors[k]))


def _nearest_pose(task: _Task, q: Floats, error: float) -> NearestPose:
    linear, angular = parts_of_error(task.aim, forward_kinematics(task.robot, q))
    return NearestPose(q.copy(), error, linear, angular)
