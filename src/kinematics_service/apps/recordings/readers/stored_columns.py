# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Store columns of numbers for all states of a recording: in memory at first, and in a temporary file
if they are large.
"""

import os
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from typing import IO, Any, Generic, TypeVar, overload

import numpy as np
import numpy.typing as npt

from ....errors import RecordingError
from ....kernel import Floats

# A column with more numbers than this in memory writes its numbers to an unnamed file. The system
# deletes the file when the process ends.
MAX_HELD_NUMBERS = 2**18
# Number of states that are read at once for sums and medians, 17 minutes at 1 kHz. The number is
# constant, so that sums do not depend on how the recording was divided into blocks.
MAX_PIECE_ROWS = 2**20

Scalar = TypeVar('Scalar', bound=np.generic)
Row = int | np.integer[Any]
Rows = slice | Sequence[int] | npt.NDArray[np.integer[Any]] | npt.NDArray[np.bool_]


class Column(Generic[Scalar]):
    """A column of numbers, one for each state. Numbers are appended, and read as from an array."""

    def __init__(self, kind: type[Scalar]) -> None:
        self._kind = np.dtype(kind)
        self._held: list[npt.NDArray[Scalar]] = []
        self._held_count = self._written = 0
        self._file: IO[bytes] | None = None

    def __len__(self) -> int:
        return self._written + self._held_count

    def append(self, numbers: npt.ArrayLike) -> None:
        """Append the numbers of the next states."""
        copy = np.array(numbers, dtype=self._kind)
        self._held.append(copy)
        self._held_count += len(copy)
        if self._held_count > MAX_HELD_NUMBERS:
            self._write()

    def _write(self) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix='kinematics_service_')  # noqa: SIM115
            self._file.seek(0, os.SEEK_END)
            for numbers in self._held:
                self._file.write(numbers.data)
            self._file.flush()
        except OSError as error:
            raise RecordingError(
                f'{tempfile.gettempdir()}: cannot write working files: {error.strerror}; name a '
                'folder with 250 bytes for each message in TMPDIR',
                code='no-space',
            ) from None
        self._written += self._held_count
        self._held, self._held_count = [], 0

    @overload
    def __getitem__(self, at: Row) -> Scalar: ...
    @overload
    def __getitem__(self, at: Rows) -> npt.NDArray[Scalar]: ...
    def __getitem__(self, at: Row | Rows) -> Scalar | npt.NDArray[Scalar]:
        numbers: Any = self.mapped()[at]
        # If the column is in a file, copy the numbers. An array that refers to the memory map
        # would keep the map of the whole file open.
        return numbers if self._file is None else np.array(numbers)[()]

    def mapped(self) -> npt.NDArray[Scalar]:
        """
        Return all numbers as an array, which is a memory map if the column is in a file. Changes
        of the array change the column.
        """
        if self._file is not None:
            self._write()
            return np.memmap(self._file, self._kind, 'r+')
        if len(self._held) != 1:
            self._held = [np.concatenate([np.zeros(0, dtype=self._kind), *self._held])]
        return self._held[0]


class StateTable:
    """k columns of equal length N, which are read as an array (N, k)."""

    def __init__(self, columns: int) -> None:
        self.columns = tuple(Column(np.float64) for _ in range(columns))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, rows: Floats) -> None:
        """Append the rows (M, k) of the next states."""
        self._count += len(rows)
        for k, column in enumerate(self.columns):
            column.append(rows[:, k])

    def __getitem__(self, at: Row | Rows) -> Floats:
        if not self.columns:
            return np.zeros((*np.broadcast_to(0, self._count)[at].shape, 0))
        return np.stack([column[at] for column in self.columns], axis=-1)


def spans(count: int, size: int = MAX_PIECE_ROWS) -> Iterator[slice]:
    """
    Yield slices that divide `count` rows into pieces of `size` rows; the last piece may be
    shorter.
    """
    for begin in range(0, count, size):
        yield slice(begin, min(begin + size, count))


def median(pieces: Iterable[npt.ArrayLike]) -> float:
    """
    Return the median of all numbers in `pieces`, 0 without numbers; NaN is not allowed.

    Many numbers are partitioned in a temporary file, not in memory.
    """
    column = Column(np.float64)
    for piece in pieces:
        column.append(piece)
    return float(np.median(column.mapped(), overwrite_input=True)) if len(column) else 0.0
