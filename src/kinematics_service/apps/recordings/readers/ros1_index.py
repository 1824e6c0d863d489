"""
The index of a ROS 1 bag, which has an entry for every message, kept in columns.

The reader of rosbags keeps an object for each: 0.14 kB a message.
"""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import IndexData

from .block import LARGEST_BLOCK
from .columns import Column


class LongBag(Reader):  # type: ignore[misc]
    """A ROS 1 bag of any length."""

    connections: list[Connection]
    indexes: dict[int, '_Entries']

    def open(self) -> None:
        """Open the bag."""
        self._entries: defaultdict[int, _Entries] = defaultdict(_Entries)
        super().open()
        self.indexes = {one.id: self._entries[one.id] for one in self.connections}
        self.connections = [
            one._replace(msgcount=len(self._entries[one.id])) for one in self.connections
        ]

    def read_index_data(self, pos: int, indexes: dict[int, list[IndexData]]) -> None:
        """Read the index of one connection in the chunk at a position."""
        found: defaultdict[int, list[IndexData]] = defaultdict(list)
        super().read_index_data(pos, found)
        for connection, entries in found.items():
            self._entries[connection].append(entries)


class _Entries:
    """The messages of a connection; they come out by rising time."""

    def __init__(self) -> None:
        self._columns = tuple(Column(np.int64) for _ in IndexData._fields)
        self._rising, self._latest = True, -1

    def __len__(self) -> int:
        return len(self._columns[0])

    def append(self, entries: list[IndexData]) -> None:
        if not entries:
            return
        table = np.array(entries, dtype=np.int64)
        self._rising &= bool(np.all(np.diff(table[:, 0], prepend=self._latest) >= 0))
        self._latest = int(table[-1, 0])
        for column, numbers in zip(self._columns, table.T):
            column.append(numbers)

    def __iter__(self) -> Iterator[IndexData]:
        columns: tuple[Any, ...] = self._columns
        if not self._rising:
            order = np.argsort(columns[0][:], kind='stable')
            columns = tuple(column[:][order] for column in columns)
        for begin in range(0, len(self), LARGEST_BLOCK):
            rows = slice(begin, begin + LARGEST_BLOCK)
            yield from map(IndexData, *(column[rows].tolist() for column in columns))
