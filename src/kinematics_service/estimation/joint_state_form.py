# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the form of serialized JointState messages: joint names and byte offsets of the numbers.

A driver sends the same names in every message. So the messages of a driver differ only in stamps,
numbers and bytes without a meaning.
"""

import sys
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import CdrError
from ..kernel import Bytes, Floats, IncomingForm, OurJoints
from .cdr import DOUBLE, ENCAPSULATION_SAYS, SECOND, STAMP, STAMP_AT, CdrReader, Ros1Reader

_EMPTY = np.empty(0)
_EMPTY.setflags(write=False)


@dataclass(frozen=True, eq=False)  # eq=False: comparing arrays with == gives no single truth value
class JointStateForm:
    """
    The byte layout of JointState messages in plain CDR.

    Messages with equal joint names, frame id and array lengths have one layout.

    Attributes
    ----------
    names
        Joint names.
    size
        Bytes of a message.
    positions, velocities, efforts
        Byte ranges of the positions, velocities and efforts, doubles in the byte order of this
        machine. The stamp is at `cdr.STAMP_AT`.
    fixed : shape (size,)
        Bit mask for each byte: bits that are equal in all messages are 1. A fixed byte has 255.
    same : shape (size,)
        The values of the fixed bits. Other bits are 0.
    """

    names: tuple[str, ...]
    size: int
    positions: slice
    velocities: slice
    efforts: slice
    fixed: Bytes
    same: Bytes

    @property
    def position_count(self) -> int:
        """Return how many positions a message has."""
        return int(self.positions.stop - self.positions.start) // DOUBLE

    def fits(self, data: bytes) -> bool:
        """Return whether a message has this form."""
        return len(data) == self.size and np.array_equal(
            np.frombuffer(data, np.uint8) & self.fixed, self.same
        )

    def for_joints(self, ours: OurJoints) -> IncomingForm:
        """
        Return the byte layout of messages of this form, as the kernel's reader needs it. `ours`
        are the indices of the arm's joints in the messages.
        """
        return IncomingForm(self.fixed, self.same, STAMP_AT, self.positions, self.velocities, ours)


def doubles_of(data: bytes) -> Floats:
    """Return bytes as a read-only array of float64, in the byte order of this machine."""
    return np.frombuffer(data, np.float64) if data else _EMPTY


class SerializedSample(NamedTuple):
    """
    A serialized JointState message, and the form that the reader expects it to have.

    Attributes
    ----------
    form, data
        The expected form, and the bytes of the message.
    arrival : ns
        Time of receipt, steady clock.
    """

    form: JointStateForm
    data: bytes
    arrival: int

    @property
    def names(self) -> tuple[str, ...]:
        """Return the joint names of the message."""
        return self.form.names

    @property
    def time(self) -> int:
        """Return the stamp of the message, ns."""
        seconds, nanoseconds = STAMP.unpack_from(self.data, STAMP_AT)
        return seconds * SECOND + nanoseconds  # type: ignore[no-any-return]

    @property
    def efforts(self) -> Floats:
        """Return the joint efforts of the message, N m or N, as a read-only array."""
        return doubles_of(self.data[self.form.efforts])


class JointStateFields(NamedTuple):
    """Byte ranges of the fields of a serialized JointState."""

    frame: slice
    names: tuple[slice, ...]
    positions: slice
    velocities: slice
    efforts: slice


def fields_of(reader: CdrReader) -> JointStateFields:
    """
    Return the byte ranges of the fields of a JointState message that `reader` reads.

    Raises
    ------
    CdrError
        The bytes are not a JointState.
    """
    reader.skip(STAMP.size)
    frame = reader.text()
    names = tuple(reader.text() for _ in range(reader.count()))
    positions = reader.doubles(reader.count())
    velocities = reader.doubles(reader.count())
    efforts = reader.doubles(reader.count())
    return JointStateFields(frame, names, positions, velocities, efforts)


def form_of(data: bytes, ros1: bool = False) -> JointStateForm | None:
    """
    Return the form of a serialized JointState message; `ros1` is True for a message of ROS 1.

    Returns None if the message is not a whole JointState in plain CDR, if a text has a zero
    elsewhere than at its end, or on a big-endian machine. The caller must then decode the message
    by another reader.
    """
    try:
        reader = Ros1Reader(data) if ros1 else CdrReader(data)
        if not reader.is_plain or sys.byteorder != 'little':
            return None
        fields, text_of = fields_of(reader), bytes.decode if ros1 else _plain_text
        _, *names = (text_of(data[place]) for place in (fields.frame, *fields.names))
    except (CdrError, UnicodeDecodeError):
        return None
    if ros1 and not reader.is_at_end:
        return None
    fixed = np.zeros(len(data), np.uint8)
    if not ros1:
        fixed[: len(ENCAPSULATION_SAYS)] = tuple(ENCAPSULATION_SAYS)
    for place in reader.shape:
        fixed[place] = 255
    return JointStateForm(
        names=tuple(names),
        size=len(data),
        positions=fields.positions,
        velocities=fields.velocities,
        efforts=fields.efforts,
        fixed=fixed,
        same=np.frombuffer(data, np.uint8) & fixed,
    )


def _plain_text(data: bytes) -> str:
    # Returns a text without its final zero byte. Refuses a text without a final zero, or with a
    # zero inside, because ROS readers disagree about such texts.
    if data.find(0) != len(data) - 1:
        raise CdrError('a text does not end with its only zero', code='text')
    return data[:-1].decode()
