# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Limit the size of unpacked bags, because a small file can unpack to more than the memory.

The limits are needed because rosbags unpacks files, chunks and messages of any size.
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

# the module's name depends on the version of rosbags
zstd: ModuleType = getattr(rosbag2, 'zstd', None) or rosbag2.zstandard

# Largest ratio of unpacked to packed size of a file. The ratio of joint states is about 10.
MAX_EXPANSION_RATIO = 200
# Files that unpack to at most this size, 64 MiB, are accepted at any ratio of unpacked to packed
# size.
MIN_EXPANSION_BYTES = 2**26
# Largest size of an unpacked chunk or message, 256 MiB. Chunks usually have about 1 MB.
MAX_PART_BYTES = 2**28
# Chunks of a bag that overlap in time may have at most this size together, 1 GiB. The size is
# limited because rosbags holds overlapping chunks in memory together.
MAX_OVERLAP_BYTES = 2**30
# Number of bytes that are unpacked in one step.
READ_SIZE = 2**20


def refuse_to_grow(folder: Path) -> None:
    """
    Raise an error if a file of a bag unpacks to much more than its packed size.

    Raises
    ------
    RecordingError
        A file is larger than allowed when it is unpacked.
    """
    for file in folder.iterdir():
        if not file.is_file():
            continue
        limit = max(MAX_EXPANSION_RATIO * file.stat().st_size, MIN_EXPANSION_BYTES)
        limit = min(limit, shutil.disk_usage(tempfile.gettempdir()).free)
        refusal = (
            f'{file}: unpacks to more than {limit >> 20} MiB; unpack it yourself with zstd -d if '
            'you trust it'
        )
        with suppress(zstd.ZstdError, EOFError), zstd.open(file, 'rb') as stream:
            for _ in _pieces(stream, limit, refusal):
                pass


@contextmanager
def bounded_chunks(path: Path) -> Iterator[None]:
    """
    Make rosbags raise an error at a chunk that unpacks to more than `MAX_PART_BYTES`, or to more
    than its header claims.
    """

    def bounded(open_packed: Callable[..., Any]) -> Callable[..., bytes]:
        return lambda data, size=MAX_PART_BYTES: unpacked(data, path, open_packed, size)

    codecs = {'zstd': bounded(zstd.open), 'lz4': bounded(lz4.frame.open), 'bz2': bounded(bz2.open)}
    tables = storage_mcap.DECOMPRESSORS, rosbag1.decompressors
    usual = [dict(table) for table in tables]
    for table in tables:
        table.update({name: codecs[name] for name in table if name in codecs})
    try:
        yield
    finally:
        for table, before in zip(tables, usual):
            table.update(before)


def leave_messages_packed(reader: rosbag1.Reader | rosbag2.Reader) -> bool:
    """
    Make a reader of rosbags yield messages without decompressing them. Return False if the bag's
    messages are not compressed one by one.
    """
    storage = getattr(reader, 'storage', None)  # only readers of ROS 2 bags have this attribute
    if storage is None or storage.metadata.compression_mode != 'message':
        return False
    storage.metadata = storage.metadata._replace(compression_mode=None)
    return True


def refuse_to_hold(path: Path, reader: rosbag1.Reader | rosbag2.Reader, topic: str) -> None:
    """
    Raise an error if several chunks of a bag overlap in time and are too large together.

    rosbags reads a bag in the order of time. The header of a chunk gives the times of the chunk's
    first and last message. rosbags holds the chunk in memory between the two times, and skips
    messages of the chunk outside the two times. The sizes in the headers are reliable, because
    `bounded_chunks` refuses chunks that are larger than their headers claim.

    Raises
    ------
    RecordingError
        Several chunks overlap in time and are too large together.
    """
    storage = getattr(reader, 'storage', None)
    for file in getattr(storage, 'storages', [storage]):
        ids = {entry.id for entry in getattr(file, 'connections', ()) if entry.topic == topic}
        chunks = [part for part in getattr(file, 'chunks', ()) if ids & part.channel_count.keys()]
        size = _largest_overlap(chunks)
        if size > MAX_OVERLAP_BYTES:
            raise RecordingError(
                f'{path}: chunks of one time have {size >> 20} MiB together, more than '
                f'{MAX_OVERLAP_BYTES >> 20}; order the messages by time with `mcap sort`',
                code='too-large',
            )


def _largest_overlap(chunks: Sequence[Any]) -> int:
    changes = []
    for chunk in chunks:
        size = max(chunk.uncompressed_size, chunk.compressed_size)
        changes.append((chunk.message_start_time, 0, size))
        changes.append((max(chunk.message_start_time, chunk.message_end_time), 1, -size))
    return max(accumulate(size for _, _, size in sorted(changes)), default=0)


def unpacked(
    data: bytes,
    path: Path,
    opened: Callable[..., Any] = zstd.open,
    size: int = MAX_PART_BYTES,
) -> bytes:
    """
    Unpack a message or a chunk of a bag, and return its bytes.

    Raises
    ------
    RecordingError
        The unpacked data have more than `size` bytes, or more than `MAX_PART_BYTES`.
    """
    limit = min(size, MAX_PART_BYTES)
    refusal = f'{path}: a part of it unpacks to more than {limit:,} bytes; record it anew'
    with opened(BytesIO(data), 'rb') as stream:
        return b''.join(_pieces(stream, limit, refusal))


def _pieces(stream: Any, limit: int, refusal: str) -> Iterator[bytes]:
    size = 0
    while data := stream.read(READ_SIZE):
        size += len(data)
        if size > limit:
            raise RecordingError(refusal, code='too-large')
        yield data
