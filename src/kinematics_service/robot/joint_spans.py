"""Over which positions of its joints singular poses of an arm are looked for: known once."""

import math

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .chain import poses_and_jacobians
from .clearance_bounds import moving_joints
from .task import Task

# A turn of a joint after which J is the same to this share of its largest entries is a period;
# turns of geared joints that are tried.
SAME, TURNS = 1e-9, (1, 2, 3, 4)
# Somewhere, for the test of that, rad or m.
SOMEWHERE = 0.3


def joint_spans(chain: Chain, task: Task, limits: Floats) -> Floats:
    """
    Return where each joint begins and how far it reaches, and its period, (n, 3).

    In rad, a prismatic joint divided by the length. Reach 0: it changes the rank of J_t nowhere.
    The period is endless where there is none; then a joint reaches as far as its limits, and by
    `kernel.FARTHEST` beyond, or a turn, where it has none. A joint of a closed loop reaches as far
    as its limits: beyond, the loops may not close.
    """
    n, scales = chain.dof, task.column_scales
    if not chain.entries:
        return np.tile([-math.pi, 0.0, math.inf], (n, 1))
    spans = np.zeros((n, 3))
    low, high = limits.T / scales
    for j in range(n):
        period = _period(chain, j) if chain.closure is None else _period_of_loops(chain, j)
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
    poses = np.full((1 + len(TURNS), chain.dof), SOMEWHERE)
    poses[1:, j] += np.array(TURNS) * math.tau
    _, J = poses_and_jacobians(chain, poses)
    # Linear rows apart from angular ones: they are as small as the arm is.
    parts = np.abs(J).reshape(len(poses), 2, -1), np.abs(J - J[0]).reshape(len(poses), 2, -1)
    largest, changes = (np.max(part, axis=2) for part in parts)
    same = np.all(changes <= SAME * largest[0], axis=1)
    turns = [turn for turn, one in zip(TURNS, same[1:]) if one]
    return turns[0] * math.tau if turns else math.inf


def _period_of_loops(chain: Chain, j: int) -> float:
    # A joint that slides has none, nor has one whose turn does not leave its loops as they are.
    slides = np.any(chain.table.by_d[chain.table.joint == j] != 0.0)
    assert chain.closure is not None
    return math.tau if chain.closure.is_periodic()[j] and not slides else math.inf
