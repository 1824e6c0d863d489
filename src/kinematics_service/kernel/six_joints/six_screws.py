"""Six screws and the motion they bring about, as a closed chain that may begin at any of them."""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector

# The unit of length is no smaller than this share of the farthest axis' distance.
LEAST_SHARE = 1e-3


def write_inverse(T: Numbers, inverse: Numbers) -> None:
    """Write the inverse of a rigid motion (3, 4)."""
    for i in range(3):
        inverse[4 * i + 3] = 0.0
        for j in range(3):
            inverse[4 * i + j] = T[4 * j + i]
            inverse[4 * i + 3] -= T[4 * j + i] * T[4 * j + 3]


class SixScrews:
    """
    Six screws whose product is a motion: e1 ... e6 = goal, lengths in a unit of its own.

    e2 ... e6 (goal^-1 e1 goal) = goal is the same equation, and so are its inverses.

    Attributes
    ----------
    screws : shape (6, 7)
        Axis, point, 1 where it slides; the points are the feet nearest to an origin on axis 3.
    goal : shape (3, 4)
        The motion.
    order : shape (6,)
        Which screw of the arm each is.
    length
        The unit of length, m.
    """

    def __init__(self) -> None:
        self.screws, self.goal = arrays.rooms(42, 12)
        (self.order,) = arrays.whole_rooms(6)
        self.length = 1.0

    def close(self, screws: Flat, T: Numbers, first: int, backwards: bool) -> None:
        """Begin the loop of an arm's screws and motion at one of them, forwards or backwards."""
        back = [0.0] * 12
        write_inverse(T, back)
        for k in range(12):
            self.goal[k] = back[k] if backwards else T[k]
            if backwards:
                back[k] = T[k]
        for j in range(6):
            k = (first + j) % 6
            source = 5 - k if backwards else k
            axis, point = vectors.axis_of(screws, source), vectors.point_of(screws, source)
            if backwards:
                axis = (-axis[0], -axis[1], -axis[2])
            if first + j >= 6:
                axis, point = vectors.times_vector(back, axis), vectors.times_point(back, point)
            self.order[j] = source
            self._put(j, axis, point, screws[7 * source + 6])
        self._choose_unit()

    def _put(self, k: int, axis: Vector, point: Vector, slides: float) -> None:
        screw = arrays.after(self.screws, 7 * k)
        screw[0], screw[1], screw[2] = axis[0], axis[1], axis[2]
        screw[3], screw[4], screw[5] = point[0], point[1], point[2]
        screw[6] = slides

    def _choose_unit(self) -> None:
        # The origin: on axis 3, next to the middle of the points.
        away = [0.0] * 6
        origin, axis = vectors.point_of(self.screws, 2), vectors.axis_of(self.screws, 2)
        middle: Vector = (0.0, 0.0, 0.0)
        for k in range(6):
            middle = vectors.plus(middle, 1.0 / 6.0, vectors.point_of(self.screws, k))
        along = vectors.dot(axis, vectors.plus(middle, -1.0, origin))
        origin = vectors.plus(origin, along, axis)
        # The unit is the median of the distances to it: one long link must not make all short.
        for k in range(6):
            v = vectors.plus(vectors.point_of(self.screws, k), -1.0, origin)
            distance = math.sqrt(vectors.dot(v, v))
            i = k
            while i > 0 and away[i - 1] > distance:
                away[i] = away[i - 1]
                i -= 1
            away[i] = distance
        length = max(0.5 * (away[2] + away[3]), LEAST_SHARE * away[5])
        self.length = length if length > 0.0 else 1.0
        self._move_origin(origin)

    def _move_origin(self, origin: Vector) -> None:
        share = 1.0 / self.length
        for k in range(6):
            axis = vectors.axis_of(self.screws, k)
            v = vectors.plus(vectors.point_of(self.screws, k), -1.0, origin)
            v = vectors.plus(v, -vectors.dot(axis, v), axis)
            foot = (share * v[0], share * v[1], share * v[2])
            self._put(k, axis, foot, self.screws[7 * k + 6])
        moved = vectors.plus(vectors.times_point(self.goal, origin), -1.0, origin)
        self.goal[3], self.goal[7] = share * moved[0], share * moved[1]
        self.goal[11] = share * moved[2]
