"""
Solutions in closed form: one call of the kernel finds, proves and sorts them.

"""

from typing import NamedTuple

import numpy as np

from .. import kernel
from ..kernel import Floats, Integers
from .plan import ClosedForm
from .question import Question
from .result import IkSolution, Posture
from .search import PROVED

# By their signs, as the kernel says them.
POSTURES = {
    (a - 1, b - 1, c - 1): Posture(shoulder, elbow, wrist)
    for a, shoulder in enumerate(('left', '', 'right'))
    for b, elbow in enumerate(('down', '', 'up'))
    for c, wrist in enumerate(('flip', '', 'no_flip'))
}
NO_POSTURE = Posture()


class Proved(NamedTuple):
    """
    Solutions as the kernel left them, nearest first.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Turned into the limits where that can be.
    facts : shape (m, kernel.BEYOND_AT + n)
        What they miss by, how they stand to the limits, how near they are to singular.
    signs : shape (m, 3)
        Their postures.

    """

    q: Floats
    facts: Floats
    signs: Integers


def closed_solutions(question: Question, form: ClosedForm, only_one: bool) -> Proved:
    """
    Return all solutions of an arm with a closed form, or the nearest one inside the limits.

    """
    plan, chain = question.plan, question.robot.chain
    most = kernel.MOST_CANDIDATES
    q = np.empty((most, chain.dof))
    facts = np.empty((most, kernel.BEYOND_AT + chain.dof))
    signs = np.empty((most, 3), dtype=np.int64)
    count = kernel.closed_solutions(
        chain,
        question.aim.numbers,
        form.way,
        form.table,
        form.point,
        form.home_inverse,
        form.backwards,
        form.to_joints,
        form.to_screws,
        plan.scales,
        plan.periods,
        plan.limits,
        question.near,
        PROVED,
        only_one,
        q,
        facts,
        signs,
    )
    return Proved(q[:count], facts[:count], signs[:count])


def solutions_of(question: Question, proved: Proved) -> tuple[IkSolution, ...]:
    """
    Return proved solutions as the result has them, in their order.

    """
    names = question.robot.joint_names
    solutions = []
    told = zip(proved.q.copy(), proved.facts.tolist(), proved.signs.tolist())
    for q, (residual, margin, _, *outside), (shoulder, elbow, wrist) in told:
        feasible = margin >= -kernel.AT_LIMIT
        beyond = () if feasible else tuple(name for name, out in zip(names, outside) if out)
        posture = POSTURES[shoulder, elbow, wrist]
        solutions.append(IkSolution(q, residual, feasible, beyond, margin, posture))
    return tuple(solutions)
