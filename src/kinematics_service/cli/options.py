# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define options that several commands have, and convert the values of options."""

import math
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import EllipsisType
from typing import Annotated, Any, Optional

import numpy as np
import typer

from ..errors import ExpressionError, Fault, PointError, RobotNotFoundError
from ..kernel import Floats
from ..output_file import unwritable
from ..robot.bundled import bundled_robots, find_robot_file
from ..robot.file.reader import NO_SUCH_FILE
from ..robot.file.text.expressions import Scope, parse_affine
from ..robot.file.text.plain_expression import plain_expression
from ..robot.file.translation import translator_of
from ..robot.points import TOOL
from ..robot.robot import Robot, load_robot, robot_in_letters
from ..typography import counted, plain_names

# Matches a number with pi or a degree sign, such as -pi/2 or 90°.
WITH_PI = re.compile(r'[-+*/0-9.]*(pi|°)[-+*/0-9.pi]*')
NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?')

MAX_BYTES = 256 * 1024  # largest size of a text file or of standard input, bytes
# The first bytes of UTF-16 text, as some spreadsheets write it.
UTF_16 = (b'\xff\xfe', b'\xfe\xff')
ROBOT = 'FILE|NAME'
NODE = '/kinematics'  # the default name of the node, with its namespace
ROBOT_WORDS = 'A robot file, a URDF (with --base and --tip LINK), or a bundled robot.'


def robots_like(incomplete: str) -> list[str]:
    """
    Return the names of the bundled robots that begin with `incomplete`.

    A shell completes a command line with these names.
    """
    return [name for name in bundled_robots() if name.startswith(incomplete)]


def named(name: str, words: str, metavar: str | None = None, **others: Any) -> Any:
    """
    Return a typer option for the annotation of a function's parameter.

    The default value of the option is that of the parameter.
    """
    return typer.Option(name, help=words, metavar=metavar, **others)


RobotOption = Annotated[str, named('--robot', ROBOT_WORDS, ROBOT, autocompletion=robots_like)]
RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar='ROBOT', help=f'{ROBOT_WORDS} Also by --robot.', autocompletion=robots_like
    ),
]
PositionsOption = Annotated[
    str, named('--q', 'Joint positions in rad and m, in the order of the robot.', 'NUMBERS')
]
DegreesOption = Annotated[
    bool, named('--deg', 'Angles on the command line are in degrees; lengths stay metres.')
]
OfOption = Annotated[
    Optional[str],
    named(
        '--of',
        'Instead of the tool: a point of the robot file, or a row of its table (0: the '
        "table's frame 0, i: the frame after row i).",
        'POINT',
    ),
]
AtOption = Annotated[
    Optional[str], named('--at', 'A point fixed to that frame, in its coordinates, in m.', 'X,Y,Z')
]
JsonOption = Annotated[bool, named('--json', 'Print one JSON object, in SI units.')]


def option(
    words: str,
    metavar: str | None = None,
    default: str | float | EllipsisType | None = None,
    name: str | None = None,
    shown: str | bool = True,
    least: float | None = None,
    most: float | None = None,
) -> Any:
    """
    Return a typer option that takes a value.

    Parameters
    ----------
    words, metavar
        Help text of the option, and the word that stands for its value in the help.
    default
        The value of a missing option; `...` if the option is required.
    name
        The name `--name` of the option, if it is not the name of the parameter.
    shown
        Text for the default in the help; True shows the value of the default.
    least, most
        The smallest and the largest number that the option accepts.
    """
    names = () if name is None else (name,)
    return typer.Option(
        default,
        *names,
        metavar=metavar,
        help=words,
        show_default=shown,
        min=least,
        max=most,
        autocompletion=robots_like if metavar == ROBOT else None,
    )


def flag(name: str, words: str) -> Any:
    """Return a typer option without a value (a flag), which is off by default."""
    return typer.Option(False, name, help=words)


class WrongUsage(typer.BadParameter):
    """
    Wrong usage of the command line. The program prints the message of this exception and exits
    with code 2.
    """

    def format_message(self) -> str:
        """Return only the message, because typer would put other words before it."""
        return self.message


def refuse_unwritable(option: str, file: Path) -> None:
    """
    Raise WrongUsage if an output file cannot be written. Call this before you compute its content.
    """
    folder = file.parent
    if file.is_dir():
        raise WrongUsage(f'{option}: {file} is a folder: give the file itself')
    if not folder.is_dir():
        message = f'{option}: there is no folder {folder}; make it first (mkdir -p {folder})'
        raise WrongUsage(message)
    if reason := unwritable(file):
        raise WrongUsage(f'{option}: {reason}')


def refuse_robot_file(option: str, file: Path, robot: str) -> None:
    """Raise WrongUsage if an output file would overwrite the robot file."""
    if file.exists() and file.samefile(find_robot_file(robot)):
        raise WrongUsage(f'{option}: {file} is the robot file itself; give another file')


def refuse_unknown_robot(name: str) -> None:
    """Raise WrongUsage if a name is neither a file nor a bundled robot."""
    try:
        path = find_robot_file(name)
    except RobotNotFoundError as error:
        raise WrongUsage(f'--robot: {error}') from None
    if not path.exists():
        raise WrongUsage(f'--robot: {path}: {NO_SUCH_FILE}')


def given_robot(name: str, in_letters: bool = False) -> Robot:
    """
    Return the robot of a name or file; for a URDF, print warnings about probable mistakes.

    With `in_letters` the constants of the robot file need no values.

    Raises
    ------
    RobotFileError, UrdfError
        The file exists, but does not describe a valid robot.
    """
    refuse_unknown_robot(name)
    robot = robot_in_letters(name) if in_letters else load_robot(name)
    # Print warnings only for a URDF. For a robot file, only the command `check` prints warnings.
    if translator_of(robot.description.file):
        for doubt in robot.description.warnings:
            print(doubt_text(doubt), file=sys.stderr)
    return robot


def doubt_text(doubt: Fault) -> str:
    """
    Return a warning as one line of text. The warning is about a part of a file that is allowed,
    but probably a mistake.
    """
    return str(replace(doubt, where=f'WARN {doubt.where}'))


def given_point(text: str) -> str | int:
    """
    Return the value of the option `--of` or `--axes`: the number of a table row, or a point's
    name.
    """
    return int(text) if re.fullmatch('[0-9]{1,6}', text) else text


def ending_at(robot: Robot, of: str | None, at: str | None = None) -> Robot:
    """
    Return a robot whose tool is the point that the options `--of` and `--at` give.

    If neither option is given, return the robot unchanged.
    """
    if of is None and at is None:
        return robot
    try:
        return robot.ending_at(
            given_point(of or TOOL), None if at is None else given_numbers('--at', at, 3)
        )
    except PointError as error:
        raise WrongUsage(f'--{error.argument}: {error}') from None


def given_text(file: str) -> str:
    """Return the text of a file, or of standard input for `-`."""
    try:
        if file == '-':
            data = sys.stdin.buffer.read(MAX_BYTES + 1)
        else:
            with Path(file).open('rb') as stream:
                data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise WrongUsage(f'{file}: cannot be read: {error.strerror}') from None
    if len(data) > MAX_BYTES:
        raise WrongUsage(f'{file}: larger than {MAX_BYTES // 1024} KiB')
    try:
        return data.decode('utf-16' if data[:2] in UTF_16 else 'utf-8-sig')
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b'\n') + 1
        raise WrongUsage(f'{file}:{line}: not UTF-8 text; save the file as UTF-8') from None


def given_numbers(
    option: str, text: str, count: int, angles: bool = False, degrees: bool = False
) -> Floats:
    """
    Return the numbers in the text of an option, shape (count,), in SI units.

    If `angles` and `degrees` are true, the text has angles in degrees.
    """
    words = _words(text)
    values = [_value(option, word, angles, degrees) for word in words]
    if len(words) != count or None in values:
        example = ','.join(['0.1'] * count)
        raise WrongUsage(f'{option}: {text!r} is not {count} numbers, such as {option}={example}')
    return np.array(values, dtype=np.float64)


def _words(text: str) -> list[str]:
    text = re.sub(r'\s+°', '°', plain_names(text)).strip().strip('[]()').strip()
    return re.split(r'\s*,\s*|\s+', text.rstrip(','))


def _value(option: str, word: str, angle: bool, degrees: bool) -> float | None:
    # Return the number that a word such as 90° or pi/2 means, in SI units. Return None if the word
    # is not a number.
    if NUMBER.fullmatch(word):
        return math.radians(float(word)) if angle and degrees else float(word)
    if not WITH_PI.fullmatch(word):
        return None
    if degrees and 'pi' in word:
        raise WrongUsage(f'{option}: {word} is in radians; write degrees, or leave out --deg')
    try:
        return parse_affine(plain_expression(word, (), 'rad', int(angle)), Scope()).constant
    except ExpressionError as error:
        raise WrongUsage(f'{option}: {error}') from None


def given_positions(robot: Robot, text: str, degrees: bool) -> Floats:
    """
    Return the joint positions of `--q`, shape (n,), rad or m. If the numbers look like degrees,
    print a question on standard error.
    """
    q = joint_values(robot, text, '--q', degrees)
    if not degrees and _look_like_degrees(robot, q):
        message = '--q is read in radians and looks like degrees: did you mean --deg?'
        print(message, file=sys.stderr)
    return q


def _look_like_degrees(robot: Robot, q: Floats) -> bool:
    # Return whether the angles are probably in degrees. Two conditions must hold: taken as
    # radians, at least one angle is more than a turn and outside its limits; taken as degrees, all
    # angles are inside their limits.
    turning = ~robot.prismatic
    low, high = robot.limits.T
    bounded = np.isfinite(high - low)
    far = turning & (np.abs(q) > 2 * np.pi) & ((q < low) | (q > high) | ~bounded)
    angles = np.radians(q[turning])
    fit = np.all((angles >= low[turning]) & (angles <= high[turning]))
    return bool(far.any() and fit)


def joint_values(robot: Robot, text: str, option: str, degrees: bool) -> Floats:
    """
    Return the numbers of `--q` or `--qdot`, shape (n,), rad or m (rad/s or m/s).

    Commas or spaces separate the numbers; brackets around all numbers are allowed.
    """
    words = _words(text)
    # Read surplus numbers, for which the arm has no joint, as angles; they are refused below.
    turning = [*~robot.prismatic, *(True for _ in words)]
    values = []
    for word, turns in zip(words, turning):
        value = _value(option, word, turns, degrees)
        if value is None:
            raise WrongUsage(
                f'{option}: {word!r} is not a number; write {robot.dof} numbers, such as '
                f'{option}={",".join(["0.1"] * robot.dof)}'
            )
        values.append(value)
    if len(words) != robot.dof:
        # If the user has probably typed decimal commas, suggest decimal points. For two joints,
        # 0,1,0,2 most likely means 0.1,0.2.
        halves = len(words) == 2 * robot.dof and '.' not in text
        points = ','.join(map('.'.join, zip(words[::2], words[1::2])))
        raise WrongUsage(
            f'{option}: {robot.name} has {counted(robot.dof, "joint")} '
            f'({", ".join(robot.joint_names)}), not {len(words)}'
            + (f'; with decimal points: {option}={points}' if halves else '')
        )
    return np.array(values)
