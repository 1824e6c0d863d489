# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compare the velocities that a recording reports for each joint with differences of the joint's
positions.

A regression of the reported velocities on the velocities from differences finds a wrong scale
(unit or sign). A search over time shifts finds a lag of the reported velocities behind the
positions.

Let v[k] be the velocity computed from positions k and k + 1. The noise of v[k] and the noise of
v[k + 2] are independent, because v[k] and v[k + 2] have no position in common. So the noise
cancels in the mean of the products `v[k] * v[k + 2]`, but not in the mean of the squares
`v[k]**2`. The mean of the squares minus the mean of the products estimates the mean square noise.
"""

import math
from typing import NamedTuple

import numpy as np

from ....estimation.motion_checks import joint_steps, path_errors, scale_in_words
from ....kernel import Floats
from ..readers.block import Flags, ForwardClock, Times
from ..readers.stored_columns import Column, StateTable, median, spans
from .stream import steps_of

# Largest tried lag of the reported velocities behind the positions, as a multiple of the median
# interval between states.
LAG_INTERVALS = 12
# A lag is searched in about LAG_MESSAGES messages: in pieces of LAG_PIECE successive messages,
# spread over the recording.
LAG_MESSAGES = 50_000
LAG_PIECE = 5_000
# A lag or scale is reported as the cause of a difference only if
# `corrected < EXPLAINED_SHARE * uncorrected`. Here `corrected` and `uncorrected` are the RMS
# differences between reported velocities and velocities computed from positions, with and without
# a correction of the lag or scale.
EXPLAINED_SHARE = 0.6
# No lag or scale is searched if `difference <= DIFFERENCE_SHARE * speed`. Here `difference` is the
# RMS difference between reported velocities and velocities computed from positions; `speed` is the
# RMS of the velocities computed from positions.
DIFFERENCE_SHARE = 0.002
# Let `scale` be the reported velocity divided by the velocity computed from positions. If
# `|scale - 1| <= SCALE_TOLERANCE`, the scale counts as correct, and no wrong scale is reported.
SCALE_TOLERANCE = 0.05
# The velocities of a joint are compared only if its RMS speed is at least this (rad/s, m/s).
SPEED_MINIMUM = 1e-3
# The velocities of a joint are compared only if `speed**2 >= 6 * noise**2 / sqrt(N)`. Here `speed`
# is the joint's RMS speed, and `noise` is the RMS noise of N velocities computed from positions.
# `noise**2 / sqrt(N)` is about the standard error of `noise**2`. The code applies the constant to
# RMS values, so it is the square root of six.
NOISE_FACTOR = math.sqrt(6.0)
# The velocities of a joint are compared only if the range of its positions is at least this many
# standard deviations of the position noise.
RANGE_FACTOR = 20.0
# The velocities of a joint are compared only if the range of its positions is at least this (rad,
# m). With a smaller range the joint counts as standing still.
RANGE_MINIMUM = 1e-3
# A velocity is computed from the positions of two successive states only if the time between them
# is at most this multiple of the median interval between states.
INTERVAL_FACTOR = 5.0
# If neither a lag nor a wrong scale is found, a difference between reported and computed
# velocities is a finding only if `median > noise + VELOCITY_SHARE * speed`. Computed velocities
# are differences of positions, divided by time. `median` is the median absolute difference,
# `speed` is the RMS of the computed velocities, and `noise` is the RMS of their noise.
VELOCITY_SHARE = 0.2


class MotionColumns:
    """
    Stamps, joint positions and velocities of N states. Long columns are kept in temporary files.

    Attributes
    ----------
    stamps : shape (N,), ns
        Stamp of each state.
    t : shape (N,), s
        Time since the first state: the sum of the differences of successive stamps. A negative
        difference counts as 0.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Rows of `qdot` are NaN if unknown.
    differenced : shape (N,)
        Whether the velocities are differences of positions, and not reported by the message.
    """

    def __init__(self, dof: int) -> None:
        self.stamps, self.t = Column(np.int64), Column(np.float64)
        self.differenced = Column(np.bool_)
        self.q, self.qdot = StateTable(dof), StateTable(dof)
        self._clock = ForwardClock()

    def __len__(self) -> int:
        """Return the number of states."""
        return len(self.stamps)

    def add(self, stamps: Times, q: Floats, qdot: Floats, differenced: Flags) -> None:
        """Add the next states, one or more."""
        self.stamps.append(stamps)
        times = self._clock.times(stamps)
        begin = int(self.stamps[0])
        self.t.append((times - begin) * 1e-9)
        self.q.append(q)
        self.qdot.append(qdot)
        self.differenced.append(differenced)


class VelocityCheck(NamedTuple):
    """
    Comparison of a joint's reported velocities with differences of its positions, rad/s or m/s.

    Attributes
    ----------
    rms, typical, worst
        RMS, median and largest difference between the reported velocity and the velocity computed
        from positions. `row` is the row of the largest difference.
    speed
        RMS of the velocities from differences of positions.
    noise
        RMS of the noise in the velocities from differences of positions.
    lag : s
        Delay of the reported velocities behind the positions; 0 if no delay explains the
        difference.
    scale
        Reported velocity divided by the velocity from positions: -1 for a wrong sign, 57.3 for
        degrees. 1 if no scale explains the difference.
    """

    rms: float
    typical: float
    worst: float
    row: int
    speed: float
    noise: float
    lag: float
    scale: float

    def in_words(self, unit: str) -> str:
        """Return as text how the velocities differ from the positions; empty if they agree."""
        if self.scale != 1.0:
            return f'are {scale_in_words(self.scale)}'
        if self.lag:
            side = 'behind' if self.lag > 0.0 else 'ahead of'
            return f'are {1e3 * abs(self.lag):.3g} ms {side} its positions'
        if self.typical > VELOCITY_SHARE * self.speed + self.noise:
            return f'differ from its positions by {self.typical:.3g} {unit}/s (median)'
        return ''


def smooth_products(velocities: Floats, use: Flags) -> Floats:
    """
    Return the products of velocity k and velocity k + 2. The mean of the products estimates the
    mean square velocity without the contribution of noise.

    The velocities are differences of positions, so the noise of a position enters two adjacent
    velocities. The noise of velocity k and velocity k + 2 is independent, and the speed hardly
    changes between them.
    """
    products: Floats = velocities[2:] * velocities[:-2]
    return products[use[2:] & use[1:-1] & use[:-2]]


def _samples(timeline: MotionColumns, j: int) -> StateTable:
    # Returns time, position, reported velocity and row of each state whose position or velocity of
    # joint j differs from that of the state before. In the other states the joint stood still, or
    # the message lacked the joint.
    samples = StateTable(4)
    columns = timeline.t, timeline.q.columns[j], timeline.qdot.columns[j]
    for rows in spans(len(timeline)):
        numbers = np.arange(rows.start, rows.stop)
        piece = np.column_stack([*(column[rows] for column in columns), numbers])
        piece = piece[~(timeline.differenced[rows] | np.isnan(piece[:, 2]))]
        before = samples[-1:] if len(samples) else np.full((1, 4), np.nan)
        changes = np.diff(piece[:, 1:3], axis=0, prepend=before[:, 1:3])
        samples.append(piece[np.any(changes != 0.0, axis=1)])
    return samples


def velocity_check(timeline: MotionColumns, j: int, wraps: bool) -> VelocityCheck | None:
    """
    Compare the reported velocities of joint j with differences of its positions. Return None if
    the motion is too small or too short.
    """
    samples = _samples(timeline, j)
    usual = median(steps[steps > 0.0] for _, steps in steps_of(samples.columns[0]))
    longest, differences = INTERVAL_FACTOR * usual, Column(np.float64)
    row, worst, sums = 0, -1.0, np.zeros(6)
    position = least = greatest = 0.0
    for rows in spans(len(samples)):
        begin = max(rows.start - 3, 0)  # `smooth_products` of a new row uses the 3 rows before it
        t, q, qdot, numbers = samples[begin : rows.stop].T
        steps, motion = np.diff(t), joint_steps(q, wraps)
        use = (steps > 0.0) & (steps <= longest)
        # Compare two mean velocities over the time between two states: the difference of positions
        # divided by the time, and the mean of the velocities that the two states report. For a
        # short time the two are nearly equal.
        mean = np.where(use, motion, 0.0) / np.where(use, steps, 1.0)
        ends = np.where(use, 0.5 * (qdot[1:] + qdot[:-1]), 0.0)
        products, new = smooth_products(mean, use), slice(max(rows.start - begin - 1, 0), None)
        mean, ends, path = mean[new], ends[new], position + np.cumsum(motion[new])
        if not len(mean):
            continue
        off = np.abs(ends - mean)
        differences.append(off[use[new]])
        squares = mean @ mean, ends @ mean, ends @ ends, off @ off
        sums += np.array([*squares, np.sum(products), len(products)])
        position, least, greatest = path[-1], min(least, path.min()), max(greatest, path.max())
        k = int(np.argmax(off))
        if off[k] > worst:
            row, worst = int(numbers[new][k + 1 - len(numbers[new])]), float(off[k])
    if (count := len(differences)) < 4:
        return None
    square, product, reported, error, smooth = (sums[:5] / count).tolist()
    moving = max(smooth * count / sums[5], 0.0) if sums[5] else square
    speed, rms, noise = math.sqrt(square), math.sqrt(error), math.sqrt(max(square - moving, 0.0))
    jitter = noise * usual / math.sqrt(2.0)
    surely = max(SPEED_MINIMUM, NOISE_FACTOR * noise / count**0.25)
    if moving < surely**2 or greatest - least < max(RANGE_FACTOR * jitter, RANGE_MINIMUM):
        return None
    # Compute the scale by a regression of the reported velocities on the velocities from
    # positions. The divisor is the mean square velocity without the noise of the positions
    # (`moving`). With the noise, the divisor would be too large and the scale too small.
    scale, lag = product / moving, 0.0
    error = reported - 2.0 * scale * product + scale**2 * square
    least = DIFFERENCE_SHARE * speed
    explained = error < (EXPLAINED_SHARE * rms) ** 2 and abs(scale - 1.0) > SCALE_TOLERANCE
    if rms <= least or not explained:
        scale, lag = 1.0, _lag(samples, wraps, usual, least)
    typical = median(differences[rows] for rows in spans(count))
    return VelocityCheck(rms, typical, worst, row, speed, noise, lag, scale)


def _lag(samples: StateTable, wraps: bool, usual: float, least: float) -> float:
    # Returns the delay (s) of the reported velocities that explains their difference from the
    # velocities computed from positions. Returns 0 if no delay explains the difference, or if the
    # RMS difference is at most `least`.
    lags = usual * np.linspace(-LAG_INTERVALS, LAG_INTERVALS, 8 * LAG_INTERVALS + 1)
    pieces = [np.zeros((len(lags), 0))]
    for begin in range(0, len(samples), LAG_PIECE * math.ceil(len(samples) / LAG_MESSAGES)):
        t, q, qdot, _ = samples[begin : begin + LAG_PIECE].T
        path = np.append(0.0, np.cumsum(joint_steps(q, wraps)))
        steps, errors = np.diff(t), np.diff(path_errors(t, path, qdot, lags), axis=1)
        # Use an interval between two states only if the recording has no gap in time near it:
        # from (begin of the interval - largest lag) to (end of the interval + largest lag).
        gaps = np.append(0.0, np.cumsum((steps <= 0.0) | (steps > INTERVAL_FACTOR * usual)))
        ends = t[:-1] + lags[0], t[1:] + lags[-1]
        use = np.ptp(np.interp(ends, t, gaps, left=math.nan, right=math.nan), axis=0) == 0.0
        pieces.append(np.abs(errors[:, use] / steps[use]))
    differences = np.concatenate(pieces, axis=1)
    squares, now = np.sum(differences**2, axis=1), len(lags) // 2
    best = int(np.argmin(squares))
    if squares[now] <= differences.shape[1] * least**2 or best in (0, len(lags) - 1):
        return 0.0
    # Accept a lag if it reduces the mean square or the median of the differences. Both are tested,
    # because outliers hide a lag in the mean square, and a long rest hides it in the median.
    explained = squares[best] < EXPLAINED_SHARE**2 * squares[now]
    explained |= np.median(differences[best]) < EXPLAINED_SHARE * np.median(differences[now])
    return float(lags[best]) if explained else 0.0
