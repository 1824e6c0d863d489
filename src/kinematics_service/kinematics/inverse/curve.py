"""A curve of solutions of an arm with one joint more than its target asks for."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...robot.chain import FrozenArrays

# Most samples of a curve, eight times what the longest of a robot's had, and those that there is
# room for at first: where lengths are far apart a curve has no end.
MOST, FEW = 1 << 14, 1 << 12
# Steps to where a joint is at an end of its range, or at a position; a joint that is as near to it
# is there (rad or m).
STEPS, THERE = 60, 1e-13


@dataclass(frozen=True, eq=False)
class SolutionCurve(FrozenArrays):
    """
    A curve of solutions, in positions of the screws.

    Attributes
    ----------
    chart
        Of the arm and its target.
    psi, tangents : shape (m, n), rad or m
        Samples, and the unit tangents there. Of a closed curve the last sample is the first one,
        full turns added. Between two of them the curve is a graph over one joint, by proof.
    turning : shape (n,)
        Which screws turn.
    closed
        Whether it closes; otherwise it ends where it cannot be followed, near singular poses.
    """

    READ_ONLY: ClassVar = ('psi', 'tangents')

    chart: kernel.CurveChart
    psi: Floats
    tangents: Floats
    turning: npt.NDArray[np.bool_]
    closed: bool

    def at(self, place: float) -> Floats:
        """Return the solution (n,) at a place: a sample's number and a share of the next piece."""
        k = min(int(place), len(self.psi) - 2)
        x = place - k
        a, b = self.psi[k], self.psi[k + 1]
        size = math.sqrt(float((b - a) @ (b - a)))
        u, v = self.tangents[k] * size, self.tangents[k + 1] * size
        # Hermite's cubic.
        p = (1 + 2 * x) * (1 - x) ** 2 * a + x * (1 - x) ** 2 * u
        p = p + x * x * (3 - 2 * x) * b + x * x * (x - 1) * v
        return self.moved_onto(p, int(np.argmax(np.abs(self.tangents[k] + self.tangents[k + 1]))))

    def moved_onto(self, psi: Floats, joint: int) -> Floats:
        """Return positions near the curve (n,) moved onto it, one joint held."""
        t = np.zeros((len(psi), 2))
        t[:, 0] = psi
        kernel.corrected(self.chart, t, joint)
        return t[:, 0].copy()

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
        slopes = self.tangents @ direction
        places = []
        for k in np.flatnonzero((slopes[1:] > 0.0) != (slopes[:-1] > 0.0)).tolist():

            def slope(x: float, k: int = k) -> float:
                return float(self.tangent_at(self.at(k + x), k) @ direction)

            places.append(k + _root(slope, float(slopes[k]), float(slopes[k + 1])))
        return places

    def crossings(self, direction: Floats, value: float, places: list[float]) -> list[float]:
        """
        Return the places where a motion (n,) times the positions is a value.

        `places` are those of its folds: between them it rises or falls.
        """
        among = {x: float(self.at(x) @ direction) for x in places}
        among.update(enumerate((self.psi @ direction).tolist()))
        ends = sorted(among)
        values = np.array([among[x] for x in ends]) - value
        found = []
        for i in np.flatnonzero((values[1:] > 0.0) != (values[:-1] > 0.0)).tolist():
            a, b = ends[i], ends[i + 1]

            def away(x: float, a: float = a, b: float = b) -> float:
                return float(self.at(a + x * (b - a)) @ direction) - value

            found.append(a + (b - a) * _root(away, float(values[i]), float(values[i + 1])))
        return found


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    # Where a function of 0 to 1 vanishes that has different signs at both: the Illinois method.
    a, b = 0.0, 1.0
    for _ in range(STEPS):
        if low == high:
            break
        x = (a * high - b * low) / (high - low)
        y = function(x)
        if abs(y) < THERE:
            return float(x)
        if (y > 0.0) != (high > 0.0):
            a, low = b, high
        else:
            low *= 0.5
        b, high = x, y
    return float(b)


def traced(
    chart: kernel.CurveChart, start: Floats, turning: npt.NDArray[np.bool_]
) -> SolutionCurve:
    """Return the curve through a solution (n,); `turning` says which screws turn."""
    first, closed = _samples(chart, start, 1.0)
    if closed:
        n = len(start)
        last = first[-1] if len(first) else start
        turned = first[0].copy()
        turns = np.round((last[:n] - turned[:n]) / math.tau)
        turned[:n] += np.where(turning, turns * math.tau, 0.0)
        return _curve(chart, np.vstack([first, turned]), turning, True)
    other, _ = _samples(chart, start, -1.0)
    other[:, len(start) :] *= -1.0
    return _curve(chart, np.vstack([other[:0:-1], first]), turning, False)


def _curve(
    chart: kernel.CurveChart, samples: Floats, turning: npt.NDArray[np.bool_], closed: bool
) -> SolutionCurve:
    n = len(turning)
    return SolutionCurve(chart, samples[:, :n].copy(), samples[:, n:].copy(), turning, closed)


def _samples(chart: kernel.CurveChart, start: Floats, side: float) -> tuple[Floats, bool]:
    room = FEW
    while True:
        samples, closed = np.empty((room, 2 * len(start))), np.zeros(1, dtype=np.int64)
        count = kernel.trace(chart, np.ascontiguousarray(start), side, samples, closed)
        if closed[0] or count < room or room >= MOST:
            return samples[:count].copy(), bool(closed[0])
        room *= 4
