# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the singularity warning as a level, a sentence, and pairs of key and value."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..kinematics.singularity import (
    Singularity,
    flat_loop,
    nearest_factor,
    none_found,
    unsearched,
    watched_value,
)
from ..robot.file.parts.loop_groups import closed_together, group_in_words, group_key
from ..robot.measures import MEASURES, Level, Measure
from ..robot.robot import Robot

# Texts about a direction of the tool or a joint motion leave out components whose ratio to the
# largest component is below this.
NEGLIGIBLE_RATIO = 0.1

# Longest expression of a singular factor, in characters, that the warning sentence shows. A longer
# expression is only in the value `factor_expression`.
MAX_EXPRESSION_LENGTH = 24


@dataclass(frozen=True)
class StatusText:
    """
    A status of the node, such as the singularity warning: a level, one sentence, and pairs of key
    and value.
    """

    level: Level
    sentence: str
    values: tuple[tuple[str, str], ...]


def direction_in_words(
    direction: Floats, kinds: tuple[str, str] = ('motion along', 'rotation about')
) -> str:
    """
    Return a twist direction (6,) as text: motion along an axis, rotation about an axis, or both.
    """
    linear, angular = direction[:3], direction[3:]
    parts = []
    strongest = max(float(np.linalg.norm(linear)), float(np.linalg.norm(angular)))
    for words, vector in zip(kinds, (linear, angular)):
        norm = float(np.linalg.norm(vector))
        if norm > NEGLIGIBLE_RATIO * strongest and norm > 0.0:
            parts.append(f'{words} {_axis_in_words(vector / norm)}')
    return ' with '.join(parts)


def _axis_in_words(axis: Floats) -> str:
    for k, name in enumerate('xyz'):
        if abs(axis[k]) > math.cos(math.radians(2.0)):
            return name
    # A lost direction has no sign, so show the sign for which its largest component is positive.
    axis = axis * np.sign(axis[int(np.argmax(np.abs(axis)))])
    return '(' + ', '.join(f'{x + 0.0:.2f}' for x in axis) + ')'


def joints_in_words(names: Sequence[str], motion: Floats) -> str:
    """
    Return the names of the joints that move most in a joint motion (n,), with signs: `q2 + q4 -
    q6`.
    """
    largest = float(np.max(np.abs(motion)))
    if largest == 0.0:
        return 'no joint'
    flip = math.copysign(1.0, float(motion[int(np.argmax(np.abs(motion)))]))
    text = ''
    for name, change in zip(names, motion * flip):
        if abs(change) > NEGLIGIBLE_RATIO * largest:
            sign = '-' if change < 0.0 else '+'
            text += f' {sign} {name}' if text or sign == '-' else name
    return text.strip()


def _watched_in_words(measure: Measure, value: float, singularity: Singularity) -> str:
    if measure.unit != 'rad':
        return f'{measure.name} {value:.3g}'
    shown = f'{measure.name} {value:.3g} rad ({math.degrees(value):.1f} deg)'
    return none_found(singularity) or shown


def _tendency(singularity: Singularity, robot: Robot) -> str:
    if singularity.rate is None:
        return 'unknown'
    small_is_bad = MEASURES[robot.singularity.thresholds.measure].small_is_bad
    worsening = -singularity.rate if small_is_bad else singularity.rate
    if abs(worsening) < 1e-9:
        return 'steady'
    return 'towards' if worsening > 0.0 else 'away'


def singularity_status(
    robot: Robot, singularity: Singularity, level: Level, base_frame: str, joint_prefix: str = ''
) -> StatusText:
    """
    Return the text of the singularity warning at a configuration.

    Parameters
    ----------
    robot, singularity
        The arm, and its measures of singularity.
    level
        OK, WARN or ERROR, after hysteresis.
    base_frame
        Name of the frame in which the lost direction is given.
    joint_prefix
        Prefix of the joint names of the robot file.
    """
    names = [joint_prefix + name for name in robot.joint_names]
    measure = MEASURES[robot.singularity.thresholds.measure]
    value = watched_value(robot, singularity)
    shown = f'{_watched_in_words(measure, value, singularity)}, '
    volume = f'manipulability {singularity.manipulability:.3g}'
    if singularity.determinant is not None:
        volume = f'det(J) = {singularity.determinant:.3g}'
    loop = flat_loop(robot, singularity)
    lost = direction_in_words(singularity.lost_direction)
    fight = joints_in_words(names, singularity.joint_motion)
    tendency = _tendency(singularity, robot)
    if level == Level.OK:
        known = measure.unit != 'rad' or not unsearched(singularity)
        sentence = f'{"not near a singularity: " if known else ""}{shown}{volume}'
    else:
        named = _nearest_factor(robot, singularity)
        meaning = lost_hold(loop) if loop else f'losing {lost} in {base_frame}'
        sentence = f'{_head(robot, singularity, level, loop)}: {named}{shown}{volume}; {meaning}'
        if tendency in ('towards', 'away'):
            sentence += f'; moving {tendency}' + (' from it' if tendency == 'away' else ' it')
    out = ' '.join(f'{name}={change:+.3f}' for name, change in zip(names, singularity.way_out))
    values = [
        ('robot', robot.name),
        ('measure', measure.name),
        ('value', f'{value:.9g}'),
        ('warn', f'{robot.singularity.thresholds.warn:g}'),
        ('stop', f'{robot.singularity.thresholds.stop:g}'),
        ('distance', _amount(singularity.distance)),
        *((name, _amount(getattr(singularity, name))) for name in MEASURES if name != 'distance'),
        ('nearest_singular', _pose_in_words(names, singularity.nearest_singular)),
        *_loop_values(robot, singularity, loop),
        ('rank', f'{singularity.rank} of {singularity.generic_rank}'),
        ('lost_direction', ' '.join(f'{x:+.4f}' for x in singularity.lost_direction)),
        ('lost_direction_in_words', lost),
        ('frame', base_frame),
        ('joints_against_each_other', fight),
        ('way_out', out),
        ('tendency', tendency),
        ('time_to_warning', _seconds(singularity.time_to_warning)),
    ]
    values += _factor_values(robot, singularity, names)
    if robot.singularity.task.structurally_deficient:
        values.append(('structural', structure_in_words(robot)))
    return StatusText(level, sentence, tuple(values))


def flat_position(loop: str) -> str:
    """
    Return a name for joint positions at which the equations of a loop, or of several loops, are
    singular.
    """
    return f'a flat position of the {group_in_words(loop)}'


def lost_hold(loop: str) -> str:
    """
    Return the words of a warning that the motors do not hold the links of a closed loop.

    The warning is about joint positions at which the loop equations are singular. There, passive
    joints of the loop can move although all motors are at rest.
    """
    moves = 'move' if closed_together(loop) else 'moves'
    return f'there the motors do not hold what the {group_in_words(loop)} {moves}'


def _head(robot: Robot, singularity: Singularity, level: Level, loop: str) -> str:
    # Returns the beginning of the warning sentence. The text says whether the arm or a loop is
    # singular, and whether the arm is near or at the singular pose.
    thresholds, condition = robot.singularity.thresholds, singularity.condition_number
    none_near = thresholds.measure == 'distance' and singularity.distance > thresholds.warn
    if none_near and level == Level.WARN and condition > kernel.NEARLY_SINGULAR:
        return (
            f'nearly singular: condition number {condition:.3g}, no singular pose found within '
            f'{thresholds.warn:g} rad'
        )
    subject = 'a singularity'
    if robot.loop_names:
        subject = flat_position(loop) if loop else 'a singularity of the arm'
    at = 'at' if level == Level.ERROR else 'near'
    return f'{at} {subject}'


def _loop_values(robot: Robot, singularity: Singularity, loop: str) -> Iterator[tuple[str, str]]:
    # First yields what is singular at the nearest singular pose: the name of a loop whose
    # equations are singular there, or `arm`. Then yields the determinant of each loop's equations.
    factors, names = singularity.factors, robot.loop_names
    if factors is None or not names:
        return
    first = len(factors.names) - len(names)
    yield 'nearest', group_in_words(loop) if loop else 'arm'
    for name, value in zip(names, factors.values[first:]):
        away = f', {singularity.distance:.9g} rad from flat' if name == loop else ''
        yield f'loop_{group_key(name)}', f'det {value:.9g}{away}'


def _pose_in_words(names: Sequence[str], pose: Floats | None) -> str:
    if pose is None:
        return 'none found'
    return ' '.join(f'{name}={position:.4f}' for name, position in zip(names, pose))


def _nearest_factor(robot: Robot, singularity: Singularity) -> str:
    k = nearest_factor(robot, singularity)
    if k is None or singularity.factors is None:
        return ''
    text = robot.singularity.factors.texts[k]
    shown = f': {text}' if len(text) <= MAX_EXPRESSION_LENGTH else ''
    return f'{robot.singularity.factors.called(k)}{shown} = {singularity.factors.values[k]:.3g}, '


def _factor_values(
    robot: Robot, singularity: Singularity, names: Sequence[str]
) -> list[tuple[str, str]]:
    factors = singularity.factors
    if factors is None:
        return []
    k = factors.nearest
    motion = ' '.join(
        f'{name}={change:+.4f}' for name, change in zip(names, factors.motions[k]) if change != 0.0
    )
    return [
        ('factor', factors.names[k]),
        ('factor_expression', robot.singularity.factors.texts[k]),
        *([('factor_approximate', 'true')] if robot.singularity.factors.approximate[k] else []),
        ('factor_value', f'{factors.values[k]:.9g}'),
        ('factor_motion', f'{factors.estimates[k]:.9g}'),
        ('joint_motion_to_its_zero', motion),
    ]


def _amount(value: float | None) -> str:
    return 'none' if value is None else f'{value:.9g}'


def _seconds(time: float | None) -> str:
    if time is None:
        return 'unknown'
    return 'never' if math.isinf(time) else f'{time:.3g} s'


def structure_in_words(robot: Robot) -> str:
    """Return a text about an arm whose Jacobian has full rank at no pose, or '' for other arms."""
    task = robot.singularity.task
    if not task.structurally_deficient:
        return ''
    full = min(len(task.rows), robot.dof)
    cause = (
        f'joints {", ".join(task.dependent_joints)} work against each other at every pose'
        if task.dependent_joints
        else f'the rows {" ".join(task.rows)} are never independent'
    )
    return f'{cause}: rank {task.generic_rank} of {full} at best'


def stale_status(robot: Robot, sentence: str) -> StatusText:
    """Return the status text of an arm whose joint positions are unknown or stale."""
    return StatusText(Level.STALE, sentence, (('robot', robot.name),))
