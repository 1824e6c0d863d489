"""A curve of solutions of an arm with one joint more than its target asks for."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats, Integers
from ...robot.chain import FrozenArrays

# Most samples of a curve, eight times what the longest of a robot's had, and those that there is
# room for at first: where lengths are far apart a curve has no end.
MOST, FEW = 1 << 14, 1 << 12
# Ends of ranges and limits of a curve that there is room for at first.
MARKS = 256


class CurveMarks(NamedTuple):
    """
    Where on a curve a sum of positions is at an end of its range, or at a limit.

    Attributes
    ----------
    places : shape (m,)
        Of `SolutionCurve.at`.
    rows : shape (m,)
        Which of the sums.
    sides : shape (m,)
        0 or 1 for a lower or upper limit, 2 for an end of the range.
    """

    places: Floats
    rows: Integers
    sides: Integers


@dataclass(frozen=True, eq=False)
class SolutionCurve(FrozenArrays):
    """
    A curve of solutions, in positions of the screws.

    Attributes
    ----------
    chart, point
        Of the arm and its target.
    psi, tangents : shape (m, n), rad or m
        Samples, and the unit tangents there. Of a closed curve the last sample is the first one,
        full turns added. Between two of them the curve is a graph over one joint, by proof.
    turning : shape (n,)
        Which screws turn.
    closed
        Whether it closes; otherwise it ends where it cannot be followed, near singular poses.
    """

    chart: kernel.CurveChart
    point: kernel.CurvePoint
    psi: Floats
    tangents: Floats
    turning: npt.NDArray[np.bool_]
    closed: bool

    def path(self, rows: Floats) -> kernel.CurvePath:
        """Return the curve for the kernel, and sums of its positions (k, n) to be looked at."""
        return kernel.CurvePath(self.point, self.psi, self.tangents, np.ascontiguousarray(rows))

    def at(self, place: float) -> Floats:
        """Return the solution (n,) at a place: a sample's number and a share of the next piece."""
        path = self.path(np.empty((0, len(self.turning))))
        return np.asarray(places_of(path, np.array([place]))[0])

    def tangent_at(self, psi: Floats, k: int) -> Floats:
        """Return the tangent (n,) at a solution on the piece after sample k."""
        t, tangent = np.zeros((len(psi), 2)), np.zeros(len(psi))
        t[:, 0] = psi
        kernel.tangent_at(self.chart, t, tangent)
        return -tangent if tangent @ self.tangents[k] < 0.0 else tangent

    def spread(self, begin: Floats, end: Floats) -> Floats:
        """
        Return how far the curve leaves the chord of two solutions (n,) at most, shape (n,), by
        proof; infinite where they are too far apart for one.
        """
        widths = np.empty(len(begin))
        if not kernel.spread(self.chart, begin, end, widths):
            widths[:] = math.inf
        return widths

    def folds(self, direction: Floats) -> list[float]:
        """Return the places where a motion (n,) times the positions is largest or smallest."""
        path, nothing = self.path(direction[None]), np.full((1, 2), np.inf)
        marks = marks_of(path, nothing, nothing[0, :1])
        return [] if marks is None else marks.places.tolist()


def places_of(path: kernel.CurvePath, places: Floats) -> Floats:
    """Return the solutions (m, n) at places (m,) of a curve."""
    psi = np.empty((len(places), path.n))
    kernel.write_places(path, places, psi)
    return psi


def marks_of(path: kernel.CurvePath, limits: Floats, periods: Floats) -> CurveMarks | None:
    """
    Return where the sums that are looked at are at ends of their ranges or at limits.

    `limits` (k, 2) come again after each period (k,). None: one of them is never inside.
    """
    room = MARKS
    while True:
        places, kinds = np.empty(room), np.empty((room, 2), dtype=np.int64)
        count = kernel.marks(path, limits, periods, places, kinds)
        if count < 0:
            return None
        if count <= room:
            return CurveMarks(places[:count], *kinds[:count].T)
        room = count


def traced(
    chart: kernel.CurveChart,
    point: kernel.CurvePoint,
    start: Floats,
    turning: npt.NDArray[np.bool_],
) -> SolutionCurve:
    """Return the curve through a solution (n,); `turning` says which screws turn."""
    first, closed = _samples(chart, start, 1.0)
    if closed:
        n = len(start)
        last = first[-1] if len(first) else start
        turned = first[0].copy()
        turns = np.round((last[:n] - turned[:n]) / math.tau)
        turned[:n] += np.where(turning, turns * math.tau, 0.0)
        return curve_of(chart, point, np.vstack([first, turned]), turning, True)
    other, _ = _samples(chart, start, -1.0)
    other[:, len(start) :] *= -1.0
    return curve_of(chart, point, np.vstack([other[:0:-1], first]), turning, False)


def curve_of(
    chart: kernel.CurveChart,
    point: kernel.CurvePoint,
    samples: Floats,
    turning: npt.NDArray[np.bool_],
    closed: bool,
) -> SolutionCurve:
    """Return the curve of samples (m, 2 n): positions and tangents."""
    n = len(turning)
    psi, tangents = samples[:, :n].copy(), samples[:, n:].copy()
    return SolutionCurve(chart, point, psi, tangents, turning, closed)


def _samples(chart: kernel.CurveChart, start: Floats, side: float) -> tuple[Floats, bool]:
    room = FEW
    while True:
        samples, closed = np.empty((room, 2 * len(start))), np.zeros(1, dtype=np.int64)
        count = kernel.trace(chart, np.ascontiguousarray(start), side, samples, closed)
        if closed[0] or count < room or room >= MOST:
            return samples[:count].copy(), bool(closed[0])
        room *= 4
