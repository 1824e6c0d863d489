# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Add full turns to joint positions. The turns are chosen so that the positions are inside the
limits, if possible, and nearest to reference positions of the caller.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats


class Joints:
    """
    The periods, limits and scales of the joints of an arm. The methods add full turns to joint
    positions, and compute their distances to reference positions and to the limits.

    Parameters
    ----------
    scales : shape (n,), rad or m
        For each joint, the motion that is taken as equal to 1 rad: 1 for a revolute joint, the
        characteristic length for a prismatic joint.
    periods : shape (n,)
        Motion of a joint, rad or m, after which the tool has the same pose; infinite for a joint
        without such a motion.
    limits : shape (n, 2), rad or m
        Position limits; infinite for a joint without limits.
    """

    def __init__(self, scales: Floats, periods: Floats, limits: Floats) -> None:
        self.n = arrays.size(scales)
        self.scales, self.periods = arrays.numbers(scales, self.n), arrays.numbers(periods, self.n)
        self.limits = arrays.numbers(limits, 2 * self.n)

    def without_turns(self, j: int, motion: float) -> float:
        """
        Return a motion of joint j minus full turns. The size of the result is at most half a
        period of the joint.
        """
        period = self.periods[j]
        if not math.isfinite(period):
            return motion
        return motion - period * math.floor(motion / period + 0.5)

    def represent(self, near: Flat, q: Flat) -> None:
        """
        Add full turns to the joint positions q (n,), in place. If possible, q is then inside the
        limits; among such positions q is nearest to `near`.
        """
        for j in range(self.n):
            period = self.periods[j]
            if not math.isfinite(period):
                continue
            low = self.limits[2 * j] - places.AT_LIMIT
            high = self.limits[2 * j + 1] + places.AT_LIMIT
            x = near[j] - self.without_turns(j, near[j] - q[j])
            if x <= near[j] - 0.5 * period + 1e-15:
                x += period
            if x < low:
                x += period * math.ceil((low - x) / period)
            elif x > high:
                x -= period * math.ceil((x - high) / period)
            # If no position is inside the limits, take the position that exceeds a limit least.
            if x > high and low - (x - period) < x - high:
                x -= period
            elif x < low and x + period - high < low - x:
                x += period
            q[j] = x

    def square_to(self, near: Flat, q: Flat) -> float:
        """
        Return the squared distance from q (n,) to `near` (n,). The difference of each joint is
        divided by the scale of the joint.
        """
        square = 0.0
        for j in range(self.n):
            scaled = (q[j] - near[j]) / self.scales[j]
            square += scaled * scaled
        return square

    def space(self, j: int, q: Flat) -> float:
        """
        Return the distance of joint j to its nearest limit, rad or m; negative beyond the limit.
        """
        return min(q[j] - self.limits[2 * j], self.limits[2 * j + 1] - q[j])

    def margin(self, q: Flat) -> float:
        """
        Return the least distance of any joint to its nearest limit, rad or m; negative beyond a
        limit.
        """
        margin = places.INFINITY
        for j in range(self.n):
            margin = min(margin, self.space(j, q))
        return margin

    def are_inside(self, q: Flat) -> bool:
        """Return whether all joints are inside their limits, with the tolerance AT_LIMIT."""
        return self.margin(q) >= -places.AT_LIMIT


def representatives(joints: Joints, near: Floats, q: Floats) -> None:
    """
    Add full turns to each row of joint positions q, in place. If possible, each position is then
    inside its limits.

    If several positions of a joint are inside the limits, take the one nearest to `near`.

    Parameters
    ----------
    joints
        The joints of the arm.
    near : shape (n,), rad or m
        Reference joint positions. If two positions of a joint are equally near, the function takes
        the larger position.
    q : shape (N, n), rad or m
        Joint positions, overwritten.
    """
    count, n = arrays.extent(q, 0), joints.n
    center, rows = arrays.numbers(near, n), arrays.results(q, count * n)
    for k in range(count):
        joints.represent(center, arrays.after(rows, k * n))
