# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `fk`: print the pose of the tool at joint positions."""

from ..kernel import Floats
from ..kinematics.singularity import Singularity, singularity_of
from ..kinematics.tool_state import ToolState, evaluate
from ..printing import Output, attributes, facts, heading, json_text, number, numbers
from ..rigid_motion import roll_pitch_yaw
from . import options, singularity_report

# Text at the end of the help: the keys of the JSON object `singularity`.
HELP_ENDS = singularity_report.JSON_KEYS


def fk(
    robot: options.RobotOption,
    q: options.PositionsOption,
    of: options.OfOption = None,
    at: options.AtOption = None,
    deg: options.DegreesOption = False,
    everything: bool = options.flag(
        '--all', 'Also print the matrix, all measures, and a line per joint.'
    ),
    json: options.JsonOption = False,
) -> None:
    """
    Print the pose of the tool at joint positions, and how near the pose is to a singular pose.

    \b
    Examples:
      kinematics_service fk --robot puma560 --deg --q 20,35,-60,15,40,-70
      kinematics_service fk --robot ur5e --q=-0.1,-1.57,1.2,0,0.4,0 --json
      kinematics_service fk --robot puma560 --of 3 --q 0,0.8,3.1,0,0.8,0 --all

    Positions may be negative, and separated by commas, spaces or both. Positions of prismatic
    joints are in metres, even with --deg. With --of and --at the pose and the measures of
    singularity are those of another point of the arm instead of the tool.

    \b
    The keys of --json, in m and rad; null: infinite or undefined:
      robot, base_frame, tool_frame, joint_names, q
      beyond_limits                  names of joints outside their limits
      position                       x y z of the tool in the base frame
      quaternion_xyzw                unit length, w >= 0
      roll_pitch_yaw                 R = Rz(yaw) Ry(pitch) Rx(roll)
      matrix                         4 rows of 4
      singularity                    an object:
    """
    arm = options.ending_at(options.given_robot(robot), of, at)
    state = evaluate(arm, options.given_positions(arm, q, deg))
    singularity = singularity_of(state)
    if json:
        document = {
            **singularity_report.state_json(state),
            **attributes(state, 'position', 'quaternion_xyzw'),
            'roll_pitch_yaw': roll_pitch_yaw(state.pose[:3, :3]),
            'matrix': state.pose,
            'singularity': singularity_report.singularity_json(arm, singularity),
        }
        print(json_text(document))
    else:
        _print_pose(Output(), state, singularity, everything)


def _print_pose(out: Output, state: ToolState, singularity: Singularity, everything: bool) -> None:
    robot = state.robot
    rpy = roll_pitch_yaw(state.pose[:3, :3])
    in_rad = f'{numbers(rpy)}  rad\n' if everything else ''
    pose = [
        ('position x y z', f'{numbers(state.position)}  m'),
        ('quaternion x y z w', numbers(state.quaternion_xyzw)),
        ('roll pitch yaw', f'{in_rad}{numbers(rpy * singularity_report.DEGREES, 4)}  deg'),
    ]
    title = f'{robot.name}: pose of {robot.tool_frame} in {robot.base_frame}'
    if everything:
        out.print(heading(title), facts([*pose, ('matrix', _matrix_text(state.pose))]))
        singularity_report.print_singularity(out, state, singularity)
    else:
        title += ' (--all prints more)'
        out.print(
            heading(title), facts([*pose, *singularity_report.short_measures(state, singularity)])
        )


def _matrix_text(matrix: Floats) -> str:
    texts = [[number(entry) for entry in row] for row in matrix]
    width = max(len(text) for row in texts for text in row)
    return '\n'.join('  '.join(text.rjust(width) for text in row) for row in texts)
