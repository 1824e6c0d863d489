# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Store joint states as blocks: consecutive messages with the same joint names, in columns."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ....estimation.joint_sample import JointSample
from ....kernel import Floats

Times: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]

SECOND = 1_000_000_000  # ns
# Largest number of messages in a block.
LARGEST_BLOCK = 16_384
# Largest size of the serialized messages of a block, 64 MiB. A larger message becomes a block of
# its own.
LARGEST_BYTES = 2**26


class ForwardClock:
    """A clock, ns, that advances while stamps rise and stops while stamps step back."""

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None

    def times(self, stamps: Times) -> Times:
        """
        Advance the clock by the next stamps (N,), N > 0, and return the time of the clock at each
        stamp (N,). The clock begins at the first stamp.
        """
        stamp, time = self._last or (int(stamps[0]), int(stamps[0]))
        times: Times = time + np.cumsum(np.maximum(np.diff(stamps, prepend=stamp), 0))
        self._last = int(stamps[-1]), int(times[-1])
        return times


@dataclass(frozen=True, eq=False)
class Block:
    """
    Consecutive JointState messages with the same joint names, and with the same numbers of
    positions and velocities.

    Attributes
    ----------
    names
        Joint names, as in the messages.
    stamps, received : shape (N,), ns
        Stamp in the header, 0 if unstamped, and time of receipt of each message.
    positions, velocities : shape (N, k), rad or m, rad/s or m/s
        Positions and velocities as in the messages. In valid messages k is the number of joint
        names, or 0 if the messages have no positions (or no velocities).
    """

    names: tuple[str, ...]
    stamps: Times
    received: Times
    positions: Floats
    velocities: Floats

    def __len__(self) -> int:
        return len(self.stamps)

    def sample(self, k: int) -> JointSample:
        """
        Return message k in the form that the state estimator accepts. The estimator needs a steady
        clock: a recording has none, so the time of receipt is used.
        """
        received = int(self.received[k])
        return JointSample(
            self.names,
            self.positions[k].tolist(),
            self.velocities[k].tolist(),
            int(self.stamps[k]),
            received,
            received,
        )


@dataclass(frozen=True)
class UnreadableMessage:
    """A message that cannot be read as a JointState, with the reason as text."""

    received: int
    reason: str

    def __len__(self) -> int:
        return 1


def joined(parts: Iterable[Block | UnreadableMessage]) -> Iterator[Block | UnreadableMessage]:
    """
    Yield blocks in order. Join consecutive blocks that have the same joint names and the same
    numbers of positions and velocities.
    """

    def kind(part: Block | UnreadableMessage) -> tuple[object, ...]:
        if isinstance(part, UnreadableMessage):
            return (part,)
        return part.names, part.positions.shape[1], part.velocities.shape[1]

    for _, alike in groupby(parts, kind):
        blocks = list(alike)
        if isinstance(blocks[0], Block):
            names, *columns = zip(*(vars(block).values() for block in blocks))
            yield Block(names[0], *(np.concatenate(column) for column in columns))
        else:
            yield from blocks
