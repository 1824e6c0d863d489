"""Reported velocities of a joint against differences of its positions."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...formats.recordings.block import Flags, Times
from ...formats.recordings.columns import Column, StateTable, median, spans
from ...kernel import Floats

# Lags tried, in median intervals; and the number of messages for the trials.
LAGS, LAG_ROWS = 12, 50_000
# A lag or a scale is believed if it removes this share of the difference.
BELIEVED = 0.6
# Differences below this share of the speed need no explanation; scales this near to 1 are no
# finding.
WORTH, SAME_SCALE = 0.002, 0.05
# There is nothing to compare below this speed (rad/s, m/s; RMS), nor if the motion could be this
# many standard errors of the noise, or if the way is no longer than this many jitters of a
# position.
STILL, SURE, MANY_JITTERS = 1e-3, math.sqrt(6.0), 20.0
# Intervals longer than this many median ones are not used.
LONGEST = 5.0
# Difference of reported velocity that is worth a sentence, as a share of the joint's own speed.
VELOCITY_SHARE = 0.2


class MotionColumns:
    """
    The joints of N states, in columns that are read in pieces.

    Attributes
    ----------
    stamps : shape (N,), ns
        Of the state.
    t : shape (N,), s
        Time since the first state by the stamps; a step back takes no time.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Rows of `qdot` are NaN if unknown.
    differenced : shape (N,)
        Whether the velocities are differences of positions.
    """

    def __init__(self, dof: int) -> None:
        self.stamps, self.t, self.differenced = Column(np.int64), Column(np.float64), Column(bool)
        self.q, self.qdot = StateTable(dof), StateTable(dof)
        self._clock: tuple[int, int] | None = None

    def __len__(self) -> int:
        """Return the number of states."""
        return len(self.stamps)

    def add(self, stamps: Times, q: Floats, qdot: Floats, differenced: Flags) -> None:
        """Add the next states, one or more."""
        self.stamps.append(stamps)
        self.t.append(self._times(stamps))
        self.q.append(q)
        self.qdot.append(qdot)
        self.differenced.append(differenced)

    def _times(self, stamps: Times) -> Floats:
        last, passed = self._clock or (int(stamps[0]), 0)
        steps = np.maximum(np.diff(stamps, prepend=last), 0)
        total = passed + np.cumsum(steps)
        self._clock = int(stamps[-1]), int(total[-1])
        times: Floats = total * 1e-9
        return times


class VelocityCheck(NamedTuple):
    """
    Reported velocities of a joint against differences of its positions, rad/s or m/s.

    Attributes
    ----------
    rms, typical, worst
        RMS, median and largest of their difference; `row` is the worst row.
    speed
        RMS of the differences themselves.
    noise
        RMS of their part that is noise of the positions.
    lag : s
        Delay of the velocities, 0 if none is believable.
    scale
        Reported over differentiated: -1 a wrong sign, 57.3 degrees; 1 if none is believable.
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
        """Return what reported velocities do that is worth a sentence, empty for nothing."""
        if self.scale != 1.0:
            text = f'are {self.scale:.3g} times what its positions say'
            if abs(self.scale - math.degrees(1.0)) < 1.0:
                return f'{text} (degrees?)'
            return f'{text} (the wrong sign)' if abs(self.scale + 1.0) < 0.05 else text
        if self.lag:
            side = 'behind' if self.lag > 0.0 else 'ahead of'
            return f'are {1e3 * abs(self.lag):.3g} ms {side} its positions'
        if self.typical > VELOCITY_SHARE * self.speed + self.noise:
            return f'differ from its positions by {self.typical:.3g} {unit}/s (median)'
        return ''


@dataclass
class Unwrapped:
    """Positions of a joint without the jumps of a full turn, as from `numpy.unwrap`."""

    wraps: bool
    _last: Floats = field(default_factory=lambda: np.zeros(0))
    _turns: float = 0.0

    def take(self, q: Floats) -> Floats:
        """Return the next positions, shape (N,), N > 0."""
        if not self.wraps:
            return q
        last = self._last if len(self._last) else q[:1]
        steps = np.diff(q, prepend=last)
        wrapped = np.mod(steps + math.pi, math.tau) - math.pi
        wrapped[(wrapped == -math.pi) & (steps > 0.0)] = math.pi
        turns = np.where(np.abs(steps) < math.pi, 0.0, wrapped - steps)
        total = np.cumsum(np.concatenate([[self._turns], turns]))[1:]
        self._last, self._turns = q[-1:], float(total[-1])
        unwrapped: Floats = q + total
        return unwrapped


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


def longest_interval(forwards: float) -> float:
    """
    Return the longest interval (ns) after which a state still follows the one before, from the
    median.
    """
    return LONGEST * forwards


class _JointSamples(NamedTuple):
    """Messages with new values of a joint, after the one before them."""

    q: Floats
    reported: Floats
    stamps: Times
    t: Floats
    rows: Times


class _Intervals(NamedTuple):
    """
    The intervals between samples: mean velocity, mean of the reported ones at the ends, and which
    to use.
    """

    mean: Floats
    ends: Floats
    use: Flags


@dataclass
class _Joint:
    """One joint of a recording, to be read several times."""

    timeline: MotionColumns
    j: int
    wraps: bool
    longest: float = 0.0

    def pieces(self) -> Iterator[_JointSamples]:
        timeline, unwrapped = self.timeline, Unwrapped(self.wraps)
        last = np.array([math.nan]), np.array([math.nan])
        before: list[Any] | None = None
        for rows in spans(len(timeline)):
            q = unwrapped.take(timeline.q.columns[self.j][rows])
            velocities = timeline.qdot.columns[self.j][rows]
            reported = np.where(timeline.differenced[rows], np.nan, velocities)
            # If neither changes, the joint stood still or was in none of the messages.
            news = np.flatnonzero(
                (np.diff(q, prepend=last[0]) != 0.0) | (np.diff(reported, prepend=last[1]) != 0.0)
            )
            last = q[-1:], reported[-1:]
            columns = (q, reported, timeline.stamps[rows], timeline.t[rows])
            piece = [*(column[news] for column in columns), news + rows.start]
            if before is not None:
                piece = [np.concatenate(pair) for pair in zip(before, piece)]
            if len(piece[0]):
                yield _JointSamples(*piece)
                before = [column[-1:] for column in piece]

    def intervals(self) -> Iterator[tuple[_JointSamples, _Intervals]]:
        for piece in self.pieces():
            steps, known = np.diff(piece.stamps), ~np.isnan(piece.reported)
            use = (steps > 0) & (steps <= self.longest) & known[1:] & known[:-1]
            safe = np.where(use, steps * 1e-9, 1.0)
            # The mean velocity of an interval against the mean of its ends: right to second order.
            mean = np.where(use, np.diff(piece.q) / safe, 0.0)
            sums = piece.reported[1:] + piece.reported[:-1]
            yield piece, _Intervals(mean, np.where(use, 0.5 * sums, 0.0), use)

    def forwards(self) -> Iterator[Times]:
        for piece in self.pieces():
            steps = np.diff(piece.stamps)
            yield steps[steps > 0]

    def differences(self) -> Iterator[Floats]:
        for _, (mean, ends, use) in self.intervals():
            yield np.abs(ends - mean)[use]

    def times(self) -> Iterator[Floats]:
        for piece, (_, _, use) in self.intervals():
            yield np.diff(piece.t)[use]


def velocity_check(timeline: MotionColumns, j: int, wraps: bool) -> VelocityCheck | None:
    """Return how the reported velocities of joint j agree; None if there is nothing to compare."""
    joint = _Joint(timeline, j, wraps)
    joint.longest = longest_interval(median(joint.forwards()))
    count, row, worst = 0, 0, -1.0
    means = products = squares = 0.0
    motion, least, greatest = SmoothMotion(), math.inf, -math.inf
    for piece, (mean, ends, use) in joint.intervals():
        if not len(mean):
            continue
        off = np.abs(ends - mean)
        count += int(np.sum(use))
        means += float(np.sum(mean**2))
        products += float(np.sum(ends * mean))
        squares += float(np.sum(off**2))
        motion.take(mean, use)
        least, greatest = min(least, float(piece.q.min())), max(greatest, float(piece.q.max()))
        k = int(np.argmax(off))
        if off[k] > worst:
            row, worst = int(piece.rows[k + 1]), float(off[k])
    if count < 4:
        return None
    speed, rms = math.sqrt(means / count), math.sqrt(squares / count)
    moving = motion.square(means / count)
    noise = math.sqrt(max(speed**2 - moving, 0.0))
    jitter = noise * median(joint.times()) / math.sqrt(2.0)
    surely = max(STILL, SURE * noise / count**0.25)
    if moving < surely**2 or greatest - least < MANY_JITTERS * jitter:
        return None
    scale = lag = 0.0
    if rms > WORTH * speed:
        # The noise of the positions is in the differences alone: the motion is the measure.
        scale = _scale(joint, products / count / moving, count, rms)
        lag = 0.0 if scale else _lag(joint, count, rms)
    typical = median(joint.differences())
    return VelocityCheck(rms, typical, worst, row, speed, noise, lag, scale or 1.0)


def _scale(joint: _Joint, scale: float, count: int, rms: float) -> float:
    # Returns the factor by which the reported velocities are too large, 0 if none explains them.
    left = 0.0
    for _, (mean, ends, use) in joint.intervals():
        left += float(np.sum((ends - scale * mean)[use] ** 2))
    believed = math.sqrt(left / count) < BELIEVED * rms
    return scale if believed and abs(scale - 1.0) > SAME_SCALE else 0.0


def _lag(joint: _Joint, count: int, rms: float) -> float:
    # Returns the shift of the reported velocities that brings them nearest, s.
    interval = median(joint.times())
    shifts = interval * np.linspace(-LAGS, LAGS, 8 * LAGS + 1)
    stride = max(1, count // LAG_ROWS)
    trial, seen, first = _ShiftTrial(shifts), 0, True
    for piece, (mean, _, use) in joint.intervals():
        at = np.flatnonzero(use)
        at, seen = at[-seen % stride :: stride], seen + len(at)
        begin = 0 if first else 1  # the message before them was there already
        known = np.flatnonzero(~np.isnan(piece.reported[begin:])) + begin
        trial.take(
            piece.t[known],
            piece.reported[known],
            0.5 * (piece.t[at] + piece.t[at + 1]),
            mean[at],
        )
        first = False
    errors = trial.errors()
    best = int(np.argmin(errors))
    if math.sqrt(float(errors[best])) > BELIEVED * rms or best in (0, len(shifts) - 1):
        return 0.0
    return float(shifts[best])


class _ShiftTrial:
    """Velocities looked up at shifted times, as soon as the samples after them are known."""

    def __init__(self, shifts: Floats) -> None:
        self._shifts = shifts
        nothing = np.zeros(0)
        self._t = self._reported = self._middle = self._mean = nothing
        self._squares: list[list[Floats]] = [[] for _ in shifts]

    def take(self, t: Floats, reported: Floats, middle: Floats, mean: Floats) -> None:
        self._t = np.concatenate([self._t, t])
        self._reported = np.concatenate([self._reported, reported])
        self._middle = np.concatenate([self._middle, middle])
        self._mean = np.concatenate([self._mean, mean])
        if len(self._t):
            self._look_up(int(np.searchsorted(self._middle, self._t[-1] - 2.0 * self._shifts[-1])))
        # The next piece begins at the end of this one; one earlier velocity is enough.
        needed = self._middle[0] if len(self._middle) else self._t[-1:].sum()
        keep = max(int(np.searchsorted(self._t, needed + self._shifts[0])) - 1, 0)
        self._t, self._reported = self._t[keep:], self._reported[keep:]

    def _look_up(self, count: int) -> None:
        middle, mean = self._middle[:count], self._mean[:count]
        for squares, shift in zip(self._squares, self._shifts):
            squares.append((np.interp(middle + shift, self._t, self._reported) - mean) ** 2)
        self._middle, self._mean = self._middle[count:], self._mean[count:]

    def errors(self) -> Floats:
        self._look_up(len(self._middle))
        return np.array([np.mean(np.concatenate(squares)) for squares in self._squares])
