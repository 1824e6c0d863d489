"""Inverse kinematics: candidates, each proved by forward kinematics, sorted by what they are."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...robot.robot import Robot
from .answer import LEFT_FREE, answer, inside_limits, moving_joints, nearest_pose, result_of
from .closed import NO_POSTURE, closed_solutions, solutions_of
from .families import SUSPECT, tangent
from .first import first_solution
from .plan import plan_for
from .problem import IkProblem, near_or_middle
from .redundant import dimension, redundant_family
from .result import IkFamily, IkResult, Method
from .search import LeastError, DistinctSolutions, search
from .target import ik_target_of


def inverse_kinematics(
    robot: Robot,
    target: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    respect_limits: bool = True,
    rows: Sequence[str] | None = None,
    seed: int = 0,
    all_solutions: bool = True,
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
        solutions first (root of the sum of squares, prismatic joints divided by the arm's length);
        default: the middle of the limits, 0 where there are none.
    respect_limits
        Whether solutions outside the limits are left out.
    rows
        Which of x y z rx ry rz count (axes of the table's frame 0; rx ry rz: the rotation vector
        from pose to target); default: all of a pose, x y z of a position.
    seed
        Of the search, where there is no closed form: the same seed, the same answer.
    all_solutions
        False: the first solution inside the limits is enough, in a fraction of the time. In closed
        form it is the nearest to `near`, otherwise what refinement from `near` leads to. A
        redundant arm's is the representative of its family (`families[0].q`). If no start leads
        inside the limits, all are searched for.

    Raises
    ------
    TargetError
        The target is neither a pose nor a position, or not finite.
    JointVectorError
        `near` is not n finite numbers.
    """
    checked = ik_target_of(robot, target, rows)
    plan = plan_for(robot, checked.rows)
    problem = IkProblem(robot, checked, plan, near_or_middle(robot, plan, near), seed)
    if not all_solutions:
        proved = first_solution(problem)
        if proved.count:
            return _one(problem, proved)
        result = _all(problem, respect_limits)
        return replace(result, solutions=result.solutions[:1], families=result.families[:1])
    return _all(problem, respect_limits)


def _all(problem: IkProblem, respect_limits: bool) -> IkResult:
    robot, checked, plan, near, _ = problem
    best = LeastError(near, np.inf)
    if plan.redundant:
        family, best = redundant_family(robot, checked, plan, near, problem.random())
        alone = () if family is None else (family,)
        nothing = DistinctSolutions(np.empty((0, robot.dof)), np.empty(0))
        return result_of(problem, nothing, alone, 'search', best, respect_limits)
    if plan.closed is None:
        found, best = search(robot, checked, plan, near, problem.random())
        return answer(problem, found, 'search', best, respect_limits)
    proved = closed_solutions(problem, plan.closed, False)
    if proved.count and min(map(proved.share, range(proved.count))) >= SUSPECT:
        solutions = solutions_of(problem, proved)
        inside = tuple(solution for solution in solutions if solution.feasible)
        if inside:
            wanted = inside if respect_limits else solutions
            return IkResult(
                wanted, (), 'solved', inside_limits(len(inside), 0), 'closed form', None
            )
    return answer(problem, _found(proved), 'closed form', best, respect_limits)


def _found(proved: kernel.Solutions) -> DistinctSolutions:
    errors = [proved.miss(k) for k in range(proved.count)]
    return DistinctSolutions(proved.q[: proved.count].copy(), np.array(errors, dtype=np.float64))


def _one(problem: IkProblem, proved: kernel.Solutions) -> IkResult:
    robot, checked, plan, near, _ = problem
    method: Method = 'search' if plan.closed is None else 'closed form'
    error = proved.miss(0)
    motions = plan.idle
    if plan.redundant:
        motions = tangent(robot, checked, plan, proved.q[0], dimension(robot, checked))
    if len(motions):
        continuum = IkFamily(
            q=proved.q[0].copy(),
            motions=motions.copy(),
            straight=not plan.redundant,
            joints=moving_joints(robot, motions),
            residual=error,
            feasible=True,
            beyond=(),
            margin=proved.margin(0),
            posture=NO_POSTURE,
            scales=plan.scales.copy(),
            periods=plan.periods.copy(),
        )
        nearest = nearest_pose(problem, continuum.q, error)
        joints = ', '.join(continuum.joints)
        return IkResult((), (continuum,), 'family', LEFT_FREE + joints, method, nearest)
    if proved.share(0) < SUSPECT:
        # Perhaps not isolated.
        return answer(problem, _found(proved), method, LeastError(near, np.inf), True)
    reason = 'a solution inside the limits; others were not looked for'
    return IkResult(solutions_of(problem, proved), (), 'solved', reason, method, None)
