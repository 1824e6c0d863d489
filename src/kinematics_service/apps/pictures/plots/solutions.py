# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the solutions of inverse kinematics side by side, one panel for each solution."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....kernel import Floats
from ....kinematics.inverse.result import IkFamily, IkResult
from ....kinematics.singularity import Singularities, singularity
from ....rigid_motion import roll_pitch_yaw
from ....robot.measures import MEASURES
from ....robot.robot import Robot
from .arm import azimuth_of, cube_around, draw_skeleton, set_space
from .artists import Figure
from .captions import positions, signed
from .picture import BLACK, PURPLE, VERMILION, Draw, words
from .skeleton import skeleton_of

# Largest number of solutions that the picture shows, one in each panel. If more solutions exist,
# the picture gives their number as text.
MAX_PANELS = 16
# Largest number of panels in a row.
MAX_COLUMNS = 4
# Sizes, inches.
PANEL_WIDTH = 3.4
PANEL_HEIGHT = 4.3  # contains the text above the drawing
DRAWING_HEIGHT = 3.13  # height of the arm in a panel
GAP = 0.12  # height of the gap below each drawing
MIN_WIDTH = 6.0  # least width of the picture
LINE_HEIGHT = 0.18  # height of a line of the title
# Number of letters of the title per inch of width.
LETTERS = 12.5


@dataclass(frozen=True, eq=False)
class SolutionPose:
    """
    The joint positions (n,) that a panel shows, the heading of the panel, and whether the
    positions are inside the joint limits.
    """

    q: Floats
    heading: str
    allowed: bool


def poses_of(result: IkResult) -> tuple[SolutionPose, ...]:
    """
    Return the configurations that the picture shows: each solution, and one configuration of each
    solution curve. If the target has no solution, return the configuration whose tool pose is
    nearest to the target.
    """
    poses = []
    for k, solution in enumerate(result.solutions):
        beyond = _beyond(solution.beyond)
        posture = f': {solution.posture}' if str(solution.posture) else ''
        poses.append(SolutionPose(solution.q, f'{k + 1}{posture}{beyond}', solution.feasible))
    for family in result.families:
        heading = f'{_family(family)}{_beyond(family.beyond)}'
        poses.append(SolutionPose(family.q, heading, family.feasible))
    nearest = result.nearest
    if not poses and nearest is not None:
        off = f'{nearest.position_error:.3g} m and {math.degrees(nearest.rotation_error):.3g}°'
        poses.append(SolutionPose(nearest.q, f'nearest pose: {off} off the target', False))
    return tuple(poses)


def _family(family: IkFamily) -> str:
    count = len(family.joints)
    moves = ', '.join(family.joints) if count <= 2 else f'{count} joints'
    return f'one of a family:\n{moves} {"moves" if count == 1 else "move together"}'


def _beyond(names: Sequence[str]) -> str:
    return f'\nbeyond the limits of {", ".join(names)}' if names else ''


def solutions_picture(robot: Robot, target: Floats, result: IkResult) -> Draw:
    """Return the picture of the solutions for a target (4, 4) or (3,)."""
    poses = poses_of(result)
    point = target[:3, 3] if target.ndim == 2 else target
    shown = poses[:MAX_PANELS]
    skeletons = [skeleton_of(robot, pose.q) for pose in shown]
    near = singularity(robot, np.array([pose.q for pose in shown]))

    def draw(figure: Figure) -> None:
        rows = math.ceil(len(shown) / MAX_COLUMNS)
        columns = math.ceil(len(shown) / rows)
        width = max(columns * PANEL_WIDTH, MIN_WIDTH)
        title = _title(robot, target, result, len(poses), int(width * LETTERS))
        height = rows * PANEL_HEIGHT + LINE_HEIGHT * (title.count('\n') + 2)
        figure.set_size_inches(width, height)
        cube = cube_around(skeletons, point)
        for k, (pose, skeleton) in enumerate(zip(shown, skeletons)):
            row, column = divmod(k, columns)
            bottom = (rows - 1 - row) * PANEL_HEIGHT + GAP
            panel = column / columns, bottom / height, 0.97 / columns, DRAWING_HEIGHT / height
            axes = figure.add_axes(panel, projection='3d')
            set_space(axes, cube, azimuth_of(skeleton), small=True)
            draw_skeleton(axes, skeleton, cube, label_size=None)
            star: dict[str, Any] = {'marker': '*', 'markersize': 13, 'markeredgecolor': 'white'}
            axes.plot(*point[:, None], color=PURPLE, gid='target', **star)
            text = f'{words(pose.heading)}\n{positions(robot, pose.q, 40)}\n{_away(near, k)}'
            axes.set_title(text, fontsize=9.0, color=BLACK if pose.allowed else VERMILION)
        figure.suptitle(title, y=1.0 - 0.1 / height)

    return draw


def _away(near: Singularities, k: int) -> str:
    distance = float(near.distance[k])
    farther = MEASURES['distance'].farther(distance)
    return f'singular: {farther}' if farther else f'distance to singularity {distance:.3f} rad'


def _title(robot: Robot, target: Floats, result: IkResult, count: int, width: int) -> str:
    point = target[:3, 3] if target.ndim == 2 else target
    where = f'{words(robot.name)}: {words(robot.tool_frame)} to x y z '
    where += '  '.join(signed(x, 3) for x in point) + ' m (star), '
    if target.ndim == 2:
        angles = np.degrees(roll_pitch_yaw(target[:3, :3]))
        where += 'roll pitch yaw ' + '  '.join(f'{signed(x, 1)}°' for x in angles)
    else:
        where += 'any orientation'
    reason = result.reason
    if not all(solution.feasible for solution in result):
        reason = f'{len(result)} solutions; {reason}'
    if count > MAX_PANELS:
        reason += f'; the first {MAX_PANELS} of {count} are drawn'
    lines = [*textwrap.wrap(where, width), *textwrap.wrap(words(reason), width)]
    return '\n'.join(lines)
