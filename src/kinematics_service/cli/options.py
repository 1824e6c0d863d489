"""The options several commands share, and what their values mean."""

import re
import sys
from typing import Annotated

import numpy as np
import typer

from ..errors import RobotNotFoundError
from ..kernel import Floats
from ..robot.bundled import find_robot_file
from ..robot.robot import Robot, load_robot

NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?')
# Prefix of messages about faults of a robot.
OPTION = '--robot: '

RobotOption = Annotated[
    str, typer.Option('--robot', metavar='FILE|NAME', help='A robot file, or a bundled robot.')
]
RobotArgument = Annotated[
    str, typer.Argument(metavar='ROBOT', help='A robot file, or a bundled robot.')
]
PositionsOption = Annotated[
    str,
    typer.Option(
        '--q', metavar='NUMBERS', help='Joint positions in rad and m, in the order of the robot.'
    ),
]
DegreesOption = Annotated[
    bool,
    typer.Option('--deg', help='Angles on the command line are in degrees; lengths stay metres.'),
]
JsonOption = Annotated[bool, typer.Option('--json', help='Print one JSON object, in SI units.')]


class WrongUsage(typer.BadParameter):
    """A command line that makes no sense: exit code 2, with its text as the message."""

    def format_message(self) -> str:
        """Return the sentence itself, without typer's preface."""
        return self.message


def refuse_unknown_robot(name: str, where: str = OPTION) -> None:
    """
    Refuse a robot that is neither a file nor a bundled one, as wrong usage.

    `where` stands before the sentence: the option, or nothing where the robot has no option.
    """
    try:
        path = find_robot_file(name)
    except RobotNotFoundError as error:
        raise WrongUsage(f'{where}{error}') from None
    if not path.exists():
        raise WrongUsage(f'{where}there is no file {name}')


def given_robot(name: str, where: str = OPTION) -> Robot:
    """
    Return the robot of a name; `where` as `refuse_unknown_robot` takes it.

    Raises
    ------
    RobotFileError
        The file exists but holds no valid robot.
    """
    refuse_unknown_robot(name, where)
    return load_robot(name)


def given_positions(robot: Robot, text: str, degrees: bool) -> Floats:
    """Return the joint positions of `--q`, shape (n,), rad or m; ask if they look like degrees."""
    q = joint_values(robot, text, '--q', degrees)
    if not degrees and _look_like_degrees(robot, q):
        print('--q is read in radians, and is far out: did you mean --deg?', file=sys.stderr)
    return q


def _look_like_degrees(robot: Robot, q: Floats) -> bool:
    # More than a turn and beyond the limits in radians, while all would fit in degrees.
    turning = np.array([kind != 'prismatic' for kind in robot.joint_types])
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
    words = re.split(r'\s*,\s*|\s+', text.strip().strip('[]()').strip().rstrip(','))
    for word in words:
        if not NUMBER.fullmatch(word):
            raise WrongUsage(
                f'{option}: {word!r} is not a number; write {robot.dof} numbers, such as '
                f'{option}={",".join(["0.1"] * robot.dof)}'
            )
    if len(words) != robot.dof:
        joints = f'{robot.dof} joint' if robot.dof == 1 else f'{robot.dof} joints'
        raise WrongUsage(
            f'{option}: {robot.name} has {joints} ({", ".join(robot.joint_names)}), '
            f'not {len(words)}'
        )
    values = np.array([float(word) for word in words])
    if degrees:
        turning = np.array([kind != 'prismatic' for kind in robot.joint_types])
        values[turning] = np.radians(values[turning])
    return values
