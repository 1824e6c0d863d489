# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Report the motion of each joint: range, limits, jumps, and a check of the reported velocities.

The motion of a joint between two states is a jump if the joint's speed is too low to explain it.
"""

import math
from typing import NamedTuple

import numpy as np

from ....estimation.joint_memory import LIMIT_TOLERANCE
from ....estimation.motion_checks import joint_steps, jumps
from ....robot.robot import Robot
from ..readers.stored_columns import median, spans
from .reported_velocities import INTERVAL_FACTOR, VelocityCheck, velocity_check
from .stream import steps_of
from .timeline import Timeline

# A joint is at its limit if its distance to the limit is less than this: rad for revolute joints,
# m for prismatic joints.
LIMIT_MARGIN = (math.radians(0.5), 1e-3)
# If a position is beyond its limit by more than this (rad), the positions may be in degrees.
DEGREES_BEYOND = math.tau
# Largest number of jumps listed in the report.
MAX_JUMPS = 100


class Jump(NamedTuple):
    """
    A jump: `step` (rad or m) is the motion of a joint between two states, too large for the
    joint's speed. `row` is the second of these states.
    """

    row: int
    joint: str
    step: float
    seconds: float


class JointReport(NamedTuple):
    """
    Statistics of the motion of one joint over a recording, rad or m.

    Attributes
    ----------
    least, greatest
        Least and greatest recorded position of the joint.
    lower, upper
        Limits of the position; infinite without limits.
    beyond, touching
        `beyond` is the number of states in which the joint is beyond a limit, `touching` the
        number of states in which it is exactly at a limit.
    worst_beyond
        Largest distance beyond a limit.
    fastest, velocity_limit, too_fast
        Largest known speed of the joint, its velocity limit, and number of states above this
        limit.
    check
        Check of the reported velocities. None if no velocities are reported, or if the joint moves
        less than the noise of its positions.
    """

    name: str
    sliding: bool
    least: float
    greatest: float
    lower: float
    upper: float
    beyond: int
    touching: int
    worst_beyond: float
    fastest: float
    velocity_limit: float
    too_fast: int
    check: VelocityCheck | None


def joint_reports(robot: Robot, timeline: Timeline) -> tuple[JointReport, ...]:
    """Return a report of each joint of a recording, in the order of the arm's joints."""
    return tuple(_report(robot, timeline, j) for j in range(robot.dof))


def _report(robot: Robot, timeline: Timeline, j: int) -> JointReport:
    lower, upper = robot.limits[j].tolist()
    sliding = bool(robot.prismatic[j])
    top = robot.velocity_limits[j] * (1.0 + LIMIT_TOLERANCE)
    least, greatest, worst, fastest = math.inf, -math.inf, 0.0, math.nan
    beyond = touching = too_fast = 0
    for rows in spans(len(timeline)):
        q = timeline.q.columns[j][rows]
        excess = np.maximum(lower - q, q - upper)
        outside = excess > LIMIT_TOLERANCE
        beyond += int(np.sum(outside))
        touching += int(np.sum((excess > -LIMIT_MARGIN[sliding]) & ~outside))
        least, greatest = min(least, float(np.min(q))), max(greatest, float(np.max(q)))
        worst = max(worst, float(np.max(excess)))
        speeds = np.abs(timeline.qdot.columns[j][rows])
        with np.errstate(invalid='ignore'):
            too_fast += int(np.sum(speeds > top))
        if np.any(~np.isnan(speeds)):
            fastest = float(np.fmax(fastest, np.nanmax(speeds)))
    return JointReport(
        name=robot.joint_names[j],
        sliding=sliding,
        least=least,
        greatest=greatest,
        lower=lower,
        upper=upper,
        beyond=beyond,
        touching=touching,
        worst_beyond=worst,
        fastest=fastest,
        velocity_limit=float(robot.velocity_limits[j]),
        too_fast=too_fast,
        check=velocity_check(timeline, j, bool(robot.continuous[j])),
    )


def look_like_degrees(reports: tuple[JointReport, ...]) -> bool:
    """
    Return whether the joint positions may be in degrees, because they are far beyond the limits.
    """
    turning = [report for report in reports if not report.sliding]
    far = [report for report in turning if report.worst_beyond > DEGREES_BEYOND]
    wild = [r for r in turning if math.isinf(r.upper) and r.greatest - r.least > 10 * math.tau]
    return len(far) + len(wild) >= min(2, len(turning)) > 0


def jumps_of(robot: Robot, timeline: Timeline) -> tuple[int, tuple[Jump, ...]]:
    """Return the number of jumps in a recording, and the first `MAX_JUMPS` jumps."""
    usual = median(steps[steps > 0] for _, steps in steps_of(timeline.stamps))
    count, first = 0, list[Jump]()
    for rows in spans(len(timeline)):
        span = slice(max(rows.start - 1, 0), rows.stop)
        gaps, differenced = np.diff(timeline.stamps[span]), timeline.differenced[span]
        steady, span_jumps = (gaps > 0) & (gaps <= INTERVAL_FACTOR * usual), list[Jump]()
        for j in range(robot.dof):
            q, speeds = timeline.q.columns[j][span], timeline.qdot.columns[j][span]
            odd = jumps(robot, j, timeline.t[span], q, np.where(differenced, np.nan, speeds))
            odd, steps = odd[steady[odd]], joint_steps(q, bool(robot.continuous[j]))
            count += len(odd)
            span_jumps += [
                Jump(span.start + k + 1, robot.joint_names[j], float(steps[k]), gaps[k] * 1e-9)
                for k in odd[:MAX_JUMPS].tolist()
            ]
        first = (first + sorted(span_jumps))[:MAX_JUMPS]
    return count, tuple(first)
