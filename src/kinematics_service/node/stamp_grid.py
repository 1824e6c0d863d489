# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Limit the rate of published results by their stamps."""


class StampGrid:
    """Passes only the first result in each interval of a fixed grid of stamps."""

    def __init__(self) -> None:
        self._last: int | None = None

    def passes(self, stamp: int, period: int) -> bool:
        """
        Return whether a stamp (ns) is in another interval than the last stamp that passed. With
        the period 0, every stamp passes.

        The intervals are `period` ns long and begin at the multiples of `period`.
        """
        if period == 0:
            return True
        cell = stamp // period
        if cell == self._last:
            return False
        self._last = cell
        return True

    def forget(self) -> None:
        """Forget the last interval, so that `passes` returns True for the next stamp."""
        self._last = None
