# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Report the singularity measures of one pose, as text and as JSON."""

import math
import textwrap
from collections.abc import Iterator

from rich.text import Text

from ..estimation import status_text
from ..kernel import Floats
from ..kinematics.singularity import Singularity, flat_loop, none_found
from ..kinematics.tool_state import ToolState
from ..printing import Json, Output, attributes, facts, heading, number, numbers, plain, table
from ..robot.file.parts.loop_groups import group_in_words
from ..robot.measures import MEASURES, Level, Measure, Thresholds
from ..robot.robot import Robot

LEVEL_STYLES = {Level.OK: 'bold green', Level.WARN: 'bold yellow', Level.ERROR: 'bold red'}
DEGREES = 180.0 / math.pi
# Print the rate of change of a measure as 0 if it is below this, 1/s, because it is round-off.
RATE_TOLERANCE = 1e-8
# If the time to the WARN threshold is longer than this, s, the motion counts as not approaching
# the threshold.
MAX_TIME = 1e5

NUMBERS = (*MEASURES, 'singular_values', 'rank', 'generic_rank')
JSON_KEYS = f"""\
    level, measure, warn, stop     OK, WARN or ERROR by the measure watched
{textwrap.indent(textwrap.fill(', '.join(NUMBERS), 74), '    ')}
    nearest_singular               joint positions of the singular pose found,
                                   distance away; null where none was found
    flat_loop                      the loop that is flat there; null: the arm
                                   is singular there
    clearance                      radius without a singular pose, proved, rad
    task, length                   rows of J judged, characteristic length
    lost_direction                 6 numbers, base axes; angular ones * length
    joint_motion, way_out          n numbers each, rad or m
    rate, time_to_warning          1/s and s along qdot; null without one"""


def in_degrees(angle: float) -> str:
    """Return an angle, given in rad, as text in degrees with three digits."""
    return f'{angle * DEGREES:.3g} deg'


def threshold_words(thresholds: Thresholds) -> str:
    """Return the thresholds as text, such as `distance: WARN below 0.1 rad (5.73 deg), ...`."""
    measure = MEASURES[thresholds.measure]
    side = 'below' if measure.small_is_bad else 'above'

    def amount(value: float) -> str:
        return f'{value:g} rad ({in_degrees(value)})' if measure.unit == 'rad' else f'{value:g}'

    return (
        f'{measure.words}: WARN {side} {amount(thresholds.warn)}, '
        f'ERROR {side} {amount(thresholds.stop)}'
    )


def beyond_limits(robot: Robot, q: Floats) -> list[str]:
    """Return the names of the joints whose positions are outside their limits."""
    outside = (q < robot.limits[:, 0]) | (q > robot.limits[:, 1])
    return [name for name, out in zip(robot.joint_names, outside) if out]


def arm_json(robot: Robot) -> dict[str, Json]:
    """Return the part of a JSON object that describes an arm: its name, frames and joint names."""
    return {'robot': robot.name, **attributes(robot, 'base_frame', 'tool_frame', 'joint_names')}


def state_json(state: ToolState) -> dict[str, Json]:
    """Return the part of a JSON object that describes an arm and its configuration q."""
    beyond = beyond_limits(state.robot, state.q)
    return {**arm_json(state.robot), 'q': state.q, 'beyond_limits': beyond}


def singularity_json(robot: Robot, singularity: Singularity) -> dict[str, Json]:
    """Return the singularity measures of a pose as a JSON object, with the keys in `JSON_KEYS`."""
    moving = ('lost_direction', 'joint_motion', 'way_out', 'rate', 'time_to_warning')
    return {
        'level': singularity.level.name,
        **attributes(robot.singularity.thresholds, 'measure', 'warn', 'stop'),
        **attributes(singularity, 'distance', *NUMBERS, 'nearest_singular'),
        'flat_loop': flat_loop(robot, singularity) or None,
        **attributes(singularity, 'clearance'),
        'task': robot.singularity.task.rows,
        'length': robot.singularity.task.length,
        **attributes(singularity, *moving),
    }


def short_measures(state: ToolState, singularity: Singularity) -> Iterator[tuple[str, str]]:
    """
    Yield pairs of label and text that describe how near a pose is to a singular pose.

    The pairs are the level (OK, WARN or ERROR) with the watched measure, the determinant, the
    direction in which the tool moves least, and the joints beyond their limits.
    """
    robot = state.robot
    thresholds = robot.singularity.thresholds
    measure = MEASURES[thresholds.measure]
    side = 'below' if measure.small_is_bad else 'above'
    value = f' {getattr(singularity, measure.name):.4g} {measure.unit}'.rstrip()
    if measure.name == 'distance' and (none := none_found(singularity)):
        value = f': {none}'
    yield (
        'singularity',
        f'{singularity.level.name}: {measure.words}{value}, '
        f'WARN {side} {thresholds.warn:g}, ERROR {side} {thresholds.stop:g}',
    )
    loop = flat_loop(robot, singularity)
    if loop and singularity.level != Level.OK:
        yield 'near', f'{status_text.flat_position(loop)}: {status_text.lost_hold(loop)}'
    if measure.name != 'determinant' and singularity.determinant is not None:
        yield 'determinant', f'{singularity.determinant:.6g}'
    direction = status_text.direction_in_words(singularity.lost_direction)
    yield f'{_degree(robot, singularity)} direction', direction
    if outside := beyond_limits(robot, state.q):
        yield 'beyond limits', ', '.join(map(plain, outside))


def print_singularity(out: Output, state: ToolState, singularity: Singularity) -> None:
    """Print the measures of a pose, then a table of the joints."""
    robot = state.robot
    out.print(
        '',
        heading('Singularity  ')
        + Text(f'level {singularity.level.name}', style=LEVEL_STYLES[singularity.level]),
    )
    out.print(facts(_measure_words(robot, singularity)), '')
    _print_joints(out, state, singularity)


def _print_joints(out: Output, state: ToolState, singularity: Singularity) -> None:
    # Print one line for each joint: its position, its position at the nearest singular pose, and
    # its components of `way_out` (the motion away from that pose) and `joint_motion` (the motion
    # that moves the tool least).
    robot = state.robot
    outside = beyond_limits(robot, state.q)
    nearest = singularity.nearest_singular
    heads = [] if nearest is None else ['singular']
    joints = table('  joint', 'position', '', *heads, 'way out', 'weakest motion', '')
    for column in joints.columns[1:-1]:
        column.justify = 'right'
        column.no_wrap = True
    for j, name in enumerate(robot.joint_names):
        slides = robot.prismatic[j]
        joints.add_row(
            f'  {plain(name)}',
            f'{number(state.q[j], 4)} {"m  " if slides else "rad"}',
            '' if slides else f'{number(state.q[j] * DEGREES, 2)} deg',
            *([] if nearest is None else [number(nearest[j], 4)]),
            number(singularity.way_out[j], 3),
            number(singularity.joint_motion[j], 3),
            'beyond its limit' if name in outside else '',
        )
    either = ' (or its opposite)' if singularity.rank < singularity.generic_rank else ''
    out.print(
        joints,
        '',
        *(f'  {name}: where {_end_words(robot, singularity)} was found nearest' for name in heads),
        f'  way out: the joint motion that leads away fastest{either}',
        '  weakest motion: the joint motion that moves the tool least',
    )


def _measure_words(robot: Robot, singularity: Singularity) -> Iterator[tuple[str, str]]:
    task = robot.singularity.task
    full = min(len(task.rows), robot.dof)
    for measure in MEASURES.values():
        yield measure.words, _value_words(measure, robot, singularity)
        clearance = singularity.clearance
        if measure.name == 'distance' and clearance > 0.0:
            within = f'no pose within {in_degrees(clearance)} is singular, proved'
            yield 'clearance', f'{clearance:.4g} rad: {within}'
    yield (
        'rank',
        f'{singularity.rank} of {full}'
        + (f' ({singularity.generic_rank} at best)' if singularity.generic_rank < full else ''),
    )
    yield from _loop_words(robot, singularity)
    if task.structurally_deficient:
        yield 'at every pose', status_text.structure_in_words(robot)
    yield 'task', f'{" ".join(task.rows)}, characteristic length {task.length:.4g} m'
    yield 'watched', threshold_words(robot.singularity.thresholds)
    loop = flat_loop(robot, singularity)
    if loop and singularity.level != Level.OK:
        yield 'near', f'{status_text.flat_position(loop)}: {status_text.lost_hold(loop)}'
    direction = singularity.lost_direction
    yield (
        f'{_degree(robot, singularity)} direction',
        f'{status_text.direction_in_words(direction)}\n'
        f'linear   {numbers(direction[:3], 3)}  in {robot.base_frame}\n'
        f'angular  {numbers(direction[3:], 3)}  times length',
    )
    is_lost = _degree(robot, singularity) == 'lost'
    yield (
        'joints against each other' if is_lost else 'weakest motion',
        status_text.joints_in_words(robot.joint_names, singularity.joint_motion),
    )
    yield 'along qdot', _motion_words(robot, singularity)


def _degree(robot: Robot, singularity: Singularity) -> str:
    # Return a word for the direction in which the tool moves least. The word is `lost` if the tool
    # cannot move in this direction at this pose, or at a singular pose near enough for WARN or
    # ERROR. Otherwise it is `weakest`.
    at_pose = singularity.rank < singularity.generic_rank
    near = singularity.level != Level.OK and not flat_loop(robot, singularity)
    return 'lost' if at_pose or near else 'weakest'


def _loop_words(robot: Robot, singularity: Singularity) -> Iterator[tuple[str, str]]:
    # Yield the determinant of each closed loop. The array `factors` has the factors of the file
    # first, then those of the loops.
    factors, loops = singularity.factors, robot.loop_names
    if factors is None:
        return
    for name, value in zip(factors.names, factors.values.tolist()):
        if name in loops:
            yield group_in_words(name), f'det {value:.4g}'


def _end_words(robot: Robot, singularity: Singularity) -> str:
    if not robot.loop_names:
        return 'a singular pose'
    loop = flat_loop(robot, singularity)
    return status_text.flat_position(loop) if loop else 'a singular pose of the arm'


def _value_words(measure: Measure, robot: Robot, singularity: Singularity) -> str:
    if measure.name == 'distance':
        return _distance_words(robot, singularity)
    value = getattr(singularity, measure.name)
    if value is None:
        return f'none, J has {len(robot.singularity.task.rows)} rows and {robot.dof} columns'
    shown = f'{value:.6g}' if measure.of_volume else f'{value:.4g}'
    return f'{shown} {measure.unit}'.rstrip()


def _distance_words(robot: Robot, singularity: Singularity) -> str:
    shown = f'{singularity.distance:.4g} rad'
    if singularity.rank < singularity.generic_rank:
        return f'{shown}: this pose is singular'
    if singularity.nearest_singular is not None:
        away, end = in_degrees(singularity.distance), _end_words(robot, singularity)
        return f'{shown}: {away} of joint motion to {end}'
    return none_found(singularity) or shown


def _motion_words(robot: Robot, singularity: Singularity) -> str:
    measure = MEASURES[robot.singularity.thresholds.measure].words
    time, rate = singularity.time_to_warning, singularity.rate
    if time is None or rate is None:
        return ''
    if time == 0.0:
        when = 'beyond its WARN threshold now'
    elif time > MAX_TIME:
        when = 'not approaching its WARN threshold'
    else:
        when = f'WARN in {time:.3g} s'
    rate = 0.0 if abs(rate) < RATE_TOLERANCE else rate
    return f'{measure} changes by {rate:.3g} per second: {when}'
