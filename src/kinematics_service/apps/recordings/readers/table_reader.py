# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read joint states from a table, which is a CSV file with a known layout of columns."""

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ....errors import RecordingError
from ....robot.measures import Level
from .arm_columns import HOW, arm_columns
from .block import LARGEST_BLOCK
from .source import RecordingSource, Remark, Selection
from .stamp_format import UNITS, unit_of
from .table_rows import MAX_STAMP, NO_TEXT, NUMBER, TableRows, nanoseconds_of, number_of, table_of
from .table_source import source_of

# Number of bytes that are read at once to count lines.
READ_SIZE = 2**20
HINT = '; --stamps says the unit, or the rate of the rows, or none if the arm stands in each'


class TableReader:
    """
    Finds the columns of an arm in a table, and reads the table's rows.

    Parameters
    ----------
    accepted
        Text that describes the accepted columns, for the error about a missing column.
    whole
        Whether each row must be complete and finite. Otherwise empty cells and an incomplete last
        line are accepted.

    Attributes
    ----------
    header
        The names of all columns.
    columns
        The columns of the arm.
    remarks
        Remarks on the file, complete after all rows were read.

    Raises
    ------
    RecordingError
        The table cannot be read, or columns are missing.
    """

    def __init__(
        self, file: Path, selection: Selection, accepted: str = HOW, whole: bool = False
    ) -> None:
        self.file, self.selection, self.remarks = file, selection, list[Remark]()
        self._whole, self._hint = whole, HINT if accepted is HOW else ''
        self._table = table_of(file, accepted)
        self.header = self._table.header
        numbered = selection.columns is None or not any(map(str.isdigit, selection.columns))
        if not self._table.named and numbered:
            raise RecordingError(
                f'{file}: the first line has numbers, not the names of columns; give the columns '
                'by number from 1 on, for instance --columns stamp=1,position=2-7,pose=8-13',
                code='missing-header',
            )
        self.columns = arm_columns(file, self.header, selection, accepted)
        self._digits = UNITS.get(self.columns.stamps.unit)

    def source(self) -> RecordingSource:
        """Return the table as a recording, with measured tool poses if the table has them."""
        columns = self.columns
        if self._table.decimal_comma:
            self.remarks.append(Remark(Level.OK, 'commas in numbers are taken as points'))
        total = _count_lines(self.file) - self._table.heads
        pieces = self.pieces([*columns.positions, *columns.velocities, *columns.poses])
        return source_of(columns, self.selection, 'table', total, pieces, self.remarks)

    def pieces(self, columns: Sequence[str]) -> Iterator[TableRows]:
        """
        Yield the rows of the table in file order, in blocks of at most `LARGEST_BLOCK` rows. Each
        block has the stamps of its rows, and their numbers in the given columns.

        Raises
        ------
        RecordingError
            A line is not a valid row; the message names line and column.
        """
        stamp = self.columns.stamp
        stamp_at = [self.header.index(stamp)] if stamp else []
        at = [self.header.index(column) for column in columns]
        stamps: list[int] = []
        numbers: list[list[float]] = []
        count = 0
        try:
            for line, cells in self._lines():
                count += 1
                stamps += [self._nanoseconds(line, cells[column]) for column in stamp_at]
                numbers.append([self._number(line, column, cells[column]) for column in at])
                if len(numbers) == LARGEST_BLOCK:
                    yield self._rows(stamps, numbers, count)
                    stamps, numbers = [], []
        except UnicodeDecodeError:
            raise RecordingError(f'{self.file}: {NO_TEXT}', code='encoding') from None
        except csv.Error as error:
            message = f'{self.file}: cannot be read as a table: {error}'
            raise RecordingError(message, code='syntax') from None
        if not count:
            message = f'{self.file}: has a header but no rows; add rows of numbers'
            raise RecordingError(message, code='empty')
        if numbers:
            yield self._rows(stamps, numbers, count)

    def _rows(self, stamps: list[int], numbers: list[list[float]], end: int) -> TableRows:
        times = np.array(stamps, dtype=np.int64)
        if not self.columns.stamp:
            times = self.columns.stamps.of_rows(end - len(numbers), len(numbers))
        return TableRows(times, np.array(numbers))

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        # Yields line number and cells of each row. An incomplete row is an error. But if rows need
        # not be whole, and the last row is incomplete, skips this row and adds a remark.
        with self._table.opened() as stream:
            filled = self._table.cells(stream)
            count = 0
            for line, cells in filled:
                count += 1
                if len(cells) >= len(self.header) and not any(cells[len(self.header) :]):
                    yield line, cells
                    continue
                if count > 1 and not self._whole and next(filled, None) is None:
                    text = f'line {line}, the last one, is cut off and left out'
                    self.remarks.append(Remark(Level.OK, text, 'cut-off'))
                    return
                raise RecordingError(
                    f'{self.file}:{line}: {len(cells)} cells, but the header has '
                    f'{len(self.header)} columns',
                    code='wrong-length',
                )

    def _digits_of(self, stamp: str) -> int:
        # Returns the exponent n of the stamps' unit, 10^n ns: 9 for seconds. The unit follows from
        # the size of the first stamp. If `stamp` is not a number, the unit is taken as seconds
        # here, and `_nanoseconds` refuses the stamp.
        unit = unit_of(number_of(stamp)) if NUMBER.fullmatch(stamp.strip()) else 's'
        if unit != 's':
            name = self.columns.stamp
            text = f'column {name!r} is taken in {unit}, as the size of its stamps tells'
            self.remarks.append(Remark(Level.OK, text))
        return UNITS[unit]

    def _nanoseconds(self, line: int, cell: str) -> int:
        if self._digits is None:
            self._digits = self._digits_of(cell)
        try:
            return nanoseconds_of(cell, self._digits)
        except ValueError:
            unit = {9: 'seconds', 6: 'ms', 3: 'us', 0: 'ns'}[self._digits]
            raise RecordingError(
                f'{self.file}:{line}: column {self.columns.stamp!r}: '
                f'{cell[:40]!a} is not a time in {unit} '
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
                f'{self.file}:{line}: column {self.header[column]!r}: '
                f'{ascii(text[:40]) if text else "an empty cell"} is not a '
                f'{"finite " if self._whole else ""}number',
                code='not-a-number' if value is None or not text else 'not-finite',
            )
        return value


def _count_lines(file: Path) -> int:
    with file.open('rb') as stream:
        return sum(data.count(b'\n') for data in iter(lambda: stream.read(READ_SIZE), b''))
