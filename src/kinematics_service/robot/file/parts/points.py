"""The points of a robot file: frames that move with a row of the table, by their names."""

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
# Part of a ROS topic: `~/elbow/pose`.
POINT_NAME = re.compile(r'[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*')
LONGEST_NAME = 60
TAKEN = {
    'base': 'the base frame',
    'tool': "the tool, which is always a point; its place stands under the key 'tool'",
}


def read_points(
    data: Yaml, rows: int | None, placements: Sequence[Placement | None], quantities: Quantities
) -> tuple[PointDescription, ...]:
    """
    Return the points in the order of the file, without those that have faults.

    Parameters
    ----------
    data
        The mapping as the file has it; None where there is none.
    rows
        Number of rows of the table; None where that is not known.
    placements
        Base and tool, whose frames no point may be called like.
    quantities
        What the names in expressions mean.
    """
    at = quantities.top['points']
    given = checked_mapping(data, at, 'names to {row, xyz, rpy}')
    if len(given) > MAX_POINTS:
        at.fault(f'{len(given)} points (at most {MAX_POINTS})')
        return ()
    frames = {place.frame: key for place, key in zip(placements, ('base', 'tool')) if place}
    points = [_point(name, value, rows, frames, quantities) for name, value in given.items()]
    return tuple(point for point in points if point is not None)


def _why_no_name(name: str, frames: dict[str, str]) -> str:
    if name in TAKEN:
        return f'the name {quoted(name)} is that of {TAKEN[name]}'
    if name in frames:
        return f'the name {quoted(name)} is that of the frame of the {frames[name]}'
    if len(name) > LONGEST_NAME or not POINT_NAME.fullmatch(name):
        return (
            f'the name {quoted(name)} cannot be part of a topic: letters, digits and single '
            f'underscores between them, a letter first, at most {LONGEST_NAME} characters'
        )
    return ''


def check_row(row: int | None, rows: int | None, at: Place) -> None:
    """Report the row of a frame that a table of so many rows has not."""
    if row is not None and rows is not None and row > rows:
        at['row'].fault(
            f'there is no row {row}: 0 is the frame before the table, {rows} the frame after its '
            'last row'
        )


def _point(
    name: str, data: Yaml, rows: int | None, frames: dict[str, str], quantities: Quantities
) -> PointDescription | None:
    at = quantities.top['points', name]
    if reason := _why_no_name(name, frames):
        at.fault(reason)
    entry = checked(PointEntry, data, at)
    check_row(entry.row, rows, at)
    motion = pose_motion(entry, at, quantities)
    if motion is None or entry.row is None or not at.intact:
        return None
    return PointDescription(name, entry.row, motion)
