"""A curve of solutions by samples: places between them, where joints turn, and the limits."""

import math

from ..layout import arrays
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers
from .curve_point import CurvePoint

# Steps to where a joint is at an end of its range, or at a position; a joint that is as near to it
# is there (rad or m).
STEPS, THERE = 60, 1e-13
# The slope of a joint that is at an end of its range: the square is what it is away from it.
FLAT = 1e-9
# What vanishes at a place: a joint's slope, how far it is from a value, the slope of a distance.
SLOPE, VALUE, DISTANCE = 0, 1, 2
# A mark that is no limit's: of a joint at an end of its range.
FOLD = 2


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
        What is looked at: each a sum of shares of the screws' positions, as a joint's.
    """

    m: int
    n: int
    k: int
    kind: int
    value: float

    def __init__(self, point: CurvePoint, psi: Floats, tangents: Floats, rows: Floats) -> None:
        arrays.given(point)
        self.point: CurvePoint = point
        self.m, self.n, self.k = (
            arrays.extent(psi, 0),
            arrays.extent(psi, 1),
            arrays.extent(rows, 0),
        )
        if self.n != point.n or self.m < 2:
            raise TypeError('a curve has two samples at least, of as many joints as its arm')
        self.psi: Flat = arrays.numbers(psi, self.m * self.n)
        self.tangents: Flat = arrays.numbers(tangents, self.m * self.n)
        self.rows: Flat = arrays.numbers(rows, self.k * self.n)
        self.kind, self.value = SLOPE, 0.0
        self.row: Flat = self.rows
        self.goal: Flat = self.rows
        self._arrays: tuple[object, ...] = psi, tangents, rows

    def stand_at(self, place: float) -> bool:
        """Move the point to a place of the curve; return whether the steps ended."""
        point, tangent, n, square = self.point.psi, self.point.tangent, self.n, 0.0
        k: int = int(min(max(place, 0.0), self.m - 2.0))
        x = place - k
        a, b = arrays.after(self.psi, k * n), arrays.after(self.psi, k * n + n)
        u, v = arrays.after(self.tangents, k * n), arrays.after(self.tangents, k * n + n)
        for j in range(n):
            square += (b[j] - a[j]) * (b[j] - a[j])
        size, parameter = math.sqrt(square), 0
        most: float = -1.0
        # Hermite's cubic.
        y = 1.0 - x
        of_a, of_b = (1.0 + 2.0 * x) * y * y, x * x * (3.0 - 2.0 * x)
        of_u, of_v = x * y * y * size, -x * x * y * size
        for j in range(n):
            point[j] = of_a * a[j] + of_b * b[j] + of_u * u[j] + of_v * v[j]
            if abs(u[j] + v[j]) > most:
                most, parameter = abs(u[j] + v[j]), j
        arrived = self.point.improve(parameter)
        along = 0.0
        for j in range(n):
            along += tangent[j] * u[j]
        if along < 0.0:
            for j in range(n):
                tangent[j] = -tangent[j]
        return arrived

    def times(self, row: Flat, v: Flat) -> float:
        """Return the sum of shares of what `v` has of each joint."""
        total = 0.0
        for j in range(self.n):
            total += row[j] * v[j]
        return total

    def what_vanishes(self, psi: Flat, tangent: Flat) -> float:
        """Return the number that is looked for a zero of."""
        if self.kind == SLOPE:
            return self.times(self.row, tangent)
        if self.kind == VALUE:
            return self.times(self.row, psi) - self.value
        total = 0.0
        for i in range(self.k):
            row = arrays.after(self.rows, i * self.n)
            weight = self.goal[self.k + i]
            total += weight * (self.times(row, psi) - self.goal[i]) * self.times(row, tangent)
        return total

    def zero(self, a: float, low: float, b: float, high: float) -> float:
        """Return where what vanishes does, between places at which its signs differ."""
        # The Illinois method.
        for _ in range(STEPS):
            if low == high:
                break
            x = (a * high - b * low) / (high - low)
            self.stand_at(x)
            y = self.what_vanishes(self.point.psi, self.point.tangent)
            if abs(y) < (THERE if self.kind == VALUE else FLAT):
                return x
            if (y > 0.0) != (high > 0.0):
                a, low = b, high
            else:
                low *= 0.5
            b, high = x, y
        self.stand_at(b)
        return b


def write_places(path: CurvePath, places: Floats, psi: Floats) -> None:
    """Fill in the positions of the screws (m, n) at places (m,) of a curve."""
    arrays.given(path)
    count, n = arrays.size(places), path.n
    at, rows = arrays.numbers(places, count), arrays.results(psi, count * n)
    for i in range(count):
        path.stand_at(at[i])
        for j in range(n):
            rows[i * n + j] = path.point.psi[j]


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
    arrays.given(path)
    path.goal, path.kind = arrays.numbers(goal, 2 * path.k), DISTANCE
    path.stand_at(begin)
    low = path.what_vanishes(path.point.psi, path.point.tangent)
    path.stand_at(end)
    high = path.what_vanishes(path.point.psi, path.point.tangent)
    if low >= 0.0 or high <= 0.0:
        return begin if low >= 0.0 else end
    return path.zero(begin, low, end, high)


class _Marks:
    # What was found: places, and rows and sides.

    count: int
    limits: int
    most: int

    def __init__(self, places: Floats, kinds: Integers) -> None:
        self.count, self.limits, self.most = 0, 0, arrays.size(places)
        self.places: Flat = arrays.results(places, self.most)
        self.kinds: FlatIntegers = arrays.whole_results(kinds, 2 * self.most)
        self._arrays: tuple[object, ...] = places, kinds

    def take(self, place: float, row: int, side: int) -> None:
        """Take a place."""
        if self.count < self.most:
            self.places[self.count] = place
            self.kinds[2 * self.count], self.kinds[2 * self.count + 1] = row, side
        self.count += 1
        if side != FOLD:
            self.limits += 1


def marks(
    path: CurvePath, limits: Floats, periods: Floats, places: Floats, kinds: Integers
) -> int:
    """
    Find where each row is at an end of its range, or at a limit; return how many places.

    Between neighbouring ends of its range a row rises or falls. More than there is room for are
    counted only. -1: a row is never inside its limits, and the others were not all looked at.

    Parameters
    ----------
    path
        The curve.
    limits : shape (k, 2)
        Of each row; infinite ones are none.
    periods : shape (k,)
        After which a limit is one again, or infinite.
    places, kinds : shape (m,), (m, 2)
        The places; the row, and 0 or 1 of a lower or upper limit, 2 of an end of the range.
    """
    arrays.given(path)
    k, n = path.k, path.n
    bounds, turns = arrays.numbers(limits, 2 * k), arrays.numbers(periods, k)
    found = _Marks(places, kinds)
    for i in range(k):
        known = found.limits
        path.row = arrays.after(path.rows, i * n)
        slope, at = path.times(path.row, path.tangents), path.times(path.row, path.psi)
        for s in range(1, path.m):
            next_slope = path.times(path.row, arrays.after(path.tangents, s * n))
            next_at = path.times(path.row, arrays.after(path.psi, s * n))
            begin, here = s - 1.0, at
            if (slope > 0.0) != (next_slope > 0.0):
                path.kind = SLOPE
                fold = path.zero(begin, slope, begin + 1.0, next_slope)
                found.take(fold, i, FOLD)
                here = path.times(path.row, path.point.psi)
                _take_crossings(path, found, bounds, turns, i, begin, at, fold, here)
                begin = fold
            _take_crossings(path, found, bounds, turns, i, begin, here, s * 1.0, next_at)
            slope, at = next_slope, next_at
        if found.limits == known and not _is_inside(bounds, turns, i, at):
            return -1
    return found.count


def _is_inside(limits: Flat, periods: Flat, i: int, value: float) -> bool:
    low, high, period = limits[2 * i], limits[2 * i + 1], periods[i]
    if math.isfinite(low) and math.isfinite(high) and math.isfinite(period):
        return value + period * math.ceil((low - value) / period) <= high
    return (not math.isfinite(low) or low <= value) and (not math.isfinite(high) or value <= high)


def _take_crossings(
    path: CurvePath,
    found: _Marks,
    limits: Flat,
    periods: Flat,
    i: int,
    begin: float,
    first: float,
    end: float,
    last: float,
) -> None:
    low, high, period = min(first, last), max(first, last), periods[i]
    for side in range(2):
        limit = limits[2 * i + side]
        if not math.isfinite(limit):
            continue
        if math.isfinite(period):
            limit += period * math.ceil((low - limit) / period)
        while limit <= high:
            if (first > limit) != (last > limit):
                path.kind, path.value = VALUE, limit
                place = path.zero(begin, first - limit, end, last - limit)
                found.take(place, i, side)
            if not math.isfinite(period):
                break
            limit += period
