# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Interpolate a curve of inverse kinematics solutions between its samples, and find roots of
functions along the curve.

A place on the curve is a number k + x: the fraction x of the way from sample k to sample k + 1.
Cubic Hermite interpolation predicts the solution, and Newton's method corrects the prediction
perpendicular to the chord between the two samples. The Illinois method (Dowell and Jarratt 1971)
finds roots. It is regula falsi with one change: if an end of the interval does not move, the
function value at this end is halved.
"""

import math

from ..layout import arrays
from ..layout.arrays import Floats
from .curve_point import CurvePoint

# Largest number of steps of the Illinois method to find a root; ten steps are usual.
MAX_ROOT_STEPS = 100
# `CurvePath.root` finds the point of the curve at which a joint has a wanted position. The search
# ends if the joint position differs from the wanted position by less than LEVEL_TOLERANCE, rad or
# m. The tolerance is the round-off of 100 operations at 3 rad.
LEVEL_TOLERANCE = 1e-13
# `CurvePath.root` finds a turning point of a joint: the derivative of the joint position along the
# curve is zero there. The search ends if the absolute derivative is below SLOPE_TOLERANCE. The
# error of the joint position is then about the square of the derivative. `nearest_place` uses the
# same tolerance for the derivative of half the squared distance to a goal.
SLOPE_TOLERANCE = 1e-9


class CurvePath:
    """
    A curve of inverse kinematics solutions, interpolated between its samples.

    Parameters
    ----------
    point
        A point on the curve. The methods move this point.
    samples : shape (m, 2 n), rad or m
        Joint positions and unit tangents of at least two samples.

    Attributes
    ----------
    joint, level
        The method `root` finds a root of a function along the curve. The attributes select this
        function: the position of joint `joint` minus `level`. If `level` is NaN, the function is
        the derivative of the joint position along the curve. If `joint` is -1, the function is the
        derivative of half the weighted squared distance from `goal`.
    """

    def __init__(self, point: CurvePoint, samples: Floats) -> None:
        self.point, self.n, self.m = point, point.n, arrays.extent(samples, 0)
        if self.m < 2:
            raise TypeError('a curve has two samples at least')
        self.samples = arrays.numbers(samples, 2 * self.m * self.n)
        self.goal = arrays.numbers(samples, 2 * self.n)
        self.joint, self.level = -1, 0.0

    def interpolate(self, place: float) -> None:
        """
        Move `point` to a place on the curve.

        `place` is the curve parameter: 2.25 is a quarter of the way from sample 2 to sample 3.
        """
        q, border, n, square = self.point.q, self.point.border, self.n, 0.0
        k: int = int(min(max(place, 0.0), self.m - 2.0))
        x = place - k
        a = arrays.after(self.samples, 2 * n * k)
        b = arrays.after(a, 2 * n)
        for j in range(n):
            border[j] = b[j] - a[j]
            square += border[j] * border[j]
        size, y = math.sqrt(square), 1.0 - x
        for j in range(n):
            chord = border[j]
            bend = y * (size * a[n + j] - chord) - x * (size * b[n + j] - chord)
            q[j] = a[j] + x * chord + x * y * bend
        # Do not check whether Newton's method converged. It may fail near a singular pose, but
        # there the point is still near samples k and k + 1, which are solutions.
        self.point.improve()

    def value(self) -> float:
        """Evaluate the function that `joint` and `level` select (see `CurvePath`) at `point`."""
        q, tangent, total = self.point.q, self.point.tangent, 0.0
        if self.joint >= 0:
            level = self.level
            return tangent[self.joint] if math.isnan(level) else q[self.joint] - level
        for j in range(self.n):
            total += self.goal[self.n + j] * (q[j] - self.goal[j]) * tangent[j]
        return total

    def root(self, a: float, low: float, b: float, high: float) -> float:
        """
        Return the curve parameter between a and b at which the function `value` is 0.

        The function has the value `low` at a and the value `high` at b. The two values differ in
        sign.
        """
        x = b
        tolerance: float = LEVEL_TOLERANCE if not math.isnan(self.level) else SLOPE_TOLERANCE
        for _ in range(MAX_ROOT_STEPS):
            x = b - high * (b - a) / (high - low)
            if not min(a, b) <= x <= max(a, b):
                x = 0.5 * (a + b)
            self.interpolate(x)
            y = self.value()
            if abs(y) < tolerance or (x - a) * (x - b) == 0.0:
                break
            if (y > 0.0) == (high > 0.0):
                low *= 0.5
            else:
                a, low = b, high
            b, high = x, y
        return x


def write_places(path: CurvePath, places: Floats, q: Floats) -> None:
    """Fill q (m, n) with the joint positions at given places (m,) of a curve of solutions."""
    count, n = arrays.size(places), path.n
    at, rows = arrays.numbers(places, count), arrays.results(q, count * n)
    for i in range(count):
        path.interpolate(at[i])
        arrays.copy(arrays.after(rows, i * n), n, path.point.q)


def write_roots(path: CurvePath, brackets: Floats, roots: Floats) -> None:
    """
    Find the points of a curve at which a joint has a wanted position or changes its direction.

    A point is given as curve parameter: 2.25 is a quarter of the way from sample 2 to sample 3.

    Parameters
    ----------
    path
        The curve.
    brackets : shape (6, m)
        Each column describes one point to find. The rows are: index of the joint; wanted joint
        position (NaN to find a change of direction); curve parameter a on one side of the point;
        value of `CurvePath.value` at a; curve parameter b on the other side; value at b. The
        values at a and b differ in sign.
    roots : shape (m, k)
        Row i is filled for column i of `brackets`: the curve parameter of the point, then the n
        joint positions. Columns from 1 + n on do not change.
    """
    count, wide, n = arrays.extent(roots, 0), arrays.extent(roots, 1), path.n
    if wide < 1 + n:
        raise TypeError('a root is a place and joint positions')
    given, rows = arrays.numbers(brackets, 6 * count), arrays.results(roots, wide * count)
    for i in range(count):
        bracket, row = arrays.after(given, i), arrays.after(rows, wide * i)
        path.joint, path.level = int(bracket[0]), bracket[count]
        ends = arrays.after(bracket, 2 * count)
        row[0] = path.root(ends[0], ends[count], ends[2 * count], ends[3 * count])
        arrays.copy(arrays.after(row, 1), n, path.point.q)


def nearest_place(path: CurvePath, goal: Floats, begin: float, end: float) -> float:
    """
    Return the curve parameter at which the joint positions are nearest to a goal.

    The curve parameter 2.25 is a quarter of the way from sample 2 to sample 3.

    Parameters
    ----------
    path
        The curve.
    goal : shape (2, n)
        Row 0 has the joint positions of the goal. Row 1 has the weight of each joint in the
        squared distance.
    begin, end
        Range of the curve parameter.
    """
    path.goal, path.joint = arrays.numbers(goal, 2 * path.n), -1
    path.level = math.nan
    path.interpolate(begin)
    low = path.value()
    path.interpolate(end)
    high = path.value()
    if low >= 0.0 or high <= 0.0:
        return begin if low >= 0.0 else end
    return path.root(begin, low, end, high)
