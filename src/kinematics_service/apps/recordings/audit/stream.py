"""
The timing of the messages of a recording: rate, gaps, repeated stamps, names that change order.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..readers.block import Block, UnreadableMessage
from ..readers.columns import Column, Scalar, median, spans

# A gap is this many times the median interval of stamps, and at least this long (ns).
GAP, SHORTEST_GAP = 5.0, 20_000_000
# Number of gaps and orders of names that are listed.
MOST_LISTED = 100


class Gap(NamedTuple):
    """
    Nothing was measured from the stamp `after` (ns) for `seconds`; `message` is the next one.
    """

    message: int
    after: int
    seconds: float


class NameOrder(NamedTuple):
    """The joints of the arm in the order one kind of message names them."""

    joints: tuple[str, ...]
    others: int
    messages: int
    first: int


@dataclass(frozen=True)
class Stream:
    """
    Findings about the messages themselves, which hold for any arm.

    Attributes
    ----------
    messages
        Their number.
    first_stamp, last_stamp : ns
        0 if no message is stamped.
    median_interval, longest_interval : s
        Of stamps, 0 if there are none.
    duration : s
        Sum of the intervals that go forwards.
    gap_count, gaps
        Number of gaps, and the longest of them.
    repeated, backwards, unstamped
        Numbers of messages with the stamp of the message before, with an earlier one, and without
        one.
    largest_step_back : s
        Of the stamps.
    identical
        Messages with stamp and positions of the message before.
    orders
        The orders in which the arm's joints are named, most frequent first.
    changes_of_order
        Number of times that two messages in a row name them differently.
    delay_median, delay_longest : s
        From stamp to receipt; 0 if there are no stamps.
    """

    messages: int
    first_stamp: int
    last_stamp: int
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
    orders: tuple[NameOrder, ...]
    changes_of_order: int
    delay_median: float
    delay_longest: float

    @property
    def rate(self) -> float:
        """Return messages per second by the median interval, 0 if there are no stamps."""
        return 1.0 / self.median_interval if self.median_interval > 0.0 else 0.0


def steps_of(stamps: Column[Scalar]) -> Iterator[tuple[int, npt.NDArray[Scalar]]]:
    """Yield the steps between stamps in pieces, with the number of the first stamp of each."""
    for rows in spans(len(stamps)):
        begin = max(rows.start - 1, 0)
        steps = np.diff(stamps[begin : rows.stop])
        if len(steps):
            yield begin, steps


class StreamWatch:
    """Collects the data of a `Stream`, block by block."""

    def __init__(self, joint_names: tuple[str, ...]) -> None:
        self._ours = set(joint_names)
        # The messages with a stamp.
        self._stamps, self._delays = Column(np.int64), Column(np.int64)
        self._numbers = Column(np.int64)
        self._orders: Counter[tuple[str, ...]] = Counter()
        self._first: dict[tuple[str, ...], tuple[int, int]] = {}
        self._order: tuple[str, ...] | None = None
        self._changes = 0
        self._identical = 0
        self._last: tuple[int, list[float]] | None = None
        self._count = 0

    def take(self, block: Block | UnreadableMessage) -> None:
        """Take the next block."""
        if isinstance(block, UnreadableMessage):
            self._count += 1
            return
        order = tuple(name for name in block.names if name in self._ours)
        if order:
            self._orders[order] += len(block)
            self._first.setdefault(order, (self._count, len(block.names) - len(order)))
            self._changes += self._order is not None and self._order != order
            self._order = order
        # Tables may begin at 0 s, as no clock of a bag does.
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
        """Return the findings."""
        stamps, delays = self._stamps, self._delays
        forwards = median(steps[steps > 0] for _, steps in steps_of(stamps))
        longest = max(GAP * forwards, SHORTEST_GAP)
        gaps: list[tuple[int, int]] = []
        gap_count = repeated = backwards = duration = 0
        largest = least = 0
        for begin, steps in steps_of(stamps):
            late = np.flatnonzero(steps > longest)
            gap_count += len(late)
            late = late[np.argsort(-steps[late], kind='stable')][:MOST_LISTED]
            gaps += [(-int(steps[k]), begin + k) for k in late.tolist()]
            gaps = sorted(gaps)[:MOST_LISTED]
            repeated += int(np.sum(steps == 0))
            backwards += int(np.sum(steps < 0))
            duration += int(np.sum(steps[steps > 0]))
            largest, least = max(largest, int(np.max(steps))), min(least, int(np.min(steps)))
        delay_longest = max((int(np.max(delays[rows])) for rows in spans(len(delays))), default=0)
        return Stream(
            messages=self._count,
            first_stamp=int(stamps[0]) if len(stamps) else 0,
            last_stamp=int(stamps[-1]) if len(stamps) else 0,
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
            orders=tuple(
                NameOrder(order, self._first[order][1], count, self._first[order][0])
                for order, count in self._orders.most_common(MOST_LISTED)
            ),
            changes_of_order=self._changes,
            delay_median=median(delays[rows] for rows in spans(len(delays))) * 1e-9,
            delay_longest=max(delay_longest, 0) * 1e-9,
        )
