"""
Postures of arms with a closed form: shoulder, elbow, wrist.

"""

import math

from . import arrays, places, vectors
from .arrays import Floats, Integers, Vector


def _sign(value: float, size: float) -> int:
    if abs(value) <= 1e-9 * size:
        return 0
    return 1 if value > 0.0 else -1


def write_posture(way: int, screws: Floats, point: Vector, psi: Floats, signs: Integers) -> None:
    """
    Write the posture of one row of `postures`.

    """
    signs[0], signs[1], signs[2] = 0, 0, 0
    z1, z2 = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    o1, o2 = vectors.point_of(screws, 0), vectors.point_of(screws, 1)
    side = vectors.cross(z2, z1)
    elbow = vectors.cross(z2, vectors.axis_of(screws, 2))
    turn_2 = not vectors.slides(screws, 1)
    has_shoulder = not vectors.slides(screws, 0) and turn_2 and vectors.dot(side, side) > 1e-9
    has_elbow = turn_2 and not vectors.slides(screws, 2) and vectors.dot(elbow, elbow) < 1e-12
    # The tool of joints 1 to 3, in the frame joint 1 carries along.
    end = point
    if way == places.PARALLEL_AXES:
        end = vectors.moved(screws, 3, psi[3], end)
    end = vectors.moved(screws, 1, psi[1], vectors.moved(screws, 2, psi[2], end))
    if has_shoulder:
        reach = vectors.plus(end, -1.0, o1)
        signs[0] = _sign(vectors.dot(side, reach), math.sqrt(vectors.dot(reach, reach)))
    if has_elbow and has_shoulder:
        tip = end
        if way == places.PARALLEL_AXES:
            tip = vectors.moved(screws, 2, psi[2], vectors.point_of(screws, 3))
            tip = vectors.moved(screws, 1, psi[1], tip)
        chord = vectors.plus(tip, -1.0, o2)
        chord = vectors.plus(chord, -vectors.dot(chord, z2), z2)
        upper = vectors.moved(screws, 1, psi[1], vectors.point_of(screws, 2))
        upper = vectors.plus(upper, -1.0, o2)
        upper = vectors.plus(upper, -vectors.dot(upper, z2), z2)
        square = vectors.dot(chord, chord)
        if square > 0.0:
            off = vectors.plus(upper, -vectors.dot(upper, chord) / square, chord)
            signs[1] = _sign(vectors.dot(off, z1), math.sqrt(vectors.dot(upper, upper)))
    if way != places.POSITION_3:
        a = vectors.axis_of(screws, 4)
        first = vectors.turned(a, -psi[4], vectors.axis_of(screws, 3))
        across = vectors.cross(first, a)
        signs[2] = _sign(vectors.dot(across, vectors.axis_of(screws, 5)), 1.0)


def postures(way: int, screws: Floats, point: Floats, psi: Floats, signs: Integers) -> None:
    """
    Fill `signs` (N, 3) with 1, -1 or 0 (none): shoulder right, elbow up, wrist not flipped.

    Parameters
    ----------
    way, screws, point
        As `inverse_candidates` takes them.
    psi : shape (N, k), rad or m
        Positions of the screws.
    signs : shape (N, 3)
        The postures.

    """
    count, k = arrays.extent(psi, 0), arrays.extent(psi, 1)
    table = arrays.numbers(screws, 7 * k)
    start = vectors.three(arrays.numbers(point, 3), 0)
    positions = arrays.numbers(psi, 0)
    result = arrays.whole_results(signs, 3 * count)
    for i in range(count):
        write_posture(
            way, table, start, arrays.after(positions, i * k), arrays.whole_after(result, 3 * i)
        )
