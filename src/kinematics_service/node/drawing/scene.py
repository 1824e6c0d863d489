# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make the picture of an arm as plain data: segments, arrows and ellipsoids.

The page of `view` and the markers of a node draw the same scene.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...estimation.status_text import NEGLIGIBLE_RATIO, direction_in_words, flat_position
from ...kernel import Floats
from ...kinematics.loop_links import carried_rows, linked_frames
from ...kinematics.singularity import flat_loop, nearest_factor, none_found
from ...rigid_motion import across
from ...robot.measures import Level
from ...robot.robot import Robot
from .axes import RowAxis
from .ellipsoids import Ellipsoid, EllipsoidScales, ellipsoid_of, ellipsoid_scales
from .observation import Observation

# Colours of the singularity levels, which people with any colour vision can distinguish (Okabe and
# Ito). Pictures also show the level as text.
LEVEL_COLOURS = {
    Level.OK: (0, 114, 178),
    Level.WARN: (230, 159, 0),
    Level.ERROR: (200, 16, 46),
    Level.STALE: (110, 110, 110),
}
LINK_COLOUR = (150, 158, 168)
JOINT_COLOUR = (62, 68, 76)
TURNING_COLOUR = (86, 180, 233)
SLIDING_COLOUR = (204, 121, 167)
LINEAR_COLOUR = (0, 114, 178)
ANGULAR_COLOUR = (0, 158, 115)
VELOCITY_COLOUR = (110, 64, 190)
ROTATION_COLOUR = (0, 110, 80)
TRAIL_COLOUR = (150, 120, 210)
LOST_COLOUR = LEVEL_COLOURS[Level.ERROR]

# Radii and lengths in the picture, divided by the arm's size.
LINK_RADIUS = 0.022  # radius of a link
JOINT_RADIUS = 0.034  # radius of the cylinder of a joint
JOINT_LENGTH = 0.1  # length of the cylinder of a joint
AXIS_RADIUS = 0.005  # radius of the line along an axis
AXIS_LENGTH = 0.34  # length of the line along an axis
LOST_LENGTH = 0.42  # half length of the line along a direction in which the tool loses mobility
RING_RADIUS = 0.2  # radius of the ring about an axis about which the tool cannot turn
MIN_ELLIPSOID_RADIUS = 0.003  # least drawn radius, so that a flat ellipsoid is visible
MAX_ARROW_LENGTH = 0.8  # largest length of the arrows of velocity and rotation
MIN_ARROW_LENGTH = 1e-4  # length below which arrows and links are not drawn
ROTATION_ARROW_LENGTH = 0.25  # length of the arrow along the axis of rotation, at 1 rad/s
# The velocity arrow ends where the tool would be after this time (s).
VELOCITY_ARROW_TIME = 0.5
RING_SIDES = 36


class LostDirection(NamedTuple):
    """
    The direction in which the tool loses mobility near a singular pose.

    Attributes
    ----------
    linear : shape (2, 3), m, or None
        Ends of a line through the tool along the translation that the tool loses; None if the tool
        loses no translation.
    angular : shape (2, 3), m, or None
        Ends of a line through the tool along the axis of the rotation that the tool loses; None if
        the tool loses no rotation.
    name
        Name of the singular factor that is zero; empty if the robot file has no factors.
    words
        The lost translation and rotation as text.
    """

    linear: Floats | None
    angular: Floats | None
    name: str
    words: str


class Scene(NamedTuple):
    """
    The picture of an arm, in the base frame, in m.

    Attributes
    ----------
    size
        The arm's size, m, with which the thickness of lines is multiplied.
    links : shape (k, 2, 3)
        Line segments. They connect the base with frame 0, successive frames, and the last frame
        with the tool; further segments are the links of closed loops. Some segments have length 0;
        k is constant for an arm.
    frames : shape (m, 4, 4)
        Link frames.
    tool : shape (4, 4)
        The pose of the tool.
    axes, axis_labels
        The joint axes: those of the moving rows of the DH table, and those of the motor-driven
        joints in closed loops. Each axis has a label.
    velocity, rotation : shape (2, 3), or None
        Arrows from the tool along its velocity and its angular velocity.
    linear, angular
        Manipulability ellipsoids of the linear and the angular rows of J, drawn about the tool.
    scales
        Drawn lengths (m) of a singular value of 1.
    lost
        The direction in which the tool loses mobility; None if the level is neither WARN nor
        ERROR.
    level
        OK, WARN, ERROR or STALE.
    """

    size: float
    links: Floats
    frames: Floats
    tool: Floats
    axes: tuple[RowAxis, ...]
    axis_labels: tuple[str, ...]
    velocity: Floats | None
    rotation: Floats | None
    linear: Ellipsoid
    angular: Ellipsoid
    scales: EllipsoidScales
    lost: LostDirection | None
    level: Level

    def drawn_radii(self, ellipsoid: Ellipsoid, scale: float) -> Floats:
        """
        Return the drawn radii of an ellipsoid, shape (3,), m, each at least the visible minimum.
        """
        return np.maximum(ellipsoid.radii * scale, MIN_ELLIPSOID_RADIUS * self.size)


@lru_cache(maxsize=8)
def size_of(robot: Robot) -> float:
    """Return the size of an arm, m: its reach, or 1 if the tool cannot leave frame 0."""
    reach = float(robot.singularity.task.reach)
    return reach if reach > 1e-6 else 1.0


def scene_of(seen: Observation) -> Scene:
    """Return the picture of an arm, given its observation."""
    robot = seen.robot
    size, names = size_of(robot), short_names(robot.joint_names)
    movers = (*names, *robot.passive_joint_names)
    points = np.concatenate([np.zeros((1, 3)), seen.frames[:, :3, 3], seen.pose[None, :3, 3]])
    links = np.stack([points[:-1], points[1:]], axis=1)
    rows = np.array([False, *carried_rows(robot), False])
    tool = seen.pose[:3, 3]
    velocity = rotation = None
    if seen.twist is not None:
        velocity = _arrow(tool, VELOCITY_ARROW_TIME * seen.twist[:3], size)
        rotation = _arrow(tool, ROTATION_ARROW_LENGTH * size * seen.twist[3:], size)
    return Scene(
        size=size,
        links=np.concatenate([links[~rows], seen.loops]),
        frames=seen.frames[linked_frames(robot)],
        tool=seen.pose,
        axes=seen.axes,
        axis_labels=tuple(' & '.join(movers[j] for j in axis.joints) for axis in seen.axes),
        velocity=velocity,
        rotation=rotation,
        linear=ellipsoid_of(seen.jacobian[:3]),
        angular=ellipsoid_of(seen.jacobian[3:]),
        scales=ellipsoid_scales(robot, size),
        lost=_lost(seen, size) if seen.level in (Level.WARN, Level.ERROR) else None,
        level=seen.level,
    )


def _arrow(start: Floats, motion: Floats, size: float) -> Floats | None:
    length = float(np.linalg.norm(motion))
    if length < MIN_ARROW_LENGTH * size:
        return None
    return np.stack([start, start + motion * min(1.0, MAX_ARROW_LENGTH * size / length)])


def _lost(seen: Observation, size: float) -> LostDirection:
    if loop := flat_loop(seen.robot, seen.singularity):
        return LostDirection(None, None, '', f'near {flat_position(loop)}')
    direction = seen.singularity.lost_direction
    tool = seen.pose[:3, 3]

    def line(part: Floats) -> Floats | None:
        norm = float(np.linalg.norm(part))
        if norm < NEGLIGIBLE_RATIO * float(np.linalg.norm(direction)):
            return None
        # Draw the linear or angular part of the lost direction as a line. Half of its length is
        # LOST_LENGTH times the square root of the norm of the part, so that a small part stays
        # visible.
        half = LOST_LENGTH * size * part / norm**0.5
        return np.stack([tool - half, tool + half])

    words = f'lost: {direction_in_words(direction)}'
    return LostDirection(line(direction[:3]), line(direction[3:]), factor_name(seen), words)


def short_names(names: Sequence[str]) -> tuple[str, ...]:
    """
    Return joint names without the ending `_joint`, if all names have this ending and the shortened
    names are different.
    """
    short = tuple(name.removesuffix('_joint') for name in names)
    fit = all(s and s != name for s, name in zip(short, names)) and len(set(short)) == len(short)
    return short if fit else tuple(names)


def quaternion_along(direction: Floats) -> tuple[float, float, float, float]:
    """Return the quaternion x y z w of the shortest rotation of the z axis into a unit vector."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-12:
        return 1.0, 0.0, 0.0, 0.0
    # Let k = (0, 0, 1), and let d = (x, y, z) be the unit vector `direction`. The quaternion is
    # `(k x d, 1 + k.d)` = (-y, x, 0, 1 + z), divided by its norm.
    norm = math.sqrt(2.0 * (1.0 + z))
    return -y / norm, x / norm, 0.0, (1.0 + z) / norm


def ring(ends: Floats, size: float) -> Floats:
    """
    Return segments of a circle about the middle of a line segment, in the plane normal to the
    segment, shape (RING_SIDES, 2, 3), m.
    """
    line = ends[1] - ends[0]
    x, y = across(line / np.linalg.norm(line))
    angle = np.linspace(0.0, 2.0 * np.pi, RING_SIDES + 1)[:, None]
    points = ends.mean(axis=0) + RING_RADIUS * size * (np.cos(angle) * x + np.sin(angle) * y)
    return np.stack([points[:-1], points[1:]], axis=1)


def factor_name(seen: Observation) -> str:
    """Return the name of the singular factor that is nearest to zero; empty without factors."""
    k = nearest_factor(seen.robot, seen.singularity)
    return '' if k is None else seen.robot.singularity.factors.called(k)


def distance_text(seen: Observation) -> str:
    """Return the distance to the nearest singular pose as text, or that no pose was found."""
    distance = seen.singularity.distance
    shown = f'{distance:.3f} rad = {math.degrees(distance):.1f}°'
    return none_found(seen.singularity) or shown
