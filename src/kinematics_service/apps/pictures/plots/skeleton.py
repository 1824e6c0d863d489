# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the skeleton of an arm from its DH table: segments, joint axes and frames."""

from dataclasses import dataclass

import numpy as np

from .... import kernel
from ....kernel import Floats
from ....kinematics.loop_links import carried_rows, linked_frames, loop_links
from ....kinematics.tool_state import evaluate
from ....rigid_motion import inverse
from ....robot.conventions import table_rows
from ....robot.robot import Robot

# Two corners of the skeleton are one point if their distance divided by the arm's reach is below
# this.
POINT_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class JointAxis:
    """
    The axis of a joint, in the base frame: the line about which the frame after a row of the DH
    table turns, or along which it slides.

    Attributes
    ----------
    point, direction : shape (3,), m; unit vector
    variables
        The joint variables in the row. In the chain of a closed loop only joints with a motor have
        a variable, so `variables` may be empty.
    slides
        Whether the joint slides without turning.
    """

    point: Floats
    direction: Floats
    variables: tuple[str, ...]
    slides: bool


@dataclass(frozen=True, eq=False)
class Segment:
    """
    A straight part of the arm between two points (3,), m; `slides` is True if its length changes.
    """

    start: Floats
    end: Floats
    slides: bool


@dataclass(frozen=True, eq=False)
class Skeleton:
    """
    Segments, axes and frames of an arm at one configuration, in the base frame.

    Attributes
    ----------
    frames : shape (k, 4, 4)
        The frames of the links; frames in `link_frames` that belong to no link are left out.
    tool : shape (4, 4)
        The tool frame.
    segments
        Segments from the base's origin to the tool's, then segments of the closed loops.
    axes
        The axis of each DH table row with a joint variable, and of each joint in a closed loop.
    """

    frames: Floats
    tool: Floats
    segments: tuple[Segment, ...]
    axes: tuple[JointAxis, ...]

    @property
    def points(self) -> Floats:
        """Return base origin, ends of all segments and tool origin, shape (k, 3), m."""
        ends = [point for segment in self.segments for point in (segment.start, segment.end)]
        return np.array([np.zeros(3), *ends, self.tool[:3, 3]])


def skeleton_of(robot: Robot, q: Floats) -> Skeleton:
    """
    Return the skeleton of an arm at joint positions (n,), rad or m.

    Each row of the DH table is a product of three motions: `before` (fixed), the screw of the
    joint along z, and `after` (fixed). A row adds three corners to the skeleton: the origins of
    the frames that are reached after the first, the second and the third motion. For a row of
    standard DH the skeleton goes d along z, then a along x, as the real arm does.

    Raises
    ------
    JointVectorError
        `q` has not n finite numbers.
    """
    state = evaluate(robot, q, depth=kernel.ALL_FRAMES)
    frames, tool = state.link_frames, state.pose
    tolerance = POINT_TOLERANCE * robot.singularity.task.reach
    corners: list[tuple[Floats, bool]] = [(np.zeros(3), False), (frames[0, :3, 3], False)]
    axes, segments = [], []
    for k, (row, carried) in enumerate(zip(table_rows(robot.description), carried_rows(robot))):
        if carried:
            segments += _joined(corners, tolerance)
            corners = [(frames[k + 1, :3, 3], False)]
            continue
        before = frames[k] @ row.before
        moving = frames[k + 1] @ inverse(row.after)
        turns = [name for name, c in row.theta.coefficients if c != 0.0]
        slides = [name for name, c in row.d.coefficients if c != 0.0]
        corners += [(before[:3, 3], False), (moving[:3, 3], bool(slides))]
        corners.append((frames[k + 1, :3, 3], False))
        if turns or slides:
            names = tuple(dict.fromkeys([*turns, *slides]))
            axes.append(JointAxis(before[:3, 3], before[:3, 2], names, not turns))
    corners.append((tool[:3, 3], False))
    segments += _joined(corners, tolerance)
    for loop in loop_links(state):
        segments += _joined(list(zip(loop.corners, (False, *loop.slides))), tolerance)
        axes += [JointAxis(*joint) for joint in loop.joints]
    return Skeleton(frames[linked_frames(robot)], tool, tuple(segments), tuple(axes))


def _joined(corners: list[tuple[Floats, bool]], tolerance: float) -> list[Segment]:
    segments = []
    corner = corners[0][0]
    for point, slides in corners[1:]:
        if np.linalg.norm(point - corner) > tolerance:
            segments.append(Segment(corner, point, slides))
            corner = point
    return segments
