"""Serialized messages that go out, and the numbers of a state that are written into them."""

from typing import NamedTuple

import numpy as np

from .forward import pose_errors
from .forward.chain import Chain
from .forward.pose_errors import PoseErrors
from .layout import arrays, places
from .layout.arrays import Bytes, Flat, Floats, Integers, Nanoseconds

TOO_FEW = 'a state has fewer numbers than the messages take'


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
        Index in a row of each number; beyond the row's end, in its measures; beyond these, in the
        covariances of pose and twist.
    """

    data: Bytes
    stamps: Integers
    targets: Integers
    sources: Integers


class OutgoingMessages:
    """
    Messages to fill.

    Parameters
    ----------
    table
        Their arrays.
    errors, of_pose, of_twist
        Where covariances are among their numbers: what they are of, and which are wanted.

    Attributes
    ----------
    table
        Their arrays. The kernel has the same ones, flat and under the same names; to the compiled
        kernel they are addresses that Python does not see.
    stamped, count
        Numbers of stamps and of numbers.
    needed
        Least length of a row, its measures and the covariances together.
    """

    def __init__(
        self,
        table: OutgoingTable,
        errors: PoseErrors | None = None,
        of_pose: bool = False,
        of_twist: bool = False,
    ) -> None:
        size = arrays.size(table.data)
        self.table, self.errors = table, errors
        self.of_pose, self.of_twist = of_pose, of_twist
        self.found: Floats = np.zeros(0 if errors is None else pose_errors.COVARIANCES)
        self.covariances = arrays.results(self.found, 0)
        self.stamped, self.count = arrays.size(table.stamps), arrays.size(table.targets)
        self.needed: int = int(table.sources.max(initial=-1)) + 1
        self.data = arrays.octets_to_fill(table.data, 0)
        self.stamps = arrays.whole(table.stamps, 0)
        self.targets = arrays.whole(table.targets, 0)
        self.sources = arrays.whole(table.sources, self.count)
        for begins in (table.stamps, table.targets):
            if begins.min(initial=0) < 0 or begins.max(initial=0) + 8 > size and begins.size:
                raise ValueError('a place outside of the messages')
        if table.sources.min(initial=0) < 0:
            raise ValueError('a number from before the row')


def fill_messages(
    messages: OutgoingMessages, stamp: Nanoseconds, row: Floats, measures: Floats
) -> None:
    """
    Write a stamp and the numbers of a state into messages without covariances.

    Parameters
    ----------
    messages
        The messages.
    stamp : ns
        A stamp beyond the range of a message becomes the nearest one.
    row, measures
        Together at least `messages.needed` numbers.
    """
    size, measured = arrays.size(row), arrays.size(measures)
    if messages.needed > size + measured:
        raise TypeError(TOO_FEW)
    fill(messages, stamp, arrays.numbers(row, 0), size, arrays.numbers(measures, 0), measured)


def check_fit(messages: OutgoingMessages, chain: Chain, width: int, numbers: int) -> None:
    """
    Raise TypeError if they do not fit a row `width` wide, of so many numbers with its measures.
    """
    if messages.errors is not None:
        if messages.errors.chain is not chain or width < chain.width:
            raise TypeError('covariances are those of another arm, or need the frames')
        numbers += pose_errors.COVARIANCES
    if numbers < messages.needed:
        raise TypeError(TOO_FEW)


def fill(
    messages: OutgoingMessages,
    stamp: Nanoseconds,
    row: Flat,
    size: int,
    measures: Flat,
    measured: int,
) -> None:
    """Do the work of `fill_messages`; `size` and `measured` are those of row and measures."""
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
        if source < size:
            number = row[source]
        elif source < size + measured:
            number = measures[source - size]
        else:
            number = messages.covariances[source - size - measured]
        arrays.put_number(messages.data, messages.targets[k], number)


def spread(messages: OutgoingMessages, row: Flat, q: Flat, qdot: Flat) -> None:
    """Compute the covariances of a row that are among the numbers of the messages."""
    if messages.errors is not None:
        work = arrays.scratch(pose_errors.room(messages.errors))
        pose_errors.write_covariances(
            messages.errors,
            row,
            q,
            qdot,
            messages.of_pose,
            messages.of_twist,
            False,
            messages.covariances,
            work,
        )
        arrays.give_back(work)
