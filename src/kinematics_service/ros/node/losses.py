"""How many messages of a topic were lost, by the numbers that the middleware gives them."""

from collections.abc import Callable


class Losses:
    """
    Counts the gaps in the numbers of messages; each publisher counts its own by one.

    A message does not name its publisher. The numbers of several publishers are kept apart by the
    rule that a message follows the nearest number below its own. If two publishers have similar
    numbers, a message may be taken for the other's, which does not change the sum of all gaps.

    Parameters
    ----------
    publishers
        Returns the number of publishers; called when a number follows no other.

    Attributes
    ----------
    count
        Messages lost since the start, None if the middleware does not number them.
    """

    def __init__(self, publishers: Callable[[], int]) -> None:
        self.count: int | None = 0
        self._count_publishers = publishers
        self._publishers = 0
        self._last: list[int] = []  # numbers; that of the most recent publisher is the last

    def forget(self) -> None:
        """Start again: publishers have come or gone."""
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
            # The first message of a publisher. It replaces one that is gone.
            del last[: max(len(last) + 1 - publishers, 0)]
        else:
            last.remove(before)
            self.count = (self.count or 0) + number - before - 1
        last.append(number)
