# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Fit constant offsets of base and tool between two sources of poses: X and Y of B_i = X A_i Y.

Most functions compute H independent fits at once, for example one fit for each hypothesis about a
mistake. A further fit costs little time.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...kernel import Floats
from ...rigid_motion import exponential, rotation_vector, skew_part

Flags = npt.NDArray[np.bool_]

# Largest number of Levenberg-Marquardt steps in a fit of the offsets of base and tool.
MAX_STEPS = 12
# Stop if a step reduces the score (RMS residual) by less than one part in 1e9.
GAIN_TOLERANCE = 1e-9
# Damping after the first failed step (Levenberg-Marquardt), in units of the largest eigenvalue of
# J^T J.
FIRST_DAMPING = 1e-3
# The tool positions are taken as one point if spread / far is below this value. Here `spread` is
# the RMS distance of the positions from the mean position, and `far` is the RMS distance of the
# positions from the origin of the base frame.
POINT_SPREAD_RATIO = 0.05
# The poses do not determine a direction of the 12 offset coordinates (base and tool) if its
# singular value, divided by the largest singular value of the Jacobian, is below this ratio.
WEAK_RATIO = 1e-4
# The rotation from one tool pose to another has an angle and an axis. Take the vectors
# sin(angle) * axis of many pairs of poses, and the principal axes of this set of vectors. If the
# RMS of the components along the second principal axis is below this value, the tool is taken to
# turn about one axis only.
AXIS_VARIETY = 0.02


def nearest_rotation(M: Floats) -> Floats:
    """Return the rotations R (..., 3, 3) that maximize trace(R^T M): Procrustes (Kabsch 1976)."""
    U, _, Vt = np.linalg.svd(M)
    U = np.array(U)
    U[..., :, 2] *= np.linalg.det(U @ Vt)[..., None]
    return np.asarray(U @ Vt)


class Fit(NamedTuple):
    """
    The results of H independent fits: offsets and residuals. `fit.one(k)` is the result of fit k.

    Each fit compares N poses A_i of the robot file with N poses B_i of a second source.

    Attributes
    ----------
    X, Y : shape (H, 4, 4)
        The base offset X and the tool offset Y. The fit brings X A_i Y near to B_i.
    position, rotation : shape (H, N, 3)
        Residuals between B_i and X A_i Y, in the base axes of the second source: position in m,
        rotation vector in rad.
    score : shape (H,)
        RMS of all residuals of a fit, rad. Position residuals are divided by the length that
        `scale_of` returns.
    """

    X: Floats
    Y: Floats
    position: Floats
    rotation: Floats
    score: Floats

    def one(self, k: int) -> 'Fit':
        """Return the result of fit k: entry k of each array."""
        return Fit(*(values[k] for values in self))


def lifted(fit: Fit) -> Fit:
    """Return the result of one fit with a leading dimension H = 1 of each array."""
    return Fit(*(np.asarray(values)[None] for values in fit))


def spread(positions: Floats) -> Floats:
    """Return the RMS distance of points (..., N, 3) from their mean, shape (...,)."""
    away = positions - positions.mean(axis=-2, keepdims=True)
    return np.asarray(np.sqrt(np.mean(np.sum(away**2, axis=-1), axis=-1)))


def scale_of(poses: Floats) -> Floats:
    """
    Return the length (...,) by which position residuals are divided: the RMS distance of the tool
    positions from their mean.

    A position residual of this length has the weight of a rotation residual of 1 rad. So the fit
    does not depend on the unit of the positions. If the positions hardly move, the length is 5 %
    of their distance from the origin.
    """
    p = poses[..., :3, 3]
    far = np.sqrt(np.mean(np.sum(p**2, axis=-1), axis=-1))
    return np.asarray(np.maximum(np.maximum(spread(p), POINT_SPREAD_RATIO * far), 1e-9))


def least_angles(A: Floats, B: Floats) -> Floats:
    """
    Return a lower bound (H,) of the RMS rotation residuals (rad) between poses A and B (H, N, 4,
    4), for any base and tool offsets X and Y.
    """
    # Let A_i and B_i be the rotations of pose i in A and B, and a_i the angle of the rotation
    # residual of pose i. Let D_ij = trace(B_i^T B_j) - trace(A_i^T A_j). Then
    # |D_ij| <= 2 (a_i + a_j), and so D_ij^2 <= 8 (a_i^2 + a_j^2). The mean of D_ij^2 over all i
    # and j is therefore at most 16 times the mean of a_i^2.
    off = _traces(B) - _traces(A)
    return np.asarray(np.sqrt(np.mean(off**2, axis=(1, 2)) / 16.0))


def _traces(poses: Floats) -> Floats:
    # Return trace(B_i^T B_j) of the rotations of poses (H, N, 4, 4), shape (H, N, N).
    flat = poses[..., :3, :3].reshape(*poses.shape[:2], 9)
    return flat @ np.swapaxes(flat, 1, 2)


def fit_offsets(A: Floats, B: Floats, begin: Fit | None = None, steps: int = MAX_STEPS) -> Fit:
    """
    Return the offsets X and Y that bring X A_i Y nearest to B_i, and the residuals.

    Parameters
    ----------
    A, B : shape (H, N, 4, 4)
        Poses of the two sources.
    begin
        Initial offsets; default: those that a closed form gives.
    steps
        Largest number of Levenberg-Marquardt steps.
    """
    scale = scale_of(B)[:, None, None]
    X, Y = _closed_form(A, B, scale) if begin is None else (begin.X, begin.Y)
    fixed = np.zeros((*A.shape[:2], 6, 0))
    return fit_numbers(
        lambda _: (A, fixed), fixed[:, 0, 0], B, fit_at(A, B, X, Y, scale), steps
    ).fit


def fit_at(A: Floats, B: Floats, X: Floats, Y: Floats, scale: Floats) -> Fit:
    """
    Return the residuals between B_i and X A_i Y for given offsets X and Y, as a `Fit`.

    For the score, position residuals are divided by the length `scale` (H, 1, 1), m.
    """
    M = X[:, None] @ A @ Y[:, None]
    position = B[..., :3, 3] - M[..., :3, 3]
    rotation = rotation_vector(B[..., :3, :3] @ np.swapaxes(M[..., :3, :3], -1, -2))
    squares = np.sum((position / scale) ** 2, axis=-1) + np.sum(rotation**2, axis=-1)
    return Fit(X, Y, position, rotation, np.sqrt(np.mean(squares, axis=-1)))


def _better(fit: Fit, new: Fit) -> Fit:
    # Return the better result of each of H fits: the result with the smaller score.
    return Fit(*_chosen(new.score < fit.score, new, fit))


def _chosen(mask: Flags, some: Sequence[Floats], others: Sequence[Floats]) -> Iterator[Floats]:
    # `some` and `others` are two results of H fits, each a sequence of arrays. Yield arrays that
    # have entry k of `some` if mask[k] is True, and entry k of `others` if mask[k] is False.
    for array, other in zip(some, others):
        yield np.where(mask.reshape(-1, *[1] * (array.ndim - 1)), array, other)


def residual(fit: Fit, scale: Floats) -> Floats:
    """
    Return the residuals, shape (H, 6 N): for each pose the position divided by the scale, then the
    rotation.
    """
    rows = np.concatenate([fit.position / scale, fit.rotation], axis=-1)
    return rows.reshape(len(rows), -1)


def jacobian(A: Floats, fit: Fit, scale: Floats) -> Floats:
    """
    Return the derivatives (H, 6 N, 12) of the poses X A Y by motions of the base and of the tool.

    X is the base offset, and Y is the tool offset. The rows are in the order of `residual`. The
    first six columns are for the linear motion v (divided by the scale) and the angular motion w
    of the base. The last six columns are for v and w of the tool.

    Let p be the position and R the rotation of X A Y. A motion (v, w) of the base, in base axes,
    changes p by v + w x p and turns R by w. A motion (v, w) of the tool, in tool axes, changes p
    by R v and turns R by R w.
    """
    M = fit.X[:, None] @ A @ fit.Y[:, None]
    R, p = M[..., :3, :3], M[..., :3, 3] / scale
    J = np.zeros((*p.shape[:2], 6, 12))
    J[..., :3, 0:3] = J[..., 3:, 3:6] = np.eye(3)
    J[..., 0, 4], J[..., 0, 5] = p[..., 2], -p[..., 1]
    J[..., 1, 3], J[..., 1, 5] = -p[..., 2], p[..., 0]
    J[..., 2, 3], J[..., 2, 4] = p[..., 1], -p[..., 0]
    J[..., :3, 6:9] = J[..., 3:, 9:12] = R
    return J.reshape(len(J), -1, 12)


def number_columns(A: Floats, fit: Fit, columns: Floats, scale: Floats) -> Floats:
    """
    Return the derivatives (H, 6 N, c) of the poses X A Y by c numbers of the robot file.

    The rows are in the order of `residual`: for each pose the position divided by `scale`, then
    the rotation.

    Parameters
    ----------
    A : shape (H, N, 4, 4)
        Poses that are computed from the robot file: N poses in each of H independent fits.
    fit
        The base offsets X and the tool offsets Y.
    columns : shape (H, N, 6, c)
        Derivatives of A by the numbers: linear and angular motion of the tool in base axes.
    scale : shape (H, 1, 1), m
        A position residual of this length has the weight of a rotation residual of 1 rad.
    """
    lever = A[..., :3, :3] @ fit.Y[:, None, :3, 3:]
    linear = columns[..., :3, :] + np.cross(columns[..., 3:, :], lever, axis=-2)
    RX = fit.X[:, None, :3, :3]
    rows = np.concatenate([RX @ linear / scale[..., None], RX @ columns[..., 3:, :]], axis=-2)
    return rows.reshape(len(A), 6 * A.shape[1], columns.shape[-1])


def equations_of(A: Floats, fit: Fit, scale: Floats) -> tuple[Floats, Floats]:
    """
    Return the derivatives (6 N, 12) of the poses X A Y by the offsets X and Y of `fit`, and the
    residuals (6 N,) of `fit`. A (N, 4, 4) are N poses that are computed from the robot file.
    """
    scales = np.reshape(scale, (1, 1, 1))
    return jacobian(A[None], lifted(fit), scales)[0], residual(lifted(fit), scales)[0]


class NumberFit(NamedTuple):
    """
    The results of H independent fits of numbers of the robot file.

    Attributes
    ----------
    values : shape (H, c)
        The c fitted numbers of each fit.
    fit
        The offsets of base and tool that were fitted together with the numbers.
    """

    values: Floats
    fit: Fit


def fit_numbers(
    moved: Callable[[Floats], tuple[Floats, Floats]],
    values: Floats,
    B: Floats,
    begin: Fit,
    steps: int,
) -> NumberFit:
    """
    Fit numbers of the robot file together with the base offset X and the tool offset Y.

    Let A be the poses that the robot file gives, and B the poses of a second source. The fit
    brings the poses X A Y nearest to B. The function computes H independent fits at once: the
    first dimension of each array has the length H.

    Parameters
    ----------
    moved
        Function that returns the robot's poses A (H, N, 4, 4) for c numbers of the robot file,
        shape (H, c). It also returns the derivatives (H, N, 6, c) of A by these numbers.
    values : shape (H, c)
        Initial numbers of the robot file.
    B : shape (H, N, 4, 4)
        Poses of the second source.
    begin
        Initial offsets.
    steps
        Largest number of Levenberg-Marquardt steps.
    """
    scale = scale_of(B)[:, None, None]
    A, columns = moved(values)
    fit = fit_at(A, B, begin.X, begin.Y, scale)
    damping = np.zeros((len(values), 1))
    for _ in range(steps):
        J = np.concatenate(
            [jacobian(A, fit, scale), number_columns(A, fit, columns, scale)], axis=-1
        )
        step = solved(J, residual(fit, scale), damping)
        tried = values + step[:, 12:], *moved(values + step[:, 12:])
        new = fit_at(tried[1], B, *moved_offsets(fit.X, fit.Y, step, scale), scale)
        less = new.score < fit.score
        gained = np.max(1.0 - new.score / np.maximum(fit.score, 1e-300), initial=0.0)
        values, A, columns = _chosen(less, tried, (values, A, columns))
        fit = _better(fit, new)
        damping = np.where(less[:, None], 0.1 * damping, np.maximum(10.0 * damping, FIRST_DAMPING))
        if np.max(np.abs(step)) < GAIN_TOLERANCE or (np.all(less) and gained < GAIN_TOLERANCE):
            break
    return NumberFit(values, fit)


def solved(J: Floats, r: Floats, damping: Floats | float = 0.0) -> Floats:
    """
    Return the least-squares solution s of J s = r with the least norm, shape (H, k).

    `damping` is in units of the largest eigenvalue of J^T J.
    """
    # Solve by the normal equations. They suffice, because the dozen unknown offset coordinates
    # have equal scales, and the next Levenberg-Marquardt step corrects the round-off.
    Jt = np.swapaxes(J, 1, 2)
    values, vectors = np.linalg.eigh(Jt @ J)
    strong = values > WEAK_RATIO**2 * values[:, -1:]
    values = values + damping * values[:, -1:]
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=strong)
    g = np.swapaxes(vectors, 1, 2) @ (Jt @ r[..., None])
    return np.asarray((vectors @ (inverse[..., None] * g))[..., 0])


def span_of(J: Floats) -> Floats:
    """Return an orthonormal basis (6 N, k) of the column space of J (6 N, 12)."""
    # Use eigenvectors of J^T J, because they are ten times faster than a QR if BLAS threads wait
    # for each other.
    values, vectors = np.linalg.eigh(J.T @ J)
    strong = values > WEAK_RATIO**2 * values[-1]
    return np.asarray(J @ (vectors[:, strong] / np.sqrt(values[strong])))


def free_directions(J: Floats) -> Floats:
    """
    Return an orthonormal basis (f, 12) of the offset changes that the poses do not determine.

    The 12 coordinates of a change are the motions of base and tool. J (6 N, 12) has the
    derivatives of N poses by these coordinates, as `equations_of` returns them.
    """
    values, vectors = np.linalg.eigh(J.T @ J)
    return np.asarray(vectors[:, ~(values > WEAK_RATIO**2 * values[-1])].T)


def moved_offsets(X: Floats, Y: Floats, step: Floats, scale: Floats) -> tuple[Floats, Floats]:
    """
    Return the offsets X and Y (H, 4, 4) after small motions of base and tool. The entries of
    `step` (H, 12) are in the order of the columns of `jacobian`.
    """
    return _small(step[:, :6], scale) @ X, Y @ _small(step[:, 6:12], scale)


def _small(step: Floats, scale: Floats) -> Floats:
    T = np.zeros((len(step), 4, 4))
    T[:, :3, :3], T[:, :3, 3] = exponential(step[:, 3:6]), scale[:, 0] * step[:, :3]
    T[:, 3, 3] = 1.0
    return T


def _closed_form(A: Floats, B: Floats, scale: Floats) -> tuple[Floats, Floats]:
    # Return the offsets with the smallest RMS residual. `_rotations` gives several candidates for
    # the rotations of X and Y; each gets the translations that fit best.
    fits = (_translated(A, B, scale, *rotations) for rotations in _rotations(A, B))
    best = reduce(_better, fits)
    return best.X, best.Y


def _translated(A: Floats, B: Floats, scale: Floats, RX: Floats, RY: Floats) -> Fit:
    X, Y = np.zeros((len(A), 4, 4)), np.zeros((len(A), 4, 4))
    X[:, :3, :3], Y[:, :3, :3] = RX, RY
    X[:, 3, 3] = Y[:, 3, 3] = 1.0
    # Solve p_B = t_X + R_X p_A + R_X R_A t_Y, which is linear in the translations t_X and t_Y.
    RXA = RX[:, None] @ A[..., :3, :3]
    M = np.concatenate([np.broadcast_to(np.eye(3), RXA.shape), RXA], axis=-1)
    right = B[..., :3, 3] - np.einsum('hij,hnj->hni', RX, A[..., :3, 3])
    t = solved(M.reshape(len(A), -1, 6), right.reshape(len(A), -1))
    X[:, :3, 3], Y[:, :3, 3] = t[:, :3], t[:, 3:]
    return fit_at(A, B, X, Y, scale)


def _rotations(A: Floats, B: Floats) -> list[tuple[Floats, Floats]]:
    # Return candidates for the rotations R_X and R_Y of the base offset X and the tool offset Y.
    # If B_i = X A_i Y, then B_i^-1 B_j turns about R_Y^T a, where a is the axis of A_i^-1 A_j
    # (Park and Martin 1994). The fit uses skew parts instead of axes. The skew part of a rotation
    # is sin(angle) times its axis, and is a smooth function of the rotation.
    RA, RB = A[..., :3, :3], B[..., :3, :3]
    n = A.shape[1]
    a, b = [], []
    for shift in {max(1, n // 7), max(1, n // 3), max(1, n // 2)}:
        a.append(skew_part(np.swapaxes(RA, -1, -2) @ np.roll(RA, -shift, axis=1)))
        b.append(skew_part(np.swapaxes(RB, -1, -2) @ np.roll(RB, -shift, axis=1)))
    alpha, beta = np.concatenate(a, axis=1), np.concatenate(b, axis=1)
    axes, strengths, _ = np.linalg.svd(np.swapaxes(alpha, 1, 2) @ alpha / alpha.shape[1])
    RY = nearest_rotation(np.swapaxes(alpha, 1, 2) @ beta)
    RX = nearest_rotation(np.einsum('hnij,hnkj->hik', RB, RA @ RY[:, None]))
    pairs = [(RX, RY)]
    if np.sqrt(np.median(strengths[:, 1])) < AXIS_VARIETY:
        RX = RX @ _about_the_axis(A, B, RX, axes[:, :, 0])
        pairs.append((RX, nearest_rotation(np.einsum('hnji,hnjk->hik', RX[:, None] @ RA, RB))))
    # Add a candidate whose X is computed from positions alone. It is a good start if the tool
    # turns little or is close to the flange.
    pA = A[..., :3, 3] - A[..., :3, 3].mean(axis=1, keepdims=True)
    pB = B[..., :3, 3] - B[..., :3, 3].mean(axis=1, keepdims=True)
    RX = nearest_rotation(np.swapaxes(pB, 1, 2) @ pA)
    pairs.append((RX, nearest_rotation(np.einsum('hnji,hnjk->hik', RX[:, None] @ RA, RB))))
    return pairs


def _about_the_axis(A: Floats, B: Floats, RX: Floats, axis: Floats) -> Floats:
    # If the tool turns about one axis only, orientations do not determine the turn of the base
    # offset X about this axis. Return this turn as a rotation (H, 3, 3), computed from positions.
    # Let u be the unknown angle of the turn, and R_X the rotation of X without the turn. Let p be
    # the position of a pose in A, and p_B, R_B the position and rotation of the same pose in B.
    # Split p into `still` along the axis and `across` perpendicular to the axis; side = axis x p.
    # Let t be the unknown translation of X, and s an unknown vector that depends on the tool
    # offset. Then p_B = t + R_B s + R_X (cos(u) across + sin(u) side + still). This equation is
    # linear in t, s, cos(u) and sin(u).
    p = A[..., :3, 3]
    axis = np.einsum('hnij,hj->hi', A[..., :3, :3], axis) / p.shape[1]
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
    still = np.einsum('hni,hi,hj->hnj', p, axis, axis)
    ways = np.stack([p - still, np.cross(axis[:, None], p)], axis=-1)
    M = np.broadcast_to(np.eye(3), (*p.shape, 3))
    M = np.concatenate([M, B[..., :3, :3], RX[:, None] @ ways], axis=-1)
    right = B[..., :3, 3] - np.einsum('hij,hnj->hni', RX, still)
    solution = solved(M.reshape(len(p), -1, 8), right.reshape(len(p), -1))
    return exponential(np.arctan2(solution[:, 7], solution[:, 6])[:, None] * axis)
