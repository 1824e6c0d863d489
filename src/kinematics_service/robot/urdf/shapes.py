# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make simple shapes of an arm for viewers: rods between frames, and hubs on joint axes.

A robot file has no shapes of links. These shapes are symbols, not the outline of the arm. Do not
use them for collision checks.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from ...rigid_motion import across
from .elements import UNLIMITED, PlannedJoint, UrdfPlan

# Sizes of the drawn shapes, relative to the arm's characteristic length. They only affect the look
# in a viewer.
ROD_RADIUS = 0.025  # radius of rods between frames
HUB_RADIUS = 0.045  # radius of cylinders on joint axes
HUB_LENGTH = 0.11  # length of cylinders on joint axes
TOOL_RADIUS = 0.035  # radius of the sphere at the tool
UNLIMITED_STROKE = 0.5  # length of the rod of a prismatic joint without limits


@dataclass(frozen=True, eq=False)
class Shape:
    """
    One element `<visual>`: a shape of a link, for viewers.

    Parameters
    ----------
    kind
        `cylinder` (radius, length along z), `box` (x y z) or `sphere` (radius).
    size : m
        The sizes that `kind` lists.
    pose : shape (4, 4)
        Pose of the shape in the link's frame.
    colour
        `rod`, `turning`, `sliding` or `tool`.
    """

    kind: str
    size: tuple[float, ...]
    pose: Floats
    colour: str


def shapes_of(plan: UrdfPlan, length: float) -> dict[str, tuple[Shape, ...]]:
    """
    Return, for each link, its shapes. Sizes are proportional to the characteristic length (m).
    """
    shapes: dict[str, list[Shape]] = {link: [] for link in plan.links}
    for joint in plan.joints:
        shapes[joint.parent] += _rod(joint.origin[:3, 3], length)
        if joint.hub:
            shapes[joint.child] += _hub(joint, length)
    shapes[plan.tool].append(Shape('sphere', (_sized(TOOL_RADIUS * length),), np.eye(4), 'tool'))
    return {link: tuple(group) for link, group in shapes.items()}


def _sized(value: float) -> float:
    # Round a size to four digits, which are enough for a symbol.
    return float(f'{value:.4g}')


def _rod(end: Floats, length: float) -> Iterator[Shape]:
    # Yield a rod from the link's origin to the origin of the next link.
    distance = float(np.linalg.norm(end))
    if distance < ROD_RADIUS * length:
        return
    pose = _pointing(end / distance)
    pose[:3, 3] = end / 2.0
    yield Shape('cylinder', (_sized(ROD_RADIUS * length), _sized(distance)), pose, 'rod')


def _hub(joint: PlannedJoint, length: float) -> Iterator[Shape]:
    if joint.type != 'prismatic':
        size = (_sized(HUB_RADIUS * length), _sized(HUB_LENGTH * length))
        yield Shape('cylinder', size, np.eye(4), 'turning')
        return
    side = _sized(2.0 * HUB_RADIUS * length)
    yield Shape('box', (side, side, side), np.eye(4), 'sliding')
    assert joint.limit is not None  # `plan_of` gives a limit to every prismatic joint
    ends = (joint.limit.lower or 0.0, joint.limit.upper or 0.0)
    strokes = [abs(end) for end in ends if abs(end) < UNLIMITED]
    stroke = max(strokes, default=0.0)
    if len(strokes) < 2 or stroke == 0.0:
        stroke = UNLIMITED_STROKE * length
    # Yield a rod as long as the stroke of the joint. The rod slides out of the previous link.
    pose = np.eye(4)
    pose[2, 3] = -joint.sign * stroke / 2.0
    yield Shape('cylinder', (_sized(ROD_RADIUS * length), _sized(stroke)), pose, 'sliding')


def _pointing(direction: Floats) -> Floats:
    # Return a pose with the z axis `direction`. The x axis is arbitrary, because a cylinder has no
    # preferred direction around its axis.
    T = np.eye(4)
    T[:3, :3] = np.column_stack([*across(direction), direction])
    return T
