# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the equation of six screws and a target as a closed loop that may begin at any screw.

The product of the exponentials e1 to e6 of the six screws (R. W. Brockett, "Robotic manipulators
and the product of exponentials formula", 1984) is e1 ... e6 = goal. The equation e2 ... e6
(goal^-1 e1 goal) = goal is equivalent. It is the equation of a loop that begins with joint 2.
Repeated, this step makes any joint the first. If both sides are inverted, the loop runs backwards.
"""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector
from . import lines

# A loop has a unit of length: the median of the distances from the origin to the six axes (to a
# stored point of each axis). If four axes meet, this median may be 0 or as small as the errors of
# a calibration. Coordinates in such a unit would be huge. So the unit is at least MIN_UNIT_RATIO
# times the largest of the six distances.
MIN_UNIT_RATIO = 1e-3


def write_motion(pose: Numbers, home_inverse: Numbers, T: Numbers) -> None:
    """
    Write to T (3, 4) the motion of the tool from rest to `pose`; `home_inverse` is the inverse of
    the rest pose.
    """
    for i in range(3):
        for j in range(4):
            T[4 * i + j] = 0.0
            for k in range(4):
                T[4 * i + j] += pose[4 * i + k] * home_inverse[4 * k + j]


def write_inverse(T: Numbers, inverse: Numbers) -> None:
    """Write to `inverse` (3, 4) the inverse of a rigid motion T (3, 4)."""
    for i in range(3):
        inverse[4 * i + 3] = 0.0
        for j in range(3):
            inverse[4 * i + j] = T[4 * j + i]
            inverse[4 * i + 3] -= T[4 * j + i] * T[4 * j + 3]


class SixScrews:
    """
    The six screws and the goal of a closed loop. Lengths are in a unit that is chosen for the
    loop.

    Attributes
    ----------
    screws : shape (6, 7)
        For each screw: the direction of its axis, a point on the axis, and 1 if the screw is
        prismatic. The point is the foot of the perpendicular from the origin; the origin is on
        axis 3.
    goal : shape (3, 4)
        The rigid motion that the product of the six screw motions must equal.
    order : shape (6,)
        Index in the arm, from 0, of each screw of the loop.
    length
        The unit of length, m.
    """

    def __init__(self) -> None:
        self.screws, self.goal = arrays.rooms(42, 12)
        (self.order,) = arrays.whole_rooms(6)
        self.length = 1.0

    def close(self, screws: Flat, T: Numbers, first: int, backwards: bool) -> None:
        """
        Set up the closed loop that the six screws of an arm form with the tool motion T.

        `screws` (6, 7) are the screws of the arm. T is the motion of the tool from its rest pose
        to the target. The loop begins at screw `first`. If `backwards` is set, the loop runs in
        the reverse direction.
        """
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
        lines.put(screw, 0, axis)
        lines.put(screw, 3, point)
        screw[6] = slides

    def _choose_unit(self) -> None:
        # For each axis, a point on it is stored. Choose the origin: compute the mean of the six
        # stored points, and project it onto axis 3.
        distances = [0.0] * 6
        origin, axis = vectors.point_of(self.screws, 2), vectors.axis_of(self.screws, 2)
        mean: Vector = (0.0, 0.0, 0.0)
        for k in range(6):
            mean = vectors.plus(mean, 1.0 / 6, vectors.point_of(self.screws, k))
        along = vectors.dot(axis, vectors.plus(mean, -1.0, origin))
        origin = vectors.plus(origin, along, axis)
        # Choose the unit of length: the median of the distances from the origin to the six stored
        # points. With the median, one long link does not change the unit.
        for k in range(6):
            v = vectors.plus(vectors.point_of(self.screws, k), -1.0, origin)
            distance = math.sqrt(vectors.dot(v, v))
            i = k
            while i > 0 and distances[i - 1] > distance:
                distances[i] = distances[i - 1]
                i -= 1
            distances[i] = distance
        length = max(0.5 * (distances[2] + distances[3]), MIN_UNIT_RATIO * distances[5])
        self.length = length if length > 0.0 else 1.0
        self._move_origin(origin)

    def _move_origin(self, origin: Vector) -> None:
        scale = 1.0 / self.length
        for k in range(6):
            axis = vectors.axis_of(self.screws, k)
            v = vectors.plus(vectors.point_of(self.screws, k), -1.0, origin)
            v = vectors.plus(v, -vectors.dot(axis, v), axis)
            foot = (scale * v[0], scale * v[1], scale * v[2])
            self._put(k, axis, foot, self.screws[7 * k + 6])
        moved = vectors.plus(vectors.times_point(self.goal, origin), -1.0, origin)
        self.goal[3], self.goal[7] = scale * moved[0], scale * moved[1]
        self.goal[11] = scale * moved[2]
