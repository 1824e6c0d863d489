"""The command `postures`: whether an arm can change its posture without a singular pose."""

import numpy as np

from ..kernel import Floats
from ..kinematics.postures.change import DISTANCE, posture_change
from ..kinematics.postures.result import PostureChange
from ..printing import Output, attributes, facts, heading, json_text, number, plain
from ..robot.robot import Robot
from .options import DegreesOption, JsonOption, RobotOption, flag, given_robot, option
from .singularity_report import DEGREES, arm_json

SENTENCES = {
    'yes': 'changes its posture without meeting a singular pose',
    'no': 'changes no posture without meeting a singular pose',
    'not decided': 'whether it changes posture without meeting a singular pose is not decided',
}


def postures(
    robot: RobotOption,
    distance: float = option(
        'How near a singular pose a path may come, rad.', default=DISTANCE, least=0.0
    ),
    seed: int = option('Seed of the search for a path.', default=0, least=0),
    everything: bool = flag('--all', 'Also look for paths outside the joint limits.'),
    deg: DegreesOption = False,
    json: JsonOption = False,
) -> None:
    """
    Print whether an arm can change from one posture of a target to another without meeting a
    singular pose, which makes it a cuspidal arm.

    \b
    Examples:
      kinematics_service postures ur5e
      kinematics_service postures crx10ia_l --deg
      kinematics_service postures arm.yaml --distance 0.05 --json

    yes: a path of the joints that was found and proved is printed. no: with the proof, which
    leaves limits aside. not decided: with what was tried. The postures of a target are listed
    by the signs of the factors of the determinant, of three joints also by the aspect they are
    in. Postures with different signs have a singular pose between them.

    \b
    The keys of --json, in m and rad:
      robot, base_frame, tool_frame, joint_names
      verdict, reason                yes, no or not decided; a sentence
      target                         4 rows of 4, or x y z
      groups                         objects: signs, aspect, q (a row a posture)
      aspects                        how many were told apart, or null
      path                           null, or a row of joint positions a point
      clearance                      null, or the distance that the path keeps, rad
    """
    arm = given_robot(robot)
    change = posture_change(arm, distance, not everything, seed)
    if json:
        path = change.path
        print(
            json_text(
                {
                    **arm_json(arm),
                    **attributes(change, 'verdict', 'reason', 'target', 'aspects'),
                    'groups': change.groups,
                    'path': path and path.q,
                    'clearance': path and path.check.singularity.lower,
                }
            )
        )
    else:
        _print(Output(), arm, change, deg)


def _print(out: Output, arm: Robot, change: PostureChange, degrees: bool) -> None:
    scale = np.where(arm.prismatic, 1.0, DEGREES) if degrees else np.ones(arm.dof)
    unit, places = ('deg', 2) if degrees else ('rad', 4)
    about = []
    for group in change.groups:
        aspect = f'aspect {group.aspect}' if group.aspect else ''
        label = ', '.join(filter(None, (group.signs, aspect)))
        about.append((label, _rows(group.q * scale, places)))
    if change.path is not None:
        about.append(('path', _rows(change.path.q * scale, places)))
    out.print(
        heading(f'{arm.name} {SENTENCES[change.verdict]}'),
        f'  {plain(change.reason)}',
        '',
        heading(f'     joints [{unit}{", m" if any(arm.prismatic) else ""}] of one target'),
        facts(about),
    )


def _rows(q: Floats, places: int) -> str:
    # A line for each row; all numbers of one width, so that rows of different tables align.
    return '\n'.join('  '.join(number(x, places).rjust(8) for x in row) for row in q.tolist())
