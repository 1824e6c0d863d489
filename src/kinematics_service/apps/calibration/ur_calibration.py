# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the factory calibration of a Universal Robots arm: `calibration.conf`, or YAML.

The controller's file `calibration.conf` holds numbers that are added to the nominal
Denavit-Hartenberg table. For parallel axes, d may be hundreds of metres that cancel. The YAML that
ur_robot_driver extracts (package ur_calibration) holds the pose of each joint in the link before
the joint.
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
from ...rigid_motion import pose_of
from ...robot.file.text.yaml_reader import YamlError
from ..recordings.readers.plan_reader import text_of
from ..recordings.readers.yaml_values import read_documents

JOINTS = 6
# Keys of the controller's file for each number of the table; the values are added to the numbers.
DELTAS = {'theta': 'delta_theta', 'a': 'delta_a', 'd': 'delta_d', 'alpha': 'delta_alpha'}
# Links of ur_description whose joints have an origin in the YAML, from base to tool.
LINKS = ('shoulder', 'upper_arm', 'forearm', 'wrist_1', 'wrist_2', 'wrist_3')
ORIGIN = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')
LARGEST = 256 * 1024


@dataclass(frozen=True, eq=False)
class UrCalibration:
    """
    A factory calibration: either `deltas` or `origins` is given.

    Attributes
    ----------
    deltas : shape (6,) by theta, a, d, alpha
        Numbers that are added to the nominal table, rad and m; empty if the file is YAML.
    origins : 6 poses of shape (4, 4)
        Pose of each joint in the link before the joint; empty if the file is that of the
        controller.
    """

    deltas: dict[str, Floats]
    origins: tuple[Floats, ...] = ()


def read_ur_calibration(path: Path) -> UrCalibration:
    """
    Return the factory calibration that a file holds.

    Raises
    ------
    CalibrationError
        The file cannot be read, or has neither of the two formats.
    """
    try:
        text = text_of(path, LARGEST, 'give one of the two')
    except RecordingError as error:
        raise CalibrationError(str(error), code=error.code) from None
    if 'delta_' in text:
        return UrCalibration(_deltas(path, text))
    if 'kinematics' in text:
        return UrCalibration({}, _origins(path, text))
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
    found = {}
    for place, key in DELTAS.items():
        written = next((section[key] for section in parser.values() if key in section), None)
        if written is None:
            raise CalibrationError(
                f'{path}: {key} is missing; write {", ".join(DELTAS.values())}', code='missing-key'
            )
        found[place] = _six(path, key, written)
    return found


def _six(path: Path, key: str, text: str) -> Floats:
    try:
        given = ast.literal_eval(text)
        # Accept only lists and tuples, because iteration over bytes, sets and mappings would yield
        # numbers too.
        numbers = given if type(given) in (list, tuple) else []
        six = np.array([float(one) for one in numbers if type(one) in (int, float)])
    except (ValueError, OverflowError, SyntaxError, MemoryError, RecursionError):
        numbers, six = [], np.zeros(0)
    if not len(numbers) == len(six) == JOINTS or not np.all(np.isfinite(six)):
        raise CalibrationError(
            f'{path}: {key}: expected six numbers in brackets, not {text[:40]}',
            code='wrong-shape',
        )
    return six


def _origins(path: Path, text: str) -> tuple[Floats, ...]:
    try:
        documents = read_documents(text)
    except YamlError as error:
        raise CalibrationError(f'{path}:{error}', code='syntax') from None
    document = documents[0] if documents else None
    kinematics = document.get('kinematics') if isinstance(document, dict) else None
    if not isinstance(kinematics, dict):
        raise CalibrationError(
            f'{path}: kinematics must be a mapping of links (shoulder, upper_arm and so on)',
            code='wrong-type',
        )
    return tuple(_origin(path, link, kinematics.get(link)) for link in LINKS)


def _origin(path: Path, link: str, entry: Any) -> Floats:
    given = [entry.get(key) for key in ORIGIN] if isinstance(entry, dict) else []
    numbers = [one for one in given if isinstance(one, float) and math.isfinite(one)]
    if len(numbers) != len(ORIGIN):
        raise CalibrationError(
            f'{path}: kinematics.{link}: expected the numbers {", ".join(ORIGIN)}',
            code='missing-key',
        )
    return pose_of(numbers[:3], (numbers[3], numbers[4], numbers[5]))
