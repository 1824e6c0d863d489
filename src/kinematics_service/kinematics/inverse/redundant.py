"""
Arms with more joints than the target has rows: a continuum for every target, and one pose of it.
"""

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .families import SolutionFamily, nearer, tangent
from .plan import InversePlan
from .search import LeastError, refined, starts
from .target import IkTarget

# Number of starts inside the limits, at first and if those fail.
FEW, MANY = 24, 240


def redundant_family(
    robot: Robot, target: IkTarget, plan: InversePlan, near: Floats, random: np.random.Generator
) -> tuple[SolutionFamily | None, LeastError]:
    """Return the family of a target at a pose near `near`, inside the limits if any is."""
    limits = np.array(robot.limits)
    best = LeastError(near, np.inf)
    for count, bounded in ((FEW, True), (MANY, True), (FEW, False)):
        q = starts(robot, plan, random, count)
        q[0] = near
        if bounded:
            q = into_limits(robot, q, random)
            q[0] = np.clip(near, *robot.limits.T)
        arrived = refined(target, plan, q, True, limits if bounded else None)
        k = int(np.argmin(arrived.errors))
        if bounded and arrived.errors[k] < best.error:
            best = LeastError(arrived.q[k], float(arrived.errors[k]))
        arrivals = enumerate(zip(arrived.q, arrived.errors))
        good = [k for k, (one, error) in arrivals if target.is_reached_at(one, error)]
        if not good:
            continue
        distance = np.linalg.norm((arrived.q[good] - near) / plan.scales, axis=1)
        one = good[int(np.argmin(distance))]
        q_one = arrived.q[one]
        motions = tangent(robot, target, plan, q_one, dimension(robot, target))
        family = SolutionFamily(q_one, float(arrived.errors[one]), motions, False)
        slack = limits + [-kernel.AT_LIMIT / 2, kernel.AT_LIMIT / 2]
        open_limits = slack if bounded else np.full_like(slack, np.inf) * [-1.0, 1.0]
        return nearer(robot, target, plan, family, near, open_limits), best
    return None, best


def dimension(robot: Robot, target: IkTarget) -> int:
    """Return the dimension of the families of a redundant arm."""
    return max(robot.chain.dof - target.equations, 1)


def into_limits(robot: Robot, q: Floats, random: np.random.Generator) -> Floats:
    """
    Return starts (m, n) on full turns, those outside narrower limits drawn again inside them.
    """
    low, high = robot.limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    inside = random.uniform(np.where(bounded, low, 0.0), np.where(bounded, high, 1.0), q.shape)
    outside = bounded & ((q < low) | (q > high))
    return np.asarray(np.clip(np.where(outside, inside, q), low, high))
