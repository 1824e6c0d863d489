"""
The answer: what was found as the result a user reads, and the nearest pose where that is none.
"""

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .closed import NO_POSTURE, POSTURES
from .families import SolutionFamily, isolated_or_not, nearer
from .question import IkProblem
from .representatives import representatives
from .result import IkFamily, IkResult, IkSolution, Method, NearestPose, Posture, Status
from .search import PROVED, DistinctSolutions, LeastError, refined, starts

# Starts, inside the limits, for the nearest pose.
NEAREST_STARTS = 64
# A joint that moves less than this share of a unit motion stands still.
MOVES = 1e-6
LEFT_FREE = 'the target leaves joints free to move: '


def answer(
    question: IkProblem,
    found: DistinctSolutions,
    method: Method,
    best: LeastError,
    respect_limits: bool,
) -> IkResult:
    """Return the result of proved solutions, told apart from families."""
    robot, aim, plan = question.robot, question.aim, question.plan
    families: tuple[SolutionFamily, ...] = ()
    isolated = found
    if len(found.q):
        isolated, families = isolated_or_not(robot, aim, plan, found)
    result = result_of(question, isolated, families, method, best, respect_limits)
    nearest = result.nearest
    if nearest is None or nearest.residual >= PROVED or result.status == 'family':
        return result
    # The search for the nearest pose met the target inside the limits.
    q = np.concatenate([found.q, nearest.q[None]])
    more = DistinctSolutions(q, np.append(found.errors, nearest.residual))
    isolated, families = isolated_or_not(robot, aim, plan, more)
    return result_of(question, isolated, families, 'search', best, respect_limits)


def result_of(
    question: IkProblem,
    found: DistinctSolutions,
    families: tuple[SolutionFamily, ...],
    method: Method,
    best: LeastError,
    respect_limits: bool,
) -> IkResult:
    """Return the result of isolated solutions and families."""
    solutions = _solutions(question, found)
    continua = tuple(family_of(question, family) for family in families)
    inside = tuple(solution for solution in solutions if solution.feasible)
    status, reason = _status(question, solutions, inside, continua, method)
    wanted = inside if respect_limits else solutions
    nearest = None
    if not inside:
        nearest = _nearest(question, solutions, continua, best)
    if respect_limits:
        continua = tuple(family for family in continua if family.feasible)
    return IkResult(wanted, continua, status, reason, method, nearest)


def inside_limits(solutions: int, families: int) -> str:
    """Return the sentence of a result that has solutions."""
    sentence = f'{solutions} {"solution" if solutions == 1 else "solutions"} inside the limits'
    if not families:
        return sentence
    return f'{sentence}, and {families} continuous {"family" if families == 1 else "families"}'


def _status(
    question: IkProblem,
    solutions: tuple[IkSolution, ...],
    inside: tuple[IkSolution, ...],
    families: tuple[IkFamily, ...],
    method: Method,
) -> tuple[Status, str]:
    # A search that found nothing is no proof that there is nothing.
    searched = ' (by search, which proves nothing)' if method == 'search' else ''
    if inside:
        return 'solved', inside_limits(len(inside), sum(family.feasible for family in families))
    if any(family.feasible for family in families):
        joints = ', '.join(dict.fromkeys(name for f in families for name in f.joints))
        return 'family', LEFT_FREE + joints
    beyond: list[IkSolution | IkFamily] = [*solutions, *families]
    if beyond:
        names = ', '.join(dict.fromkeys(name for one in beyond for name in one.beyond))
        return 'outside_limits', f'reached only beyond the limits of {names}{searched}'
    return 'unreachable', (
        f'no joint positions bring the tool there ({" ".join(question.aim.rows)}){searched}'
    )


def _solutions(question: IkProblem, found: DistinctSolutions) -> tuple[IkSolution, ...]:
    if not len(found.q):
        return ()
    chosen = representatives(question.robot, question.plan, found.q, question.near)
    away = np.linalg.norm((chosen.q - question.near) / question.plan.scales, axis=1)
    postures = _postures(question, found.q)
    errors, margins = found.errors.tolist(), chosen.margin.tolist()
    feasible = (~np.logical_or.reduce(chosen.outside, axis=1)).tolist()
    return tuple(
        IkSolution(
            q=chosen.q[k],
            residual=errors[k],
            feasible=feasible[k],
            beyond=() if feasible[k] else _named(question.robot, chosen.outside[k]),
            margin=margins[k],
            posture=postures[k],
        )
        for k in away.argsort(kind='stable').tolist()
    )


def moving_joints(robot: Robot, motions: Floats) -> tuple[str, ...]:
    """Return the names of the joints that motions (k, n) move."""
    columns = zip(robot.joint_names, *motions.tolist())
    return tuple(name for name, *moves in columns if any(abs(move) > MOVES for move in moves))


def _named(robot: Robot, which: npt.NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(robot.joint_names[j] for j in np.flatnonzero(which))


def family_of(question: IkProblem, family: SolutionFamily) -> IkFamily:
    """Return a family as the result has it, at a pose near to where it was asked to be."""
    robot, plan = question.robot, question.plan
    if not plan.redundant:
        q = representatives(robot, plan, family.q[None], question.near).q[0]
        limits = np.array(robot.limits)
        inside = bool(np.all((q >= limits[:, 0]) & (q <= limits[:, 1])))
        if not inside:
            limits = np.full_like(limits, np.inf) * [-1.0, 1.0]
        family = nearer(robot, question.aim, plan, family._replace(q=q), question.near, limits)
    chosen = representatives(robot, plan, family.q[None], question.near)
    outside = chosen.outside[0]
    return IkFamily(
        q=chosen.q[0].copy(),
        motions=family.motions.copy(),
        straight=family.straight,
        joints=moving_joints(robot, family.motions),
        residual=family.error,
        feasible=not bool(np.any(outside)),
        beyond=_named(robot, outside),
        margin=float(chosen.margin[0]),
        posture=_postures(question, family.q[None])[0],
        scales=plan.scales.copy(),
        periods=plan.periods.copy(),
    )


def _postures(question: IkProblem, q: Floats) -> list[Posture]:
    closed = question.plan.closed
    if closed is None:
        return [NO_POSTURE] * len(q)
    signs = np.zeros((len(q), 3), dtype=np.int64)
    kernel.postures(closed, np.ascontiguousarray(q), signs)
    return [POSTURES[a, b, c] for a, b, c in signs.tolist()]


def _nearest(
    question: IkProblem,
    solutions: tuple[IkSolution, ...],
    families: tuple[IkFamily, ...],
    best: LeastError,
) -> NearestPose:
    robot, aim, plan = question.robot, question.aim, question.plan
    good = next((family for family in families if family.feasible), None)
    if good is not None:
        return nearest_pose(question, good.q, good.residual)
    q = starts(robot, plan, question.random(), NEAREST_STARTS)
    known = [*(one.q for one in solutions), *(one.q for one in families)]
    q = np.vstack([question.near, best.q, *known, q])
    q = np.clip(q, *robot.limits.T)
    arrived = refined(aim, plan, q, True, plan.limits)
    k = int(np.argmin(arrived.errors))
    q = representatives(robot, plan, arrived.q[k][None], question.near).q[0]
    return nearest_pose(question, q, float(arrived.errors[k]))


def nearest_pose(question: IkProblem, q: Floats, error: float) -> NearestPose:
    """Return how near to the target the tool is at joint positions (n,)."""
    linear, angular = kernel.parts_of_error(question.aim.residual, np.array(q))
    return NearestPose(q.copy(), error, linear, angular)
