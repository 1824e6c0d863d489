# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find a point of an arm: its tool, a named point of its file, or a frame of its table.

The kinematics of a point is the kinematics of a shorter arm. The shorter arm has only the table
rows before the point, and the point is its tool. The Jacobian of the shorter arm still has a
column for each joint of the whole arm. The columns of joints after the point are zero.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..errors import PointError
from ..kernel import Chain, Floats, Integers
from ..rigid_motion import exact_rpy, rotation_of_roll_pitch_yaw
from .chain import first_entries
from .file.parts.description import (
    IDENTITY,
    Link,
    Placement,
    PointDescription,
    RigidMotion,
    RobotDescription,
    SingularityDescription,
    Uncertainty,
)
from .file.parts.parameters import ENDS, TABLE_GROUPS, uncertain_parameters
from .loops import moving_variables, passive_names

TOOL = 'tool'


@dataclass(frozen=True, eq=False)
class Point:
    """
    A frame of an arm, and the kernel's chain from the base to the frame.

    Attributes
    ----------
    name
        `tool`, the name in the robot file, or a name such as `row 2` for the frame after row 2.
    chain
        The kernel's chain from the base to this frame.
    """

    name: str
    chain: Chain

    @cached_property
    def first_entries(self) -> Integers:
        """
        Return, for each (screw, joint) entry of the chain, the index of the screw's first entry.

        A chain has one entry for each screw and each joint that moves the screw. The entries of a
        screw follow one another.
        """
        return first_entries(self.chain)


def known_points(description: RobotDescription) -> tuple[str, ...]:
    """Return `tool`, followed by the names of the points in the robot file."""
    return (TOOL, *(point.name for point in description.points))


def described_point(description: RobotDescription, of: str | int) -> PointDescription:
    """
    Return a point of an arm, given the name of the point or the number of a table row in `of`.

    The number k means the frame after row k of the table; 0 means frame 0.

    Raises
    ------
    PointError
        The arm has no such point or row.
    """
    rows = len(description.links)
    if isinstance(of, str):
        if of == TOOL:
            return PointDescription(TOOL, rows, description.tool.motion)
        point = next((point for point in description.points if point.name == of), None)
        if point is not None:
            return point
    elif isinstance(of, (int, np.integer)) and not isinstance(of, bool) and 0 <= of <= rows:
        return PointDescription(f'row {of}', int(of), IDENTITY)
    known = known_points(description)
    sentence = (
        f'unknown point {of!r} of {description.name} (known: {", ".join(known)}, and the frames '
        f'of rows 0 to {rows})'
    )
    raise PointError(sentence, 'of', known, of, code='unknown-name')


def place_in_frame(at: npt.ArrayLike) -> Floats:
    """
    Check the coordinates of a point, and return them as an array, shape (3,), m.

    Raises
    ------
    PointError
        `at` is not three finite numbers.
    """
    try:
        place = np.asarray(at, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        place = np.empty(0)
    if place.shape != (3,) or not all(map(math.isfinite, place.tolist())):
        message = f'at must be three finite numbers in m, not {at!r}'
        raise PointError(message, 'at', [(3,)], at, code='wrong-shape')
    return place


def with_tool(
    description: RobotDescription, xyz: Sequence[float] | None, rpy: Sequence[float] | None
) -> RobotDescription:
    """
    Return an arm with another tool. The result has no known poses, because those are poses of the
    old tool.

    Parameters
    ----------
    xyz : shape (3,), m
        Origin of the tool in the frame after the last row; None: the origin in the file.
    rpy : shape (3,), rad
        Orientation of the tool in the frame after the last row, R = Rz(yaw) Ry(pitch) Rx(roll);
        None: the orientation in the file.
    """
    tool = description.tool
    matrix, texts = tool.motion.matrix.copy(), tool.motion.texts
    written = len(texts) == 6  # true if the file gives xyz and rpy, not a matrix
    if xyz is not None:
        matrix[:3, 3] = xyz
    if rpy is not None:
        matrix[:3, :3] = rotation_of_roll_pitch_yaw(rpy)
    place, turn = texts[:3], texts[3:]
    if xyz is not None or not written:
        place = _texts(matrix[:3, 3], description.metres)
    if rpy is not None or not written:
        turn = _texts(rpy or exact_rpy(matrix[:3, :3]), description.radians)
    motion = RigidMotion(matrix, (*place, *turn))
    return replace(description, tool=Placement(tool.frame, motion), known_poses=())


def moved_base(description: RobotDescription, motion: Floats, frame: str) -> RobotDescription:
    """
    Return the same arm with a new base frame, named `frame`. `motion`, (4, 4), m, is the pose of
    the old base frame in the new one.
    """
    matrix = motion @ description.base.motion.matrix
    place, turn = _texts(matrix[:3, 3], description.metres), exact_rpy(matrix[:3, :3])
    texts = (*place, *_texts(turn, description.radians))
    if np.array_equal(motion, np.eye(4)):
        texts = description.base.motion.texts
    return replace(description, base=Placement(frame, RigidMotion(matrix, texts)))


def _texts(numbers: npt.ArrayLike, unit: float) -> tuple[str, ...]:
    return tuple(repr(value / unit) for value in np.asarray(numbers, dtype=np.float64).tolist())


def ending_at(
    description: RobotDescription, of: str | int, at: npt.ArrayLike | None = None
) -> RobotDescription:
    """
    Return an arm that ends at a point of the given arm: this point is the tool of the result.

    `at`, shape (3,), m, is the origin of the tool in the frame of the point; default: the point
    itself. The name of the result consists of the names of arm and point, such as `puma560_elbow`.
    The sections `singularity` and `known_poses` are left out, because they describe the old tool.
    Joints after the point are marked as unused.

    Raises
    ------
    PointError
        The arm has no such point or row, or `at` is not three finite numbers.
    """
    point = described_point(description, of)
    if at is not None:
        matrix = point.motion.matrix.copy()
        matrix[:3, 3] += matrix[:3, :3] @ place_in_frame(at)
        # The new tool has another position and the same rotation. So replace the texts of x, y, z,
        # and keep the other texts.
        texts = list(point.motion.texts)
        entries = slice(0, 3) if len(texts) == 6 else slice(3, 12, 4)
        texts[entries] = _texts(matrix[:3, 3], description.metres)
        point = replace(point, motion=RigidMotion(matrix, tuple(texts)))
    elif point.name == TOOL:
        return description
    links = description.links[: point.row]
    moving = moving_variables(description, links)
    of_tool = point.name == TOOL
    points = tuple(
        other
        for other in description.points
        if other.row <= point.row and other.name != point.name
    )
    limited = {other.name: other.name for other in points} | {point.name: TOOL}
    frame = description.tool.frame if of_tool else point.name.replace(' ', '_')
    return replace(
        description,
        name=description.name if of_tool else f'{description.name}_{frame}',
        joints=tuple(
            replace(joint, unused=joint.variable not in moving) for joint in description.joints
        ),
        links=links,
        tool=Placement(frame, point.motion),
        points=points,
        speed_limits=tuple(
            replace(limit, of=limited[limit.of])
            for limit in description.speed_limits
            if limit.of in limited
        ),
        singularity=SingularityDescription(),
        uncertainty=_up_to(description, links, of_tool),
        known_poses=(),
        loops=description.loops if moving & passive_names(description) else (),
    )


def _up_to(
    description: RobotDescription, links: Sequence[Link], of_tool: bool
) -> Uncertainty | None:
    # Return the uncertainty of an arm that ends after the rows `links`. Leave out the parameters
    # of later rows, and, unless `of_tool`, the parameters of the tool.
    uncertainty = description.uncertainty
    if uncertainty is None:
        return None
    ends = ENDS if of_tool else ENDS[:1]
    joints, convention = description.joints, description.convention
    names = {*TABLE_GROUPS, *uncertain_parameters(links, convention, joints, ends)}
    return replace(
        uncertainty,
        parameters=tuple(pair for pair in uncertainty.parameters if pair[0] in names),
        factor=tuple(pair for pair in uncertainty.factor if pair[0] in names),
    )
