# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `new`: write a robot file from an example, a bundled robot or a table."""

import re
import sys
from collections.abc import Collection
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional, get_args

import typer

from ..app_modules import app_module
from ..errors import RobotNotFoundError
from ..output_file import write_document
from ..robot.bundled import bundled_robots, find_robot_file
from ..robot.file.parts.description import AngleUnit, LengthUnit
from ..robot.file.parts.quantities import Units
from ..robot.file.writing.new_robot import MAX_JOINTS, NEW_CONVENTIONS, new_robot_text
from ..robot.tables.robot_table import read_table
from .options import WrongUsage, flag, given_text, option, refuse_unwritable

DEFAULT_DOF = 6
DEFAULT_CONVENTION = 'standard'
ROBOT_LINE = re.compile(r'^robot:.*$', re.MULTILINE)


# The accepted conventions are an enumeration, because typer reads the choices of an option from an
# enumeration.
NewConvention = Enum(  # type: ignore[misc]
    'NewConvention', {name: name for name in NEW_CONVENTIONS}, type=str
)


def new(
    name: Annotated[str, typer.Argument(metavar='NAME', help='Name of the robot.')],
    dof: Optional[int] = option('Number of joints, 1 to 12.', 'N', shown=str(DEFAULT_DOF)),
    convention: Optional[NewConvention] = option(
        'Convention of the table.', shown=DEFAULT_CONVENTION
    ),
    units: Optional[str] = option('rad or deg, m or mm.', 'ANGLE,LENGTH', shown='rad,m'),
    source: Optional[str] = option(
        "A bundled robot to begin with (see 'robots').", 'ROBOT', name='--from'
    ),
    table: Optional[str] = option(
        "A file with a Denavit-Hartenberg table; '-': standard input.", 'FILE'
    ),
    columns: Optional[str] = option(
        'What the columns of the table hold: a, alpha, d, theta, offset, type, joint, limits, '
        'min, max; - for none.',
        'NAME,NAME,...',
    ),
    round_angles: bool = flag(
        '--round-angles', 'Read rounded parts of pi as exact ones, for example 1.5708 as pi/2.'
    ),
    out: str = option("Output file; '-': the screen.", 'FILE', default='', shown='NAME.yaml'),
    force: bool = flag('--force', 'Overwrite the file.'),
) -> None:
    """
    Write a robot file to begin with: an example arm whose comments say what each part means.

    \b
    Examples:
      kinematics_service new my_arm --dof 4 --units deg,mm
      kinematics_service new my_arm --convention modified
      kinematics_service new my_ur5e --from ur5e
      kinematics_service new my_arm --table dh.csv
      kinematics_service new my_arm --table - --columns a,alpha,d,theta

    The command writes NAME.yaml in this folder, or the file of --out; an existing file is kept
    unless you give --force. With --from the file is a copy of a bundled robot's file, including
    the comments. You can change the copy.

    With --table the robot comes from a table: rows of a spreadsheet (commas, semicolons or tabs),
    of a text, of Markdown or LaTeX, a matrix of MATLAB or Python, named numbers of YAML, JSON or
    TOML, or the links of Corke's toolbox. The heads of the columns, in any order, name the
    quantity of each column; without heads use --columns. The joint of a row moves theta or d. Mark
    the moved quantity: write the joint variable into its cell, or leave the cell empty. A letter
    becomes a constant without a value. The command prints how it read the table, refuses an
    ambiguous table, and checks the result.
    """
    if not re.fullmatch(r'[A-Za-z0-9_]+', name):
        raise WrongUsage(f'NAME: {name!r} is not a name of letters, digits and underscores')
    if table is None and (columns is not None or round_angles):
        raise WrongUsage('--columns and --round-angles need --table; give both, or leave them out')
    if table is not None:
        if dof is not None or source is not None:
            raise WrongUsage('--table excludes --dof and --from; leave them out')
        convention_given = convention.value if convention else None
        given = (_unit_words(units or ''), convention_given, columns, round_angles)
        text = _from_table(name, table, *given)
    elif source is not None:
        if dof is not None or convention is not None or units is not None:
            raise WrongUsage('--from copies a robot; leave out --dof, --convention and --units')
        text = _copy(name, source)
    else:
        dof = DEFAULT_DOF if dof is None else dof
        if not 1 <= dof <= MAX_JOINTS:
            raise WrongUsage(f'--dof: {dof} joints; write a number from 1 to {MAX_JOINTS}')
        text = new_robot_text(
            name, dof, convention.value if convention else DEFAULT_CONVENTION, _units(units or '')
        )
    file = out or f'{name}.yaml'
    if file != '-':
        refuse_unwritable('--out', Path(file))
        if Path(file).is_file() and not force:
            raise WrongUsage(f'{file} exists already; give another name, --out, or --force')
    write_document(file, text)
    if file == '-':
        return
    if table is not None:
        print(f'wrote {file}')
        if checking := app_module('check'):
            checking.check([file], strict=False)
        return
    print(f'wrote {file}; next: python -m kinematics_service check {file}')


def _copy(name: str, source: str) -> str:
    if source not in bundled_robots():
        try:
            find_robot_file(source)
        except RobotNotFoundError as error:
            raise WrongUsage(f'--from: {error}') from None
        raise WrongUsage(f'--from: {source} is a file; copy it, or give a bundled robot')
    text = bundled_robots()[source].read_text(encoding='utf-8')
    return ROBOT_LINE.sub(f'robot: {name}', text, count=1)


def _from_table(
    name: str,
    table: str,
    units: Collection[str],
    convention: str | None,
    columns: str | None,
    round_angles: bool,
) -> str:
    if convention not in (None, 'standard', 'modified'):
        raise WrongUsage(f'--convention: a table is standard or modified, not {convention}')
    file = '<stdin>' if table == '-' else table
    result = read_table(given_text(table), file, name, units, convention, columns, round_angles)
    for note in result.doubts:
        print(note, file=sys.stderr)
    return result.text


def _unit_words(text: str) -> list[str]:
    words = re.findall(r'[^\s,]+', text)
    for word in words:
        if word not in (*get_args(AngleUnit), *get_args(LengthUnit)):
            message = f'--units: unknown unit {word!r} (accepted: rad, deg, m, mm, as deg,mm)'
            raise WrongUsage(message)
    for accepted in get_args(AngleUnit), get_args(LengthUnit):
        if all(unit in words for unit in accepted):
            raise WrongUsage(f'--units: {" and ".join(accepted)} exclude each other; write one')
    return words


def _units(text: str) -> Units:
    words, default = _unit_words(text), Units()
    return Units(
        next((unit for unit in get_args(AngleUnit) if unit in words), default.angle),
        next((unit for unit in get_args(LengthUnit) if unit in words), default.length),
    )
