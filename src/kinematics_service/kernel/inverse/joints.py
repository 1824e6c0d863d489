"""Rules for joint positions: full turns, limits, and the weight of each joint."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats


class Joints:
    """
    Rules for joint positions that hold for any target.

    Parameters
    ----------
    scales : shape (n,)
        Weight of a unit of each joint: `Task.column_scales`, inverted.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    limits : shape (n, 2), rad or m
        Infinite if there are none.
    """

    def __init__(self, scales: Floats, periods: Floats, limits: Floats) -> None:
        self.n = arrays.size(scales)
        self.scales, self.periods = arrays.numbers(scales, self.n), arrays.numbers(periods, self.n)
        self.limits = arrays.numbers(limits, 2 * self.n)

    def without_turns(self, j: int, away: float) -> float:
        """Return a way of joint j without the full turns in it."""
        period = self.periods[j]
        if not math.isfinite(period):
            return away
        return away - period * math.floor(away / period + 0.5)

    def represent(self, near: Flat, q: Flat) -> None:
        """Turn q (n,) as `representatives` turns a row."""
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
            # If no turn is inside, the one that is beyond by less.
            if x > high and low - (x - period) < x - high:
                x -= period
            elif x < low and x + period - high < low - x:
                x += period
            q[j] = x

    def square_to(self, near: Flat, q: Flat) -> float:
        """Return the square of the distance from q to `near`."""
        square = 0.0
        for j in range(self.n):
            share = (q[j] - near[j]) / self.scales[j]
            square += share * share
        return square

    def space(self, j: int, q: Flat) -> float:
        """Return the distance of joint j to its nearest limit, rad or m; negative beyond it."""
        return min(q[j] - self.limits[2 * j], self.limits[2 * j + 1] - q[j])

    def margin(self, q: Flat) -> float:
        """Return the least space of a joint."""
        margin = places.INFINITY
        for j in range(self.n):
            margin = min(margin, self.space(j, q))
        return margin

    def are_inside(self, q: Flat) -> bool:
        """Return whether no joint is beyond its limits."""
        return self.margin(q) >= -places.AT_LIMIT


def representatives(joints: Joints, near: Floats, q: Floats) -> None:
    """
    Turn each row of q by full turns: into the limits if possible, and there nearest to `near`.

    Parameters
    ----------
    joints
        The joints of the arm.
    near : shape (n,), rad or m
        Half a turn from it, the upper one is taken.
    q : shape (N, n), rad or m
        Overwritten.
    """
    count, n = arrays.extent(q, 0), joints.n
    middle, rows = arrays.numbers(near, n), arrays.results(q, count * n)
    for k in range(count):
        joints.represent(middle, arrays.after(rows, k * n))
