"""Compute the range of each joint position over which the arm's singular poses are sampled."""

import math

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .clearance_bounds import moving_joints
from .task import Task

MAX_TURNS = 4  # longest period of a joint behind a gear, in turns


def joint_spans(chain: Chain, task: Task, limits: Floats) -> Floats:
    """
    Return the begin, the length and the period of each joint's range, (n, 3).

    In rad; prismatic joints are divided by the characteristic length. The length is 0 if the joint
    never changes the rank of J_t. The period is infinite if the joint has none. Then the range
    goes `kernel.FARTHEST` beyond the limits, or is one turn if there are no limits. With closed
    loops it ends at the limits, because the loops may not close beyond them.
    """
    n, scales = chain.dof, task.column_scales
    if not chain.entries:
        return np.tile([-math.pi, 0.0, math.inf], (n, 1))
    spans = np.zeros((n, 3))
    low, high = limits.T / scales
    for j in range(n):
        period = _period(chain, j)
        begin, end = -0.5 * period, 0.5 * period
        beyond = 0.0 if chain.loops else kernel.FARTHEST
        if math.isinf(period):
            begin = low[j] - beyond if math.isfinite(low[j]) else -math.pi
            end = high[j] + beyond if math.isfinite(high[j]) else begin + math.tau
        spans[j] = begin, end - begin, period
    still = np.ones(n, dtype=bool)
    still[moving_joints(chain, task)] = False
    spans[still, 1] = 0.0
    return spans


def _period(chain: Chain, j: int) -> float:
    # Return the smallest number of turns, in rad, that leaves all elements or all loops unchanged.
    moved = chain.table.joint == j
    if np.any(chain.table.by_d[moved] != 0.0):
        return math.inf
    if chain.loops:
        return math.tau if chain.closure.is_periodic()[j] else math.inf
    ratios = chain.table.by_theta[moved]
    turns = (k for k in range(1, MAX_TURNS + 1) if np.all(k * ratios == np.round(k * ratios)))
    return math.tau * next(turns, math.inf)
