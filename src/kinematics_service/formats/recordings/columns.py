"""
Numbers of every state of a recording, read again piece by piece; they are in memory while they are
few.
"""

import os
import tempfile
from collections.abc import Callable, Iterator
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...errors import RecordingError
from ...kernel import Floats

# A column keeps this number of numbers in memory; then they go to a file without a name, which
# disappears with the process, whatever ends it.
HELD = 2**18
# Number of states that findings process at once, so that their sums depend on nothing else:
# shorter recordings (17 minutes at 1 kHz) are one piece.
AT_ONCE = 2**20
# Bits of a double by which each reading narrows a median down.
DIGITS = 16


class Column:
    """One number for each state, to be appended to, and then read like an array."""

    def __init__(self, kind: Any) -> None:
        self._kind = np.dtype(kind)
        self._held: list[npt.NDArray[Any]] = []
        self._held_count = self._written = 0
        self._file: IO[bytes] | None = None

    def __len__(self) -> int:
        return self._written + self._held_count

    def append(self, numbers: npt.ArrayLike) -> None:
        """Add the numbers of the next states."""
        own = np.array(numbers, dtype=self._kind)
        self._held.append(own)
        self._held_count += len(own)
        if self._held_count > HELD:
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
                f'{tempfile.gettempdir()}: no room for working files: {error.strerror} (some 250 '
                'bytes a message; TMPDIR names another folder)'
            ) from None
        self._written += self._held_count
        self._held, self._held_count = [], 0

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, slice):
            begin, end, step = at.indices(len(self))
            return self._read(begin, max(begin, end))[::step]
        if isinstance(at, (int, np.integer)):
            row = int(at) + (len(self) if at < 0 else 0)
            return self._read(row, row + 1)[0]
        rows = np.asarray(at)
        if self._file is None:
            return self._joined()[rows]
        return np.array([self[row] for row in rows.tolist()], dtype=self._kind)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.asarray(self[:], dtype=dtype)

    def _joined(self) -> npt.NDArray[Any]:
        if len(self._held) != 1:
            empty = np.zeros(0, dtype=self._kind)
            self._held = [np.concatenate(self._held) if self._held else empty]
        return self._held[0]

    def _read(self, begin: int, end: int) -> npt.NDArray[Any]:
        if begin >= self._written:
            return self._joined()[begin - self._written : end - self._written]
        assert self._file is not None
        self._file.seek(begin * self._kind.itemsize)
        own = np.fromfile(self._file, self._kind, min(end, self._written) - begin)
        if end <= self._written:
            return own
        return np.concatenate([own, self._joined()[: end - self._written]])


class StateTable:
    """Some numbers for each state: columns side by side, read like an array (N, k)."""

    def __init__(self, columns: int) -> None:
        self.columns = tuple(Column(np.float64) for _ in range(columns))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, rows: Floats) -> None:
        """Add the rows of the next states."""
        self._count += len(rows)
        for k, column in enumerate(self.columns):
            column.append(rows[:, k])

    def __getitem__(self, at: Any) -> Floats:
        if not self.columns:
            return np.zeros((*np.broadcast_to(0, self._count)[at].shape, 0))
        return np.stack([column[at] for column in self.columns], axis=-1)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.asarray(self[:], dtype=dtype)


def spans(count: int) -> Iterator[slice]:
    """Yield the rows of `count` in pieces that findings process at once."""
    for begin in range(0, count, AT_ONCE):
        yield slice(begin, min(begin + AT_ONCE, count))


def median(pieces: Callable[[], Iterator[npt.NDArray[Any]]]) -> float:
    """
    Return the median of numbers that are read in pieces, 0 if there are none.

    It is the same as numpy's median of all of them, in the memory of one piece: the leading bits
    of the doubles tell the narrow band of the middle, and few numbers are in that band.

    Parameters
    ----------
    pieces
        Yields the numbers, the same each time; none is NaN.
    """
    count, prefix, known = 0, 0, 0
    rank = (0, 0)
    while True:
        found = np.zeros(2**DIGITS, dtype=np.int64)
        band: list[npt.NDArray[Any]] = []
        collected = 0
        for piece in pieces():
            keys = _ordered(piece)
            if known:
                keys = keys[keys >> np.uint64(64 - known) == prefix]
            collected += len(keys)
            if collected <= AT_ONCE:
                band.append(keys)
            digits = (keys >> np.uint64(64 - known - DIGITS)) & np.uint64(2**DIGITS - 1)
            found += np.bincount(digits.astype(np.int64), minlength=2**DIGITS)
        if not known:
            count = collected
            rank = ((count - 1) // 2, count // 2)
        if not count:
            return 0.0
        if collected <= AT_ONCE:
            keys = np.partition(np.concatenate(band), rank)
            return float(np.mean(_numbers(keys[list(rank)])))
        ends = np.cumsum(found)
        low, high = (int(np.searchsorted(ends, one, side='right')) for one in rank)
        if low != high or known + DIGITS == 64:
            return _between(pieces, prefix, known, low, high, ends, rank)
        before = int(ends[low - 1]) if low else 0
        rank = (rank[0] - before, rank[1] - before)
        prefix, known = prefix << DIGITS | low, known + DIGITS


def _between(
    pieces: Callable[[], Iterator[npt.NDArray[Any]]],
    prefix: int,
    known: int,
    low: int,
    high: int,
    ends: npt.NDArray[Any],
    rank: tuple[int, int],
) -> float:
    # The middle two are the largest of one band and the least of another, or all bits are known.
    if low == high:
        key = np.array([prefix << DIGITS | low], dtype=np.uint64)
        return float(_numbers(key)[0])
    largest, least = np.uint64(0), np.uint64(2**64 - 1)
    for piece in pieces():
        keys = _ordered(piece)
        bands = keys >> np.uint64(64 - known - DIGITS)
        below, above = (
            keys[bands == (prefix << DIGITS | low)],
            keys[bands == (prefix << DIGITS | high)],
        )
        largest = max(largest, below.max(initial=0))
        least = min(least, above.min(initial=2**64 - 1))
    return float(np.mean(_numbers(np.array([largest, least], dtype=np.uint64))))


def _ordered(numbers: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    # Returns the bits of doubles, changed so that they sort like the numbers.
    bits = np.asarray(numbers, dtype=np.float64).view(np.uint64)
    sign = np.uint64(1 << 63)
    return np.where(bits & sign, ~bits, bits | sign)


def _numbers(keys: npt.NDArray[np.uint64]) -> Floats:
    sign = np.uint64(1 << 63)
    return np.where(keys & sign, keys ^ sign, ~keys).astype(np.uint64).view(np.float64)
