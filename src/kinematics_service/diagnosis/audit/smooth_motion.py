"""The motion in differences of positions, separated from the noise of the positions."""

import numpy as np

from ...formats.recordings.block import Flags
from ...kernel import Floats


class SmoothMotion:
    """
    Mean square of the differences without that noise, the same in pieces as at once.

    The noise of one position is in two differences, next to each other; the product of one and the
    next but one is free of it, and the speed hardly changes in between.
    """

    def __init__(self) -> None:
        self._sum, self._count = 0.0, 0
        self._before, self._use_before = np.zeros(0), np.zeros(0, dtype=bool)

    def take(self, differences: Floats, use: Flags) -> None:
        """Take the next differences, and which of them are valid, shape (N,)."""
        all_, usable = np.append(self._before, differences), np.append(self._use_before, use)
        both = usable[2:] & usable[1:-1] & usable[:-2]
        self._sum += float(np.sum((all_[2:] * all_[:-2])[both]))
        self._count += int(np.sum(both))
        self._before, self._use_before = all_[-2:], usable[-2:]

    def square(self, otherwise: float) -> float:
        """Return the mean square of the motion, `otherwise` if there are too few differences."""
        return max(self._sum / self._count, 0.0) if self._count else otherwise
