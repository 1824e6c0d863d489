"""The command `import`: a robot file from the formats of other programs."""

import re
import sys
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import typer

from ..diagnosis.calibration.factory import import_ur_calibration
from ..formats.urdf.importer import import_urdf as imported
from ..robot.bundled import find_robot
from ..robot.file.reader import robot_file_text
from .export import write_document
from .options import WrongUsage, doubt_text, given_robot

HELP = """
Make a robot file from a chain of a URDF, or from a factory calibration, and prove it.

\b
Examples:
  kinematics_service import --urdf arm.urdf
  kinematics_service import --urdf arm.urdf --base base_link --tip tool0
  kinematics_service import --urdf a.urdf --base b --tip t --out a.yaml
  kinematics_service import --urdf a.urdf --base b --tip t --name my_arm
  kinematics_service import --urdf a.urdf --base b --tip t --point camera_link
  kinematics_service import --ur-calibration calibration.conf --robot ur5e --out my_ur5e.yaml

Names, limits, velocities and joints that mimic are kept. The robot file is compared with
the plain product of the URDF's joints over 1000 random configurations; the worst error
is printed and written into the file. xacro files are expanded first: xacro FILE > arm.urdf

--ur-calibration is the controller's calibration.conf, or the YAML of ur_calibration; --robot the
nominal arm. Its numbers get corrections of millimetres and an extra angle between parallel axes,
in the place of lengths of hundreds of metres that cancel; it is the same arm to 1e-9.
"""


class ImportedConvention(str, Enum):
    """The conventions that a table may be written in."""

    standard = 'standard'
    modified = 'modified'


def import_urdf(
    urdf: Annotated[
        Optional[Path], typer.Option('--urdf', metavar='FILE', help='The URDF.')
    ] = None,
    base: Annotated[
        str,
        typer.Option(
            metavar='LINK',
            help='The link in whose frame poses are given.',
            show_default='the root',
        ),
    ] = '',
    tip: Annotated[
        str,
        typer.Option(
            metavar='LINK',
            help='The link that is the tool.',
            show_default='the end of the longest chain of moving joints',
        ),
    ] = '',
    ur_calibration: Annotated[
        Optional[Path],
        typer.Option(metavar='FILE', help='A factory calibration of Universal Robots.'),
    ] = None,
    robot: Annotated[
        Optional[str],
        typer.Option(metavar='FILE|NAME', help='The nominal arm of a factory calibration.'),
    ] = None,
    name: Annotated[
        str, typer.Option(metavar='NAME', help='Name of the robot.', show_default="the URDF's")
    ] = '',
    out: Annotated[
        str, typer.Option(metavar='FILE', help='Where to write it.', show_default='the screen')
    ] = '-',
    convention: Annotated[
        ImportedConvention, typer.Option(help='Convention of the table.')
    ] = ImportedConvention.standard,
    round_angles: Annotated[
        bool,
        typer.Option(
            '--round-angles', help='Read 1.5708 and the like as the part of pi they round.'
        ),
    ] = False,
    point: Annotated[
        Optional[list[str]],
        typer.Option('--point', metavar='LINK', help='A link that becomes a point; repeatable.'),
    ] = None,
) -> None:
    """Run the command; `HELP` is what its user reads."""
    if name and not re.fullmatch(r'[A-Za-z0-9_]+', name):
        raise WrongUsage(f'--name: {name!r} is not a name of letters, digits and underscores')
    if ur_calibration is not None:
        if robot is None or urdf is not None:
            raise WrongUsage('--ur-calibration: give the nominal arm with --robot, and no --urdf')
        _import_ur_calibration(ur_calibration, robot, out)
        return
    if urdf is None:
        raise WrongUsage('give --urdf FILE, or --ur-calibration FILE with --robot NAME')
    found = imported(urdf, base, tip, name, convention.value, round_angles, point or ())
    write_document(out, found.text)
    # On the screen the robot file itself is standard output, so that it can be redirected.
    report = sys.stderr if out == '-' else sys.stdout
    print(f'{found.robot.name}: {found.certificate}', file=report)
    for doubt in found.doubts:
        print(doubt_text(doubt), file=sys.stderr)


def _import_ur_calibration(file: Path, robot: str, out: str) -> None:
    arm = given_robot(robot)
    date = datetime.now().astimezone().date().isoformat()
    text = robot_file_text(*find_robot(robot))
    found = import_ur_calibration(file, arm, text, date)
    write_document(out, found.text)
    print(f'{arm.name}: {found}', file=sys.stderr if out == '-' else sys.stdout)
