"""One solution: the first that is proved inside the limits, from the arm's present position."""

import functools

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .closed import closed_solutions, room_for
from .plan import plan_for
from .problem import IkProblem
from .redundant import into_limits
from .search import refinement, starts

# Number of starts tried before the search for all solutions.
STARTS = 256


def first_solution(problem: IkProblem) -> kernel.Solutions:
    """
    Return the first solution inside the limits, nothing if none was met.

    In closed form it is the nearest to `near`; by refinement from there, or from seeded starts if
    that leads nowhere, it is one near by.
    """
    plan = problem.plan
    if plan.closed is not None:
        return closed_solutions(problem, plan.closed, True)
    bounds = plan.limits if plan.redundant else None
    solution = room_for(1, problem)
    kernel.first_solution(
        refinement(problem.target, plan, True, bounds, held=True),
        plan.joints,
        problem.near,
        problem.target.proved,
        _starts(problem.robot, problem.target.rows, problem.target.axis, problem.seed),
        solution,
    )
    return solution


@functools.lru_cache(maxsize=128)
def _starts(robot: Robot, rows: tuple[str, ...], axis: str, seed: int) -> Floats:
    random = np.random.default_rng(seed)
    return into_limits(robot, starts(robot, plan_for(robot, rows, axis), random, STARTS), random)
