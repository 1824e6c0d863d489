"""The states of an arm at every message of a recording, in columns."""

from typing import NamedTuple

import numpy as np

from ...estimation.status_text import StatusText
from ...formats.recordings.block import Flags, Times
from ...formats.recordings.columns import Column, StateTable
from ...kernel import Floats
from ...kinematics.singularity import Singularity
from ...kinematics.tool_state import ToolState
from ...robot.measures import MEASURES
from ...robot.robot import Robot
from .ingest import KnownJoints
from .judging import Levels


class PublishedWarning(NamedTuple):
    """
    A warning as the node would have published it; `row` is the state it belongs to or precedes.
    """

    row: int
    moment: int
    status_text: StatusText


class Timeline:
    """
    Every state of a recording; N of them, in columns that are read in pieces.

    Other values (Jacobian, quaternion, twist, other measures) are computed again from `q` and
    `qdot` for the rows that need them.

    Attributes
    ----------
    messages : shape (N,)
        Number of the message that made it, from 0.
    stamps : shape (N,), ns
        Of the state.
    t : shape (N,), s
        Time since the first state by the stamps; a step back takes no time.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Rows of `qdot` are NaN if unknown.
    differenced : shape (N,)
        Whether the velocities are differences of positions.
    turned : shape (N,)
        Whether the tool's quaternion is published with the opposite sign of the kernel's.
    position : shape (N, 3), m; speed : shape (N,), m/s; turning : shape (N,), rad/s
        Of the tool in the base frame; speeds are NaN if unknown.
    measures : by name, shape (N,)
        As in `Singularity`: the watched one, and those the page shows besides.
    distance, nearest_singular, decided : shape (N,), rad; shape (N, n), rad or m; shape (N,)
        As in `Singularity`: what is found depends on the states before.
    factors : shape (N, F), rad
        Distance to the zero of each named factor; F is 0 if the file lists none.
    levels : shape (N,)
        OK, WARN or ERROR, with hysteresis.
    silent : shape (N,)
        Whether the state was stale just before.
    warnings
        The warnings that the node would have published.
    """

    def __init__(self, robot: Robot) -> None:
        self.messages, self.stamps = Column(np.int64), Column(np.int64)
        self.t = Column(np.float64)
        self.q, self.qdot = StateTable(robot.dof), StateTable(robot.dof)
        self.differenced, self.turned = Column(bool), Column(bool)
        self.position, self.speed, self.turning = (
            StateTable(3),
            Column(np.float64),
            Column(np.float64),
        )
        kept = [one.name for one in MEASURES.values() if one.on_page]
        self.measures = {name: Column(np.float64) for name in (robot.thresholds.measure, *kept)}
        self.distance, self.nearest_singular = Column(np.float64), StateTable(robot.dof)
        self.decided = Column(bool)
        self.factors = StateTable(len(robot.factors.names))
        self.levels, self.silent = Column(np.int8), Column(bool)
        self.warnings: list[PublishedWarning] = []
        self._clock: tuple[int, int] | None = None

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def end(self) -> float:
        """Return the time of the last state, s."""
        return float(self.t[-1])

    def append(
        self,
        known: KnownJoints,
        state: ToolState,
        singularity: Singularity,
        levels: Levels,
        turned: Flags,
    ) -> None:
        """Add the next batch of states."""
        moving = ~np.any(np.isnan(known.qdot), axis=1)
        twist = np.where(moving[:, None], state.twist, np.nan)
        silent = np.zeros(len(known), dtype=bool)
        silent[list(known.timeouts)] = True
        self.messages.append(known.messages)
        self.t.append(self._times(known.stamps))
        self.stamps.append(known.stamps)
        self.q.append(known.q)
        self.qdot.append(known.qdot)
        self.differenced.append(known.differenced)
        self.turned.append(turned)
        self.position.append(state.position)
        self.speed.append(np.linalg.norm(twist[:, :3], axis=1))
        self.turning.append(np.linalg.norm(twist[:, 3:], axis=1))
        for name, column in self.measures.items():
            column.append(getattr(singularity, name))
        self.distance.append(singularity.distance)
        self.nearest_singular.append(singularity.nearest_singular)
        self.decided.append(singularity.decided)
        factors = singularity.factors
        none = np.zeros((len(known), 0))
        self.factors.append(none if factors is None else factors.estimates)
        self.levels.append(levels)
        self.silent.append(silent)

    def _times(self, stamps: Times) -> Floats:
        last, passed = self._clock or (int(stamps[0]), 0)
        steps = np.maximum(np.diff(stamps, prepend=last), 0)
        total = passed + np.cumsum(steps)
        self._clock = int(stamps[-1]), int(total[-1])
        times: Floats = total * 1e-9
        return times


class TimelineBatch(NamedTuple):
    """
    A batch of states with everything the node would publish of them.

    `first` is the number of its first state, and `warnings` are those at its states.
    """

    first: int
    known: KnownJoints
    state: ToolState
    quaternion_xyzw: Floats
    singularity: Singularity
    warnings: list[PublishedWarning]
