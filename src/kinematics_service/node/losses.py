# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Count lost messages of a topic by the sequence numbers of the middleware."""

from collections.abc import Callable

NANOSECOND = 1e-9  # s
# The rate of a publisher is computed from its last message and an earlier message, at least this
# number of messages before. After four times this number of messages, a newer message replaces the
# earlier message. So an error does not last: if two publishers have similar sequence numbers, the
# earlier message may be attributed to the wrong publisher.
MIN_RATE_MESSAGES = 20
# Time (s) by which a message may be sent earlier or later than the publisher's rate predicts.
SEND_TIME_TOLERANCE = 0.02
# A message can come from a known publisher if the sequence number of the message exceeds the last
# number of the publisher by at most this. A larger difference must also fit the publisher's rate.
MAX_GAP_AT_ANY_RATE = 3
# Largest rate that is assumed for a publisher before any rate has been measured, messages per s.
MAX_RATE = 20_000.0
# Largest rate that is assumed for a publisher, divided by the largest rate measured so far.
MAX_RATE_RATIO = 2.0


class _Publisher:
    # Sequence number and send time (ns) of a publisher's last message and of two earlier messages,
    # from which the rate is computed.

    def __init__(self, number: int, stamp: int) -> None:
        self.number, self.stamp = number, stamp
        self._from = self._between = number, stamp

    def take(self, number: int, stamp: int) -> None:
        """Store sequence number and send time (ns) of the publisher's last message."""
        self.number, self.stamp = number, stamp

    def look_back(self) -> None:
        """
        Replace the older of the two messages from which the rate is computed, if it is too old.

        The rate is computed from the last message and an older message, `_from`. A third message,
        `_between`, was sent between the two. If at least `4 * MIN_RATE_MESSAGES` messages were
        sent after `_between`, then `_between` becomes `_from`, and the last message becomes
        `_between`.
        """
        if self.number - self._between[0] >= 4 * MIN_RATE_MESSAGES:
            self._from, self._between = self._between, (self.number, self.stamp)

    def rate(self) -> float:
        """Return the publisher's recent rate, messages per s; 0 if the rate is unknown."""
        number, stamp = self._from
        count, time = self.number - number, NANOSECOND * (self.stamp - stamp)
        return count / time if count >= MIN_RATE_MESSAGES and time > 0.0 else 0.0

    def time_since(self, stamp: int) -> float:
        """Return the time (s) from the publisher's last message to `stamp` (ns)."""
        return max(NANOSECOND * (stamp - self.stamp), 0.0)

    def is_due(self, number: int, stamp: int) -> bool:
        """
        Return whether this publisher, at its recent rate, would send a message with the sequence
        number `number` at about the time `stamp` (ns).
        """
        rate = self.rate()
        expected = self.number + rate * self.time_since(stamp)
        return (
            rate > 0.0
            and abs(number - expected) <= MAX_GAP_AT_ANY_RATE + SEND_TIME_TOLERANCE * rate
        )


class Losses:
    """
    Counts lost messages of a topic, as gaps in the sequence numbers of each publisher.

    A message does not name its publisher. This class attributes a message to the publisher with
    the nearest smaller sequence number, if that publisher can have sent the missing messages in
    the time since its last message. If two publishers have similar sequence numbers, a message may
    be attributed to the wrong publisher. This error does not change the sum of all gaps.

    Parameters
    ----------
    publishers
        A function that returns how many publishers the topic has. It is called if a message's
        sequence number is not the next one of a known publisher.

    Attributes
    ----------
    count
        Messages lost since the start; None if the middleware does not number messages.
    is_lower_bound
        Whether `count` may be smaller than the true number of lost messages, because a gap could
        not be attributed to a publisher.
    """

    def __init__(self, publishers: Callable[[], int]) -> None:
        self.count: int | None = 0
        self.is_lower_bound = False
        self._count_publishers = publishers
        self._have_changed = False
        self._publishers: list[_Publisher] = []  # in the order of their last messages

    def publishers_changed(self) -> None:
        """
        Remember that publishers started or ended, because this change may cause the next gap.
        """
        self._have_changed = True

    def take(self, number: int | None, stamp: int) -> None:
        """
        Count the messages lost before a received message, given its sequence number and send time
        (ns).
        """
        known = self._publishers
        if number is None:
            self.count = None
            return
        if known and known[-1].number + 1 == number:
            known[-1].take(number, stamp)
            return
        for k, publisher in enumerate(known):
            if publisher.number + 1 == number:
                publisher.take(number, stamp)
                known.append(known.pop(k))
                return
        self._take_after_gap(number, stamp)

    def _take_after_gap(self, number: int, stamp: int) -> None:
        known, count = self._publishers, max(self._count_publishers(), 1)
        del known[: max(len(known) - count, 0)]
        for known_publisher in known:
            known_publisher.look_back()
        publisher = self._publisher_of(number, stamp, count)
        if publisher is None:
            # The message is probably the first message of a new publisher. Add this publisher to
            # the list of known publishers. If the list is full, remove the publisher P that has
            # been silent for longest, because P has probably ended. But perhaps P sent the
            # message, and earlier messages of P were lost. These lost messages are not counted,
            # so the count becomes a lower bound.
            self.is_lower_bound |= len(known) >= count > 1 and not self._have_changed
            del known[: max(len(known) + 1 - count, 0)]
            publisher = _Publisher(number, stamp)
        else:
            known.remove(publisher)
            self.count = (self.count or 0) + number - publisher.number - 1
            publisher.take(number, stamp)
        known.append(publisher)
        self._have_changed = False

    def _publisher_of(self, number: int, stamp: int, publishers: int) -> _Publisher | None:
        # Return the known publisher that probably sent this message. Some sequence numbers before
        # `number` are missing. Return None if this is the first message of a new publisher.
        below = [publisher for publisher in self._publishers if publisher.number < number]
        largest_rate = max((publisher.rate() for publisher in self._publishers), default=0.0)
        rate = MAX_RATE_RATIO * largest_rate or MAX_RATE

        def fits(publisher: _Publisher) -> bool:
            time = SEND_TIME_TOLERANCE + publisher.time_since(stamp)
            return number - publisher.number <= MAX_GAP_AT_ANY_RATE + rate * time

        fitting = [*filter(fits, below)]
        if len(self._publishers) < publishers:
            # Not all publishers are known yet. So an unknown publisher may have sent the message.
            # Attribute the message to a known publisher only if this publisher, at its recent
            # rate, would send its message `number` at about the time `stamp`.
            below = [publisher for publisher in below if publisher.is_due(number, stamp)]
            self.is_lower_bound |= len(fitting) > 0 and not below
        elif publishers > 1 or self._have_changed:
            below = fitting
        return max(below, key=lambda publisher: publisher.number, default=None)
