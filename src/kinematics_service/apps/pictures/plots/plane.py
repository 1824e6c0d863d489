"""
The plane of a section of the workspace: the half plane of joint 1's axis, or one along two base
axes.
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
# Number of random poses for the test whether the tool leaves a plane, and its tolerance.
TRIED, FLAT = 500, 1e-9


@dataclass(frozen=True, eq=False)
class Plane(FrozenArrays):
    """
    Two coordinates of a point in the base frame.

    Attributes
    ----------
    name
        One of `PLANES`.
    origin : shape (3,), m
        A point of the plane; of the half plane, of its edge, the axis.
    across, up : shape (3,)
        Unit vectors of the coordinates; `up` of the half plane is along its edge, and `across` is
        then not used: the radius points to the tool.
    at
        Position on the third axis of a plane along base axes, m.
    labels
        Labels of both coordinates, with units.
    title
        The plane in words.
    """

    name: str
    origin: Floats
    across: Floats
    up: Floats
    at: float
    labels: tuple[str, str]
    title: str

    @property
    def half(self) -> bool:
        """Return whether it is the half plane of radius and height."""
        return self.name == 'rz'

    @property
    def normal(self) -> Floats:
        """Return the unit vector across the plane, shape (3,)."""
        return np.cross(self.across, self.up)

    def coordinates(self, points: Floats) -> Floats:
        """Return both coordinates of points (..., 3), shape (..., 2), m."""
        if not self.half:
            return np.stack([points @ self.across, points @ self.up], axis=-1)
        radius = np.linalg.norm(self._radial(points), axis=-1)
        return np.stack([radius, points @ self.up], axis=-1)

    def gradients(self, points: Floats) -> Floats:
        """
        Return unit vectors (..., k, 3) along which the coordinates grow: both, then the normal.

        k is 2 for the half plane, since the first joint moves the tool along its normal.
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
    Return the plane of a name, or the one that shows most of this arm.

    Parameters
    ----------
    robot
        The arm.
    name
        One of `PLANES`; without it `rz` if joint 1 turns and the tool leaves its plane of turning,
        else the two base axes along which the tool moves farthest.
    at
        Position on the third axis of a plane along base axes, m; without it 0 if the tool reaches
        it, else the middle of the reach.

    Raises
    ------
    PlotError
        There is no such plane, or not for this arm.
    """
    if name is not None and name not in PLANES:
        raise PlotError(f'--plane: there is no plane {name!r}; choose from {", ".join(PLANES)}')
    axis = skeleton_of(robot, clear_pose(robot)).axes[0]
    turns = not axis.slides and len(axis.variables) == 1
    q = closed_poses(robot.chain, random_positions(robot, np.random.default_rng(SEED), TRIED))
    points = forward_kinematics(robot, q)[:, :3, 3]
    if name is None:
        height = np.ptp(points @ axis.direction)
        leaves = height > FLAT * robot.singularity.task.reach
        widths = np.ptp(points, axis=0)
        thin = int(np.argmin(widths))
        widest = next(name for name, axes in AXES.items() if thin not in axes)
        name = 'rz' if turns and leaves else widest
    if name == 'rz':
        if not turns:
            raise PlotError(
                f'--plane rz needs a first joint that turns; {robot.name} has none: '
                f'choose from {", ".join(AXES)}'
            )
        if at is not None:
            raise PlotError('--at goes with --plane xy, xz or yz: rz is about the axis of joint 1')
        return _half_plane(axis)
    return _base_plane(name, at, points, FLAT * robot.singularity.task.reach)


def _half_plane(axis: JointAxis) -> Plane:
    direction = axis.direction
    along = int(np.argmax(np.abs(direction)))
    direction = direction * math.copysign(1.0, direction[along])
    parallel = direction[along] > 1.0 - FLAT
    if parallel:
        direction = np.eye(3)[along]
    who = short(axis.variables[0])
    height = 'xyz'[along] if parallel else f'along the axis of {who}'
    return Plane(
        name='rz',
        origin=np.array(axis.point),
        across=np.roll(direction, 1),
        up=np.array(direction),
        at=0.0,
        labels=(with_unit(f'distance from the axis of {who}', 'm'), with_unit(height, 'm')),
        title=f'half plane of the axis of {who}',
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
        at=at,
        labels=(with_unit(name[0], 'm'), with_unit(name[1], 'm')),
        title=f'plane {"xyz"[third]} = {at:.3g} m',
    )
