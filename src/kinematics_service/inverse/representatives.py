"""
Which of the joint positions that differ by full turns are meant, and how they stand to limits.

"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..kernel import Floats
from ..robot import Robot
from .plan import Plan

# Beyond a limit by less is at the limit: what the last digits of a solution do (rad, m).
AT_LIMIT = 1e-9


class Representatives(NamedTuple):
    """
    Joint positions with the turns chosen.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Inside the limits if any turn is; the nearest to `near` of those.
    outside : shape (m, n)
        Which joints are beyond their limits.
    margin : shape (m,)
        Distance to the nearest limit, rad or m; negative beyond one.

    """

    q: Floats
    outside: npt.NDArray[np.bool_]
    margin: Floats


def representatives(robot: Robot, plan: Plan, q: Floats, near: Floats) -> Representatives:
    """
    Return the representatives of joint positions (m, n) nearest to `near` (n,).

    """
    low, high = robot.limits.T
    turns = np.isfinite(plan.periods)
    if np.any(turns):
        q = np.array(q)
        period = plan.periods[turns]
        lo, hi = low[turns] - AT_LIMIT, high[turns] + AT_LIMIT
        # ceil(x - 1/2) rounds halves down: without a reference the turn ends at pi, not at -pi.
        x = q[:, turns] + period * np.ceil((near[turns] - q[:, turns]) / period - 0.5)
        x = np.where(x <= near[turns] - period / 2 + 1e-15, x + period, x)
        up = np.where(x < lo, np.ceil((lo - x) / period), 0.0)
        down = np.where(x > hi, np.ceil((x - hi) / period), 0.0)
        moved = x + period * np.where(np.isfinite(up - down), up - down, 0.0)
        inside = (moved >= lo) & (moved <= hi)
        # No turn is inside: the one that is beyond by less.
        other = moved + period * np.where(moved > hi, -1.0, 1.0)
        beyond = np.maximum(lo - moved, moved - hi)
        beyond_other = np.maximum(lo - other, other - hi)
        q[:, turns] = np.where(inside | (beyond <= beyond_other), moved, other)
    outside = (q < low - AT_LIMIT) | (q > high + AT_LIMIT)
    margin = np.min(np.minimum(q - low, high - q), axis=1, initial=np.inf)
    return Representatives(q, outside, margin)
