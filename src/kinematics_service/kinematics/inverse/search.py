# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Search for inverse kinematics solutions from random starts (multistart). New starts are refined
until every known solution has been found from four starts.

Good (1953) justifies this stopping rule: if some solutions have been found only once, other
solutions are likely missing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats, Integers
from ...robot.robot import Robot
from .problem.plan import InversePlan
from .problem.problem import IkProblem
from .problem.target import IkTarget
from .result import without_turns

# Number of random starts of the inverse kinematics search that are refined in one call of the
# kernel.
BATCH = 48
# The search for inverse kinematics solutions ends if every solution was found from at least this
# number of starts.
MIN_MEETINGS = 4
# Largest number of random starts of the search for inverse kinematics solutions.
MAX_STARTS = 1920
# The search for inverse kinematics solutions ends after this number of starts if none of them has
# led to a solution.
MAX_FAILED_STARTS = 384


class DistinctSolutions(NamedTuple):
    """
    The different solutions of one inverse kinematics target.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Joint positions, each a solution.
    errors : shape (m,), m
        Residual of each solution.
    multiplicities
        Number of solutions that coincide at each q; empty if all are simple.
    """

    q: Floats
    errors: Floats
    multiplicities: tuple[int, ...] = ()

    def joined(self, others: DistinctSolutions) -> DistinctSolutions:
        """Return the solutions of this object followed by the solutions of `others`."""
        errors = np.concatenate([self.errors, others.errors])
        return DistinctSolutions(np.concatenate([self.q, others.q]), errors)


def no_solutions(robot: Robot) -> DistinctSolutions:
    """Return a `DistinctSolutions` without solutions."""
    return DistinctSolutions(np.empty((0, robot.dof)), np.empty(0))


def refinement(
    target: IkTarget,
    plan: InversePlan,
    far: bool = False,
    limits: Floats | None = None,
    held: bool = False,
) -> kernel.Refinement:
    """
    Return the kernel's Levenberg-Marquardt refinement for a target. `far`, `limits` and `held` are
    described at the function `refined`.
    """
    damping = kernel.SEARCH_DAMPING if far else 0.0
    steps = kernel.MAX_SEARCH_STEPS if far else kernel.MAX_CANDIDATE_STEPS
    return kernel.Refinement(
        target.residual,
        plan.held if held else plan.scales,
        plan.unlimited if limits is None else limits,
        damping,
        steps,
    )


def refined(
    target: IkTarget,
    plan: InversePlan,
    q: Floats,
    far: bool = False,
    limits: Floats | None = None,
    held: bool = False,
) -> DistinctSolutions:
    """
    Return the local minima of the residual to which Levenberg-Marquardt moves the joint positions
    q (m, n).

    Parameters
    ----------
    target, plan
        The target, and the arm's plan for it.
    q : shape (m, n), rad or m
        Joint positions at which the iterations start.
    far
        Whether the starts are arbitrary (steps are damped) instead of candidates near solutions.
    limits : shape (n, 2), rad or m
        Range of the joints; default: no limits.
    held
        Whether some joints do not move: those with the factor 0 in `plan.held`.
    """
    return _refined(refinement(target, plan, far, limits, held), q)


def errors_at(target: IkTarget, plan: InversePlan, q: Floats) -> Floats:
    """Return the residual of the target, in metres, for each row of q (m, n): shape (m,)."""
    still = kernel.Refinement(target.residual, plan.scales, plan.unlimited, 0.0, 0)
    return _refined(still, q).errors


def _refined(refinement: kernel.Refinement, q: Floats) -> DistinctSolutions:
    q = np.array(q, dtype=np.float64, order='C')
    errors = np.empty(len(q))
    kernel.refine(refinement, q, errors)
    return DistinctSolutions(q, errors)


def apart(plan: InversePlan, a: Floats, b: Floats) -> Floats:
    """Return the joint differences b - a (..., n) without full turns."""
    return without_turns(b - a, plan.periods)


def distinct(
    target: IkTarget, plan: InversePlan, candidates: DistinctSolutions
) -> tuple[DistinctSolutions, Integers]:
    """
    Return the distinct solutions among the joint positions `candidates`, and how often each
    solution was found. Positions that do not reach the target are left out.
    """
    order = np.argsort(candidates.errors, kind='stable')
    q, errors = candidates.q[order], candidates.errors[order]
    rows, counts = np.empty(len(q), dtype=np.int64), np.empty(len(q), dtype=np.int64)
    count = kernel.distinct(target.residual, plan.joints, target.proved, q, errors, rows, counts)
    kept = rows[:count]
    return DistinctSolutions(q[kept], errors[kept]), counts[:count]


def reached(target: IkTarget, candidates: DistinctSolutions) -> DistinctSolutions:
    """Return those of the joint positions `candidates` that reach the target."""
    mask = [target.is_reached_at(q, error) for q, error in zip(candidates.q, candidates.errors)]
    return DistinctSolutions(candidates.q[mask], candidates.errors[mask])


def starts(robot: Robot, plan: InversePlan, random: np.random.Generator, count: int) -> Floats:
    """
    Return random joint positions (count, n) within a full period of each joint.

    Joints without a period are drawn inside their limits. Without limits, they are drawn from -pi
    to pi, or, if prismatic, from minus to plus twice the arm's reach.
    """
    lower, upper = robot.limits.T
    span = np.where(robot.prismatic, 2.0 * max(robot.singularity.task.reach, 1e-6), np.pi)
    span = np.where(np.isfinite(plan.periods), 0.5 * plan.periods, span)
    free = np.isfinite(plan.periods) | (np.isinf(lower) & np.isinf(upper))
    low = np.where(np.isinf(lower), upper - 2 * span, lower)
    high = np.where(np.isinf(upper), lower + 2 * span, upper)
    low, high = np.where(free, -span, low), np.where(free, span, high)
    return random.uniform(low, high, (count, robot.dof))


def search(
    problem: IkProblem, limits: Floats, known: DistinctSolutions | None = None
) -> tuple[DistinctSolutions, Floats]:
    """
    Return all solutions that the search finds, also outside the limits, and the joint positions
    (n,) with the least residual.

    The search begins with the `known` solutions, each taken as found once. It ends when every
    solution has been found `MIN_MEETINGS` times. If a solution is within `limits` (n, 2), only
    solutions within `limits` must be found `MIN_MEETINGS` times.
    """
    robot, target, plan, near, *_ = problem
    random, arrivals, best, least = problem.random(), known or no_solutions(robot), near, np.inf
    # `plan.held` has a factor for the steps of each joint. If the factor is 0, the joint keeps its
    # position in `near`.
    frozen = plan.held == 0.0
    for tried in range(BATCH, MAX_STARTS + 1, BATCH):
        q = starts(robot, plan, random, BATCH)
        if tried == BATCH:
            q[0] = near
        q[:, frozen] = near[frozen]
        arrived = refined(target, plan, q, far=True, held=True)
        k = int(np.argmin(arrived.errors))
        if arrived.errors[k] < least:
            best, least = arrived.q[k], arrived.errors[k]
        arrivals = arrivals.joined(arrived)
        solutions, counts = distinct(target, plan, arrivals)
        # Stop if very many distinct solutions were found: they are then points of a continuum.
        if (not len(counts) and tried >= MAX_FAILED_STARTS) or len(counts) > MAX_STARTS // 40:
            break
        inside = np.all((solutions.q >= limits[:, 0]) & (solutions.q <= limits[:, 1]), axis=1)
        required = counts[inside] if np.any(inside) else counts
        if len(required) and required.min() >= MIN_MEETINGS and tried >= 2 * BATCH:
            break
    return solutions, best
