# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Open a table, and read its header, its lines, and the numbers and times in its cells."""

import csv
import io
import re
from collections.abc import Callable, Iterator
from datetime import datetime
from decimal import Decimal
from functools import partial
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.tables.delimiter import delimiter_of
from ....typography import plain_signs
from .arm_columns import HOW
from .block import Times

MAX_LINE_LENGTH = 2**20
# Number of first lines of a file in which column names and decimal commas are searched.
HEAD_LINES = 100
COMMENT = '#'
COMMA = re.compile(r'\d,\d')
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
    # Text with `_` needs a check, because float() accepts 1_0. Text with characters outside ASCII
    # may have a typographic minus, which must be replaced.
    if not plain.isascii() or '_' in plain:
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
        Exponent n of the unit of the time, 10^n ns: 9 for seconds, 0 for ns.
    """
    text, latest = text.strip(), MAX_STAMP.scaleb(9 - digits)
    if match := DATE.fullmatch(text):
        zone = (match[4] or 'Z').replace(':', '').replace('UTC', 'Z').replace('Z', '+0000')
        date = datetime.strptime(f'{match[1]} {match[2]}{zone}', '%Y-%m-%d %H:%M:%S%z')
        text, digits, latest = f'{int(date.timestamp())}.{match[3] or 0}', 9, MAX_STAMP
    time = Decimal(text) if NUMBER.fullmatch(text) else Decimal('nan')
    if not (time.is_finite() and 0 <= time < latest):
        raise ValueError(text)
    # Shift the decimal point of a Decimal, because a float has too few digits for the nanoseconds
    # since 1970.
    return int(time.scaleb(digits))
