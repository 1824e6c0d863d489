# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the gauges of the panel: distance to a singular pose, time to the threshold, joint limits.
"""

import math
from typing import NamedTuple

from ....kinematics.singularity import watched_value
from ....node.drawing.observation import Observation
from ....node.drawing.scene import distance_text, factor_name
from ....robot.measures import MEASURES, Level

# Value at which the gauge of a singularity measure is full, divided by the threshold of WARN.
FULL_RATIO = 5.0
# The gauge of the predicted time to the WARN threshold is full at this time (s) or longer.
FULL_TIME = 10.0
# The gauge of the predicted time to the WARN threshold has the colour of WARN below this time (s).
WARN_TIME = 2.0
# A joint is near a limit if its distance from the limit, divided by the joint's range, is below
# this value. If only one limit is finite, the distance itself, in rad or m, is compared with this
# value.
LIMIT_MARGIN = 0.05

LEVEL_WORDS = {
    Level.OK: 'OK',
    Level.WARN: 'NEAR A SINGULARITY',
    Level.ERROR: 'AT A SINGULARITY',
    Level.STALE: 'NO NEW JOINT STATES',
}


class Gauge(NamedTuple):
    """
    A gauge of the panel, filled between 0 (bad) and 1 (good).

    Attributes
    ----------
    name, title, text
        A key for programs, the title, and the value as text.
    fraction
        Filled part, 0 to 1.
    marks
        Pairs (position 0 to 1, value as text) of the thresholds of ERROR and WARN.
    level
        The level whose colour the gauge has.
    """

    name: str
    title: str
    text: str
    fraction: float
    marks: tuple[tuple[float, str], ...]
    level: Level


class JointReading(NamedTuple):
    """
    The position of a joint between its limits, as the panel shows it.

    Attributes
    ----------
    name, text
        The name of the joint, and its position with unit.
    fraction
        Position between the limits, 0 to 1; None unless both limits are finite.
    remark
        `near lower limit`, `beyond upper limit`, or empty.
    level
        OK, WARN near a joint limit, ERROR beyond it.
    """

    name: str
    text: str
    fraction: float | None
    remark: str
    level: Level


def headline(seen: Observation) -> str:
    """
    Return the singularity status as text. For WARN and ERROR, add the name of the singular factor
    that is nearest to zero.
    """
    words = LEVEL_WORDS[seen.level]
    name = factor_name(seen) if seen.level in (Level.WARN, Level.ERROR) else ''
    return f'{words}: {name}' if name else words


def gauges_of(seen: Observation) -> tuple[Gauge, ...]:
    """
    Return the gauges: the measure that has thresholds, the distance to singularity, the time to
    the WARN threshold, and the factor by which the node scales commands.
    """
    thresholds = seen.robot.singularity.thresholds
    measure = MEASURES[thresholds.measure]
    value = watched_value(seen.robot, seen.singularity)
    full = FULL_RATIO * thresholds.warn if measure.small_is_bad else thresholds.warn / FULL_RATIO

    def fraction(value: float) -> float:
        if not measure.small_is_bad:  # a condition number is best at 1, and worst at infinity
            return min(1.0, full / value)
        return min(1.0, max(0.0, value / full))

    title = measure.long or measure.words
    text = distance_text(seen) if _is_distance(seen) else f'{value:.4g}'
    limits = (thresholds.stop, thresholds.warn)
    marks = tuple((fraction(limit), f'{limit:g}') for limit in limits)
    gauges = [Gauge('measure', title, text, fraction(value), marks, seen.level)]
    if not _is_distance(seen):
        title, filled = MEASURES['distance'].long, min(1.0, seen.singularity.distance / 0.5)
        gauges.append(Gauge('distance', title, distance_text(seen), filled, (), seen.level))
    return (*gauges, _time_gauge(seen), *_scale_gauges(seen))


def _scale_gauges(seen: Observation) -> tuple[Gauge, ...]:
    # Return the gauge of the factor by which the node scales velocity commands; none if the node
    # receives no commands, because then it publishes no factor.
    if seen.scale is None:
        return ()
    value, cause, level = seen.scale
    text = f'{value:.2f}: {cause}' if cause else f'{value:.2f}'
    filled = min(1.0, max(0.0, value))
    return (Gauge('scale', 'share of the command that may be kept', text, filled, (), level),)


def _is_distance(seen: Observation) -> bool:
    return seen.robot.singularity.thresholds.measure == 'distance'


def _time_gauge(seen: Observation) -> Gauge:
    time = seen.singularity.time_to_warning
    title = 'time to the WARN threshold'
    if seen.level in (Level.WARN, Level.ERROR):
        return Gauge('time', title, 'beyond it already', 0.0, (), seen.level)
    if time is None:
        return Gauge('time', title, 'unknown: no velocity', 0.0, (), Level.STALE)
    time = float(time)
    if math.isinf(time):
        return Gauge('time', title, 'not approaching', 1.0, (), Level.OK)
    text = f'{time:.1f} s at this velocity' if time < 1000.0 else 'not soon'
    level = Level.WARN if time < WARN_TIME else Level.OK
    marks = ((WARN_TIME / FULL_TIME, f'{WARN_TIME:.0f} s'),)
    return Gauge('time', title, text, min(1.0, time / FULL_TIME), marks, level)


def joint_readings(seen: Observation) -> tuple[JointReading, ...]:
    """Return the position of each joint between its limits."""
    robot = seen.robot
    readings = []
    joints = zip(robot.joint_names, robot.units, seen.q.tolist(), robot.limits.tolist())
    for name, unit, q, (lower, upper) in joints:
        text = f'{q:+.3f} {unit}' + ('' if unit == 'm' else f' = {math.degrees(q):+.1f}°')
        bounded = math.isfinite(upper - lower)
        margin = LIMIT_MARGIN * (upper - lower) if bounded else LIMIT_MARGIN
        remark, level = _remark(q, lower, upper, margin)
        fraction = None
        if bounded and upper > lower:
            fraction = min(1.0, max(0.0, (q - lower) / (upper - lower)))
        readings.append(JointReading(name, text, fraction, remark, level))
    return tuple(readings)


def _remark(q: float, lower: float, upper: float, margin: float) -> tuple[str, Level]:
    for side, room in (('lower', q - lower), ('upper', upper - q)):
        if room < 0.0:
            return f'beyond {side} limit', Level.ERROR
        if room < margin:
            return f'near {side} limit', Level.WARN
    return '', Level.OK
