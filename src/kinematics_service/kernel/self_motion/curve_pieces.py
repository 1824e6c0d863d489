"""
A curve of solutions cut by the joint limits: where joints are at one, and inside which turns.

Where a joint is far beyond its limits nothing else is looked at: between a posture inside all
limits and one that is not there is a place where a joint is at a limit and none is far beyond.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers
from . import curve_path
from .curve_path import CurvePath

# A joint that stays so far beyond its limits between two samples, and all its way, has no mark
# there, nor have the others, rad.
FAR = 0.1
# A joint leaves its limits where it is this far beyond one, rad or m: half of AT_LIMIT, the error
# of a posture inside. A joint that rests at a limit, with round-off, stays inside.
EXIT_MARGIN = 5e-10
# Marks at places that differ by less are one mark, in ways between samples: 2e-10 rad for 0.1 rad,
# a fifth of twice EXIT_MARGIN, the distance between the marks of two limits that are one.
PLACE_TOLERANCE = 2e-9
# Kinds of rows: at a lower (0) or an upper limit (1), at an end of a joint's range, or a sample.
FOLD, SAMPLE = 2, 3


class _CutCurve:
    # What is written: rows of the table, their kinds, where pieces begin, and their turns.

    def __init__(
        self,
        path: CurvePath,
        joints: Floats,
        closed: bool,
        table: Floats,
        kinds: Integers,
        begins: Integers,
        turns: Integers,
    ) -> None:
        self.path, self.closed, self.rows = path, closed, 0
        self.k, self.room = path.k, arrays.extent(table, 0)
        self.wide = self.k + 2
        self.joints = arrays.numbers(joints, 4 * self.k)
        self.table = arrays.results(table, self.room * self.wide)
        self.kinds = arrays.whole_results(kinds, 2 * self.room)
        self.begins = arrays.whole_results(begins, self.room)
        self.turns = arrays.whole_results(turns, 2 * self.k * self.room)
        k = self.k
        self.away, self.slopes, self.at, self.lap = arrays.rooms(k, k, k, k)
        self.next_away, self.next_slopes, self.next_at = arrays.rooms(k, k, k)

    def row(self, i: int) -> Flat:
        """Return a row of the table: the place, how far along it is, what is looked at."""
        return arrays.after(self.table, i * self.wide)

    def lay_out(self) -> bool:
        """Write samples and marks in their order; return whether there was room."""
        n, samples = self.path.n, self.path.m
        self._stand(arrays.after(self.path.psi, (samples - 1) * n))
        arrays.copy(self.lap, self.k, self.next_at)
        self._stand(self.path.psi)
        for i in range(self.k):
            self.lap[i] -= self.next_at[i]
        self._add(0.0, -1, SAMPLE)
        for s in range(1, samples):
            place = s - 1.0
            for i in range(self.k):
                self.at[i], self.away[i] = self.next_at[i], self.next_away[i]
            self._stand(arrays.after(self.path.psi, s * n))
            if not self._is_far():
                self.path.write_sums(arrays.after(self.path.tangents, s * n - n), self.slopes)
                self.path.write_sums(arrays.after(self.path.tangents, s * n), self.next_slopes)
                begun = self.rows
                for i in range(self.k):
                    self._mark(i, place)
                self._sort(begun)
            if self.rows + 3 > self.room:
                return False
            self._add(s * 1.0, -1, SAMPLE)
            self.rows -= 1
            if s < samples - 1 or not self.closed:
                self._keep(self.rows)
        if self.closed:
            self._merge_end_into_start()
        return True

    def _stand(self, psi: Flat) -> None:
        self.path.write_sums(psi, self.next_at)
        self._write_away(self.next_at, self.next_away)

    def _write_away(self, at: Flat, away: Flat) -> None:
        # How far each joint is beyond its limits, by the turns that are best, in rad.
        for i in range(self.k):
            low, high = self.joints[4 * i], self.joints[4 * i + 1]
            period, value = self.joints[4 * i + 2], at[i]
            if math.isfinite(period) and math.isfinite(low) and math.isfinite(high):
                value -= period * math.floor((value - low) / period)
                beyond = min(value - high, low + period - value)
            else:
                beyond = max(low - value, value - high)
            away[i] = beyond / self.joints[4 * i + 3]

    def _is_far(self) -> bool:
        # Whether a joint is far beyond its limits from one sample to the next.
        way: float = 0.0
        far: float = -1.0
        for i in range(self.k):
            way += abs(self.next_at[i] - self.at[i]) / self.joints[4 * i + 3]
            far = max(far, min(self.away[i], self.next_away[i]))
        return far > FAR + way

    def _mark(self, i: int, place: float) -> None:
        # Adds where a joint is at an end of its range or at a limit, after a sample.
        self.path.row = arrays.after(self.path.rows, i * self.path.n)
        slope, following, begin, here = self.slopes[i], self.next_slopes[i], place, self.at[i]
        # A joint that stands still has none.
        still = (
            abs(slope) < curve_path.SLOPE_TOLERANCE and abs(following) < curve_path.SLOPE_TOLERANCE
        )
        if (slope > 0.0) != (following > 0.0) and not still:
            self.path.function = curve_path.SLOPE
            fold = self.path.root(place, slope, place + 1.0, following)
            at = self.path.times(self.path.row, self.path.point.psi)
            self._add_here(fold, i, FOLD)
            self._mark_limits(i, begin, here, fold, at)
            begin, here = fold, at
        self._mark_limits(i, begin, here, place + 1.0, self.next_at[i])

    def _mark_limits(self, i: int, begin: float, first: float, end: float, last: float) -> None:
        low, high = min(first, last) - EXIT_MARGIN, max(first, last) + EXIT_MARGIN
        period = self.joints[4 * i + 2]
        for side in range(2):
            limit = self.joints[4 * i + side]
            if not math.isfinite(limit):
                continue
            if math.isfinite(period):
                limit += period * math.ceil((low - limit) / period)
            while limit <= high:
                # The mark is EXIT_MARGIN beyond the limit if the joint is within EXIT_MARGIN of
                # the limit at either end, and at the limit otherwise.
                least = limit + (EXIT_MARGIN if side == 1 else -EXIT_MARGIN)
                if (first > least) != (last > least):
                    if min(abs(first - limit), abs(last - limit)) > EXIT_MARGIN:
                        least = limit
                    self.path.function, self.path.value = curve_path.VALUE, least
                    self._add_here(
                        self.path.root(begin, first - least, end, last - least), i, side
                    )
                if not math.isfinite(period):
                    break
                limit += period

    def _add_here(self, place: float, i: int, side: int) -> None:
        # Adds where the point stands. More than there is room for end it: see above.
        if self.rows + 3 < self.room:
            self.path.write_sums(self.path.point.psi, arrays.after(self.row(self.rows), 2))
            self._write_kind(place, i, side)

    def _add(self, place: float, i: int, side: int) -> None:
        row = arrays.after(self.row(self.rows), 2)
        arrays.copy(row, self.k, self.next_at)
        self._write_kind(place, i, side)

    def _write_kind(self, place: float, i: int, side: int) -> None:
        self.row(self.rows)[0] = place
        self.kinds[2 * self.rows], self.kinds[2 * self.rows + 1] = i, side
        self.rows += 1

    def _sort(self, begun: int) -> None:
        # Orders the marks after a sample, and leaves out those that another one stands for.
        for i in range(begun + 1, self.rows):
            for j in range(i, begun, -1):
                if self.row(j - 1)[0] <= self.row(j)[0]:
                    break
                self._exchange(j - 1, j)
        marks, self.rows = self.rows, begun
        for i in range(begun, marks):
            self._keep(i)

    def _exchange(self, a: int, b: int) -> None:
        first, second = self.row(a), self.row(b)
        for j in range(self.wide):
            first[j], second[j] = second[j], first[j]
        for j in range(2):
            self.kinds[2 * a + j], self.kinds[2 * b + j] = (
                self.kinds[2 * b + j],
                self.kinds[2 * a + j],
            )

    def _keep(self, i: int) -> None:
        # Keeps row i behind those kept. Where both are one place, a limit stands for a sample or
        # an end of a range, and for the same joint's.
        last = self.rows - 1
        if self.row(i)[0] - self.row(last)[0] < PLACE_TOLERANCE:
            if self._is_limit(i) and not self._is_limit(last):
                self.rows = last
            elif not self._is_limit(i) or self.kinds[2 * i] == self.kinds[2 * last]:
                return
        if i != self.rows:
            self._exchange(i, self.rows)
        self.rows += 1

    def _is_limit(self, i: int) -> bool:
        return self.kinds[2 * i + 1] < FOLD

    def _merge_end_into_start(self) -> None:
        # A mark at the end of a closed curve is at its first sample: one of both rows stays, the
        # first, and has the kind of a limit if either has.
        last = self.rows - 1
        if self.row(last)[0] < self.path.m - 1.0 - PLACE_TOLERANCE or last == 0:
            return
        if self._is_limit(last) and self._is_limit(0):
            if self.kinds[0] == self.kinds[2 * last]:
                self.rows = last
            return
        if self._is_limit(last):
            self.kinds[0], self.kinds[1] = self.kinds[2 * last], self.kinds[2 * last + 1]
            for i in range(self.k):
                self.row(0)[2 + i] = self.row(last)[2 + i] - self.lap[i]
        self.rows = last

    def divide(self) -> int:
        """Write where pieces begin, and their turns; return how many there are, 0: none inside."""
        count, inside, ends = 0, False, self.path.m - 1.0
        for i in range(self.rows):
            if self._is_limit(i) or not self.closed and i in (0, self.rows - 1):
                self.begins[count] = i
                count += 1
        if count == 0:
            self.begins[0], count = 0, 1
        pieces = count if self.closed else count - 1
        for p in range(pieces):
            begin = self.row(self.begins[p])[0]
            if p + 1 < count:
                end = self.row(self.begins[p + 1])[0]
            else:
                end = self.row(self.begins[0])[0] + ends
            place = 0.5 * (begin + end)
            beyond = place >= ends
            self.path.stand_at(place - ends if beyond else place)
            self.path.write_sums(self.path.point.psi, self.next_at)
            for i in range(self.k):
                self.next_at[i] += self.lap[i] if beyond else 0.0
            if self._write_turns(arrays.whole_after(self.turns, 2 * self.k * p)):
                inside = True
        return pieces if inside else 0

    def _write_turns(self, turns: FlatIntegers) -> bool:
        # The least and largest numbers of turns that bring each joint inside; whether all can be.
        inside = True
        for i in range(self.k):
            low, high = self.joints[4 * i], self.joints[4 * i + 1]
            period, value = self.joints[4 * i + 2], self.next_at[i]
            first, last = 0.0, 0.0
            low, high = low - places.AT_LIMIT, high + places.AT_LIMIT
            if math.isfinite(period) and math.isfinite(low) and math.isfinite(high):
                first = math.ceil((low - value) / period)
                last = math.floor((high - value) / period)
            elif value < low or value > high:
                last = -1.0
            turns[2 * i], turns[2 * i + 1] = int(first), int(last)
            inside = inside and first <= last
        return inside

    def write_lengths(self) -> None:
        """Write how far along each row is; of a closed curve a last row, its first one again."""
        last = self.rows - 1
        if self.closed:
            last, end = self.rows, self.row(self.rows)
            end[0] = self.path.m - 1.0
            for i in range(self.k):
                end[2 + i] = self.row(0)[2 + i] + self.lap[i]
        self.row(0)[1] = 0.0
        for s in range(last):
            one, other, square = self.row(s), self.row(s + 1), 0.0
            for i in range(self.k):
                way = (other[2 + i] - one[2 + i]) / self.joints[4 * i + 3]
                square += way * way
            other[1] = one[1] + math.sqrt(square)


def cut(
    path: CurvePath,
    joints: Floats,
    closed: bool,
    table: Floats,
    kinds: Integers,
    begins: Integers,
    turns: Integers,
    rows: Integers,
) -> int:
    """
    Cut a curve where what is looked at is at a limit; return how many pieces it has.

    0: none is inside all limits, and not all is written. -1: there is not room enough.

    Parameters
    ----------
    path
        The curve, and k sums of positions, as joints.
    joints : shape (k, 4)
        Of each its limits, infinite ones are none; after which period they are ones again, or
        infinite; and what a rad counts.
    closed
        Whether the last sample is the first one, full turns added.
    table : shape (m, 2 + k)
        Samples, limits and ends of ranges in their order: the place, how far along it is (rad),
        and the sums. A row of places that are one; a closed curve has one row more, its first one
        a lap farther.
    kinds : shape (m, 2)
        Which of the sums is at a lower (0) or upper limit (1), or at an end of its range (2); 3: a
        sample.
    begins : shape (m,)
        Rows at which pieces begin, and of a curve that is not closed where the last one ends.
    turns : shape (m, k, 2)
        Of each piece the least and largest number of periods by which each sum is inside; none
        where the least is larger.
    rows : shape (1,)
        How many rows the table has, that one more left aside.
    """
    counts = arrays.whole_results(rows, 1)
    pieces = _CutCurve(path, joints, closed, table, kinds, begins, turns)
    if not pieces.lay_out():
        return -1
    count = pieces.divide()
    if count > 0:
        pieces.write_lengths()
        counts[0] = pieces.rows
    return count
