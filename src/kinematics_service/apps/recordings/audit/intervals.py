# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the intervals of time in which the arm is near a singularity, with duration and worst state.
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ....estimation.status_text import direction_in_words, joints_in_words
from ....kernel import Floats
from ....kinematics.singularity import Singularity, flat_loop, singularity
from ....robot.measures import MEASURES, Level
from ....robot.robot import Robot
from ..readers.stored_columns import spans
from .timeline import Stretch, Timeline, stretches_of


class FactorPassage(NamedTuple):
    """
    The state of a recording at which a singular factor comes nearest to zero.

    A singular factor is a function of q whose zeros are singular poses. `name` is the name of the
    factor. `row` is the row of the state in the timeline. `distance` is the joint motion (rad)
    from the state to a zero of the factor, estimated from the factor's value and gradient.
    """

    name: str
    distance: float
    row: int


class Interval(NamedTuple):
    """
    Consecutive states with level WARN or ERROR, with their duration and the worst of them.

    Attributes
    ----------
    first, last, worst
        Rows of the timeline.
    begin, end : s
        Time of the first state that is not OK, and time of the next OK state, or of the last
        state.
    level
        The worst level.
    stopped : s
        Duration of the states with level ERROR.
    value
        Worst value of the watched measure: the singularity measure to which the thresholds of the
        robot file apply.
    factor
        Name of the singular factor that is nearest to zero in the worst state; empty if the robot
        file lists none.
    factors
        Singular factors that the arm comes near. Each comes with the state in which the factor is
        nearest to zero, in the order of the states. A factor is listed only if it is nearer to
        zero than all other factors in at least one state.
    lost, fighting
        At the worst moment, as text: the direction in which the tool cannot move, and the joints
        whose motions cancel.
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
    factors: tuple[FactorPassage, ...]
    lost: str
    fighting: str
    q: Floats

    @property
    def seconds(self) -> float:
        """Return the duration, s."""
        return self.end - self.begin


def watched_values(robot: Robot, timeline: Timeline, rows: slice) -> Floats:
    """
    Return the values, shape (N,), of the measure to which the robot file's thresholds apply, for
    the states in `rows`. For the determinant, return |det|.
    """
    return np.asarray(np.abs(timeline.measures[robot.singularity.thresholds.measure][rows]))


def watched_at(robot: Robot, timeline: Timeline, row: int) -> float:
    """Return the value of the measure to which the robot file's thresholds apply, at one state."""
    return float(watched_values(robot, timeline, slice(row, row + 1))[0])


def badness(robot: Robot, timeline: Timeline, rows: slice) -> Floats:
    """
    Return how near the states in `rows` are to a singularity, shape (N,): the watched measure,
    negated if small values are bad. NaN becomes inf.
    """
    values = watched_values(robot, timeline, rows)
    sign = -1.0 if MEASURES[robot.singularity.thresholds.measure].small_is_bad else 1.0
    return np.where(np.isnan(values), np.inf, sign * values)


def intervals_of(robot: Robot, timeline: Timeline) -> tuple[Interval, ...]:
    """
    Return the intervals in which the arm is near a singularity (WARN or ERROR), in the order of
    time.
    """
    pieces = (
        (timeline.levels[rows] != Level.OK, timeline.silent[rows]) for rows in spans(len(timeline))
    )
    return tuple(_interval(robot, timeline, run) for run in stretches_of(pieces) if run.label)


def _interval(robot: Robot, timeline: Timeline, run: Stretch) -> Interval:
    _, first, last, until = run
    level, stopped = Level.OK, 0.0
    worst, worse = first, -math.inf
    passed: dict[int, FactorPassage] = {}
    for span in spans(last + 1 - first):
        rows = slice(first + span.start, first + span.stop)
        t = timeline.t[rows.start : min(rows.stop, until) + 1]
        levels = timeline.levels[rows]
        # Compute how long each state's level lasts: until the next state.
        holds = np.diff(t, append=t[-1:])[: len(levels)]
        level = max(level, Level(int(np.max(levels))))
        stopped += float(np.sum(holds[levels == Level.ERROR]))
        bad = badness(robot, timeline, rows)
        k = int(np.argmax(bad))
        if bad[k] > worse:
            worst, worse = rows.start + k, float(bad[k])
        _pass(robot, timeline, rows, passed)
    near = singularity(robot, timeline.q[worst])
    return Interval(
        first=first,
        last=last,
        worst=worst,
        begin=float(timeline.t[first]),
        end=float(timeline.t[until]),
        level=level,
        stopped=stopped,
        value=watched_at(robot, timeline, worst),
        factor=_nearest(robot, near),
        factors=tuple(sorted(_named(robot, timeline, passed.values()), key=lambda item: item.row)),
        lost='' if flat_loop(robot, near) else direction_in_words(near.lost_direction),
        fighting=joints_in_words(robot.joint_names, near.joint_motion),
        q=timeline.q[worst],
    )


def _nearest(robot: Robot, near: Singularity) -> str:
    # Returns the name of the singular factor nearest to zero, or '' if the arm has no factors. A
    # factor of a closed loop has the loop's name. If the loop equations are not singular at the
    # nearest singular pose, returns '' instead of the loop's name.
    if near.factors is None:
        return ''
    k = near.factors.nearest
    return (
        flat_loop(robot, near) if robot.singularity.factors.is_loop(k) else near.factors.names[k]
    )


def _named(
    robot: Robot, timeline: Timeline, passages: Iterable[FactorPassage]
) -> Iterator[FactorPassage]:
    for passage in passages:
        if passage.name not in robot.loop_names or passage.name == _nearest(
            robot, singularity(robot, timeline.q[passage.row])
        ):
            yield passage


def _pass(robot: Robot, timeline: Timeline, rows: slice, passed: dict[int, FactorPassage]) -> None:
    # Updates `passed`, which holds for each singular factor the state that comes nearest to a zero
    # of the factor. A state is considered only for one factor: the factor that is nearest to zero
    # in this state.
    if not robot.singularity.factors.names:
        return
    distances = timeline.factors[rows]
    nearest = np.argmin(distances, axis=1)
    for k in np.unique(nearest).tolist():
        states = np.flatnonzero(nearest == k)
        row = int(states[np.argmin(distances[states, k])])
        distance = float(distances[row, k])
        if k not in passed or distance < passed[k].distance:
            passed[k] = FactorPassage(
                robot.singularity.factors.names[k], distance, rows.start + row
            )
