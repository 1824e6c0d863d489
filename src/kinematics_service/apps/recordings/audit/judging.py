"""The level of each state and the warnings of the node, from the measures of a batch."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....estimation.alarm import Alarm
from ....kernel import Floats
from ....kinematics.singularity import Singularities
from ....robot.measures import MEASURES, Level, Thresholds
from .ingest import JointTimeout, KnownJoints

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

    def judge(self, known: KnownJoints, singularity: Singularities) -> Judged:
        """Return levels and warnings of the next states, and of the time-outs before them."""
        arrivals, timeouts = known.arrivals, known.timeouts
        directions, factors = singularity.lost_direction, singularity.factors
        nearest = None if factors is None else np.argmin(factors.estimates, axis=1)
        levels = self._levels(singularity, timeouts)
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
            factor = None if nearest is None else int(nearest[k])
            self.alarm, say = self.alarm.step(
                Level(int(levels[k])), directions[k], int(arrivals[k]), factor
            )
            warnings += [k] if say else []
        return Judged(levels, warnings, stale)

    def _levels(self, singularity: Singularities, timeouts: dict[int, JointTimeout]) -> Levels:
        values = np.abs(getattr(singularity, self.thresholds.measure))
        # The level by itself is the higher one where the pose is nearly singular.
        alone = np.asarray(singularity.level, dtype=np.int8)
        after = np.maximum(_levels_after(self.thresholds, values), alone)
        levels: Levels = after[0].copy()
        # If the level before makes no difference, the loop is not needed.
        open_ = np.any(after != after[0], axis=0)
        previous = self.alarm.level
        for k in np.flatnonzero(open_).tolist():
            before = (int(levels[k - 1]) if k else previous) if k not in timeouts else Level.STALE
            levels[k] = after[0 if before == Level.STALE else before, k]
        return levels
