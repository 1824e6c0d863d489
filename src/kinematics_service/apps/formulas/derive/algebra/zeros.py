# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Decide whether polynomials have a common zero in a box, by Newton-Kantorovich and by bisection.

The theorem of Newton and Kantorovich proves a zero near a point of the box. Bisection proves that
no zero exists: it halves the box until in each part some polynomial cannot be 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .....kernel import Floats
from .numeric import Numbers, smallest_step, values_and_gradients

# Largest distance of a proved zero from the configuration in `Zero.pose`, rad or unit of length.
ZERO_DISTANCE = 1e-9
# Round-off of a sum of a few hundred terms, relative to the sum of their absolute values.
ROUND_OFF = 1e-13
# Largest number of steps of Newton's method. After every STEPS_PER_CHECK steps, the theorem of
# Newton and Kantorovich is applied to the points with the smallest function values.
STEPS = 32
STEPS_PER_CHECK = 8
# A check applies the theorem of Newton and Kantorovich to this number of points. It takes the
# points with the smallest function values.
CHECKED_POSES = 10
# Bisection ends undecided after this number of evaluated polynomial terms, which takes seconds.
MAX_TERM_EVALUATIONS = 100_000_000
# Bisection ends undecided after this number of evaluated boxes.
MAX_BOXES = 200_000
BATCH_SIZE = 4096  # number of boxes evaluated at once, which bounds the memory


@dataclass(frozen=True, eq=False)
class Box:
    """
    Joint positions between bounds.

    Attributes
    ----------
    low, high : shape (n,)
        Bounds in rad or the file's unit of length; infinite if a prismatic joint is not limited.
    """

    low: Floats
    high: Floats


@dataclass(frozen=True, eq=False)
class Zero:
    """
    The result of a search for a common zero in a box.

    Attributes
    ----------
    exists
        Whether a zero exists; None if this is not decided.
    pose
        The n joint positions, in the box and within 1e-9 of a zero; None if no zero is proved.
    """

    exists: bool | None
    pose: tuple[float, ...] | None


def common_zero(functions: Sequence[Numbers], box: Box, starts: Floats) -> Zero:
    """
    Return whether polynomials have a common zero in a box, and the zero if one is proved.

    Parameters
    ----------
    functions
        Polynomials of the same joint variables.
    box
        The box to search.
    starts : shape (N, n)
        Configurations in the box at which Newton's method starts.
    """
    # If a prismatic joint is unlimited, search its positions up to twice the largest position in
    # `starts`. Search larger positions d with the variable t = 1 / d.
    free = np.isinf(box.low) | np.isinf(box.high)
    reach = np.where(free, 2 * np.max(np.abs(starts), axis=0) + 1e-6, np.inf)
    near = Box(np.maximum(box.low, -reach), np.minimum(box.high, reach))
    pose = _shown(functions, starts, near)
    if pose is not None:
        return Zero(True, pose)
    moving = np.any([f.moving for f in functions], axis=0)
    zero = _halved(functions, near, moving)
    indices = np.flatnonzero(free & moving)
    if zero.exists is not False or not len(indices):
        return zero
    if len(indices) > 1:
        return Zero(None, None)
    k = int(indices[0])
    far = Box(np.array(near.low), np.array(near.high))
    far.low[k] = -1.0 / reach[k] if np.isinf(box.low[k]) else 0.0
    far.high[k] = 1.0 / reach[k] if np.isinf(box.high[k]) else 0.0
    beyond = _halved([f.in_reciprocal(k) for f in functions], far, moving)
    return zero if beyond.exists is False else Zero(None, None)


def _bends(functions: Sequence[Numbers], largest: Floats) -> Floats:
    # Return bounds of the second derivatives of the m functions for |q| <= largest, shape (..., m,
    # n, n).
    bounds = [
        [[second.magnitude(largest) for second in first.firsts] for first in f.firsts]
        for f in functions
    ]
    return np.moveaxis(np.array(bounds), (0, 1, 2), (-3, -2, -1))


def _round_off(functions: Sequence[Numbers], largest: Floats) -> Floats:
    return ROUND_OFF * np.stack([f.magnitude(largest) for f in functions], axis=-1)


def _shown(functions: Sequence[Numbers], q: Floats, box: Box) -> tuple[float, ...] | None:
    # Take least-norm Newton steps inside the box. Return a point with a proved zero near it, or
    # None. If a joint is at a bound of the box and a step would leave the box, the joint stays at
    # the bound.
    for count in range(STEPS + 1):
        f, G = values_and_gradients(functions, q)
        if count % STEPS_PER_CHECK == 0:
            for k in np.argsort(np.max(np.abs(f), axis=-1))[:CHECKED_POSES]:
                if _has_zero_beside(functions, q[k], f[k], G[k]):
                    return tuple(q[k].tolist())
        step = _step(f, G)
        held = ((q <= box.low) & (step < 0)) | ((q >= box.high) & (step > 0))
        step = np.where(held, 0.0, _step(f, np.where(held[:, None, :], 0.0, G)))
        longest = np.max(np.abs(step), axis=-1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))
        q = np.clip(q, box.low, box.high)
    return None


def _step(f: Floats, G: Floats) -> Floats:
    size = np.einsum('kij,kij->k', G, G)[:, None, None]
    return smallest_step(f, G, 1e-13 * size + 1e-200)


def _has_zero_beside(functions: Sequence[Numbers], q: Floats, f: Floats, G: Floats) -> bool:
    # Theorem of Kantorovich: let G+ be the pseudoinverse of the gradients G, |G+| = b and
    # |G+ f| = s. Let the gradients change by at most K per unit of q. If b K s <= 1/2, the
    # distance of a zero from q is at most 2 * s.
    sigma = np.linalg.svd(G, compute_uv=False)
    if len(sigma) < len(f) or sigma[-1] <= 1e-9 * sigma[0]:
        return False
    largest = np.abs(q) + ZERO_DISTANCE
    size = float(np.linalg.norm(np.abs(f) + _round_off(functions, largest)))
    inverse = 2.0 / float(sigma[-1])
    if inverse * size > ZERO_DISTANCE / 2:
        return False
    change = float(np.linalg.norm(_bends(functions, largest)))
    return inverse * inverse * change * size <= 0.5


def _halved(functions: Sequence[Numbers], box: Box, moving: Floats) -> Zero:
    middle, half = (box.low + box.high) / 2, np.where(moving, (box.high - box.low) / 2, 0.0)
    # Enlarge the box by a margin, so that round-off does not exclude zeros on its boundary.
    centers, radii = middle[None], np.where(moving, half + ZERO_DISTANCE, 0.0)[None]
    terms = sum(len(f.value.terms()) for f in functions) * (1 + len(middle))
    budget = min(MAX_BOXES, MAX_TERM_EVALUATIONS // max(1, terms))
    while len(centers):
        budget -= len(centers)
        if budget < 0:
            return Zero(None, None)
        parts = [
            _undecided(functions, centers[k : k + BATCH_SIZE], radii[k : k + BATCH_SIZE])
            for k in range(0, len(centers), BATCH_SIZE)
        ]
        centers, radii, sizes, along = (np.concatenate(part) for part in zip(*parts))
        nearest = np.argsort(sizes)[:CHECKED_POSES]
        pose = _shown(functions, centers[nearest], box) if len(centers) else None
        if pose is not None:
            return Zero(True, pose)
        halved = np.arange(len(middle)) == along[:, None]
        radii = np.where(halved, radii / 2, radii)
        shift = np.where(halved, radii, 0.0)
        centers, radii = np.concatenate([centers - shift, centers + shift]), np.tile(radii, (2, 1))
    return Zero(False, None)


def _undecided(
    functions: Sequence[Numbers], centers: Floats, radii: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    # Return centers and radii of the boxes in which every polynomial may be 0. Let f be the value
    # of a polynomial at the center of a box, and r an upper bound of the difference between f and
    # any other value in the box. Return for each box also the largest ratio |f| / r of all
    # polynomials, and the joint along which to halve the box next.
    f, G = values_and_gradients(functions, centers)
    largest = np.abs(centers) + radii
    bends = _bends(functions, largest)
    straight = np.abs(G) * radii[:, None, :]
    bent = np.einsum('kmij,kj->kmi', bends, radii) * radii[:, None, :]
    reach = np.sum(straight + bent / 2, axis=-1) + _round_off(functions, largest)
    kept = np.all(np.abs(f) <= reach, axis=-1)
    # The motion of one joint in the box causes a part of the bound r (`reach`). Compute the ratio
    # of this part to r, and add the ratios over the polynomials. The parts themselves could not be
    # added, because the polynomials have different units.
    fractions = np.sum((straight + bent) / np.maximum(reach, 1e-300)[..., None], axis=1)
    worst = np.max(np.abs(f) / np.maximum(reach, 1e-300), axis=-1)
    return centers[kept], radii[kept], worst[kept], np.argmax(fractions, axis=-1)[kept]
