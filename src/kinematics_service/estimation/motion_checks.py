"""
Check the motion of one joint: steps too large for its speed, and contradictory velocities.

Reported velocities are integrated by trapezoids and compared with the positions at the best lag.
Lags, bursts and noise of healthy drivers pass. The node and `audit` use the same rules.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..kernel import Floats, Integers
from ..robot.robot import Robot
from .joint_state_columns import Flags

# Smaller differences of positions are not faults, rad, m: encoders, rounding, backlash.
POSITION_TOLERANCE = (0.02, 0.005)
# A step is a jump above this times the motion at the larger reported speed.
SPEED_MARGIN = 3.0  # by trial: filters of drivers report accelerations late
# Without a reported speed, a step is a jump above this times the motion at the velocity limit.
LIMIT_MARGIN = 2.0  # by trial: jitter of stamps halves an interval
# Speed of a joint without a velocity limit, rad/s, m/s: above that of industrial arms.
FREE_SPEED = (10.0, 2.0)
# A joint can start and stop within a longer interval, s, so reported speeds at both ends of such
# an interval are not used.
START_AND_STOP = 0.05
# Time over which a speed is averaged, s: jitter of stamps adds 10 %.
SPEED_BASELINE = 0.2
# Time over which reported velocities are compared, s.
VELOCITY_WINDOW = 1.0
# Longest interval of the comparison, s: trapezoids are inexact below 7 Hz.
INTERVAL_LIMIT = 0.15
# Largest delay of velocities by filters, and largest lead of commanded velocities, s.
LAG_LIMIT = 0.1
# Largest difference of the integrated and the reported motion, relative to the larger motion:
# filters of drivers smooth velocities.
VELOCITY_SHARE = 0.3
# Smallest number of positions in a check: two intervals in each half of the time.
SAMPLE_MINIMUM = 5


def joint_steps(q: Floats, wraps: bool) -> Floats:
    """
    Return the steps between positions, shape (N - 1,), rad or m; with `wraps` at most half a turn.
    """
    steps = np.diff(q)
    return np.asarray(np.mod(steps + math.pi, math.tau) - math.pi if wraps else steps)


def jumps(robot: Robot, j: int, t: Floats, q: Floats, qdot: Floats) -> Integers:
    """
    Return the indices of intervals in which the step of joint j is too large for its speed.

    The speed is the largest reported one within `LAG_LIMIT` of the interval. Intervals shorter
    than the median count as the median: two messages may have nearly equal stamps although their
    measurements are apart.

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
    near = min(math.ceil(LAG_LIMIT / usual), len(t))  # largest lag of reported speeds, messages
    speeds = sliding_window_view(np.pad(np.abs(qdot), near, 'edge'), 2 * near + 1).max(axis=1)
    reported = SPEED_MARGIN * np.maximum(speeds[1:], speeds[:-1])
    limit = LIMIT_MARGIN * float(robot.velocity_limits[j])
    otherwise = limit if math.isfinite(limit) else FREE_SPEED[sliding]
    unknown = np.isnan(reported) | (intervals > START_AND_STOP)
    explained = np.where(unknown, otherwise, reported) * intervals + tolerance
    return np.flatnonzero(steps > explained)


def integral(t: Floats, qdot: Floats) -> Floats:
    """Return the integral of velocities (N,) or (N, k) from the first time, by trapezoids."""
    steps = (0.5 * (qdot[1:] + qdot[:-1]).T * np.diff(t)).T
    return np.concatenate([np.zeros_like(qdot[:1]), np.cumsum(steps, axis=0)])


def largest_speed(t: Floats, q: Floats) -> Floats:
    """
    Return the largest mean speed over `SPEED_BASELINE`, for positions (N,) or (N, k) at times t.
    """
    ends = np.searchsorted(t, t + SPEED_BASELINE)
    begins = np.flatnonzero(ends < len(t))
    ends = ends[begins]
    speeds = np.abs(q[ends] - q[begins]).T / (t[ends] - t[begins])
    return np.asarray(np.max(speeds, axis=-1, initial=0.0))


def path_errors(t: Floats, q: Floats, qdot: Floats, lags: Floats) -> Floats:
    """
    Return the integrated velocities, shifted by each of L lags (s), minus the positions.

    Shape (L, N), rad or m, up to a constant. NaN if the shifted time is outside of `t`.
    """
    path, nan = integral(t, qdot), math.nan
    return np.stack([np.interp(t + lag, t, path, left=nan, right=nan) - q for lag in lags])


def scale_in_words(scale: float) -> str:
    """Return a text with the ratio of integrated to reported motion, and its likely cause."""
    degrees, flipped = abs(scale - math.degrees(1.0)) < 2.0, abs(scale + 1.0) < 0.1
    cause = ': degrees?' if degrees else ': wrong sign' if flipped else ''
    return f'{scale:.3g} times the change of its position{cause}'


def suspects(t: Floats, q: Floats, qdot: Floats, tolerances: Floats) -> Flags:
    """
    Return for each of k joints whether `jumps` or `contradiction` may find a fault, shape (k,).

    This test takes few array operations for all joints; `jumps` and `contradiction` take thirty
    for each joint.
    """
    late = t >= t[-1] - VELOCITY_WINDOW
    agree = np.ptp(integral(t[late], qdot[late]) - q[late], axis=0) <= tolerances
    agree |= np.isnan(qdot[late]).all(axis=0)
    return np.asarray(~agree | (np.abs(np.diff(q, axis=0)).max(axis=0) > tolerances))


def contradiction(t: Floats, q: Floats, qdot: Floats, tolerance: float, unit: str) -> str:
    """Return how reported velocities contradict the positions of the last second, or ''."""
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
    # Fit the ratio to the second half of the time, because the first half may be from before the
    # fault.
    x, y = (half - np.mean(half) for half in (q[len(q) // 2 :], path[len(q) // 2 :]))
    scale = float(np.dot(x, y) / max(np.dot(x, x), np.finfo(float).tiny))
    if np.ptp(y - scale * x) > VELOCITY_SHARE * np.ptp(y):
        return f'off by {off:.2g} {unit} within a second'
    return scale_in_words(scale)
