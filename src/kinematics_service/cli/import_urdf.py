"""The command `import`: a robot file from the formats of other programs."""

import re
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import typer

from .application import app
from .export import write_document
from .options import WrongUsage

HELP = """
Make a robot file from a chain of a URDF, and prove it.

\b
Examples:
  kinematics_service import --urdf arm.urdf --base base_link --tip tool0
  kinematics_service import --urdf a.urdf --base b --tip t --out a.yaml
  kinematics_service import --urdf a.urdf --base b --tip t --name my_arm
  kinematics_service import --urdf a.urdf --base b --tip t --point camera_link

Names, limits, velocities and joints that mimic are kept. The robot file is compared with
the plain product of the URDF's joints over 1000 random configurations; the worst error
is printed and written into the file. xacro files are expanded first: xacro FILE > arm.urdf
"""


class ImportedConvention(str, Enum):
    """The conventions that a table may be written in."""

    standard = 'standard'
    modified = 'modified'


@app.command('import', short_help='Make a robot file from a URDF.', help=HELP)
def import_urdf(
    urdf: Annotated[Path, typer.Option('--urdf', metavar='FILE', help='The URDF.')],
    base: Annotated[
        str,
        typer.Option('--base', metavar='LINK', help='The link in whose frame poses are given.'),
    ],
    tip: Annotated[str, typer.Option('--tip', metavar='LINK', help='The link that is the tool.')],
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
    from ..formats.urdf.importer import import_file

    found = import_file(urdf, base, tip, name, convention.value, round_angles, point or ())
    write_document(out, found.text)
    # On the screen the robot file itself is standard output, so that it can be redirected.
    report = sys.stderr if out == '-' else sys.stdout
    print(f'{found.robot.name}: {found.certificate}', file=report)
