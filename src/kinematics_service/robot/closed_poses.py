# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find joint positions at which the closed loops of an arm close, by random sampling."""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, Floats

BATCH_SIZE = 20  # joint positions that the kernel tries in one call
# Stop the sampling if the number of samples exceeds this number times the number of samples that
# close the loops. A sample that does not close the loops takes much longer than a sample that
# closes them.
MAX_TRIES_PER_POSE = 5
# If fewer samples than this number close the loops, sample again around the position `assembled`
# of the robot file, within smaller and smaller radii (rad or m).
MIN_CLOSED_POSES = 100
SEARCH_RADII = (1.0, 0.3, 0.1, 0.03, 0.01)
SEED = 20240523


def close_at(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Solve the loop equations of a chain at joint positions. Return the kernel's results for the
    loops, and the group of loops that fails.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.

    Returns
    -------
    The results that `kernel.Closure` documents, shape (N, width), and for each row of q the failed
    group, shape (N,). The failed group is 0 if all loops close, else the number of the group,
    where the last group has the number 1.
    """
    sections = np.empty((len(q), chain.closure.width))
    failed = np.empty(len(q))
    kernel.close_at(chain, np.ascontiguousarray(q), sections, failed)
    return sections, failed


def closes_at(chain: Chain, q: Floats) -> npt.NDArray[np.bool_]:
    """
    Return whether the loops of a chain close at joint positions (..., n); True without loops.
    """
    if chain.loops == 0:
        return np.full(q.shape[:-1], True)
    return np.reshape(close_at(chain, q.reshape(-1, chain.dof))[1] == 0.0, q.shape[:-1])


def tried_poses(chain: Chain, q: Floats) -> tuple[Floats, int]:
    """
    Return the rows of q (N, n) that close the loops of a chain, and the number of tried rows.

    The function stops early if fewer than one in MAX_TRIES_PER_POSE rows closes the loops.
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
    Return the rows of q (N, n) that close the loops of a chain; all rows if it has no loops.

    If fewer than MIN_CLOSED_POSES rows close the loops, the function samples more joint positions
    around the position `assembled` of the robot file. At this position the loops close.
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
