"""
Messages as bytes, made by patching numbers into a serialized template.

Nothing about the wire format is written here. What a message looks like is found by serializing it
with different numbers and looking where they went; what was found must pass a round trip through
the official serializer and deserializer, or the template is not used.
"""

import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

from ..kernel import LARGEST_SECOND, Floats
from .messages import SECOND

Make = Callable[[int, Floats], Any]

# Stamps, ns, whose seconds and nanoseconds share no bytes with each other or with small numbers.
MARKED_STAMPS = (
    0x1A2B3C4D * SECOND + 0x1F2E3D4C,
    0x5E6F7A0B * SECOND + 0x2C0D4B5A,
)
# Stamps for the check: none, before the epoch, the last, and beyond what a message can hold.
CHECKED_STAMPS = (
    0,
    -1,
    1_732_000_000_123_456_789,
    LARGEST_SECOND * SECOND + SECOND - 1,
    (LARGEST_SECOND + 7) * SECOND + 5,
    -(LARGEST_SECOND + 7) * SECOND + 5,
)
# The numbers that a conversion on the way would change: signed zero, the smallest and largest
# doubles, infinities, and a NaN with a payload.
HARD_NUMBERS = (
    -0.0,
    5e-324,
    -2.2250738585072014e-308,
    1.7976931348623157e308,
    float('inf'),
    -float('inf'),
    float('nan'),
    struct.unpack('=d', struct.pack('=Q', 0x7FF8_0000_DEAD_BEEF))[0],
    1 / 3,
)

STAMP = struct.Struct('=iI')


def only_place(data: bytes, pattern: bytes) -> int | None:
    """
    Return where a pattern begins, None where it is not there or there more than once.

    """
    place = data.find(pattern)
    return place if place >= 0 and data.find(pattern, place + 1) < 0 else None


def stamp_bytes(stamp: int) -> bytes:
    """
    Return a stamp in ns as seconds and nanoseconds, as they stand in this machine's memory.

    """
    seconds, nanoseconds = divmod(stamp, SECOND)
    return STAMP.pack(seconds, nanoseconds)


class Template:
    """
    One serialized message, whose numbers and stamp are overwritten for each message.

    Everything else in it (frames, labels, lengths) stays as it was when the template was learned.
    It has one buffer, so it is not for several threads.

    Attributes
    ----------
    data
        The message it was learned from.
    place, stamp_place
        Where in the bytes the numbers and the stamp begin; None for a message without a stamp.
    stamped
        Whether the message carries a stamp.

    """

    def __init__(
        self, data: bytes, shape: int | tuple[int, ...], place: int, stamp_place: int | None
    ) -> None:
        self.data, self.place, self.stamp_place = data, place, stamp_place
        self.stamped = stamp_place is not None
        self._buffer = bytearray(data)
        count = int(np.prod(shape))
        self._numbers = np.frombuffer(self._buffer, np.float64, count, place).reshape(shape)

    @classmethod
    def learn(cls, make: Make, shape: int | tuple[int, ...]) -> 'Template | None':
        """
        Return the template of a message; None where it cannot be one: build messages then.

        Parameters
        ----------
        make
            Returns the message for a stamp in ns and an array of numbers, which must stand in the
            message as doubles in the array's order, with nothing between them. The stamp is free
            to be ignored.
        shape
            Of the array of numbers; a plain count for a vector.

        """
        random = np.random.default_rng(20)
        found = []
        for stamp in MARKED_STAMPS:
            numbers = random.normal(size=shape)
            data = serialize_message(make(stamp, numbers))
            place = only_place(data, numbers.tobytes())
            found.append((len(data), place, only_place(data, stamp_bytes(stamp))))
        _, place, stamp_place = found[0]
        if place is None or found[0] != found[1]:
            return None
        template = cls(data, shape, place, stamp_place)
        return template if template._agrees_with(make) else None

    def _agrees_with(self, make: Make) -> bool:
        # The same bits where the numbers are, and the same message around them. Whole messages
        # cannot be compared as bytes: serializers leave those between fields to chance.
        for k in range(len(HARD_NUMBERS)):
            stamp = CHECKED_STAMPS[k % len(CHECKED_STAMPS)]
            numbers = np.resize(np.roll(HARD_NUMBERS, k), self._numbers.shape)
            official = make(stamp, numbers)
            kind = type(official)
            expected, data = serialize_message(official), self.message(stamp, numbers)
            if len(data) != len(expected):
                return False
            if any(data[part] != expected[part] for part in self._parts()):
                return False
            if repr(deserialize_message(data, kind)) != repr(deserialize_message(expected, kind)):
                return False
        return True

    def _parts(self) -> tuple[slice, ...]:
        numbers = slice(self.place, self.place + self._numbers.nbytes)
        if self.stamp_place is None:
            return (numbers,)
        return (numbers, slice(self.stamp_place, self.stamp_place + STAMP.size))

    def message(self, stamp: int, numbers: Floats) -> bytes:
        """
        Return the message for a stamp and numbers, ready to be published.

        Parameters
        ----------
        stamp : ns
            Beyond what a message can hold, the nearest it can; ignored where there is none.
        numbers
            Of the shape that was learned.

        """
        self._numbers[...] = numbers
        if self.stamp_place is not None:
            seconds, nanoseconds = divmod(stamp, SECOND)
            if not -LARGEST_SECOND <= seconds <= LARGEST_SECOND:
                seconds = max(-LARGEST_SECOND - 1, min(LARGEST_SECOND, seconds))
            STAMP.pack_into(self._buffer, self.stamp_place, seconds, nanoseconds)
        return bytes(self._buffer)
