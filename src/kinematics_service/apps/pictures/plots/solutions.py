"""The picture of inverse kinematics: every way an arm reaches the target, side by side."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....kernel import Floats
from ....kinematics.inverse.result import IkFamily, IkResult
from ....kinematics.singularity import Singularities, singularity
from ....rigid_motion import roll_pitch_yaw
from ....robot.measures import MEASURES
from ....robot.robot import Robot
from .arm import azimuth_of, cube_around, draw_skeleton, set_space
from .artists import Axes, Figure
from .captions import positions, signed
from .picture import BLACK, PURPLE, VERMILION, Draw, words
from .skeleton import skeleton_of

# More poses than this are not drawn, only counted.
MOST = 16
# Heights in inches: of a panel, of its words, below it, above all panels, and of a line.
WIDTH, HEIGHT, WORDS, BELOW, HEAD, LINE = 3.4, 4.1, 0.85, 0.12, 0.2, 0.18
TEXT = 8.5
LETTERS = 12.5  # of the title to an inch
COLUMNS = {1: 1, 2: 2, 3: 3, 4: 4, 5: 3, 6: 3, 7: 4, 8: 4, 9: 3}


@dataclass(frozen=True, eq=False)
class SolutionPose:
    """Joint positions (n,) of a panel, its heading, and whether they are inside the limits."""

    q: Floats
    heading: str
    allowed: bool


def poses_of(result: IkResult) -> tuple[SolutionPose, ...]:
    """Return the poses to show: solutions, then families, or else the nearest pose."""
    poses = []
    for k, solution in enumerate(result.solutions):
        beyond = _beyond(solution.beyond)
        posture = f': {solution.posture}' if str(solution.posture) else ''
        poses.append(SolutionPose(solution.q, f'{k + 1}{posture}{beyond}', solution.feasible))
    for family in result.families:
        poses.append(
            SolutionPose(family.q, _family(family) + _beyond(family.beyond), family.feasible)
        )
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
    """Return the picture of the inverse kinematics of a target (4, 4) or (3,)."""
    poses = poses_of(result)
    point = target[:3, 3] if target.ndim == 2 else target
    shown = poses[:MOST]
    skeletons = [skeleton_of(robot, pose.q) for pose in shown]
    near = singularity(robot, np.array([pose.q for pose in shown]))

    def draw(figure: Figure) -> None:
        columns = COLUMNS.get(len(shown), 4)
        rows = math.ceil(len(shown) / columns)
        width = max(columns * WIDTH, 6.0)
        title = _title(robot, target, result, len(poses), int(width * LETTERS))
        height = rows * HEIGHT + HEAD + LINE * (title.count('\n') + 1)
        figure.set_size_inches(width, height)
        cube = cube_around(skeletons, point)
        for k, (pose, skeleton) in enumerate(zip(shown, skeletons)):
            row, column = divmod(k, columns)
            left, bottom = column / columns, (rows - 1 - row) * HEIGHT
            drawing = HEIGHT - WORDS - BELOW
            panel = (left, (bottom + BELOW) / height, 0.97 / columns, drawing / height)
            axes = figure.add_axes(panel, projection='3d')
            set_space(axes, cube, azimuth_of(skeleton), small=True)
            draw_skeleton(axes, skeleton, cube, label_size=None)
            _draw_target(axes, point)
            _write_heading(figure, robot, pose, _away(near, k), panel, height)
        figure.suptitle(title, y=1.0 - 0.1 / height)

    return draw


def _away(near: Singularities, k: int) -> str:
    distance = float(near.distance[k])
    farther = MEASURES['distance'].farther(distance)
    return f'singular: {farther}' if farther else f'distance to singularity {distance:.3f} rad'


def _write_heading(
    figure: Figure,
    robot: Robot,
    pose: SolutionPose,
    away: str,
    panel: Sequence[float],
    height: float,
) -> None:
    left, bottom, width, up = panel
    top = bottom + up + (WORDS - LINE / 2.0) / height
    figure.text(
        left + width / 2.0,
        top,
        words(pose.heading),
        ha='center',
        va='top',
        fontsize=TEXT + 0.5,
        fontweight='bold',
        color=BLACK if pose.allowed else VERMILION,
        linespacing=1.15,
    )
    figure.text(
        left + width / 2.0,
        top - LINE * (pose.heading.count('\n') + 1) / height,
        f'{positions(robot, pose.q, 40)}\n{away}',
        ha='center',
        va='top',
        fontsize=TEXT,
        linespacing=1.2,
    )


def _draw_target(axes: Axes, point: Floats) -> None:
    axes.plot(
        *point[:, None],
        marker='*',
        markersize=13,
        color=PURPLE,
        markeredgecolor='white',
        zorder=30,
        gid='target',
    )


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
    if count > MOST:
        reason += f'; the first {MOST} of {count} are drawn'
    lines = [*textwrap.wrap(where, width), *textwrap.wrap(words(reason), width)]
    return '\n'.join(lines)
