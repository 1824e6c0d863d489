"""Compute the range of each joint position over which the arm's singular poses are sampled."""

import math

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .clearance_bounds import moving_joints
from .task import Task

MAX_TURNS = 4  # largest number of turns that is tried as the period of a joint


def joint_spans(chain: Chain, task: Task, limits: Floats) -> Floats:
    """
    Return the begin, the length and the period of each joint's sampling range, (n, 3), in rad.

    Positions of prismatic joints are divided by the characteristic length. The length of the range
    is 0 if the joint never changes the rank of J_t. If the joint has no period, its period is
    infinite, and the range goes `kernel.FARTHEST` beyond the limits, or is one turn without
    limits. For an arm with closed loops the range ends at the limits, because the loops may not
    close beyond them.
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
    # Return the period of joint j in rad: the smallest number of whole turns after which the arm
    # is in the same configuration. Return infinity if there is none up to MAX_TURNS.
    moved = chain.table.joint == j
    if np.any(chain.table.by_d[moved] != 0.0):
        return math.inf
    if chain.loops:
        return math.tau if chain.closure.is_periodic()[j] else math.inf
    ratios = chain.table.by_theta[moved]
    turns = (k for k in range(1, MAX_TURNS + 1) if np.all(k * ratios == np.round(k * ratios)))
    return math.tau * next(turns, math.inf)
