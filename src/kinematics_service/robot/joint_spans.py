# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the range of each joint in which the kernel samples the arm's singular poses."""

import math

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .clearance_bounds import moving_joints
from .task import Task

# If a gear turns a row of the table by a fraction of the joint's angle, all links have the same
# poses again only after several turns of the joint. At most this number of turns is tried.
MAX_TURNS = 4


def joint_spans(chain: Chain, task: Task, limits: Floats) -> Floats:
    """
    Return, for each joint, the range in which it is sampled: begin, length and period, (n, 3),
    rad.

    The period of a joint is the angle after which all links have the same poses again. If a joint
    has a period, its range is one period. A joint without a period has the period inf. Its range
    is from `kernel.FARTHEST` (1 rad) below the lower limit to `kernel.FARTHEST` above the upper
    limit, or one turn if it has no limits. For an arm with closed loops, the range ends at the
    limits, because the loops may not close beyond the limits. The length is 0 if the joint never
    changes the rank of J_t. Positions of prismatic joints are divided by the characteristic
    length.
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
    # Return the period of joint j in rad: the smallest number of whole turns after which all links
    # of the arm have the same poses again. Return infinity if the number is above MAX_TURNS.
    moved = chain.table.joint == j
    if np.any(chain.table.by_d[moved] != 0.0):
        return math.inf
    if chain.loops:
        return math.tau if chain.closure.is_periodic()[j] else math.inf
    ratios = chain.table.by_theta[moved]
    turns = (k for k in range(1, MAX_TURNS + 1) if np.all(k * ratios == np.round(k * ratios)))
    return math.tau * next(turns, math.inf)
