# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read and write plain CDR, the encoding of ROS 2 messages (OMG, Common Data Representation).

A message begins with four bytes, the encapsulation, which name the byte order; the body follows. A
number begins at a multiple of its size, counted from the start of the body. A text is encoded as
its length, which includes the zero at the end, and its bytes. A sequence is encoded as its length
and its members. Bytes skipped for alignment have no meaning; serializers leave them undefined.
"""

import struct

from ..errors import CdrError

BODY = 4
# The first two bytes of plain little-endian CDR. The second byte names the encoding; its lowest
# bit is set for little-endian bytes. In the newer encodings doubles begin at multiples of four.
PLAIN = b'\0\1'
# Mask of the last two bits of the encapsulation. These bits hold the number of padding bytes at
# the end of the message. Serializers leave these bits 0; only newer deserializers, since ROS
# Kilted, read the bits.
PADDING = 3
ENCAPSULATION_SAYS = bytes((255, 255, 0, PADDING))
OLD_ENCODINGS, NEW_ENCODINGS = (0, 1, 2, 3), (6, 7, 8, 9, 10, 11)
# Sizes of a uint32 and of a double, bytes.
WHOLE = 4
DOUBLE = 8
LITTLE, BIG = struct.Struct('<I'), struct.Struct('>I')
# Format of a stamp: seconds (signed), nanoseconds (unsigned).
STAMP = struct.Struct('<iI')
SECOND = 1_000_000_000  # one second, ns
STAMP_AT = BODY


class CdrWriter:
    """
    Writes one message field by field. Numbers can be filled in later at the returned offsets.

    Attributes
    ----------
    data
        The bytes written so far.
    written
        A mask for each byte: 255 if its bits have a meaning, 0 for a byte skipped for alignment.
    """

    def __init__(self) -> None:
        self.data = bytearray(PLAIN + bytes(BODY - len(PLAIN)))
        self.written = bytearray(ENCAPSULATION_SAYS)

    def room(self, size: int, count: int = 1) -> int:
        """
        Append aligned space for `count` numbers of `size` bytes; return the offset of the first
        number.
        """
        skipped = -(len(self.data) - BODY) % size if count else 0
        self.data += bytes(skipped + count * size)
        self.written += bytes(skipped) + b'\xff' * (count * size)
        return len(self.data) - count * size

    def whole(self, number: int) -> None:
        """Write `number` as an aligned uint32."""
        at = self.room(WHOLE)
        LITTLE.pack_into(self.data, at, number)

    def text(self, text: str) -> None:
        """Write a text as its length, its bytes and a final zero."""
        encoded = text.encode() + b'\0'
        self.whole(len(encoded))
        at = self.room(1, len(encoded))
        self.data[at:] = encoded


class CdrReader:
    """
    Finds the byte ranges of the fields of a CDR message, in either byte order.

    Parameters
    ----------
    data
        The message.

    Attributes
    ----------
    is_plain
        Whether the message is little-endian, with doubles at multiples of eight, and without
        padding at its end.
    shape
        Byte ranges of the lengths and texts read so far. Messages that are equal in these bytes
        have their numbers at equal offsets.

    Raises
    ------
    CdrError
        The encapsulation is not that of CDR, or a field goes beyond the end of the message.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < BODY or data[0] != 0:
            raise CdrError('the first bytes are not an encapsulation of CDR', code='encapsulation')
        encoding = data[1]
        if encoding not in OLD_ENCODINGS and encoding not in NEW_ENCODINGS:
            raise CdrError(f'encoding {encoding} is unknown', code='encoding')
        self.is_plain = data[: len(PLAIN)] == PLAIN and not data[BODY - 1] & PADDING
        self.shape: list[slice] = []
        self._data, self._at = data, BODY
        self._unpack_from = (LITTLE if encoding % 2 else BIG).unpack_from
        self._aligned = (WHOLE, DOUBLE if encoding in OLD_ENCODINGS else WHOLE)

    @property
    def is_at_end(self) -> bool:
        """Return whether all bytes of the message have been read."""
        return self._at == len(self._data)

    def skip(self, size: int) -> slice:
        """Return the byte range of the next `size` bytes, and continue reading behind it."""
        at = self._at
        self._at += size
        if self._at > len(self._data):
            raise CdrError('a field is longer than the message', code='too-short')
        return slice(at, self._at)

    def _length(self) -> int:
        self.skip(-(self._at - BODY) % self._aligned[0])
        place = self.skip(WHOLE)
        self.shape.append(place)
        (length,) = self._unpack_from(self._data, place.start)
        return int(length)

    def text(self) -> slice:
        """Return the byte range of the next text, including the zero at its end."""
        place = self.skip(self._length())
        self.shape.append(place)
        return place

    def count(self) -> int:
        """
        Read the length of a sequence and return it; raise CdrError if it exceeds the remaining
        bytes.
        """
        count = self._length()
        if self._at + count > len(self._data):
            raise CdrError('a sequence is longer than the message', code='too-short')
        return count

    def doubles(self, count: int) -> slice:
        """Return the byte range of the next `count` doubles, and continue reading behind it."""
        if count:
            self.skip(-(self._at - BODY) % self._aligned[1])
        return self.skip(DOUBLE * count)


class Ros1Reader(CdrReader):
    """
    Finds the byte ranges of the fields of a serialized ROS 1 message.

    The message begins with its sequence number (4 bytes), where CDR has the encapsulation. Fields
    are not aligned, and texts do not end with a zero.
    """

    def __init__(self, data: bytes) -> None:
        self.is_plain, self.shape = True, []
        self._data, self._at = data, 0
        self._unpack_from = LITTLE.unpack_from
        self._aligned = 1, 1
        self.skip(BODY)
