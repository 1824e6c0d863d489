"""Joint states in a table: a CSV file with a header, of any of the known layouts."""

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from ...errors import RecordingError
from .block import Block
from .pose_format import ACCEPTED_POSES, PoseFormat, pose_columns
from .source import MOST_POSES, PoseTrack, RecordingSource, Selection
from .table_rows import NO_TEXT, RowReader, TableFile, delimiter_of, lines_of
from .tool_poses import PoseRows

# Most columns in an error message, and most letters of each.
SHOWN, LONGEST_NAME = 12, 60
# Bytes read at once to count lines.
AT_ONCE = 2**20
HOW = '--columns stamp=...,position=...,velocity=...,pose=... says how column names begin'


class ColumnNames(NamedTuple):
    """The beginnings of the column names of a layout; the stamp's whole name."""

    stamp: str
    position: str
    velocity: str
    pose: str


STAMP = 'stamp'
LAYOUTS = (
    ColumnNames(STAMP, 'position.', 'velocity.', 'pose.'),
    # The columns that the recorder of Universal Robots' RTDE client writes.
    ColumnNames('timestamp', 'actual_q_', 'actual_qd_', 'actual_TCP_pose_'),
)


def open_table(file: Path, wanted: Selection) -> RecordingSource:
    """
    Open a table.

    Raises
    ------
    RecordingError
        It cannot be read, or columns are missing; the message names line and column.
    """
    return TableReader(file, wanted, HOW).source()


class TableReader:
    """
    The columns of an arm in a table, and its rows.

    Parameters
    ----------
    accepted
        What is accepted, for the message on a missing column.

    Attributes
    ----------
    header
        The names of all columns.
    names
        The beginnings of those that are wanted.
    positions, velocities
        Names of the columns of the joints; no velocities unless all joints have one.

    Raises
    ------
    RecordingError
        The table cannot be read, or columns are missing.
    """

    def __init__(self, file: Path, wanted: Selection, accepted: str) -> None:
        self.file, self.wanted, self._accepted = file, wanted, accepted
        self.joints = [wanted.joint_prefix + name for name in wanted.robot.joint_names]
        self._table = _opened(file, accepted)
        self.header = self._table.header
        name, times = Counter(self.header).most_common(1)[0]
        if times > 1:
            raise RecordingError(f'{file}: column {_cut(name)} occurs twice')
        self.names = self._layout()
        self.positions, self.velocities = map(
            self._family, (self.names.position, self.names.velocity)
        )

    def rows(self, columns: list[str], whole: bool = False) -> RowReader:
        """Return the reader of some columns of numbers; `whole` as there."""
        return RowReader(self._table, self.names.stamp, columns, whole)

    def source(self) -> RecordingSource:
        """Return the table as a recording, with poses of the tool if it has such columns."""
        positions, velocities = self.positions, self.velocities
        found = self._pose_columns()
        columns, form = found or ([], PoseFormat())
        reader = self.rows([*positions, *velocities, *columns])
        n, m = len(positions), len(positions) + len(velocities)
        poses = PoseRows(form, len(columns), n)

        def blocks() -> Iterator[Block]:
            before: tuple[int, int] | None = None
            for stamps, numbers in reader.pieces():
                if found:
                    # Poses and joints of a row belong together, however far apart the rows are.
                    # A row without any number of a pose has none; one that lacks some is refused.
                    rows = numbers[:, m:]
                    known = np.any(np.isfinite(rows), axis=1)
                    poses.take(stamps[known], rows[known], numbers[known, :n])
                # The time of receipt is that of the measurement; if the stamps step back, time
                # goes on.
                last, passed = before or (int(stamps[0]), int(stamps[0]))
                steps = np.maximum(np.diff(stamps, prepend=last), 0)
                received = passed + np.cumsum(steps)
                before = int(stamps[-1]), int(received[-1])
                yield Block(tuple(self.joints), stamps, received, numbers[:, :n], numbers[:, n:m])

        def track() -> PoseTrack | None:
            return poses.track(f'{self.names.pose}*', '', MOST_POSES) if poses.count else None

        topic, total = f'{self.names.position}*', _count_lines(self.file) - 1
        return RecordingSource('table', topic, False, total, blocks(), track, reader.remarks)

    def _layout(self) -> ColumnNames:
        if self.wanted.columns is not None:
            given = self._given(self.wanted.columns)
            names = LAYOUTS[0]._replace(**given)
            self._positions(names, required=True)
            return names
        for names in LAYOUTS:
            if names.stamp in self.header and self._positions(names, required=False):
                return names
        names = LAYOUTS[0]
        self._positions(names, required=True)
        raise RecordingError(
            f'{self.file}: there is no column {names.stamp!r} (seconds); the header has '
            f'{self._shown()}; '
            f'{self._accepted}'
        )

    def _given(self, text: str) -> dict[str, str]:
        given = {}
        for item in text.split(','):
            key, equals, value = (part.strip() for part in item.partition('='))
            if not equals or key not in ColumnNames._fields:
                raise RecordingError(
                    f'--columns: {item!r} is not accepted; write for instance '
                    'stamp=time,position=q_,velocity=qd_,pose=tcp_'
                )
            given[key] = value.rstrip('*')
        if given.get('stamp', STAMP) not in self.header:
            raise RecordingError(
                f'{self.file}: there is no column {given.get("stamp", STAMP)!r}; '
                f'the header has {self._shown()}'
            )
        return given

    def _positions(self, names: ColumnNames, required: bool) -> list[str]:
        found = self._family(names.position)
        if not found and required:
            missing = [j for j in self.joints if names.position + j not in self.header]
            raise RecordingError(
                f'{self.file}: there is no column {names.position + missing[0]!r} for joint '
                f'{missing[0]!r} of {self.wanted.robot.name}; the header has {self._shown()}; '
                f'{self._accepted}'
            )
        return found

    def _family(self, prefix: str) -> list[str]:
        # Returns the columns of the joints, by name or by number from 0 or from 1; none if one is
        # missing.
        n = len(self.joints)
        bare = self.wanted.robot.joint_names
        for ends in (self.joints, bare, range(n), range(1, n + 1)):
            columns = [f'{prefix}{end}' for end in ends]
            if all(column in self.header for column in columns):
                # Numbers from 1 are also numbers from 0 with one left over.
                return columns
        return []

    def _pose_columns(self) -> tuple[list[str], PoseFormat] | None:
        found = pose_columns(self.header, self.names.pose, self.wanted.pose_format)
        asked = self.wanted.columns is not None and 'pose=' in self.wanted.columns
        if found is None and (asked or self.wanted.pose_format != PoseFormat()):
            raise RecordingError(f'{self.file}: {self.names.pose}* are no pose: {ACCEPTED_POSES}')
        return found

    def _shown(self) -> str:
        return listed([_cut(name) for name in self.header], SHOWN)


def listed(names: Sequence[str], most: int) -> str:
    """Return names one after another, at most so many, and how many there are more."""
    more = len(names) - most
    return ', '.join(names[:most]) + (f' and {more} more' if more > 0 else '')


def _opened(file: Path, accepted: str) -> TableFile:
    try:
        opened: Callable[[], TextIO] = partial(file.open, encoding='utf-8-sig', newline='')
        with opened() as stream:
            if not file.is_file():
                # What a pipe gives is there once.
                opened = partial(io.StringIO, ''.join(lines_of(stream)))
        with opened() as stream:
            first = next((line for line in lines_of(stream) if line.strip()), '')
        delimiter = delimiter_of([first])
        cells = next(csv.reader([first], delimiter=delimiter))
    except UnicodeDecodeError:
        raise RecordingError(f'{file}: {NO_TEXT}') from None
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from None
    except csv.Error as error:
        raise RecordingError(f'{file}: cannot be read as a table: {error}') from None
    if not first:
        raise RecordingError(f'{file}: is empty; {accepted}')
    return TableFile(file, opened, delimiter, [cell.strip() for cell in cells])


def _cut(name: str) -> str:
    return ascii(name if len(name) <= LONGEST_NAME else f'{name[:LONGEST_NAME]}...')


def _count_lines(file: Path) -> int:
    with file.open('rb') as stream:
        return sum(data.count(b'\n') for data in iter(lambda: stream.read(AT_ONCE), b''))
