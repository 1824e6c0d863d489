"""
All curves of solutions of an arm with one joint more than its target asks for, and the proof.

One joint at the arm's end, held at a position, makes a slice: six joints, of whose complex
solutions all are found, as many as there can be. Each is followed, by certified charts, while the
joint makes a whole turn. Real ones are points of curves. Complex ones come in conjugate pairs, and
become real only where both meet: at a fold of a curve, where the joint is at an end of its range.
There is a disc about a fold in which the slice has exactly two solutions, by Rouche's theorem. So
at each position of the joint all solutions are known that there can be: a curve that is missing
would have more.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .... import kernel
from ....kernel import Floats
from ..problem.target import IkTarget
from .curve import SolutionCurve, curve_of, traced
from .sliced_arm import TRIED, SlicedArm

# Pieces of a complex solution's path that are shorter are at a fold, or end it (rad).
SHORTEST = 1e-12
# Tubes about a fold that are tried: the one that leaves most room.
TUBES = (0.1, 0.03, 0.01, 0.003, 0.001)
# Solutions of a slice are the same as points of a curve (rad or m).
SAME = 1e-7
# A point of a curve is in the tube of one of so many samples nearest to it; no chart reaches
# farther (rad): 0.69 over the root of n, in units in which a rad of each axis is 1 at least.
NEXT, REACH = 4, 0.35
# Positions of the held joint for slices that are to find, not to prove (rad).
MORE = np.linspace(-math.pi, math.pi, 24, endpoint=False) + 0.05
# Curves and pieces of complex solutions at most.
MOST_CURVES, MOST_PATHS = 64, 96
# Samples of all curves in closed form, ten times what those of a robot had.
MOST_SAMPLES = 20000
SINGULAR = 'a curve cannot be followed to its end: it passes a singular pose, or is too long'


class Fold(NamedTuple):
    """
    Where two solutions of slices meet: the held joint is at an end of its range along their curve.

    Attributes
    ----------
    t : shape (n, 2)
        The double solution.
    chart
        At it.
    position : rad
        Of the joint, within a turn after the slice.
    side
        Of a real one, 1 where two more solutions are real above it, -1 below; otherwise 0.
    room : rad
        How far from it the slice has exactly two solutions in the chart.
    share
        Of the chart, up to which those are.
    """

    t: Floats
    chart: kernel.CurveChart
    position: float
    side: int
    room: float
    share: float

    def holds(self, t: Floats) -> bool:
        """Return whether a solution (n, 2) of a slice, or its conjugate, is one of the two."""
        if kernel.holds(self.chart, t, self.share):
            return True
        return not self.side and kernel.holds(self.chart, t * [1.0, -1.0], self.share)

    def takes(self) -> int:
        """Return how many complex solutions, one of each pair, lead to it from below."""
        return 2 if not self.side else 1 if self.side > 0 else 0


class _Unproved(Exception):
    """The proof has a gap, in words."""


class CurveSearch:
    """
    The curves of solutions of a target that are known so far.

    Parameters
    ----------
    arm, target
        The arm and its target.

    Attributes
    ----------
    curves
        Each once.
    gap
        Why there may be others, in words; empty where it is proved that there are none.
    """

    def __init__(self, arm: SlicedArm, target: IkTarget) -> None:
        self.arm, self.target = arm, target
        self.chart, self.point = arm.chart(target), arm.point(target)
        self.curves: list[SolutionCurve] = []
        self.gap = 'no slice was found of which all solutions are known'
        # Whether a solution was met whose curve is not known.
        self.lost = False

    def prove(self) -> bool:
        """Find the curves, and return whether there is proof that these are all."""
        if self._take_closed():
            self.gap = ''
            return True
        for slices in self.arm.slices:
            most: tuple[float, Floats] = (TRIED[0], np.empty((0, len(self.arm.table), 2)))
            for position in TRIED:
                solutions = self.arm.solutions(slices, self.target, position)
                self.take_real(solutions)
                if len(solutions) > len(most[1]):
                    most = position, solutions
                if len(solutions) == slices.bound:
                    break
            # Where some are missing, the others may lead to curves all the same.
            hindrance = _Turn(self, slices.joint, most[0]).follow_all(most[1])
            if len(most[1]) == slices.bound:
                self.gap = hindrance
            if not self.gap:
                return True
        return False

    def _take_closed(self) -> bool:
        # All curves in closed form, where the arm has one and the target is not singular.
        if self.arm.closed is None:
            return False
        n = len(self.arm.table)
        samples, lengths = np.empty((MOST_SAMPLES, 2 * n)), np.zeros(MOST_CURVES, dtype=np.int64)
        motion = np.ascontiguousarray(self.arm.motion(self.target))
        count = kernel.closed_curves(self.arm.closed, self.point, motion, samples, lengths)
        ends = np.cumsum(lengths[: max(count, 0)])
        for end, length in zip(ends, lengths):
            curve = samples[end - length : end]
            self.curves.append(curve_of(self.chart, self.point, curve, self.arm.turning, True))
        return count >= 0

    def find_more(self, psi: Floats | None) -> bool:
        """
        Find more curves, without a proof; return whether one of them passes a solution (n,).

        That is not so where it is singular.
        """
        if psi is not None:
            self.take(psi)
        # First where there are curves: others are often symmetric to them.
        for slices in self.arm.slices:
            along = [curve.psi[:, slices.joint] for curve in self.curves]
            middles = [0.5 * float(path.min() + path.max()) for path in along]
            for position in [*middles, *MORE.tolist()]:
                self.take_real(self.arm.solutions(slices, self.target, position))
        return psi is not None and any(_is_on(curve, psi) for curve in self.curves)

    def take_real(self, solutions: Floats) -> None:
        """Trace the curves of the real ones of a slice's solutions (m, n, 2)."""
        for one in solutions[np.max(np.abs(solutions[:, :, 1]), axis=1) < SAME]:
            self.take(one[:, 0])

    def take(self, psi: Floats) -> None:
        """Trace the curve of a solution (n,), if it is on none that is known."""
        if any(_is_on(curve, psi) for curve in self.curves):
            return
        if len(self.curves) == MOST_CURVES:
            self.lost = True
            return
        curve = traced(self.chart, self.point, psi, self.arm.turning)
        if len(curve.psi) < 2 or not curve.closed or not _is_on(curve, psi):
            self.lost = True
        if len(curve.psi) > 1:
            self.curves.append(curve)


class _Turn:
    """The way of all complex solutions, one of each pair, through a whole turn of a joint."""

    def __init__(self, search: CurveSearch, joint: int, position: float) -> None:
        self.search, self.joint, self.position = search, joint, position
        self.chart = search.chart
        self.direction = np.eye(len(search.arm.table))[joint]
        self.folds: list[Fold] = []
        self.met: list[int] = []
        self.paths: list[Floats] = []
        self.counted = 0
        self.hindrance = ''

    def follow_all(self, solutions: Floats) -> str:
        """Follow the solutions (m, n, 2) of a slice; return what hinders the proof, or nothing."""
        complex_ones = solutions[np.max(np.abs(solutions[:, :, 1]), axis=1) >= SAME]
        self.paths = [one.copy() for one in _one_of_each_pair(complex_ones)]
        begun, ended = len(self.paths), 0
        if 2 * begun != len(complex_ones):
            self.hindrance = 'a complex solution has no conjugate'
        self._try(self._add_folds_of_curves)
        for _ in range(MOST_PATHS):
            if not self.paths:
                break
            ended += self._try(self._follow_one)
        matched = all(met == fold.takes() for met, fold in zip(self.met, self.folds))
        if self.search.lost:
            self.hindrance = SINGULAR
        if self.paths or not matched or begun != ended:
            self.hindrance = self.hindrance or 'complex solutions and folds do not match'
        return self.hindrance

    def _try(self, step: Callable[[], int]) -> int:
        try:
            return step()
        except _Unproved as gap:
            self.hindrance = self.hindrance or str(gap)
            return 0

    def _follow_one(self) -> int:
        # Follows a path; 1 if it came to the end of the turn.
        met = self._follow(self.paths.pop())
        if met is None:
            return 1
        self.met[met] += 1
        fold = self.folds[met]
        if self.met[met] == 1 and not fold.side:
            self.paths += [self._beside(fold, 1.0), self._beside(fold, -1.0)]
        return 0

    def _follow(self, t: Floats) -> int | None:
        # Follows a complex solution to the end of the turn (None), or to a fold (its number).
        passed: set[int] = set()
        while True:
            met = self._next(float(t[self.joint, 0]), passed)
            stop = self.position + math.tau
            if met is not None:
                fold = self.folds[met]
                stop = max(fold.position - 0.5 * fold.room, float(t[self.joint, 0]))
            if kernel.follow(self.chart, t, self.joint, stop, SHORTEST):
                if met is None or self.folds[met].holds(t):
                    return met
                passed.add(met)
            else:
                self._find_fold(t)

    def _next(self, here: float, passed: set[int]) -> int | None:
        # The next fold that a path may lead to.
        ahead = [
            (fold.position, k)
            for k, fold in enumerate(self.folds)
            if k not in passed and self.met[k] < fold.takes() and fold.position > here
        ]
        return min(ahead)[1] if ahead else None

    def _find_fold(self, t: Floats) -> None:
        # A path ends at a fold that is not known yet: of a curve, or of complex solutions.
        at = t.copy()
        if not kernel.fold_near(self.chart, at, self.joint):
            raise _Unproved(f'a slice is singular at {float(t[self.joint, 0]):.6g}')
        if np.max(np.abs(at[:, 1])) < SAME:
            known = len(self.search.curves)
            self.search.take(at[:, 0].copy())
            self._add_folds_of_curves()
            if len(self.search.curves) == known:
                raise _Unproved(f'a path ends before a fold at {float(at[self.joint, 0]):.6g}')
            return
        fold = self._fold(at)
        if fold is None or any(_are_one(fold.t, other.t) for other in self.folds):
            raise _Unproved(f'a slice is singular at {float(t[self.joint, 0]):.6g}')
        self._add(fold)

    def _beside(self, fold: Fold, side: float) -> Floats:
        # One of the two solutions above a fold.
        t = np.zeros_like(fold.t)
        away = 0.5 * fold.room
        kernel.write_beside_fold(fold.chart, self.joint, away, side, t)
        above = fold.position + away
        t[self.joint] = above, 0.0
        if not kernel.follow(self.chart, t, self.joint, above, SHORTEST) or not fold.holds(t):
            raise _Unproved('the complex solutions beyond a fold were not found')
        return t

    def _add_folds_of_curves(self) -> int:
        while self.counted < len(self.search.curves):
            curve = self.search.curves[self.counted]
            self.counted += 1
            if not curve.closed:
                raise _Unproved(SINGULAR)
            for place in curve.folds(self.direction):
                t = np.zeros((len(self.direction), 2))
                t[:, 0] = curve.at(place)
                fold = self._fold(t)
                if fold is None:
                    raise _Unproved('a fold of a curve is nearly one of higher order')
                self._add(fold)
        return 0

    def _add(self, fold: Fold) -> None:
        self.folds.append(fold)
        self.met.append(0)
        if fold.side < 0:
            self.paths.append(self._beside(fold, 1.0))

    def _fold(self, t: Floats) -> Fold | None:
        # The double solution t, with the tube that leaves most room.
        said, best = np.zeros(4), None
        t[self.joint, 0] = self.position + (t[self.joint, 0] - self.position) % math.tau
        away = np.max(np.abs(t[self.search.arm.turning, 1]))
        real = bool(away < SAME)
        for radius in TUBES:
            chart = self.search.arm.chart(self.search.target)
            if not kernel.fold_at(chart, t, self.joint, radius, said):
                continue
            side, room, share, far = said.tolist()
            # The joint is real; what is not real is apart from its conjugate.
            room -= abs(t[self.joint, 1])
            if room > 0.0 and (real or far < away) and (best is None or room > best.room):
                position = float(t[self.joint, 0])
                best = Fold(t, chart, position, int(side) if real else 0, room, share)
        return best


def _are_one(a: Floats, b: Floats) -> bool:
    return bool(np.max(np.abs(a - b)) < SAME or np.max(np.abs(a * [1.0, -1.0] - b)) < SAME)


def _one_of_each_pair(solutions: Floats) -> list[Floats]:
    # Of conjugate solutions the one whose first imaginary part that is not nothing is positive.
    chosen = []
    for one in solutions:
        imaginary = one[:, 1]
        if imaginary[np.argmax(np.abs(imaginary) > 0.5 * np.max(np.abs(imaginary)))] > 0.0:
            chosen.append(one)
    return chosen


def _is_on(curve: SolutionCurve, psi: Floats) -> bool:
    # Whether a solution (n,) is on a curve: in the tube of a piece next to it.
    away = (curve.psi - psi)[:, curve.turning]
    away -= math.tau * np.round(away / math.tau)
    far = np.abs(away, out=away).max(axis=1, initial=0.0)
    near = np.flatnonzero(far < REACH)
    nearest, psi = near[np.argsort(far[near])[:NEXT]], np.ascontiguousarray(psi)
    return any(kernel.passes(curve.chart, one, psi) for one in curve.psi[nearest])
