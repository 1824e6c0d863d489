# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `jacobian`: print the Jacobian and the twist of the tool at joint positions."""

from typing import Annotated, Optional

import typer

from ..errors import PointError
from ..kernel import Floats
from ..kinematics.forward import BASE, in_axes_of, pose_of_axes
from ..kinematics.singularity import singularity_of
from ..kinematics.tool_state import evaluate
from ..printing import Output, broken_name, heading, json_text, number, plain, table
from ..robot.points import TOOL
from ..robot.robot import Robot
from ..robot.task import TWIST_ROWS
from . import options, singularity_report

# Width, in characters, of a column of the printed matrix. If a joint name is longer, break it into
# lines.
CELL = 9

# Text at the end of the help: the keys of the JSON object `singularity`.
HELP_ENDS = singularity_report.JSON_KEYS


def jacobian(
    robot: options.RobotOption,
    q: options.PositionsOption,
    qdot: Optional[str] = options.option(
        'Joint velocities in rad/s and m/s, for the twist.', 'NUMBERS'
    ),
    of: options.OfOption = None,
    at: options.AtOption = None,
    axes: Annotated[
        str,
        typer.Option(
            '--axes',
            '--frame',
            metavar='base|tool|POINT',
            help='The axes of the rows: of the base, the tool, a point, or the frame of a row.',
        ),
    ] = BASE,
    deg: options.DegreesOption = False,
    json: options.JsonOption = False,
) -> None:
    """
    Print the Jacobian at joint positions, the twist of the tool at joint velocities, and how near
    the pose is to a singular pose.

    \b
    Examples:
      kinematics_service jacobian --robot puma560 --q 0,0.8,3.1,0,0.8,0
      kinematics_service jacobian --robot planar_2r --deg --q 20,30 --qdot 5,-2

    The command prints the geometric Jacobian J with the rows vx vy vz wx wy wz and one column for
    each joint, in the order of the robot. The reference point is the tool's origin, and --axes
    gives the axes. The twist is J qdot in these axes. With --of and --at all results are those of
    another point of the arm instead of the tool.

    \b
    The keys of --json, in m, rad, s; null: infinite, undefined, not asked for:
      robot, base_frame, tool_frame, joint_names, q
      beyond_limits                  names of joints outside their limits
      frame                          the axes: base, tool, a point or a table row
      rows                           vx vy vz wx wy wz
      jacobian                       6 rows of n
      qdot, twist                    n and 6 numbers
      singularity                    an object:
    """
    whole = options.given_robot(robot)
    arm = options.ending_at(whole, of, at)
    rates = None if qdot is None else options.joint_values(arm, qdot, '--qdot', deg)
    state = evaluate(arm, options.given_positions(arm, q, deg), rates)
    J, twist = state.jacobian, None if qdot is None else state.twist
    if axes != BASE:
        try:
            pose = pose_of_axes(whole, options.given_point(axes), state.q)
        except PointError as error:
            raise options.WrongUsage(f'--axes: {error}') from None
        J = in_axes_of(pose, J)
        twist = None if twist is None else in_axes_of(pose, twist[:, None])[:, 0]
    singularity = singularity_of(state)
    if json:
        document = {
            **singularity_report.state_json(state),
            'frame': axes,
            'rows': TWIST_ROWS,
            'jacobian': J,
            'qdot': state.qdot,
            'twist': twist,
            'singularity': singularity_report.singularity_json(arm, singularity),
        }
        print(json_text(document))
        return
    out = Output()
    _print_jacobian(out, arm, at, _axes_name(whole, axes), J)
    if twist is not None:
        _print_twist(out, arm, at, _axes_name(whole, axes), twist)
    singularity_report.print_singularity(out, state, singularity)


def _axes_name(robot: Robot, axes: str) -> str:
    named = {BASE: robot.base_frame, TOOL: robot.tool_frame}
    return named.get(axes) or robot.point(options.given_point(axes)).name


def _place(robot: Robot, at: str | None) -> str:
    return f'the origin of {robot.tool_frame}' if at is None else f'({at}) of {robot.tool_frame}'


def _print_jacobian(out: Output, robot: Robot, at: str | None, axes: str, J: Floats) -> None:
    out.print(heading(f'{robot.name}: Jacobian of {_place(robot, at)}, axes of {axes}'))
    names = [plain(name) for name in robot.joint_names]
    # If the table is too wide for a line, break joint names into lines. If it is still too wide,
    # print the last columns below the first columns.
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
        for row, entries in zip(TWIST_ROWS, J[:, columns]):
            matrix.add_row(f'  {row}', *(number(entry, 5) for entry in entries))
        out.print('', matrix) if first else out.print(matrix)


def _print_twist(out: Output, robot: Robot, at: str | None, axes: str, twist: Floats) -> None:
    rows = table('', '', '')
    for column in rows.columns:
        column.justify = 'right'
    for name, value in zip(TWIST_ROWS[:3], twist[:3]):
        rows.add_row(f'  {name}', f'{number(value)} m/s')
    for name, value in zip(TWIST_ROWS[3:], twist[3:]):
        rows.add_row(
            f'  {name}',
            f'{number(value)} rad/s',
            f'{number(value * singularity_report.DEGREES, 4)} deg/s',
        )
    rows.show_header = False
    title = heading(f'Twist of {_place(robot, at)}, axes of {axes}')
    out.print('', title, rows)
