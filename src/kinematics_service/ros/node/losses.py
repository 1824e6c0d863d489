"""How many messages of a topic were lost, told by the numbers that the middleware gives them."""

from collections.abc import Callable


class Losses:
    """
    Counts the gaps in the numbers of messages; each publisher counts its own by one.

    A message does not say whose it is. The numbers of several publishers are kept apart by the
    rule that a message follows the nearest number below its own. Where two publishers have like
    numbers it may be taken for the other's, which leaves the sum of all gaps what it is.

    Parameters
    ----------
    publishers
        Returns how many publishers there are; asked where a number follows no other.

    Attributes
    ----------
    count
        Messages lost since the start, None where the middleware numbers none.
    """

    def __init__(self, publishers: Callable[[], int]) -> None:
        self.count: int | None = 0
        self._count_publishers = publishers
        self._publishers = 0
        self._last: list[int] = []  # numbers; that of the publisher heard last at the end

    def forget(self) -> None:
        """Begin anew: publishers have come or gone."""
        self._last.clear()

    def heard(self, number: int | None) -> None:
        """Take the number of a message."""
        last = self._last
        if number is None:
            self.count = None
        elif last and number == last[-1] + 1:
            last[-1] = number
        elif number - 1 in last:
            last.remove(number - 1)
            last.append(number)
        else:
            self._take_another(number)

    def _take_another(self, number: int) -> None:
        last, publishers = self._last, max(self._count_publishers(), 1)
        if publishers != self._publishers:
            self._publishers = publishers
            last.clear()
        before = max((one for one in last if one < number), default=None)
        if before is None or len(last) < publishers:
            # The first message of a publisher. It takes the place of one that is gone.
            del last[: len(last) + 1 - publishers]
        else:
            last.remove(before)
            self.count = (self.count or 0) + number - before - 1
        last.append(number)
