# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the level of each state and the node's warnings from a batch of measures."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....estimation.alarm import Alarm
from ....kinematics.singularity import Singularities
from ....robot.measures import Level, Thresholds
from .ingest import JointTimeout, KnownJoints

Levels = npt.NDArray[np.int8]


class Judged(NamedTuple):
    """
    Levels (N,) of states, with hysteresis, and the row numbers of states with a warning.

    `timeouts` has pairs: the row of a state, and the time-out just before it that gave a warning.
    """

    levels: Levels
    warnings: list[int]
    timeouts: list[tuple[int, JointTimeout]]


@dataclass
class Judge:
    """Judges states in the order of time. It remembers the last level and warning in `alarm`."""

    thresholds: Thresholds
    alarm: Alarm = Alarm()

    def judge(self, known: KnownJoints, singularity: Singularities) -> Judged:
        """Return levels and warnings of the next states, and the time-outs that give a warning."""
        directions, factors = singularity.lost_direction, singularity.factors
        nearest = None if factors is None else np.argmin(factors.estimates, axis=1)
        values = np.abs(getattr(singularity, self.thresholds.measure))
        # Start from the levels without hysteresis. They include the check for nearly singular
        # poses.
        levels = np.array(singularity.level, dtype=np.int8)
        judged = Judged(levels, [], [])
        for k, alone in enumerate(levels.tolist()):
            if k in known.timeouts:
                timeout = known.timeouts[k]
                self.alarm, say = self.alarm.step(Level.STALE, None, timeout.moment)
                judged.timeouts.extend([(k, timeout)] if say else [])
            # Skip a state if its level is OK and the last level was OK, because nothing changes.
            if alone == self.alarm.level == Level.OK and self.alarm.last is not None:
                continue
            level = self.thresholds.level(float(values[k]), self.alarm.level)
            level = max(level, Level(alone))
            levels[k] = level
            factor = None if nearest is None else int(nearest[k])
            arrival = int(known.arrivals[k])
            self.alarm, say = self.alarm.step(level, directions[k], arrival, factor)
            judged.warnings.extend([k] if say else [])
        return judged
