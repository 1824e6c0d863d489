"""
The skeleton of an arm in a pose: what can be drawn of it from its table alone, without a mesh.
"""

from dataclasses import dataclass

import numpy as np

from .... import kernel
from ....kernel import Floats
from ....kinematics.loop_links import carried_rows, linked_frames, loop_links
from ....kinematics.tool_state import evaluate
from ....rigid_motion import inverse
from ....robot.conventions import table_rows
from ....robot.robot import Robot

# Points nearer to each other than this share of the arm's reach are one.
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class JointAxis:
    """
    The line a row of the table turns about or slides along, in the base frame.

    Attributes
    ----------
    point, direction : shape (3,), m; unit vector
    variables
        The joint variables that move the row; of a row of a loop those that have a motor.
    slides
        Whether it slides only.
    """

    point: Floats
    direction: Floats
    variables: tuple[str, ...]
    slides: bool


@dataclass(frozen=True, eq=False)
class Segment:
    """A straight piece of the arm between two points (3,), m; `slides` if its length changes."""

    start: Floats
    end: Floats
    slides: bool


@dataclass(frozen=True, eq=False)
class Skeleton:
    """
    An arm in one pose, in the base frame.

    Attributes
    ----------
    frames : shape (k, 4, 4)
        Those of `link_frames` that belong to a link.
    tool : shape (4, 4)
    segments, axes
        From the base's origin to the tool's, then those of the closed loops; of every row that
        moves.
    """

    frames: Floats
    tool: Floats
    segments: tuple[Segment, ...]
    axes: tuple[JointAxis, ...]

    @property
    def points(self) -> Floats:
        """Return the ends of all segments, shape (k, 3), m."""
        ends = [point for segment in self.segments for point in (segment.start, segment.end)]
        return np.array([np.zeros(3), *ends, self.tool[:3, 3]])


def skeleton_of(robot: Robot, q: Floats) -> Skeleton:
    """
    Return the skeleton of an arm at joint positions (n,), rad or m.

    Every row T = before screw_z after goes along `before`, then along the screw's axis, then along
    `after`: of a standard row that is d along z, then a along x, so that the drawn arm has the
    corners of the real one.

    Raises
    ------
    JointVectorError
        `q` has not n finite numbers.
    """
    state = evaluate(robot, q, depth=kernel.ALL_FRAMES)
    frames, tool = state.link_frames, state.pose
    same = SAME * robot.singularity.task.reach
    corners: list[tuple[Floats, bool]] = [(np.zeros(3), False), (frames[0, :3, 3], False)]
    axes, segments = [], []
    for k, (row, carried) in enumerate(zip(table_rows(robot.description), carried_rows(robot))):
        if carried:
            segments += _joined(corners, same)
            corners = [(frames[k + 1, :3, 3], False)]
            continue
        before = frames[k] @ row.before
        moving = frames[k + 1] @ inverse(row.after)
        turns = [name for name, c in row.theta.coefficients if c != 0.0]
        slides = [name for name, c in row.d.coefficients if c != 0.0]
        corners += [
            (before[:3, 3], False),
            (moving[:3, 3], bool(slides)),
            (frames[k + 1, :3, 3], False),
        ]
        if turns or slides:
            names = tuple(dict.fromkeys([*turns, *slides]))
            axes.append(JointAxis(before[:3, 3], before[:3, 2], names, not turns))
    corners.append((tool[:3, 3], False))
    segments += _joined(corners, same)
    for loop in loop_links(state):
        segments += _joined(list(zip(loop.corners, (False, *loop.slides))), same)
        axes += [JointAxis(*joint) for joint in loop.joints]
    return Skeleton(frames[linked_frames(robot)], tool, tuple(segments), tuple(axes))


def _joined(corners: list[tuple[Floats, bool]], same: float) -> list[Segment]:
    segments = []
    at = corners[0][0]
    for point, slides in corners[1:]:
        if np.linalg.norm(point - at) > same:
            segments.append(Segment(at, point, slides))
            at = point
    return segments
