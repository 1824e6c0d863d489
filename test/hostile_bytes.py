# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Bytes that are nearly a serialized message: lengths that lie, and every encoding."""

import random
import struct

TEXTS = (b'', b'\0', b'a\0', b'ab', b'abc\0', b'\xff\xfe\0', b'a\0b\0', b'q1\0', b'q2\0', b'q3\0')
LENGTHS = (0, 1, 2**31, 2**32 - 1)
# Second byte of the encapsulation by order of bytes and alignment of doubles.
ENCODINGS = {('<', 8): (1, 3), ('>', 8): (0, 2), ('<', 4): (7, 9, 11), ('>', 4): (6, 8, 10)}


class HostileBytes:
    """Makes bytes that are nearly a message of a kind."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def __call__(self, kind):
        draw = self.random
        if draw.random() < 0.002:
            return draw.randbytes(draw.randrange(80))
        data = self._serialized(kind)
        for _ in range(draw.choice([0, 0, 0, 1, 1, 2, 8])):
            if data:
                self._spoil(data)
        return bytes(data)

    def _length(self, count):
        if self.random.random() < 0.06:
            return self.random.choice((*LENGTHS, count - 1, count + 1, 2 * count)) % 2**32
        return count

    def _serialized(self, kind):
        draw, data = self.random, bytearray()
        order, size = draw.choice('<<<>'), draw.choice([8, 8, 8, 4])
        fill = draw.choice([b'\0', b'\xd0'])

        def align(to):
            data.extend(fill * (-len(data) % to))

        def number(value):
            align(4)
            data.extend(struct.pack(order + 'I', value))

        def text():
            one = draw.choice(TEXTS)
            number(self._length(len(one)))
            data.extend(one)

        def doubles(count):
            if count:
                align(size)
            data.extend(struct.pack(f'{order}{count}d', *(draw.gauss(0, 1) for _ in range(count))))

        number(draw.choice([0, 1, 5, 2**31]))
        number(draw.randrange(2**32))
        text()
        if kind.__name__ == 'JointState':
            count = draw.choice([0, 1, 2, 3, 6, 20])
            number(self._length(count))
            for _ in range(count):
                text()
            for _ in range(3):
                many = draw.choice([count, count, 0, 1, count + 1])
                number(self._length(many))
                doubles(many)
        else:
            doubles(7 if kind.__name__ == 'PoseStamped' else 6)
        head = (0, draw.choice(ENCODINGS[order, size]), draw.choice([0, 255]), draw.choice([0, 3]))
        return bytearray(head) + data

    def _spoil(self, data):
        draw = self.random
        at, kind = draw.randrange(len(data)), draw.randrange(7)
        if kind == 0:
            data[at] ^= 1 << draw.randrange(8)
        elif kind == 1:
            del data[at:]
        elif kind == 2:
            data[at:at] = draw.randbytes(draw.randrange(1, 9))
        elif kind == 3:
            del data[at : at + draw.randrange(1, 9)]
        elif kind == 4:
            data[at] = draw.choice([0, 1, 127, 255])
        elif kind == 5:
            data[1:2] = bytes([draw.choice([*range(20), 128, 255])])
        else:
            data.extend(bytes(draw.randrange(20)))
