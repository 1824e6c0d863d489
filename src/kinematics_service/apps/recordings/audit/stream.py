# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate the timing of messages: rate, gaps, repeated stamps, and changes in the order of joint
names.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..readers.block import Block, UnreadableMessage
from ..readers.stored_columns import Column, Scalar, median, spans

# The time between two successive stamps is a gap if it exceeds MIN_GAP, and exceeds the median
# time between stamps by this factor.
GAP_INTERVALS = 5.0
# Least length of a gap in the stamps, ns.
MIN_GAP = 20_000_000
# Largest number of gaps that a report lists.
MAX_LISTED = 100


class Gap(NamedTuple):
    """
    A gap of `seconds` in the stamps, after the stamp `after` (ns); `message` is the next message.
    """

    message: int
    after: int
    seconds: float


class Stream(NamedTuple):
    """
    Statistics of the timing of a recording's messages.

    Attributes
    ----------
    messages
        Number of messages.
    median_interval, longest_interval : s
        Median and longest interval between stamps, 0 without stamps.
    duration : s
        Sum of the positive intervals between stamps.
    gap_count, gaps
        Number of gaps, and the longest gaps.
    repeated, backwards, unstamped
        Number of messages whose stamp equals the stamp of the message before, number with an
        earlier stamp, and number without a stamp.
    largest_step_back : s
        Largest step back of the stamps.
    identical
        Number of messages whose stamp and positions equal the stamp and positions of the message
        before.
    orders
        Number of different orders in which messages name the arm's joints.
    changes_of_order
        Number of times that the order differs from the order in the message before.
    delay_median, delay_longest : s
        Median and longest time from stamp to receipt, 0 without stamps.
    """

    messages: int
    median_interval: float
    longest_interval: float
    duration: float
    gap_count: int
    gaps: tuple[Gap, ...]
    repeated: int
    backwards: int
    unstamped: int
    largest_step_back: float
    identical: int
    orders: int
    changes_of_order: int
    delay_median: float
    delay_longest: float

    @property
    def rate(self) -> float:
        """
        Return the message rate, 1/s: the inverse of the median time between stamps; 0 without
        stamps.
        """
        return 1.0 / self.median_interval if self.median_interval > 0.0 else 0.0


def steps_of(stamps: Column[Scalar]) -> Iterator[tuple[int, npt.NDArray[Scalar]]]:
    """
    Yield the differences of successive stamps in pieces, as pairs (begin, steps):
    `steps[i] = stamps[begin + i + 1] - stamps[begin + i]`.
    """
    for rows in spans(len(stamps)):
        begin = max(rows.start - 1, 0)
        steps = np.diff(stamps[begin : rows.stop])
        if len(steps):
            yield begin, steps


class StreamWatch:
    """Collects the statistics of a `Stream`, block by block."""

    def __init__(self, joint_names: tuple[str, ...]) -> None:
        self._ours = set(joint_names)
        # These three columns have a row for each message that has a stamp: stamp, delay until
        # receipt, and number of the message.
        self._stamps, self._delays = Column(np.int64), Column(np.int64)
        self._numbers = Column(np.int64)
        self._orders = set[tuple[str, ...]]()
        self._order: tuple[str, ...] | None = None
        self._changes = 0
        self._identical = 0
        self._last: tuple[int, list[float]] | None = None
        self._count = 0

    def take(self, block: Block | UnreadableMessage) -> None:
        """Take the next block of messages."""
        if isinstance(block, UnreadableMessage):
            self._count += 1
            return
        order = tuple(name for name in block.names if name in self._ours)
        if order:
            self._orders.add(order)
            self._changes += self._order is not None and self._order != order
            self._order = order
        # A stamp of 0 means unstamped in a bag. In a table it is a valid stamp, because a table
        # may begin at 0 s.
        stamped = (block.stamps > 0) | (block.received == 0)
        self._numbers.append(np.flatnonzero(stamped) + self._count)
        self._stamps.append(block.stamps[stamped])
        self._delays.append((block.received - block.stamps)[stamped])
        same = (np.diff(block.stamps) == 0) & np.all(np.diff(block.positions, axis=0) == 0, axis=1)
        self._identical += int(np.sum(same & (block.stamps[1:] > 0)))
        first = (int(block.stamps[0]), block.positions[0].tolist())
        self._identical += first[0] > 0 and first == self._last
        self._last = (int(block.stamps[-1]), block.positions[-1].tolist())
        self._count += len(block)

    def stream(self) -> Stream:
        """Return the timing of all messages taken so far."""
        stamps, delays = self._stamps, self._delays
        forwards = median(steps[steps > 0] for _, steps in steps_of(stamps))
        longest = max(GAP_INTERVALS * forwards, MIN_GAP)
        gaps: list[tuple[int, int]] = []
        gap_count = repeated = backwards = duration = 0
        largest = least = 0
        for begin, steps in steps_of(stamps):
            late = np.flatnonzero(steps > longest)
            gap_count += len(late)
            late = late[np.argsort(-steps[late], kind='stable')][:MAX_LISTED]
            gaps += [(-int(steps[k]), begin + k) for k in late.tolist()]
            gaps = sorted(gaps)[:MAX_LISTED]
            repeated += int(np.sum(steps == 0))
            backwards += int(np.sum(steps < 0))
            duration += int(np.sum(steps[steps > 0]))
            largest, least = max(largest, int(np.max(steps))), min(least, int(np.min(steps)))
        delay_longest = max((int(np.max(delays[rows])) for rows in spans(len(delays))), default=0)
        return Stream(
            messages=self._count,
            median_interval=forwards * 1e-9,
            longest_interval=largest * 1e-9,
            duration=duration * 1e-9,
            gap_count=gap_count,
            gaps=tuple(
                Gap(int(self._numbers[k + 1]), int(stamps[k]), -step * 1e-9)
                for step, k in sorted(gaps, key=lambda gap: gap[1])
            ),
            repeated=repeated,
            backwards=backwards,
            unstamped=self._count - len(stamps),
            largest_step_back=-least * 1e-9,
            identical=int(self._identical),
            orders=len(self._orders),
            changes_of_order=self._changes,
            delay_median=median(delays[rows] for rows in spans(len(delays))) * 1e-9,
            delay_longest=max(delay_longest, 0) * 1e-9,
        )
