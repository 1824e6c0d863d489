"""
Joint states in a table: a CSV file with a header, of any of the known layouts.

"""

import csv
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..kernel import Floats
from ..measures import Level
from ..recording import POSITION, STAMP, VELOCITY, nanoseconds_of, number_of
from .block import LARGEST_BLOCK, AuditError, Block, Times
from .pose_format import ACCEPTED_POSES, PoseFormat, pose_columns
from .source import PoseTrack, Remark, Source, Wanted
from .tool_poses import pose_track

SHOWN = 12
HOW = '--columns stamp=...,position=...,velocity=...,pose=... says what columns begin with'


class Names(NamedTuple):
    """
    What the columns of a layout begin with; the stamp's whole name.

    """

    stamp: str
    position: str
    velocity: str
    pose: str


LAYOUTS = (
    Names(STAMP, POSITION, VELOCITY, 'pose.'),
    # What the recorder of Universal Robots' RTDE client writes.
    Names('timestamp', 'actual_q_', 'actual_qd_', 'actual_TCP_pose_'),
)


def open_table(file: Path, wanted: Wanted) -> Source:
    """
    Open a table.

    Raises
    ------
    AuditError
        It cannot be read, or columns are missing; the message names line and column.

    """
    table = _Table(file, wanted)
    return table.source()


class _Table:
    def __init__(self, file: Path, wanted: Wanted) -> None:
        self.file, self.wanted = file, wanted
        robot = wanted.robot
        self.joints = [wanted.joint_prefix + name for name in robot.joint_names]
        try:
            with file.open(encoding='utf-8-sig', newline='') as stream:
                first = stream.readline()
                while first and not first.strip():
                    first = stream.readline()
        except UnicodeDecodeError:
            raise AuditError(f'{file}: is not UTF-8 text, so not a table') from None
        except OSError as error:
            raise AuditError(f'{file}: cannot be read: {error.strerror}') from None
        if not first:
            raise AuditError(f'{file}: is empty')
        self.delimiter = next((c for c in ',;\t' if c in first), ' ')
        self.header = [
            cell.strip() for cell in next(csv.reader([first], delimiter=self.delimiter))
        ]
        if len(set(self.header)) < len(self.header):
            twice = next(name for name in self.header if self.header.count(name) > 1)
            raise AuditError(f'{file}: column {ascii(twice)} is there twice')
        self.names = self._layout()

    def source(self) -> Source:
        stamps, numbers, remarks = self._numbers()
        n, velocities, pose = len(self.joints), self._velocity_columns(), self._pose_columns()
        # Received when it was measured; where the stamps step back, time goes on.
        steps = np.maximum(np.diff(stamps, prepend=stamps[:1]), 0)
        received = stamps[:1] + np.cumsum(steps)
        track: PoseTrack | None = None
        if pose is not None:
            columns, form = pose
            rows = numbers[:, -len(columns) :]
            known = np.all(np.isfinite(rows), axis=1)
            if np.any(known):
                # Poses and joints of a row belong together, however far apart the rows are.
                q, name = numbers[known, :n], f'{self.names.pose}*'
                track = pose_track(name, '', stamps[known], rows[known], form, q)

        def blocks() -> Iterator[Block]:
            for begin in range(0, len(stamps), LARGEST_BLOCK):
                span = slice(begin, begin + LARGEST_BLOCK)
                yield Block(
                    tuple(self.joints),
                    stamps[span],
                    received[span],
                    numbers[span, :n],
                    numbers[span, n : n + len(velocities)],
                )

        topic = f'{self.names.position}*'
        return Source('table', topic, False, len(stamps), blocks(), track, remarks)

    def _layout(self) -> Names:
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
        raise AuditError(
            f'{self.file}: no column {names.stamp!r} (seconds); the header has {self._shown()}; '
            f'{HOW}'
        )

    def _given(self, text: str) -> dict[str, str]:
        given = {}
        for item in text.split(','):
            key, equals, value = (part.strip() for part in item.partition('='))
            if not equals or key not in Names._fields:
                raise AuditError(
                    f'--columns: {item!r} is not accepted; write for instance '
                    'stamp=time,position=q_,velocity=qd_,pose=tcp_'
                )
            given[key] = value.rstrip('*')
        if given.get('stamp', STAMP) not in self.header:
            raise AuditError(
                f'{self.file}: no column {given.get("stamp", STAMP)!r}; '
                f'the header has {self._shown()}'
            )
        return given

    def _positions(self, names: Names, required: bool) -> list[str]:
        found = self._family(names.position)
        if not found and required:
            missing = [j for j in self.joints if names.position + j not in self.header]
            raise AuditError(
                f'{self.file}: no column {names.position + missing[0]!r} for joint '
                f'{missing[0]!r} of {self.wanted.robot.name}; the header has {self._shown()}; '
                f'{HOW}'
            )
        return found

    def _family(self, prefix: str) -> list[str]:
        # Columns of the joints, by name or by number from 0 or from 1; none if one is missing.
        n = len(self.joints)
        bare = self.wanted.robot.joint_names
        for ends in (self.joints, bare, range(n), range(1, n + 1)):
            columns = [f'{prefix}{end}' for end in ends]
            if all(column in self.header for column in columns):
                # Numbers from 1 are also numbers from 0 with one left over.
                return columns
        return []

    def _velocity_columns(self) -> list[str]:
        return self._family(self.names.velocity)

    def _pose_columns(self) -> tuple[list[str], PoseFormat] | None:
        found = pose_columns(self.header, self.names.pose, self.wanted.pose_format)
        asked = self.wanted.columns is not None and 'pose=' in self.wanted.columns
        if found is None and (asked or self.wanted.pose_format != PoseFormat()):
            raise AuditError(f'{self.file}: {self.names.pose}* are no pose: {ACCEPTED_POSES}')
        return found

    def _shown(self) -> str:
        more = len(self.header) - SHOWN
        listed = ', '.join(ascii(name) for name in self.header[:SHOWN])
        return listed + (f' and {more} more' if more > 0 else '')

    def _numbers(self) -> tuple[Times, Floats, list[Remark]]:
        # All wanted columns: positions, velocities, pose.
        columns = self._family(self.names.position) + self._velocity_columns()
        pose = self._pose_columns()
        columns += [] if pose is None else pose[0]
        at = [self.header.index(column) for column in columns]
        stamp_at = self.header.index(self.names.stamp)
        try:
            stamps, numbers = self._quickly(stamp_at, at)
            return stamps, numbers, []
        except ValueError:
            return self._line_by_line(stamp_at, at)

    def _quickly(self, stamp_at: int, at: Sequence[int]) -> tuple[Times, Floats]:
        with self.file.open(encoding='utf-8-sig') as stream, warnings.catch_warnings():
            while not stream.readline().strip():
                pass
            warnings.simplefilter('ignore')  # that there are no rows is said elsewhere
            table = np.loadtxt(
                stream,
                delimiter=None if self.delimiter == ' ' else self.delimiter,
                usecols=[stamp_at, *at],
                converters={stamp_at: _nanoseconds_as_double},
                comments=None,
                ndmin=2,
                quotechar='"',
                encoding='utf-8',
            )
        if not len(table):
            raise ValueError
        return np.ascontiguousarray(table[:, 0]).view(np.int64), table[:, 1:]

    def _line_by_line(
        self, stamp_at: int, at: Sequence[int]
    ) -> tuple[Times, Floats, list[Remark]]:
        # The long way, which knows what to say of a bad line.
        stamps: list[int] = []
        numbers: list[list[float]] = []
        remarks: list[Remark] = []
        with self.file.open(encoding='utf-8-sig', newline='') as stream:
            rows = csv.reader(stream, delimiter=self.delimiter)
            lines = [(rows.line_num, cells) for cells in rows if any(c.strip() for c in cells)]
        for k, (line, cells) in enumerate(lines[1:], start=1):
            if len(cells) != len(self.header):
                if k == len(lines) - 1 and k > 1:
                    text = f'line {line}, the last one, is cut off and left out'
                    remarks.append(Remark(Level.OK, text))
                    continue
                raise AuditError(
                    f'{self.file}:{line}: {len(cells)} cells, but the header has '
                    f'{len(self.header)} columns'
                )
            try:
                stamps.append(nanoseconds_of(cells[stamp_at]))
            except ValueError:
                raise AuditError(
                    f'{self.file}:{line}: column {self.header[stamp_at]!r}: '
                    f'{cells[stamp_at][:40]!a} is not a time in seconds'
                ) from None
            numbers.append([self._number(line, column, cells[column]) for column in at])
        if not stamps:
            raise AuditError(f'{self.file}: has a header but no rows')
        return np.array(stamps, dtype=np.int64), np.array(numbers), remarks

    def _number(self, line: int, column: int, cell: str) -> float:
        text = cell.strip()
        try:
            return number_of(text) if text else float('nan')
        except ValueError:
            raise AuditError(
                f'{self.file}:{line}: column {self.header[column]!r}: {text[:40]!a} is not a '
                'number'
            ) from None


def _nanoseconds_as_double(text: str) -> float:
    # The bits of an integer in the one table of doubles that numpy reads.
    return float(np.int64(nanoseconds_of(text)).view(np.float64))
