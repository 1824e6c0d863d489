"""
Solutions: told apart, turned into the limits, and sorted by how near they are.

"""

import math

from . import arrays, places, refinement
from .arrays import Floats, Integers
from .residuals import Residual

# Two solutions (rad, scaled) nearer than this may be one.
MAYBE_SAME = 1e-2
# As near to the target as a solution is to round-off, as a share of the length.
AS_GOOD = 1e-13


def _without_turns(away: float, period: float) -> float:
    if not math.isfinite(period):
        return away
    return away - period * math.floor(away / period + 0.5)


class Joints:
    """
    What positions of the joints mean, whatever the target.

    Parameters
    ----------
    scales : shape (n,)
        What a unit of each joint counts, as `Task.column_scales`, inverted.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    limits : shape (n, 2), rad or m
        Infinite where there are none.

    """

    def __init__(self, scales: Floats, periods: Floats, limits: Floats) -> None:
        self.n = arrays.size(scales)
        self.scales = arrays.numbers(scales, self.n)
        self.periods = arrays.numbers(periods, self.n)
        self.limits = arrays.numbers(limits, 2 * self.n)
        self._arrays = scales, periods, limits

    def represent(self, near: Floats, q: Floats) -> None:
        """
        Turn q (n,) as `representatives` turns a row.

        """
        for j in range(self.n):
            period = self.periods[j]
            if not math.isfinite(period):
                continue
            low = self.limits[2 * j] - places.AT_LIMIT
            high = self.limits[2 * j + 1] + places.AT_LIMIT
            x = near[j] - _without_turns(near[j] - q[j], period)
            if x <= near[j] - 0.5 * period + 1e-15:
                x += period
            if x < low:
                x += period * math.ceil((low - x) / period)
            elif x > high:
                x -= period * math.ceil((x - high) / period)
            # Where no turn is inside, the one that is beyond by less.
            if x > high and low - (x - period) < x - high:
                x -= period
            elif x < low and x + period - high < low - x:
                x += period
            q[j] = x

    def square_to(self, near: Floats, q: Floats) -> float:
        """
        Return the square of the distance from q to `near`.

        """
        square = 0.0
        for j in range(self.n):
            share = (q[j] - near[j]) / self.scales[j]
            square += share * share
        return square

    def space(self, j: int, q: Floats) -> float:
        """
        Return how far joint j is from its nearest limit, rad or m; negative beyond it.

        """
        return min(q[j] - self.limits[2 * j], self.limits[2 * j + 1] - q[j])

    def margin(self, q: Floats) -> float:
        """
        Return the least space of a joint.

        """
        margin = places.INFINITY
        for j in range(self.n):
            margin = min(margin, self.space(j, q))
        return margin

    def are_inside(self, q: Floats) -> bool:
        """
        Return whether no joint is beyond its limits.

        """
        return self.margin(q) >= -places.AT_LIMIT


class Solutions:
    """
    Room for solutions, nearest first, and what is said of each.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Their joint positions, to be written.

    Attributes
    ----------
    count
        How many there are.

    """

    def __init__(self, q: Floats) -> None:
        self.most, self.n, self.count = arrays.extent(q, 0), arrays.extent(q, 1), 0
        self.q = q
        self.rows = arrays.results(q, self.most * self.n)
        self.room = arrays.scratch(self.most * (self.n + 6))
        self.misses = self.room
        self.margins = arrays.after(self.misses, self.most)
        self.shares = arrays.after(self.margins, self.most)
        self.postures = arrays.as_whole(arrays.after(self.shares, self.most))
        self.beyond = arrays.whole_after(self.postures, 3 * self.most)

    def __dealloc__(self) -> None:
        """
        Give the room back.

        """
        arrays.give_back(self.room)

    def take(self, k: int, joints: Joints, q: Floats, misses: float) -> None:
        """
        Take q (n,) as solution k, with how it stands to the limits.

        """
        n = self.n
        for j in range(n):
            self.rows[k * n + j] = q[j]
            self.beyond[k * n + j] = 1 if joints.space(j, q) < -places.AT_LIMIT else 0
        self.margins[k] = joints.margin(q)
        self.misses[k] = misses
        for i in range(3):
            self.postures[3 * k + i] = 0

    def require(self, k: int) -> None:
        """
        Raise IndexError where there is no solution k.

        """
        if not 0 <= k < self.count:
            raise IndexError('there are fewer solutions')

    def miss(self, k: int) -> float:
        """
        Return what solution k misses the target by, m.

        """
        self.require(k)
        return self.misses[k]

    def margin(self, k: int) -> float:
        """
        Return the distance of solution k to the nearest limit, rad or m; negative beyond one.

        """
        self.require(k)
        return self.margins[k]

    def share(self, k: int) -> float:
        """
        Return how near to dependent the columns of J are at solution k: see `pivots`.

        """
        self.require(k)
        return self.shares[k]

    def is_beyond(self, k: int, j: int) -> bool:
        """
        Return whether joint j of solution k is beyond its limits.

        """
        self.require(k)
        return 0 <= j < self.n and self.beyond[k * self.n + j] == 1

    def posture(self, k: int) -> tuple[int, int, int]:
        """
        Return the signs of solution k: see `postures`; 0 where there are none.

        """
        self.require(k)
        signs = arrays.whole_after(self.postures, 3 * k)
        return int(signs[0]), int(signs[1]), int(signs[2])


class Found:
    """
    Joint positions that may be solutions, and room to sort them.

    Parameters
    ----------
    most, n
        How many there can be, and of how many joints.

    """

    def __init__(self, most: int, n: int) -> None:
        self.n = n
        self.room = arrays.scratch(most * (n + 4) + n)
        self.q = self.room
        self.errors = arrays.after(self.q, most * n)
        self.away = arrays.after(self.errors, most)
        self.halfway = arrays.after(self.away, most)
        self.which = arrays.as_whole(arrays.after(self.halfway, n))
        self.met = arrays.whole_after(self.which, most)

    def __dealloc__(self) -> None:
        """
        Give the room back.

        """
        arrays.give_back(self.room)

    def sort_by_error(self, count: int) -> None:
        """
        Sort the first rows by their errors; rows that miss by as much keep their order.

        """
        n, q, errors = self.n, self.q, self.errors
        for i in range(1, count):
            k = i
            while k > 0 and errors[k] < errors[k - 1]:
                x = errors[k]
                errors[k] = errors[k - 1]
                errors[k - 1] = x
                for j in range(k * n, k * n + n):
                    x = q[j]
                    q[j] = q[j - n]
                    q[j - n] = x
                k -= 1

    def keep_distinct(self, count: int, residual: Residual, joints: Joints, proved: float) -> int:
        """
        Do what `distinct` does with the first rows, sorted by their errors.

        """
        kept = 0
        for k in range(count):
            if not self.errors[k] < proved:
                break
            known = False
            for i in range(kept):
                known = self._are_one(k, self.which[i], residual, joints)
                if known:
                    self.met[i] += 1
                    break
            if not known:
                self.which[kept] = k
                self.met[kept] = 1
                kept += 1
        return kept

    def _are_one(self, one: int, other: int, residual: Residual, joints: Joints) -> bool:
        # Equal to round-off, or the point halfway is a solution too.
        a, b = arrays.after(self.q, one * self.n), arrays.after(self.q, other * self.n)
        distance = 0.0
        for j in range(self.n):
            away = _without_turns(a[j] - b[j], joints.periods[j])
            self.halfway[j] = b[j] + 0.5 * away
            distance = max(distance, abs(away) / joints.scales[j])
        if distance >= MAYBE_SAME:
            return False
        if distance < places.SAME_SOLUTION:
            return True
        left = math.sqrt(residual.square(self.halfway, places.POSE))
        length = max(residual.length(), refinement.LEAST_LENGTH)
        return left < max(AS_GOOD * length, 4.0 * self.errors[one])


def require_fit(residual: Residual, joints: Joints, solution: Solutions, most: int) -> None:
    """
    Refuse what is of arms with different joints, and room for too few solutions.

    """
    arrays.given(joints)
    arrays.given(residual)
    arrays.given(solution)
    if joints.n != residual.n or solution.n != joints.n or solution.most < most:
        raise TypeError('a target, an arm and the room for its solutions do not go together')


def distinct(
    residual: Residual,
    joints: Joints,
    proved: float,
    q: Floats,
    errors: Floats,
    which: Integers,
    met: Integers,
) -> int:
    """
    Fill `which` with the rows of q that are solutions, each solution once; return their number.

    Two rows are one solution where they are equal to round-off, full turns left out, or where
    they are near each other and the point halfway is a solution too: at the border of the
    workspace two solutions meet, and are told apart as long as the target can tell.

    Parameters
    ----------
    residual, joints
        Of the target, and of the arm.
    proved
        Rows with less of an error are solutions, m.
    q, errors : shape (N, n), (N,)
        Joint positions and by how much they miss, the least first.
    which, met : shape (N,)
        Rows kept, and how many rows each stands for.

    """
    arrays.given(residual)
    arrays.given(joints)
    n, rows = joints.n, arrays.extent(q, 0)
    positions, left = arrays.numbers(q, rows * n), arrays.numbers(errors, rows)
    kept, times = arrays.whole_results(which, rows), arrays.whole_results(met, rows)
    found = Found(rows, n)
    for k in range(rows * n):
        found.q[k] = positions[k]
    for k in range(rows):
        found.errors[k] = left[k]
    count = found.keep_distinct(rows, residual, joints, proved)
    for k in range(count):
        kept[k], times[k] = found.which[k], found.met[k]
    return count


def representatives(joints: Joints, near: Floats, q: Floats) -> None:
    """
    Turn each row of q by full turns: into the limits if that can be, and there nearest to `near`.

    Parameters
    ----------
    joints
        Of the arm.
    near : shape (n,), rad or m
        Half a turn from it, the upper one is taken.
    q : shape (N, n), rad or m
        Overwritten.

    """
    arrays.given(joints)
    count, n = arrays.extent(q, 0), joints.n
    middle, rows = arrays.numbers(near, n), arrays.results(q, count * n)
    for k in range(count):
        joints.represent(middle, arrays.after(rows, k * n))


def least(numbers: Floats, count: int) -> int:
    """
    Return where the least of so many numbers stands.

    """
    at = 0
    for i in range(1, count):
        if numbers[i] < numbers[at]:
            at = i
    return at
