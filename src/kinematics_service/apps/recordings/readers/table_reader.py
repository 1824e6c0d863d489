# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read joint states from a table, which is a CSV file with a known layout of columns."""

import csv
import io
import re
from collections.abc import Callable
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TextIO

from ....errors import RecordingError
from ....robot.measures import Level
from ....robot.tables.delimiter import delimiter_of
from .arm_columns import HOW, arm_columns
from .source import RecordingSource, Remark, Selection
from .table_rows import NO_TEXT, RowReader, TableFile, lines_of, number_of
from .table_source import source_of

# Number of bytes that are read at once to count lines.
READ_SIZE = 2**20
# Column names and decimal commas are detected in this number of first lines of a file.
HEAD_LINES = 100
COMMENT = '#'
HINT = '; --stamps says the unit, or the rate of the rows, or none if the arm stands in each'
COMMA = re.compile(r'\d,\d')


def open_table(file: Path, wanted: Selection) -> RecordingSource:
    """
    Open a table of joint states.

    Raises
    ------
    RecordingError
        The table cannot be read, or columns are missing; the message names line and column.
    """
    return TableReader(file, wanted, HOW).source()


class TableReader:
    """
    Finds the columns of an arm in a table, and reads the table's rows.

    Parameters
    ----------
    accepted
        Text that describes the accepted columns, for the error about a missing column.

    Attributes
    ----------
    header
        The names of all columns.
    columns
        The columns of the arm.

    Raises
    ------
    RecordingError
        The table cannot be read, or columns are missing.
    """

    def __init__(self, file: Path, wanted: Selection, accepted: str) -> None:
        self.file, self.wanted = file, wanted
        self._hint = HINT if accepted is HOW else ''
        self._table = table_of(file, accepted)
        self.header = self._table.header
        numbered = wanted.columns is None or not any(map(str.isdigit, wanted.columns))
        if not self._table.named and numbered:
            raise RecordingError(
                f'{file}: the first line has numbers, not the names of columns; give the columns '
                'by number from 1 on, for instance --columns stamp=1,position=2-7,pose=8-13',
                code='missing-header',
            )
        self.columns = arm_columns(file, self.header, wanted, accepted)

    def rows(self, columns: list[str], whole: bool = False) -> RowReader:
        """
        Return a `RowReader` of the given columns. `whole` says whether each row must be complete
        and finite.
        """
        return RowReader(
            self._table, self.columns.stamp, columns, self.columns.stamps, whole, self._hint
        )

    def source(self) -> RecordingSource:
        """Return the table as a recording, with measured tool poses if the table has them."""
        own = self.columns
        reader = self.rows([*own.positions, *own.velocities, *own.poses])
        if self._table.decimal_comma:
            reader.remarks.append(Remark(Level.OK, 'commas in numbers are taken as points'))
        total = _count_lines(self.file) - self._table.heads
        return source_of(own, self.wanted, 'table', total, reader.pieces(), reader.remarks)


def table_of(file: Path, accepted: str = HOW) -> TableFile:
    """
    Open a table, and find its column names and its delimiter.

    Raises
    ------
    RecordingError
        The table cannot be read.
    """
    try:
        opened: Callable[[], TextIO] = partial(file.open, encoding='utf-8-sig', newline='')
        with opened() as stream:
            if not file.is_file():
                # Keep the text of a pipe in memory, because a pipe can be read once, and the table
                # is read twice.
                opened = partial(io.StringIO, ''.join(lines_of(stream)))
        with opened() as stream:
            lines = list(islice(lines_of(stream), HEAD_LINES))
        filled = [k for k, line in enumerate(lines) if line.strip()]
        if not filled:
            raise RecordingError(f'{file}: the file is empty; {accepted}', code='empty')
        return _table(file, opened, lines, filled)
    except UnicodeDecodeError:
        raise RecordingError(f'{file}: {NO_TEXT}', code='encoding') from None
    except FileNotFoundError:
        message = f'{file}: there is no such file; give a table of joint states (.csv)'
        raise RecordingError(message, code='missing-file') from None
    except OSError as error:
        message = f'{file}: cannot be read: {error.strerror}'
        raise RecordingError(message, code='unreadable') from None
    except csv.Error as error:
        message = f'{file}: cannot be read as a table: {error}'
        raise RecordingError(message, code='syntax') from None


def _table(
    file: Path, opened: Callable[[], TextIO], lines: list[str], filled: list[int]
) -> TableFile:
    # Skip comment lines, which begin with #. The last comment line may hold the column names.
    rows = [k for k in filled if not lines[k].lstrip().startswith(COMMENT)]
    first = lines[rows[0]] if rows else ''
    delimiter = delimiter_of([first or lines[filled[0]]])
    decimal_comma = delimiter != ',' and any(COMMA.search(lines[k]) for k in rows)
    cells = _cells(first, delimiter)
    heads = rows[0] + 1 if rows else len(lines)
    remarks = [k for k in filled if rows and k < rows[0]]
    labelled = any('.' in cell for cell in cells) and len(cells) > 2
    header, named = cells, True
    if not rows or _are_numbers(cells[1:] if labelled else cells, decimal_comma):
        heads -= bool(rows)
        header = _cells(lines[remarks[-1]].lstrip(' #'), delimiter) if remarks else []
        named = len(header) == len(cells)
    if not named:
        header = [str(k + 1) for k in range(len(cells))]
    return TableFile(file, opened, delimiter, header, heads, decimal_comma, named)


def _cells(line: str, delimiter: str) -> list[str]:
    cells = line.split() if delimiter == ' ' else next(csv.reader([line], delimiter=delimiter))
    return [cell.strip() for cell in cells]


def _are_numbers(cells: list[str], decimal_comma: bool) -> bool:
    for cell in cells:
        try:
            number_of(cell.replace(',', '.') if decimal_comma else cell)
        except ValueError:
            return False
    return True


def _count_lines(file: Path) -> int:
    with file.open('rb') as stream:
        return sum(data.count(b'\n') for data in iter(lambda: stream.read(READ_SIZE), b''))
