# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check whether a bag is damaged: by its checksums, or, for a sqlite3 bag, by sqlite's own check. If
the bag has no checksums, a remark says so.

This module does not check MCAP chunks, because rosbags checks each chunk when it reads the chunk.
"""

import sqlite3
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ....robot.measures import Level
from .source import Remark

UNNOTICED = 'has no checksums: a flipped bit in its numbers would not be noticed'
CHANGED = 'it was changed after it was written, and what follows from it may be wrong'
# Codes in the JSON document for a wrong checksum, and for a missing checksum.
WRONG_SUM, NO_SUM = 'wrong-checksum', 'no-checksum'
MAGIC_LENGTH = 8
# Layout of the first bytes of an MCAP record: opcode and length (mcap.dev/spec).
HEAD = struct.Struct('<BQ')
CHUNK_INDEX = 8
DATA_END = 15
FOOTER_LENGTH = HEAD.size + 20
DATA_END_LENGTH = HEAD.size + 4
# Offset of the checksum in a chunk record. Before the checksum are the opcode and length of the
# record (`HEAD`), and three fields of 8 bytes: two time stamps and the uncompressed size.
CHUNK_SUM_AT = HEAD.size + 24
READ_SIZE = 1 << 20


def checked(path: Path) -> Iterator[Remark]:
    """Check a bag (a file or a directory), and yield remarks on damage or missing checksums."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        if file.suffix == '.mcap':
            with file.open('rb') as stream:
                yield from _mcap(file.name, stream)
        elif file.suffix == '.db3':
            yield from _sqlite(file)
        elif file.suffix == '.bag':
            yield Remark(Level.OK, f'{file.name} {UNNOTICED} (ROS 1 bags have none)', NO_SUM)


def add_checksums(file: Path) -> None:
    """
    Write the checksums of data and index into an MCAP file that was written without checksums.
    """
    with file.open('r+b') as stream:
        end = stream.seek(-(FOOTER_LENGTH + MAGIC_LENGTH), 2)
        footer = stream.read(FOOTER_LENGTH)
        (begin,) = struct.unpack_from('<Q', footer, HEAD.size)
        data_end = begin - DATA_END_LENGTH
        for at, total in (
            (data_end + HEAD.size, _sum_until(stream, data_end)),
            (end + FOOTER_LENGTH - 4, zlib.crc32(_between(stream, begin, end) + footer[:-4])),
        ):
            stream.seek(at)
            stream.write(struct.pack('<I', total))


def _mcap(name: str, stream: BinaryIO) -> Iterator[Remark]:
    end = stream.seek(-(FOOTER_LENGTH + MAGIC_LENGTH), 2)
    footer = stream.read(FOOTER_LENGTH)
    begin, _, summary_sum = struct.unpack_from('<QQI', footer, HEAD.size)
    begin = begin or end
    summary = _between(stream, begin, end)
    if summary_sum and zlib.crc32(summary + footer[:-4]) != summary_sum:
        text = f'The index of {name} does not have its checksum: {CHANGED}'
        yield Remark(Level.ERROR, text, WRONG_SUM)
    whole = _data_sum(stream, begin - DATA_END_LENGTH)
    if whole and _sum_until(stream, begin - DATA_END_LENGTH) != whole:
        yield Remark(Level.ERROR, f'{name} does not have its checksum: {CHANGED}', WRONG_SUM)
    sums = list(_chunk_sums(stream, summary))
    if not whole and not (sums and all(sums)):
        yield Remark(Level.OK, f'{name} {UNNOTICED}', NO_SUM)


def _between(stream: BinaryIO, begin: int, end: int) -> bytes:
    stream.seek(begin)
    return stream.read(end - begin)


def _data_sum(stream: BinaryIO, at: int) -> int:
    # Returns the checksum of the data section as stored in the file, 0 without a checksum.
    stream.seek(at)
    record = stream.read(DATA_END_LENGTH)
    if len(record) < DATA_END_LENGTH or HEAD.unpack_from(record) != (DATA_END, 4):
        return 0
    return int(struct.unpack_from('<I', record, HEAD.size)[0])


def _sum_until(stream: BinaryIO, end: int) -> int:
    stream.seek(0)
    total, remaining = 0, end
    while remaining and (data := stream.read(min(remaining, READ_SIZE))):
        total, remaining = zlib.crc32(data, total), remaining - len(data)
    return total


def _chunk_sums(stream: BinaryIO, summary: bytes) -> Iterator[int]:
    at = 0
    while at + HEAD.size <= len(summary):
        kind, length = HEAD.unpack_from(summary, at)
        if kind == CHUNK_INDEX and at + HEAD.size + 24 <= len(summary):
            (chunk,) = struct.unpack_from('<Q', summary, at + HEAD.size + 16)
            stream.seek(min(chunk, 1 << 62) + CHUNK_SUM_AT)
            data = stream.read(4)
            yield int.from_bytes(data, 'little') if len(data) == 4 else 0
        at += HEAD.size + length


def _sqlite(file: Path) -> Iterator[Remark]:
    address = f'{file.absolute().as_uri()}?mode=ro&immutable=1'
    database = sqlite3.connect(address, uri=True)
    try:
        answer = str(database.execute('PRAGMA quick_check(1)').fetchone()[0])
    except sqlite3.Error as error:
        answer = str(error)
    finally:
        database.close()
    if answer != 'ok':
        reason = ' '.join(answer.split())
        yield Remark(Level.ERROR, f'{file.name} is damaged ({reason}): {CHANGED}', WRONG_SUM)
    yield Remark(Level.OK, f'{file.name} {UNNOTICED} (sqlite3 bags have none)', NO_SUM)
