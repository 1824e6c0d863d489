# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a motion to draw over time: a recording, or a built-in trajectory."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....app_modules import app_module
from ....errors import PlotError
from ....kernel import Floats, Integers
from ....robot.closed_poses import closes_at
from ....robot.robot import Robot
from ...recordings.readers.recording import read_recording

# Number of samples of one period of a built-in trajectory.
SAMPLES = 2001
# A pause between two rows of a recording is a gap if it is longer than both of these limits.
MIN_GAP = 1.0  # s
MIN_GAP_STEPS = 5.0  # in units of the median time between two rows


@dataclass(frozen=True, eq=False)
class PlottedMotion:
    """
    Joint positions and velocities over time.

    Attributes
    ----------
    times : shape (N,), s
        Times since the first row, strictly increasing.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
    name
        The source of the motion, as text.
    differentiated
        Whether qdot was computed from q because the recording has no velocities.
    open_rows : shape (k,)
        For each of k recording rows that were left out, because a loop does not close at them: the
        index of the next kept row.
    """

    times: Floats
    q: Floats
    qdot: Floats
    name: str
    differentiated: bool
    open_rows: Integers

    @property
    def gaps(self) -> Integers:
        """
        Return the indices of the first rows after a pause or a row that was left out; curves are
        interrupted before these rows.
        """
        opened = self.open_rows[(self.open_rows > 0) & (self.open_rows < len(self.times))]
        return np.union1d(_gaps(self.times), opened)

    @property
    def described(self) -> str:
        """
        Return the name of the motion. If loops do not close at some of the joint positions, the
        text also states the number of these positions.
        """
        if not len(self.open_rows):
            return self.name
        count = len(self.open_rows)
        return (
            f'{self.name}; loops do not close at {count} of its '
            f'{count + len(self.times)} positions'
        )

    def broken(self, values: Floats) -> tuple[Floats, Floats]:
        """Return `times` and values (N, ...) with a row of nan added in every gap."""
        at = self.gaps
        middles = (self.times[at - 1] + self.times[at]) / 2.0
        return np.insert(self.times, at, middles), np.insert(values, at, np.nan, axis=0)


def motion_of(robot: Robot, path: str) -> PlottedMotion:
    """
    Return the motion in the CSV file `path`, or one period of the built-in trajectory that is
    named `path`.

    Raises
    ------
    RecordingError
        The file is not a recording of this arm.
    PlotError
        `path` is neither a file nor the name of a trajectory; or fewer than two rows can be drawn.
    """
    demo = app_module('motions')
    built_in = {} if demo is None else demo.TRAJECTORIES
    if path in built_in:
        trajectory = built_in[path](robot)
        times = np.linspace(0.0, trajectory.period, SAMPLES)
        q, qdot = trajectory.at(times)
        return _closed(robot, times, q, qdot, f'trajectory {path}', False)
    file = Path(path)
    if not file.exists():
        names = f'or one of: {", ".join(built_in)}'
        if not built_in:
            names = '(the app demo, which has the built-in motions, was removed)'
        raise PlotError(
            f'--path: there is no file {path}; give a CSV file '
            f'(stamp,position.<joint>,...) {names}',
            code='missing-file',
        )
    recording = read_recording(file, robot)
    times = recording.due
    # Drop a row whose stamp repeats or precedes the stamp of the row before it.
    first = np.append(True, np.diff(times) > 0.0)
    times, q = times[first], recording.positions[first]
    if len(times) < 2:
        message = f'{path}: all rows have the same time; give a recording with rising stamps'
        raise PlotError(message, code='wrong-order')
    q[:, robot.continuous] = np.unwrap(q[:, robot.continuous], axis=0)
    if recording.velocities is not None:
        return _closed(robot, times, q, recording.velocities[first], file.name, False)
    return _differentiated(robot, times, q, file.name)


def _closed(
    robot: Robot, times: Floats, q: Floats, qdot: Floats, name: str, differentiated: bool
) -> PlottedMotion:
    # Leave out the rows at which a loop does not close.
    closed = closes_at(robot.chain, q)
    if np.sum(closed) < 2:
        raise PlotError(
            f'{name}: the loops of {robot.name} close at {np.sum(closed)} of its {len(q)} joint '
            'positions; give a recording with at least two of them',
            code='open-loop',
        )
    open_rows = np.cumsum(closed, dtype=np.int64)[~closed]
    return PlottedMotion(times[closed], q[closed], qdot[closed], name, differentiated, open_rows)


def _gaps(times: Floats) -> Integers:
    steps = np.diff(times)
    longest = max(MIN_GAP, MIN_GAP_STEPS * float(np.median(steps)))
    return np.asarray(np.flatnonzero(steps > longest) + 1, dtype=np.int64)


def _differentiated(robot: Robot, times: Floats, q: Floats, name: str) -> PlottedMotion:
    # Differentiate the joint positions of each part of the recording between gaps. A single row
    # between two gaps has no velocity and is left out. At least one part has two rows, because the
    # median time step is never a gap.
    gaps = _gaps(times)
    parts = [(t, p) for t, p in zip(np.split(times, gaps), np.split(q, gaps)) if len(t) > 1]
    qdot = [np.gradient(positions, t, axis=0) for t, positions in parts]
    kept, positions = (np.concatenate(column) for column in zip(*parts))
    return _closed(robot, kept, positions, np.concatenate(qdot), name, True)
