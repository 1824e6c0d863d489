"""Limits the rate of answers by their stamps."""


class StampGrid:
    """
    Lets one answer pass in each cell of a fixed grid of stamps, whatever the input's rate is.
    """

    def __init__(self) -> None:
        self._last: int | None = None

    def passes(self, stamp: int, period: int) -> bool:
        """
        Return whether the first answer of its cell has this stamp (ns); a period of 0: always.
        """
        if period == 0:
            return True
        cell = stamp // period
        if cell == self._last:
            return False
        self._last = cell
        return True

    def forget(self) -> None:
        """Start again: the next answer passes."""
        self._last = None
