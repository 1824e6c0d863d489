"""The level of each state and the warnings of the node, from the measures of a batch."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...estimation.alarm import Alarm
from ...formats.recordings.block import Times
from ...kernel import Floats
from ...robot.measures import MEASURES, Level, Thresholds
from .ingest import JointTimeout

Levels = npt.NDArray[np.int8]


class Judged(NamedTuple):
    """
    Levels (N,) with hysteresis, and the rows with a warning.

    `timeouts` are those with a warning, and the row they come before.
    """

    levels: Levels
    warnings: list[int]
    timeouts: list[tuple[int, JointTimeout]]


def _levels_after(thresholds: Thresholds, values: Floats) -> npt.NDArray[np.int8]:
    # Level of each value after each level before it, shape (3, N): as Thresholds.level.
    small = MEASURES[thresholds.measure].small_is_bad
    rows = []
    for before in (Level.OK, Level.WARN, Level.ERROR):
        levels = np.zeros(len(values), dtype=np.int8)
        for level, bound in zip((Level.WARN, Level.ERROR), thresholds.bounds_after(before)):
            good = values > bound if small else values < bound
            levels[~good] = level
        rows.append(levels)
    return np.stack(rows)


@dataclass
class Judge:
    """Judges states in their order; its memory is the node's alarm."""

    thresholds: Thresholds
    alarm: Alarm = Alarm()

    def judge(
        self,
        values: Floats,
        alone: Levels,
        directions: Floats,
        factors: Times | None,
        arrivals: Times,
        timeouts: dict[int, JointTimeout],
    ) -> Judged:
        """
        Return levels and warnings.

        Parameters
        ----------
        values : shape (N,)
            The watched measure, |det| for the determinant.
        alone : shape (N,)
            The level of each state by itself; the higher one of the two is meant where a nearer
            singular pose is not excluded.
        directions : shape (N, 6)
            Lost directions.
        factors : shape (N,)
            Index of the nearest named factor; None if the arm has none.
        arrivals : shape (N,), ns
            Steady clock.
        timeouts
            The time-out before a row.
        """
        levels = self._levels(values, alone, timeouts)
        before = np.concatenate([[self.alarm.level], levels[:-1]])
        # While the level stays OK there is no warning and nothing to remember.
        eventful = (levels != Level.OK) | (before != Level.OK)
        if self.alarm.last is None:
            eventful[:1] = True
        eventful[list(timeouts)] = True
        warnings: list[int] = []
        stale: list[tuple[int, JointTimeout]] = []
        for k in np.flatnonzero(eventful).tolist():
            if k in timeouts:
                self.alarm, say = self.alarm.step(Level.STALE, None, timeouts[k].moment)
                stale += [(k, timeouts[k])] if say else []
            factor = None if factors is None else int(factors[k])
            self.alarm, say = self.alarm.step(
                Level(int(levels[k])), directions[k], int(arrivals[k]), factor
            )
            warnings += [k] if say else []
        return Judged(levels, warnings, stale)

    def _levels(self, values: Floats, alone: Levels, timeouts: dict[int, JointTimeout]) -> Levels:
        after = np.maximum(_levels_after(self.thresholds, values), alone)
        levels: Levels = after[0].copy()
        # If the level before makes no difference, the loop is not needed.
        open_ = np.any(after != after[0], axis=0)
        previous = self.alarm.level
        for k in np.flatnonzero(open_).tolist():
            before = (int(levels[k - 1]) if k else previous) if k not in timeouts else Level.STALE
            levels[k] = after[0 if before == Level.STALE else before, k]
        return levels
