# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the intervals of a recording in which `ks.scale` would have slowed the motion, and why."""

from typing import NamedTuple

import numpy as np

from ....errors import RecordingError, ServoSettingsError
from ....kernel import Floats
from ....kinematics.scale import scale
from ....kinematics.servo_rule import ServoRule
from ....robot.robot import Robot
from ..readers.stored_columns import Column, spans
from .timeline import Stretch, Timeline, stretches_of

# Number of states for each call of `scale`. The number is limited to bound the memory.
BATCH = 2**14


class SlowedStretch(NamedTuple):
    """
    Consecutive states in which `ks.scale` would have slowed the motion for one cause.

    Attributes
    ----------
    begin, end : s
        Time of the first slowed state, and of the first state after the slowed states. If no state
        follows, the end is the time of the last slowed state.
    cause
        The cause as text, such as `singularity` or `position limit of elbow`.
    value
        The least scale: allowed velocity divided by the velocity of the recording.
    worst
        The row of the least scale in the timeline.
    """

    begin: float
    end: float
    cause: str
    value: float
    worst: int

    @property
    def seconds(self) -> float:
        """Return the duration, s."""
        return self.end - self.begin


class Slowing(NamedTuple):
    """
    What `ks.scale` returns for all states of a recording.

    Attributes
    ----------
    values : shape (N,)
        Scale of each state: the allowed velocity divided by the velocity in the recording. NaN if
        the velocity is unknown.
    stretches
        The slowed intervals, in order.
    unknown
        Number of states without velocities.
    """

    values: Column[np.float64]
    stretches: tuple[SlowedStretch, ...]
    unknown: int

    @property
    def by_cause(self) -> dict[str, float]:
        """
        Return for each cause how long it would have slowed the motion in total, s; the longest
        first.
        """
        seconds: dict[str, float] = {}
        for stretch in self.stretches:
            seconds[stretch.cause] = seconds.get(stretch.cause, 0.0) + stretch.seconds
        return dict(sorted(seconds.items(), key=lambda pair: -pair[1]))


class SlowingSettings(NamedTuple):
    """
    Settings of `ks.scale`: whether the robot file's `reduced` speed limits apply, and the
    parameters of MoveIt Servo's slowing near singular poses, or None.
    """

    reduced: bool = False
    rule: ServoRule | None = None


def slowing_of(robot: Robot, timeline: Timeline, settings: SlowingSettings) -> Slowing:
    """
    Return where and why `ks.scale` would have slowed the motion of a timeline.

    Raises
    ------
    RecordingError
        `settings.reduced` is true, but the robot file has no reduced speeds. Or `settings.rule` is
        given, but the arm has closed loops, which MoveIt Servo's rule does not support.
    """
    values, causes = Column(np.float64), Column(np.int16)
    words: list[str] = []
    for rows in spans(len(timeline), BATCH):
        q, qdot = timeline.q[rows], timeline.qdot[rows]
        moving = ~np.any(np.isnan(qdot), axis=1)
        try:
            velocities = np.where(moving[:, None], qdot, 0.0)
            scaling = scale(robot, q, velocities, reduced=settings.reduced, rule=settings.rule)
        except ServoSettingsError as error:
            raise RecordingError(str(error), code=error.code) from None
        words = [constraint.words for constraint in scaling.constraints]
        values.append(np.where(moving, scaling.value, np.nan))
        slower = moving & (scaling.value < 1.0)
        causes.append(np.where(slower, np.argmin(scaling.values, axis=-1), -1))
    shares = values[:]
    runs = stretches_of([(causes[:], timeline.silent[:])])
    slowed = [run for run in runs if run.label >= 0]
    stretches = tuple(_stretch(timeline, shares, run, words[run.label]) for run in slowed)
    return Slowing(values, stretches, int(np.sum(np.isnan(shares))))


def _stretch(timeline: Timeline, shares: Floats, run: Stretch, cause: str) -> SlowedStretch:
    begin, end = (float(timeline.t[row]) for row in (run.first, run.until))
    worst = run.first + int(np.argmin(shares[run.first : run.last + 1]))
    return SlowedStretch(begin, end, cause, float(shares[worst]), worst)
