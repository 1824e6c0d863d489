"""Solutions: distinguished, sorted, and judged against the limits and the target."""

import math
from typing import TypeVar

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers
from .joints import Joints
from .residuals import Residual

Record = TypeVar('Record')
# Two solutions (rad, scaled) nearer than this may be one.
MAYBE_SAME = 1e-2
# Error of a solution that is round-off, as a share of the length.
AS_GOOD = 1e-13


class Solutions:
    """
    Room for solutions, nearest first, and for the properties of each.

    Parameters
    ----------
    joints
        Of the arm.
    near : shape (n,), rad or m
        Joint positions that solutions should be near.
    proved
        What misses the target by less is a solution, m.
    q : shape (N, n), rad or m
        Their joint positions, to be written.

    Attributes
    ----------
    count
        Their number.
    regular
        Whether what led to them is nowhere singular but for its errors.
    sure
        Whether those are small, too, so that there are no other solutions.
    """

    def __init__(self, joints: Joints, near: Floats, proved: float, q: Floats) -> None:
        self.most, self.n, self.count = arrays.extent(q, 0), arrays.extent(q, 1), 0
        self.joints, self.near, self.proved = joints, arrays.numbers(near, self.n), proved
        if self.joints.n != self.n:
            raise TypeError('an arm and the room for its solutions do not go together')
        self.regular, self.sure, self.q = False, False, q
        self.rows = arrays.results(q, self.most * self.n)
        self.misses, self.margins, self.shares = arrays.rooms(self.most, self.most, self.most)
        self.postures, self.beyond = arrays.whole_rooms(3 * self.most, self.most * self.n)

    def require_fit(self, residual: Residual, joints: int, most: int) -> None:
        """Refuse targets and forms of arms with other joints, and room for too few solutions."""
        if residual.n != self.n or joints != self.n or self.most < most:
            raise TypeError('a target, an arm and the room for its solutions do not go together')

    def represent(self, q: Flat) -> bool:
        """Turn q (n,) to where it is nearest; return whether it is inside the limits there."""
        self.joints.represent(self.near, q)
        return self.joints.are_inside(q)

    def take(self, k: int, q: Flat, misses: float) -> None:
        """Take q (n,) as solution k, with its distance to the limits."""
        n = self.n
        for j in range(n):
            self.rows[k * n + j] = q[j]
            self.beyond[k * n + j] = 1 if self.joints.space(j, q) < -places.AT_LIMIT else 0
        self.margins[k] = self.joints.margin(q)
        self.misses[k] = misses
        for i in range(3):
            self.postures[3 * k + i] = 0

    def require(self, k: int) -> None:
        """Raise IndexError if there is no solution k."""
        if not 0 <= k < self.count:
            raise IndexError('there are fewer solutions')

    def miss(self, k: int) -> float:
        """Return the error of solution k, m."""
        self.require(k)
        return self.misses[k]

    def margin(self, k: int) -> float:
        """
        Return the distance of solution k to the nearest limit, rad or m; negative beyond one.
        """
        self.require(k)
        return self.margins[k]

    def share(self, k: int) -> float:
        """Return the linear independence of the columns of J at solution k: see `pivots`."""
        self.require(k)
        return self.shares[k]

    def records(
        self,
        kind: type[Record],
        names: tuple[str, ...],
        postures: tuple[object, ...],
        exact: float,
        first: int,
        stop: int,
        only_feasible: bool,
    ) -> list[Record]:
        """
        Return solutions from `first` to before `stop` as objects that have their fields by name.

        Parameters
        ----------
        kind
            Their class. It is not called: the constructor of a frozen dataclass sets field by
            field, which takes a fifth of a call with a closed form.
        names
            Of the joints.
        postures
            What stands for the signs -1 -1 -1, -1 -1 0, and so on to 1 1 1 of `postures`.
        exact
            Largest error of a solution that is exact, m.
        only_feasible
            Whether to leave out those outside the limits.
        """
        if first < stop:
            self.require(first)
            self.require(stop - 1)
        found: list[Record] = []
        for k in range(first, stop):
            feasible = self.margins[k] >= -places.AT_LIMIT
            if only_feasible and not feasible:
                continue
            one = kind.__new__(kind)
            fields = one.__dict__
            signs = arrays.whole_after(self.postures, 3 * k)
            fields['q'] = self.q[k]
            fields['residual'] = self.misses[k]
            fields['feasible'] = feasible
            fields['beyond'] = () if feasible else self._beyond(k, names)
            fields['margin'] = self.margins[k]
            fields['posture'] = postures[13 + 9 * signs[0] + 3 * signs[1] + signs[2]]
            fields['multiplicity'] = 1
            fields['exact'] = self.misses[k] < exact
            found.append(one)
        return found

    def _beyond(self, k: int, names: tuple[str, ...]) -> tuple[str, ...]:
        # The names of the joints of solution k that are beyond their limits.
        return tuple([names[j] for j in range(self.n) if self.beyond[k * self.n + j] == 1])


class SolutionCandidates:
    """
    Joint positions that may be solutions, and room to sort them.

    Parameters
    ----------
    most, n
        The largest number of candidates, and the number of joints.
    """

    def __init__(self, most: int, n: int) -> None:
        self.n = n
        self.q, self.errors, self.away, self.halfway = arrays.rooms(most * n, most, most, n)
        self.which, self.met = arrays.whole_rooms(most, most)

    def sort_by_error(self, count: int) -> None:
        """Sort the first rows by their errors; rows with equal errors keep their order."""
        n, q, errors = self.n, self.q, self.errors
        for i in range(1, count):
            k = i
            while k > 0 and errors[k] < errors[k - 1]:
                errors[k], errors[k - 1] = errors[k - 1], errors[k]
                for j in range(k * n, k * n + n):
                    q[j], q[j - n] = q[j - n], q[j]
                k -= 1

    def keep_distinct(self, count: int, residual: Residual, joints: Joints, proved: float) -> int:
        """Do the work of `distinct` on the first rows, sorted by their errors."""
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
        # Equal up to round-off, or the point halfway is a solution, too.
        a, b = arrays.after(self.q, one * self.n), arrays.after(self.q, other * self.n)
        distance: float = 0.0
        for j in range(self.n):
            away = joints.without_turns(j, a[j] - b[j])
            self.halfway[j] = b[j] + 0.5 * away
            distance = max(distance, abs(away) / joints.scales[j])
        if distance >= MAYBE_SAME:
            return False
        if distance < places.SAME_SOLUTION:
            return True
        left = math.sqrt(residual.square(self.halfway, places.POSE))
        length = residual.size()
        return left < max(AS_GOOD * length, 4.0 * self.errors[one])


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

    Two rows are one solution if they are equal up to round-off, without full turns, or if they are
    near each other and the point halfway is a solution, too: at the border of the workspace two
    solutions meet, and are distinct as long as the target distinguishes them.

    Parameters
    ----------
    residual, joints
        Of the target, and of the arm.
    proved
        Rows with a smaller error are solutions, m.
    q, errors : shape (N, n), (N,)
        Joint positions and their errors, the least first.
    which, met : shape (N,)
        Rows kept, and the number of rows that each represents.
    """
    n, rows = joints.n, arrays.extent(q, 0)
    positions, left = arrays.numbers(q, rows * n), arrays.numbers(errors, rows)
    kept, times = arrays.whole_results(which, rows), arrays.whole_results(met, rows)
    found = SolutionCandidates(rows, n)
    arrays.copy(found.q, rows * n, positions)
    arrays.copy(found.errors, rows, left)
    count = found.keep_distinct(rows, residual, joints, proved)
    for k in range(count):
        kept[k], times[k] = found.which[k], found.met[k]
    return count


def least(numbers: Flat, count: int) -> int:
    """Return the index of the least of `count` numbers."""
    at = 0
    for i in range(1, count):
        if numbers[i] < numbers[at]:
            at = i
    return at
