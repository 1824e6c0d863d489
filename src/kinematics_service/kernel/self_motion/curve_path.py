"""
Places on a curve of solutions between its samples, and roots of functions along it.

A place is a number: k + x is the share x of the way from sample k to the next one. Hermite's cubic
predicts the solution there, and Newton's method corrects it across the chord. Roots are found by
the Illinois method (Dowell and Jarratt 1971): regula falsi, which halves the value at an end that
stays.
"""

import math

from ..layout import arrays
from ..layout.arrays import Floats
from .curve_point import CurvePoint

# Largest number of steps to a root: ten are usual.
MAX_ROOT_STEPS = 100
# A smaller value is a root, rad or m: round-off of 100 operations at 3 rad.
TOLERANCE = 1e-13
# A joint turns round where its slope is smaller: to second order, its position there is off by the
# square of this.
SLOPE_TOLERANCE = 1e-9


class CurvePath:
    """
    A curve, its places counted by its samples.

    Parameters
    ----------
    point
        Of the arm and its target.
    samples : shape (m, 2 n), rad or m
        Joint positions and unit tangents, at least two.

    Attributes
    ----------
    joint, level
        The function whose roots are found: how far a joint is above a level, or, if that is not
        a number, its slope. Joint -1: the slope of the distance from `goal`.
    """

    def __init__(self, point: CurvePoint, samples: Floats) -> None:
        self.point, self.n, self.m = point, point.n, arrays.extent(samples, 0)
        if self.m < 2:
            raise TypeError('a curve has two samples at least')
        self.samples = arrays.numbers(samples, 2 * self.m * self.n)
        self.goal = arrays.numbers(samples, 2 * self.n)
        self.joint, self.level = -1, 0.0

    def stand_at(self, place: float) -> None:
        """Move the point to a place of the curve."""
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
        # It may fail beside a singular pose; the samples at both ends are solutions.
        self.point.improve()

    def value(self) -> float:
        """Return the function where the point stands."""
        q, tangent, total = self.point.q, self.point.tangent, 0.0
        if self.joint >= 0:
            level = self.level
            return tangent[self.joint] if math.isnan(level) else q[self.joint] - level
        for j in range(self.n):
            total += self.goal[self.n + j] * (q[j] - self.goal[j]) * tangent[j]
        return total

    def root(self, a: float, low: float, b: float, high: float) -> float:
        """Return the root between places at which the function has values of opposite signs."""
        x = b
        tolerance: float = TOLERANCE if not math.isnan(self.level) else SLOPE_TOLERANCE
        for _ in range(MAX_ROOT_STEPS):
            x = b - high * (b - a) / (high - low)
            if not min(a, b) <= x <= max(a, b):
                x = 0.5 * (a + b)
            self.stand_at(x)
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
    """Fill in joint positions (m, n) at places (m,) of a curve."""
    count, n = arrays.size(places), path.n
    at, rows = arrays.numbers(places, count), arrays.results(q, count * n)
    for i in range(count):
        path.stand_at(at[i])
        arrays.copy(arrays.after(rows, i * n), n, path.point.q)


def write_roots(path: CurvePath, brackets: Floats, roots: Floats) -> None:
    """
    Fill in where joints are at levels, or turn round.

    Parameters
    ----------
    path
        The curve.
    brackets : shape (6, m)
        Joint and level (not a number: where it turns round); a place and the function there; and
        another place, at which its sign is the opposite one.
    roots : shape (m, k)
        The place, and the joint positions (n,) there; what is behind them stays.
    """
    count, wide, n = arrays.extent(roots, 0), arrays.extent(roots, 1), path.n
    if wide < 1 + n:
        raise TypeError('a root is a place and joint positions')
    given, rows = arrays.numbers(brackets, 6 * count), arrays.results(roots, wide * count)
    for i in range(count):
        one, row = arrays.after(given, i), arrays.after(rows, wide * i)
        path.joint, path.level = int(one[0]), one[count]
        row[0] = path.root(one[2 * count], one[3 * count], one[4 * count], one[5 * count])
        arrays.copy(arrays.after(row, 1), n, path.point.q)


def nearest_place(path: CurvePath, goal: Floats, begin: float, end: float) -> float:
    """
    Return the place between two neighbouring ones that is nearest to a goal.

    Parameters
    ----------
    path
        The curve.
    goal : shape (2, n)
        Joint positions, and the weights of the squares.
    begin, end
        The places.
    """
    path.goal, path.joint = arrays.numbers(goal, 2 * path.n), -1
    path.level = math.nan
    path.stand_at(begin)
    low = path.value()
    path.stand_at(end)
    high = path.value()
    if low >= 0.0 or high <= 0.0:
        return begin if low >= 0.0 else end
    return path.root(begin, low, end, high)
