# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the observation of an arm at one time: the data from which its picture is made."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...kinematics.loop_links import loop_links
from ...kinematics.singularity import Singularity
from ...kinematics.tool_state import ToolState
from ...robot.measures import Level
from ...robot.robot import Robot
from .axes import RowAxis, axes_of, motor_axes


class CommandScale(NamedTuple):
    """
    The scale (0 to 1) of the last commanded joint velocity, the constraint that makes it less than
    1, and the level: WARN if the command is slowed, ERROR if it is stopped.
    """

    value: float
    cause: str
    level: Level


@dataclass(frozen=True, eq=False)
class Observation:
    """
    An arm at one configuration: frames, Jacobian, twist and singularity measures, computed here or
    received from a node.

    Attributes
    ----------
    robot
        The arm.
    q : shape (n,), rad or m
        Joint positions.
    frames : shape (rows + 1, 4, 4)
        Frame 0 and the frame after each row, in the base frame.
    pose : shape (4, 4)
        Pose of the tool in the base frame.
    jacobian : shape (6, n)
        The geometric Jacobian with rows vx vy vz wx wy wz, in base axes, at the tool's origin.
    twist : shape (6,), m/s and rad/s, or None
        The twist J qdot of the tool in base axes; None if the joint velocities are unknown.
    axes
        The axes of the moving rows of the DH table, then the axes of the motor-driven joints in
        closed loops.
    loops : shape (k, 2, 3), m
        Segments of the links of closed loops. Some have length 0; k is constant for an arm.
    singularity
        The measures of singularity.
    level
        OK, WARN, ERROR, or STALE if no new joint states arrive.
    scale
        The scale, 0 to 1, of the last joint velocity that was commanded; None before the first
        command.
    """

    robot: Robot
    q: Floats
    frames: Floats
    pose: Floats
    jacobian: Floats
    twist: Floats | None
    axes: tuple[RowAxis, ...]
    loops: Floats
    singularity: Singularity
    level: Level
    scale: CommandScale | None = None


def observation_of(state: ToolState, singularity: Singularity) -> Observation:
    """Return the observation of an arm in a state, which must contain all link frames."""
    loops = loop_links(state)
    corners = [np.stack([loop.corners[:-1], loop.corners[1:]], axis=1) for loop in loops]
    return Observation(
        robot=state.robot,
        q=np.asarray(state.q),
        frames=state.link_frames,
        pose=state.pose,
        jacobian=state.jacobian,
        twist=None if state.qdot is None else state.twist,
        axes=(*axes_of(state), *motor_axes(state.robot, loops)),
        loops=np.concatenate([np.empty((0, 2, 3)), *corners]),
        singularity=singularity,
        level=Level(int(singularity.level)),
    )
