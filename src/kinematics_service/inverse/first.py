"""
One solution: the first that is proved inside the limits, found from where the arm is.

"""

import functools

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..robot import Robot
from .closed import Proved, closed_solutions
from .plan import plan_for
from .question import Question
from .redundant import into_limits
from .search import PROVED, starts

# Starts tried before the question is handed to the search for all.
STARTS = 256


def first_solution(question: Question) -> Proved:
    """
    Return the first solution inside the limits, nothing if none was met.

    In closed form it is the nearest to `near`; by refinement from there, or from seeded starts if
    that leads nowhere, it is one near by.

    """
    plan, chain = question.plan, question.robot.chain
    if plan.closed is not None:
        return closed_solutions(question, plan.closed, True)
    q, facts = np.empty((1, chain.dof)), np.empty((1, kernel.BEYOND_AT + chain.dof))
    tries = kernel.first_solution(
        chain,
        question.aim.numbers,
        plan.held,
        plan.scales,
        plan.periods,
        plan.limits if plan.redundant else plan.unlimited,
        plan.limits,
        question.near,
        PROVED,
        _starts(question.robot, question.aim.rows, question.seed),
        q,
        facts,
    )
    count = 1 if tries > 0 else 0
    return Proved(q[:count], facts[:count], np.zeros((count, 3), dtype=np.int64))


@functools.lru_cache(maxsize=128)
def _starts(robot: Robot, rows: tuple[str, ...], seed: int) -> Floats:
    random = np.random.default_rng(seed)
    return into_limits(robot, starts(robot, plan_for(robot, rows), random, STARTS), random)
