# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the motion of one joint for jumps and for velocities that contradict the positions.

Reported velocities are integrated by trapezoids, shifted in time by the lag at which they agree
best with the positions, and compared with the positions. Lags, bursts and noise of healthy drivers
are not faults. The node and the command `audit` use these rules.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..kernel import Floats, Integers
from ..robot.robot import Robot
from .joint_state_columns import Flags

# A joint's position may differ by this much (revolute: rad, prismatic: m) from its position in the
# previous message, or from the integral of its velocities, without a fault. The reason is that
# encoders round and joints have backlash.
POSITION_TOLERANCE = (0.02, 0.005)
# A step of position is a jump if it exceeds this factor times the motion at the reported speed.
# The factor was found by trial. It is above 1, because drivers filter the speed: while a joint
# accelerates, the reported speed is lower than the true speed.
SPEED_MARGIN = 3.0
# If no speed is reported, a step of position is a jump if it exceeds this factor times the motion
# at the velocity limit. The factor was found by trial. It is above 1, because jitter of stamps can
# halve the time between two messages. This time, multiplied by the velocity limit, then gives only
# half of the possible motion.
LIMIT_MARGIN = 2.0
# Velocity limit of a joint without a limit in the robot file, rad/s and m/s. Industrial arms are
# slower.
FREE_SPEED = (10.0, 2.0)
# Longest interval for which reported speeds bound the motion, s. Within a longer interval a joint
# can start and stop without a reported speed.
START_AND_STOP = 0.05
# Time over which a speed is averaged, s. Jitter of stamps changes the average by up to 10 %.
SPEED_BASELINE = 0.2
# Time over which reported velocities are compared with the positions, s.
VELOCITY_WINDOW = 1.0
# Velocities are compared with positions if intervals between messages are at most this, s. Below 7
# Hz the trapezoidal rule is inexact.
INTERVAL_LIMIT = 0.15
# Largest delay or lead of velocities relative to positions, s. Filters delay velocities; commanded
# velocities lead.
LAG_LIMIT = 0.1
# The integral of a joint's reported velocities is compared with the change of the joint's reported
# positions. This is the largest accepted difference, divided by the larger of the two motions.
# Drivers that smooth velocities show a difference without being faulty.
VELOCITY_SHARE = 0.3
# Smallest number of positions of a joint for a check of its motion. Five positions give two
# intervals in the first half of the time and two in the second.
SAMPLE_MINIMUM = 5


def joint_steps(q: Floats, wraps: bool) -> Floats:
    """
    Return the differences of successive positions, shape (N - 1,), rad or m. If `wraps` is True, a
    difference is at most half a turn.
    """
    steps = np.diff(q)
    return np.asarray(np.mod(steps + math.pi, math.tau) - math.pi if wraps else steps)


def jumps(robot: Robot, j: int, t: Floats, q: Floats, qdot: Floats) -> Integers:
    """
    Return the indices of the intervals between messages in which joint j moves too far for its
    speed.

    The speed is the largest reported speed within `LAG_LIMIT` of the interval. A time between two
    stamps that is shorter than the median of these times is replaced by the median. The reason is
    that two messages may have nearly equal stamps although they were measured at different times.

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
    near = min(math.ceil(LAG_LIMIT / usual), len(t))  # LAG_LIMIT as a number of messages
    speeds = sliding_window_view(np.pad(np.abs(qdot), near, 'edge'), 2 * near + 1).max(axis=1)
    reported = SPEED_MARGIN * np.maximum(speeds[1:], speeds[:-1])
    limit = LIMIT_MARGIN * float(robot.velocity_limits[j])
    otherwise = limit if math.isfinite(limit) else FREE_SPEED[sliding]
    unknown = np.isnan(reported) | (intervals > START_AND_STOP)
    explained = np.where(unknown, otherwise, reported) * intervals + tolerance
    return np.flatnonzero(steps > explained)


def integral(t: Floats, qdot: Floats) -> Floats:
    """Return the integral of velocities (N,) or (N, k) from t[0] to each time, by trapezoids."""
    steps = (0.5 * (qdot[1:] + qdot[:-1]).T * np.diff(t)).T
    return np.concatenate([np.zeros_like(qdot[:1]), np.cumsum(steps, axis=0)])


def largest_speed(t: Floats, q: Floats) -> Floats:
    """
    Return each joint's largest mean speed over `SPEED_BASELINE`; q is (N,) or (N, k) at times t.
    """
    ends = np.searchsorted(t, t + SPEED_BASELINE)
    begins = np.flatnonzero(ends < len(t))
    ends = ends[begins]
    speeds = np.abs(q[ends] - q[begins]).T / (t[ends] - t[begins])
    return np.asarray(np.max(speeds, axis=-1, initial=0.0))


def path_errors(t: Floats, q: Floats, qdot: Floats, lags: Floats) -> Floats:
    """
    Return the integrated velocities, shifted in time by each of L lags (s), minus the positions.

    The shape is (L, N), in rad or m. Each row contains an arbitrary constant, because the integral
    starts at 0. Entries are NaN if the shifted time is outside `t`.
    """
    path, nan = integral(t, qdot), math.nan
    return np.stack([np.interp(t + lag, t, path, left=nan, right=nan) - q for lag in lags])


def scale_in_words(scale: float) -> str:
    """
    Return a text with the ratio `scale` and the likely cause of this ratio.

    `scale` compares two motions of a joint: the integral of its reported velocities, divided by
    the change of its reported positions.
    """
    degrees, flipped = abs(scale - math.degrees(1.0)) < 2.0, abs(scale + 1.0) < 0.1
    cause = ': degrees?' if degrees else ': wrong sign' if flipped else ''
    return f'{scale:.3g} times the change of its position{cause}'


def suspects(t: Floats, q: Floats, qdot: Floats, tolerances: Floats) -> Flags:
    """
    Return for each of k joints whether `jumps` or `contradiction` could find a fault, shape (k,).

    This test is faster: it needs few array operations for all joints together. `jumps` and
    `contradiction` need thirty operations for each joint.
    """
    late = t >= t[-1] - VELOCITY_WINDOW
    agree = np.ptp(integral(t[late], qdot[late]) - q[late], axis=0) <= tolerances
    agree |= np.isnan(qdot[late]).all(axis=0)
    return np.asarray(~agree | (np.abs(np.diff(q, axis=0)).max(axis=0) > tolerances))


def contradiction(t: Floats, q: Floats, qdot: Floats, tolerance: float, unit: str) -> str:
    """
    Return a text that says how reported velocities contradict the positions of the last second, or
    ''.
    """
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
    # Fit the ratio (integrated velocities / positions) only over the second half of the time. If
    # the fault began in the first half, it acts during all of the second half.
    x, y = (half - np.mean(half) for half in (q[len(q) // 2 :], path[len(q) // 2 :]))
    scale = float(np.dot(x, y) / max(np.dot(x, x), np.finfo(float).tiny))
    if np.ptp(y - scale * x) > VELOCITY_SHARE * np.ptp(y):
        return f'off by {off:.2g} {unit} within a second'
    return scale_in_words(scale)
