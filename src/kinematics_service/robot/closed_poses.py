"""Poses of an arm at which its closed loops close."""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, Floats

# Poses are tried so many at a time, and no more where fewer than one of five of them closes: a
# pose that does not close costs as much as many that do.
AT_A_TIME, ONE_OF = 20, 5
# Where fewer close than this, others are looked for around the assembly, ever nearer to it.
FEW, AROUND, SEED = 100, (1.0, 0.3, 0.1, 0.03, 0.01), 20240523


def close_at(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Return what the kernel says of the loops of a chain at each pose, and which does not close.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.

    Returns
    -------
    shape (N, width) as `kernel.Closure` says, shape (N,) 0 or the group counted from the last
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
    Return those of many poses at which the loops of a chain close, and how many were tried.

    Not all are where fewer than one of five closes.
    """
    found: list[Floats] = []
    closed, tried = 0, 0
    while tried < len(q) and ONE_OF * closed >= tried:
        some = q[tried : tried + AT_A_TIME]
        found.append(some[closes_at(chain, some)])
        closed, tried = closed + len(found[-1]), tried + len(some)
    return np.concatenate([q[:0], *found]), tried


def closed_poses(chain: Chain, q: Floats) -> Floats:
    """
    Return those of many poses at which the loops of a chain close, all of them without loops.

    As `tried_poses` finds them. Where they are few, others around the known position are put
    behind them.
    """
    if chain.loops == 0:
        return q
    found, _ = tried_poses(chain, q)
    if len(found) >= FEW:
        return found
    random = np.random.default_rng(SEED)
    assembled = chain.closure.assembled()
    for share in AROUND:
        units = np.minimum(chain.closure.units(), 1.0)
        near = assembled + share * units * random.uniform(-1.0, 1.0, (10 * FEW, chain.dof))
        found = np.concatenate([found, tried_poses(chain, near)[0]])
        if len(found) >= FEW:
            break
    return np.asarray(np.concatenate([found, assembled[None]]))
