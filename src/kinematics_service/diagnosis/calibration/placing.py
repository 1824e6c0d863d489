"""Where base and tool are to begin with, found in spite of single rows that are far off."""

from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...rigid_motion import nearest_rotation
from ..frame_check.offsets import fit_offsets

# Rounds in which the worst rows are left out, the share of the rows that is kept, and steps to the
# base and the tool of positions.
ROUNDS, KEPT, STEPS = 3, 0.7, 40


class Offsets(NamedTuple):
    """X and Y, each (4, 4), of B = X A Y, and the remainder (N,) of the positions, m."""

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
    A, B : shape (N, 4, 4)
        Of the file, and measured.
    positions
        Whether the measured ones are positions alone: then Y is a translation.
    free
        What may differ.
    """
    rows = np.arange(len(A))
    found = _offsets(A, B, positions, free)
    for _ in range(ROUNDS):
        order = np.argsort(found.remainder, kind='stable')
        rows = order[: max(3, round(KEPT * len(A)))]
        some = _offsets(A[rows], B[rows], positions, free)
        found = _with_remainder(some.base, some.tool, A, B)
    return found


def _offsets(A: Floats, B: Floats, positions: bool, free: Free) -> Offsets:
    X, Y = np.eye(4), np.eye(4)
    if free.base and free.tool:
        X, Y = _of_positions(A, B) if positions else _of_poses(A, B)
    elif free.base:
        X = _placed(B[:, :3, 3], A[:, :3, 3]) if positions else _mean(B @ np.linalg.inv(A))
    elif free.tool:
        Y = _mean(np.linalg.inv(A) @ B)
        if positions:
            Y[:3, :3] = np.eye(3)
    return _with_remainder(X, Y, A, B)


def _with_remainder(X: Floats, Y: Floats, A: Floats, B: Floats) -> Offsets:
    M = X @ A @ Y
    return Offsets(X, Y, np.linalg.norm(B[:, :3, 3] - M[:, :3, 3], axis=1))


def _of_poses(A: Floats, B: Floats) -> tuple[Floats, Floats]:
    fit = fit_offsets(A[None], B[None]).one(0)
    return fit.X, fit.Y


def _of_positions(A: Floats, B: Floats) -> tuple[Floats, Floats]:
    # By turns: the base as of points on two bodies (Kabsch 1976), the tool's point by least
    # squares.
    X, Y = np.eye(4), np.eye(4)
    p = B[:, :3, 3]
    for _ in range(STEPS):
        X = _placed(p, (A @ Y)[:, :3, 3])
        # p = X p_A + X R_A y + noise, with y the tool's point and a change of X's translation.
        R = X[:3, :3] @ A[:, :3, :3]
        rest = p - (X @ A)[:, :3, 3]
        M = np.concatenate([np.broadcast_to(np.eye(3), R.shape), R], axis=2).reshape(-1, 6)
        Y[:3, 3] = np.linalg.lstsq(M, rest.reshape(-1), rcond=1e-6)[0][3:]
    return _placed(p, (A @ Y)[:, :3, 3]), Y


def _placed(to: Floats, points: Floats) -> Floats:
    # The rigid motion that brings points (N, 3) nearest to others.
    X = np.eye(4)
    a, b = points.mean(axis=0), to.mean(axis=0)
    X[:3, :3] = nearest_rotation((to - b).T @ (points - a))
    X[:3, 3] = b - X[:3, :3] @ a
    return X


def _mean(motions: Floats) -> Floats:
    X = np.median(motions, axis=0)
    X[:3, :3] = nearest_rotation(X[:3, :3])
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
        What each set has of its own.
    """
    largest = found[int(np.argmax([len(one) for one in A]))]
    result = []
    for a, b, one in zip(A, B, found):
        X = one.base if own.base else largest.base
        Y = one.tool if own.tool else largest.tool
        if own.base and not own.tool and free.base:
            X = _offsets(a @ Y, b, positions, Free(tool=False)).base
        elif own.tool and not own.base and free.tool:
            Y = _offsets(X @ a, b, positions, Free(base=False)).tool
        result.append(_with_remainder(X, Y, a, b))
    return result
