# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the points of a robot file: named frames that move with a row of the table."""

import re
from collections.abc import Sequence

from ..text.entries import checked, checked_mapping
from ..text.fault_report import Place, quoted
from ..text.yaml_document import Yaml
from .description import Placement, PointDescription
from .motions import pose_motion
from .quantities import Quantities
from .schema import PointEntry

MAX_POINTS = 64
# Matches the names of points. A name must be valid in a ROS topic, such as `~/elbow/pose`.
POINT_NAME = re.compile(r'[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*')
MAX_NAME_LENGTH = 60
RESERVED_NAMES = {
    'base': 'the base frame',
    'tool': "the tool, whose place is the key 'tool'",
}


def read_points(
    data: Yaml, rows: int, placements: Sequence[Placement | None], quantities: Quantities
) -> tuple[PointDescription, ...]:
    """
    Read the points in the order of the file; report faults, and leave out points with faults.

    Parameters
    ----------
    data
        The value of the key `points`; None if the file does not have the key.
    rows
        Number of rows of the table.
    placements
        Base and tool; a point may not have the name of the base frame or the tool frame.
    quantities
        The meaning of the names in expressions.
    """
    at = quantities.top['points']
    given = checked_mapping(data, at, 'names to {row, xyz, rpy}')
    if len(given) > MAX_POINTS:
        at.fault(f'{len(given)} points (at most {MAX_POINTS})', 'too-many')
        return ()
    frames = {place.frame: key for place, key in zip(placements, ('base', 'tool')) if place}
    points = [_point(name, value, rows, frames, quantities) for name, value in given.items()]
    return tuple(point for point in points if point is not None)


def _check_name(name: str, frames: dict[str, str], at: Place) -> None:
    if name in RESERVED_NAMES:
        message = f'{quoted(name)} is reserved for {RESERVED_NAMES[name]}; write another name'
        at.fault(message, 'reserved-name')
    elif name in frames:
        message = f'{quoted(name)} is the frame of the {frames[name]}; write another name'
        at.fault(message, 'duplicate-name')
    elif len(name) > MAX_NAME_LENGTH or not POINT_NAME.fullmatch(name):
        at.fault(
            f'{quoted(name)} cannot be part of a topic; write a letter, then letters, digits and '
            f'single underscores, at most {MAX_NAME_LENGTH} characters',
            'wrong-name',
        )


def check_row(row: int | None, rows: int, at: Place) -> None:
    """Report a fault if the row number of a point or loop exceeds the number of table rows."""
    if row is not None and row > rows:
        at['row'].fault(
            f'the table has no row {row}; write 0 (the frame before the table) to {rows} (the '
            'frame after its last row)',
            'out-of-range',
        )


def _point(
    name: str, data: Yaml, rows: int, frames: dict[str, str], quantities: Quantities
) -> PointDescription | None:
    at = quantities.top['points', name]
    _check_name(name, frames, at)
    entry = checked(PointEntry, data, at)
    check_row(entry.row, rows, at)
    motion = pose_motion(entry, at, quantities)
    if motion is None or entry.row is None or not at.intact:
        return None
    return PointDescription(name, entry.row, motion)
