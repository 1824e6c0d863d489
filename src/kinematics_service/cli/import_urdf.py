# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `import`: make a robot file from a URDF or a factory calibration."""

import re
import sys
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import Optional

from ..app_modules import app_module
from ..output_file import say_written, write_document
from ..robot.bundled import find_robot
from ..robot.file.reader import robot_file_text
from ..robot.urdf.importer import import_urdf as imported
from .options import ROBOT, WrongUsage, doubt_text, flag, given_robot, option


class ImportedConvention(str, Enum):
    """Denavit-Hartenberg conventions that an imported table can have."""

    standard = 'standard'
    modified = 'modified'


def import_urdf(
    urdf: Optional[Path] = option('The URDF.', 'FILE'),
    base: str = option(
        'Base link: poses are given in its frame.', 'LINK', default='', shown='the root'
    ),
    tip: str = option(
        'Tool link.',
        'LINK',
        default='',
        shown='the hand, or the end of the longest chain',
    ),
    ur_calibration: Optional[Path] = option('A factory calibration of Universal Robots.', 'FILE'),
    robot: Optional[str] = option('The nominal arm of a factory calibration.', ROBOT),
    name: str = option('Name of the robot.', 'NAME', default='', shown="the URDF's"),
    out: str = option('Output file.', 'FILE', default='-', shown='the screen'),
    convention: ImportedConvention = option(
        'Convention of the table.', default=ImportedConvention.standard
    ),
    round_angles: bool = flag(
        '--round-angles', 'Read 1.5708 as pi/2, and round the noise of CAD programs off axes.'
    ),
) -> None:
    """
    Make a robot file from a chain of a URDF, or from a factory calibration, and check the file.

    \b
    Examples:
      kinematics_service import --urdf arm.urdf
      kinematics_service import --urdf arm.urdf --base base_link --tip tool0
      kinematics_service import --urdf a.urdf --base b --tip t --out a.yaml
      kinematics_service import --urdf a.urdf --base b --tip t --name my_arm
      kinematics_service import --ur-calibration calibration.conf --robot ur5e --out my_ur5e.yaml

    Names, limits, velocities, accelerations and mimic joints are kept. The robot file is compared
    with the product of the URDF's joint transforms over 1000 random configurations; the largest
    error is printed and written into the file. Expand a xacro file first: xacro FILE > arm.urdf

    --ur-calibration is the controller's calibration.conf, or the YAML file of ur_calibration, and
    --robot is the nominal arm. The calibration file has its own table; for parallel axes, this
    table has lengths of hundreds of metres that cancel each other. The robot file has the numbers
    of the nominal arm with corrections of millimetres, and an extra angle between parallel axes.
    The poses of the two tables agree to 1e-9 (m and rad).
    """
    if name and not re.fullmatch(r'[A-Za-z0-9_]+', name):
        raise WrongUsage(f'--name: {name!r} is not a name of letters, digits and underscores')
    if ur_calibration is not None:
        if robot is None or urdf is not None:
            message = '--ur-calibration: give the nominal arm by --robot, and leave out --urdf'
            raise WrongUsage(message)
        _import_ur_calibration(ur_calibration, robot, out)
        return
    if urdf is None:
        raise WrongUsage('give --urdf FILE, or --ur-calibration FILE with --robot NAME')
    result = imported(urdf, base, tip, name, convention.value, round_angles)
    _write(out, result.text, f'{result.robot.name}: {result.certificate}')
    for doubt in result.doubts:
        print(doubt_text(doubt), file=sys.stderr)
    for remark in result.remarks:
        print(remark, file=sys.stderr)


def _import_ur_calibration(file: Path, robot: str, out: str) -> None:
    app = app_module('factory calibration')
    if app is None:
        raise WrongUsage('--ur-calibration: the app calibration, which reads it, was removed')
    arm = given_robot(robot)
    date = datetime.now().astimezone().date().isoformat()
    text = robot_file_text(*find_robot(robot))
    result = app.import_ur_calibration(file, arm, text, date)
    _write(out, result.text, f'{arm.name}: {result}')


def _write(out: str, text: str, message: str) -> None:
    write_document(out, text)
    # If the robot file goes to standard output, print the message to standard error.
    if out == '-':
        print(message, file=sys.stderr)
    else:
        print(message)
        say_written(Path(out))
