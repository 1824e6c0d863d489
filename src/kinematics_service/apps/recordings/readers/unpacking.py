"""
Bounds for what the reader of bags unpacks: a small file may hold what fills any memory.

rosbags unpacks whole files, chunks and messages, whatever size they say they have.
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

# A compressed file of joint states is some ten times as large when it is unpacked, and may be this
# many times; small ones may have this many bytes.
MOST_TIMES, LEAST_UNPACKED = 200, 2**26
# A chunk has about a megabyte, and may have this many bytes; so may a message.
MOST_OF_A_PART = 2**28
# Chunks of one time are in memory together, and may have this many bytes.
MOST_TOGETHER = 2**30
# Bytes unpacked at once.
AT_ONCE = 2**20


def refuse_to_grow(folder: Path) -> None:
    """
    Refuse a bag with a file that has many times its size when it is unpacked.

    Raises
    ------
    RecordingError
        It has one.
    """
    for file in folder.iterdir():
        if not file.is_file():
            continue
        most = max(MOST_TIMES * file.stat().st_size, LEAST_UNPACKED)
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
    """Let rosbags unpack no chunk of a bag that is too large, or larger than it says."""

    def bounded(open_packed: Callable[..., Any]) -> Callable[..., bytes]:
        return lambda data, size=MOST_OF_A_PART: _unpacked(data, open_packed, path, size)

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
    Return what a message of a bag is when it is unpacked.

    Raises
    ------
    RecordingError
        It is too large.
    """
    return _unpacked(data, zstd.open, path, MOST_OF_A_PART)


def leave_messages_packed(reader: rosbag1.Reader | rosbag2.Reader) -> bool:
    """Have a reader of rosbags yield messages as they are; return whether they are compressed."""
    storage = getattr(reader, 'storage', None)  # of ROS 2
    if storage is None or storage.metadata.compression_mode != 'message':
        return False
    storage.metadata = storage.metadata._replace(compression_mode=None)
    return True


def refuse_to_hold(path: Path, reader: rosbag1.Reader | rosbag2.Reader, topic: str) -> None:
    """
    Refuse a bag of which too much would be in memory at a time.

    rosbags holds a chunk from its first to its last message. What is longer than these is left
    out by it, and what is larger than it says is not unpacked.

    Raises
    ------
    RecordingError
        It is one.
    """
    storage = getattr(reader, 'storage', None)
    for file in getattr(storage, 'storages', [storage]):
        ids = {one.id for one in getattr(file, 'connections', ()) if one.topic == topic}
        chunks = [one for one in getattr(file, 'chunks', ()) if ids & one.channel_count.keys()]
        most = _most_together(chunks)
        if most > MOST_TOGETHER:
            raise RecordingError(
                f'{path}: chunks of one time have {most >> 20} MiB together, more than '
                f'{MOST_TOGETHER >> 20} (mcap sort may order them)'
            )


def _most_together(chunks: Sequence[Any]) -> int:
    changes = []
    for one in chunks:
        size = max(one.uncompressed_size, one.compressed_size)
        changes.append((one.message_start_time, 0, size))
        changes.append((max(one.message_start_time, one.message_end_time), 1, -size))
    return max(accumulate(size for _, _, size in sorted(changes)), default=0)


def _unpacked(data: bytes, open_packed: Callable[..., Any], path: Path, size: int) -> bytes:
    most = min(size, MOST_OF_A_PART)
    refusal = f'{path}: a part of it unpacks to more than {most:,} bytes'
    with open_packed(BytesIO(data), 'rb') as stream:
        return b''.join(_pieces(stream, most, refusal))


def _pieces(stream: Any, most: int, refusal: str) -> Iterator[bytes]:
    size = 0
    while data := stream.read(AT_ONCE):
        size += len(data)
        if size > most:
            raise RecordingError(refusal)
        yield data
