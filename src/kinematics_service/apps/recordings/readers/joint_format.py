# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert the joint columns of a table to rad or m, from other units or from encoder ticks."""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.robot import Robot

# Factors that convert a unit to rad or m.
ANGLES = {'rad': 1.0, 'deg': math.radians(1.0), 'turns': math.tau}
LENGTHS = {'m': 1.0, 'mm': 1e-3, 'cm': 1e-2}
# The unit `percent` of joint positions: -100 is the lower limit of the joint, 100 the upper limit.
PERCENT = 'percent'
# Matches the number of encoder ticks in a turn, and the tick at joint position 0, such as
# 4096@2048. The number of ticks is negative if the encoder counts backwards.
TICKS = re.compile(r'(-?\d+(?:\.\d+)?)(?:@(-?\d+(?:\.\d+)?))?')
# Name of the vector of joint positions in a file with the statistics of a dataset.
STATE = 'observation.state'
# Number of encoder ticks in a turn of the servos to which LeRobot's calibration files apply.
SERVO_TURN = 4095.0
ACCEPTED = (
    'write rad, deg, turns, m, mm, percent (of the way from the middle of the limits to a '
    "limit), an encoder's ticks a turn and its zero (4096@2048), one of these for a joint "
    '(elbow=-4096@2048), or a file with a calibration or statistics (.json)'
)


class JointUnits(NamedTuple):
    """
    Conversion of joint columns to joint positions (..., n), rad or m. A number x of joint j
    becomes the position scale[j] (x - zero[j]).
    """

    scale: Floats
    zero: Floats

    def positions(self, numbers: Floats) -> Floats:
        """Convert numbers (..., n) of the joint columns to joint positions, rad or m."""
        return np.asarray((numbers - self.zero) * self.scale)


class JointFormat(NamedTuple):
    """
    The units of joint columns as a text: items separated by commas. An empty text means rad and m.

    The item `deg` gives the unit of all revolute joints, and `mm` of all prismatic joints. An item
    such as `wrist=4096@2048` gives the unit of one joint. An item that ends in `.json` is the name
    of a file with a calibration or with the statistics of a dataset. For statistics, `first` is
    the index of the arm's first joint in the dataset's state vector.
    """

    text: str = ''
    first: int = 0

    def units(self, robot: Robot) -> JointUnits:
        """
        Return the conversion to rad or m for each joint column of an arm.

        Raises
        ------
        RecordingError
            An item or a joint is unknown, or a file cannot be read.
        """
        units = JointUnits(np.ones(robot.dof), np.zeros(robot.dof))
        for word in (part.strip() for part in self.text.split(',') if part.strip()):
            if word.endswith('.json'):
                _take_file(units, robot, Path(word), self.first)
                continue
            name, named, unit = word.rpartition('=')
            if named and name not in robot.joint_names:
                raise RecordingError(
                    f'--joint-format: {robot.name} has no joint {name!r}; its joints are '
                    f'{", ".join(robot.joint_names)}',
                    code='unknown-name',
                )
            for j, joint in enumerate(robot.joint_names):
                if not named or joint == name:
                    _take_word(units, robot, j, unit)
        return units


def _take_word(units: JointUnits, robot: Robot, j: int, unit: str) -> None:
    sliding = bool(robot.prismatic[j])
    ticks = TICKS.fullmatch(unit)
    if unit in ANGLES or unit in LENGTHS:
        if (unit in LENGTHS) == sliding:
            units.scale[j], units.zero[j] = (LENGTHS if sliding else ANGLES)[unit], 0.0
    elif unit == PERCENT:
        lower, upper = robot.limits[j].tolist()
        if not math.isfinite(upper - lower):
            raise RecordingError(
                f'--joint-format: percent: joint {robot.joint_names[j]} has no limits in '
                'the robot file; add its limits there, or give another unit',
                code='missing-limits',
            )
        _take_range(units, j, (-100.0, 100.0), (lower, upper))
    elif ticks and float(ticks[1]):
        turn = 1.0 if sliding else math.tau  # ticks of a prismatic joint are per metre
        units.scale[j], units.zero[j] = turn / float(ticks[1]), float(ticks[2] or 0.0)
    else:
        message = f'--joint-format: {unit!r} is not accepted; {ACCEPTED}'
        raise RecordingError(message, code='unknown-unit')


def _take_range(
    units: JointUnits, j: int, numbers: tuple[float, float], positions: tuple[float, float]
) -> None:
    # Sets scale and zero of joint j, so that the first of the two `numbers` in the column becomes
    # the first position in `positions` (rad or m), and the second number the second position.
    scale = (positions[1] - positions[0]) / (numbers[1] - numbers[0])
    units.scale[j], units.zero[j] = scale, 0.5 * sum(numbers) - 0.5 * sum(positions) / scale


def _take_file(units: JointUnits, robot: Robot, file: Path, first: int) -> None:
    try:
        content = json.loads(file.read_text(encoding='utf-8'))
        if not isinstance(content, Mapping):
            raise ValueError('it is not a mapping')
        motors = {name: motor for name, motor in content.items() if _is_motor(motor)}
        if motors:
            _take_calibration(units, robot, motors)
            return
        # Read the least and the largest position (rad or m) of each joint in the dataset. The
        # columns of the dataset have -1 and 1 instead of these two positions.
        least, greatest = (
            [float(x) for x in content[STATE][name][first : first + robot.dof]]
            for name in ('min', 'max')
        )
        if min(len(least), len(greatest)) < robot.dof:
            raise ValueError('there are fewer numbers than joints')
    except OSError as error:
        raise RecordingError(
            f'--joint-format: {file}: cannot be read: {error.strerror}; give a calibration or the '
            'statistics of a dataset, or a unit such as deg',
            code='missing-file' if isinstance(error, FileNotFoundError) else 'unreadable',
        ) from None
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise RecordingError(
            f'--joint-format: {file}: is neither a calibration nor statistics ({error}); give '
            'range_min and range_max of every joint, or min and max of observation.state',
            code='wrong-kind',
        ) from None
    for j in range(robot.dof):
        _take_range(units, j, (-1.0, 1.0), (least[j], greatest[j]))


def _is_motor(content: Any) -> bool:
    return isinstance(content, Mapping) and {'range_min', 'range_max'} <= content.keys()


def _take_calibration(units: JointUnits, robot: Robot, motors: Mapping[str, Any]) -> None:
    # Sets scale and zero of servo joints. The position column of a servo has -100 at `range_min`
    # (ticks) and 100 at `range_max`; with `drive_mode` the signs are reversed. The middle of the
    # range, 0 in the column, is joint position 0.
    for j, name in enumerate(robot.joint_names):
        motor = motors[name]
        reach = 0.5 * (float(motor['range_max']) - float(motor['range_min']))
        sign = -1.0 if motor.get('drive_mode') else 1.0
        units.scale[j], units.zero[j] = sign * math.tau * reach / SERVO_TURN / 100.0, 0.0
