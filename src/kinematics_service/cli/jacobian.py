"""The command `jacobian`: how joint velocities move the tool at given joint positions."""

from enum import Enum
from textwrap import indent
from typing import Annotated, Optional

import typer

from ..kernel import Floats
from ..kinematics.forward import in_axes
from ..kinematics.singularity import Singularity, singularity_of
from ..kinematics.tool_state import ToolState, evaluate
from ..printing import Output, broken_name, heading, json_text, number, plain, table
from ..robot.robot import Robot
from .application import app
from .options import (
    DegreesOption,
    JsonOption,
    PositionsOption,
    RobotOption,
    given_positions,
    given_robot,
    joint_values,
)
from .singularity_report import (
    DEGREES,
    JSON_KEYS,
    beyond_limits,
    print_singularity,
    singularity_json,
)

ROWS = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')
# Width of a column of the matrix: its numbers, and the longest part of a joint name that is
# printed on one line.
CELL = 9

HELP = f"""
Print the Jacobian at joint positions, the twist of the tool at joint velocities, and how near the
pose is to a singular one.

\b
Examples:
  kinematics_service jacobian --robot puma560 --q 0,0.8,3.1,0,0.8,0
  kinematics_service jacobian --robot planar_2r --deg --q 20,30 --qdot 5,-2

The Jacobian is the geometric one, rows vx vy vz wx wy wz, a column a joint in the order of the
robot; its reference point is the tool's origin, its axes are those of --frame. The twist is
J qdot in the same axes.

\b
The keys of --json, in m, rad, s; null: infinite, undefined, not asked for:
  robot, base_frame, tool_frame, joint_names, q
  beyond_limits                  names of joints outside their limits
  frame                          base or tool
  rows                           vx vy vz wx wy wz
  jacobian                       6 rows of n
  qdot, twist                    n and 6 numbers
  singularity                    an object:
{indent(JSON_KEYS, '  ')}
"""


class AxesOption(str, Enum):
    """The axes a Jacobian is written in."""

    base = 'base'
    tool = 'tool'


@app.command(short_help='Print the Jacobian and the twist of the tool.', help=HELP)
def jacobian(
    robot: RobotOption,
    q: PositionsOption,
    qdot: Annotated[
        Optional[str],
        typer.Option(metavar='NUMBERS', help='Joint velocities in rad/s and m/s, for the twist.'),
    ] = None,
    frame: Annotated[AxesOption, typer.Option(help='The axes of the rows.')] = AxesOption.base,
    deg: DegreesOption = False,
    json: JsonOption = False,
) -> None:
    """Run the command; `HELP` is what its user reads."""
    arm = given_robot(robot)
    rates = None if qdot is None else joint_values(arm, qdot, '--qdot', deg)
    state = evaluate(arm, given_positions(arm, q, deg), rates)
    J = in_axes(state, state.jacobian, frame.value)
    twist = None if qdot is None else in_axes(state, state.twist[:, None], frame.value)[:, 0]
    singularity = singularity_of(state)
    if json:
        print(_document(state, singularity, frame, J, twist))
        return
    out = Output()
    _print_jacobian(out, arm, frame, J)
    if twist is not None:
        _print_twist(out, arm, frame, twist)
    print_singularity(out, state, singularity)


def _document(
    state: ToolState, singularity: Singularity, frame: AxesOption, J: Floats, twist: Floats | None
) -> str:
    robot = state.robot
    return json_text(
        {
            'robot': robot.name,
            'base_frame': robot.base_frame,
            'tool_frame': robot.tool_frame,
            'joint_names': robot.joint_names,
            'q': state.q,
            'beyond_limits': beyond_limits(robot, state.q),
            'frame': frame.value,
            'rows': ROWS,
            'jacobian': J,
            'qdot': state.qdot,
            'twist': twist,
            'singularity': singularity_json(robot, singularity),
        }
    )


def _axes_name(robot: Robot, frame: AxesOption) -> str:
    return robot.base_frame if frame is AxesOption.base else robot.tool_frame


def _print_jacobian(out: Output, robot: Robot, frame: AxesOption, J: Floats) -> None:
    axes = _axes_name(robot, frame)
    out.print(
        heading(f'{robot.name}: Jacobian of the origin of {robot.tool_frame}, axes of {axes}')
    )
    names = [plain(name) for name in robot.joint_names]
    # Names on one line if there is room, else broken; then as many columns as there is room for.
    room = out.width - len('  vx  ')
    longest = max(CELL, *map(len, names))
    cell = longest if robot.dof * (longest + 2) <= room else CELL
    block = max(1, room // (cell + 2))
    for first in range(0, robot.dof, block):
        columns = slice(first, first + block)
        matrix = table('', *(broken_name(name, cell) for name in names[columns]))
        for column in matrix.columns[1:]:
            column.justify = 'right'
            column.min_width = CELL
            column.max_width = cell
        for row, entries in zip(ROWS, J[:, columns]):
            matrix.add_row(f'  {row}', *(number(entry, 5) for entry in entries))
        out.print('', matrix) if first else out.print(matrix)


def _print_twist(out: Output, robot: Robot, frame: AxesOption, twist: Floats) -> None:
    rows = table('', '', '')
    for column in rows.columns:
        column.justify = 'right'
    for name, value in zip(ROWS[:3], twist[:3]):
        rows.add_row(f'  {name}', f'{number(value)} m/s')
    for name, value in zip(ROWS[3:], twist[3:]):
        rows.add_row(f'  {name}', f'{number(value)} rad/s', f'{number(value * DEGREES, 4)} deg/s')
    rows.show_header = False
    title = heading(f'Twist of {robot.tool_frame}, axes of {_axes_name(robot, frame)}')
    out.print('', title, rows)
