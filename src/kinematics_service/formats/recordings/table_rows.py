"""Rows of a table, read in pieces: quickly while nothing is wrong, else line by line."""

import csv
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import RecordingError
from ...kernel import Floats
from ...robot.measures import Level
from .block import LARGEST_BLOCK, Times
from .joint_csv import lines_of, nanoseconds_of, number_of
from .source import Remark

# Most lines of one piece, empty ones included. More would be a quote that is never closed.
MOST_LINES = 8 * LARGEST_BLOCK
NO_TEXT = 'is not UTF-8 text, so not a table'


class TableRows(NamedTuple):
    """Consecutive rows: stamps (N,), ns, and the wanted numbers (N, k), NaN for an empty cell."""

    stamps: Times
    numbers: Floats


class RowReader:
    """
    The rows of a table whose header is known.

    Parameters
    ----------
    stamp, columns
        Names of the column of stamps, and of the wanted columns.

    Attributes
    ----------
    remarks
        Remarks on the file, complete when the rows are read.
    """

    def __init__(
        self, file: Path, delimiter: str, header: list[str], stamp: str, columns: Sequence[str]
    ) -> None:
        self.remarks: list[Remark] = []
        self._file, self._delimiter, self._header = file, delimiter, header
        self._stamp_at = header.index(stamp)
        self._at = [header.index(column) for column in columns]

    def pieces(self) -> Iterator[TableRows]:
        """
        Yield the rows in their order, at most `LARGEST_BLOCK` at once.

        Raises
        ------
        RecordingError
            A line is no row of the table; the message names line and column.
        """
        count = 0
        try:
            for rows in self._quickly():
                count += len(rows.stamps)
                yield rows
        except (ValueError, csv.Error):
            pass
        else:
            if count:
                return
        try:
            yield from self._line_by_line(count)
        except UnicodeDecodeError:
            raise RecordingError(f'{self._file}: {NO_TEXT}') from None
        except csv.Error as error:
            raise RecordingError(f'{self._file}: cannot be read as a table: {error}') from None

    def _quickly(self) -> Iterator[TableRows]:
        with self._file.open(encoding='utf-8-sig') as stream:
            lines = lines_of(stream)
            next((line for line in lines if line.strip()), '')
            length = LARGEST_BLOCK
            while length == LARGEST_BLOCK:
                table = self._table(_few(lines))
                length = len(table)
                if length:
                    stamps = np.ascontiguousarray(table[:, 0]).view(np.int64)
                    yield TableRows(stamps, table[:, 1:])

    def _table(self, lines: Iterable[str]) -> Floats:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # the caller reports that there are no rows
            return np.loadtxt(
                lines,
                delimiter=None if self._delimiter == ' ' else self._delimiter,
                usecols=[self._stamp_at, *self._at],
                converters={self._stamp_at: _nanoseconds_as_double},
                comments=None,
                encoding=None,  # before numpy 2, converters got bytes without it
                ndmin=2,
                quotechar='"',
                max_rows=LARGEST_BLOCK,
            )

    def _line_by_line(self, known: int) -> Iterator[TableRows]:
        # The slow way, which can describe a bad line; it also reads rows that are known already,
        # since the quick way overlooks superfluous cells.
        stamps: list[int] = []
        numbers: list[list[float]] = []
        count = 0
        for line, cells in self._lines():
            count += 1
            if count <= known:
                continue
            stamps.append(self._nanoseconds(line, cells[self._stamp_at]))
            numbers.append([self._number(line, column, cells[column]) for column in self._at])
            if len(stamps) == LARGEST_BLOCK:
                yield TableRows(np.array(stamps, dtype=np.int64), np.array(numbers))
                stamps, numbers = [], []
        if not count:
            raise RecordingError(f'{self._file}: has a header but no rows')
        if stamps:
            yield TableRows(np.array(stamps, dtype=np.int64), np.array(numbers))

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        # Yields rows with their line; the last one may be cut off.
        with self._file.open(encoding='utf-8-sig', newline='') as stream:
            rows = csv.reader(lines_of(stream), delimiter=self._delimiter)
            filled = (
                (rows.line_num, cells) for cells in rows if any(cell.strip() for cell in cells)
            )
            next(filled)
            count = 0
            for line, cells in filled:
                count += 1
                if len(cells) == len(self._header):
                    yield line, cells
                    continue
                if count > 1 and next(filled, None) is None:
                    text = f'line {line}, the last one, is cut off and left out'
                    self.remarks.append(Remark(Level.OK, text))
                    return
                raise RecordingError(
                    f'{self._file}:{line}: {len(cells)} cells, but the header has '
                    f'{len(self._header)} columns'
                )

    def _nanoseconds(self, line: int, cell: str) -> int:
        try:
            return nanoseconds_of(cell)
        except ValueError:
            raise RecordingError(
                f'{self._file}:{line}: column {self._header[self._stamp_at]!r}: '
                f'{cell[:40]!a} is not a time in seconds'
            ) from None

    def _number(self, line: int, column: int, cell: str) -> float:
        text = cell.strip()
        try:
            return number_of(text) if text else float('nan')
        except ValueError:
            raise RecordingError(
                f'{self._file}:{line}: column {self._header[column]!r}: {text[:40]!a} is not a '
                'number'
            ) from None


def _few(lines: Iterable[str]) -> Iterator[str]:
    for k, line in enumerate(lines):
        if k == MOST_LINES:
            raise ValueError('a quote is not closed')
        yield line


def _nanoseconds_as_double(text: str) -> float:
    # Returns the bits of an integer in the one table of doubles that numpy reads.
    return float(np.int64(nanoseconds_of(text)).view(np.float64))
