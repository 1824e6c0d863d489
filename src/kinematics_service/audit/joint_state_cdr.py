"""
Many serialised JointState messages at once, where they differ in stamp and numbers alone.

A driver sends the same names in every message, so that all have one length and their numbers stand
at the same places; what does not look like the first one is left to the reader of messages.
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kernel import Floats
from .block import Flags, Times

# Encapsulation of plain little-endian CDR, and where the body begins.
LITTLE_ENDIAN = b'\x00\x01'
BODY = 4
# ROS 1 has the number of the message there instead, aligns nothing, and ends no text with a zero.
STAMP_AT, FRAME_AT = BODY, BODY + 8


class Layout(NamedTuple):
    """
    Where things stand in messages that look like one of them.

    Attributes
    ----------
    fixed
        Ranges of bytes that are the same in all of them.
    positions, velocities
        Place and number of the doubles.

    """

    names: tuple[str, ...]
    fixed: tuple[tuple[int, int], ...]
    positions: tuple[int, int]
    velocities: tuple[int, int]


class Columns(NamedTuple):
    """
    Messages in columns; `alike` tells which rows mean something.

    """

    alike: Flags
    names: tuple[str, ...]
    stamps: Times
    positions: Floats
    velocities: Floats


def layout_of(raw: bytes, ros1: bool = False) -> Layout | None:
    """
    Return the layout of a message; None where it is no whole little-endian JointState.

    """
    try:
        return _layout(raw, ros1)
    except (struct.error, UnicodeDecodeError, IndexError):
        return None


def _layout(raw: bytes, ros1: bool) -> Layout | None:
    if not ros1 and raw[:2] != LITTLE_ENDIAN:
        return None
    fixed = [] if ros1 else [(0, 2)]

    def aligned(at: int, size: int) -> int:
        return at if ros1 else at + -(at - BODY) % size

    def count(at: int) -> tuple[int, int]:
        at = aligned(at, 4)
        fixed.append((at, at + 4))
        return int(struct.unpack_from('<I', raw, at)[0]), at + 4

    def text(at: int) -> tuple[str, int]:
        length, at = count(at)
        fixed.append((at, at + length))
        end = at + length
        if end > len(raw):
            raise IndexError
        if ros1:
            return raw[at:end].decode(), end
        if not length or raw[end - 1]:
            raise IndexError
        return raw[at : end - 1].decode(), end

    def doubles(at: int) -> tuple[tuple[int, int], int]:
        number, at = count(at)
        if number:
            at = aligned(at, 8)
        if at + 8 * number > len(raw):
            raise IndexError
        return (at, number), at + 8 * number

    _, at = text(FRAME_AT)
    number, at = count(at)
    if number > len(raw):
        return None
    names = []
    for _ in range(number):
        name, at = text(at)
        names.append(name)
    positions, at = doubles(at)
    velocities, at = doubles(at)
    _, at = doubles(at)
    if ros1 and at != len(raw):
        return None
    return Layout(tuple(names), tuple(fixed), positions, velocities)


def columns_of(raws: Sequence[bytes], ros1: bool = False) -> Columns | None:
    """
    Return messages of equal length in columns; None where the first has no layout.

    """
    layout = layout_of(raws[0], ros1)
    if layout is None:
        return None
    table = np.frombuffer(b''.join(raws), dtype=np.uint8).reshape(len(raws), -1)
    at = np.concatenate([np.arange(*span) for span in layout.fixed])
    alike = np.all(table[:, at] == table[0, at], axis=1)
    seconds = _view(table, STAMP_AT, 4, '<i4')[:, 0].astype(np.int64)
    nanoseconds = _view(table, STAMP_AT + 4, 4, '<u4')[:, 0].astype(np.int64)
    return Columns(
        alike,
        layout.names,
        seconds * 1_000_000_000 + nanoseconds,
        _view(table, layout.positions[0], 8 * layout.positions[1], '<f8'),
        _view(table, layout.velocities[0], 8 * layout.velocities[1], '<f8'),
    )


def _view(table: np.ndarray, at: int, size: int, kind: str) -> np.ndarray:  # type: ignore[type-arg]
    if not size:
        return np.zeros((len(table), 0))
    return np.ascontiguousarray(table[:, at : at + size]).view(kind)
