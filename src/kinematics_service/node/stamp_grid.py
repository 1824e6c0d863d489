"""Limit the rate of answers by their stamps."""


class StampGrid:
    """
    Passes one answer in each cell of a fixed grid of stamps, at any rate of the input.
    """

    def __init__(self) -> None:
        self._last: int | None = None

    def passes(self, stamp: int, period: int) -> bool:
        """
        Return whether this stamp (ns) is the first in its cell; with a period of 0 all pass.
        """
        if period == 0:
            return True
        cell = stamp // period
        if cell == self._last:
            return False
        self._last = cell
        return True

    def forget(self) -> None:
        """Let the next answer pass."""
        self._last = None
