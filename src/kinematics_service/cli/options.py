"""The options several commands share, and what their values mean."""

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
from ..robot.file.text.expressions import Scope, parse_affine
from ..robot.file.text.plain_expression import plain_expression
from ..robot.file.translation import translator_of
from ..robot.points import TOOL
from ..robot.robot import Robot, load_robot, robot_in_letters
from ..typography import counted, plain_names

WITH_PI = re.compile(r'[-+*/0-9.]*(pi|°)[-+*/0-9.pi]*')  # or with a degree sign
NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?')

LARGEST = 256 * 1024  # bytes of a text that is given
UTF_16 = (b'\xff\xfe', b'\xfe\xff')  # as spreadsheets begin their Unicode text
ROBOT = 'FILE|NAME'
NODE = '/kinematics'  # full name of the node that is meant if none is named
ROBOT_WORDS = 'A robot file, a URDF (with --base and --tip LINK), or a bundled robot.'


def robots_like(incomplete: str) -> list[str]:
    """Return the bundled robots whose name a word begins, for completion by a shell."""
    return [name for name in bundled_robots() if name.startswith(incomplete)]


def named(name: str, words: str, metavar: str | None = None, **others: Any) -> Any:
    """Return an option of that name for what several commands have, which take its default."""
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
    Return an option that takes a value.

    Parameters
    ----------
    words, metavar
        Its help, and the word for its value there.
    default
        Its value where it is not given; `...` where it must be.
    name
        `--name` where it is not that of the parameter.
    shown
        The default in words.
    least, most
        The bounds of a number.
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
    """Return an option without a value."""
    return typer.Option(False, name, help=words)


class WrongUsage(typer.BadParameter):
    """A command line that makes no sense: exit code 2, with its text as the message."""

    def format_message(self) -> str:
        """Return the sentence itself, without typer's preface."""
        return self.message


def refuse_unwritable(option: str, file: Path) -> None:
    """Refuse an output that cannot be written, before anything is computed for it."""
    folder = file.parent
    if file.is_dir():
        raise WrongUsage(f'{option}: {file} is a folder: give the file itself')
    if not folder.is_dir():
        raise WrongUsage(f'{option}: there is no folder {folder}')
    if reason := unwritable(file):
        raise WrongUsage(f'{option}: {reason}')


def refuse_robot_file(option: str, file: Path, robot: str) -> None:
    """Refuse an output that would take the place of the robot file it is made from."""
    if file.exists() and file.samefile(find_robot_file(robot)):
        raise WrongUsage(f'{option}: {file} is the robot file itself')


def refuse_unknown_robot(name: str) -> None:
    """Refuse a robot that is neither a file nor a bundled one, as wrong usage."""
    try:
        path = find_robot_file(name)
    except RobotNotFoundError as error:
        raise WrongUsage(f'--robot: {error}') from None
    if not path.exists():
        raise WrongUsage(f'--robot: there is no file {path}')


def given_robot(name: str, in_letters: bool = False) -> Robot:
    """
    Return the robot of a name; what is doubtful in a URDF is printed.

    `in_letters`: constants of its file may have no value.

    Raises
    ------
    RobotFileError, UrdfError
        The file exists but holds no valid robot.
    """
    refuse_unknown_robot(name)
    robot = robot_in_letters(name) if in_letters else load_robot(name)
    if translator_of(robot.description.file):  # a robot file has been checked by its author
        for doubt in robot.description.warnings:
            print(doubt_text(doubt), file=sys.stderr)
    return robot


def doubt_text(doubt: Fault) -> str:
    """Return what is allowed but most likely a mistake, as a line for the user."""
    return str(replace(doubt, where=f'WARN {doubt.where}'))


def given_point(text: str) -> str | int:
    """Return what `--of` or `--axes` names: a row where it is a whole number."""
    return int(text) if re.fullmatch('[0-9]{1,6}', text) else text


def ending_at(robot: Robot, of: str | None, at: str | None = None) -> Robot:
    """Return the robot whose tool is what `--of` and `--at` say, or the robot itself."""
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
            data = sys.stdin.buffer.read(LARGEST + 1)
        else:
            with Path(file).open('rb') as stream:
                data = stream.read(LARGEST + 1)
    except OSError as error:
        raise WrongUsage(f'cannot read {file}: {error.strerror}') from None
    if len(data) > LARGEST:
        raise WrongUsage(f'{file} is larger than {LARGEST // 1024} KiB')
    try:
        return data.decode('utf-16' if data[:2] in UTF_16 else 'utf-8-sig')
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b'\n') + 1
        raise WrongUsage(f'{file}:{line}: not UTF-8 text') from None


def given_numbers(
    option: str, text: str, count: int, angles: bool = False, degrees: bool = False
) -> Floats:
    """Return the numbers of an option that takes so many, shape (count,), angles in rad."""
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
    # A number in SI units; 90° and pi/2 are understood too. None for another word.
    if NUMBER.fullmatch(word):
        return math.radians(float(word)) if angle and degrees else float(word)
    if not WITH_PI.fullmatch(word):
        return None
    if degrees and 'pi' in word:
        raise WrongUsage(f'{option}: {word} beside --deg: write degrees, or leave out --deg')
    try:
        return parse_affine(plain_expression(word, (), 'rad', int(angle)), Scope()).constant
    except ExpressionError as error:
        raise WrongUsage(f'{option}: {error}') from None


def given_positions(robot: Robot, text: str, degrees: bool) -> Floats:
    """Return the joint positions of `--q`, shape (n,), rad or m; ask if they look like degrees."""
    q = joint_values(robot, text, '--q', degrees)
    if not degrees and _look_like_degrees(robot, q):
        print('--q is read in radians, and is far out: did you mean --deg?', file=sys.stderr)
    return q


def _look_like_degrees(robot: Robot, q: Floats) -> bool:
    # More than a turn and beyond the limits in radians, while all would fit in degrees.
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

    Accepted are commas, spaces, and brackets around them all.
    """
    words = _words(text)
    turning = [*~robot.prismatic, *(True for _ in words)]  # and where there are too many
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
        # 0,1,0,2 for two joints
        halves = len(words) == 2 * robot.dof and '.' not in text
        points = ','.join(map('.'.join, zip(words[::2], words[1::2])))
        raise WrongUsage(
            f'{option}: {robot.name} has {counted(robot.dof, "joint")} '
            f'({", ".join(robot.joint_names)}), not {len(words)}'
            + (f'; with decimal points: {option}={points}' if halves else '')
        )
    return np.array(values)
