"""
What each joint did: range, limits, jumps, and its reported velocity against its positions.

"""

import math
from typing import NamedTuple

import numpy as np

from ..joint_table import LIMIT_SLACK
from ..kernel import Floats
from ..robot import Robot
from .block import Flags, Times
from .timeline import Timeline

# A step is a jump where it exceeds, by so much (rad, m), what three times the larger reported
# speed covers; without reported speeds, twice the velocity limit; without that, these speeds.
JUMP = (0.02, 0.005)
SPEED_MARGIN, LIMIT_MARGIN = 3.0, 2.0
FREE_SPEED = (10.0, 2.0)
# A position this near to its limit touches it (rad, m).
TOUCHES = (math.radians(0.5), 1e-3)
# Positions beyond their limits by more than a turn are perhaps degrees.
DEGREES_BEYOND = math.tau
MOST_JUMPS = 100
# Lags tried, in median intervals; and messages they are tried on.
LAGS, LAG_ROWS = 12, 50_000
# A lag is believed where it takes this share of the difference away, and a scale likewise.
BELIEVED = 0.6
# Differences below this share of the speed need no explanation; scales this near to 1 are none.
WORTH, SAME_SCALE = 0.002, 0.05
# Slower than this (rad/s, m/s; RMS) there is nothing to compare; nor where so many standard errors
# of the noise could be the motion, or the way is no longer than so many jitters of a position.
STILL, SURE, MANY_JITTERS = 1e-3, math.sqrt(6.0), 20.0


class Jump(NamedTuple):
    """
    A step of a joint (rad or m) that its speed does not explain; `row` is the state after it.

    """

    row: int
    joint: str
    step: float
    seconds: float


class VelocityCheck(NamedTuple):
    """
    Reported velocities of a joint against differences of its positions, rad/s or m/s.

    Attributes
    ----------
    rms, typical, worst
        RMS, median and largest of their difference; `row` is where it is worst.
    speed
        RMS of the differences themselves.
    noise
        RMS of what in them is noise of the positions.
    lag : s
        By which the velocities come late, 0 where none is believable.
    scale
        Reported over differentiated: -1 a wrong sign, 57.3 degrees; 1 where none is believable.

    """

    rms: float
    typical: float
    worst: float
    row: int
    speed: float
    noise: float
    lag: float
    scale: float


class JointReport(NamedTuple):
    """
    One joint over a recording, rad or m.

    Attributes
    ----------
    least, greatest
        Of its positions.
    lower, upper
        Its limits; infinite where there are none.
    beyond, touching
        States beyond a limit, and at one.
    first_beyond, worst_beyond
        Row of the first state beyond a limit, -1 where there is none; by how much it is beyond.
    fastest, velocity_limit, too_fast
        Largest speed known, its limit, and states above it.
    check
        None where the messages report no velocity, or the joint stands still as far as the noise
        of its positions lets one tell.

    """

    name: str
    sliding: bool
    least: float
    greatest: float
    lower: float
    upper: float
    beyond: int
    touching: int
    first_beyond: int
    worst_beyond: float
    fastest: float
    velocity_limit: float
    too_fast: int
    check: VelocityCheck | None


def joint_reports(robot: Robot, timeline: Timeline) -> tuple[JointReport, ...]:
    """
    Return what each joint did, in the order of the arm.

    """
    return tuple(_report(robot, timeline, j) for j in range(robot.dof))


def _report(robot: Robot, timeline: Timeline, j: int) -> JointReport:
    q = timeline.q[:, j]
    lower, upper = robot.limits[j].tolist()
    sliding = robot.joint_types[j] == 'prismatic'
    excess = np.maximum(lower - q, q - upper)
    beyond = excess > LIMIT_SLACK
    speeds = np.abs(timeline.qdot[:, j])
    fastest = float(np.nanmax(speeds)) if np.any(~np.isnan(speeds)) else math.nan
    with np.errstate(invalid='ignore'):
        too_fast = int(np.sum(speeds > robot.velocity_limits[j] * (1.0 + LIMIT_SLACK)))
    return JointReport(
        name=robot.joint_names[j],
        sliding=sliding,
        least=float(np.min(q)),
        greatest=float(np.max(q)),
        lower=lower,
        upper=upper,
        beyond=int(np.sum(beyond)),
        touching=int(np.sum((excess > -TOUCHES[sliding]) & ~beyond)),
        first_beyond=int(np.argmax(beyond)) if np.any(beyond) else -1,
        worst_beyond=float(max(np.max(excess), 0.0)),
        fastest=fastest,
        velocity_limit=float(robot.velocity_limits[j]),
        too_fast=too_fast,
        check=_velocity_check(timeline, _unwrapped(robot, timeline, j), j),
    )


def look_like_degrees(reports: tuple[JointReport, ...]) -> bool:
    """
    Return whether positions are so far beyond the limits that they may be degrees.

    """
    turning = [report for report in reports if not report.sliding]
    far = [report for report in turning if report.worst_beyond > DEGREES_BEYOND]
    wild = [r for r in turning if math.isinf(r.upper) and r.greatest - r.least > 10 * math.tau]
    return len(far) + len(wild) >= min(2, len(turning)) > 0


def _unwrapped(robot: Robot, timeline: Timeline, j: int) -> Floats:
    q: Floats = timeline.q[:, j]
    return np.unwrap(q) if robot.continuous[j] else q


def _steady(stamps: Times) -> Flags:
    # Whether each state follows the one before it within a time that means something.
    steps = np.diff(stamps)
    forwards = steps[steps > 0]
    longest = 5.0 * float(np.median(forwards)) if len(forwards) else 0.0
    steady: Flags = (steps > 0) & (steps <= longest)
    return steady


def jumps_of(robot: Robot, timeline: Timeline) -> tuple[int, tuple[Jump, ...]]:
    """
    Return how many jumps there are, and the first of them.

    """
    steady = _steady(timeline.stamps)
    intervals = np.diff(timeline.stamps) * 1e-9
    found: list[Jump] = []
    for j in range(robot.dof):
        sliding = robot.joint_types[j] == 'prismatic'
        steps = np.diff(_unwrapped(robot, timeline, j))
        speeds = np.abs(np.where(timeline.differenced, np.nan, timeline.qdot[:, j]))
        reported = SPEED_MARGIN * np.fmax(speeds[1:], speeds[:-1])
        limit = LIMIT_MARGIN * float(robot.velocity_limits[j])
        otherwise = limit if math.isfinite(limit) else FREE_SPEED[sliding]
        explained = np.where(np.isnan(reported), otherwise, reported) * intervals
        odd = steady & (np.abs(steps) > explained + JUMP[sliding])
        found += [
            Jump(k + 1, robot.joint_names[j], float(steps[k]), float(intervals[k]))
            for k in np.flatnonzero(odd).tolist()
        ]
    found.sort()
    return len(found), tuple(found[:MOST_JUMPS])


def _velocity_check(timeline: Timeline, q: Floats, j: int) -> VelocityCheck | None:
    reported = np.where(timeline.differenced, np.nan, timeline.qdot[:, j])
    # Where neither changes, the joint stood still or was in none of the messages.
    news = np.flatnonzero(
        (np.diff(q, prepend=np.nan) != 0.0) | (np.diff(reported, prepend=np.nan) != 0.0)
    )
    q, reported, stamps, t = q[news], reported[news], timeline.stamps[news], timeline.t[news]
    use = _steady(stamps) & ~np.isnan(reported[1:]) & ~np.isnan(reported[:-1])
    if np.sum(use) < 4:
        return None
    intervals = np.diff(stamps) * 1e-9
    safe = np.where(use, intervals, 1.0)
    # The mean velocity of an interval against the mean of its ends: right to second order.
    mean = np.where(use, np.diff(q) / safe, 0.0)
    ends = np.where(use, 0.5 * (reported[1:] + reported[:-1]), 0.0)
    off = np.abs(ends - mean)
    speed = math.sqrt(float(np.sum(mean**2)) / float(np.sum(use)))
    motion = _motion(mean, use)
    noise = math.sqrt(max(speed**2 - motion**2, 0.0))
    jitter = noise * float(np.median(intervals[use])) / math.sqrt(2.0)
    if motion < max(STILL, SURE * noise / len(use) ** 0.25) or np.ptp(q) < MANY_JITTERS * jitter:
        return None
    rms = math.sqrt(float(np.sum(off**2)) / float(np.sum(use)))
    typical = float(np.median(off[use]))
    worst = int(np.argmax(off))
    scale = lag = 0.0
    if rms > WORTH * speed:
        scale = _scale(mean, ends, use, motion, rms)
        lag = 0.0 if scale else _lag(t, mean, reported, use, rms)
    return VelocityCheck(
        rms, typical, float(off[worst]), int(news[worst + 1]), speed, noise, lag, scale or 1.0
    )


def _motion(mean: Floats, use: Flags) -> float:
    # RMS of the differences without the noise of the positions. That of one position is in two
    # differences, next to each other; the product of one and the next but one is free of it, and
    # the speed hardly changes in between.
    both = use[2:] & use[1:-1] & use[:-2]
    if not np.any(both):
        return math.sqrt(float(np.sum(mean**2)) / float(np.sum(use)))
    return math.sqrt(max(float(np.mean((mean[2:] * mean[:-2])[both])), 0.0))


def _scale(mean: Floats, ends: Floats, use: Flags, motion: float, rms: float) -> float:
    # By which factor the reported velocities are too large, 0 where none explains them. The noise
    # of the positions is in the differences alone, so the motion without it is the measure.
    scale = float(np.mean((ends * mean)[use])) / motion**2
    left = math.sqrt(float(np.mean((ends - scale * mean)[use] ** 2)))
    return scale if left < BELIEVED * rms and abs(scale - 1.0) > SAME_SCALE else 0.0


def _lag(t: Floats, mean: Floats, reported: Floats, use: Flags, rms: float) -> float:
    # The shift of the reported velocities that brings them nearest, s.
    at = np.flatnonzero(use)
    at = at[:: max(1, len(at) // LAG_ROWS)]
    interval = float(np.median(np.diff(t)[use]))
    known = ~np.isnan(reported)
    middle = 0.5 * (t[at] + t[at + 1])
    shifts = interval * np.linspace(-LAGS, LAGS, 8 * LAGS + 1)
    errors = np.array(
        [
            np.mean((np.interp(middle + shift, t[known], reported[known]) - mean[at]) ** 2)
            for shift in shifts
        ]
    )
    best = int(np.argmin(errors))
    if math.sqrt(float(errors[best])) > BELIEVED * rms or best in (0, len(shifts) - 1):
        return 0.0
    return float(shifts[best])
