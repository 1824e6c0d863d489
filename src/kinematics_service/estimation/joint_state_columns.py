# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read many serialized JointState messages at once if they differ only in stamps and numbers.

Messages with other joint names or lengths than the first message must be read one by one.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..kernel import Floats, Integers
from .cdr import SECOND, STAMP_AT
from .joint_state_form import form_of

Flags: TypeAlias = npt.NDArray[np.bool_]


class MessageColumns(NamedTuple):
    """
    JointState messages as arrays, one row per message: stamp fields (s, ns), positions and
    velocities.

    `alike` is true for a message with the same joint names and array lengths as the first message.
    The rows of all other messages are invalid.
    """

    alike: Flags
    names: tuple[str, ...]
    seconds: Integers
    nanoseconds: Integers
    positions: Floats
    velocities: Floats

    @property
    def stamps(self) -> Integers:
        """Return the stamps of the messages, ns."""
        return self.seconds * SECOND + self.nanoseconds


def columns_of(raws: Sequence[bytes], ros1: bool = False) -> MessageColumns | None:
    """
    Return serialized messages of equal length as arrays; None if `form_of` cannot read the first
    message.
    """
    form = form_of(raws[0], ros1)
    if form is None:
        return None
    table = np.frombuffer(b''.join(raws), dtype=np.uint8).reshape(len(raws), -1)
    at = np.flatnonzero(form.fixed)
    alike = np.all(table[:, at] == table[0, at], axis=1)
    return MessageColumns(
        alike,
        form.names,
        _view(table, slice(STAMP_AT, STAMP_AT + 4), '<i4')[:, 0].astype(np.int64),
        _view(table, slice(STAMP_AT + 4, STAMP_AT + 8), '<u4')[:, 0].astype(np.int64),
        _view(table, form.positions, '<f8'),
        _view(table, form.velocities, '<f8'),
    )


def _view(table: np.ndarray, place: slice, kind: str) -> np.ndarray:  # type: ignore[type-arg]
    return np.ascontiguousarray(table[:, place]).view(kind)
