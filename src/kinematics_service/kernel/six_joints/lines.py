# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Represent a line in space by 15 numbers, so that a rigid motion is a linear map of the numbers.

M. Raghavan and B. Roth, "Inverse kinematics of the general 6R manipulator and related linkages",
J. Mech. Des. 115 (1993) 502, use 14 numbers. In this module the number 1 comes before them. Let p
be a point of the line and l its unit direction. Let m = p x l (the Pluecker moment) and
h = (p.p) l - 2 (p.l) p. The line is the vector V = (1, p, p.p, l, p.l, m, h).

If the line moves, V becomes a combination of three vectors V0, V1 and V2, called the parts of the
moved line. The parts are linear functions of V. After a rotation by the angle t, the line is
V0 + cos(t) V1 + sin(t) V2. After a translation by the distance d, it is V0 + d V1 + d^2 V2.
"""

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector

# Number of numbers that represent a line.
LINE = 15
# Index of p, a point of the line, in the 15 numbers of a line.
POINT = 1
# Index of l, the unit direction of the line, in the 15 numbers of a line.
DIRECTION = 5
# Index of m = p x l, the moment of the line, in the 15 numbers of a line.
MOMENT = 9
# Index of the vector h = (p.p) l - 2 (p.l) p in the 15 numbers of a line with the direction l and
# the point p. h is p.p times the mirror image of l in the plane perpendicular to p.
MIRRORED = 12


def put(V: Numbers, at: int, v: Vector) -> None:
    """Write the vector v to V[at], V[at + 1] and V[at + 2]."""
    V[at], V[at + 1], V[at + 2] = v[0], v[1], v[2]


def vector_at(k: int) -> int:
    """
    Return the index in V at which vector k of a line begins: p, l, m or h for k = 0 to 3.

    V = (1, p, p.p, l, p.l, m, h) represents the line with the point p, the unit direction l and
    the moment m. The vector h is (p.p) l - 2 (p.l) p.
    """
    return POINT if k == 0 else DIRECTION if k == 1 else MOMENT if k == 2 else MIRRORED


def write_line(direction: Vector, point: Vector, V: Numbers) -> None:
    """
    Write to V the line through `point` with the unit vector `direction`.

    V has the 15 numbers by which this module represents a line (see the module's docstring).
    """
    square, along = vectors.dot(point, point), vectors.dot(point, direction)
    V[0], V[4], V[8] = 1.0, square, along
    put(V, POINT, point)
    put(V, DIRECTION, direction)
    put(V, MOMENT, vectors.cross(point, direction))
    h = vectors.plus((0.0, 0.0, 0.0), square, direction)
    put(V, MIRRORED, vectors.plus(h, -2.0 * along, point))


def translate(V: Numbers, a: Vector) -> None:
    """Translate the line V (or a linear combination of lines) by the vector a, in place."""
    p, direction = vectors.three(V, POINT), vectors.three(V, DIRECTION)
    moment, h = vectors.three(V, MOMENT), vectors.three(V, MIRRORED)
    square, along = vectors.dot(a, a), vectors.dot(a, direction)
    h = vectors.plus(h, -2.0, vectors.cross(a, moment))
    h = vectors.plus(h, -2.0 * (V[8] + along), a)
    put(V, MIRRORED, vectors.plus(h, square, direction))
    put(V, MOMENT, vectors.plus(moment, 1.0, vectors.cross(a, direction)))
    V[4] += 2.0 * vectors.dot(a, p) + square * V[0]
    V[8] += along
    put(V, POINT, vectors.plus(p, V[0], a))


def carry(V: Numbers, T: Numbers) -> None:
    """Move the line V by a rigid motion T (3, 4), in place."""
    for k in range(4):
        at = vector_at(k)
        put(V, at, vectors.times_vector(T, vectors.three(V, at)))
    translate(V, (T[3], T[7], T[11]))


def write_parts(screws: Numbers, k: int, V: Numbers, parts: Flat) -> None:
    """
    Write to `parts` (3, 15) the parts of the line V (15 numbers) after a motion by screw k.

    If the screw is a rotation by the angle t, the moved line is parts[0] + cos(t) parts[1] +
    sin(t) parts[2]. If it is a translation by d, the moved line is parts[0] + d parts[1] +
    d^2 parts[2].
    """
    axis, point = vectors.axis_of(screws, k), vectors.point_of(screws, k)
    arrays.copy(parts, LINE, V)
    arrays.fill(arrays.after(parts, LINE), 2 * LINE, 0.0)
    if vectors.slides(screws, k):
        _write_slide_parts(axis, V, parts)
        return
    # Rotate about the axis: move the axis to the origin, apply Rodrigues' formula, and move the
    # axis back.
    translate(parts, (-point[0], -point[1], -point[2]))
    for j in range(4):
        at = vector_at(j)
        v = vectors.three(parts, at)
        along = vectors.dot(axis, v)
        put(parts, at, (along * axis[0], along * axis[1], along * axis[2]))
        put(parts, LINE + at, vectors.plus(v, -along, axis))
        put(parts, 2 * LINE + at, vectors.cross(axis, v))
    for j in range(3):
        translate(arrays.after(parts, LINE * j), point)


def _write_slide_parts(axis: Vector, V: Numbers, parts: Numbers) -> None:
    # The line V, translated by d times the axis, is V + d P1 + d^2 P2. Writes P1 and P2 to rows 1
    # and 2 of `parts` (3, 15).
    p, direction = vectors.three(V, POINT), vectors.three(V, DIRECTION)
    moment = vectors.three(V, MOMENT)
    along = vectors.dot(axis, direction)
    zero = (0.0, 0.0, 0.0)
    put(parts, LINE + POINT, vectors.plus(zero, V[0], axis))
    parts[LINE + 4] = 2.0 * vectors.dot(axis, p)
    parts[LINE + 8] = along
    put(parts, LINE + MOMENT, vectors.cross(axis, direction))
    h = vectors.plus(zero, -2.0, vectors.cross(axis, moment))
    put(parts, LINE + MIRRORED, vectors.plus(h, -2.0 * V[8], axis))
    parts[2 * LINE + 4] = V[0]
    put(parts, 2 * LINE + MIRRORED, vectors.plus(direction, -2.0 * along, axis))


def write_invariants(screws: Numbers, k: int, V: Numbers, six: Numbers) -> None:
    """
    Write to `six` (6,) the invariants of the line V: they do not change if screw k moves the line.

    V has 15 numbers (see the module's docstring). Each invariant is a linear combination of them.
    """
    axis, point = vectors.axis_of(screws, k), vectors.point_of(screws, k)
    moved = [0.0] * 15
    arrays.copy(moved, LINE, V)
    if vectors.slides(screws, k):
        side = vectors.across(axis)
        p = vectors.three(V, POINT)
        six[0] = vectors.dot(side, p)
        six[1] = vectors.dot(vectors.cross(axis, side), p)
        six[2], six[3], six[4] = V[DIRECTION], V[DIRECTION + 1], V[DIRECTION + 2]
        six[5] = vectors.dot(axis, vectors.three(V, MOMENT))
        return
    translate(moved, (-point[0], -point[1], -point[2]))
    six[0] = vectors.dot(axis, vectors.three(moved, DIRECTION))
    six[1] = vectors.dot(axis, vectors.three(moved, POINT))
    six[2], six[3] = moved[4], moved[8]
    six[4] = vectors.dot(axis, vectors.three(moved, MOMENT))
    six[5] = vectors.dot(axis, vectors.three(moved, MIRRORED))
