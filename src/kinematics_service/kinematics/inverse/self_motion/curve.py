"""A curve of solutions of an arm with one joint more than its target asks for."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....kernel import Floats
from ....robot.chain import FrozenArrays

# Most samples of a curve, eight times what the longest of a robot's had: where lengths are far
# apart a curve has no end.
MOST = 1 << 14
# Limits and ends of ranges of a curve that there is room for at first.
MARKS = 256


class CurvePieces(NamedTuple):
    """
    A curve cut where joints are at their limits.

    Attributes
    ----------
    table : shape (m, 2 + n)
        Samples, limits and ends of joints' ranges, in their order: the place, of
        `SolutionCurve.at`; how far along the curve (rad); the joint positions. The last row of a
        closed curve is its first one again.
    begins
        Rows at which pieces begin, and of a curve that is not closed where the last one ends.
    ends
        There: which joint is at a limit, and 0 or 1 for a lower or upper one; more for none.
    turns
        Of each piece the least and largest number of periods by which each joint is inside its
        limits; none where the least is larger.
    """

    table: Floats
    begins: list[int]
    ends: list[list[int]]
    turns: list[list[list[int]]]


@dataclass(frozen=True, eq=False)
class SolutionCurve(FrozenArrays):
    """
    A curve of solutions, in positions of the screws.

    Attributes
    ----------
    point
        Of the arm and its target.
    samples : shape (m, 2 n), rad or m
        Positions, and the unit tangents there. The last sample of a closed curve is the first
        one, full turns added.
    closed
        Whether it closes; otherwise it ends at singular poses.
    """

    point: 'kernel.CurvePoint'
    samples: Floats
    closed: bool

    @property
    def psi(self) -> Floats:
        """Return the positions of the samples, shape (m, n), rad or m."""
        return self.samples[:, : self.point.n]

    def path(self, rows: Floats) -> 'kernel.CurvePath':
        """Return the curve for the kernel, and sums of its positions (k, n) to be looked at."""
        psi, tangents = np.split(self.samples, 2, axis=1)
        return kernel.CurvePath(self.point, psi.copy(), tangents.copy(), rows.copy())


def places_of(path: 'kernel.CurvePath', places: Floats) -> Floats:
    """Return what is looked at (m, k) at places (m,) of a curve."""
    sums = np.empty((len(places), path.k))
    kernel.write_places(path, places, sums)
    return sums


def pieces_of(path: 'kernel.CurvePath', joints: Floats, closed: bool) -> CurvePieces | None:
    """
    Return the pieces of a curve between limits; None where none is inside all of them.

    `joints` (n, 4): limits, period, and what a rad counts, of each joint that is looked at.
    """
    room, rows = path.m + MARKS, np.empty(1, dtype=np.int64)
    while True:
        table, kinds = np.empty((room, 2 + path.k)), np.empty((room, 2), dtype=np.int64)
        begins = np.empty(room, dtype=np.int64)
        turns = np.empty((room, path.k, 2), dtype=np.int64)
        pieces = kernel.cut(path, joints, closed, table, kinds, begins, turns, rows)
        if pieces >= 0:
            break
        room *= 4
    if pieces == 0:
        return None
    begins = begins[: pieces + (not closed)]
    ends = kinds[begins].tolist()
    return CurvePieces(table[: rows[0] + closed], begins.tolist(), ends, turns[:pieces].tolist())


def traced(
    point: 'kernel.CurvePoint', start: Floats, turning: npt.NDArray[np.bool_]
) -> SolutionCurve | None:
    """
    Return the curve through a solution (n,), or None if that is singular.

    `turning` (n,): which screws turn.
    """
    first, closed = _samples(point, start, 1.0)
    if closed:
        n = len(start)
        turned = first[0].copy()
        turns = np.round((first[-1, :n] - turned[:n]) / math.tau)
        turned[:n] += np.where(turning, turns * math.tau, 0.0)
        return SolutionCurve(point, np.vstack([first, turned]), True)
    other, _ = _samples(point, start, -1.0)
    other[:, len(start) :] *= -1.0
    samples = np.vstack([other[:0:-1], first])
    return SolutionCurve(point, samples, False) if len(samples) > 1 else None


def _samples(point: 'kernel.CurvePoint', start: Floats, side: float) -> tuple[Floats, bool]:
    samples, closed = np.empty((MOST, 2 * len(start))), np.zeros(1, dtype=np.int64)
    count = kernel.trace(point, np.ascontiguousarray(start), side, samples, closed)
    return samples[:count].copy(), bool(closed[0])
