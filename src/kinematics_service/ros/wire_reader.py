"""
JointState messages read straight from their bytes, where that is proven to read the same.

Nothing about the wire format is written here. The layout of a stream of messages is learned from
one that the official deserializer has read; while everything but the numbers stays byte for byte
the same, the numbers are read from where they stand. Any other message is read officially.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from ..kernel import Floats
from ..wire_form import WireForm
from .messages import SECOND, stamp_of
from .wire_check import WireError, read_message
from .wire_template import HARD_NUMBERS, STAMP, only_place

# Layouts known at a time: a few drivers on one topic. Larger messages are not learned.
MOST_LAYOUTS = 8
LARGEST_LEARNED = 1 << 16
# To learn costs as much as reading some ten messages officially. So that a stream of ever new
# layouts cannot make every message cost that, it is done so often, then once in so many messages.
CREDIT = 16.0
CREDIT_A_MESSAGE = 1 / 64
# What a byte is filled with to see that nobody reads it: length or text, it would be read then.
FILLINGS = (0x00, 0x01, 0x41, 0x42, 0x7F, 0x80, 0xFF)
MARKED_STAMP = 0x1A2B3C4D * SECOND + 0x1F2E3D4C

EMPTY = np.empty(0)
EMPTY.setflags(write=False)
Bytes = NDArray[np.uint8]


class WireJointState(NamedTuple):
    """
    What a JointState says, without its header's text and its efforts.

    Attributes
    ----------
    names
        Joint names; while a layout is known, the very same tuple for each of its messages.
    positions, velocities : rad or m, rad/s or m/s
        As in the message: of any length, with any number in them; read-only.
    stamp : ns
        0 where the message has none.

    """

    names: tuple[str, ...]
    positions: Floats
    velocities: Floats
    stamp: int


@dataclass(frozen=True, eq=False)  # arrays have no truth of equality
class _Layout:
    # Messages that differ in nothing but their numbers and the bytes nobody reads.
    shape: tuple[Any, ...]  # of `_shape_of`: text and lengths
    names: tuple[str, ...]
    size: int
    places: tuple[slice, ...]  # of stamp, positions, velocities, efforts
    fixed: Bytes  # 255 for a byte that must be as it was, 0 for another
    same: Bytes  # what stands there; 0 elsewhere
    sample: bytes  # one such message
    stamp: struct.Struct
    form: WireForm | None  # where there are as many positions as names

    @classmethod
    def of(
        cls,
        message: Any,
        names: tuple[str, ...],
        data: bytes,
        places: tuple[slice, ...],
        fixed: Bytes,
    ) -> '_Layout':
        same = np.frombuffer(data, np.uint8) & fixed
        stamp, positions, velocities, _ = places
        form = None
        if len(message.position) == len(names):
            form = WireForm(
                names=names,
                size=len(data),
                stamp=stamp.start,
                positions=positions.start,
                velocities=velocities.start,
                velocity_count=len(message.velocity),
                pattern=np.concatenate([fixed, same]),
            )
        return cls(
            shape=_shape_of(message),
            names=names,
            size=len(data),
            places=places,
            fixed=fixed,
            same=same,
            sample=data,
            stamp=struct.Struct(f'={places[0].start}x{STAMP.format[1:]}'),
            form=form,
        )


def _shape_of(message: Any) -> tuple[Any, ...]:
    lengths = (len(message.position), len(message.velocity), len(message.effort))
    return (message.header.frame_id, tuple(message.name), *lengths)


def _numbers_of(message: Any) -> tuple[bytes, ...]:
    # As bytes: a NaN must keep its bits, and nanoseconds may be more than a second.
    stamp = STAMP.pack(message.header.stamp.sec, message.header.stamp.nanosec)
    arrays = (message.position, message.velocity, message.effort)
    return (stamp, *(numbers.tobytes() for numbers in arrays))


def _doubles(data: bytes) -> Floats:
    return np.frombuffer(data, np.float64) if data else EMPTY


class JointStateReader:
    """
    Reads JointState messages from their bytes, as the official deserializer would, only faster.

    What it holds does not grow with time.
    """

    def __init__(self) -> None:
        self._layouts: list[_Layout] = []  # the one heard last first
        self._credit = CREDIT
        self._random = np.random.default_rng(21)

    def read(self, data: bytes) -> WireJointState:
        """
        Return what a serialized JointState says.

        Raises
        ------
        WireError
            The official deserializer refuses the bytes.

        """
        size = len(data)
        for age, layout in enumerate(self._layouts):
            if layout.size != size:
                continue
            if np.array_equal(np.frombuffer(data, np.uint8) & layout.fixed, layout.same):
                if age:
                    self._layouts.insert(0, self._layouts.pop(age))
                _, positions, velocities, _ = layout.places
                seconds, nanoseconds = layout.stamp.unpack_from(data)
                return WireJointState(
                    layout.names,
                    _doubles(data[positions]),
                    _doubles(data[velocities]),
                    seconds * SECOND + nanoseconds,
                )
        return self._read_officially(data)

    def forms(self, size: int) -> Iterator[WireForm]:
        """
        Yield the forms known of messages of so many bytes, the one heard last first.

        """
        for layout in self._layouts:
            if layout.size == size and layout.form is not None:
                yield layout.form

    def _read_officially(self, data: bytes) -> WireJointState:
        message = read_message(data, JointState)
        names = tuple(message.name)
        names = next((layout.names for layout in self._layouts if layout.names == names), names)
        self._credit = min(self._credit + CREDIT_A_MESSAGE, CREDIT)
        if self._credit >= 1.0 and len(data) <= LARGEST_LEARNED:
            self._credit -= 1.0
            self._learn(message, names, data)
        return WireJointState(
            names,
            _doubles(message.position.tobytes()),
            _doubles(message.velocity.tobytes()),
            stamp_of(message),
        )

    def _learn(self, message: Any, names: tuple[str, ...], data: bytes) -> None:
        # Serializers leave the bytes between fields to chance. A byte that differs in a message
        # which says the same is believed to be one of them if the official deserializer agrees
        # whatever stands there; the text of another name may look the same by accident.
        shape, heard = _shape_of(message), np.frombuffer(data, np.uint8)
        for layout in self._layouts:
            if layout.size == len(data) and layout.shape == shape:
                same = heard == np.frombuffer(layout.sample, np.uint8)
                fixed = np.where(same, layout.fixed, np.uint8(0))
                if self._holds(data, layout.places, fixed, message):
                    self._layouts.remove(layout)
                    self._add(_Layout.of(message, names, data, layout.places, fixed))
                    return
        places = _places(message)
        if places is None or tuple(data[place] for place in places) != _numbers_of(message):
            return
        fixed = np.full(len(data), 255, np.uint8)
        for place in places:
            fixed[place] = 0
        if self._holds(data, places, fixed, message):
            self._add(_Layout.of(message, names, data, places, fixed))

    def _add(self, layout: _Layout) -> None:
        self._layouts = [layout, *self._layouts][:MOST_LAYOUTS]

    def _holds(self, data: bytes, places: Sequence[slice], fixed: Bytes, message: Any) -> bool:
        # Whether the official deserializer finds the same text and lengths, and the numbers at
        # their places, whatever they are and whatever stands in the bytes nobody reads.
        shape = _shape_of(message)
        free = fixed == 0
        for k, filling in enumerate((*FILLINGS, None)):
            heard = np.frombuffer(data, np.uint8).copy()
            heard[free] = (
                self._random.integers(0, 256, int(free.sum()), np.uint8)
                if filling is None
                else filling
            )
            hard = np.roll(HARD_NUMBERS, k)
            for place in places[1:]:
                if k % 2 == 0:  # otherwise as filled
                    count = (place.stop - place.start) // hard.itemsize
                    heard[place] = np.frombuffer(np.resize(hard, count).tobytes(), np.uint8)
            result = _deserialized(heard.tobytes())
            if result is None or _shape_of(result) != shape:
                return False
            if _numbers_of(result) != tuple(heard[place].tobytes() for place in places):
                return False
        return True


def _deserialized(data: bytes) -> Any:
    try:
        return read_message(data, JointState)
    except WireError:
        return None


def _places(message: Any) -> tuple[slice, ...] | None:
    # Where stamp, positions, velocities and efforts go when a message like this is serialized.
    marked = JointState(name=message.name)
    marked.header.frame_id = message.header.frame_id
    marked.header.stamp.sec, marked.header.stamp.nanosec = divmod(MARKED_STAMP, SECOND)
    random = np.random.default_rng(22)
    marked.position.frombytes(random.normal(size=len(message.position)).tobytes())
    marked.velocity.frombytes(random.normal(size=len(message.velocity)).tobytes())
    marked.effort.frombytes(random.normal(size=len(message.effort)).tobytes())
    data = serialize_message(marked)
    places = []
    for pattern in _numbers_of(marked):
        place = only_place(data, pattern) if pattern else 0
        if place is None:
            return None
        places.append(slice(place, place + len(pattern)))
    return tuple(places)
