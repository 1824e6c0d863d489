"""
Inverse kinematics: candidates, each proved by forward kinematics, sorted into solutions and
families.
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
    inside_limits,
    moving_joints,
    nearest_pose,
    not_exact,
    result_of,
)
from .closed_forms import (
    NO_POSTURE,
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
from .families import SUSPECT, isolated_or_not, tangent
from .multiple import with_multiplicities
from .problem.plan import as_six, elimination_of, plan_for
from .problem.problem import IkProblem, near_or_middle
from .problem.target import ik_target_of, poses_of
from .redundant import into_limits, redundant_result
from .result import IkFamily, IkResult, Method
from .search import (
    DistinctSolutions,
    LeastError,
    distinct,
    no_solutions,
    reached,
    refined,
    refinement,
    search,
    starts,
)

# How far off a target is reached (m, rad): what a person types has seven digits.
TOLERANCE = 1e-6
# Number of starts tried for one solution before the search for all.
STARTS = 256
# Candidates less far from solutions (rad) lead each to its own, as in kernel/inverse/solving.py.
CANDIDATE_ERROR = 1e-2
# How five joints are solved, in this order.
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
        Whether to leave out solutions outside the limits.
    rows
        Which of x y z rx ry rz count (axes of the table's frame 0; rx ry rz: the rotation vector
        from pose to target); default: all of a pose, x y z of a position.
    seed
        Of the search, where neither a closed form nor elimination finds all: the same seed, the
        same answer.
    all_solutions
        False: the first solution inside the limits is enough, in a fraction of the time. In closed
        form it is the nearest to `near`, otherwise what refinement from `near` leads to. A
        redundant arm's is the representative of its family (`families[0].q`). If no start leads
        inside the limits, all are searched for.
    axis
        Of a pose as target, the axis of the tool, x, y or z, whose direction counts instead of the
        whole rotation: the tool may turn about it. `rows` are some of x y z then.
    tolerance
        How far off the tool may be, m and rad. A solution that is exact comes first: where an arm
        can be exact, one that is not is looked for only if no exact one is inside the limits. Arms
        that move the tool in fewer ways than count meet no rounded target exactly; of those all
        solutions within the tolerance are returned. Each is where its residual is least. 0: only
        exact ones (to 1e-10 m; of arms smaller than 1 mm, to 1e-7 of their reach).

    Raises
    ------
    TargetError
        The target is neither a pose nor a position, or not finite; rows, axis or tolerance are
        not as above.
    JointVectorError
        `near` is not n finite numbers.
    """
    robot = as_robot(robot)
    checked = ik_target_of(robot, target, rows, axis, tolerance)
    plan = plan_for(robot, checked.rows, checked.axis)
    if plan.overdetermined:
        checked = checked.within_tolerance()
    seed_of(seed)  # refuses what is none
    problem = IkProblem(robot, checked, plan, near_or_middle(robot, plan, near), seed, curves)
    if not all_solutions:
        proved = _first_solution(problem)
        if proved.count and checked.is_reached_at(proved.q[0], proved.miss(0)):
            return _one(problem, proved)
        result = _exact_or_near(problem, respect_limits)
        return replace(
            result,
            solutions=result.solutions[:1],
            families=result.families[:1],
            complete='partial' if result.solutions or result.families else result.complete,
        )
    return _exact_or_near(problem, respect_limits)


def inverse_kinematics_of_each(
    robot: AnyRobot,
    targets: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    respect_limits: bool = True,
    tolerance: float = TOLERANCE,
) -> tuple[IkResult, ...]:
    """
    Return the result of `inverse_kinematics` of each of many poses of the tool.

    Those of an arm with a closed form are found in one call of the kernel, and stand in one array.

    Parameters
    ----------
    robot, near, respect_limits, tolerance
        As there.
    targets : shape (N, 4, 4)
        Poses of the tool in the base frame.

    Raises
    ------
    TargetError
        The targets are no poses, or not finite; the tolerance is not as there.
    JointVectorError
        `near` is not n finite numbers.
    """
    robot = as_robot(robot)
    poses = poses_of(targets)
    if not len(poses):
        return ()
    checked = ik_target_of(robot, poses[0], tolerance=tolerance)
    plan = plan_for(robot, checked.rows)
    problem = IkProblem(robot, checked, plan, near_or_middle(robot, plan, near), 0)

    def singly(pose: Floats) -> IkResult:
        return inverse_kinematics(robot, pose, problem.near, respect_limits, tolerance=tolerance)

    if plan.closed is None:
        return tuple(singly(pose) for pose in poses)
    proved, counts = closed_solutions_of_each(problem, plan.closed, respect_limits, poses)
    results, first = [], 0
    for k, (count, sure) in enumerate(counts.tolist()):
        which = range(first, first + count)
        first += count
        solved = _solved(problem, proved, 'closed form', respect_limits, which) if sure else None
        results.append(solved or singly(poses[k]))
    return tuple(results)


def _exact_or_near(problem: IkProblem, respect_limits: bool) -> IkResult:
    result = _within_tolerance(problem, respect_limits)
    if result.status != 'unreachable':
        return result
    # Joints that slide reach less far inside their limits.
    plan = problem.plan
    reach = plan.reach_inside if respect_limits else plan.reach
    said = beyond(problem.target, problem.robot, reach)
    return replace(result, reason=said, complete='proved') if said else result


def _within_tolerance(problem: IkProblem, respect_limits: bool) -> IkResult:
    result = _all(problem, respect_limits)
    nearest, target = result.nearest, problem.target
    if nearest is None or result.status == 'family' or not target.is_near_at(nearest.q):
        return result
    # Just beyond what the arm reaches, or reaches inside its limits.
    near = problem._replace(target=target.within_tolerance())
    return (_all if problem.plan.redundant else _searched)(near, respect_limits)


def _all(problem: IkProblem, respect_limits: bool) -> IkResult:
    plan = problem.plan
    if plan.redundant:
        out = _beyond_reach(problem)
        if out is not None:
            return out
        return redundant_result(problem, respect_limits)
    if plan.closed is not None:
        if respect_limits:
            inside = closed_solutions(problem, plan.closed, False, True)
            which = range(inside.count)
            solved = _solved(problem, inside, 'closed form', True, which) if inside.sure else None
            if solved is not None:
                return solved
        closed = closed_solutions(problem, plan.closed, False, False)
        if closed.sure:
            return _proved(problem, closed, 'closed form', respect_limits)
        return _unsure(problem, closed, respect_limits)
    if plan.six_joints is None:
        five = _result_of_five(problem, respect_limits)
        return _searched(problem, respect_limits) if five is None else five
    eliminated = eliminated_solutions(problem, plan.six_joints)
    if not eliminated.all_found:
        return _degenerate(problem, plan.six_joints, eliminated, respect_limits)
    return _all_eliminated(problem, plan.six_joints, eliminated, respect_limits)


def _result_of_five(problem: IkProblem, respect_limits: bool) -> IkResult | None:
    # Five joints are six that hold an added turn at 0. The proof is of the pose nearest to the
    # target that the arm has; without a proof it returns None.
    robot, target, plan, *_ = problem
    known = target.rows == ROW_NAMES and not plan.redundant and not len(plan.idle)
    if not known or target.tolerance > CANDIDATE_ERROR**2:
        return None
    arms = ((way, arm) for way in FIVE_JOINTS for arm in as_six(robot, way == 'algebraic'))
    for way, arm in arms:
        pose = target.pose
        for _ in range(2):
            q, off = arm.candidates(pose)
            held = np.abs(np.remainder(q[:, 5] + np.pi, 2 * np.pi) - np.pi) < CANDIDATE_ERROR
            found, _ = distinct(target, plan, refined(target, plan, q[held, :5]))
            if len(found.q):
                pose = forward_kinematics(robot, found.q[0])
        beside = [arm.candidates(one) for one in _poses_beside(pose, target.tolerance)]
        regular = all(len(one) == len(q) for one, _ in beside)
        if regular and off < CANDIDATE_ERROR and len(found.q) == np.count_nonzero(held):
            best = LeastError(problem.near, np.inf)
            return answer(problem, reached(target, found), way, best, respect_limits)
    return None


def _poses_beside(pose: Floats, tolerance: float) -> Iterator[Floats]:
    # A border within the tolerance in some direction is within sqrt(6) times it in one of six: the
    # number of solutions differs there.
    for way in np.vstack([np.eye(6), -np.eye(6)]) * math.sqrt(6.0) * tolerance:
        moved = pose.copy()
        moved[:3, 3] += way[:3]
        moved[:3, :3] = exponential(way[3:]) @ moved[:3, :3]
        yield moved


def _all_eliminated(
    problem: IkProblem, arm: kernel.SixJoints, eliminated: Eliminated, respect_limits: bool
) -> IkResult:
    method = _method_of(arm)
    return _proved(problem, eliminated.solutions, method, respect_limits, eliminated.roots)


def _proved(
    problem: IkProblem,
    proved: kernel.Solutions,
    method: Method,
    respect_limits: bool,
    roots: tuple[int, int] | None = None,
) -> IkResult:
    # All there are, unless some that are nearly singular turn out to be families.
    simple = proved.sure or all(proved.share(k) >= SUSPECT for k in range(proved.count))
    which = range(proved.count)
    solved = _solved(problem, proved, method, respect_limits, which, roots) if simple else None
    if solved is not None:
        return solved
    best = LeastError(problem.near, np.inf)
    return answer(problem, _found(proved), method, best, respect_limits, roots)


def _solved(
    problem: IkProblem,
    proved: kernel.Solutions,
    method: Method,
    respect_limits: bool,
    which: range,
    roots: tuple[int, int] | None = None,
) -> IkResult | None:
    # The result of simple solutions, all there are; None where none of them is inside the limits.
    wanted = solutions_of(problem, proved, respect_limits, which)
    inside = len(wanted) if respect_limits else sum(one.feasible for one in wanted)
    if not inside:
        return None
    result = IkResult.__new__(IkResult)
    # Its constructor sets field by field, as that of a frozen dataclass: a twentieth of a call.
    fields = result.__dict__
    fields['solutions'] = wanted
    fields['families'] = ()
    fields['status'] = 'solved'
    fields['reason'] = inside_limits(inside, 0)
    fields['method'] = method
    fields['nearest'] = None
    fields['complete'] = 'proved'
    fields['roots'] = roots
    return result


def _unsure(problem: IkProblem, closed: kernel.Solutions, respect_limits: bool) -> IkResult:
    # Solutions may be missing: a step of the closed form is singular but for its errors, or these
    # are large, which elimination need not mind.
    known, best = _found(closed), LeastError(problem.near, np.inf)
    if closed.count:
        result = answer(problem, known, 'closed form', best, respect_limits)
        if result.families:
            return result
    arm = elimination_of(problem.robot) if closed.regular else None
    if arm is not None:
        eliminated = eliminated_solutions(problem, arm)
        if eliminated.all_found:
            return _all_eliminated(problem, arm, eliminated, respect_limits)
        known = known.joined(_found(eliminated.solutions))
    return _searched(problem, respect_limits, known)


def _degenerate(
    problem: IkProblem, arm: kernel.SixJoints, eliminated: Eliminated, respect_limits: bool
) -> IkResult:
    # Where solutions have become one, or every determinant vanishes, at the target itself.
    _, checked, plan, near, *_ = problem
    completed, best = completed_solutions(problem, arm), LeastError(near, np.inf)
    if completed is not None:
        every = (arm.bound, arm.bound)
        return answer(problem, completed, _method_of(arm), best, respect_limits, every)
    beside = solutions_beside(problem, arm)
    certified, real = max(beside.simple, (eliminated.roots[0], eliminated.real))
    known, _ = distinct(checked, plan, _found(eliminated.solutions).joined(beside.found))
    isolated, singular, families = isolated_or_not(problem, known)
    if not families and np.count_nonzero(~singular) == real:
        found = with_multiplicities(problem, isolated, singular)
        # A multiplicity of 0 is unknown; a singular one of 1 may be among the certified ones.
        multiples = found.multiplicities[np.count_nonzero(~singular) :]
        if all(m > 1 for m in multiples) and certified + sum(multiples) == arm.bound:
            roots = (arm.bound, arm.bound)
            return result_of(problem, found, (), _method_of(arm), best, respect_limits, roots)
    return _searched(problem, respect_limits, known)


def _method_of(arm: kernel.SixJoints) -> Method:
    # The two roots of three prismatic joints are those of a quadratic equation.
    return 'algebraic' if arm.bound > 2 else 'closed form'


def _searched(
    problem: IkProblem, respect_limits: bool, known: DistinctSolutions | None = None
) -> IkResult:
    robot, checked, plan, *_ = problem
    out = _beyond_reach(problem)
    if out is not None:
        return out
    # Beyond the limits of a machine with loops these close seldom, and its turns are no periods:
    # what is there would be met once in many starts, of which each takes long.
    inside = plan.limits if respect_limits and robot.chain.loops else plan.unlimited
    found, best = search(problem, inside, known)
    return answer(problem, reached(checked, found), 'search', best, respect_limits)


def _beyond_reach(problem: IkProblem) -> IkResult | None:
    # The answer to a target farther away than the lengths of the arm let the tool be; None if not.
    if not beyond(problem.target, problem.robot, problem.plan.reach):
        return None
    nothing, best = no_solutions(problem.robot), LeastError(problem.near, np.inf)
    return result_of(problem, nothing, (), 'closed form', best, True)


def _found(proved: kernel.Solutions) -> DistinctSolutions:
    errors = [proved.miss(k) for k in range(proved.count)]
    return DistinctSolutions(proved.q[: proved.count].copy(), np.array(errors, dtype=np.float64))


def _one(problem: IkProblem, proved: kernel.Solutions) -> IkResult:
    robot, target, plan, near, *_ = problem
    method: Method = 'search' if plan.closed is None else 'closed form'
    error = proved.miss(0)
    motions = plan.idle
    if plan.redundant:
        motions = tangent(problem, proved.q[0], plan.freedom)
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
        reason = LEFT_FREE + joints + not_exact(target, error)
        return IkResult((), (continuum,), 'family', reason, method, nearest, 'partial')
    if proved.share(0) < SUSPECT:
        # Perhaps not isolated.
        result = answer(problem, _found(proved), method, LeastError(near, np.inf), True)
        return replace(result, complete='partial')
    reason = f'a solution inside the limits{not_exact(target, error)}; others were not looked for'
    return IkResult(
        solutions_of(problem, proved, True), (), 'solved', reason, method, None, 'partial'
    )


def _first_solution(problem: IkProblem) -> kernel.Solutions:
    """
    Return the first solution inside the limits, nothing if none was met.

    In closed form it is the nearest to `near`; by refinement from there, or from seeded starts if
    that leads nowhere, it is one near by.
    """
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
