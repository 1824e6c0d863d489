"""The start of base and tool by least trimmed squares: single wrong rows do not matter."""

from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ..checking.offsets import fit_offsets, nearest_rotation

# Rounds of least trimmed squares (Rousseeuw 1984), which fit the nearest rows of the last round.
TRIM_ROUNDS = 3
# The share of the rows that is kept.
TRIMMED_SHARE = 0.7
# Steps by turns to the base and the tool of positions.
PLACING_STEPS = 40
# A coordinate of the tool's point stays 0 if moving it moves the positions by less than 1e-6 of
# that motion: the positions do not determine it.
MIN_RATIO = 1e-6


class Offsets(NamedTuple):
    """X and Y, each (..., 4, 4), of B = X A Y, and the remainder (..., N) of the positions, m."""

    base: Floats
    tool: Floats
    remainder: Floats


class Free(NamedTuple):
    """Whether base and tool are to be found; otherwise they are as in the robot file."""

    base: bool = True
    tool: bool = True


def offsets_of(A: Floats, B: Floats, positions: bool, free: Free) -> Offsets:
    """
    Return the offsets between the poses of a robot file and measured ones, most rows counting.

    Parameters
    ----------
    A, B : shape (N, 4, 4), or (H, N, 4, 4) of H problems that are solved at once
        Poses of the file, and measured poses.
    positions
        Whether the measured ones are positions alone: then Y is a translation.
    free
        Whether base and tool may differ.
    """
    if A.ndim == 3:
        return Offsets(*(values[0] for values in offsets_of(A[None], B[None], positions, free)))
    found, each = _offsets(A, B, positions, free), np.arange(len(A))[:, None]
    for _ in range(TRIM_ROUNDS):
        order = np.argsort(found.remainder, axis=1, kind='stable')
        rows = order[:, : max(3, round(TRIMMED_SHARE * A.shape[1]))]
        some = _offsets(A[each, rows], B[each, rows], positions, free)
        found = _with_remainder(some.base, some.tool, A, B)
    return found


def _offsets(A: Floats, B: Floats, positions: bool, free: Free) -> Offsets:
    X, Y = np.tile(np.eye(4), (2, len(A), 1, 1))
    if free.base and free.tool:
        X, Y = _of_positions(A, B) if positions else fit_offsets(A, B)[:2]
    elif free.base:
        X = _of_positions(A, B, 0)[0] if positions else _mean(B @ np.linalg.inv(A))
    elif free.tool:
        Y = _mean(np.linalg.inv(A) @ B)
        if positions:
            Y[:, :3, :3] = np.eye(3)
    return _with_remainder(X, Y, A, B)


def _with_remainder(X: Floats, Y: Floats, A: Floats, B: Floats) -> Offsets:
    M = X[:, None] @ A @ Y[:, None]
    return Offsets(X, Y, np.linalg.norm(B[..., :3, 3] - M[..., :3, 3], axis=-1))


def _of_positions(A: Floats, B: Floats, steps: int = PLACING_STEPS) -> tuple[Floats, Floats]:
    # p_B = X (p_A + R_A y), with y the tool's point, about the means: the base by turns as of
    # points on two bodies (Kabsch 1976), the point by least squares. Sums over the rows are all
    # that this takes.
    p, p_A, R_A = B[..., :3, 3], A[..., :3, 3], A[..., :3, :3]
    to, of, by = (one - one.mean(axis=1, keepdims=True) for one in (p, p_A, R_A))
    still, turning = np.einsum('hni,hnj->hij', to, of), np.einsum('hni,hnjk->hkij', to, by)
    along = np.einsum('hnjk,hnj->hk', by, of)
    values, vectors = np.linalg.eigh(np.einsum('hnji,hnjk->hik', by, by))
    told = values > MIN_RATIO**2 * A.shape[1]
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=told)
    y = np.zeros((len(A), 3))
    R = nearest_rotation(still)
    for _ in range(steps):
        rest = np.einsum('hkij,hij->hk', turning, R) - along
        y = np.einsum('hik,hk,hjk,hj->hi', vectors, inverse, vectors, rest)
        R = nearest_rotation(still + np.einsum('hk,hkij->hij', y, turning))
    X, Y = np.tile(np.eye(4), (2, len(A), 1, 1))
    X[:, :3, :3], Y[:, :3, 3] = R, y
    points = p_A.mean(axis=1) + np.einsum('hij,hj->hi', R_A.mean(axis=1), y)
    X[:, :3, 3] = p.mean(axis=1) - np.einsum('hij,hj->hi', R, points)
    return X, Y


def _mean(motions: Floats) -> Floats:
    X = np.median(motions, axis=-3)
    X[..., :3, :3] = nearest_rotation(X[..., :3, :3])
    return np.asarray(X)


def shared_offsets(
    A: list[Floats], B: list[Floats], found: list[Offsets], positions: bool, free: Free, own: Free
) -> list[Offsets]:
    """
    Return the offsets of several sets of poses, base or tool being that of the largest set.

    Parameters
    ----------
    A, B : sets, each of shape (N, 4, 4)
        Poses of the file, and measured ones.
    found
        Offsets of each set by itself.
    own
        The placements that each set has of its own.
    """
    largest = found[int(np.argmax([len(one) for one in A]))]
    result = []
    for a, b, one in zip(A, B, found):
        X = one.base if own.base else largest.base
        Y = one.tool if own.tool else largest.tool
        if own.base and not own.tool and free.base:
            X = _offsets((a @ Y)[None], b[None], positions, Free(tool=False)).base[0]
        elif own.tool and not own.base and free.tool:
            Y = _offsets((X @ a)[None], b[None], positions, Free(base=False)).tool[0]
        left = _with_remainder(X[None], Y[None], a[None], b[None]).remainder[0]
        result.append(Offsets(X, Y, left))
    return result
