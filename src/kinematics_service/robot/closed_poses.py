"""Find poses of an arm at which its closed loops close, by trying random poses."""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, Floats

BATCH_SIZE = 20  # poses that are tried at a time
# Stop when more poses than this were tried for each pose that closes: a pose that does not close
# costs as much time as many that close.
MAX_TRIES_PER_POSE = 5
# If fewer poses close, try poses around the known position, in these radii (rad or m) one after
# another.
MIN_CLOSED_POSES = 100
SEARCH_RADII = (1.0, 0.3, 0.1, 0.03, 0.01)
SEED = 20240523


def close_at(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Return the kernel's numbers of the loops at each pose, and which group does not close.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.

    Returns
    -------
    shape (N, width) as `kernel.Closure` documents, shape (N,) 0 or the group counted from the last
    """
    sections = np.empty((len(q), chain.closure.width))
    failed = np.empty(len(q))
    kernel.close_at(chain, np.ascontiguousarray(q), sections, failed)
    return sections, failed


def closes_at(chain: Chain, q: Floats) -> npt.NDArray[np.bool_]:
    """Return for poses (..., n) whether the loops of a chain close there; always without loops."""
    if chain.loops == 0:
        return np.full(q.shape[:-1], True)
    return np.reshape(close_at(chain, q.reshape(-1, chain.dof))[1] == 0.0, q.shape[:-1])


def tried_poses(chain: Chain, q: Floats) -> tuple[Floats, int]:
    """
    Return the poses of (N, n) at which the loops of a chain close, and how many were tried.

    It stops when it has tried more than MAX_TRIES_PER_POSE poses for each that closes.
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
    Return the poses of (N, n) at which the loops of a chain close; all poses without loops.

    `tried_poses` finds them. If fewer than MIN_CLOSED_POSES close, poses around the known position
    follow them.
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
