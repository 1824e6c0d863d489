# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the numbers of a tool state into serialized outgoing messages."""

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
    The bytes of serialized outgoing messages, and the offsets at which stamps and numbers are
    written.

    Attributes
    ----------
    data
        The bytes of all messages. Bytes outside of stamps and targets do not change.
    stamps
        Byte offsets of the stamps: int32 seconds, then uint32 nanoseconds.
    targets
        Byte offsets of the doubles to write.
    sources : shape of targets
        Source of each double. It is an index into an array that consists of a row of results, its
        singularity measures, and the covariances of pose and twist.
    """

    data: Bytes
    stamps: Integers
    targets: Integers
    sources: Integers


class OutgoingMessages:
    """
    Serialized messages into which the kernel writes the numbers of a tool state.

    Parameters
    ----------
    table
        The arrays of the messages.
    errors, of_pose, of_twist
        If messages have covariances: the errors of the arm, and whether the covariance of the pose
        and that of the twist are needed.

    Attributes
    ----------
    table
        The arrays of the messages. `OutgoingMessages` also has one field for each array, with the
        same name. The kernel uses the array through this field, as a flat array. In the compiled
        kernel these fields are pointers, which Python code cannot read.
    stamped, count
        Number of stamps, and number of doubles, in all messages together.
    needed
        Smallest number of values from which the messages can be filled. The values are a row of
        results, the measures of this row and the covariances, counted together.
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
        self.covariance_array: Floats = np.zeros(0 if errors is None else pose_errors.COVARIANCES)
        self.covariances = arrays.results(self.covariance_array, 0)
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
    Write a stamp and the numbers of a tool state into outgoing messages that have no covariances.

    Parameters
    ----------
    messages
        The messages.
    stamp : ns
        If the stamp is outside the range of a message, the nearest possible stamp is written.
    row, measures
        A row of results and its measures; together at least `messages.needed` numbers.
    """
    size, measured = arrays.size(row), arrays.size(measures)
    if messages.needed > size + measured:
        raise TypeError(TOO_FEW)
    fill(messages, stamp, arrays.numbers(row, 0), size, arrays.numbers(measures, 0), measured)


def check_fit(messages: OutgoingMessages, chain: Chain, width: int, numbers: int) -> None:
    """
    Raise TypeError if the outgoing messages do not fit the arm.

    The messages must not need more numbers than a tool state has, and their covariances must
    belong to this arm. `width` is the length of a row of results of `evaluate`. `numbers` is the
    sum of three lengths: the row of results, the numbers after it (q, qdot and a quaternion), and
    the singularity measures.
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
    """
    Write a stamp and the numbers of a tool state into outgoing messages.

    The numbers come from a row of results, from the measures of this row, and from the covariances
    in `messages`. Only the numbers that the messages contain are written.
    """
    seconds = stamp // 1_000_000_000
    if seconds * 1_000_000_000 > stamp:  # C rounds a negative quotient up: subtract 1
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


def fill_covariances(messages: OutgoingMessages, row: Flat, q: Flat, qdot: Flat) -> None:
    """
    Compute the covariances of pose and twist that `messages` need, and store them in `messages`.
    If the messages need none, do nothing.
    """
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
