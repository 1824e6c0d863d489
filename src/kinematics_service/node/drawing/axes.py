# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the joint axes of an arm at one configuration: an axis for each moving row of its DH table,
in any DH convention.

`axes_of` uses the screws that the kernel computes. A row that turns with angular velocity w
about a point c moves the tool p with v = w x (p - c). So the point p + (w x v) / w.w is on the
axis of the row. A row that slides moves the tool along v. A joint that moves several rows, as in a
parallelogram, has several axes.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...kinematics.loop_links import LoopLinks, carried_rows
from ...kinematics.tool_state import ToolState
from ...robot.robot import Robot


class RowAxis(NamedTuple):
    """
    The axis about or along which one row of the DH table moves, in the base frame.

    Attributes
    ----------
    point : shape (3,), m
        The projection of a frame's origin onto the axis. The frame is the link frame before or
        after the row: the frame whose origin is nearer to the axis.
    direction : shape (3,)
        Unit vector, along the positive motion of the first joint in `joints`.
    slides
        Whether the row slides along the axis; otherwise it turns about the axis.
    joints
        Indices of the joints that move the row; passive joints have indices from n on. Coupled
        joints move a row together.
    """

    point: Floats
    direction: Floats
    slides: bool
    joints: tuple[int, ...]


def axes_of(state: ToolState) -> Iterator[RowAxis]:
    """
    Yield the axes of the moving rows of the DH table, from base to tool.

    `state` must contain all link frames. If closed loops carry a platform, some rows describe
    coordinates of the platform and no links. Such rows are left out.
    """
    chain = state.robot.chain
    first, joints = chain.table.first_entry, chain.table.joint
    parents = chain.table.frame_parent.tolist()
    screws = state.numbers[chain.screws_at :][: 6 * chain.entries].reshape(6, chain.entries)
    carried = carried_rows(state.robot)
    for k in range(chain.elements):
        after = parents.index(k)  # the first frame after the row
        if carried[after - 1]:
            continue
        beside = state.link_frames[after - 1 : after + 1, :3, 3]
        begin, end = int(first[k]), int(first[k + 1])
        moved_by = tuple(joints[begin:end].tolist())
        yield _axis(screws[:, begin], state.position, beside, moved_by)


def motor_axes(robot: Robot, loops: Sequence[LoopLinks]) -> Iterator[RowAxis]:
    """
    Yield the axes of motor-driven joints that are not in the DH table.

    A closed loop has two chains of links. The first chain is in the DH table. The second chain has
    rows of its own, and its joints are yielded here.
    """
    places = {joint.variable: k for k, joint in enumerate(robot.description.joints)}
    for joint in (joint for loop in loops for joint in loop.joints if joint.motors):
        joints = tuple(sorted(places[name] for name in joint.motors))
        yield RowAxis(joint.point, joint.direction, joint.slides, joints)


def _axis(screw: Floats, tool: Floats, beside: Floats, joints: tuple[int, ...]) -> RowAxis:
    v, w = screw[:3], screw[3:]
    speed = float(np.linalg.norm(w))
    if speed == 0.0:
        return RowAxis(beside[0].copy(), v / np.linalg.norm(v), True, joints)
    direction = w / speed
    point = tool + np.cross(w, v) / speed**2
    # `beside` has the origins of two link frames: the frame before the row and the frame after the
    # row. In every convention one of the two origins is on the axis. Select the origin that is
    # nearer to the axis, and project it onto the axis.
    feet = point + np.outer((beside - point) @ direction, direction)
    return RowAxis(
        feet[int(np.argmin(np.linalg.norm(feet - beside, axis=1)))], direction, False, joints
    )
