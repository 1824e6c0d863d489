# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find joint positions at which the closed loops of an arm close, by random sampling."""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, Floats

BATCH_SIZE = 20  # number of joint configurations in one call of the kernel
# Stop the sampling if less than one in MAX_TRIES_PER_POSE samples closes the loops. Such a
# sampling is slow, because a sample that does not close the loops takes the most time.
MAX_TRIES_PER_POSE = 5
# Lowest number of samples that close the loops. If fewer close the loops, sample again around the
# position `assembled` of the robot file, within the radii SEARCH_RADII (rad or m), largest first.
MIN_CLOSED_POSES = 100
SEARCH_RADII = (1.0, 0.3, 0.1, 0.03, 0.01)
SEED = 20240523


def close_at(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Solve the loop equations of a chain at joint positions, and return whether the loops close.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.

    Returns
    -------
    Two arrays. The first, shape (N, width), has one row for each row of q: the positions and rates
    of all joints, the derivatives of the passive joints, and more numbers. `kernel.Closure` lists
    the numbers of such a row, and calls the row a section. The second array, shape (N,), is 0 if
    all loops close. Otherwise it is the number of a group of loops that cannot be closed, counted
    from the last group: 1 is the last group.
    """
    sections = np.empty((len(q), chain.closure.width))
    failed = np.empty(len(q))
    kernel.close_at(chain, np.ascontiguousarray(q), sections, failed)
    return sections, failed


def closes_at(chain: Chain, q: Floats) -> npt.NDArray[np.bool_]:
    """
    Return whether the loops of a chain close at joint positions (..., n).

    The result is True if the chain has no loops.
    """
    if chain.loops == 0:
        return np.full(q.shape[:-1], True)
    return np.reshape(close_at(chain, q.reshape(-1, chain.dof))[1] == 0.0, q.shape[:-1])


def tried_poses(chain: Chain, q: Floats) -> tuple[Floats, int]:
    """
    Return the configurations in q (N, n) at which the loops of a chain close, and the number of
    tried configurations.

    The function stops early if the loops close at less than one in MAX_TRIES_PER_POSE tried
    configurations.
    """
    batches: list[Floats] = []
    closed, tried = 0, 0
    while tried < len(q) and tried <= MAX_TRIES_PER_POSE * closed:
        batch = q[tried : tried + BATCH_SIZE]
        batches.append(batch[closes_at(chain, batch)])
        closed, tried = closed + len(batches[-1]), tried + len(batch)
    return np.concatenate([q[:0], *batches]), tried


def closed_poses(chain: Chain, q: Floats) -> Floats:
    """
    Return the configurations in q (N, n) at which the loops of a chain close.

    If the chain has no loops, the result is q. If the loops close at fewer than MIN_CLOSED_POSES
    configurations, the function samples more configurations around the position `assembled` of the
    robot file. At this position the loops close.
    """
    if chain.loops == 0:
        return q
    closed, _ = tried_poses(chain, q)
    if len(closed) >= MIN_CLOSED_POSES:
        return closed
    random = np.random.default_rng(SEED)
    assembled = chain.closure.assembled()
    for radius in SEARCH_RADII:
        units = np.minimum(chain.closure.units(), 1.0)
        steps = random.uniform(-1.0, 1.0, (10 * MIN_CLOSED_POSES, chain.dof))
        around = assembled + radius * units * steps
        closed = np.concatenate([closed, tried_poses(chain, around)[0]])
        if len(closed) >= MIN_CLOSED_POSES:
            break
    return np.asarray(np.concatenate([closed, assembled[None]]))
