# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check that the numbers of a target pose are finite, its rotation is orthogonal, and its last row is
0 0 0 1.

A matrix R is a rotation if R R^T = 1 and det R = 1. The error of a rotation is the largest element
of |R R^T - 1|.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats

# Targets whose rotation error exceeds this are refused. Matrices printed with four digits are
# accepted.
MAX_ROTATION_ERROR = 1e-3
# Rotations with an error up to this number are used unchanged. The number is the round-off of a
# product of a few rotation matrices.
EXACT_ROTATION_ERROR = 1e-13


def rotation_error(T: Flat) -> float:
    """
    Return the error of the rotation in a pose (4, 4), max |R R^T - 1|; infinite if det R is
    negative.
    """
    largest = 0.0
    for i in range(3):
        for j in range(i + 1):
            a, b = vectors.three(T, 4 * i), vectors.three(T, 4 * j)
            largest = max(largest, abs(vectors.dot(a, b) - (1.0 if i == j else 0.0)))
    a, b = vectors.three(T, 0), vectors.three(T, 4)
    if vectors.dot(vectors.cross(a, b), vectors.three(T, 8)) < 0.0:
        return places.INFINITY
    return largest


def take_target(target: Floats, pose: Floats) -> int:
    """
    Copy a target to `pose` and check the target; return FINE, ROUGH, NOT_FINE or NOT_RIGID.

    - FINE: the pose can be used.
    - ROUGH: the rotation has to be made orthogonal before the pose is used.
    - NOT_FINE: a number is not finite.
    - NOT_RIGID: the rotation or the last row is wrong.

    Parameters
    ----------
    target : shape (16,) or (3,)
        Pose (4, 4) row by row, or position; lengths in m.
    pose : shape (4, 4)
        Overwritten by the target. If the target is a position, only the last column is
        overwritten, so pass the identity.
    """
    size = arrays.size(target)
    numbers = arrays.numbers(target, 3 if size == 3 else 16)
    written = arrays.results(pose, 16)
    for k in range(size):
        if not math.isfinite(numbers[k]):
            return places.NOT_FINE
    if size == 3:
        for i in range(3):
            written[4 * i + 3] = numbers[i]
        return places.FINE
    arrays.copy(written, 16, numbers)
    error = rotation_error(numbers)
    if error > MAX_ROTATION_ERROR or numbers[15] != 1.0:
        return places.NOT_RIGID
    if numbers[12] != 0.0 or numbers[13] != 0.0 or numbers[14] != 0.0:
        return places.NOT_RIGID
    return places.FINE if error <= EXACT_ROTATION_ERROR else places.ROUGH
