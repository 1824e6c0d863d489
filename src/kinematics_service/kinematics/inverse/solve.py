# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve inverse kinematics of an arm by a closed form, by elimination, or by search.

Forward kinematics checks each candidate solution. Solutions are isolated, or belong to families
(continua).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...rigid_motion import exponential
from ...robot.robot import AnyRobot, Robot, as_robot
from ...robot.task import ROW_NAMES
from ..arguments import seed_of
from ..forward import forward_kinematics
from .answer import (
    LEFT_FREE,
    answer,
    beyond,
    family_of,
    inside_limits,
    nearest_pose,
    not_exact,
    result_of,
)
from .closed_forms import (
    closed_solutions,
    closed_solutions_of_each,
    room_for,
    solutions_of,
)
from .elimination import (
    Eliminated,
    completed_solutions,
    eliminated_solutions,
    solutions_beside,
)
from .families import SUSPECT_PIVOT_RATIO, SolutionFamily, isolated_or_not, tangent
from .multiple import with_multiplicities
from .problem.plan import as_six, elimination_of, plan_for
from .problem.problem import IkProblem, near_or_middle
from .problem.target import ik_target_of, poses_of
from .redundant import into_limits, redundant_result
from .result import Complete, IkResult, Method
from .search import (
    DistinctSolutions,
    distinct,
    no_solutions,
    reached,
    refined,
    refinement,
    search,
    starts,
)

# Default tolerance of the tool's error at a target, m and rad. It is 1e-6, because targets that
# people type have about seven digits.
TOLERANCE = 1e-6
# Number of random starts in the search for a single solution of inverse kinematics. If none of the
# starts leads to a solution, all solutions are searched.
STARTS = 256
# Refinement moves a candidate to a solution if their joint positions differ by at most this, rad
# (see kernel/inverse/solving.py).
CANDIDATE_ERROR = 1e-2
# Methods that are tried for an arm of five joints, in this order.
FIVE_JOINTS: tuple[Method, ...] = ('closed form', 'algebraic')


def inverse_kinematics(
    robot: AnyRobot,
    target: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    respect_limits: bool = True,
    rows: Sequence[str] | None = None,
    seed: int = 0,
    all_solutions: bool = True,
    axis: str | None = None,
    tolerance: float = TOLERANCE,
    curves: bool = True,
) -> IkResult:
    """
    Return all joint positions that bring the tool to a target in the base frame.

    A target out of reach is not an error: the result is empty, with the reason and the nearest
    pose found.

    Parameters
    ----------
    robot
        The arm.
    target : shape (4, 4) or (3,)
        Pose of the tool, or its position (m), in the base frame.
    near : shape (n,), rad or m
        Preferred joint positions. The solutions are sorted by their distance from `near` (root of
        the sum of squares, prismatic motions divided by the characteristic length). To each joint
        of a solution, full turns are added that bring it nearest to `near`. Default: the middle of
        the limits, 0 without limits.
    respect_limits
        Whether to leave out solutions outside the limits.
    rows
        The rows that the solution must meet, some of x y z rx ry rz, in the axes of the table's
        frame 0; rx ry rz is the rotation vector from pose to target. Default: all rows for a pose,
        x y z for a position.
    seed
        Seed of the search, if neither a closed form nor elimination finds all solutions. Equal
        seeds give equal results.
    all_solutions
        False: return one solution inside the limits, in a fraction of the time. A closed form
        gives the solution nearest to `near`. Without a closed form, an iteration starts at `near`,
        then at random joint positions, until it finds a solution. If no solution is found, all
        solutions are searched for. For a redundant arm, the solution is a posture of a family
        (`families[0].q`).
    axis
        For a pose as target: the tool axis, x, y or z, whose direction must be met instead of the
        whole rotation. The tool may turn about this axis. With `axis`, `rows` are some of x y z.
    tolerance
        Largest position error (m) and rotation error (rad). Inexact solutions are searched for
        only if no exact solution is inside the limits. Exception: J may have fewer independent
        rows than the target has equations, as for five joints and a pose. Then no solution is
        exact if the numbers of the target are rounded, so all solutions within the tolerance are
        returned, each with the least residual. 0: only exact solutions (to 1e-10 m; for arms
        smaller than 1 mm, to 1e-7 of their reach).

    Raises
    ------
    TargetError
        The target is neither a pose nor a position, or not finite; rows, axis or tolerance are
        wrong.
    JointVectorError
        `near` is not n finite numbers.
    """
    robot = as_robot(robot)
    checked = ik_target_of(robot, target, rows, axis, tolerance)
    plan = plan_for(robot, checked.rows, checked.axis)
    if plan.overdetermined:
        checked = checked.within_tolerance()
    random_seed = seed_of(seed)
    near = near_or_middle(robot, plan, near)
    problem = IkProblem(robot, checked, plan, near, random_seed, curves, respect_limits)
    if all_solutions:
        return _exact_or_near(problem)
    proved = _first_solution(problem)
    if proved.count and checked.is_reached_at(proved.q[0], proved.miss(0)):
        return _single_result(problem, proved)
    result = _exact_or_near(problem)
    solutions, families = result.solutions[:1], result.families[:1]
    complete: Complete = 'partial' if solutions or families else result.complete
    return replace(result, solutions=solutions, families=families, complete=complete)


def inverse_kinematics_of_each(
    robot: AnyRobot,
    targets: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    respect_limits: bool = True,
    tolerance: float = TOLERANCE,
) -> tuple[IkResult, ...]:
    """
    Return the result of `inverse_kinematics` for each of many poses of the tool.

    If the arm has a closed form, one call of the kernel solves all poses.

    Parameters
    ----------
    robot, near, respect_limits, tolerance
        As in `inverse_kinematics`.
    targets : shape (N, 4, 4)
        Poses of the tool in the base frame.

    Raises
    ------
    TargetError
        A target is not a pose, or not finite; the tolerance is wrong.
    JointVectorError
        `near` is not n finite numbers.
    """
    robot = as_robot(robot)
    poses = poses_of(targets)
    if not len(poses):
        return ()
    checked = ik_target_of(robot, poses[0], tolerance=tolerance)
    plan = plan_for(robot, checked.rows)
    near = near_or_middle(robot, plan, near)
    problem = IkProblem(robot, checked, plan, near, 0, True, respect_limits)

    def singly(pose: Floats) -> IkResult:
        return inverse_kinematics(robot, pose, near, respect_limits, tolerance=tolerance)

    if plan.closed is None:
        return tuple(map(singly, poses))
    proved, counts = closed_solutions_of_each(problem, plan.closed, poses)
    results, first = [], 0
    for pose, (count, sure) in zip(poses, counts.tolist()):
        indices = range(first, first + count)
        first += count
        solved = _solved(problem, proved, indices) if sure else None
        results.append(solved or singly(pose))
    return tuple(results)


def _exact_or_near(problem: IkProblem) -> IkResult:
    robot, target, plan, *_ = problem
    result = _all(problem)
    nearest = result.nearest
    if nearest is not None and result.status != 'family' and target.is_near_at(nearest.q):
        # No exact solution is inside the limits, but the tool's error at the nearest pose is
        # within the tolerance. So search again, and accept all errors within the tolerance.
        near = problem._replace(target=target.within_tolerance())
        result = (_all if plan.redundant else _searched)(near)
    if result.status != 'unreachable':
        return result
    # Use the reach inside the limits, which is smaller if prismatic joints have limits.
    reach = plan.reach_inside if problem.respect_limits else plan.reach
    sentence = beyond(target, robot, reach)
    return replace(result, reason=sentence, complete='proved') if sentence else result


def _all(problem: IkProblem) -> IkResult:
    plan = problem.plan
    if plan.redundant:
        out = _beyond_reach(problem)
        return redundant_result(problem) if out is None else out
    if plan.closed is not None:
        if problem.respect_limits:
            inside = closed_solutions(problem, plan.closed, False, True)
            solved = _solved(problem, inside, range(inside.count)) if inside.sure else None
            if solved is not None:
                return solved
        closed = closed_solutions(problem, plan.closed, False, False)
        return _proved(problem, closed) if closed.sure else _unsure(problem, closed)
    if plan.six_joints is None:
        five = _result_of_five(problem)
        return _searched(problem) if five is None else five
    eliminated = eliminated_solutions(problem, plan.six_joints)
    if eliminated.all_found:
        return _proved(problem, eliminated.solutions, eliminated.roots)
    return _degenerate(problem, plan.six_joints, eliminated)


def _result_of_five(problem: IkProblem) -> IkResult | None:
    # Solves an arm of five joints as an arm of six: adds a sixth joint, and takes the solutions in
    # which the sixth joint is at 0. If the numbers of the target are rounded, the five joints can
    # only approach the target. So the tool pose at the first approximate solution replaces the
    # target, and the arm is solved again. Returns None if the number of solutions is not proved.
    robot, target, plan, *_ = problem
    known = target.rows == ROW_NAMES and not plan.redundant and not len(plan.idle)
    if not known or target.tolerance > CANDIDATE_ERROR**2:
        return None
    arms = ((kind, arm) for kind in FIVE_JOINTS for arm in as_six(robot, kind == 'algebraic'))
    for kind, arm in arms:
        pose = target.pose
        for _ in range(2):
            q, off = arm.candidates(pose)
            held = np.abs(np.remainder(q[:, 5] + np.pi, 2 * np.pi) - np.pi) < CANDIDATE_ERROR
            solutions, _ = distinct(target, plan, refined(target, plan, q[held, :5]))
            if len(solutions.q):
                pose = forward_kinematics(robot, solutions.q[0])
        beside = [arm.candidates(moved) for moved in _poses_beside(pose, target.tolerance)]
        regular = all(len(other) == len(q) for other, _ in beside)
        if regular and off < CANDIDATE_ERROR and len(solutions.q) == np.count_nonzero(held):
            return answer(problem, reached(target, solutions), kind)
    return None


def _poses_beside(pose: Floats, tolerance: float) -> Iterator[Floats]:
    # Yields 12 poses near `pose`: moved along or turned about x, y or z, in both directions, by
    # sqrt(6) * tolerance. They show whether the number of solutions changes within `tolerance` of
    # `pose`. Suppose that the number changes at a plane in the space of the six motions. The unit
    # normal n of the plane has a component n_i of at least 1 / sqrt(6) in size. So a step of
    # sqrt(6) * tolerance along axis i moves the pose by at least `tolerance` in the direction of
    # n. If the plane is within `tolerance`, one of the 12 poses is beyond the plane.
    for motion in np.vstack([np.eye(6), -np.eye(6)]) * math.sqrt(6.0) * tolerance:
        moved = pose.copy()
        moved[:3, 3] += motion[:3]
        moved[:3, :3] = exponential(motion[3:]) @ moved[:3, :3]
        yield moved


def _method_of(roots: tuple[int, int] | None) -> Method:
    # `roots` ends with the largest possible number of solutions. If that is 2, the arm has three
    # prismatic joints, and elimination leads to a quadratic equation, which is a closed form.
    return 'algebraic' if roots and roots[1] > 2 else 'closed form'


def _proved(
    problem: IkProblem, proved: kernel.Solutions, roots: tuple[int, int] | None = None
) -> IkResult:
    # Returns the result for the solutions `proved`, which are proved to be all solutions. If some
    # of them are nearly singular, they may belong to families; then `answer` sorts the solutions
    # into isolated ones and families.
    indices = range(proved.count)
    simple = proved.sure or all(proved.share(k) >= SUSPECT_PIVOT_RATIO for k in indices)
    solved = _solved(problem, proved, indices, roots) if simple else None
    return answer(problem, _copied(proved), _method_of(roots), roots) if solved is None else solved


def _solved(
    problem: IkProblem,
    proved: kernel.Solutions,
    indices: range,
    roots: tuple[int, int] | None = None,
) -> IkResult | None:
    # Returns the result for the solutions `proved`, which are proved to be all solutions and are
    # all simple. Returns None if none of them is inside the limits.
    solutions = solutions_of(problem, proved, problem.respect_limits, indices)
    inside = sum(solution.feasible for solution in solutions)
    if not inside:
        return None
    result = IkResult.__new__(IkResult)
    # Set the fields without the constructor, because the constructor of a frozen dataclass takes 5
    # % of the time of a call.
    result.__dict__.update(
        solutions=solutions,
        families=(),
        status='solved',
        reason=inside_limits(inside, 0),
        method=_method_of(roots),
        nearest=None,
        complete='proved',
        roots=roots,
    )
    return result


def _unsure(problem: IkProblem, closed: kernel.Solutions) -> IkResult:
    # The closed form may have missed solutions, because one of its equations is nearly singular or
    # its error bound is large. Elimination uses other equations, which may be far from singular at
    # this target. If elimination proves that it found all solutions, returns its result. Otherwise
    # returns the result of a search.
    known = _copied(closed)
    if closed.count:
        result = answer(problem, known, 'closed form')
        if result.families:
            return result
    arm = elimination_of(problem.robot) if closed.regular else None
    if arm is not None:
        eliminated = eliminated_solutions(problem, arm)
        if eliminated.all_found:
            return _proved(problem, eliminated.solutions, eliminated.roots)
        known = known.joined(_copied(eliminated.solutions))
    return _searched(problem, known)


def _degenerate(problem: IkProblem, arm: kernel.SixJoints, eliminated: Eliminated) -> IkResult:
    # Solves a target at which solutions coincide, or at which every determinant of elimination
    # vanishes.
    roots = arm.bound, arm.bound
    completed = completed_solutions(problem, arm)
    if completed is not None:
        return answer(problem, completed, _method_of(roots), roots)
    beside = solutions_beside(problem, arm)
    certified, real = max(beside.simple, (eliminated.roots[0], eliminated.real))
    known = _copied(eliminated.solutions).joined(beside.solutions)
    known, _ = distinct(problem.target, problem.plan, known)
    isolated, singular, families = isolated_or_not(problem, known)
    if not families and np.count_nonzero(~singular) == real:
        solutions = with_multiplicities(problem, isolated, singular)
        # The solutions are proved complete if their number, with multiplicities, is the largest
        # possible number. `certified` is the number of simple solutions. Add the multiplicity of
        # each singular solution only if all these multiplicities exceed 1. A singular solution of
        # multiplicity 1 may already be included in `certified`, and a multiplicity of 0 means
        # unknown.
        multiples = solutions.multiplicities[np.count_nonzero(~singular) :]
        if all(m > 1 for m in multiples) and certified + sum(multiples) == arm.bound:
            return result_of(problem, solutions, (), _method_of(roots), roots)
    return _searched(problem, known)


def _searched(problem: IkProblem, known: DistinctSolutions | None = None) -> IkResult:
    robot, checked, plan, *_ = problem
    out = _beyond_reach(problem)
    if out is not None:
        return out
    # The search ends when each solution was found from several starts. For an arm with loops,
    # require this only of solutions inside the limits. Beyond the limits loops seldom close, so
    # finding a solution there several times would need very many starts.
    inside = plan.limits if problem.respect_limits and robot.chain.loops else plan.unlimited
    solutions, best = search(problem, inside, known)
    return answer(problem, reached(checked, solutions), 'search', best=best)


def _beyond_reach(problem: IkProblem) -> IkResult | None:
    # Returns the result for a target beyond the arm's reach, or None if the target is within
    # reach.
    if not beyond(problem.target, problem.robot, problem.plan.reach):
        return None
    return result_of(problem, no_solutions(problem.robot), (), 'closed form')


def _copied(proved: kernel.Solutions) -> DistinctSolutions:
    errors = [proved.miss(k) for k in range(proved.count)]
    return DistinctSolutions(proved.q[: proved.count].copy(), np.array(errors, dtype=np.float64))


def _single_result(problem: IkProblem, proved: kernel.Solutions) -> IkResult:
    target, plan = problem.target, problem.plan
    method: Method = 'search' if plan.closed is None else 'closed form'
    error, motions = proved.miss(0), plan.idle
    if plan.redundant:
        motions = tangent(problem, proved.q[0], plan.freedom)
    if len(motions):
        family = SolutionFamily(proved.q[0], error, motions, not plan.redundant)
        continuum = family_of(problem, family)
        nearest = nearest_pose(problem, continuum.q, error)
        reason = LEFT_FREE + ', '.join(continuum.joints) + not_exact(target, error)
        return IkResult((), (continuum,), 'family', reason, method, nearest, 'partial')
    if proved.share(0) < SUSPECT_PIVOT_RATIO:
        # J is nearly singular at this solution, so let `answer` check whether the solution is
        # isolated.
        inside = problem._replace(respect_limits=True)
        return replace(answer(inside, _copied(proved), method), complete='partial')
    reason = f'a solution inside the limits{not_exact(target, error)}; others were not looked for'
    solutions = solutions_of(problem, proved, True, range(1))
    return IkResult(solutions, (), 'solved', reason, method, None, 'partial')


def _first_solution(problem: IkProblem) -> kernel.Solutions:
    # Returns one solution inside the limits, if one is found. If the arm has a closed form, this
    # is the solution nearest to `near`; otherwise it is the result of refinement from `near` or
    # from seeded starts.
    plan = problem.plan
    if plan.closed is not None:
        return closed_solutions(problem, plan.closed, True, False)
    bounds = plan.limits if plan.redundant else None
    solution = room_for(1, problem)
    refining = refinement(problem.target, plan, True, bounds, held=True)
    tries = _starts(problem.robot, problem.target.rows, problem.target.axis, problem.seed)
    kernel.first_solution(refining, tries, solution)
    return solution


@functools.lru_cache(maxsize=128)
def _starts(robot: Robot, rows: tuple[str, ...], axis: str, seed: int) -> Floats:
    random = np.random.default_rng(seed)
    return into_limits(robot, starts(robot, plan_for(robot, rows, axis), random, STARTS), random)
