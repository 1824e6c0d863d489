# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `plot`: draw an arm, its paths, its singular sets and its workspace."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Optional, TypeVar

import typer

from ....cli import options
from ....cli.ik import NearOption, QuaternionOption, RpyOption, target_from
from ....errors import PlotError
from ....kernel import Floats
from ....kinematics.inverse.solve import inverse_kinematics
from ....robot.robot import Robot
from ..plots.arm import arm_picture
from ..plots.critical import critical_points
from ..plots.distance_map import distance_map, joint_pair
from ..plots.family import family_picture
from ..plots.map_picture import map_picture
from ..plots.measures import measures_picture
from ..plots.motion import motion_of
from ..plots.picture import Draw, refuse_without_matplotlib, save_picture, show_picture, suffix_of
from ..plots.plane import plane_of
from ..plots.ranges import clear_pose
from ..plots.solutions import solutions_picture
from ..plots.velocity import velocity_picture
from ..plots.workspace import workspace
from ..plots.workspace_picture import workspace_picture

Result = TypeVar('Result')
# Maps a kind of picture to the options that it accepts besides --of, --save, --show and --deg.
OPTIONS = {
    'arm': ('--q',),
    'ik': ('--xyz', '--rpy', '--quaternion', '--near'),
    'family': ('--xyz', '--rpy', '--quaternion', '--near'),
    'velocity': ('--path',),
    'measures': ('--path',),
    'map': ('--joints', '--q', '--points', '--workers'),
    'workspace': ('--plane', '--at', '--points', '--workers'),
}
ALL_OPTIONS = {name for names in OPTIONS.values() for name in names}
# Kinds of pictures that need a target pose or position.
TARGETS = ('ik', 'family')
# Number of grid points along each side of the map. A map of 280 x 280 points takes 20 s on two
# cores.
MAP_POINTS = 280
# Number of random configurations with which the search of a workspace starts, unless --points is
# given.
WORKSPACE_POINTS = 28_000
# Smallest and largest --points for a kind of picture.
POINTS = {'map': (2, 4000), 'workspace': (1000, 100_000_000)}


def plot(
    context: typer.Context,
    robot: options.RobotArgument,
    kind: Annotated[str, typer.Argument(metavar='KIND', help='What to draw.')] = 'arm',
    q: Optional[str] = options.option(
        'Joint positions in rad and m.', 'NUMBERS', shown='a pose far from singular ones'
    ),
    xyz: Optional[str] = options.option('Position of the tool, m.', 'NUMBERS'),
    rpy: RpyOption = None,
    quaternion: QuaternionOption = None,
    near: NearOption = None,
    path: Optional[str] = options.option(
        'A built-in trajectory, or a recording: stamp,position.<joint>,...',
        'smooth|sine|FILE.csv',
        shown='smooth',
    ),
    joints: Optional[str] = options.option(
        'Two joints.', 'ACROSS,UP', shown='the two that change the distance most'
    ),
    plane: Optional[str] = options.option(
        "Radius and height about joint 1's axis, or two base axes.",
        'rz|xy|xz|yz',
        shown='rz, or the widest base plane',
    ),
    at: Optional[float] = options.option(
        'Position of --plane xy, xz or yz on the third axis.', 'M', shown='0'
    ),
    points: Optional[int] = options.option(
        'Points on each side of the map, or random poses of the workspace.',
        'N',
        shown=f'{MAP_POINTS}; {WORKSPACE_POINTS}; fewer with closed loops',
    ),
    workers: Optional[str] = options.option(
        'Let a dask cluster compute the poses of map or workspace.',
        'dask://HOST:PORT',
        shown='here',
    ),
    of: options.OfOption = None,
    deg: options.DegreesOption = False,
    save: Optional[Path] = options.option(
        'A .png, .svg or .pdf.', 'FILE', shown='ROBOT_KIND.png, here'
    ),
    show: bool = options.flag('--show', 'Open a window instead.'),
) -> None:
    """
    Draw a picture of an arm, and write it as PNG, SVG or PDF.

    \b
    KIND is one of:
      arm         links, joint axes and frames in a pose        --q
      ik          every pose that reaches a target              --xyz --rpy --near
      family      a redundant arm's postures, joint by joint    --xyz --rpy --near
      velocity    the tool's velocity along a path              --path
      measures    measures of singularity along a path          --path
      map         distance to singularity over two joints       --joints --q
      workspace   the points of a plane that the tool reaches   --plane --at

    \b
    Examples:
      kinematics_service plot ur5e --q 0,-1.57,1.2,0,0.4,0
      kinematics_service plot ur5e ik --xyz 0.3,-0.2,0.4 --rpy 180,0,90 --deg
      kinematics_service plot craig_3r velocity --path sine --save velocity.svg
      kinematics_service plot ur5e measures --path recorded.csv
      kinematics_service plot craig_3r map --joints q2,q3
      kinematics_service plot puma560 workspace --plane xz --show

    Pictures need matplotlib. The same command gives the same picture, byte for byte.
    """
    given = (f'--{name}' for name, value in context.params.items() if value is not None)
    _refuse_unknown_options(robot, kind, [name for name in given if name in ALL_OPTIONS])
    if kind in TARGETS and xyz is None:
        message = f'plot {kind}: the target is missing; give one, such as --xyz 0.3,0.1,0.4'
        raise options.WrongUsage(message)
    if save is not None:
        _accepted(suffix_of, save)
    refuse_without_matplotlib()
    arm = options.ending_at(options.given_robot(robot), of)
    count = _points(arm, kind, points) if kind in POINTS else 0
    pose = None if q is None else options.given_positions(arm, q, deg)
    if kind in TARGETS:
        start = None if near is None else options.joint_values(arm, near, '--near', deg)
        draw, failed = _ik(arm, kind, target_from(xyz or '', rpy, quaternion, deg), start)
    else:
        draw, failed = _drawing(arm, kind, pose, path, joints, (plane, at), count, workers), ''
    if save is not None or not show:
        file = save or Path(f'{arm.name}_{kind}.png')
        save_picture(draw, file)
        print(f'wrote {file}')
    if show:
        show_picture(draw, f'{arm.name} {kind}')
    if failed:
        typer.echo(f'{arm.name}: {failed}', err=True)
        raise typer.Exit(1)


def _refuse_unknown_options(robot: str, kind: str, given: list[str]) -> None:
    if kind not in OPTIONS:
        order = ' (the robot comes first)' if robot in OPTIONS else ''
        message = f'plot: there is no kind {kind!r}{order}; choose from {", ".join(OPTIONS)}'
        raise options.WrongUsage(message)
    for name in given:
        if name not in OPTIONS[kind]:
            others = ' and '.join(other for other, names in OPTIONS.items() if name in names)
            message = f'{name} is for plot {others}; plot {kind} takes {", ".join(OPTIONS[kind])}'
            raise options.WrongUsage(message)


def _accepted(function: Callable[..., Result], *arguments: Any) -> Result:
    # Call a function of the library. If it refuses the value of an option, report wrong usage
    # (exit code 2).
    try:
        return function(*arguments)
    except PlotError as error:
        raise options.WrongUsage(str(error)) from None


def _points(robot: Robot, kind: str, given: int | None) -> int:
    low, high = POINTS[kind]
    if given is not None:
        if not low <= given <= high:
            message = f'--points: {given} is not accepted; plot {kind} takes {low} to {high}'
            raise options.WrongUsage(message)
        return given
    # Use fewer points for an arm with closed loops, because closing the loops takes time. The
    # number depends on the count of passive joints, not on a measured run time, so that the same
    # command gives the same picture.
    passive = max(1, len(robot.passive_joint_names))
    points = MAP_POINTS // math.isqrt(passive) if kind == 'map' else WORKSPACE_POINTS // passive
    return max(points, low)


def _ik(robot: Robot, kind: str, target: Floats, near: Floats | None) -> tuple[Draw, str]:
    curves = kind == 'family'
    result = inverse_kinematics(robot, target, near=near, respect_limits=False, curves=curves)
    if curves:
        return family_picture(robot, result), ''
    failed = result.status in ('outside_limits', 'unreachable')
    return solutions_picture(robot, target, result), result.reason if failed else ''


def _drawing(
    robot: Robot,
    kind: str,
    pose: Floats | None,
    path: str | None,
    joints: str | None,
    plane: tuple[str | None, float | None],
    points: int,
    workers: str | None,
) -> Draw:
    if kind == 'arm':
        return arm_picture(robot, clear_pose(robot) if pose is None else pose)
    if kind == 'map':
        names = None if joints is None else re.split(r'[\s,]+', joints.strip())
        pair = _accepted(joint_pair, robot, names)
        held = clear_pose(robot) if pose is None else pose
        return map_picture(robot, distance_map(robot, pair, held, points, workers))
    if kind == 'workspace':
        where = _accepted(plane_of, robot, *plane)
        space = workspace(robot, where, points, workers)
        return workspace_picture(robot, space, critical_points(robot, where))
    motion = _accepted(motion_of, robot, path or 'smooth')
    if kind == 'velocity':
        return velocity_picture(robot, motion)
    return measures_picture(robot, motion)
