# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Build the result of inverse kinematics: solutions, families of solutions, status, and the nearest
pose.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...robot.clearance_bounds import Reach
from ...robot.robot import Robot
from ...robot.task import ROW_NAMES
from .closed_forms import NO_POSTURE, POSTURES
from .families import SolutionFamily, isolated_or_not, nearer
from .multiple import with_multiplicities
from .problem.plan import InversePlan
from .problem.problem import IkProblem
from .problem.target import IkTarget
from .result import Complete, IkFamily, IkResult, IkSolution, Method, NearestPose, Posture, Status
from .search import DistinctSolutions, refined, starts

# Number of random starts, inside the limits, of the search for the pose nearest to an unreachable
# target.
NEAREST_STARTS = 64
# The tangent of a family of solutions is a joint motion of norm 1. If a joint's component of the
# tangent exceeds this (rad), the result lists the joint as moving along the family.
MIN_MOTION = 1e-6
LEFT_FREE = 'the target leaves joints free to move: '


def answer(
    problem: IkProblem,
    solutions: DistinctSolutions,
    method: Method,
    roots: tuple[int, int] | None = None,
    best: Floats | None = None,
) -> IkResult:
    """
    Return the result of inverse kinematics for proved `solutions`. Some of them may belong to
    families of solutions.
    """
    result = _result_of_solutions(problem, solutions, method, roots, best)
    nearest = result.nearest
    if nearest is None or result.status == 'family':
        return result
    if not problem.target.is_reached_at(nearest.q, nearest.residual):
        return result
    # The search for the nearest pose has found a solution inside the limits that is not in
    # `solutions`, so add it to the result.
    more = DistinctSolutions(nearest.q[None], np.array([nearest.residual]))
    return _result_of_solutions(problem, solutions.joined(more), 'search', None, best)


def _result_of_solutions(
    problem: IkProblem,
    solutions: DistinctSolutions,
    method: Method,
    roots: tuple[int, int] | None,
    best: Floats | None,
) -> IkResult:
    families: tuple[SolutionFamily, ...] = ()
    if len(solutions.q):
        solutions, singular, families = isolated_or_not(problem, solutions)
        solutions = with_multiplicities(problem, solutions, singular)
    return result_of(problem, solutions, families, method, roots, best)


def result_of(
    problem: IkProblem,
    isolated: DistinctSolutions,
    families: tuple[SolutionFamily, ...],
    method: Method,
    roots: tuple[int, int] | None = None,
    best: Floats | None = None,
    curves: tuple[IkFamily, ...] = (),
) -> IkResult:
    """
    Return the result of inverse kinematics for isolated solutions, families of solutions, and
    traced curves.

    `best` (n,) are joint positions from which the search for the nearest pose also starts.
    """
    solutions = _solutions(problem, isolated)
    near = (_moved_near(problem, family) for family in families)
    continua = (*(family_of(problem, family) for family in near), *curves)
    inside = tuple(solution for solution in solutions if solution.feasible)
    status, reason = _status(problem, solutions, inside, continua, method)
    nearest = None if inside else _nearest(problem, (*solutions, *continua), continua, best)
    if problem.respect_limits:
        solutions, continua = inside, tuple(family for family in continua if family.feasible)
    # A result with families is not proved complete, because the solver finds only some postures of
    # a family.
    complete: Complete = 'found' if method == 'search' or families else 'proved'
    return IkResult(solutions, continua, status, reason, method, nearest, complete, roots)


def beyond(target: IkTarget, robot: Robot, reach: Reach) -> str:
    """
    Return an error sentence if the target is farther from the first joint than the arm can reach,
    otherwise ''.
    """
    offset = robot.singularity.task.rotation.T @ (target.pose[:3, 3] - reach.centre)
    counted = [offset[k] for k in range(3) if ROW_NAMES[k] in target.rows]
    away = math.hypot(*counted)
    # In a solution, the tool may be up to `target.proved` (m) away from the target. So add this
    # distance to the reach.
    if not away > reach.radius + target.proved:
        return ''
    return (
        f'no joint positions bring the tool there ({target.words}): the target is {away:.4g} m '
        f'from the first joint, and the arm is {reach.radius:.4g} m long'
    )


def inside_limits(solutions: int, families: int) -> str:
    """
    Return the `reason` of a solved result: a sentence with the number of solutions and the number
    of families.
    """
    sentence = f'{solutions} {"solution" if solutions == 1 else "solutions"} inside the limits'
    if families:
        sentence += f', and {families} continuous {"family" if families == 1 else "families"}'
    return sentence


def not_exact(target: IkTarget, worst: float) -> str:
    """
    Return a text with the distance of the tool from the target in the solutions; empty if the
    solutions are exact.

    `worst` is the largest residual of the solutions, m.
    """
    if worst < target.exact:
        return ''
    return f'; the target is met to {worst:.1e} m, within the tolerance'


def _status(
    problem: IkProblem,
    solutions: tuple[IkSolution, ...],
    inside: tuple[IkSolution, ...],
    families: tuple[IkFamily, ...],
    method: Method,
) -> tuple[Status, str]:
    # If a search has found no solution, the reason also says that this proves nothing.
    searched = ' (by search, which proves nothing)' if method == 'search' else ''
    target = problem.target
    if inside:
        feasible = sum(family.feasible for family in families)
        worst = max(solution.residual for solution in inside)
        return 'solved', inside_limits(len(inside), feasible) + not_exact(target, worst)
    if any(family.feasible for family in families):
        joints = ', '.join(dict.fromkeys(name for f in families for name in f.joints))
        worst = max(f.residual for f in families)
        return 'family', LEFT_FREE + joints + not_exact(target, worst)
    beyond: list[IkSolution | IkFamily] = [*solutions, *families]
    if beyond:
        names = ', '.join(dict.fromkeys(name for solution in beyond for name in solution.beyond))
        verb = 'found' if searched else 'reached'
        return 'outside_limits', f'{verb} only beyond the limits of {names}{searched}'
    return 'unreachable', (f'no joint positions bring the tool there ({target.words}){searched}')


def _solutions(problem: IkProblem, isolated: DistinctSolutions) -> tuple[IkSolution, ...]:
    if not len(isolated.q):
        return ()
    chosen = representatives(problem.plan, isolated.q, problem.near)
    away = np.linalg.norm((chosen.q - problem.near) / problem.plan.scales, axis=1)
    postures = _postures(problem, isolated.q)
    errors, margins = isolated.errors.tolist(), chosen.margin.tolist()
    feasible = (~np.logical_or.reduce(chosen.outside, axis=1)).tolist()
    return tuple(
        IkSolution(
            q=chosen.q[k],
            residual=errors[k],
            feasible=feasible[k],
            beyond=() if feasible[k] else _named(problem.robot, chosen.outside[k]),
            margin=margins[k],
            posture=postures[k],
            multiplicity=isolated.multiplicities[k] if isolated.multiplicities else 1,
            exact=errors[k] < problem.target.exact,
        )
        for k in away.argsort(kind='stable').tolist()
    )


def _named(robot: Robot, mask: npt.NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(robot.joint_names[j] for j in np.flatnonzero(mask))


def family_of(problem: IkProblem, family: SolutionFamily, moved: Floats | None = None) -> IkFamily:
    """
    Return a family of solutions as `IkFamily`. Its `q` is the posture `family.q`, plus the full
    turns that bring the posture nearest to `problem.near`.

    `moved` (k, n) are joint motions along the family, by default `family.motions`. They determine
    which joints are named as moving.
    """
    plan = problem.plan
    chosen = representatives(plan, family.q[None], problem.near)
    outside = chosen.outside[0]
    moves = np.any(np.abs(family.motions if moved is None else moved) > MIN_MOTION, axis=0)
    return IkFamily(
        q=chosen.q[0].copy(),
        motions=family.motions.copy(),
        straight=family.straight,
        joints=_named(problem.robot, moves),
        residual=family.error,
        feasible=not bool(np.any(outside)),
        beyond=_named(problem.robot, outside),
        margin=float(chosen.margin[0]),
        posture=_postures(problem, family.q[None])[0],
        scales=plan.scales.copy(),
        periods=plan.periods.copy(),
    )


def _moved_near(problem: IkProblem, family: SolutionFamily) -> SolutionFamily:
    # Returns the family, with its stored posture `q` replaced by a posture nearer to
    # `problem.near`.
    plan = problem.plan
    if plan.redundant:
        return family
    q = representatives(plan, family.q[None], problem.near).q[0]
    inside = np.all((q >= plan.limits[:, 0]) & (q <= plan.limits[:, 1]))
    return nearer(problem, family._replace(q=q), plan.limits if inside else plan.unlimited)


def _postures(problem: IkProblem, q: Floats) -> list[Posture]:
    closed = problem.plan.closed
    if closed is None:
        return [NO_POSTURE] * len(q)
    signs = np.zeros((len(q), 3), dtype=np.int64)
    kernel.postures(closed, np.ascontiguousarray(q), signs)
    return [POSTURES[13 + 9 * a + 3 * b + c] for a, b, c in signs.tolist()]


def _nearest(
    problem: IkProblem,
    known: tuple[IkSolution | IkFamily, ...],
    families: tuple[IkFamily, ...],
    best: Floats | None,
) -> NearestPose:
    robot, target, plan = problem.robot, problem.target, problem.plan
    good = next((family for family in families if family.feasible), None)
    if good is not None:
        return nearest_pose(problem, good.q, good.residual)
    q = starts(robot, plan, problem.random(), NEAREST_STARTS)
    best = problem.near if best is None else best
    q = np.clip(np.vstack([problem.near, best, *(item.q for item in known), q]), *robot.limits.T)
    arrived = refined(target, plan, q, True, plan.limits)
    k = int(np.argmin(arrived.errors))
    q = representatives(plan, arrived.q[k][None], problem.near).q[0]
    return nearest_pose(problem, q, float(arrived.errors[k]))


def nearest_pose(problem: IkProblem, q: Floats, error: float) -> NearestPose:
    """
    Return a `NearestPose` with joint positions q (n,) and the errors of the tool's position and
    rotation at q.
    """
    linear, angular = kernel.parts_of_error(problem.target.residual, np.array(q))
    return NearestPose(q.copy(), error, linear, angular)


class Representatives(NamedTuple):
    """
    Solutions to which full turns were added. The turns bring the joints inside the limits and near
    to the preferred joint positions `near`.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Joint positions, inside the limits if possible. If several choices of full turns bring a
        joint inside its limits, the choice nearest to `near` is used.
    outside : shape (m, n)
        Whether each joint is beyond its limits.
    margin : shape (m,)
        For each row of `q`, the smallest distance of a joint from its limits, rad or m; negative
        if a joint is beyond a limit.
    """

    q: Floats
    outside: npt.NDArray[np.bool_]
    margin: Floats


def representatives(plan: InversePlan, q: Floats, near: Floats) -> Representatives:
    """
    Return joint positions q (m, n) plus full turns, so that the results are inside the limits if
    possible, and nearest to `near` (n,).
    """
    q = np.array(q, dtype=np.float64, order='C')
    kernel.representatives(plan.joints, near, q)
    room = np.minimum(q - plan.limits[:, 0], plan.limits[:, 1] - q)
    return Representatives(q, room < -kernel.AT_LIMIT, room.min(axis=1))
