# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute with vectors of three numbers, and move points along screws.

A screw has seven numbers: its axis (3), a point on the axis (3), and 1 if it is prismatic, else 0.
"""

import math

from ..layout.arrays import Numbers, Vector
from . import chain_pass


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def plus(a: Vector, factor: float, b: Vector) -> Vector:
    """Return a + factor b for two vectors a and b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


def three(numbers: Numbers, at: int) -> Vector:
    """Return the three numbers of the array `numbers` from index `at` on, as a vector."""
    return (numbers[at], numbers[at + 1], numbers[at + 2])


def apart(numbers: Numbers, at: int, step: int) -> Vector:
    """Return the numbers at the indices `at`, at + step and at + 2 step as a vector."""
    return (numbers[at], numbers[at + step], numbers[at + 2 * step])


def axis_of(screws: Numbers, k: int) -> Vector:
    """Return the axis of screw k."""
    return three(screws, 7 * k)


def point_of(screws: Numbers, k: int) -> Vector:
    """Return the stored point on the axis of screw k."""
    return three(screws, 7 * k + 3)


def slides(screws: Numbers, k: int) -> bool:
    """Return whether screw k is prismatic."""
    return screws[7 * k + 6] > 0.5


def turned(axis: Vector, angle: float, v: Vector) -> Vector:
    """Return v rotated by `angle`, rad, about the unit vector `axis` (Rodrigues' formula)."""
    s, c = chain_pass.sincos(angle)
    along = dot(axis, v) * (1.0 - c)
    w = cross(axis, v)
    return (
        c * v[0] + s * w[0] + along * axis[0],
        c * v[1] + s * w[1] + along * axis[1],
        c * v[2] + s * w[2] + along * axis[2],
    )


def moved(screws: Numbers, k: int, value: float, point: Vector) -> Vector:
    """Return `point` moved along screw k by `value`, rad or m."""
    axis = axis_of(screws, k)
    if slides(screws, k):
        return plus(point, value, axis)
    origin = point_of(screws, k)
    return plus(origin, 1.0, turned(axis, value, plus(point, -1.0, origin)))


def angle(axis: Vector, a: Vector, b: Vector, otherwise: float) -> float:
    """
    Return the angle about `axis`, rad, by which a must rotate to point towards b.

    If a is parallel to the axis, every angle is a solution, and the function returns `otherwise`.
    """
    # Project a and b onto the plane normal to the axis. Without this projection, the computed
    # angle of vectors nearly parallel to the axis would be only round-off.
    size = dot(a, a)
    a = plus(a, -dot(axis, a), axis)
    b = plus(b, -dot(axis, b), axis)
    sine, cosine = dot(axis, cross(a, b)), dot(a, b)
    if dot(a, a) <= 1e-30 * size or (sine == 0.0 and cosine == 0.0):
        return otherwise
    return math.atan2(sine, cosine)


def across(axis: Vector) -> Vector:
    """Return a unit vector normal to `axis`."""
    v = cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.6 else (0.0, 1.0, 0.0))
    length = math.sqrt(dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length)


def times_vector(T: Numbers, v: Vector) -> Vector:
    """Return the direction v rotated by the motion T (4 x 4, or its first three rows)."""
    return (
        T[0] * v[0] + T[1] * v[1] + T[2] * v[2],
        T[4] * v[0] + T[5] * v[1] + T[6] * v[2],
        T[8] * v[0] + T[9] * v[1] + T[10] * v[2],
    )


def times_point(T: Numbers, v: Vector) -> Vector:
    """Return the point v moved by the motion T (4 x 4, or its first three rows)."""
    return plus(times_vector(T, v), 1.0, (T[3], T[7], T[11]))
