# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Cut a solution curve into arcs at the joint limits.

An arc is a part of the curve inside the joint limits, as long as possible. It ends where one joint
passes a limit while all other joints are inside their limits. The arcs are found in three stages.

Steps: a step ends at a sample of the curve, or where a joint reverses its direction. So in each
step every joint only rises or only falls, and passes a limit at most once. Steps with a joint far
beyond its limits are skipped, because no arc ends in such a step.

Pieces: a piece ends where a joint passes a limit. The posture in the middle of a piece determines
how many full turns must be added to each joint to bring the piece inside the limits.

Arcs: a vector of full turns has a whole number for each joint. The module `turns` joins successive
pieces if one vector, added to the joint positions, brings all of them inside the limits. Such a
sequence of pieces is called a run. Each run becomes one arc.
"""

import functools
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....kernel import Floats, Integers
from ..problem.plan import InversePlan
from .arcs import SIDES, IkArc, IkArcEnd, squares_of
from .curve import NO_PERIOD, SolutionCurve
from .turns import PieceRun, runs_of

Flags = npt.NDArray[np.bool_]
# A joint passes a limit if its distance beyond the limit exceeds this, rad or m. The number is
# half of kernel.AT_LIMIT. It is larger than round-off, so that a joint that rests at a limit does
# not pass the limit.
EXIT_MARGIN = 5e-10
# A joint reverses between two samples of a solution curve if the product of its slopes at both
# samples is below this. The slope is the derivative of the joint position by the length of the
# curve. If the product is between this and 0, the joint rests, or reverses at a sample.
MAX_SLOPE_PRODUCT = -1e-18
# Two places of the curve are taken as equal if they differ by less than this fraction of a sample
# distance. For samples 0.1 rad apart this is 2e-10 rad.
PLACE_TOLERANCE = 2e-9
# Number that replaces an infinite joint limit, rad or m. It is less than NO_PERIOD, and larger
# than any motion of a joint.
NO_LIMIT = 1e9


# Value of the column `side` in those rows of `_CutCurve.table` at which no joint passes a limit.
NO_SIDE = len(SIDES)


@functools.lru_cache(maxsize=128)
def _counted(plan: InversePlan) -> tuple[Floats, Floats, Floats]:
    # Returns the joint limits (2, n), the periods (n,) and the lengths of full turns (n,). The
    # length is 0 for a joint without a limit or without a period.
    limited = np.isfinite(plan.limits).all(axis=1) & np.isfinite(plan.periods)
    limits = np.clip(plan.limits.T, -NO_LIMIT, NO_LIMIT)
    periods = np.where(limited, plan.periods, NO_PERIOD)
    return limits, periods, np.where(limited, plan.periods, 0.0)


def arcs_of(curve: SolutionCurve) -> tuple[IkArc, ...]:
    """
    Return the arcs of a solution curve inside the limits. Arcs that differ only by full turns are
    one arc.
    """
    near = _is_near(curve)
    if not near.any():
        return ()
    cut = _CutCurve(curve, near)
    return tuple(map(cut.arc, cut.runs()))


def _is_near(curve: SolutionCurve) -> Flags:
    # Returns a flag for each step between two samples of the curve: whether the joints may be
    # inside their limits somewhere in the step. The flag is False if a joint is farther beyond its
    # limit than the sum of the motions of all joints in the step.
    q, ((low, high), periods, _) = curve.q, _counted(curve.plan)
    turned = q - periods * np.floor((q - low) / periods)
    away = np.minimum(turned - high, low + periods - turned) / curve.plan.scales
    motion = (np.abs(q[1:] - q[:-1]) / curve.plan.scales).sum(axis=1)
    return np.asarray(np.minimum(away[:-1], away[1:]).max(axis=1) <= motion)


class _CutCurve:
    # A solution curve that is cut into pieces at the joint limits. `table` has one row for each
    # sample, each passage of a limit and each reversal of a joint. The columns are: place on the
    # curve, n joint positions, length of the curve up to the place (rad), joint, side of the
    # limit. The rows are sorted by place. For a closed curve, the table has the rows of one lap.
    # The vector `lap`, added to a row, gives the row one lap later. `begins` has the index of the
    # first row of each piece. On an open curve, the last number of `begins` is the index of the
    # last row.

    def __init__(self, curve: SolutionCurve, near: Flags) -> None:
        self.curve, self.near = curve, near
        self.limits, self.periods, self.turn = _counted(curve.plan)
        self.table = np.empty((curve.last + 1, curve.point.n + 4))
        self.table[:, 0], self.table[:, 1:-3] = range(curve.last + 1), curve.q
        self.table[:, -2:] = 0, NO_SIDE
        self._add_turning_places()
        self._add_limits()
        q, sides = self.table[:, 1:-3], self.table[:, -1]
        steps = np.sqrt(squares_of((q[1:] - q[:-1]) / curve.plan.scales))
        self.table[:, -3] = np.concatenate([[0.0], steps.cumsum()])
        self.lap = np.array([curve.last, *curve.lap, self.table[-1, -3], 0.0, 0.0])
        if curve.closed:
            self.table = self.table[(self.table[:, 0] < curve.last) | (sides < NO_SIDE)]
        passes = self.table[:, -1] < NO_SIDE
        passes[[0, -1]] |= not curve.closed
        passes[0] |= not passes.any()
        self.begins = np.flatnonzero(passes).tolist()
        self.count = len(self.begins) - (not curve.closed)

    def _add_turning_places(self) -> None:
        slopes = self.curve.samples[:, self.curve.point.n :]
        k, joint = np.nonzero((slopes[:-1] * slopes[1:] < MAX_SLOPE_PRODUCT) & self.near[:, None])
        none = np.full(len(k), np.nan)
        self._add(k, (joint, none, slopes[k, joint], slopes[k + 1, joint]), NO_SIDE)

    def _add_limits(self) -> None:
        # A joint passes a limit in a step if its number of full turns beyond the limit changes.
        # `turns` has this number for each row, limit and joint, shape (rows, 2, n).
        places, q = self.table[:, 0], self.table[:, 1:-3]
        beyond = self.limits + [[-EXIT_MARGIN], [EXIT_MARGIN]]
        turns = np.floor((q[:, None] - beyond) / self.periods)
        near = self.near[places[:-1].clip(max=self.curve.last - 1).astype(int)]
        k, side, joint = np.nonzero((turns[:-1] != turns[1:]) & near[:, None, None])
        turned = self.periods[joint] * np.maximum(turns[k, side, joint], turns[k + 1, side, joint])
        before, after, limit = q[k, joint], q[k + 1, joint], self.limits[side, joint] + turned
        # `level` is the limit, moved into the range from `before` to `after`. The joint moves over
        # this range in the step. The limit may be up to EXIT_MARGIN outside.
        level = np.clip(limit, np.minimum(before, after), np.maximum(before, after))
        self._add(k, (joint, level, before - level, after - level), side)

    def _add(self, k: Integers, roots: Sequence[Floats | Integers], side: Integers | int) -> None:
        # Adds a row to the table between rows k and k + 1, for each index k. At the added row, a
        # joint passes the position `level` or reverses. So a function f is zero there: the joint
        # position minus `level`, or the slope of the joint position. `roots` has, for each added
        # row, the joint, the level, and f at the rows k and k + 1.
        joint, level, low, high = roots
        rows, places = np.empty((len(k), self.table.shape[1])), self.table[:, 0]
        rows[:, -2], rows[:, -1] = joint, side
        brackets = np.array([joint, level, places[k], low, places[k + 1], high])
        kernel.write_roots(self.curve.path, brackets, rows)
        table = np.vstack([self.table, rows])
        self.table = table[table[:, 0].argsort(kind='stable')]

    def _rows(self, rows: Integers) -> Floats:
        # Returns rows of the table by their indices. On a closed curve, an index may exceed the
        # number of rows: index + (number of rows) means the same row one lap later.
        laps, k = np.divmod(rows, len(self.table))
        return np.asarray(self.table[k] + laps[:, None] * self.lap)

    def _begin(self, piece: int) -> int:
        # Returns the index, in the table, of the row at which a piece begins. On a closed curve,
        # `piece` may exceed the number of pieces: piece + (number of pieces) means the same piece
        # one lap later. The index then exceeds the number of rows (see `_rows`).
        laps, k = divmod(piece, len(self.begins))
        return self.begins[k] + laps * len(self.table)

    def runs(self) -> Iterator[PieceRun]:
        """
        Return the runs of the curve: longest sequences of successive pieces inside the limits.

        Full turns are added to the joint positions of a piece to bring the piece inside the
        limits. Within a run, the number of full turns added to each joint is constant.
        """
        places = self._rows(np.array([self._begin(k) for k in range(self.count + 1)]))[:, 0]
        q, (low, high) = self.curve.at(0.5 * (places[1:] + places[:-1])), self.limits
        first = np.ceil((low - kernel.AT_LIMIT - q) / self.periods)
        last = np.floor((high + kernel.AT_LIMIT - q) / self.periods)
        boxes = np.stack([first, last], axis=2).astype(int).tolist()
        lap = np.round(self.lap[1:-3] / self.periods) * self.curve.closed
        return runs_of(boxes, self.curve.closed, lap.astype(int).tolist())

    def arc(self, run: PieceRun) -> IkArc:
        """Return the arc that consists of the pieces of `run`."""
        begin, end = self._begin(run.first), self._begin(run.first + run.pieces)
        rows = self._rows(np.arange(begin, end + 1))
        gaps = rows[1:, 0] - rows[:-1, 0]
        apart = (gaps > PLACE_TOLERANCE) & (rows[-1, 0] - rows[1:, 0] > PLACE_TOLERANCE)
        apart[-1] = True
        rows = rows[np.concatenate([[True], apart])]
        turned = self.turn * run.turns
        q = rows[:, 1:-3] + turned
        s = rows[:, -3] - rows[0, -3]
        ends = () if run.closed else (self._end(rows[0], q[0]), self._end(rows[-1], q[-1]))
        places = rows[:, 0].copy()
        return IkArc(q, s, run.closed, ends, run.windings, self.curve, places, turned)

    def _end(self, row: Floats, q: Floats) -> IkArcEnd:
        joint, side = int(row[-2]), int(row[-1])
        if side == NO_SIDE:
            return IkArcEnd('', 'singular')
        # Find the joint at whose limit the arc ends. It is `joint` if the position of `joint` in q
        # is at a limit. Otherwise `joint` is one or more full turns away from its limit. Then take
        # the joint whose position in q is nearest to a limit.
        away = np.abs(self.limits - q)
        if away[:, joint].min() > kernel.AT_LIMIT:
            joint = int(away.min(axis=0).argmin())
        return IkArcEnd(self.curve.robot.joint_names[joint], SIDES[int(away[:, joint].argmin())])
