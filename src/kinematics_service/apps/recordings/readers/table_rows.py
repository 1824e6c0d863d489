# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the rows of a table line by line, and check their numbers and stamps."""

import csv
import math
import re
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from decimal import Decimal
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.measures import Level
from ....typography import plain_signs
from .block import LARGEST_BLOCK, Times
from .source import Remark
from .stamp_format import UNITS, StampFormat, unit_of

MAX_LINE_LENGTH = 2**20
NO_TEXT = 'is not UTF-8 text; save the table as UTF-8'
# Upper bound of stamps, s. It is the range of the stamp in a ROS header.
MAX_STAMP = Decimal(2**31)
# DATE and NUMBER match only dates and numbers that other programs also accept. Python alone would
# read `1_0`, or digits of other scripts, as numbers.
DATE = re.compile(
    r'(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(?:[.,](\d+))?(?: ?(Z|UTC|[-+]\d\d:?\d\d))?', re.A
)
NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|[-+]?(nan|inf(inity)?)', re.A | re.I)


class TableRows(NamedTuple):
    """
    Consecutive rows of a table: stamps (N,), ns, and the numbers (N, k) of the read columns, NaN
    for an empty cell.
    """

    stamps: Times
    numbers: Floats


class TableFile(NamedTuple):
    """
    How to read a table: its names of columns, its delimiter, and how it writes numbers.

    Attributes
    ----------
    file
        Path of the table, for error messages.
    opened
        A function that opens the text of the table. Each call opens the text anew.
    delimiter
        The text between two cells. A space stands for any white space.
    header
        Names of the columns; their numbers from 1 if the table has no names.
    heads
        Number of lines of the file before the first row of numbers.
    decimal_comma, named
        Whether numbers have decimal commas, and whether the columns have names.
    """

    file: Path
    opened: Callable[[], TextIO]
    delimiter: str
    header: list[str]
    heads: int
    decimal_comma: bool = False
    named: bool = True

    def lines(self, stream: TextIO) -> Iterator[str]:
        """
        Yield the lines after the header, including empty lines. Decimal commas are replaced by
        points. If cells are separated by white space, it is replaced by single blanks.
        """
        for line in islice(lines_of(stream), self.heads, None):
            line = line.replace(',', '.') if self.decimal_comma else line
            yield (
                ' '.join(line.split()) if self.delimiter == ' ' else line.rstrip(' \r\n')
            ) + '\n'

    def cells(self, stream: TextIO) -> Iterator[tuple[int, list[str]]]:
        """Yield line number (from 1) and cells of each row that is not empty."""
        rows = csv.reader(self.lines(stream), delimiter=self.delimiter)
        for cells in rows:
            if any(map(str.strip, cells)):
                yield self.heads + rows.line_num, cells


class RowReader:
    """
    Reads the rows of a table.

    Parameters
    ----------
    stamp, columns
        Name of the stamp column, empty if stamps are computed from row numbers; names of the other
        columns to read.
    stamps
        The unit of the stamps; or, if there are none, the rate of the rows.
    hint
        Advice for the error message about an invalid stamp.
    whole
        Whether each row must be complete and finite. Otherwise empty cells and an incomplete last
        line are accepted.

    Attributes
    ----------
    remarks
        Remarks on the file, complete after all rows were read.
    """

    def __init__(
        self,
        table: TableFile,
        stamp: str,
        columns: Sequence[str],
        stamps: StampFormat,
        whole: bool = False,
        hint: str = '',
    ) -> None:
        self.remarks: list[Remark] = []
        self._table, self._file, self._header = table, table.file, table.header
        self._whole, self._stamps, self._hint = whole, stamps, hint
        self._stamp_at = [table.header.index(stamp)] if stamp else []
        self._at = [table.header.index(column) for column in columns]
        self._digits = UNITS.get(stamps.unit)

    def pieces(self) -> Iterator[TableRows]:
        """
        Yield the rows in their order, in pieces of at most `LARGEST_BLOCK`.

        Raises
        ------
        RecordingError
            A line is not a valid row; the message names line and column.
        """
        stamps: list[int] = []
        numbers: list[list[float]] = []
        count = 0
        try:
            for line, cells in self._lines():
                count += 1
                stamps += [self._nanoseconds(line, cells[column]) for column in self._stamp_at]
                numbers.append([self._number(line, column, cells[column]) for column in self._at])
                if len(numbers) == LARGEST_BLOCK:
                    yield self._rows(stamps, numbers, count)
                    stamps, numbers = [], []
        except UnicodeDecodeError:
            raise RecordingError(f'{self._file}: {NO_TEXT}', code='encoding') from None
        except csv.Error as error:
            message = f'{self._file}: cannot be read as a table: {error}'
            raise RecordingError(message, code='syntax') from None
        if not count:
            message = f'{self._file}: has a header but no rows; add rows of numbers'
            raise RecordingError(message, code='empty')
        if numbers:
            yield self._rows(stamps, numbers, count)

    def _rows(self, stamps: list[int], numbers: list[list[float]], end: int) -> TableRows:
        if self._stamp_at:
            return TableRows(np.array(stamps, dtype=np.int64), np.array(numbers))
        return TableRows(self._stamps.of_rows(end - len(numbers), len(numbers)), np.array(numbers))

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        # Yields line number and cells of each row. If the last row is incomplete, skips it and
        # adds a remark, unless rows must be complete (`whole`).
        with self._table.opened() as stream:
            filled = self._table.cells(stream)
            count = 0
            for line, cells in filled:
                count += 1
                if len(cells) >= len(self._header) and not any(cells[len(self._header) :]):
                    yield line, cells
                    continue
                if count > 1 and not self._whole and next(filled, None) is None:
                    text = f'line {line}, the last one, is cut off and left out'
                    self.remarks.append(Remark(Level.OK, text, 'cut-off'))
                    return
                raise RecordingError(
                    f'{self._file}:{line}: {len(cells)} cells, but the header has '
                    f'{len(self._header)} columns',
                    code='wrong-length',
                )

    def _digits_of(self, stamp: str) -> int:
        # Guesses the unit of the stamps from the size of the first stamp, and returns the number
        # of decimal places from this unit to nanoseconds. A stamp that is not a number counts as
        # seconds here; `_nanoseconds` refuses it.
        unit = unit_of(number_of(stamp)) if NUMBER.fullmatch(stamp.strip()) else 's'
        if unit != 's':
            name = self._header[self._stamp_at[0]]
            text = f'column {name!r} is taken in {unit}, as the size of its stamps tells'
            self.remarks.append(Remark(Level.OK, text))
        return UNITS[unit]

    def _nanoseconds(self, line: int, cell: str) -> int:
        if self._digits is None:
            self._digits = self._digits_of(cell)
        try:
            return nanoseconds_of(cell, self._digits)
        except ValueError:
            what = {9: 'seconds', 6: 'ms', 3: 'us', 0: 'ns'}[self._digits]
            raise RecordingError(
                f'{self._file}:{line}: column {self._header[self._stamp_at[0]]!r}: '
                f'{cell[:40]!a} is not a time in {what} '
                f'(0 to {MAX_STAMP.scaleb(9 - self._digits):f})'
                f'{", nor a date such as 2024-09-24T14:05:15.1Z" if ":" in cell else ""}'
                f'{self._hint}',
                code='not-a-time',
            ) from None

    def _number(self, line: int, column: int, cell: str) -> float:
        text = cell.strip()
        try:
            value = number_of(text) if text else math.nan
        except ValueError:
            value = None
        if value is None or (self._whole and not math.isfinite(value)):
            raise RecordingError(
                f'{self._file}:{line}: column {self._header[column]!r}: '
                f'{ascii(text[:40]) if text else "an empty cell"} is not a '
                f'{"finite " if self._whole else ""}number',
                code='not-a-number' if value is None or not text else 'not-finite',
            )
        return value


def lines_of(stream: TextIO) -> Iterator[str]:
    """
    Yield the lines of a table.

    Raises
    ------
    csv.Error
        A line is too long. The limit protects the memory from a file without line ends.
    """
    while line := stream.readline(MAX_LINE_LENGTH + 1):
        if len(line) > MAX_LINE_LENGTH:
            raise csv.Error(f'a line has more than {MAX_LINE_LENGTH >> 20} MiB')
        yield line


def number_of(text: str) -> float:
    """Return the number in a cell. Raise ValueError if the cell holds no number."""
    plain = text.strip()
    if not plain.isascii() or '_' in plain:  # such as a typographic minus, or 1_0
        plain = plain_signs(plain)
        if not NUMBER.fullmatch(plain):
            raise ValueError(text)
    return float(plain)


def nanoseconds_of(text: str, digits: int = 9) -> int:
    """
    Return the nanoseconds of a time, 0 to 2^31 s, or of a date. Raise ValueError for other text.

    A date without a time zone is taken in UTC.

    Parameters
    ----------
    digits
        Decimal places from the unit of the time to nanoseconds: 9 for seconds, 0 for ns.
    """
    text, latest = text.strip(), MAX_STAMP.scaleb(9 - digits)
    if found := DATE.fullmatch(text):
        zone = (found[4] or 'Z').replace(':', '').replace('UTC', 'Z').replace('Z', '+0000')
        date = datetime.strptime(f'{found[1]} {found[2]}{zone}', '%Y-%m-%d %H:%M:%S%z')
        text, digits, latest = f'{int(date.timestamp())}.{found[3] or 0}', 9, MAX_STAMP
    time = Decimal(text) if NUMBER.fullmatch(text) else Decimal('nan')
    if not (time.is_finite() and 0 <= time < latest):
        raise ValueError(text)
    # Shift the decimal point of a Decimal, because a float has too few digits for the nanoseconds
    # since 1970.
    return int(time.scaleb(digits))
