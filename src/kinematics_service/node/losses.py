"""How many messages of a topic were lost, by the numbers that the middleware gives them."""

from collections.abc import Callable

S = 1e-9  # s in a nanosecond
# A rate is that of so many messages at least. It is of no more than five times as many: two
# publishers whose numbers meet may have changed their places.
FEWEST = 20
# Publishers wait and hurry by so much (s), and by as many messages as they send meanwhile.
UNEVEN = 0.02
# Messages that may be missing whatever the rate.
FEW = 3
# A publisher whose rate is not known yet sends this many messages a second at most; one whose rate
# is known, this many times as many.
FASTEST = 20_000.0
HURRY = 2.0


class _Publisher:
    # The number and the time (ns) of the message of one publisher that was heard last, and of two
    # before it, whose distance gives its rate.

    __slots__ = ('_from', '_later', 'number', 'stamp')

    def __init__(self, number: int, stamp: int) -> None:
        self.number, self.stamp = number, stamp
        self._from = self._later = number, stamp

    def take(self, number: int, stamp: int) -> None:
        """Take its next message."""
        self.number, self.stamp = number, stamp

    def look_back(self) -> None:
        """Let the rate be that of late."""
        if self.number - self._later[0] >= 4 * FEWEST:
            self._from, self._later = self._later, (self.number, self.stamp)

    def rate(self) -> float:
        """Return the number of messages a second of late, 0 where it is not known."""
        number, stamp = self._from
        count, time = self.number - number, S * (self.stamp - stamp)
        return count / time if count >= FEWEST and time > 0.0 else 0.0

    def silent(self, stamp: int) -> float:
        """Return how long it has been silent (s)."""
        return max(S * (stamp - self.stamp), 0.0)

    def is_due(self, number: int, stamp: int) -> bool:
        """Return whether its rate tells of this number now."""
        rate = self.rate()
        expected = self.number + rate * self.silent(stamp)
        return rate > 0.0 and abs(number - expected) <= FEW + UNEVEN * rate


class Losses:
    """
    Counts the gaps in the numbers of messages; each publisher counts its own by one.

    A message does not name its publisher. It follows the nearest number below its own, if as many
    messages as lie between can have been sent in the time between. If two publishers have similar
    numbers, a message may be taken for the other's, which does not change the sum of all gaps.

    Parameters
    ----------
    publishers
        Returns the number of publishers; called when a number follows no other.

    Attributes
    ----------
    count
        Messages lost since the start, None if the middleware does not number them.
    is_lower_bound
        Whether more may be lost: a gap of one of several publishers could not be attributed.
    """

    def __init__(self, publishers: Callable[[], int]) -> None:
        self.count: int | None = 0
        self.is_lower_bound = False
        self._count_publishers = publishers
        self._have_changed = False
        self._heard: list[_Publisher] = []  # the one heard last is the last

    def publishers_changed(self) -> None:
        """Publishers have come or gone: one that is alone may be another."""
        self._have_changed = True

    def heard(self, number: int | None, stamp: int) -> None:
        """Take the number of a message, and the time (ns) at which it was sent."""
        heard = self._heard
        if number is None:
            self.count = None
            return
        if heard and heard[-1].number + 1 == number:
            heard[-1].take(number, stamp)
            return
        for k, one in enumerate(heard):
            if one.number + 1 == number:
                one.take(number, stamp)
                heard.append(heard.pop(k))
                return
        self._take_another(number, stamp)

    def _take_another(self, number: int, stamp: int) -> None:
        heard, publishers = self._heard, max(self._count_publishers(), 1)
        del heard[: max(len(heard) - publishers, 0)]
        for one in heard:
            one.look_back()
        before = self._before(number, stamp, publishers)
        if before is None:
            # The first message of a publisher. It replaces one that is gone, or one whose gap is
            # too long for its rate and is not counted.
            self.is_lower_bound |= len(heard) >= publishers > 1 and not self._have_changed
            del heard[: max(len(heard) + 1 - publishers, 0)]
            before = _Publisher(number, stamp)
        else:
            heard.remove(before)
            self.count = (self.count or 0) + number - before.number - 1
            before.take(number, stamp)
        heard.append(before)
        self._have_changed = False

    def _before(self, number: int, stamp: int, publishers: int) -> _Publisher | None:
        # The publisher whose messages before this one are missing, None for a first message.
        below = [one for one in self._heard if one.number < number]
        rate = HURRY * max((one.rate() for one in self._heard), default=0.0) or FASTEST
        fitting = [
            one
            for one in below
            if number - one.number <= FEW + rate * (UNEVEN + one.silent(stamp))
        ]
        if len(self._heard) < publishers:
            # It is another's, unless it comes when it has to.
            below = [one for one in below if one.is_due(number, stamp)]
            self.is_lower_bound |= len(fitting) > 0 and not below
        elif publishers > 1 or self._have_changed:
            below = fitting
        return max(below, key=lambda one: one.number, default=None)
