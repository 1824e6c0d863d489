"""Limit the rate of answers by their stamps."""


class StampGrid:
    """Passes the first answer in each cell of a fixed grid of stamps, at any rate of the input."""

    def __init__(self) -> None:
        self._last: int | None = None

    def passes(self, stamp: int, period: int) -> bool:
        """
        Return whether a stamp (ns) is the first in its cell of `period` ns; every stamp passes if
        the period is 0.
        """
        if period == 0:
            return True
        cell = stamp // period
        if cell == self._last:
            return False
        self._last = cell
        return True

    def forget(self) -> None:
        """Forget the last cell, so that the next answer passes."""
        self._last = None
