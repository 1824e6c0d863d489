"""Where a motion would have been slowed by `ks.scale`, and why."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....errors import RecordingError, ServoSettingsError
from ....kernel import Floats
from ....kinematics.scale import scale
from ....kinematics.servo_rule import ServoRule
from ....robot.robot import Robot
from ..readers.columns import Column
from .timeline import Stretch, Timeline, stretches_of

# States whose constraints are held at once.
AT_ONCE = 2**14


class SlowedStretch(NamedTuple):
    """
    States in a row that would have been slowed by the same cause.

    Attributes
    ----------
    begin, end : s
        From the first of them to the one after the last, or to the last there is.
    cause
        In words: `singularity`, `position limit of elbow`.
    value
        The least share of the velocities that would have been kept.
    worst
        Its row of the timeline.
    """

    begin: float
    end: float
    cause: str
    value: float
    worst: int

    @property
    def seconds(self) -> float:
        """Return how long it lasts, s."""
        return self.end - self.begin


@dataclass(frozen=True, eq=False)
class Slowing:
    """
    What `ks.scale` says of every state.

    Attributes
    ----------
    values : shape (N,)
        The share of the velocities; NaN where these are not known.
    stretches
        In their order.
    unknown
        Number of states without velocities.
    """

    values: Column[np.float64]
    stretches: tuple[SlowedStretch, ...]
    unknown: int

    @property
    def by_cause(self) -> dict[str, float]:
        """Return the seconds of each cause, the longest first."""
        seconds: dict[str, float] = {}
        for one in self.stretches:
            seconds[one.cause] = seconds.get(one.cause, 0.0) + one.seconds
        return dict(sorted(seconds.items(), key=lambda pair: -pair[1]))


class SlowingSettings(NamedTuple):
    """Whether the `reduced` speeds of the robot file hold, and MoveIt Servo's rule if it does."""

    reduced: bool = False
    rule: ServoRule | None = None


def slowing_of(robot: Robot, timeline: Timeline, settings: SlowingSettings) -> Slowing:
    """
    Return what `ks.scale` says of every state of a timeline.

    Raises
    ------
    RecordingError
        Reduced speeds are asked for, and the robot file has none; MoveIt Servo's rule is, for an
        arm with closed loops.
    """
    values, causes = Column(np.float64), Column(np.int16)
    words: list[str] = []
    for begin in range(0, len(timeline), AT_ONCE):
        rows = slice(begin, min(begin + AT_ONCE, len(timeline)))
        q, qdot = timeline.q[rows], timeline.qdot[rows]
        moving = ~np.any(np.isnan(qdot), axis=1)
        try:
            asked = np.where(moving[:, None], qdot, 0.0)
            found = scale(robot, q, asked, reduced=settings.reduced, rule=settings.rule)
        except ServoSettingsError as error:
            raise RecordingError(str(error)) from None
        words = [one.words for one in found.constraints]
        values.append(np.where(moving, found.value, np.nan))
        slower = moving & (found.value < 1.0)
        causes.append(np.where(slower, np.argmin(found.values, axis=-1), -1))
    shares = np.asarray(values)
    runs = stretches_of([(np.asarray(causes), timeline.silent[:])])
    slowed = [run for run in runs if run.label >= 0]
    stretches = tuple(_stretch(timeline, shares, run, words[run.label]) for run in slowed)
    return Slowing(values, stretches, int(np.sum(np.isnan(shares))))


def _stretch(timeline: Timeline, shares: Floats, run: Stretch, cause: str) -> SlowedStretch:
    begin, end = (float(timeline.t[row]) for row in (run.first, run.until))
    worst = run.first + int(np.argmin(shares[run.first : run.last + 1]))
    return SlowedStretch(begin, end, cause, float(shares[worst]), worst)
