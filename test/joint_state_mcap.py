# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Joint states as an MCAP file with every checksum, fast: messages of one layout, a chunk at a time.

It is written from the format's specification (mcap.dev/spec) alone.
"""

import struct
import zlib

import numpy as np

MAGIC = b'\x89MCAP0\r\n'
KIND = 'sensor_msgs/msg/JointState'
DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""


def text(value):
    data = value.encode()
    return struct.pack('<I', len(data)) + data


def record(opcode, data):
    return struct.pack('<BQ', opcode, len(data)) + data


def message_bytes(names, stamps, positions, velocities):
    """Return serialized JointStates, shape (N, length) of bytes."""

    def aligned(data, size):
        return data + bytes(-(len(data) - 4) % size)

    head = b'\x00\x01\x00\x00' + bytes(8) + text('\x00') + b''
    head = aligned(head, 4) + struct.pack('<I', len(names))
    for name in names:
        head = aligned(head, 4) + text(name + '\x00')
    places = []
    for numbers in (positions, velocities):
        head = aligned(aligned(head, 4) + struct.pack('<I', numbers.shape[1]), 8)
        places.append(len(head))
        head += bytes(8 * numbers.shape[1])
    head += struct.pack('<I', 0)
    table = np.tile(np.frombuffer(head, np.uint8), (len(stamps), 1))
    seconds, nanoseconds = np.divmod(stamps, 1_000_000_000)
    table[:, 4:8] = seconds.astype('<i4')[:, None].view(np.uint8)
    table[:, 8:12] = nanoseconds.astype('<u4')[:, None].view(np.uint8)
    for at, numbers in zip(places, (positions, velocities)):
        data = np.ascontiguousarray(numbers, dtype='<f8').view(np.uint8)
        table[:, at : at + data.shape[1]] = data
    return table


class Writer:
    """An MCAP file of one topic; `write` makes a chunk and its index."""

    def __init__(self, file, topic='/joint_states', checksums=True):
        self._file, self._checksums = file, checksums
        self._at = self._crc = 0
        self._put(MAGIC + record(1, text('ros2') + text('joint_state_mcap')))
        self._schema = record(
            3, struct.pack('<H', 1) + text(KIND) + text('ros2msg') + text(DEFINITION)
        )
        self._channel = record(
            4, struct.pack('<HH', 1, 1) + text(topic) + text('cdr') + struct.pack('<I', 0)
        )
        self._chunks, self._count, self._times = [], 0, []

    def _put(self, data):
        self._file.write(data)
        self._at += len(data)
        self._crc = zlib.crc32(data, self._crc)

    def _sum(self, data, start=0):
        return zlib.crc32(data, start) if self._checksums else 0

    def write(self, times, messages):
        """Write messages (N, length) with the times of their recording (N,), ns."""
        length = messages.shape[1]
        table = np.zeros((len(times), 31 + length), np.uint8)
        table[:, :9] = np.frombuffer(struct.pack('<BQ', 5, 22 + length), np.uint8)
        table[:, 9:11] = np.frombuffer(struct.pack('<H', 1), np.uint8)
        table[:, 11:15] = (np.arange(len(times)) + self._count).astype('<u4')[:, None].view('u1')
        stamps = times.astype('<u8')[:, None]
        table[:, 15:23] = table[:, 23:31] = stamps.view(np.uint8)
        table[:, 31:] = messages
        first = b'' if self._chunks else self._schema + self._channel
        data = first + table.tobytes()
        begin, end = int(times[0]), int(times[-1])
        at = self._at
        head = struct.pack('<QQQI', begin, end, len(data), self._sum(data)) + text('')
        self._put(record(6, head + struct.pack('<Q', len(data)) + data))
        length_of_chunk, index_at = self._at - at, self._at
        offsets = (np.arange(len(times)) * table.shape[1] + len(first)).astype('<u8')[:, None]
        index = np.concatenate([stamps, offsets], axis=1).tobytes()
        self._put(record(7, struct.pack('<HI', 1, len(index)) + index))
        self._chunks.append(
            record(
                8,
                struct.pack('<QQQQ', begin, end, at, length_of_chunk)
                + struct.pack('<IHQ', 10, 1, index_at)
                + struct.pack('<Q', self._at - index_at)
                + text('')
                + struct.pack('<QQ', len(data), len(data)),
            )
        )
        self._count += len(times)
        self._times = [min([begin, *self._times[:1]]), end]

    def close(self):
        """Write the summary."""
        self._put(record(15, struct.pack('<I', self._crc if self._checksums else 0)))
        begin = self._at
        count = struct.pack('<QHIIIIQQ', self._count, 1, 1, 0, 0, len(self._chunks), *self._times)
        statistics = record(11, count + struct.pack('<IHQ', 10, 1, self._count))
        summary = self._schema + self._channel + statistics + b''.join(self._chunks)
        footer = struct.pack('<BQQQ', 2, 20, begin, 0)
        crc = self._sum(summary + footer)
        self._put(summary + footer + struct.pack('<I', crc) + MAGIC)


def write_motion(path, names, count, motion, rate=1000, begin=1_700_000_000 * 10**9, chunk=4096):
    """Write `count` messages; `motion` returns positions and velocities of times in s."""
    with path.open('wb') as file:
        writer = Writer(file)
        for at in range(0, count, chunk):
            k = np.arange(at, min(at + chunk, count), dtype=np.int64)
            q, qdot = motion(k / rate)
            stamps = begin + k * (1_000_000_000 // rate)
            writer.write(stamps + 500_000, message_bytes(names, stamps, q, qdot))
        writer.close()
