# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Store solutions of inverse kinematics with their errors, margins and postures, and remove
duplicates.
"""

import math
from typing import TypeVar

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers
from .joints import Joints
from .residuals import Residual

Record = TypeVar('Record')
PostureName = TypeVar('PostureName')
# Two candidates are distinct solutions if the position of a joint differs by this number or more,
# rad; the difference of a prismatic joint is divided by the characteristic length. If all joints
# differ by less, the error at the midpoint of the two candidates decides.
MAX_DUPLICATE_DISTANCE = 1e-2
# Two candidates within MAX_DUPLICATE_DISTANCE are one solution if the error at their midpoint is
# round-off: below MIDPOINT_TOLERANCE * residual.size(). The tolerance is 500 times the round-off
# of forward kinematics.
MIDPOINT_TOLERANCE = 1e-13
# Two candidates within MAX_DUPLICATE_DISTANCE are also one solution if the error at their midpoint
# is above round-off, but below MIDPOINT_ERROR_RATIO * e. Here e is the error of the worse of the
# two candidates.
MIDPOINT_ERROR_RATIO = 4.0


class Solutions:
    """
    Solutions of inverse kinematics for one target, with the error, margin and posture of each.

    Parameters
    ----------
    joints
        The joints of the arm.
    near : shape (n,), rad or m
        Reference joint positions. The solutions are stored in the order of their distances to
        these positions, the nearest first.
    proved
        Joint positions are a solution if their error is below this, m.
    q : shape (N, n), rad or m
        Array that the joint positions of the solutions are written to.

    Attributes
    ----------
    count
        Number of solutions.
    regular
        Whether the closed form gave a candidate for each solution, all candidates converged, and
        no two candidates converged to the same solution.
    sure
        Whether each candidate is proved to be within 0.01 rad of a solution in all joint
        positions, all candidates converged, and no two candidates converged to the same solution.
        Then no other solution exists.
    """

    def __init__(self, joints: Joints, near: Floats, proved: float, q: Floats) -> None:
        self.most, self.n, self.count = arrays.extent(q, 0), arrays.extent(q, 1), 0
        self.joints, self.near, self.proved = joints, arrays.numbers(near, self.n), proved
        if self.joints.n != self.n:
            raise TypeError('an arm and the room for its solutions do not go together')
        self.regular, self.sure, self.q = False, False, q
        self.rows = arrays.results(q, self.most * self.n)
        self.errors, self.margins, self.shares = arrays.rooms(self.most, self.most, self.most)
        (self.postures,) = arrays.whole_rooms(3 * self.most)

    def require_fit(self, residual: Residual, joints: int, capacity: int) -> None:
        """
        Raise TypeError if the solutions of a target do not fit into the array q (N, n).

        `residual` is the residual of the target, and `joints` is the number of joints of the arm.
        Three conditions are checked: residual.n is n, `joints` is n, and N is at least `capacity`.
        """
        if residual.n != self.n or joints != self.n or self.most < capacity:
            raise TypeError('a target, an arm and the room for its solutions do not go together')

    def represent(self, q: Flat) -> bool:
        """
        Add full turns to q (n,) by `Joints.represent`; return whether q is then inside the limits.
        """
        self.joints.represent(self.near, q)
        return self.joints.are_inside(q)

    def add(self, q: Flat, error: float) -> None:
        """Store a solution q (n,) with its error, m, behind the earlier solutions."""
        k = self.count
        self.count += 1
        arrays.copy(arrays.after(self.rows, k * self.n), self.n, q)
        self.margins[k] = self.joints.margin(q)
        self.errors[k] = error
        for i in range(3):
            self.postures[3 * k + i] = 0

    def require(self, k: int) -> None:
        """Raise IndexError unless a solution with index k exists."""
        if not 0 <= k < self.count:
            raise IndexError('there are fewer solutions')

    def miss(self, k: int) -> float:
        """Return the remaining error of solution k, m."""
        self.require(k)
        return self.errors[k]

    def margin(self, k: int) -> float:
        """
        Return the least distance of a joint of solution k to one of its limits, rad or m.

        The distance is negative if a joint is beyond a limit.
        """
        self.require(k)
        return self.margins[k]

    def share(self, k: int) -> float:
        """
        Return the pivot ratio of J at solution k (see `dependence.pivot_ratio`). The ratio is 0 if
        J has lost rank.
        """
        self.require(k)
        return self.shares[k]

    def records(
        self,
        kind: type[Record],
        names: tuple[str, ...],
        postures: tuple[PostureName, ...],
        exact: float,
        first: int,
        stop: int,
        only_feasible: bool,
    ) -> list[Record]:
        """
        Return solutions `first` to `stop` - 1 as objects of class `kind`.

        Parameters
        ----------
        kind
            The class. Its fields are set without its constructor, because the constructor of a
            frozen dataclass would take a fifth of the time in which a closed form solves a target.
        names
            Names of the joints.
        postures
            One object for each of the 27 triples of signs (see `kernel.postures`), in the order -1
            -1 -1, -1 -1 0, ..., 1 1 1.
        exact
            A solution is exact if its error is below this, m.
        only_feasible
            Whether to omit solutions outside the limits.
        """
        if first < stop:
            self.require(first)
            self.require(stop - 1)
        records: list[Record] = []
        for k in range(first, stop):
            feasible = self.margins[k] >= -places.AT_LIMIT
            if only_feasible and not feasible:
                continue
            record = kind.__new__(kind)
            fields = record.__dict__
            signs = arrays.whole_after(self.postures, 3 * k)
            fields['q'] = self.q[k]
            fields['residual'] = self.errors[k]
            fields['feasible'] = feasible
            fields['beyond'] = () if feasible else self._beyond(k, names)
            fields['margin'] = self.margins[k]
            fields['posture'] = postures[13 + 9 * signs[0] + 3 * signs[1] + signs[2]]
            fields['multiplicity'] = 1
            fields['exact'] = self.errors[k] < exact
            records.append(record)
        return records

    def _beyond(self, k: int, names: tuple[str, ...]) -> tuple[str, ...]:
        # Returns the names of the joints that are beyond their limits in solution k.
        q = arrays.after(self.rows, k * self.n)
        return tuple(
            [names[j] for j in range(self.n) if self.joints.space(j, q) < -places.AT_LIMIT]
        )


class SolutionCandidates:
    """
    Joint positions that may solve a target, with their errors, and work arrays to compare them.

    Parameters
    ----------
    most, n
        The largest number of candidates, and the number of joints.
    """

    def __init__(self, rows: int, n: int) -> None:
        self.n = n
        self.q, self.errors, self.distances, self.midpoint = arrays.rooms(rows * n, rows, rows, n)
        self.which, self.met = arrays.whole_rooms(rows, rows)

    def keep_distinct(self, count: int, residual: Residual, joints: Joints, proved: float) -> int:
        """
        Select the distinct solutions among the first `count` rows of q; return the number of
        distinct solutions.
        """
        kept = 0
        arrays.copy(self.distances, count, self.errors)
        for _ in range(count):
            k = least(self.distances, count)
            if not self.errors[k] < proved:
                break
            self.distances[k] = places.INFINITY
            is_duplicate = False
            for i in range(kept):
                is_duplicate = self._is_duplicate(k, self.which[i], residual, joints)
                if is_duplicate:
                    self.met[i] += 1
                    break
            if not is_duplicate:
                self.which[kept] = k
                self.met[kept] = 1
                kept += 1
        return kept

    def _is_duplicate(self, k: int, other: int, residual: Residual, joints: Joints) -> bool:
        a, b = arrays.after(self.q, k * self.n), arrays.after(self.q, other * self.n)
        distance: float = 0.0
        for j in range(self.n):
            motion = joints.without_turns(j, a[j] - b[j])
            self.midpoint[j] = b[j] + 0.5 * motion
            distance = max(distance, abs(motion) / joints.scales[j])
        if distance >= MAX_DUPLICATE_DISTANCE:
            return False
        if distance < places.SOLUTION_TOLERANCE:
            return True
        error = math.sqrt(residual.square(self.midpoint, places.POSE))
        round_off = MIDPOINT_TOLERANCE * residual.size()
        return error < max(round_off, MIDPOINT_ERROR_RATIO * self.errors[k])


def distinct(
    residual: Residual,
    joints: Joints,
    proved: float,
    q: Floats,
    errors: Floats,
    kept: Integers,
    counts: Integers,
) -> int:
    """
    Fill `kept` with the indices of rows of q, one row for each distinct solution. Return the
    number of distinct solutions.

    Two rows are one solution if they are equal up to round-off and full turns. Two rows that
    differ by less than 0.01 rad are also one solution if the tool at their midpoint reaches the
    target. The error at the midpoint must be round-off, or less than four times the larger error
    of the two rows. Near the border of the workspace, two distinct solutions may differ by less
    than 0.01 rad, but the error at their midpoint is larger.

    Parameters
    ----------
    residual, joints
        The residual of the target, and the joints of the arm.
    proved
        A row of q is a solution if its error is below this, m.
    q, errors : shape (N, n) and (N,), rad or m, m
        Joint positions, and the errors of the tool at these positions.
    kept, counts : shape (N,)
        `kept`: indices of the kept rows, the row of least error first. `counts`: for each kept
        row, the number of rows of q that are this solution.
    """
    n, rows = joints.n, arrays.extent(q, 0)
    positions, row_errors = arrays.numbers(q, rows * n), arrays.numbers(errors, rows)
    kept_rows, met_counts = arrays.whole_results(kept, rows), arrays.whole_results(counts, rows)
    candidates = SolutionCandidates(rows, n)
    arrays.copy(candidates.q, rows * n, positions)
    arrays.copy(candidates.errors, rows, row_errors)
    count = candidates.keep_distinct(rows, residual, joints, proved)
    for k in range(count):
        kept_rows[k], met_counts[k] = candidates.which[k], candidates.met[k]
    return count


def least(numbers: Flat, count: int) -> int:
    """
    Return the index of the least of the first `count` numbers. If several numbers are least,
    return the first index.
    """
    index = 0
    for i in range(1, count):
        if numbers[i] < numbers[index]:
            index = i
    return index
