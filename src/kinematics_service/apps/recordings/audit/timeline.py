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
from ..readers.columns import Column, StateTable
from .ingest import KnownJoints
from .judging import Levels
from .reported_velocities import MotionColumns


class Stretch(NamedTuple):
    """
    Consecutive states with equal labels, in the rows `first` to `last`.

    The stretch ends at the time of row `until`. This is the row of the next state; before a break
    or the end of the recording it is `last`.
    """

    label: int
    first: int
    last: int
    until: int


def stretches_of(
    pieces: Iterable[tuple[npt.NDArray[np.integer[Any]], Flags]],
) -> Iterator[Stretch]:
    """
    Yield the stretches of states with equal labels. Each piece has the labels (N,) of states, and
    flags (N,) that mark a break before a state.
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
    A warning that the node would have published. `row` is the first state at or after the time of
    the warning.
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
        Number of the message of each state, from 0.
    turned : shape (N,)
        Whether the published quaternion has the opposite sign of the kernel's quaternion.
    position : shape (N, 3), m; speed : shape (N,), m/s; turning : shape (N,), rad/s
        Position and speeds of the tool in the base frame; speeds are NaN if unknown.
    measures : by name, shape (N,)
        Measures of `Singularity`: the watched measure, and the measures in the charts of the page.
    distance, nearest_singular : shape (N,), rad; shape (N, n), rad or m
        Results of `Singularity`. They are stored, because the search for the nearest singular pose
        depends on the states before.
    factors : shape (N, F), rad
        Distance to the zero of each of the F named factors of the robot file.
    levels : shape (N,)
        OK, WARN or ERROR, with hysteresis.
    silent : shape (N,)
        Whether the joint positions were stale just before the state.
    warnings
        The warnings that the node would have published.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot.dof)
        self.messages, self.position = Column(np.int64), StateTable(3)
        self.turned = Column(np.bool_)
        self.speed, self.turning = Column(np.float64), Column(np.float64)
        kept = [one.name for one in MEASURES.values() if one.on_page]
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
    A batch of states with all results that the node would publish.

    `first` is the number of the first state in the batch; `warnings` are about states of the
    batch.
    """

    first: int
    known: KnownJoints
    state: ToolState
    quaternion_xyzw: Floats
    singularity: Singularities
    warnings: list[PublishedWarning]
