"""
Limit the size of unpacked bags, because a small file can unpack to more than the memory.

rosbags itself unpacks whole files, chunks and messages of any size.
"""

import bz2
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from types import ModuleType
from typing import Any

import lz4.frame
from rosbags.rosbag1 import reader as rosbag1
from rosbags.rosbag2 import reader as rosbag2
from rosbags.rosbag2 import storage_mcap

from ....errors import RecordingError

zstd: ModuleType = getattr(rosbag2, 'zstd', None) or rosbag2.zstandard  # by the version of rosbags

# Largest ratio of unpacked to packed size of a file; joint states have about 10.
MAX_EXPANSION_RATIO = 200
# Unpacked size that is allowed for any file, 64 MiB.
MIN_EXPANSION_BYTES = 2**26
# Largest chunk or message, 256 MiB; chunks usually have about 1 MB.
MAX_PART_BYTES = 2**28
# Largest size of all chunks of the same time, which are in memory together, 1 GiB.
MAX_OVERLAP_BYTES = 2**30
# Bytes of a read.
READ_SIZE = 2**20


def refuse_to_grow(folder: Path) -> None:
    """
    Refuse a bag with a file that unpacks to much more than its size.

    Raises
    ------
    RecordingError
        A file is larger than allowed when it is unpacked.
    """
    for file in folder.iterdir():
        if not file.is_file():
            continue
        most = max(MAX_EXPANSION_RATIO * file.stat().st_size, MIN_EXPANSION_BYTES)
        most = min(most, shutil.disk_usage(tempfile.gettempdir()).free)
        refusal = (
            f'{file}: unpacks to more than {most >> 20} MiB: unpack it yourself (zstd -d) if that '
            'is meant'
        )
        with suppress(zstd.ZstdError, EOFError), zstd.open(file, 'rb') as stream:
            for _ in _pieces(stream, most, refusal):
                pass


@contextmanager
def bounded_chunks(path: Path) -> Iterator[None]:
    """Have rosbags refuse chunks of a bag that are too large, or larger than their header says."""

    def bounded(open_packed: Callable[..., Any]) -> Callable[..., bytes]:
        return lambda data, size=MAX_PART_BYTES: _unpacked(data, open_packed, path, size)

    own = {'zstd': bounded(zstd.open), 'lz4': bounded(lz4.frame.open), 'bz2': bounded(bz2.open)}
    tables = storage_mcap.DECOMPRESSORS, rosbag1.decompressors
    usual = [dict(table) for table in tables]
    for table in tables:
        table.update({name: own[name] for name in table if name in own})
    try:
        yield
    finally:
        for table, before in zip(tables, usual):
            table.update(before)


def unpacked_message(data: bytes, path: Path) -> bytes:
    """
    Return a message of a bag, unpacked.

    Raises
    ------
    RecordingError
        The message is too large.
    """
    return _unpacked(data, zstd.open, path, MAX_PART_BYTES)


def leave_messages_packed(reader: rosbag1.Reader | rosbag2.Reader) -> bool:
    """Have a reader of rosbags yield packed messages; return whether they are packed."""
    storage = getattr(reader, 'storage', None)  # of ROS 2
    if storage is None or storage.metadata.compression_mode != 'message':
        return False
    storage.metadata = storage.metadata._replace(compression_mode=None)
    return True


def refuse_to_hold(path: Path, reader: rosbag1.Reader | rosbag2.Reader, topic: str) -> None:
    """
    Refuse a bag with too many chunks of the same time.

    rosbags holds a chunk in memory from its first to its last message. It skips messages outside
    these times; `bounded_chunks` refuses chunks that are larger than their header says.

    Raises
    ------
    RecordingError
        The chunks of one time are too large.
    """
    storage = getattr(reader, 'storage', None)
    for file in getattr(storage, 'storages', [storage]):
        ids = {one.id for one in getattr(file, 'connections', ()) if one.topic == topic}
        chunks = [one for one in getattr(file, 'chunks', ()) if ids & one.channel_count.keys()]
        most = _most_together(chunks)
        if most > MAX_OVERLAP_BYTES:
            raise RecordingError(
                f'{path}: chunks of one time have {most >> 20} MiB together, more than '
                f'{MAX_OVERLAP_BYTES >> 20} (mcap sort may order them)'
            )


def _most_together(chunks: Sequence[Any]) -> int:
    changes = []
    for one in chunks:
        size = max(one.uncompressed_size, one.compressed_size)
        changes.append((one.message_start_time, 0, size))
        changes.append((max(one.message_start_time, one.message_end_time), 1, -size))
    return max(accumulate(size for _, _, size in sorted(changes)), default=0)


def _unpacked(data: bytes, open_packed: Callable[..., Any], path: Path, size: int) -> bytes:
    most = min(size, MAX_PART_BYTES)
    refusal = f'{path}: a part of it unpacks to more than {most:,} bytes'
    with open_packed(BytesIO(data), 'rb') as stream:
        return b''.join(_pieces(stream, most, refusal))


def _pieces(stream: Any, most: int, refusal: str) -> Iterator[bytes]:
    size = 0
    while data := stream.read(READ_SIZE):
        size += len(data)
        if size > most:
            raise RecordingError(refusal)
        yield data
