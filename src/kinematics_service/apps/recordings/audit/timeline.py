# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Store the states of an arm at all messages of a recording, in columns."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ....estimation.status_text import StatusText
from ....kernel import Floats
from ....kinematics.singularity import Singularities
from ....kinematics.tool_state import ToolState
from ....robot.measures import MEASURES
from ....robot.robot import Robot
from ..readers.block import Flags
from ..readers.stored_columns import Column, StateTable
from .ingest import KnownJoints
from .judging import Levels
from .reported_velocities import MotionColumns


class Stretch(NamedTuple):
    """
    Consecutive states with the same label, such as the level WARN: rows `first` to `last`.

    The stretch lasts until the time of row `until`. Usually `until` is `last` + 1, the row of the
    next state. If the recording ends after row `last`, or if messages are interrupted after row
    `last`, `until` is `last`.
    """

    label: int
    first: int
    last: int
    until: int


def stretches_of(
    pieces: Iterable[tuple[npt.NDArray[np.integer[Any]], Flags]],
) -> Iterator[Stretch]:
    """
    Split a recording into stretches: consecutive states with the same label.

    Parameters
    ----------
    pieces
        Successive blocks of states. A block has two arrays: the label of each state (N,), and
        flags (N,) that mark an interruption of the messages before a state. A stretch may begin in
        one block and end in a later block.
    """
    label = first = count = 0
    for labels, breaks in pieces:
        label = label if count else int(labels[0])
        before = np.concatenate([[label], labels[:-1]])
        for k in np.flatnonzero((labels != before) | breaks).tolist():
            row = count + k
            if row > first:
                yield Stretch(label, first, row - 1, row - int(breaks[k]))
            first, label = row, int(labels[k])
        count += len(labels)
    if count:
        yield Stretch(label, first, count - 1, count - 1)


class PublishedWarning(NamedTuple):
    """
    A warning that the node would have published at `moment` (ns, time of receipt). `row` is the
    first state at or after this time.
    """

    row: int
    moment: int
    status_text: StatusText


class Timeline(MotionColumns):
    """
    The N states of a recording, stored in columns.

    Values without a column (Jacobian, quaternion, twist, other measures) are computed again from
    `q` and `qdot` if needed.

    Attributes
    ----------
    messages : shape (N,)
        Number, from 0, of the message that completed each state.
    turned : shape (N,)
        Whether the published quaternion has the opposite sign of the kernel's quaternion.
    position : shape (N, 3), m; speed : shape (N,), m/s; turning : shape (N,), rad/s
        Position and speeds of the tool in the base frame; speeds are NaN if unknown.
    measures : by name, shape (N,)
        Singularity measures: the watched measure, to which the thresholds of the robot file apply,
        and those with a chart on the HTML page.
    distance, nearest_singular : shape (N,), rad; shape (N, n), rad or m
        Distance to the nearest singular pose, and that pose. They are stored because the search
        for the nearest singular pose starts from the result in the state before.
    factors : shape (N, F), rad
        Joint motion from the state to a zero of each of the F singular factors of the robot file,
        estimated from the factor's value and gradient.
    levels : shape (N,)
        Singularity level of each state: OK, WARN or ERROR, with hysteresis.
    silent : shape (N,)
        Whether joints had timed out (level STALE) just before the state.
    warnings
        The warnings that the node would have published.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot.dof)
        self.messages, self.position = Column(np.int64), StateTable(3)
        self.turned = Column(np.bool_)
        self.speed, self.turning = Column(np.float64), Column(np.float64)
        kept = [measure.name for measure in MEASURES.values() if measure.on_page]
        self.measures = {
            name: Column(np.float64) for name in (robot.singularity.thresholds.measure, *kept)
        }
        self.distance, self.nearest_singular = Column(np.float64), StateTable(robot.dof)
        self.factors = StateTable(len(robot.singularity.factors.names))
        self.levels, self.silent = Column(np.int8), Column(np.bool_)
        self.warnings: list[PublishedWarning] = []

    @property
    def end(self) -> float:
        """Return the time of the last state, s since the first."""
        return float(self.t[-1])

    def append(self, batch: 'TimelineBatch', levels: Levels, turned: Flags) -> None:
        """Add the next batch of states."""
        known, state, singularity = batch.known, batch.state, batch.singularity
        twist = np.where(known.moving[:, None], state.twist, np.nan)
        silent = np.zeros(len(known), dtype=bool)
        silent[list(known.timeouts)] = True
        self.messages.append(known.messages)
        self.add(known.stamps, known.q, known.qdot, known.differenced)
        self.turned.append(turned)
        self.position.append(state.position)
        self.speed.append(np.linalg.norm(twist[:, :3], axis=1))
        self.turning.append(np.linalg.norm(twist[:, 3:], axis=1))
        for name, column in self.measures.items():
            column.append(getattr(singularity, name))
        self.distance.append(singularity.distance)
        self.nearest_singular.append(singularity.nearest_singular)
        factors = singularity.factors
        none = np.zeros((len(known), 0))
        self.factors.append(none if factors is None else factors.estimates)
        self.levels.append(levels)
        self.silent.append(silent)


class TimelineBatch(NamedTuple):
    """
    Successive states of a recording with all results that the node would publish for them.

    `first` is the row of the first of these states in the timeline; `warnings` are about these
    states.
    """

    first: int
    known: KnownJoints
    state: ToolState
    quaternion_xyzw: Floats
    singularity: Singularities
    warnings: list[PublishedWarning]
