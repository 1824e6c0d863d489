# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Estimate the poses of base and tool, from which a fit starts, by least trimmed squares.

Poses with the largest residuals are left out, so single wrong poses do not change the estimate.
"""

from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ..checking.offsets import fit_offsets, nearest_rotation

# Number of rounds of least trimmed squares (Rousseeuw 1984). Each round fits base and tool to the
# measured poses that had the smallest residuals in the previous round.
TRIM_ROUNDS = 3
# Share of the measured poses that each round of least trimmed squares uses.
TRIMMED_SHARE = 0.7
# Number of steps that fit the base and a point of the tool to measured positions. Each step first
# fits the point and then the rotation of the base.
PLACING_STEPS = 40
# The position of the measured point in the tool frame is fitted to measured positions. If a
# coordinate of the point changes by c, the predicted positions change by d (RMS). The coordinate
# is left at 0 if d < MIN_RATIO * c.
MIN_RATIO = 1e-6


class Offsets(NamedTuple):
    """
    Base offset X and tool offset Y, each (..., 4, 4), from poses A of the robot file to measured
    poses B: B = X A Y.

    `remainder` has the lengths (..., N) of the position residuals, m.
    """

    base: Floats
    tool: Floats
    remainder: Floats


class Free(NamedTuple):
    """
    Flags: the offset of the base, or of the tool, is estimated if True; otherwise it stays as in
    the robot file.
    """

    base: bool = True
    tool: bool = True


def offsets_of(A: Floats, B: Floats, positions: bool, free: Free) -> Offsets:
    """
    Fit the base offset X and the tool offset Y by least trimmed squares.

    Let A be poses of the robot file, and B the measured poses. The fit solves B = X A Y.

    Parameters
    ----------
    A, B : shape (N, 4, 4), or (H, N, 4, 4) of H problems that are solved at once
        Poses computed from the robot file, and measured poses.
    positions
        Whether B has measured positions alone: then Y is a translation.
    free
        Whether base (X) and tool (Y) are estimated; else they are the identity.
    """
    if A.ndim == 3:
        return Offsets(*(values[0] for values in offsets_of(A[None], B[None], positions, free)))
    offsets, problem = _offsets(A, B, positions, free), np.arange(len(A))[:, None]
    for _ in range(TRIM_ROUNDS):
        order = np.argsort(offsets.remainder, axis=1, kind='stable')
        rows = order[:, : max(3, round(TRIMMED_SHARE * A.shape[1]))]
        trimmed = _offsets(A[problem, rows], B[problem, rows], positions, free)
        offsets = _with_remainder(trimmed.base, trimmed.tool, A, B)
    return offsets


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
    # Let p_B be the measured positions, p_A and R_A the positions and rotations of the robot
    # file's poses, and y the measured point in the tool frame. Solve p_B = X (p_A + R_A y) for the
    # base offset X and for y. First subtract from p_B, p_A and R_A their means over the N
    # measurements. This eliminates the translation of X. Each step then solves for y (least
    # squares) and for the rotation of X (Kabsch 1976). The steps need only sums over the
    # measurements. These sums are computed once.
    p, p_A, R_A = B[..., :3, 3], A[..., :3, 3], A[..., :3, :3]
    to, of, by = (array - array.mean(axis=1, keepdims=True) for array in (p, p_A, R_A))
    still, turning = np.einsum('hni,hnj->hij', to, of), np.einsum('hni,hnjk->hkij', to, by)
    along = np.einsum('hnjk,hnj->hk', by, of)
    values, vectors = np.linalg.eigh(np.einsum('hnji,hnjk->hik', by, by))
    determined = values > MIN_RATIO**2 * A.shape[1]
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=determined)
    y = np.zeros((len(A), 3))
    R = nearest_rotation(still)
    for _ in range(steps):
        right = np.einsum('hkij,hij->hk', turning, R) - along
        y = np.einsum('hik,hk,hjk,hj->hi', vectors, inverse, vectors, right)
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
    A: list[Floats], B: list[Floats], fits: list[Offsets], positions: bool, free: Free, own: Free
) -> list[Offsets]:
    """
    Return the offsets for each of several sets of poses. A base that all sets share is taken from
    the largest set, and so is a tool that all sets share.

    Parameters
    ----------
    A, B : one array for each set, each of shape (N, 4, 4)
        Poses computed from the robot file, and measured poses.
    fits
        Offsets of each set, fitted to this set alone.
    positions
        Whether only positions were measured.
    free
        Whether base and tool are estimated; else they are the identity.
    own
        Two flags: whether each set has its own base, and whether each set has its own tool.
    """
    largest = fits[int(np.argmax([len(poses) for poses in A]))]
    result = []
    for a, b, fit in zip(A, B, fits):
        X = fit.base if own.base else largest.base
        Y = fit.tool if own.tool else largest.tool
        if own.base and not own.tool and free.base:
            X = _offsets((a @ Y)[None], b[None], positions, Free(tool=False)).base[0]
        elif own.tool and not own.base and free.tool:
            Y = _offsets((X @ a)[None], b[None], positions, Free(base=False)).tool[0]
        lengths = _with_remainder(X[None], Y[None], a[None], b[None]).remainder[0]
        result.append(Offsets(X, Y, lengths))
    return result
