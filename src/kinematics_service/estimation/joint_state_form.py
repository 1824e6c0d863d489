"""
The form of a stream of serialized JointState messages: the offsets of its numbers.

A driver sends the same names in every message, so its messages differ only in their stamp, their
numbers, and the bytes without a meaning.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import CdrError
from ..kernel import Bytes, Floats, IncomingForm, OurJoints
from .cdr import (
    DOUBLE,
    ENCAPSULATION_SAYS,
    SECOND,
    STAMP,
    STAMP_AT,
    CdrReader,
    Ros1Reader,
)

_EMPTY = np.empty(0)
_EMPTY.setflags(write=False)


@dataclass(frozen=True, eq=False)  # arrays have no single truth value
class JointStateForm:
    """
    Messages in plain CDR with the same names, frame and lengths.

    Attributes
    ----------
    names
        Joint names.
    size
        Bytes of a message.
    positions, velocities, efforts
        Where they are, doubles as in this machine's memory; the stamp is at `cdr.STAMP_AT`.
    fixed : shape (size,)
        The bits that are the same in all of them: 255 for a byte of these, 0 for another.
    same : shape (size,)
        These bytes; 0 elsewhere.
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
        """Return how many positions and velocities there are."""
        positions, velocities = self.positions, self.velocities
        return (
            (positions.stop - positions.start) // DOUBLE,
            (velocities.stop - velocities.start) // DOUBLE,
        )

    def fits(self, data: bytes) -> bool:
        """Return whether a message is of this form."""
        return len(data) == self.size and np.array_equal(
            np.frombuffer(data, np.uint8) & self.fixed, self.same
        )

    def for_joints(self, ours: OurJoints) -> IncomingForm:
        """Return the form as the kernel takes it, for messages with these joints of the arm."""
        return IncomingForm(self.fixed, self.same, STAMP_AT, self.positions, self.velocities, ours)


def doubles_of(data: bytes) -> Floats:
    """Return bytes as doubles of this machine's memory; read-only."""
    return np.frombuffer(data, np.float64) if data else _EMPTY


class SerializedSample(NamedTuple):
    """
    A serialized JointState that is expected to be of a form, with the names of that form.

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
    """Where the fields of a serialized JointState are."""

    frame: slice
    names: tuple[slice, ...]
    positions: slice
    velocities: slice
    efforts: slice


def fields_of(reader: CdrReader) -> JointStateFields:
    """
    Return where the fields of a JointState are, in any encoding.

    Raises
    ------
    CdrError
        The bytes are no message of this type.
    """
    reader.skip(STAMP.size)
    frame = reader.text()
    names = tuple(reader.text() for _ in range(reader.count()))
    positions = reader.doubles(reader.count())
    velocities = reader.doubles(reader.count())
    efforts = reader.doubles(reader.count())
    return JointStateFields(frame, names, positions, velocities, efforts)


def form_of(data: bytes) -> JointStateForm | None:
    """
    Return the form of a message.

    None if it is no whole JointState in plain CDR, if its texts are not plain, or on a machine
    with another order of bytes: such messages need the reader of all messages.
    """
    try:
        reader = CdrReader(data)
        if not reader.is_plain:
            return None
        return _form(data, reader, ENCAPSULATION_SAYS, _plain_text)
    except (CdrError, UnicodeDecodeError):
        return None


def ros1_form_of(data: bytes) -> JointStateForm | None:
    """Return the same as `form_of`, for a message of ROS 1."""
    try:
        reader = Ros1Reader(data)
        form = _form(data, reader, b'', bytes.decode)
        return form if reader.is_at_end else None
    except (CdrError, UnicodeDecodeError):
        return None


def _form(
    data: bytes, reader: CdrReader, head: bytes, text_of: Callable[[bytes], str]
) -> JointStateForm | None:
    if sys.byteorder != 'little':
        return None
    fields = fields_of(reader)
    _, *names = (text_of(data[place]) for place in (fields.frame, *fields.names))
    fixed = np.zeros(len(data), np.uint8)
    fixed[: len(head)] = tuple(head)
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
    # Readers treat a text without its zero, and one with zeros within, differently.
    if data.find(0) != len(data) - 1:
        raise CdrError('a text that does not end with its only zero')
    return data[:-1].decode()
