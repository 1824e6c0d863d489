"""Targets: whether a target is a pose, and how far it is from one."""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats

# A rotation matrix with four digits is still accepted as one; a better one is taken unchanged.
NEARLY_ROTATION, ROTATION = 1e-3, 1e-13


def off(T: Flat) -> float:
    """Do what `off_rotation` does."""
    most = 0.0
    for i in range(3):
        for j in range(i + 1):
            a, b = vectors.three(T, 4 * i), vectors.three(T, 4 * j)
            most = max(most, abs(vectors.dot(a, b) - (1.0 if i == j else 0.0)))
    a, b = vectors.three(T, 0), vectors.three(T, 4)
    if vectors.dot(vectors.cross(a, b), vectors.three(T, 8)) < 0.0:
        return places.INFINITY
    return most


def off_rotation(T: Floats) -> float:
    """Return how far the rotation of a pose (4, 4) is from orthogonal; infinite for a mirror."""
    return off(arrays.numbers(T, 12))


def take_target(target: Floats, pose: Floats) -> int:
    """
    Write a target into a pose and return FINE, or what is wrong with it; ROUGH: almost a rotation.

    Parameters
    ----------
    target : shape (16,) or (3,)
        Pose, row by row, or position (m).
    pose : shape (4, 4)
        The identity, of which a position changes three numbers only.
    """
    size = arrays.size(target)
    wanted = arrays.numbers(target, 3 if size == 3 else 16)
    written = arrays.results(pose, 16)
    for k in range(size):
        if not math.isfinite(wanted[k]):
            return places.NOT_FINE
    if size == 3:
        for i in range(3):
            written[4 * i + 3] = wanted[i]
        return places.FINE
    arrays.copy(written, 16, wanted)
    from_rotation = off(wanted)
    if from_rotation > NEARLY_ROTATION or wanted[15] != 1.0:
        return places.NOT_RIGID
    if wanted[12] != 0.0 or wanted[13] != 0.0 or wanted[14] != 0.0:
        return places.NOT_RIGID
    return places.FINE if from_rotation <= ROTATION else places.ROUGH
