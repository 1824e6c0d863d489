# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the factory calibration of a Universal Robots arm as corrections of its nominal table.

The controller's file `calibration.conf` holds numbers that are added to the nominal
Denavit-Hartenberg table. The YAML that ur_robot_driver extracts (package ur_calibration) holds the
pose of each joint in the link before the joint. If two axes are nearly parallel, a factory table
may have two lengths d of hundreds of metres that nearly cancel. The robot file describes nearly
parallel axes by an extra small angle instead of long d. So the corrections in the robot file are
fitted to poses computed from the factory's table.
"""

import ast
import configparser
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import CalibrationError, RecordingError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...kinematics.uncertainty.parameters import parameters_of
from ...rigid_motion import apart, pose_of, screw_z
from ...robot.file.parts.description import DhRow
from ...robot.file.parts.parameters import ENDS
from ...robot.file.text.yaml_reader import YamlError
from ...robot.robot import Robot
from ...robot.task import seeded_poses
from ..recordings.readers.plan_reader import text_of
from ..recordings.readers.yaml_values import read_documents
from .calibration import calibrate
from .checking import ROUND_OFF
from .corrections import corrected_robot
from .robot_text import CalibrationOrigin, Frames, calibrated_text, placed_robot

JOINTS = 6
# For each number of a DH row, the key in the controller's file whose values are added to this
# number.
DELTAS = {'theta': 'delta_theta', 'a': 'delta_a', 'd': 'delta_d', 'alpha': 'delta_alpha'}
# Links of ur_description whose joints have an origin in the YAML, from base to tool.
LINKS = ('shoulder', 'upper_arm', 'forearm', 'wrist_1', 'wrist_2', 'wrist_3')
ORIGIN = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')
LARGEST = 256 * 1024

# Number of poses to which the corrections are fitted. They are the first of a larger number of
# random poses (with a fixed seed); the rest test the fitted corrections.
FITTED_POSES = 100


@dataclass(frozen=True, eq=False)
class FactoryImport:
    """
    The robot file of a factory calibration.

    Attributes
    ----------
    text
        The robot file.
    robot
        The robot with the corrections.
    configurations
        Number of random configurations at which `robot` is compared with the factory's table.
    position_error, rotation_error
        The largest differences between tool poses of `robot` and tool poses of the factory's
        table, m and rad.
    nominal_error
        The largest distance between nominal tool positions and those of the factory's table, m.
    """

    text: str
    robot: Robot
    configurations: int
    position_error: float
    rotation_error: float
    nominal_error: float

    def __str__(self) -> str:
        """Return a text with the largest pose differences from the factory's table."""
        return (
            f'{self.position_error:.1e} m and {self.rotation_error:.1e} rad from the factory '
            f'table at most, over {self.configurations} configurations; the nominal table is '
            f'{1000 * self.nominal_error:.2f} mm from it'
        )


def import_ur_calibration(path: Path, robot: Robot, text: str, date: str) -> FactoryImport:
    """
    Return the robot file of a Universal Robots arm with its factory calibration.

    Parameters
    ----------
    path
        `calibration.conf` of the controller, or the YAML of ur_calibration.
    robot, text
        The nominal robot, and its file.
    date
        The date that is written into the certificate of the robot file.

    Raises
    ------
    CalibrationError
        The file cannot be read, or is that of another robot.
    """
    rows = [isinstance(link, DhRow) for link in robot.description.links]
    turning = robot.joint_types.count('revolute') == len(rows) == JOINTS
    if robot.convention != 'standard' or not turning:
        raise CalibrationError(
            f'{robot.name}: a factory calibration of Universal Robots belongs to a standard '
            'Denavit-Hartenberg table of six turning joints, as ur3e, ur5e and ur10e have it',
            code='unsupported',
        )
    q = np.clip(seeded_poses(robot.limits, [False] * JOINTS), -np.pi, np.pi)
    expected = _poses(path, robot, q)
    nominal = float(np.max(apart(forward_kinematics(robot, q), expected)[0]))
    some, others = slice(0, FITTED_POSES), slice(FITTED_POSES, None)
    # In the first fit, keep the frames of base and tool. In the factory's table the first joint
    # axis may differ from the z axis of the base, or the last joint axis from the z axis of the
    # tool. Then the first fit leaves errors above round-off, so correct base and tool in a second
    # fit.
    tried: tuple[tuple[tuple[str, ...], Frames], ...] = ((ENDS, 'robot'), ((), 'measured'))
    for fix, frames in tried:
        result = calibrate(robot, q[some], expected[some], fix=fix)
        mine = placed_robot(result, frames)
        distances, angles = apart(forward_kinematics(mine, q[others]), expected[others])
        position, rotation = float(np.max(distances)), float(np.max(angles))
        if max(position, rotation) < ROUND_OFF:
            break
    else:
        raise CalibrationError(
            f'{path}: the table found is {position:.1e} m and {rotation:.1e} rad from the '
            "factory's own: it is not written",
            code='mismatch',
        )
    origin = CalibrationOrigin(f'the factory calibration {path.name}', date)
    written = calibrated_text(result, text, q[some], expected[some], origin, frames)
    return FactoryImport(written, mine, len(distances), position, rotation, nominal)


def _poses(path: Path, robot: Robot, q: Floats) -> Floats:
    # Return the poses (N, 4, 4) that the factory's table gives at joint positions q (N, n). The
    # factory's table is read from the file, which has one of two formats.
    try:
        text = text_of(path, LARGEST, 'give one of the two')
    except RecordingError as error:
        raise CalibrationError(str(error), code=error.code) from None
    if 'delta_' in text:
        deltas, table = _deltas(path, text), parameters_of(robot).table
        added = [deltas.get(number.place, np.zeros(JOINTS))[number.row] for number in table]
        return forward_kinematics(corrected_robot(robot, table, np.array(added)), q)
    if 'kinematics' in text:
        T = np.broadcast_to(robot.description.base.motion.matrix, (len(q), 4, 4))
        for origin, joint in zip(_origins(path, text), q.T):
            T = T @ origin @ np.array([screw_z(angle, 0.0) for angle in joint.tolist()])
        return np.asarray(T @ robot.description.tool.motion.matrix)
    raise CalibrationError(
        f'{path}: not a calibration of Universal Robots; give calibration.conf '
        '([mounting] with delta_theta, delta_a, delta_d, delta_alpha) or the YAML of '
        'ur_calibration (kinematics: shoulder, upper_arm and so on)',
        code='unsupported',
    )


def _deltas(path: Path, text: str) -> dict[str, Floats]:
    parser = configparser.ConfigParser(inline_comment_prefixes=('#',), interpolation=None)
    try:
        parser.read_string(text)
    except configparser.Error as error:
        reason = ' '.join(str(error).split())
        raise CalibrationError(f'{path}: cannot be read: {reason}', code='syntax') from None
    deltas = {}
    for place, key in DELTAS.items():
        written = next((section[key] for section in parser.values() if key in section), None)
        if written is None:
            message = f'{path}: {key} is missing; write {", ".join(DELTAS.values())}'
            raise CalibrationError(message, code='missing-key')
        deltas[place] = _six(path, key, written)
    return deltas


def _six(path: Path, key: str, text: str) -> Floats:
    try:
        given = ast.literal_eval(text)
        # Accept only lists and tuples, because iteration over bytes, sets and mappings would yield
        # numbers too.
        numbers = given if type(given) in (list, tuple) else []
        six = np.array([float(number) for number in numbers if type(number) in (int, float)])
    except (ValueError, OverflowError, SyntaxError, MemoryError, RecursionError):
        numbers, six = [], np.zeros(0)
    if not len(numbers) == len(six) == JOINTS or not np.all(np.isfinite(six)):
        message = f'{path}: {key}: expected six numbers in brackets, not {text[:40]}'
        raise CalibrationError(message, code='wrong-shape')
    return six


def _origins(path: Path, text: str) -> tuple[Floats, ...]:
    try:
        documents = read_documents(text)
    except YamlError as error:
        raise CalibrationError(f'{path}:{error}', code='syntax') from None
    document = documents[0] if documents else None
    kinematics = document.get('kinematics') if isinstance(document, dict) else None
    if not isinstance(kinematics, dict):
        message = f'{path}: kinematics must be a mapping of links (shoulder, upper_arm and so on)'
        raise CalibrationError(message, code='wrong-type')
    return tuple(_origin(path, link, kinematics.get(link)) for link in LINKS)


def _origin(path: Path, link: str, entry: Any) -> Floats:
    given = [entry.get(key) for key in ORIGIN] if isinstance(entry, dict) else []
    numbers = [value for value in given if isinstance(value, float) and math.isfinite(value)]
    if len(numbers) != len(ORIGIN):
        message = f'{path}: kinematics.{link}: expected the numbers {", ".join(ORIGIN)}'
        raise CalibrationError(message, code='missing-key')
    return pose_of(numbers[:3], (numbers[3], numbers[4], numbers[5]))
