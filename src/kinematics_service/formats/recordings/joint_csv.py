"""Recorded joint motions, read from a CSV file."""

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TextIO

import numpy as np
import numpy.typing as npt

from ...errors import RecordingError
from ...kernel import Floats
from ...robot.robot import Robot

STAMP = 'stamp'
POSITION, VELOCITY = 'position.', 'velocity.'
# Largest seconds of a header's stamp.
LATEST = Decimal(2**31)
LONGEST_LINE = 2**20
# Most names in an error message.
LISTED = 20
# Only numbers that other programs read, too: `1_0` and digits of other scripts are numbers in
# Python alone.
NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|[-+]?(nan|inf(inity)?)', re.A | re.I)


@dataclass(frozen=True, eq=False)
class Recording:
    """
    Joint states of an arm over time.

    Attributes
    ----------
    stamps : shape (N,), ns
        As in the file: they may stand still or jump back.
    positions : shape (N, n), rad or m
        In the order of the arm's joints.
    velocities : shape (N, n), rad/s or m/s
        None if the file has none.
    """

    stamps: npt.NDArray[np.int64]
    positions: Floats
    velocities: Floats | None

    @property
    def due(self) -> Floats:
        """
        Return when each row is due after the first, shape (N,), s; a step back takes no time.
        """
        steps = np.maximum(np.diff(self.stamps, prepend=self.stamps[:1]), 0)
        return np.cumsum(steps) * 1e-9


def read_recording(file: Path, robot: Robot) -> Recording:
    """
    Return the recording of a CSV file with the header `stamp,position.<joint>,velocity.<joint>`.

    Columns may have any order; each joint needs a position, and all joints or none a velocity;
    stamps are in seconds, all other numbers in rad and m. Empty lines and a byte order mark are
    ignored.

    Raises
    ------
    RecordingError
        The file cannot be read, or is not such a recording of this arm.
    """
    try:
        with file.open(encoding='utf-8-sig', newline='') as text:
            return _CsvReader(file, robot, csv.reader(lines_of(text))).read()
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from None
    except UnicodeDecodeError:
        raise RecordingError(f'{file}: is not UTF-8 text, so not a CSV file') from None
    except csv.Error as error:
        raise RecordingError(f'{file}: is not a CSV file: {error}') from None


class _CsvReader:
    def __init__(self, file: Path, robot: Robot, rows: Iterator[list[str]]) -> None:
        self.file, self.robot, self.rows = file, robot, rows
        self.line = 0

    def read(self) -> Recording:
        header: Sequence[str] | None = None
        stamps: list[int] = []
        numbers: list[list[float]] = []
        for cells in self.rows:
            self.line = self.rows.line_num  # type: ignore[attr-defined]
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = self._header([cell.strip() for cell in cells])
                order = [header.index(name) for name in self._wanted(header)]
                stamp_at = header.index(STAMP)
                continue
            if len(cells) != len(header):
                raise self._fault(f'{len(cells)} cells, but the header has {len(header)} columns')
            stamps.append(self._stamp(cells[stamp_at]))
            numbers.append([self._number(header[k], cells[k]) for k in order])
        if header is None:
            raise RecordingError(f'{self.file}: is empty; {self._accepted()}')
        if not stamps:
            raise RecordingError(f'{self.file}: has a header but no rows')
        n = self.robot.dof
        table = np.array(numbers)
        return Recording(
            np.array(stamps, dtype=np.int64),
            table[:, :n],
            table[:, n:] if table.shape[1] > n else None,
        )

    def _header(self, header: Sequence[str]) -> Sequence[str]:
        known = {STAMP, *self._names(POSITION), *self._names(VELOCITY)}
        for k, name in enumerate(header):
            if name in header[:k]:
                raise self._fault(f'column {_shown(name)} occurs twice')
            if name not in known:
                raise self._fault(f'unknown column {_shown(name)}; {self._accepted()}')
        given = set(header)
        missing = [name for name in (STAMP, *self._names(POSITION)) if name not in given]
        if given.intersection(self._names(VELOCITY)):
            missing += [name for name in self._names(VELOCITY) if name not in given]
        if missing:
            raise self._fault(f'missing column {_listed(missing)}; {self._accepted()}')
        return header

    def _names(self, prefix: str) -> list[str]:
        return [prefix + name for name in self.robot.joint_names]

    def _wanted(self, header: Sequence[str]) -> list[str]:
        velocities = self._names(VELOCITY)
        return self._names(POSITION) + (velocities if velocities[0] in header else [])

    def _accepted(self) -> str:
        return (
            f'accepted, separated by commas: {STAMP} in seconds, {POSITION}<joint> for every '
            f'joint, and {VELOCITY}<joint> for all of them or none; joints of {self.robot.name}: '
            f'{_listed(self.robot.joint_names)}'
        )

    def _stamp(self, text: str) -> int:
        try:
            return nanoseconds_of(text)
        except ValueError:
            raise self._fault(
                f'column {STAMP!r}: {_shown(text)} is not a time in seconds (0 to 2147483648)'
            ) from None

    def _number(self, column: str, text: str) -> float:
        try:
            value = number_of(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self._fault(f'column {column!r}: {_shown(text)} is not a finite number')
        return value

    def _fault(self, sentence: str) -> RecordingError:
        return RecordingError(f'{self.file}:{self.line}: {sentence}')


def lines_of(stream: TextIO) -> Iterator[str]:
    """
    Yield the lines of a table.

    Raises
    ------
    csv.Error
        One is so long that it is none: files without an end of line may be larger than memory.
    """
    while line := stream.readline(LONGEST_LINE + 1):
        if len(line) > LONGEST_LINE:
            raise csv.Error(f'a line has more than {LONGEST_LINE >> 20} MiB')
        yield line


def number_of(text: str) -> float:
    """Return the number in a cell; ValueError if it holds none."""
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(text)
    return float(text)


def nanoseconds_of(text: str) -> int:
    """Return the nanoseconds of a time in seconds, 0 to 2^31; ValueError if it is none."""
    # No double in between: it cannot hold the nanoseconds of a present time.
    text = text.strip()
    whole, _, fraction = text.partition('.')
    digits = whole + fraction
    if digits.isascii() and digits.isdecimal() and 0 < len(whole) < 11 and int(whole) < LATEST:
        return int(whole) * 1_000_000_000 + int((fraction + '000000000')[:9])
    seconds = Decimal(text) if NUMBER.fullmatch(text) else Decimal('nan')
    if not (seconds.is_finite() and 0 <= seconds < LATEST):
        raise ValueError(text)
    return int(seconds.scaleb(9).to_integral_value())


def _shown(text: str) -> str:
    return 'an empty cell' if not text.strip() else ascii(text if len(text) < 40 else text[:37])


def _listed(names: Sequence[str]) -> str:
    more = len(names) - LISTED
    return ', '.join(names[:LISTED]) + (f' and {more} more' if more > 0 else '')
