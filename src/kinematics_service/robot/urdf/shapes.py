"""
Shapes for viewers: rods between frames, hubs on joint axes, sized from the arm's own reach.

A robot file has no shapes, so these are symbols, not the arm's outline: they are of no use for
collision checks.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from .elements import UNLIMITED, PlannedJoint, UrdfPlan

# Shares of the arm's characteristic length.
ROD_RADIUS = 0.025
HUB_RADIUS = 0.045
HUB_LENGTH = 0.11
TOOL_RADIUS = 0.035
# Length drawn of a slide without an end.
ENDLESS = 0.5


@dataclass(frozen=True, eq=False)
class Shape:
    """
    One `<visual>`.

    Parameters
    ----------
    kind
        `cylinder` (radius, length along z), `box` (x y z) or `sphere` (radius).
    size : m
    pose : shape (4, 4)
        In the link's frame.
    colour
        `rod`, `turning`, `sliding` or `tool`.
    """

    kind: str
    size: tuple[float, ...]
    pose: Floats
    colour: str


def shapes_of(plan: UrdfPlan, length: float) -> dict[str, tuple[Shape, ...]]:
    """Return the shapes of each link, for an arm of the characteristic length (m)."""
    shapes: dict[str, list[Shape]] = {link: [] for link in plan.links}
    for joint in plan.joints:
        shapes[joint.parent] += _rod(joint.origin[:3, 3], length)
        if joint.hub:
            shapes[joint.child] += _hub(joint, length)
    shapes[plan.tool].append(Shape('sphere', (_sized(TOOL_RADIUS * length),), np.eye(4), 'tool'))
    return {link: tuple(found) for link, found in shapes.items()}


def _sized(value: float) -> float:
    # Four digits: a symbol needs no more.
    return float(f'{value:.4g}')


def _rod(end: Floats, length: float) -> Iterator[Shape]:
    # From the link's own origin to that of the next link.
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
    assert joint.limit is not None  # every prismatic joint has one
    ends = (joint.limit.lower or 0.0, joint.limit.upper or 0.0)
    strokes = [abs(end) for end in ends if abs(end) < UNLIMITED]
    stroke = max(strokes, default=0.0)
    if len(strokes) < 2 or stroke == 0.0:
        stroke = ENDLESS * length
    # The boom that comes out of the previous link: it reaches back as far as the joint can go.
    pose = np.eye(4)
    pose[2, 3] = -joint.sign * stroke / 2.0
    yield Shape('cylinder', (_sized(ROD_RADIUS * length), _sized(stroke)), pose, 'sliding')


def _pointing(direction: Floats) -> Floats:
    # A rotation whose z axis is the direction; which way x goes does not show on a cylinder.
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(other, direction)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(direction, x), direction])
    return T
