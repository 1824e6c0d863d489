"""
Many serialised JointState messages at once, if they differ in stamp and numbers alone.

The reader of messages takes those that do not look like the first one.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...estimation.cdr import STAMP_AT
from ...estimation.joint_state_form import form_of, ros1_form_of
from ...kernel import Floats
from .block import SECOND, Flags, Times


class MessageColumns(NamedTuple):
    """Messages in columns; `alike` tells which rows are valid."""

    alike: Flags
    names: tuple[str, ...]
    stamps: Times
    positions: Floats
    velocities: Floats


def columns_of(raws: Sequence[bytes], ros1: bool = False) -> MessageColumns | None:
    """Return messages of equal length in columns; None if the first has no form."""
    form = ros1_form_of(raws[0]) if ros1 else form_of(raws[0])
    if form is None:
        return None
    table = np.frombuffer(b''.join(raws), dtype=np.uint8).reshape(len(raws), -1)
    at = np.flatnonzero(form.fixed)
    alike = np.all(table[:, at] == table[0, at], axis=1)
    seconds = _view(table, slice(STAMP_AT, STAMP_AT + 4), '<i4')[:, 0].astype(np.int64)
    nanoseconds = _view(table, slice(STAMP_AT + 4, STAMP_AT + 8), '<u4')[:, 0].astype(np.int64)
    return MessageColumns(
        alike,
        form.names,
        seconds * SECOND + nanoseconds,
        _view(table, form.positions, '<f8'),
        _view(table, form.velocities, '<f8'),
    )


def _view(table: np.ndarray, place: slice, kind: str) -> np.ndarray:  # type: ignore[type-arg]
    if place.start == place.stop:
        return np.zeros((len(table), 0))
    return np.ascontiguousarray(table[:, place]).view(kind)
