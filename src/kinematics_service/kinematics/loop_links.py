# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the shape of closed loops at given joint positions, for pictures: corners and joints.

A closed loop consists of two chains of links. The first chain is in the DH table of the arm. The
second chain has its own links in the robot file; this module computes its shape.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..kernel import Floats
from ..rigid_motion import screw_z
from ..robot.conventions import Row, row_of, table_rows
from ..robot.file.parts.description import LoopDescription
from ..robot.loops import passive_names, variables_of
from ..robot.robot import Robot
from .tool_state import ToolState


class LoopJoint(NamedTuple):
    """
    A joint of a closed loop: a point (3,) of its axis, m, the direction (3,) of the axis, and the
    names of the motors that move the joint.
    """

    point: Floats
    direction: Floats
    motors: tuple[str, ...]
    slides: bool


class LoopLinks(NamedTuple):
    """
    The links of a closed loop that are not in the DH table, as corners and joints for pictures.

    These links form the second chain of the loop. All coordinates are in the base frame.

    Attributes
    ----------
    corners : shape (k, 3), m
        The first corner is the origin of the frame at which the chain begins. The last corner is
        the origin of the frame at which the chain ends. The number k does not depend on the joint
        positions.
    slides : k - 1 flags
        For each segment between two corners, whether its length changes.
    joints
        One `LoopJoint` for each moving row of the second chain. Rows without a joint have none.
    """

    corners: Floats
    slides: tuple[bool, ...]
    joints: tuple[LoopJoint, ...]


def loop_links(state: ToolState) -> tuple[LoopLinks, ...]:
    """
    Return the corners and joints of those links of closed loops that are not in the DH table.

    A closed loop consists of two chains of links. The first chain is in the DH table of the arm.
    The second chain has its own links in the robot file. The result has the second chain of each
    loop at one pose.

    `state` must have the frames of the table. If `state` was evaluated for an inner frame instead
    of the tool, the frames of later rows are missing. Loops that are connected to these rows are
    left out.
    """
    description, closure = state.robot.description, state.closure
    if closure is None:
        return ()
    values = dict(zip(variables_of(description), [*state.q, *closure.passive], strict=True))
    return tuple(
        _links_of(state.robot, loop, state.link_frames, values)
        for loop in description.loops
        if max(loop.start.row, loop.meets.row) <= len(description.links)
    )


def carried_rows(robot: Robot) -> tuple[bool, ...]:
    """
    Return which rows of the DH table are coordinates of a platform instead of links.

    The loops of a parallel robot carry a platform. The coordinates of the platform's position,
    such as x and y, are neighbouring prismatic rows of the table. Only passive joints set the
    displacements in these rows.
    """
    passive = passive_names(robot.description)
    slides = [_slides_by(row) for row in table_rows(robot.description)]
    free = [bool(names) and names <= passive for names in slides]
    beside = [False, *free, False]
    return tuple(is_free and (beside[k] or beside[k + 2]) for k, is_free in enumerate(free))


def linked_frames(robot: Robot) -> npt.NDArray[np.bool_]:
    """
    Return for each frame of the table whether a link carries it, shape (rows + 1,).

    The frames are frame 0 and the frame after each row.

    A parallel robot has prismatic rows that are coordinates of a platform, not links (see
    `carried_rows`). No link carries a frame between two such rows.
    """
    carried = np.array([*carried_rows(robot), False])
    return np.append(True, ~(carried[:-1] & carried[1:]))


def _slides_by(row: Row) -> frozenset[str]:
    return frozenset(name for name, c in row.d.coefficients if c != 0.0)


def _links_of(
    robot: Robot, loop: LoopDescription, frames: Floats, values: dict[str, float]
) -> LoopLinks:
    passive = passive_names(robot.description)
    T = frames[loop.start.row] @ loop.start.motion.matrix
    corners, slides = [frames[loop.start.row, :3, 3], T[:3, 3]], [False]
    joints = []
    for link in loop.links:
        row = row_of(link, robot.description.convention)
        before = T @ row.before
        moved = before @ screw_z(row.theta.at(values), row.d.at(values))
        T = moved @ row.after
        corners += [before[:3, 3], moved[:3, 3], T[:3, 3]]
        turning = [name for name, c in row.theta.coefficients if c != 0.0]
        sliding = _slides_by(row)
        slides += [False, bool(sliding), False]
        if turning or sliding:
            motors = tuple(name for name in {*turning, *sliding} if name not in passive)
            joints.append(LoopJoint(before[:3, 3], before[:3, 2], motors, not turning))
    corners.append(frames[loop.meets.row, :3, 3])
    return LoopLinks(np.array(corners), (*slides, False), tuple(joints))
