# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute which singularity level each state has, and when the node would publish a warning."""

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
    Singularity levels (N,) of N states, with hysteresis, and the rows of the states at which the
    node would publish a warning.

    `timeouts` lists the warnings about stale joint states, as pairs (row, timeout). `timeout` has
    the joints without a recent position and the time at which the node reports STALE. `row` is the
    row of the first state after this time.
    """

    levels: Levels
    warnings: list[int]
    timeouts: list[tuple[int, JointTimeout]]


@dataclass
class Judge:
    """
    Judges states in the order of time. Between calls, the attribute `alarm` keeps the level and
    the time of the last published warning.
    """

    thresholds: Thresholds
    alarm: Alarm = Alarm()

    def judge(self, known: KnownJoints, singularity: Singularities) -> Judged:
        """
        Return the singularity level (OK, WARN, ERROR) of each state in `known`, and the states and
        time-outs at which the node would publish a warning.
        """
        directions, factors = singularity.lost_direction, singularity.factors
        nearest = None if factors is None else np.argmin(factors.estimates, axis=1)
        values = np.abs(getattr(singularity, self.thresholds.measure))
        # Start from the level of each state without hysteresis. Hysteresis can only raise the
        # level.
        levels = np.array(singularity.level, dtype=np.int8)
        judged = Judged(levels, [], [])
        for k, alone in enumerate(levels.tolist()):
            if k in known.timeouts:
                timeout = known.timeouts[k]
                self.alarm, say = self.alarm.step(Level.STALE, None, timeout.moment)
                judged.timeouts.extend([(k, timeout)] if say else [])
            # Skip a state if its level is OK and the last published level was OK too, because then
            # the node publishes no warning.
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
