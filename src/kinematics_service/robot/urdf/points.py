"""Links of a URDF beside the chain, as points of the robot file that was made from the chain."""

import re
from collections.abc import Callable, Iterable

import numpy as np

from ...errors import UrdfError
from ...kernel import Floats
from ...rigid_motion import exact_rpy
from ..chain import poses_and_frames
from ..robot import Robot
from .certificate import configurations
from .chain import UrdfChain

# Poses over which a link must keep its place in a frame of the table.
POSES = 16
RESERVED = ('base', 'tool')


def points_text(
    robot: Robot,
    chain: UrdfChain,
    links: Iterable[str],
    way_to: Callable[[str], UrdfChain],
    tolerance: float,
) -> str:
    """
    Return the section `points` of a robot file, empty for no links.

    Parameters
    ----------
    robot
        The robot that has been made from the chain.
    chain
        From the base to the tip.
    links
        Names of links that become points.
    way_to
        Returns the chain from the base to a link.
    tolerance
        How exactly a link must be fixed to a frame of the table, m and parts of a turn.

    Raises
    ------
    UrdfError
        There is no such link, or it is not fixed to what the chain moves.
    """
    lines = [_line(robot, chain, link, way_to(link), tolerance) for link in links]
    return ''.join(['points:\n', *lines]) if lines else ''


def _line(robot: Robot, chain: UrdfChain, link: str, way: UrdfChain, tolerance: float) -> str:
    names = [variable.name for variable in chain.variables]
    for variable in way.variables:
        if variable.name not in names:
            raise UrdfError(
                f'the link {link!r} moves with the joint {variable.name!r}, which is not on the '
                'way to the tip: it cannot be a point of this arm'
            )
    q = configurations(chain, POSES)
    poses = way.poses(q[:, [names.index(variable.name) for variable in way.variables]])
    for row, frames in enumerate(np.moveaxis(poses_and_frames(robot.chain, q)[1], 1, 0)):
        places = _seen_from(frames, poses)
        if np.abs(places - places[0]).max() <= tolerance:
            place = places[0]
            xyz, rpy = (_numbers(three) for three in (place[:3, 3], exact_rpy(place[:3, :3])))
            return f'  {_point_name(link)}: {{row: {row}, xyz: [{xyz}], rpy: [{rpy}]}}\n'
    raise UrdfError(f'the link {link!r} is fixed to no frame of the table')


def _seen_from(frames: Floats, poses: Floats) -> Floats:
    turned = np.swapaxes(frames[:, :3, :3], 1, 2)
    result = poses.copy()
    result[:, :3, :3] = turned @ poses[:, :3, :3]
    result[:, :3, 3] = (turned @ (poses[:, :3, 3] - frames[:, :3, 3])[..., None])[..., 0]
    return result


def _numbers(three: Iterable[float]) -> str:
    # What is round-off of zero is zero.
    return ', '.join(f'{0.0 if abs(value) < 1e-15 else float(value)!r}' for value in three)


def _point_name(link: str) -> str:
    name = re.sub(r'[^A-Za-z0-9]+', '_', link).strip('_')
    if name in RESERVED:
        return f'{name}_link'
    return name if name[:1].isalpha() else f'link_{name}'
