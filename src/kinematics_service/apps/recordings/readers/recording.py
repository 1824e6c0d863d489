# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a whole table of joint states, to replay or draw its motion."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.robot import Robot
from ....typography import listed
from .block import ForwardClock
from .source import Selection
from .table_reader import TableReader

# Largest number of joint names in an error message.
LISTED = 20


class Recording(NamedTuple):
    """
    Joint states of an arm over time.

    Attributes
    ----------
    stamps : shape (N,), ns
        Stamp of each row of the file; stamps may repeat or jump back.
    positions : shape (N, n), rad or m
        Joint positions in the order of the arm's joints.
    velocities : shape (N, n), rad/s or m/s
        Joint velocities in the order of the arm's joints; None if the file has none.
    """

    stamps: npt.NDArray[np.int64]
    positions: Floats
    velocities: Floats | None

    @property
    def due(self) -> Floats:
        """
        Return when each row must be replayed: the time since the first row, shape (N,), s. At a
        stamp that steps back, no time passes.
        """
        return np.asarray((ForwardClock().times(self.stamps) - self.stamps[0]) * 1e-9)


def read_recording(file: Path, robot: Robot) -> Recording:
    """
    Read a table of joint states of any known layout, and return the recording.

    Each joint needs a position; either all joints have a velocity, or none. Stamps are in seconds,
    other numbers in rad and m. Other columns, empty lines and a byte order mark are ignored.

    Raises
    ------
    RecordingError
        The file cannot be read, or columns of the arm are missing.
    """
    accepted = (
        'accepted, separated by commas, semicolons, tabs or spaces: stamp in seconds, '
        'position.<joint> for every joint, and velocity.<joint> for all of them or none; or the '
        f"columns of UR's RTDE recorder; joints of {robot.name}: "
        f'{listed(robot.joint_names, LISTED)}'
    )
    reader = TableReader(file, Selection(robot), accepted, whole=True)
    columns = reader.columns
    beginning = columns.names.velocity
    given = [name for name in robot.joint_names if beginning + name in reader.header]
    if given and not columns.velocities:
        missing = next(name for name in robot.joint_names if name not in given)
        message = f'{file}: there is no column {beginning + missing!r}; {accepted}'
        raise RecordingError(message, code='missing-column')
    names = [*columns.positions, *columns.velocities]
    pieces = list(reader.pieces(names))
    stamps, numbers = (np.concatenate(columns) for columns in zip(*pieces))
    n, units = robot.dof, columns.joints.units(robot)
    velocities = units.scale * numbers[:, n:] if columns.velocities else None
    return Recording(stamps, units.positions(numbers[:, :n]), velocities)
