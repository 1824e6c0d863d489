"""
A curve of solutions by samples: places between them, and roots of functions along it.

A place is a number: k + x is the share x of the way from sample k to the next one. Between samples
Hermite's cubic predicts the solution, and Newton's method corrects it. Roots are found by secants,
and by bisection where a secant leads out of the interval.
"""

import math

from ..layout import arrays
from ..layout.arrays import Flat, Floats
from .curve_point import CurvePoint

# Largest number of steps to a root on the curve: bisection alone needs 53.
MAX_STEPS = 60
# Number of steps after which bisection follows secants.
SECANT_STEPS = 8
# Error up to which a joint is at a position, rad or m: round-off of 100 operations at 3 rad.
VALUE_TOLERANCE = 1e-13
# A joint with a smaller slope is at an end of its range: its error is the square of this.
SLOPE_TOLERANCE = 1e-9
# Largest number of steps to a root on the cubic, where steps on the curve begin.
CUBIC_STEPS = 6
# Function value at which the root on the cubic is near enough to that.
CUBIC_TOLERANCE = 1e-8
# The functions: the slope of a row along the curve, its difference from a value, and the
# derivative of half the squared distance from a goal along the curve.
SLOPE, VALUE, DISTANCE = 0, 1, 2


class CurvePath:
    """
    A curve, its places counted by its samples.

    Parameters
    ----------
    point
        Of the arm and its target.
    psi, tangents : shape (m, n)
        Samples of the curve, at least two, and its unit tangents there.
    rows : shape (k, n)
        Weights of the screws' positions: their sum is, for example, the position of a joint.

    Attributes
    ----------
    function
        SLOPE or VALUE of `row`, or DISTANCE: the function whose root `root` returns.
    value
        The value of VALUE.
    """

    def __init__(self, point: CurvePoint, psi: Floats, tangents: Floats, rows: Floats) -> None:
        self.point, self.k = point, arrays.extent(rows, 0)
        self.m, self.n = arrays.extent(psi, 0), arrays.extent(psi, 1)
        if self.n != point.n or self.m < 2:
            raise TypeError('a curve has two samples at least, of as many joints as its arm')
        self.psi = arrays.numbers(psi, self.m * self.n)
        self.tangents = arrays.numbers(tangents, self.m * self.n)
        self.rows = arrays.numbers(rows, self.k * self.n)
        self.function, self.value, self.steepness = SLOPE, 0.0, 0.0
        self.row, self.goal = self.rows, self.rows

    def stand_at(self, place: float) -> bool:
        """Move the point to a place of the curve; return whether the steps ended."""
        parameter = self.stand_near(place)
        tangent = self.point.tangent
        sign = tangent[parameter]
        arrived = self.point.improve(parameter)
        # The parameter moves on as it did.
        if sign * tangent[parameter] < 0.0:
            for j in range(self.n):
                tangent[j] = -tangent[j]
        return arrived

    def stand_near(self, place: float) -> int:
        """Move the point to a place of Hermite's cubic; return which joint moves most there."""
        point, tangent, n, square = self.point.psi, self.point.tangent, self.n, 0.0
        k: int = int(min(max(place, 0.0), self.m - 2.0))
        x = place - k
        a, b = arrays.after(self.psi, k * n), arrays.after(self.psi, k * n + n)
        u, v = arrays.after(self.tangents, k * n), arrays.after(self.tangents, k * n + n)
        for j in range(n):
            square += (b[j] - a[j]) * (b[j] - a[j])
        size, parameter = math.sqrt(square), 0
        most: float = -1.0
        y = 1.0 - x
        of_a, of_b = (1.0 + 2.0 * x) * y * y, x * x * (3.0 - 2.0 * x)
        of_u, of_v = x * y * y * size, -x * x * y * size
        along, from_u, from_v = 6.0 * x * y, y * (1.0 - 3.0 * x) * size, x * (3.0 * x - 2.0) * size
        square = 0.0
        for j in range(n):
            point[j] = of_a * a[j] + of_b * b[j] + of_u * u[j] + of_v * v[j]
            tangent[j] = along * (b[j] - a[j]) + from_u * u[j] + from_v * v[j]
            square += tangent[j] * tangent[j]
            if abs(u[j] + v[j]) > most:
                most, parameter = abs(u[j] + v[j]), j
        if square > 0.0:
            square = 1.0 / math.sqrt(square)
        for j in range(n):
            tangent[j] *= square
        return parameter

    def times(self, row: Flat, v: Flat) -> float:
        """Return the sum of shares of what `v` has of each joint."""
        return arrays.dot(row, v, self.n)

    def write_sums(self, v: Flat, sums: Flat) -> None:
        """Write what `v` has of each of what is looked at."""
        for i in range(self.k):
            sums[i] = self.times(arrays.after(self.rows, i * self.n), v)

    def value_of_function(self, psi: Flat, tangent: Flat) -> float:
        """Return the function at a solution (n,) with the unit tangent (n,) there."""
        if self.function == SLOPE:
            return self.times(self.row, tangent)
        if self.function == VALUE:
            return self.times(self.row, psi) - self.value
        total = 0.0
        for i in range(self.k):
            row = arrays.after(self.rows, i * self.n)
            weight = self.goal[self.k + i]
            total += weight * (self.times(row, psi) - self.goal[i]) * self.times(row, tangent)
        return total

    def root(self, a: float, low: float, b: float, high: float) -> float:
        """Return the root between places at which the function has values of opposite signs."""
        # The root on the cubic is where steps on the curve begin.
        self.steepness = (high - low) / (b - a)
        x = self._approach(a - low / self.steepness, a, b, high > 0.0, False)
        return self._approach(x, a, b, high > 0.0, True)

    def _approach(self, x: float, a: float, b: float, rises: bool, exactly: bool) -> float:
        # Secants from x; bisection where one leads out of the interval (a, b).
        least = (
            CUBIC_TOLERANCE
            if not exactly
            else VALUE_TOLERANCE
            if self.function == VALUE
            else SLOPE_TOLERANCE
        )
        last, before = x, 0.0
        for k in range(MAX_STEPS if exactly else CUBIC_STEPS):
            if exactly:
                self.stand_at(x)
            else:
                self.stand_near(x)
            y = self.value_of_function(self.point.psi, self.point.tangent)
            if abs(y) < least:
                return x
            if k > 0 and y != before:
                self.steepness = (y - before) / (x - last)
            last, before = x, y
            if (y > 0.0) == rises:
                b = x
            else:
                a = x
            x = last - y / self.steepness if self.steepness != 0.0 else a
            if k > SECANT_STEPS or not a < x < b:
                x = 0.5 * (a + b)
                if not a < x < b:
                    break
        return last


def write_places(path: CurvePath, places: Floats, sums: Floats) -> None:
    """Fill in what is looked at (m, k) at places (m,) of a curve."""
    count, k = arrays.size(places), path.k
    at, rows = arrays.numbers(places, count), arrays.results(sums, count * k)
    for i in range(count):
        path.stand_at(at[i])
        path.write_sums(path.point.psi, arrays.after(rows, i * k))


def nearest_place(path: CurvePath, goal: Floats, begin: float, end: float) -> float:
    """
    Return the place between two neighbouring ones that is nearest to a goal.

    Parameters
    ----------
    path
        The curve.
    goal : shape (2, k)
        What its rows should be, and the weights of the squares.
    begin, end
        The places.
    """
    path.goal, path.function = arrays.numbers(goal, 2 * path.k), DISTANCE
    path.stand_at(begin)
    low = path.value_of_function(path.point.psi, path.point.tangent)
    path.stand_at(end)
    high = path.value_of_function(path.point.psi, path.point.tangent)
    if low >= 0.0 or high <= 0.0:
        return begin if low >= 0.0 else end
    return path.root(begin, low, end, high)
