"""
Stretches of a recording near a singularity, each with its name, duration and worst moment.

"""

from typing import NamedTuple

import numpy as np

from ..kernel import Floats
from ..measures import MEASURES, Level
from ..notice import direction_in_words, joints_in_words
from ..robot import Robot
from ..singularities import singularity
from .timeline import Timeline


class Passed(NamedTuple):
    """
    A named factor near its zero: its least distance (rad) and the row of the timeline.

    """

    name: str
    distance: float
    row: int


class Stretch(NamedTuple):
    """
    Messages in a row that are not OK.

    Attributes
    ----------
    first, last, worst
        Rows of the timeline.
    begin, end : s
        From the first message that is not OK to the first that is, or to the last there is.
    level
        The worst.
    stopped : s
        Time at level ERROR.
    value
        Worst value of the watched measure.
    factor
        Name of the nearest factor at the worst moment, empty where the file lists none.
    factors
        All factors that are the nearest at some time, in the order of their worst moments.
    lost, fighting
        At the worst moment, in words: the tool's lost motion, the joints against each other.
    q : shape (n,), rad or m
        Joint positions at the worst moment.

    """

    first: int
    last: int
    worst: int
    begin: float
    end: float
    level: Level
    stopped: float
    value: float
    factor: str
    factors: tuple[Passed, ...]
    lost: str
    fighting: str
    q: Floats

    @property
    def seconds(self) -> float:
        """
        Return how long it lasts, s.

        """
        return self.end - self.begin


def watched_values(robot: Robot, timeline: Timeline) -> Floats:
    """
    Return the watched measure of every state, |det| for the determinant, shape (N,).

    """
    values: Floats = np.abs(timeline.measures[robot.thresholds.measure])
    return values


def badness(robot: Robot, values: Floats) -> Floats:
    """
    Return values of the watched measure with the sign that makes the larger one the worse.

    """
    sign = -1.0 if MEASURES[robot.thresholds.measure].small_is_bad else 1.0
    worse: Floats = np.where(np.isnan(values), np.inf, sign * values)
    return worse


def stretches_of(robot: Robot, timeline: Timeline) -> tuple[Stretch, ...]:
    """
    Return the stretches near a singularity, in their order.

    """
    bad = timeline.levels != Level.OK
    begins = bad & ~np.concatenate([[False], bad[:-1]]) | bad & timeline.silent
    ends = bad & ~np.concatenate([bad[1:], [False]])
    ends[:-1] |= bad[:-1] & timeline.silent[1:]
    values = watched_values(robot, timeline)
    worse = badness(robot, values)
    return tuple(
        _stretch(robot, timeline, values, worse, first, last)
        for first, last in zip(np.flatnonzero(begins).tolist(), np.flatnonzero(ends).tolist())
    )


def _stretch(
    robot: Robot, timeline: Timeline, values: Floats, worse: Floats, first: int, last: int
) -> Stretch:
    worst = first + int(np.argmax(worse[first : last + 1]))
    until = last + 1 if last + 1 < len(timeline) and not timeline.silent[last + 1] else last
    t = timeline.t[first : until + 1]
    levels = timeline.levels[first : last + 1]
    # Each message holds until the next one.
    holds = np.diff(t, append=t[-1:])[: len(levels)]
    near = singularity(robot, timeline.q[worst])
    names = robot.factors.names
    factor = names[int(np.argmin(timeline.factors[worst]))] if names else ''
    return Stretch(
        first=first,
        last=last,
        worst=worst,
        begin=float(t[0]),
        end=float(t[-1]),
        level=Level(int(np.max(levels))),
        stopped=float(np.sum(holds[levels == Level.ERROR])),
        value=float(values[worst]),
        factor=factor,
        factors=_factors(robot, timeline, first, last),
        lost=direction_in_words(near.lost_direction),
        fighting=joints_in_words(robot.joint_names, near.joint_motion),
        q=timeline.q[worst],
    )


def _factors(robot: Robot, timeline: Timeline, first: int, last: int) -> tuple[Passed, ...]:
    if not robot.factors.names:
        return ()
    distances = timeline.factors[first : last + 1]
    nearest = np.argmin(distances, axis=1)
    passed = []
    for k in np.unique(nearest).tolist():
        rows = np.flatnonzero(nearest == k)
        row = int(rows[np.argmin(distances[rows, k])])
        passed.append(Passed(robot.factors.names[k], float(distances[row, k]), first + row))
    return tuple(sorted(passed, key=lambda one: one.row))
