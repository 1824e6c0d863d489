"""
Check the motion of one joint: steps that no speed explains, and velocities that contradict it.

Reported velocities are integrated by trapezoids and compared with the positions at the lag that
fits best. Lags, bursts and noise of healthy drivers pass. The node and `audit` use the same rules.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..kernel import Floats, Integers
from ..robot.robot import Robot

# Smaller differences of positions have no fault (rad, m): encoders, rounding, play.
POSITION_TOLERANCE = (0.02, 0.005)
# A step is a jump if it exceeds this many times the motion at the larger reported speed.
SPEED_MARGIN = 3.0  # by trial: filters of drivers report accelerations late
# Without a reported speed it is a jump beyond this many times the motion at the velocity limit.
LIMIT_MARGIN = 2.0  # by trial: jitter of stamps halves an interval
# Largest speed of a joint without a velocity limit (rad/s, m/s): above those of industrial arms.
FREE_SPEED = (10.0, 2.0)
# In a longer interval (s) a joint can start and stop: reported speeds at its ends explain nothing.
START_AND_STOP = 0.05
# A speed is the mean over this time (s), in which jitter of stamps adds a tenth.
SPEED_BASELINE = 0.2
# Reported velocities are compared over this time (s).
VELOCITY_WINDOW = 1.0
# They are not compared if an interval is longer (s): trapezoids are inexact at less than 7 Hz.
INTERVAL_LIMIT = 0.15
# Filters of drivers delay velocities by up to this time (s); commanded velocities lead by it.
LAG_LIMIT = 0.1
# Integral and position may differ by this much of the larger one: filters do more than delay.
VELOCITY_SHARE = 0.3
# Positions that are compared, at least: two intervals are in each half of the time.
SAMPLE_MINIMUM = 5


def joint_steps(q: Floats, wraps: bool) -> Floats:
    """Return the steps between positions, shape (N - 1,), the shortest way round if it wraps."""
    steps = np.diff(q)
    return np.asarray(np.mod(steps + math.pi, math.tau) - math.pi if wraps else steps)


def jumps(robot: Robot, j: int, t: Floats, q: Floats, qdot: Floats) -> Integers:
    """
    Return the intervals in which joint j jumps: no speed within `LAG_LIMIT` explains its step.

    Messages that are stamped or arrive in pairs were not measured in pairs, so no interval is
    shorter than the median.

    Parameters
    ----------
    t, q, qdot : shape (N,), s, rad or m, rad/s or m/s
        Stamps, positions and velocities; `qdot` is NaN if not reported.
    """
    sliding, steps = bool(robot.prismatic[j]), np.abs(joint_steps(q, bool(robot.continuous[j])))
    intervals, tolerance = np.diff(t), POSITION_TOLERANCE[sliding]
    if np.max(steps, initial=0.0) <= tolerance or not np.any(intervals > 0.0):
        return np.zeros(0, dtype=np.int64)
    usual = float(np.median(intervals[intervals > 0.0]))
    intervals = np.maximum(intervals, usual)
    near = min(math.ceil(LAG_LIMIT / usual), len(t))  # messages by which reported speeds may lag
    speeds = sliding_window_view(np.pad(np.abs(qdot), near, 'edge'), 2 * near + 1).max(axis=1)
    reported = SPEED_MARGIN * np.maximum(speeds[1:], speeds[:-1])
    limit = LIMIT_MARGIN * float(robot.velocity_limits[j])
    otherwise = limit if math.isfinite(limit) else FREE_SPEED[sliding]
    unknown = np.isnan(reported) | (intervals > START_AND_STOP)
    explained = np.where(unknown, otherwise, reported) * intervals + tolerance
    return np.flatnonzero(steps > explained)


def integral(t: Floats, qdot: Floats) -> Floats:
    """Return the integral of velocities from the first time on, by trapezoids."""
    return np.append(0.0, np.cumsum(0.5 * (qdot[1:] + qdot[:-1]) * np.diff(t)))


def largest_speed(t: Floats, q: Floats) -> float:
    """Return the largest mean speed over `SPEED_BASELINE`."""
    ends = np.searchsorted(t, t + SPEED_BASELINE)
    begins = np.flatnonzero(ends < len(t))
    ends = ends[begins]
    return float(np.max(np.abs(q[ends] - q[begins]) / (t[ends] - t[begins]), initial=0.0))


def path_errors(t: Floats, q: Floats, qdot: Floats, lags: Floats) -> Floats:
    """
    Return the integral of velocities that are late by L lags (s), less the positions.

    Shape (L, N), rad or m; NaN if the time is beyond the ends. The constant has no meaning.
    """
    path, nan = integral(t, qdot), math.nan
    return np.stack([np.interp(t + lag, t, path, left=nan, right=nan) - q for lag in lags])


def scale_in_words(scale: float) -> str:
    """Return what a ratio of reported velocities to those by the positions means."""
    degrees, flipped = abs(scale - math.degrees(1.0)) < 2.0, abs(scale + 1.0) < 0.1
    cause = ': degrees?' if degrees else ': wrong sign' if flipped else ''
    return f'{scale:.3g} times the change of its position{cause}'


def contradiction(t: Floats, q: Floats, qdot: Floats, tolerance: float, unit: str) -> str:
    """Return how reported velocities contradict the positions of the last second; '' if not."""
    late = t >= t[-1] - VELOCITY_WINDOW
    t, q, qdot = t[late], q[late], qdot[late]
    longest, path = float(np.max(np.diff(t), initial=0.0)), integral(t, qdot)
    if longest > INTERVAL_LIMIT or np.ptp(path - q) <= tolerance:
        return ''
    errors = path_errors(t, q, qdot, np.linspace(-LAG_LIMIT, LAG_LIMIT, 11))
    inner = ~np.isnan(errors).any(axis=0)
    if inner.sum() < SAMPLE_MINIMUM:
        return ''
    q, path, off = q[inner], path[inner], float(np.ptp(errors[:, inner], axis=1).min())
    moved, motion, fastest = float(np.ptp(q)), float(np.ptp(path)), float(np.max(np.abs(qdot)))
    if off <= tolerance + 0.5 * longest * fastest + VELOCITY_SHARE * max(moved, motion):
        return ''
    if moved <= tolerance:
        return f'up to {fastest:.3g} {unit}/s, but its position moves by {moved:.1g} {unit}'
    # The latest half may have the cause alone.
    x, y = (half - np.mean(half) for half in (q[len(q) // 2 :], path[len(q) // 2 :]))
    scale = float(np.dot(x, y) / max(np.dot(x, x), np.finfo(float).tiny))
    if np.ptp(y - scale * x) > VELOCITY_SHARE * np.ptp(y):
        return f'off by {off:.2g} {unit} within a second'
    return scale_in_words(scale)
