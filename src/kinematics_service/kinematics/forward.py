# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute forward kinematics, Jacobian and twist of an arm, in one pass of the kernel.

Frames and the order of rows are those of KDL, MoveIt's `getJacobian`, the Robotics Toolbox's
`jacob0` and Pinocchio's LOCAL_WORLD_ALIGNED: base axes, reference point the tool's origin, linear
rows first. The argument `of` selects another frame of the arm, `at` another point of that frame,
and `axes` other axes.
"""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import PointError, TwistError
from ..kernel import Floats
from ..robot.points import TOOL, place_in_frame
from ..robot.robot import AnyRobot, Robot, as_robot
from .arguments import finite_rows, shape_together
from .tool_state import ToolState, evaluate

BASE = 'base'


def forward_kinematics(
    robot: AnyRobot,
    q: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the pose of the tool in the base frame, shape (..., 4, 4), translation in m.

    Parameters
    ----------
    robot
        The arm: a robot, the name of a bundled robot, or the path of a robot file. A file is read
        again when it has changed.
    q : shape (..., n), rad or m
        Joint positions.
    axes
        The frame in which the pose is expressed: `base`, or a frame as in the argument `of`.
    of
        The frame whose pose is returned: `tool`, the name of a point in the robot file, 0 for
        frame 0, or k for the frame after row k of the table.
    at : shape (3,), m
        Another origin for the frame `of`, in the coordinates of this frame.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, or a number is not finite.
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.
    """
    robot = as_robot(robot)
    T = state_of(robot, of, q, depth=kernel.POSE).pose
    if at is not None:
        T = T.copy()
        T[..., :3, 3] += offset_of(T, at)
    if str(axes) == BASE:
        return T
    T_base_axes = pose_of_axes(robot, axes, q)
    R_axes_base = np.swapaxes(T_base_axes[..., :3, :3], -1, -2)
    result = T.copy()
    result[..., :3, :3] = R_axes_base @ T[..., :3, :3]
    between = T[..., :3, 3] - T_base_axes[..., :3, 3]
    result[..., :3, 3] = (R_axes_base @ between[..., None])[..., 0]
    return result


def link_frames(robot: AnyRobot, q: npt.ArrayLike) -> Floats:
    """
    Return every frame of the table in the base frame, shape (..., rows + 1, 4, 4).

    Result [0] is the table's frame 0, and result [i] is the frame after row i. The tool is not
    included.

    Parameters
    ----------
    robot, q
        As in `forward_kinematics`, which raises the same error.
    """
    robot = as_robot(robot)
    return evaluate(robot, q, depth=kernel.ALL_FRAMES).link_frames


def in_axes_of(pose: Floats, six_rows: Floats) -> Floats:
    """Convert Jacobian columns (..., 6, k) from base axes to the axes of `pose` (..., 4, 4)."""
    to_axes = np.swapaxes(pose[..., None, :3, :3], -1, -2)
    halves = six_rows.reshape(*six_rows.shape[:-2], 2, 3, six_rows.shape[-1])
    return np.asarray(to_axes @ halves).reshape(six_rows.shape)


def pose_of_axes(robot: Robot, axes: str | int, q: npt.ArrayLike) -> Floats:
    """
    Return the pose (..., 4, 4) of the frame that `axes` names, in the base frame.

    Raises
    ------
    PointError
        The arm has no frame `axes`.
    """
    try:
        robot.point(axes)
    except PointError:
        others = f', or a row from 0 to {robot.rows}'
        raise PointError.unknown_name('axes', (BASE, *robot.points), axes, others) from None
    return state_of(robot, axes, q, depth=kernel.POSE).pose


def jacobian(
    robot: AnyRobot,
    q: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the geometric Jacobian, shape (..., 6, n), rows vx vy vz wx wy wz.

    Columns of joints between the frame `of` and the tool are zero.

    Parameters
    ----------
    robot, q
        As in `forward_kinematics`, which raises the same errors.
    axes
        Axes of the rows: `base`, or a frame as in the argument `of`. Velocities are relative to
        the base, even if these axes move.
    of
        The frame that moves: `tool`, the name of a point in the robot file, 0 for frame 0, or k
        for the frame after row k of the table.
    at : shape (3,), m
        The reference point of the linear rows: a point fixed to the frame `of`, in the coordinates
        of this frame; default: the frame's origin.

    Raises
    ------
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> ks.jacobian(robot, [0.0, 0.0], of=1)[1].tolist()
    [1.0, 0.0]
    """
    robot = as_robot(robot)
    state = state_of(robot, of, q)
    return chosen(robot, q, state, state.jacobian, of, at, axes)


def twist(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the tool's twist J qdot, shape (..., 6): vx vy vz (m/s), wx wy wz (rad/s).

    Parameters
    ----------
    robot, q, axes, of, at
        As in `jacobian`, which raises the same errors.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities.
    """
    robot = as_robot(robot)
    state = state_of(robot, of, q, qdot)
    return chosen(robot, q, state, state.twist[..., None], of, at, axes)[..., 0]


def twist_at(twist: npt.ArrayLike, r: npt.ArrayLike) -> Floats:
    """
    Return the twist of a body at another reference point: v + w x r and w; shape (..., 6).

    Parameters
    ----------
    twist : shape (..., 6), m/s and rad/s
        Linear, then angular.
    r : shape (..., 3), m
        Vector from the point of `twist` to the other point, in the axes of `twist`.

    Raises
    ------
    TwistError
        `twist` is not six finite numbers, `r` not three, or their leading dimensions differ.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> ks.twist_at([0, 0, 0, 0, 0, 2.0], [0.5, 0, 0]).tolist()
    [0.0, 1.0, 0.0, 0.0, 0.0, 2.0]
    """
    V, offset = finite_rows(TwistError, 'twist', twist, 6), finite_rows(TwistError, 'r', r, 3)
    shape_together(TwistError, ('twist', 'r'), V.shape, offset.shape, (3,))
    linear = V[..., :3] + cross(V[..., 3:, None], offset[..., None])[..., 0]
    return np.concatenate([linear, np.broadcast_to(V[..., 3:], linear.shape)], axis=-1)


def state_of(
    robot: Robot,
    of: str | int,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike | None = None,
    depth: int = kernel.JACOBIAN,
) -> ToolState:
    """
    Return the `ToolState` of an arm at q, with the pose, Jacobian and twist of the point `of`
    instead of the tool.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `qdot` is not n, or a number is not finite.
    PointError
        The arm has no frame `of`.
    """
    point = None if type(of) is str and of == TOOL else robot.point(of)
    return evaluate(robot, q, qdot, depth, point=point)


def chosen(
    robot: Robot,
    q: npt.ArrayLike,
    state: ToolState,
    six_rows: Floats,
    of: str | int,
    at: npt.ArrayLike | None,
    axes: str | int,
) -> Floats:
    """
    Convert Jacobian columns (..., 6, k) to another reference point and to other axes.

    The argument `six_rows` has the columns for the origin of the frame `of`, in base axes. The
    result has the columns for the point `at` of this frame (default: the origin), in the axes
    `axes`.

    Raises
    ------
    PointError
        The arm has no such axes; `at` is not three finite numbers.
    """
    if at is not None:
        six_rows = with_point_at(six_rows, offset_of(state.pose, at))
    if str(axes) == BASE:
        return six_rows
    same = type(axes) is type(of) and axes == of
    return in_axes_of(state.pose if same else pose_of_axes(robot, axes, q), six_rows)


def with_point_at(six_rows: Floats, r: Floats) -> Floats:
    """
    Convert Jacobian columns (..., 6, k) to a reference point that is displaced by r (..., 3).

    Each column of `six_rows` is a linear velocity v and an angular velocity w. In the result, v is
    replaced by v + w x r.
    """
    result = six_rows.copy()
    result[..., :3, :] += cross(six_rows[..., 3:, :], r[..., None])
    return result


def cross(a: Floats, b: Floats) -> Floats:
    """
    Return the vector products a x b of columns (..., 3, k), five times as fast as `np.cross`.
    """
    return np.asarray(
        a.take(_NEXT, axis=-2) * b.take(_LAST, axis=-2)
        - a.take(_LAST, axis=-2) * b.take(_NEXT, axis=-2)
    )


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def offset_of(pose: Floats, at: npt.ArrayLike) -> Floats:
    """
    Return the vector (..., 3), in base axes, from the origin of the frame `pose` to the point `at`
    of this frame.
    """
    return np.asarray(pose[..., :3, :3] @ place_in_frame(at))
