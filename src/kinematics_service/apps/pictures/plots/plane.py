# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the plane in which a workspace is drawn.

The plane is along two base axes, or it is the half plane that begins at the axis of joint 1.
"""

import math
from dataclasses import dataclass

import numpy as np

from ....errors import PlotError
from ....kernel import Floats
from ....kinematics.forward import forward_kinematics
from ....robot.chain import FrozenArrays
from ....robot.closed_poses import closed_poses
from ....robot.robot import Robot
from ....robot.task import SEED
from .captions import short
from .picture import with_unit
from .ranges import clear_pose, random_positions
from .skeleton import JointAxis, skeleton_of

AXES = {'xy': (0, 1), 'xz': (0, 2), 'yz': (1, 2)}
PLANES = ('rz', *AXES)
# Number of random configurations from which the extent of the tool's positions is computed.
POSES = 500
# The tool is taken not to move along an axis if the extent of its positions along the axis,
# divided by the arm's reach, is below this value. Two axes are parallel if 1 - cos of their angle
# is below this value.
TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Plane(FrozenArrays):
    """
    A plane (or half plane) in the base frame, with two coordinates.

    Attributes
    ----------
    name
        One of `PLANES`.
    origin : shape (3,), m
        A point of the plane. The half plane's edge is the axis of joint 1, and `origin` is on the
        edge.
    across, up : shape (3,)
        Unit vectors along the two coordinates. For the half plane, the first coordinate is the
        distance from the edge, `up` is along the edge, and `across` is not used.
    labels
        Labels of the coordinates, with units.
    title
        Description of the plane for the title of a picture.
    """

    name: str
    origin: Floats
    across: Floats
    up: Floats
    labels: tuple[str, str]
    title: str

    @property
    def half(self) -> bool:
        """Return whether the plane is the half plane with the coordinates radius and height."""
        return self.name == 'rz'

    @property
    def normal(self) -> Floats:
        """Return the unit normal of the plane, shape (3,)."""
        return np.cross(self.across, self.up)

    def coordinates(self, points: Floats) -> Floats:
        """
        Return the two plane coordinates of each point, for points (..., 3); shape (..., 2), m.
        """
        if not self.half:
            return np.stack([points @ self.across, points @ self.up], axis=-1)
        radius = np.linalg.norm(self._radial(points), axis=-1)
        return np.stack([radius, points @ self.up], axis=-1)

    def gradients(self, points: Floats) -> Floats:
        """
        Return the gradients of the two plane coordinates at points (..., 3).

        For a plane along two base axes, the result has the shape (..., 3, 3): two gradients, then
        the normal of the plane. For the half plane that begins at the axis of joint 1, the result
        has the shape (..., 2, 3): two gradients only. The normal is left out, because joint 1
        moves the tool along the normal.
        """
        up = np.broadcast_to(self.up, points.shape)
        if not self.half:
            across = np.broadcast_to(self.across, points.shape)
            return np.stack([across, up, np.broadcast_to(self.normal, points.shape)], axis=-2)
        radial = self._radial(points)
        length = np.linalg.norm(radial, axis=-1, keepdims=True)
        return np.stack([radial / np.where(length > 0.0, length, 1.0), up], axis=-2)

    def _radial(self, points: Floats) -> Floats:
        away = points - self.origin
        return away - (away @ self.up)[..., None] * self.up


def plane_of(robot: Robot, name: str | None = None, at: float | None = None) -> Plane:
    """
    Return the plane named `name`; if `name` is None, choose a plane in which the tool moves.

    Parameters
    ----------
    robot
        The arm.
    name
        One of `PLANES`. The default is `rz` if joint 1 turns and the tool moves along the axis of
        joint 1. Otherwise it is the plane along the two base axes along which the tool moves
        farthest.
    at
        For a plane along two base axes: its coordinate on the third axis, m. The default is 0 if
        the tool reaches the coordinate 0, else the middle of the tool's positions.

    Raises
    ------
    PlotError
        No plane is named `name`; or the plane is `rz`, and joint 1 does not turn or `at` is given.
    """
    if name is not None and name not in PLANES:
        message = f'--plane: there is no plane {name!r}; choose from {", ".join(PLANES)}'
        raise PlotError(message, code='unknown-name')
    axis = skeleton_of(robot, clear_pose(robot)).axes[0]
    turns = not axis.slides and len(axis.variables) == 1
    q = closed_poses(robot.chain, random_positions(robot, np.random.default_rng(SEED), POSES))
    points = forward_kinematics(robot, q)[:, :3, 3]
    if name is None:
        height = np.ptp(points @ axis.direction)
        rises = height > TOLERANCE * robot.singularity.task.reach
        widths = np.ptp(points, axis=0)
        thin = int(np.argmin(widths))
        widest = next(name for name, axes in AXES.items() if thin not in axes)
        name = 'rz' if turns and rises else widest
    if name == 'rz':
        if not turns:
            raise PlotError(
                f'--plane rz: the first joint of {robot.name} does not turn; choose from '
                f'{", ".join(AXES)}',
                code='conflict',
            )
        if at is not None:
            message = '--at is for --plane xy, xz or yz; leave it out, or choose one of them'
            raise PlotError(message, code='conflict')
        return _half_plane(axis)
    return _base_plane(name, at, points, TOLERANCE * robot.singularity.task.reach)


def _half_plane(axis: JointAxis) -> Plane:
    direction = axis.direction
    along = int(np.argmax(np.abs(direction)))
    direction = direction * math.copysign(1.0, direction[along])
    parallel = direction[along] > 1.0 - TOLERANCE
    if parallel:
        direction = np.eye(3)[along]
    joint = short(axis.variables[0])
    height = 'xyz'[along] if parallel else f'along the axis of {joint}'
    return Plane(
        name='rz',
        origin=np.array(axis.point),
        across=np.roll(direction, 1),
        up=np.array(direction),
        labels=(with_unit(f'distance from the axis of {joint}', 'm'), with_unit(height, 'm')),
        title=f'half plane of the axis of {joint}',
    )


def _base_plane(name: str, at: float | None, points: Floats, flat: float) -> Plane:
    across, up = AXES[name]
    third = 3 - across - up
    low, high = float(points[:, third].min()), float(points[:, third].max())
    if at is None:
        at = 0.0 if low <= 0.0 <= high and high - low > flat else (low + high) / 2.0
    unit = np.eye(3)
    return Plane(
        name=name,
        origin=at * unit[third],
        across=unit[across],
        up=unit[up],
        labels=(with_unit(name[0], 'm'), with_unit(name[1], 'm')),
        title=f'plane {"xyz"[third]} = {at:.3g} m',
    )
