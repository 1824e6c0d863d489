# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the range of each joint in which the kernel samples the arm's singular poses."""

import math

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .clearance_bounds import moving_joints
from .task import Task

# A gear may turn a link by a fraction of the joint's angle, for example by a third. Then all links
# have the same poses again only after several turns of the joint, here after three. If the number
# of turns is above MAX_TURNS, the joint counts as a joint without a period.
MAX_TURNS = 4


def joint_spans(chain: Chain, task: Task, limits: Floats) -> Floats:
    """
    Return, for each joint, the range in which it is sampled: begin, length and period, (n, 3),
    rad.

    The period of a joint is the angle after which all links have the same poses again. A joint
    without such an angle has the period inf. The range depends on the joint:

    - If the joint has a period, the range is one period.
    - If the joint has limits but no period, the range is from 1 rad (`kernel.FARTHEST`) below the
      lower limit to 1 rad above the upper limit. For an arm with closed loops, the range is from
      limit to limit, because the loops may not close beyond the limits.
    - If the joint has neither a period nor limits, the range is one turn.

    If the joint never changes the rank of J_t (the task rows of the Jacobian), the length is 0.
    Positions of prismatic joints are divided by the characteristic length.
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
