"""
The skeleton of an arm in a pose: what can be drawn of it from its table alone, without a mesh.
"""

from dataclasses import dataclass

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...rigid_motion import inverse
from ...robot.conventions import table_rows
from ...robot.robot import Robot

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
        The joint variables that move the row.
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
    frames : shape (rows + 1, 4, 4)
        As `link_frames` returns them.
    tool : shape (4, 4)
    segments, axes
        From the base's origin to the tool's; of every row that moves.
    """

    frames: Floats
    tool: Floats
    segments: tuple[Segment, ...]
    axes: tuple[JointAxis, ...]

    @property
    def points(self) -> Floats:
        """Return the ends of all segments, shape (k, 3), m."""
        ends = [segment.end for segment in self.segments]
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
    corners: list[tuple[Floats, bool]] = [(np.zeros(3), False), (frames[0, :3, 3], False)]
    axes = []
    for k, row in enumerate(table_rows(robot.description)):
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
    return Skeleton(frames, tool, _joined(corners, SAME * robot.task.reach), tuple(axes))


def _joined(corners: list[tuple[Floats, bool]], same: float) -> tuple[Segment, ...]:
    segments = []
    at = corners[0][0]
    for point, slides in corners[1:]:
        if np.linalg.norm(point - at) > same:
            segments.append(Segment(at, point, slides))
            at = point
    return tuple(segments)
