"""Serialized messages that go out, and the numbers of a state that are written into them."""

from typing import NamedTuple

from .layout import arrays, places
from .layout.arrays import Bytes, Floats, Integers


class OutgoingTable(NamedTuple):
    """
    The arrays of outgoing messages.

    Attributes
    ----------
    data
        The bytes of all messages; those that are not filled stay unchanged.
    stamps
        Offsets of stamps: int32 seconds and uint32 nanoseconds.
    targets
        Offsets of numbers: doubles.
    sources : shape of targets
        Index in a row of each number; beyond the row's end, in its measures.
    """

    data: Bytes
    stamps: Integers
    targets: Integers
    sources: Integers


class OutgoingMessages:
    """
    Messages to fill.

    Attributes
    ----------
    table
        Their arrays. The kernel has the same ones, flat and under the same names; to the compiled
        kernel they are addresses that Python does not see.
    stamped, count
        Numbers of stamps and of numbers.
    needed
        Least length of a row and its measures together.
    """

    def __init__(self, table: OutgoingTable) -> None:
        size = arrays.size(table.data)
        self.table = table
        self.stamped = arrays.size(table.stamps)
        self.count = arrays.size(table.targets)
        self.needed = int(table.sources.max(initial=-1)) + 1
        self.data = arrays.octets_to_fill(table.data, 0)
        self.stamps = arrays.whole(table.stamps, 0)
        self.targets = arrays.whole(table.targets, 0)
        self.sources = arrays.whole(table.sources, self.count)
        for begins in (table.stamps, table.targets):
            if begins.min(initial=0) < 0 or begins.max(initial=0) + 8 > size and begins.size:
                raise ValueError('a place outside of the messages')
        if table.sources.min(initial=0) < 0:
            raise ValueError('a number from before the row')


def fill_messages(messages: OutgoingMessages, stamp: int, row: Floats, measures: Floats) -> None:
    """
    Write a stamp and the numbers of a state into messages.

    Parameters
    ----------
    messages
        The messages.
    stamp : ns
        A stamp beyond the range of a message becomes the nearest one.
    row, measures
        Together at least `messages.needed` numbers.
    """
    arrays.given(messages)
    size = arrays.size(row)
    check_fit(messages, size + arrays.size(measures))
    fill(messages, stamp, arrays.numbers(row, 0), size, arrays.numbers(measures, 0))


def check_fit(messages: OutgoingMessages, numbers: int) -> None:
    """Raise TypeError if a row and its measures have too few numbers together."""
    if numbers < messages.needed:
        raise TypeError('a state has fewer numbers than the messages take')


def fill(messages: OutgoingMessages, stamp: int, row: Floats, size: int, measures: Floats) -> None:
    """Do the work of `fill_messages`; `size` is that of the row."""
    seconds = stamp // 1_000_000_000
    if seconds * 1_000_000_000 > stamp:  # C rounds towards zero
        seconds -= 1
    nanoseconds = stamp - seconds * 1_000_000_000
    seconds = max(-places.LARGEST_SECOND - 1, min(places.LARGEST_SECOND, seconds))
    for k in range(messages.stamped):
        arrays.put_half_word(messages.data, messages.stamps[k], seconds)
        arrays.put_half_word(messages.data, messages.stamps[k] + 4, nanoseconds)
    for k in range(messages.count):
        source = messages.sources[k]
        number = row[source] if source < size else measures[source - size]
        arrays.put_number(messages.data, messages.targets[k], number)
