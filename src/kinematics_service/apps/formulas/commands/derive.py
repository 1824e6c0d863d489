# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the command `derive`, which prints exact frames, Jacobian, determinant and singular set.
"""

import sys
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Optional

from ....cli.options import (
    RobotArgument,
    WrongUsage,
    flag,
    given_robot,
    option,
    refuse_robot_file,
    refuse_unknown_robot,
    refuse_unwritable,
)
from ....printing import working
from ....robot.bundled import find_robot, find_robot_file
from ....robot.cell import is_cell
from ....robot.file.translation import translator_of

if TYPE_CHECKING:
    from ..derive.derivation import Derivation
    from ..derive.path import Path as PathAlong


class Format(str, Enum):
    """The output formats that `--format` accepts."""

    text = 'text'
    markdown = 'markdown'
    latex = 'latex'
    html = 'html'
    json = 'json'


class Code(str, Enum):
    """The languages that `--code` accepts."""

    numpy = 'numpy'
    js = 'js'
    latex = 'latex'


def derive(
    robot: RobotArgument,
    format: Format = option('What to write.', default=Format.text),
    out: Optional[Path] = option('Output file.  [default: the screen]', 'FILE'),
    frame: Optional[str] = option('Axes of J: base, tool, or the number of a frame.', 'FRAME'),
    lock: Optional[list[str]] = option(
        'Set a joint to a constant, in the units of the robot file; repeatable.', 'JOINT=VALUE'
    ),
    code: Optional[Code] = option(
        'Write T, J and the determinant as source code instead; export writes C.'
    ),
    path: Optional[str] = option('Also derive the velocity along a path.', 'JOINT=f(t),...'),
    start: float = option('Start of the path, s.', default=0.0, name='--from'),
    end: float = option('End of the path, s.', default=6.3, name='--to'),
    plot: Optional[Path] = option(
        'Draw the velocity along the path: PNG, or .svg, .pdf (needs matplotlib).', 'PICTURE'
    ),
    write: bool = flag('--write', 'Store the factors of the determinant in the robot file.'),
) -> None:
    """
    Derive the kinematics of an arm exactly, in the symbols of its robot file.

    \b
    Examples:
      kinematics_service derive craig_3r
      kinematics_service derive puma560 --format html --out puma560.html
      kinematics_service derive panda --lock q3=0
      kinematics_service derive ur5e --code js --out ur5e.js
      kinematics_service derive rrp_elementary --path 'theta1=sin(t), theta2=cos(2*t), d3=sin(3*t)'
      kinematics_service derive arm.yaml --write

    The result has T of every row of the table, every frame, the Jacobian by four methods and the
    differences between them, and the determinant of the task rows of J as a product. For each
    factor it gives the poses at which the factor is 0, the rank of J there, and the tool motion
    that is impossible there. --write puts the factors into the robot file, after checking their
    product against the determinant.

    For an arm with closed loops the result has the loop equations, the velocities of the passive
    joints per joint velocity, and the determinants of the loop equations and of J.
    """
    refuse_unknown_robot(robot)
    if out is not None:
        refuse_unwritable('--out', out)
        refuse_robot_file('--out', out, robot)
    if write and translator_of(str(find_robot_file(robot))):
        raise WrongUsage(
            f'--write: a URDF has no factors; make a robot file of it (import --urdf {robot})'
        )
    if write and is_cell(find_robot(robot)):
        raise WrongUsage('--write: a cell has no factors; give the robot file of one of its arms')
    if write and lock:
        raise WrongUsage('--write: a locked arm has other factors than its file; omit --lock')
    if plot and not path:
        raise WrongUsage('--plot draws a path; give --path too')
    if not start < end:
        raise WrongUsage(f'--from {start:g} is not before --to {end:g}; exchange them')
    locked = dict(_locks(lock or []))
    arm = given_robot(robot, in_letters=True)
    if arm.description.loops and (lock or frame or code or path or write):
        message = f'{arm.name} has closed loops; omit --lock, --frame, --code, --path and --write'
        raise WrongUsage(message)
    if (path or lock) and arm.description.letters:
        option_given = '--path' if path else '--lock'
        raise WrongUsage(
            f'{option_given} needs numbers: {arm.description.letters} have no value; give values '
            'in the robot file'
        )
    # Import sympy only when a derivation starts, because sympy takes half a second to load.
    from ..derive.derivation import derive as derived

    with working('deriving') as tell:
        derivation = derived(arm, locked, tell)
        if write:
            tell('checking the factors')
            _write(derivation, find_robot_file(robot))
            return
        tell('writing')
        document = _document(derivation, format, frame, code, path, (start, end), plot)
    _write_document(document, out)


def _write_document(document: str, out: Path | None) -> None:
    if out is None:
        sys.stdout.write(document)
        return
    from ....output_file import say_written, write_file

    write_file(out, document)
    say_written(out)


def _locks(given: list[str]) -> list[tuple[str, str]]:
    pairs = []
    for text in given:
        name, equals, value = text.partition('=')
        if not equals:
            raise WrongUsage(f'--lock: {text!r} is not JOINT=VALUE, such as q1=0')
        pairs.append((name.strip(), value.strip()))
    return pairs


def _document(
    derivation: 'Derivation',
    format: Format,
    frame: str | None,
    code: Code | None,
    path: str | None,
    span: tuple[float, float],
    plot: Path | None,
) -> str:
    from ..derive.output.code import code_of
    from ..derive.output.documents import document_of
    from ..derive.path import along

    if code is not None:
        return code_of(derivation, code.value)
    given = None if path is None else along(derivation, path, span)
    if plot is not None and given is not None:
        _plot(given, plot)
    return document_of(derivation, format.value, frame, given)


def _plot(along: 'PathAlong', file: Path) -> None:
    import numpy as np

    from ...pictures.plots.motion import SAMPLES, PlottedMotion
    from ...pictures.plots.picture import save_picture
    from ...pictures.plots.velocity import velocity_picture

    times = np.linspace(*along.span, SAMPLES)
    q, qdot = along.motion(times)
    motion = PlottedMotion(times, q, qdot, 'the path', False, np.array([], dtype=int))
    marked = [crossing.time for crossing in along.crossings]
    save_picture(velocity_picture(along.derivation.robot, motion, marked), file, other='.png')


def _write(derivation: 'Derivation', file: Path) -> None:
    from ....output_file import write_file
    from ....robot.file.writing.writer import with_factors
    from ..derive.file_factors import checked_text, factors_to_write

    factors = factors_to_write(derivation)
    if not factors:
        print(f'{file}: no factor to write: {_why_none(derivation)}')
        return
    text = with_factors(file.read_bytes().decode('utf-8'), factors)
    checked_text(derivation, text)
    write_file(file, text)
    print(f'wrote {file}: singularity.factors: {", ".join(factors)}')


def _why_none(derivation: 'Derivation') -> str:
    determinant = derivation.singular_set.determinant
    if determinant.expression is None:
        return 'there are too many minors to write out'
    if determinant.minors == 1:
        return 'the set is empty'
    if determinant.split:
        return 'the minors share none'
    return 'no common factor of the minors was found'
