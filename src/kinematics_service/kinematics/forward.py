"""
Forward kinematics, Jacobian and twist of an arm: pure functions of joint positions.

Frames and orders are those of KDL, MoveIt's `getJacobian`, the Robotics Toolbox's `jacob0` and
Pinocchio's LOCAL_WORLD_ALIGNED: base axes, reference point the tool's origin, linear rows first.
"""

from typing import Literal

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import KinematicsError
from ..kernel import Floats
from ..robot.robot import Robot
from .tool_state import ToolState, evaluate

Axes = Literal['base', 'tool']


def forward_kinematics(robot: Robot, q: npt.ArrayLike) -> Floats:
    """
    Return the pose of the tool in the base frame, shape (..., 4, 4), translation in m.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, or a number is not finite.
    """
    return evaluate(robot, q, depth=kernel.POSE).pose


def link_frames(robot: Robot, q: npt.ArrayLike) -> Floats:
    """
    Return every frame of the table in the base frame, shape (..., rows + 1, 4, 4).

    [0] is the table's frame 0, [i] the frame after row i; the tool is not included.

    Parameters
    ----------
    robot, q
        As in `forward_kinematics`, which raises the same error.
    """
    return evaluate(robot, q, depth=kernel.ALL_FRAMES).link_frames


def in_axes(state: ToolState, six_rows: Floats, axes: str) -> Floats:
    """
    Return a Jacobian (..., 6, k) in base axes turned into `base` or `tool` axes.

    The reference point stays the tool's origin.

    Raises
    ------
    KinematicsError
        `axes` is neither of them.
    """
    if axes == 'base':
        return six_rows
    if axes != 'tool':
        raise KinematicsError(f"frame must be 'base' or 'tool', not {axes!r}")
    to_tool = np.swapaxes(state.pose[..., :3, :3], -1, -2)
    return np.concatenate(
        [to_tool @ six_rows[..., :3, :], to_tool @ six_rows[..., 3:, :]], axis=-2
    )


def jacobian(robot: Robot, q: npt.ArrayLike, frame: Axes = 'base') -> Floats:
    """
    Return the geometric Jacobian, shape (..., 6, n), rows vx vy vz wx wy wz.

    Parameters
    ----------
    robot, q
        As in `forward_kinematics`, which raises the same error.
    frame
        Axes the rows are in: `base` or `tool`. The reference point is the tool's origin in both.

    Raises
    ------
    KinematicsError
        `frame` is neither `base` nor `tool`.
    """
    state = evaluate(robot, q)
    return in_axes(state, state.jacobian, frame)


def twist(robot: Robot, q: npt.ArrayLike, qdot: npt.ArrayLike, frame: Axes = 'base') -> Floats:
    """
    Return the twist of the tool J qdot, shape (..., 6): vx vy vz (m/s), wx wy wz (rad/s).

    Parameters
    ----------
    robot, q, frame
        As in `jacobian`, which raises the same errors.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities.
    """
    state = evaluate(robot, q, qdot)
    return in_axes(state, state.twist[..., None], frame)[..., 0]
