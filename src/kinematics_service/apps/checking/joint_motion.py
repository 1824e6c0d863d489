# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Interpolate sampled joint positions at any time between the samples."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...kernel import Floats

Flags = npt.NDArray[np.bool_]

# Length of a window (s). The rate of a joint is the slope of a straight line that is fitted to the
# samples in the window. At 1 kHz a joint moves less between two samples than the noise of a
# sample, so the difference of two samples is mostly noise. The line averages the noise of many
# samples. The speed of an arm hardly changes within the window.
WINDOW = 0.02
# Smallest number of samples that a line is fitted to.
MIN_COUNT = 2
# Largest number of samples that a line is fitted to, because more samples add little information.
MAX_COUNT = 64
# The motion between two samples is taken as unknown if the samples are more than this time (s)
# apart.
MAX_SAMPLE_GAP = 0.5


class JointsAtTimes(NamedTuple):
    """
    Joint positions q (N, n), rad or m, and their rates (N, n) per s, at N times. Entry k of
    `known` (N,) is True if the samples determine the joint positions at time k.
    """

    q: Floats
    rates: Floats
    known: Flags


class SampledMotion:
    """
    Sampled joint positions, and their interpolation.

    Parameters
    ----------
    times : shape (K,), s
        Times of the samples, rising, at least two.
    positions : shape (K, n), rad or m
        Joint positions.
    continuous : shape (n,)
        Flags of the joints whose positions may jump by a full turn.
    longest_gap : s
        The motion between samples that are further apart is unknown.
    """

    def __init__(
        self,
        times: Floats,
        positions: Floats,
        continuous: npt.ArrayLike,
        longest_gap: float = MAX_SAMPLE_GAP,
    ) -> None:
        steps = np.diff(positions, axis=0)
        turned = np.where(continuous, np.round(steps / (2.0 * np.pi)), 0.0)
        self._positions = np.array(positions)
        self._positions[1:] -= 2.0 * np.pi * np.cumsum(turned, axis=0)
        self._times, self._longest_gap = times, longest_gap
        self.interval = float(np.median(np.diff(times)))
        count = min(MIN_COUNT * round(WINDOW / MIN_COUNT / self.interval), MAX_COUNT)
        self._count = min(max(count, MIN_COUNT), len(times))

    @property
    def duration(self) -> float:
        """Return the time from the first to the last sample, s."""
        return float(self._times[-1] - self._times[0])

    def at(self, times: Floats) -> JointsAtTimes:
        """
        Return joint positions and rates at times (N,), s, by a straight line that is fitted to the
        samples around each time.
        """
        stamps, count = self._times, self._count
        first = np.searchsorted(stamps, times, side='right') - count // 2
        rows = np.clip(first, 0, len(stamps) - count)[:, None] + np.arange(count)
        t, q = stamps[rows] - times[:, None], self._positions[rows]
        gaps = np.max(np.diff(t, axis=1), axis=1)
        known = (times >= stamps[0]) & (times <= stamps[-1]) & (gaps <= self._longest_gap)
        middle_t, middle_q = t.mean(axis=1, keepdims=True), q.mean(axis=1, keepdims=True)
        t, q = t - middle_t, q - middle_q
        rates = np.einsum('nk,nkj->nj', t, q) / np.sum(t**2, axis=1)[:, None]
        return JointsAtTimes(middle_q[:, 0] - middle_t * rates, rates, known)
