# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define arcs: the parts of a solution curve that are inside the joint limits.

Full turns may be added to the joint positions of a part, to bring the part inside the limits.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....robot.chain import FrozenArrays
from ....robot.robot import Robot
from ...clearance import clearances
from .curve import SolutionCurve

SIDES = ('lower', 'upper')
# Inverse golden ratio, (sqrt(5) - 1) / 2, for the golden section search.
INVERSE_GOLDEN_RATIO = 0.6180339887498949
# Number of steps of the golden section search. These steps narrow an interval of 0.1 rad to 1e-9
# rad.
SECTION_COUNT = 38


class IkArcEnd(NamedTuple):
    """
    One end of an arc: the joint limit or the singular pose at which the arc ends.

    Attributes
    ----------
    joint
        Name of the joint at a limit; empty at a singular pose.
    limit
        `lower`, `upper`, or `singular` if the search could not trace the curve farther.
    """

    joint: str
    limit: str


@dataclass(frozen=True, eq=False)
class IkArc(FrozenArrays):
    """
    A continuous joint motion inside the limits during which the tool stays at the target.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Samples along the arc, at most 0.1 rad apart, among them every reversal of a joint.
    s : shape (m,), rad
        Length of the arc from its beginning to each sample. Displacements of prismatic joints are
        divided by the characteristic length.
    closed
        Whether the arc is a closed curve, so that its last sample equals its first sample up to
        full turns.
    ends
        Beginning and end of an arc that is not closed.
    windings
        Number of arcs inside the limits that differ from this arc only by full turns, including
        this arc.
    curve
        The solution curve of which the arc is a part.
    places : shape (m,)
        Place of each sample on the curve. A place is the index of a sample of the curve, plus a
        fraction between two of its samples.
    turn_offset : shape (n,), rad or m
        Full turns, in rad, that are added to joint positions of the curve to get joint positions
        of the arc.
    """

    q: Floats
    s: Floats
    closed: bool
    ends: tuple[IkArcEnd, ...]
    windings: int
    curve: SolutionCurve
    places: Floats
    turn_offset: Floats

    @property
    def limits(self) -> Floats:
        """Return the joint limits, shape (n, 2), rad or m."""
        return self.curve.plan.limits

    @property
    def scales(self) -> Floats:
        """
        Return the numbers (n,) by which joint motions are divided before lengths along the arc are
        computed: 1 for revolute joints, the characteristic length (m) for prismatic joints.
        """
        return self.curve.plan.scales

    @property
    def length(self) -> float:
        """
        Return the length of the arc, rad. Displacements of prismatic joints are divided by the
        characteristic length.
        """
        return float(self.s[-1])

    @property
    def ranges(self) -> Floats:
        """Return the least and the largest position of each joint, shape (n, 2), rad or m."""
        return np.column_stack([self.q.min(axis=0), self.q.max(axis=0)])

    def at(self, s: float) -> Floats:
        """
        Return the joint positions (n,) at length s (rad) along the arc, exact to round-off.

        On an open arc, s is between 0 and `length`. On a closed arc, s may be any number: a new
        lap begins at each multiple of `length`.
        """
        laps = math.floor(s / self.length) if self.closed else 0
        place = np.interp([s - laps * self.length], self.s, self.places)
        return np.asarray(self._at(place)[0] + laps * (self.q[-1] - self.q[0]))

    def _at(self, places: Floats) -> Floats:
        return self.curve.at(places) + self.turn_offset

    def shifted_by(self, turn_offset: Floats) -> 'IkArc':
        """
        Return the arc with the full turns `turn_offset` (n,), in rad, added to its joint
        positions.
        """
        return replace(self, q=self.q + turn_offset, turn_offset=self.turn_offset + turn_offset)

    def margins(self) -> Floats:
        """Return the distance of each sample to the nearest joint limit, shape (m,), rad or m."""
        return self.margin(self.q)

    def margin(self, q: Floats) -> Floats:
        """
        Return the distance of joint positions q (..., n) to the nearest joint limit, rad or m.
        """
        low, high = self.limits.T
        return np.asarray(np.min(np.minimum(q - low, high - q), axis=-1))

    def with_largest_margin(self) -> Floats:
        """Return the joint positions (n,) of the arc that are farthest from the joint limits."""
        rows = np.vstack([self.q, self.at(self.place_of_least(lambda q: -self.margin(q)))])
        return np.array(rows[int(np.argmax(self.margin(rows)))])

    def nearest_to(self, q: Floats) -> Floats:
        """
        Return the joint positions (n,) of the arc that are nearest to q (n,), in the scaled
        2-norm.
        """
        k = int(squares_of((self.q - q) / self.scales).argmin())
        places, local = self._with_neighbours(self.places), q - self.turn_offset
        ends = zip(places[k : k + 2].tolist(), places[k + 1 : k + 3].tolist())
        rows = self._at(np.array([self.curve.nearest(a, b, local) for a, b in ends]))
        return np.array(rows[int(squares_of((rows - q) / self.scales).argmin())])

    def _with_neighbours(self, values: Floats) -> Floats:
        # `values` has a number for each sample of the arc, such as the length. Returns `values`
        # with one number added at each end. On an open arc, the first and the last number are
        # repeated. On a closed arc, the last sample is the first sample again, one lap later. So
        # the number added in front is the second to last number minus the increase over one lap.
        # The number added at the end is the second number plus the increase over one lap.
        before, behind = values[:1], values[-1:]
        if self.closed:
            lap = behind - before
            before, behind = values[-2:-1] - lap, values[1:2] + lap
        return np.concatenate([before, values, behind])

    def with_largest_clearance(self, robot: Robot) -> Floats:
        """
        Return the joint positions (n,) of that sample of the arc which has the largest clearance.
        The clearance is the radius of a ball in joint space that is proved to contain no singular
        pose.
        """
        return np.array(self.q[int(np.argmax(clearances(robot, np.array(self.q))))])

    def place_of_least(self, cost: Callable[[Floats], Floats]) -> float:
        """
        Return the length s (rad) along the arc at which `cost` of the joint positions is least.
        The method is golden section search between the two neighbours of the sample with the least
        cost.
        """
        k = int(np.argmin(cost(self.q)))
        a, at_sample, b = self._with_neighbours(self.s)[k : k + 3].tolist()
        for _ in range(SECTION_COUNT):
            x, y = b - INVERSE_GOLDEN_RATIO * (b - a), a + INVERSE_GOLDEN_RATIO * (b - a)
            a, b = (a, y) if cost(self.at(x)) < cost(self.at(y)) else (x, b)
        return float(min((at_sample, 0.5 * (a + b)), key=lambda s: cost(self.at(s))))


def squares_of(vectors: Floats) -> Floats:
    """
    Return the squared norms (m,) of the rows of `vectors` (m, n), in a third of the time of
    `np.linalg.norm`.
    """
    return np.asarray(np.einsum('ij,ij->i', vectors, vectors))
