"""Solutions by search: many starts, each refined by the kernel, until all have been seen often."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats, Integers
from ...robot.robot import Robot
from .problem.plan import InversePlan
from .problem.problem import IkProblem
from .problem.target import IkTarget

BATCH = 48
# The search ends when every solution has been met this often (Good 1953: solutions met once hint
# at others not met), or after this many starts, fewer if no start arrives.
MET, MOST_STARTS, HOPELESS = 4, 1920, 384


class DistinctSolutions(NamedTuple):
    """
    Distinct solutions.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Joint positions, each a solution.
    errors : shape (m,), m
        Residual of each.
    multiplicities
        How many solutions each stands for; empty: each for itself.
    """

    q: Floats
    errors: Floats
    multiplicities: tuple[int, ...] = ()

    def joined(self, others: DistinctSolutions) -> DistinctSolutions:
        """Return these and others."""
        errors = np.concatenate([self.errors, others.errors])
        return DistinctSolutions(np.concatenate([self.q, others.q]), errors)


def no_solutions(robot: Robot) -> DistinctSolutions:
    """Return none."""
    return DistinctSolutions(np.empty((0, robot.dof)), np.empty(0))


class LeastError(NamedTuple):
    """The least error of a search, and where: shape (n,), rad or m."""

    q: Floats
    error: float


def refinement(
    target: IkTarget,
    plan: InversePlan,
    far: bool = False,
    limits: Floats | None = None,
    held: bool = False,
) -> kernel.Refinement:
    """Return the refinement that leads to a target: see `refined`."""
    damping, steps = (kernel.FAR_DAMPING, kernel.FAR_STEPS) if far else (0.0, kernel.NEAR_STEPS)
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
    Return joint positions (m, n) moved to where they miss the target least.

    Parameters
    ----------
    target, plan
        The target, and the arm's plan for it.
    q : shape (m, n), rad or m
        Starts.
    far
        Whether they are starts from anywhere, rather than candidates.
    limits : shape (n, 2), rad or m
        The range where the joints must stay; default: no limits.
    held
        Whether the joints that the plan holds stay where they are.
    """
    return _refined(refinement(target, plan, far, limits, held), q)


def errors_at(target: IkTarget, plan: InversePlan, q: Floats) -> Floats:
    """Return by how much the tool misses the target at joint positions (m, n), shape (m,), m."""
    still = kernel.Refinement(target.residual, plan.scales, plan.unlimited, 0.0, 0)
    return _refined(still, q).errors


def _refined(refinement: kernel.Refinement, q: Floats) -> DistinctSolutions:
    q = np.array(q, dtype=np.float64, order='C')
    errors = np.empty(len(q))
    kernel.refine(refinement, q, errors)
    return DistinctSolutions(q, errors)


def apart(plan: InversePlan, a: Floats, b: Floats) -> Floats:
    """Return b - a (..., n), full turns left out."""
    away = b - a
    turning = np.isfinite(plan.periods)
    if np.any(turning):
        period = plan.periods[turning]
        away[..., turning] -= period * np.round(away[..., turning] / period)
    return away


def distinct(
    target: IkTarget, plan: InversePlan, found: DistinctSolutions
) -> tuple[DistinctSolutions, Integers]:
    """Return the proved solutions, each once, and how often each was met."""
    order = np.argsort(found.errors, kind='stable')
    q, errors = found.q[order], found.errors[order]
    which, met = np.empty(len(q), dtype=np.int64), np.empty(len(q), dtype=np.int64)
    count = kernel.distinct(target.residual, plan.joints, target.proved, q, errors, which, met)
    kept = which[:count]
    return DistinctSolutions(q[kept], errors[kept]), met[:count]


def reached(target: IkTarget, found: DistinctSolutions) -> DistinctSolutions:
    """Return those of what was found that are within the tolerance."""
    which = [target.is_reached_at(q, error) for q, error in zip(found.q, found.errors)]
    return DistinctSolutions(found.q[which], found.errors[which])


def starts(robot: Robot, plan: InversePlan, random: np.random.Generator, count: int) -> Floats:
    """
    Return random joint positions (count, n): full periods, or the limits of a joint without one.

    A joint that slides without limits starts within twice the arm's reach.
    """
    low, high = np.array(robot.limits.T)
    far = 2.0 * max(robot.singularity.task.reach, 1e-6)
    for j in range(robot.dof):
        if np.isfinite(plan.periods[j]):
            low[j], high[j] = -0.5 * plan.periods[j], 0.5 * plan.periods[j]
            continue
        span = far if robot.prismatic[j] else np.pi
        if np.isinf(low[j]) and np.isinf(high[j]):
            low[j], high[j] = -span, span
        elif np.isinf(low[j]):
            low[j] = high[j] - 2 * span
        elif np.isinf(high[j]):
            high[j] = low[j] + 2 * span
    return random.uniform(low, high, (count, robot.dof))


def search(
    problem: IkProblem, limits: Floats, known: DistinctSolutions | None = None
) -> tuple[DistinctSolutions, LeastError]:
    """
    Return all solutions met, limits left aside, and the least error.

    Solutions known before are among them, as if each had been met once. Once there is one within
    `limits` (n, 2), the search does not go on for others that are not.
    """
    robot, target, plan, near, *_ = problem
    random, everything = problem.random(), known or no_solutions(robot)
    all_met = [1] * len(everything.q)
    best = LeastError(near, np.inf)
    # Held joints stay at their position in `near`.
    frozen = plan.held == 0.0
    tried = 0
    while tried < MOST_STARTS:
        q = starts(robot, plan, random, BATCH)
        if tried == 0:
            q[0] = near
        q[:, frozen] = near[frozen]
        tried += BATCH
        arrived = refined(target, plan, q, far=True, held=True)
        k = int(np.argmin(arrived.errors))
        if arrived.errors[k] < best.error:
            best = LeastError(arrived.q[k], float(arrived.errors[k]))
        new, met = distinct(target, plan, arrived)
        merged, counts = everything.joined(new), [*all_met, *met.tolist()]
        everything, all_met = _merged(target, plan, merged, counts)
        if not all_met and tried >= HOPELESS:
            break
        if len(all_met) > MOST_STARTS // 40:  # not points but a continuum
            break
        inside = np.all((everything.q >= limits[:, 0]) & (everything.q <= limits[:, 1]), axis=1)
        wanted = np.array(all_met)[inside] if np.any(inside) else all_met
        if len(wanted) and min(wanted) >= MET and tried >= 2 * BATCH:
            break
    return everything, best


def _merged(
    target: IkTarget, plan: InversePlan, found: DistinctSolutions, met: list[int]
) -> tuple[DistinctSolutions, list[int]]:
    result, _ = distinct(target, plan, found)
    counts = [0] * len(result.q)
    for q, count in zip(found.q, met):
        away = np.max(np.abs(apart(plan, result.q, q[None, :])) / plan.scales, axis=1)
        counts[int(np.argmin(away))] += count
    return result, counts
