"""
Find the form of serialized JointState messages: the offsets of their numbers.

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


@dataclass(frozen=True, eq=False)  # arrays have no single truth value
class JointStateForm:
    """
    The form of messages in plain CDR with equal names, frame and lengths.

    Attributes
    ----------
    names
        Joint names.
    size
        Bytes of a message.
    positions, velocities, efforts
        Byte ranges of these numbers, which are doubles of this machine. The stamp is at
        `cdr.STAMP_AT`.
    fixed : shape (size,)
        Mask of the bits that are equal in all messages: 255 for a fixed byte, 0 for other bytes.
    same : shape (size,)
        The values of the fixed bits; 0 for other bits.
    """

    names: tuple[str, ...]
    size: int
    positions: slice
    velocities: slice
    efforts: slice
    fixed: Bytes
    same: Bytes

    @property
    def counts(self) -> tuple[int, int]:
        """Return the numbers of positions and velocities."""
        positions, velocities = (
            (one.stop - one.start) // DOUBLE for one in (self.positions, self.velocities)
        )
        return positions, velocities

    def fits(self, data: bytes) -> bool:
        """Return whether a message is of this form."""
        return len(data) == self.size and np.array_equal(
            np.frombuffer(data, np.uint8) & self.fixed, self.same
        )

    def for_joints(self, ours: OurJoints) -> IncomingForm:
        """Return the kernel's form of these messages; `ours` are the arm's joints in them."""
        return IncomingForm(self.fixed, self.same, STAMP_AT, self.positions, self.velocities, ours)


def doubles_of(data: bytes) -> Floats:
    """Return bytes as doubles in the byte order of this machine; read-only."""
    return np.frombuffer(data, np.float64) if data else _EMPTY


class SerializedSample(NamedTuple):
    """
    A serialized JointState message, with the form that it is expected to have.

    Attributes
    ----------
    form, data
        The form, and the bytes.
    arrival : ns
        Time of receipt, steady clock.
    """

    form: JointStateForm
    data: bytes
    arrival: int

    @property
    def names(self) -> tuple[str, ...]:
        """Return the joint names."""
        return self.form.names

    @property
    def time(self) -> int:
        """Return the stamp, ns."""
        seconds, nanoseconds = STAMP.unpack_from(self.data, STAMP_AT)
        return seconds * SECOND + nanoseconds  # type: ignore[no-any-return]

    @property
    def efforts(self) -> Floats:
        """Return the joint efforts, N m or N; read-only."""
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
    Return the byte ranges of the fields of a JointState, in the encoding of the reader.

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
    Return the form of a message; `ros1` for a message of ROS 1.

    Returns None if the message is not a whole JointState in plain CDR, if a text has a zero
    elsewhere than at its end, or on a big-endian machine. Such messages need the general reader.
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
    # Returns a text without its final zero. Other texts are refused, because readers of ROS treat
    # a text without a final zero, or with a zero inside, differently.
    if data.find(0) != len(data) - 1:
        raise CdrError('a text that does not end with its only zero')
    return data[:-1].decode()
