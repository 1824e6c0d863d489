"""
Lines as vectors of fifteen numbers, on which rigid motions act linearly.

A line through the point p with the direction l is (1, p, p.p, l, p.l, m, h): m = p x l and
h = l (p.p) - 2 p (p.l). A translation leaves no other terms (Raghavan and Roth 1993 eliminate with
these fourteen equations), so what a joint does is a conic of matrices: a rotation's has parts to
1, cos and sin of its angle, a translation's to 1, d and d^2.
"""

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector

LINE = 15
# Where vectors stand in a line.
POINT, DIRECTION, MOMENT, THIRD = 1, 5, 9, 12


def put(V: Numbers, at: int, v: Vector) -> None:
    """Write a vector from an index on."""
    V[at], V[at + 1], V[at + 2] = v[0], v[1], v[2]


def write_line(direction: Vector, point: Vector, V: Numbers) -> None:
    """Write a line, its direction a unit vector."""
    square, along = vectors.dot(point, point), vectors.dot(point, direction)
    V[0], V[4], V[8] = 1.0, square, along
    put(V, POINT, point)
    put(V, DIRECTION, direction)
    put(V, MOMENT, vectors.cross(point, direction))
    put(
        V,
        THIRD,
        (
            direction[0] * square - 2.0 * point[0] * along,
            direction[1] * square - 2.0 * point[1] * along,
            direction[2] * square - 2.0 * point[2] * along,
        ),
    )


def translate(V: Numbers, a: Vector) -> None:
    """Translate what the parts of lines add up to."""
    p, direction = vectors.three(V, POINT), vectors.three(V, DIRECTION)
    moment, third = vectors.three(V, MOMENT), vectors.three(V, THIRD)
    square, along = vectors.dot(a, a), vectors.dot(a, direction)
    third = vectors.plus(third, -2.0, vectors.cross(a, moment))
    third = vectors.plus(third, -2.0 * (V[8] + along), a)
    put(V, THIRD, vectors.plus(third, square, direction))
    put(V, MOMENT, vectors.plus(moment, 1.0, vectors.cross(a, direction)))
    V[4] += 2.0 * vectors.dot(a, p) + square * V[0]
    V[8] += along
    put(V, POINT, vectors.plus(p, V[0], a))


def carry(V: Numbers, T: Numbers) -> None:
    """Move a line by a rigid motion (3, 4)."""
    for k in range(4):
        at = POINT if k == 0 else DIRECTION if k == 1 else MOMENT if k == 2 else THIRD
        put(V, at, vectors.times_vector(T, vectors.three(V, at)))
    translate(V, (T[3], T[7], T[11]))


def write_parts(screws: Numbers, k: int, V: Numbers, parts: Flat) -> None:
    """Write the three parts (3, 15) of the line that screw k moves V to."""
    axis, point = vectors.axis_of(screws, k), vectors.point_of(screws, k)
    arrays.copy(parts, LINE, V)
    arrays.fill(arrays.after(parts, LINE), 2 * LINE, 0.0)
    if vectors.slides(screws, k):
        _write_slides(axis, V, parts)
        return
    translate(parts, (-point[0], -point[1], -point[2]))
    for j in range(4):
        at = POINT if j == 0 else DIRECTION if j == 1 else MOMENT if j == 2 else THIRD
        v = vectors.three(parts, at)
        along = vectors.dot(axis, v)
        put(parts, at, (along * axis[0], along * axis[1], along * axis[2]))
        put(parts, LINE + at, vectors.plus(v, -along, axis))
        put(parts, 2 * LINE + at, vectors.cross(axis, v))
    _translate_all(parts, point)


def _write_slides(axis: Vector, V: Numbers, parts: Numbers) -> None:
    # What `translate` adds by d times the axis: to d, and to d^2.
    p, direction = vectors.three(V, POINT), vectors.three(V, DIRECTION)
    moment = vectors.three(V, MOMENT)
    along = vectors.dot(axis, direction)
    none = (0.0, 0.0, 0.0)
    put(parts, LINE + POINT, vectors.plus(none, V[0], axis))
    parts[LINE + 4] = 2.0 * vectors.dot(axis, p)
    parts[LINE + 8] = along
    put(parts, LINE + MOMENT, vectors.cross(axis, direction))
    third = vectors.plus(none, -2.0, vectors.cross(axis, moment))
    put(parts, LINE + THIRD, vectors.plus(third, -2.0 * V[8], axis))
    parts[2 * LINE + 4] = V[0]
    put(parts, 2 * LINE + THIRD, vectors.plus(direction, -2.0 * along, axis))


def _translate_all(parts: Flat, point: Vector) -> None:
    for k in range(3):
        translate(arrays.after(parts, LINE * k), point)


def write_invariants(screws: Numbers, k: int, V: Numbers, six: Numbers) -> None:
    """Write six numbers of what lines add up to that screw k leaves as they are."""
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
    six[2] = moved[4]
    six[3] = moved[8]
    six[4] = vectors.dot(axis, vectors.three(moved, MOMENT))
    six[5] = vectors.dot(axis, vectors.three(moved, THIRD))
