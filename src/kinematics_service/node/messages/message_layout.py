# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Fill a message with a stamp and numbers, as Python object or as CDR bytes. The message's texts are
constant.

Both forms are filled from one array of numbers, in the order of the fields in the message type.
"""

import struct
from array import array
from itertools import islice
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message, serialize_message

from ... import kernel
from ...estimation.cdr import DOUBLE, SECOND, WHOLE, CdrWriter
from ...kernel import LARGEST_SECOND, Bytes, Floats, OutgoingMessages, OutgoingTable
from .messages import set_time

# Stamps (ns) with which a message layout is checked: a usual stamp, one before the epoch, and two
# out of the range of a message. These stamps detect a wrong offset or a missing limit of the
# range.
STAMPS = (
    1_732_000_000_123_456_789,
    -1,
    (LARGEST_SECOND + 7) * SECOND + 5,
    -(LARGEST_SECOND + 7) * SECOND + 5,
)
# Numbers with which a message layout is checked, because a conversion to another type would change
# them: negative zero, the smallest and largest doubles, infinities, and a NaN with a payload.
NUMBERS = (
    *(-0.0, 5e-324, -2.2250738585072014e-308, 1.7976931348623157e308),
    *(float('inf'), -float('inf'), float('nan'), 1 / 3),
    struct.unpack('=d', struct.pack('=Q', 0x7FF8_0000_DEAD_BEEF))[0],
)
_NONE = np.empty(0)


class MessageLayout:
    """
    The positions of stamp and numbers in a message: in the Python object, and in the CDR bytes.

    A layout has one message object and one buffer of bytes. Each new message overwrites the object
    or the buffer, so only one thread may use the layout.

    Parameters
    ----------
    template
        The message. Its stamp and numbers are replaced; its texts and lengths stay.

    Attributes
    ----------
    data
        The bytes of the message, with zeros for stamp and numbers.
    written
        For each byte of `data`, 255 if the byte has a meaning, 0 for padding.
    count
        The number of doubles in the message, which are adjacent.
    number_at, stamp_at
        Offsets of the numbers and of the stamp in the bytes; None for a message without a stamp.
    """

    def __init__(self, template: Any) -> None:
        self._template = template
        self._time: Time | None = None
        # for each field of doubles: the message that has the field, the name of the field, and the
        # number of doubles (None for a single double)
        self._fields: list[tuple[Any, str, int | None]] = []
        # becomes False for an unknown field type, or for numbers that are not adjacent
        self._is_known = True
        self.count, self.number_at = 0, 0
        self.stamp_at: int | None = None
        writer = CdrWriter()
        self._write(writer, template)
        self.data, self.written = bytes(writer.data), bytes(writer.written)
        self._buffer: Bytes = np.frombuffer(writer.data, np.uint8)
        self._filled = OutgoingMessages(
            OutgoingTable(self._buffer, *self.offsets(0), np.arange(self.count))
        )

    def offsets(self, begin: int) -> tuple[Any, Any]:
        """
        Return the offsets of the stamp and of each number in a buffer in which the message begins
        at the offset `begin`.
        """
        stamps = [] if self.stamp_at is None else [begin + self.stamp_at]
        numbers = begin + self.number_at + DOUBLE * np.arange(self.count, dtype=np.int64)
        return np.array(stamps, dtype=np.int64), numbers

    def _write(self, writer: CdrWriter, message: Any) -> None:
        if isinstance(message, Time):
            self._time, self.stamp_at = message, writer.room(WHOLE, 2)
            return
        for name, kind in message.get_fields_and_field_types().items():
            value = getattr(message, name)
            if kind in ('double', 'sequence<double>') or kind.startswith('double['):
                self._write_doubles(writer, message, name, value)
            elif kind.startswith('sequence<') and '/' in kind:
                writer.whole(len(value))
                for item in value:
                    self._write(writer, item)
            elif kind == 'string':
                writer.text(value)
            elif kind == 'uint32':
                writer.whole(value)
            elif '/' in kind and '[' not in kind:
                self._write(writer, value)
            else:
                self._is_known = False

    def _write_doubles(self, writer: CdrWriter, owner: Any, name: str, value: Any) -> None:
        many = None if isinstance(value, float) else len(value)
        # Write a length only for sequences. Arrays of constant length, which are ndarrays, have no
        # length in the bytes.
        if isinstance(value, array):
            writer.whole(len(value))
        count = 1 if many is None else many
        at = writer.room(DOUBLE, count)
        if not self.count:
            self.number_at = at
        elif at != self.number_at + DOUBLE * self.count:
            self._is_known = False
        self.count += count
        self._fields.append((owner, name, many))

    def message(self, stamp: int, numbers: Floats) -> Any:
        """
        Return the message object with this stamp (ns) and these numbers; the next call overwrites
        it.
        """
        if self._time is not None:
            set_time(self._time, stamp)
        values = iter(numbers.tolist())
        for owner, name, many in self._fields:
            value = next(values) if many is None else array('d', islice(values, many))
            if isinstance(getattr(owner, name), np.ndarray):
                value = np.array(value)
            setattr(owner, name, value)
        return self._template

    def bytes_of(self, stamp: int, numbers: Floats) -> bytes:
        """Return the message with this stamp (ns) and these numbers as bytes."""
        kernel.fill_messages(self._filled, stamp, numbers, _NONE)
        return self._buffer.tobytes()

    def is_official(self) -> bool:
        """
        Return whether ROS's serializer writes the bytes of this layout, and its deserializer reads
        them.
        """
        if not self._is_known:
            return False
        kind = type(self._template)
        for k, stamp in enumerate(STAMPS):
            numbers = np.resize(np.roll(NUMBERS, k), self.count)
            official = serialize_message(self.message(stamp, numbers))
            ours = self.bytes_of(stamp, numbers)
            # Compare the bytes before the deserializer reads them, because the deserializer logs
            # errors about wrong bytes.
            if not self._has_same_fields(ours, official):
                return False
            if not self._has_same_fields(ours, serialize_message(deserialize_message(ours, kind))):
                return False
        return True

    def _has_same_fields(self, first: bytes, second: bytes) -> bool:
        if len(first) != len(second):
            return False
        written_bits = np.frombuffer(self.written, np.uint8)
        differing = np.frombuffer(first, np.uint8) ^ np.frombuffer(second, np.uint8)
        return not np.any(differing & written_bits)
