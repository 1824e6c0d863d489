"""
Whether bytes can be a message at all: their encapsulation and their lengths.

The official deserializer writes to standard error whenever it refuses, and nobody can stop it; so
bytes that it would refuse are not given to it. What passes here is still read by it.
"""

import struct
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from ..errors import KinematicsError

# The second byte of the four before the body names the encoding, and its lowest bit the order of
# bytes. Doubles begin at multiples of eight bytes of the body, in newer encodings of four.
OLD_ENCODINGS, NEW_ENCODINGS = (0, 1, 2, 3), (6, 7, 8, 9, 10, 11)
BODY = 4
LITTLE, BIG = struct.Struct('<I'), struct.Struct('>I')
DOUBLE = 8

# What follows the stamp and the frame of a header: texts, sequences of doubles, doubles in a row.
TEXTS, DOUBLES = 'texts', 'doubles'
Field = str | int
FIELDS: dict[Any, tuple[Field, ...]] = {
    JointState: (TEXTS, DOUBLES, DOUBLES, DOUBLES),
    PoseStamped: (7,),
    TwistStamped: (6,),
}


class WireError(KinematicsError, ValueError):
    """
    Bytes that are no message of their type: the official deserializer refuses them too.

    """


def read_message(data: bytes, kind: Any) -> Any:
    """
    Return the message that bytes are, one of `FIELDS`.

    Raises
    ------
    WireError
        The bytes are none.

    """
    if is_whole(data, kind):
        try:
            return deserialize_message(data, kind)
        except Exception:  # whatever it raises, a message it is not
            pass
    raise WireError(f'{len(data)} bytes that are no {kind.__name__}')


def is_whole(data: bytes, kind: Any) -> bool:
    """
    Return whether the lengths in a serialized message fit into its bytes.

    """
    if len(data) < BODY or data[0] != 0:
        return False
    encoding = data[1]
    if encoding not in OLD_ENCODINGS and encoding not in NEW_ENCODINGS:
        return False
    body = _Body(
        data,
        LITTLE if encoding % 2 else BIG,
        DOUBLE if encoding in OLD_ENCODINGS else DOUBLE // 2,
    )
    try:
        body.skip(8)  # seconds and nanoseconds
        body.text()
        for field in FIELDS[kind]:
            if field == TEXTS:
                for _ in range(body.count()):
                    body.text()
            else:
                body.doubles(body.count() if field == DOUBLES else int(field))
    except (struct.error, IndexError):
        return False
    return True


class _Body:
    # A place in a message, moved on field by field; IndexError or struct.error beyond its end.

    def __init__(self, data: bytes, order: struct.Struct, alignment: int) -> None:
        self._data, self._end, self._at = data, len(data), BODY
        self._read, self._alignment = order.unpack_from, alignment

    def skip(self, size: int) -> None:
        self._at += size
        if self._at > self._end:
            raise IndexError

    def _length(self) -> int:
        at = self._at + -self._at % 4
        self._at = at + 4
        (length,) = self._read(self._data, at)
        return int(length)

    def text(self) -> None:
        self.skip(self._length())

    def count(self) -> int:
        # Of a sequence: refused where there are fewer bytes left than it has members.
        count = self._length()
        if self._at + count > self._end:
            raise IndexError
        return count

    def doubles(self, count: int) -> None:
        if count:
            self.skip((BODY - self._at) % self._alignment + DOUBLE * count)
