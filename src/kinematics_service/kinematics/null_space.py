# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the null space of the task Jacobian by SVD, and the self-motion that leads away from
singular poses.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import JointVectorError
from ..kernel import Floats
from ..robot.points import TOOL
from ..robot.robot import AnyRobot, as_robot
from ..robot.task import Task
from .arguments import finite_rows, shape_together
from .forward import state_of
from .singularity import singularity_of
from .task_jacobian import task_jacobian, task_of
from .tool_state import ToolState, evaluate


def null_space(
    robot: AnyRobot,
    q: npt.ArrayLike,
    rows: Sequence[str] | None = None,
    *,
    of: str | int = TOOL,
    near: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return an orthonormal basis of the null space of the task Jacobian J_t, shape (..., n, k).

    k is n minus the generic rank of J_t, the rank at poses that are not singular. For a full pose
    k is 1 for seven joints, and 0 for six. At a singular pose more than k independent joint
    motions leave the tool at rest. Then only k motions are returned; if `near` is given, the
    motions nearest to the basis `near`.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    rows
        The rows of J_t, some of x y z rx ry rz, in the axes of the table's frame 0; default: the
        arm's task.
    of
        The frame that stays at rest, as in `jacobian`.
    near : shape (..., n, k)
        The basis of an earlier pose. The result is the basis nearest to `near`, so that signs and
        directions are continuous along a motion.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, `near` has another shape, or a number is not finite.
    PointError
        The arm has no frame `of`; `rows` is empty or has an unknown name.
    KinematicsError
        No joint moves the tool in these rows.

    Examples
    --------
    Both links turn against each other while the end of a planar arm stays at its height:

    >>> import kinematics_service as ks
    >>> ks.null_space('planar_2r', [0, 0], ['y']).round(4).tolist()
    [[-0.4472], [0.8944]]
    """
    robot = as_robot(robot)
    task = task_of(robot, rows, of)
    J = state_of(robot, of, q).jacobian
    if near is None:
        return basis_of(task, J)
    expected = robot.dof, robot.dof - task.generic_rank
    before = finite_rows(JointVectorError, 'near', near, expected[1])
    shape = *J.shape[:-2], robot.dof
    shape_together(JointVectorError, ('q', 'near'), shape, before.shape, expected, count=2)
    return basis_of(task, J, before)


def basis_of(task: Task, J: Floats, before: Floats | None = None) -> Floats:
    """
    Return an orthonormal basis (..., n, k) of the null space of J_t, for a Jacobian J (..., 6, n)
    in base axes.

    Parameters
    ----------
    task
        The rows of the Jacobian that J_t has.
    J : shape (..., 6, n)
        The Jacobian.
    before : shape (..., n, k)
        The basis of an earlier pose, or None.
    """
    rank, matrix = task.generic_rank, task.row_scales[:, None] * task_jacobian(task, J)
    if before is not None:
        # At a singular pose, the null space of J_t may have more dimensions than `before` has
        # columns. Then choose null vectors in the span of `before`. Let P = before before^T be the
        # projection onto this span. Append the rows of I - P, scaled to the size of round-off, to
        # J_t. Then only null vectors inside the span have the singular value 0. The SVD puts them
        # last, because it sorts by singular values.
        least = kernel.RANK_TOLERANCE * np.linalg.norm(matrix, axis=(-2, -1), keepdims=True)
        others = least * (np.eye(J.shape[-1]) - before @ np.swapaxes(before, -1, -2))
        leading = others.shape[:-2]
        matrix = np.concatenate(
            [np.broadcast_to(matrix, (*leading, *matrix.shape[-2:])), others], axis=-2
        )
    basis = np.swapaxes(np.linalg.svd(matrix)[2][..., rank:, :], -1, -2)
    if before is None:
        # Choose the sign of each basis vector (column) so that its component with the largest size
        # is positive.
        largest = np.argmax(np.abs(basis), axis=-2)[..., None, :]
        return np.asarray(basis * np.sign(np.take_along_axis(basis, largest, axis=-2)))
    # Rotate the basis within the null space so that it is nearest to `before` (orthogonal
    # Procrustes problem).
    U, _, Wt = np.linalg.svd(np.swapaxes(basis, -1, -2) @ before)
    return np.asarray(basis @ (U @ Wt))


def self_motion(robot: AnyRobot, q: npt.ArrayLike) -> Floats:
    """
    Return the null-space motion (..., n) that increases the distance to singularity fastest.

    A null-space motion moves the joints, but not the tool in the rows of the task. The motion is
    the projection g of the gradient of `distance` onto the null space. Joint velocities k g, with
    a factor k, raise the distance at the rate k |g|^2. The motion is zero if the pose is singular,
    if no singular pose was found within 1 rad, or if the arm has no self-motion.

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
    robot = as_robot(robot)
    state = evaluate(robot, q, measured=True)
    return self_motion_of(state, basis_of(robot.singularity.task, state.jacobian))


def self_motion_of(state: ToolState, basis: Floats) -> Floats:
    """
    Return the null-space motion (..., n) of `self_motion`, given a state and a basis (..., n, k)
    of the null space of J_t at this state.
    """
    singularity = singularity_of(state)
    if singularity.nearest_singular is None:
        return np.zeros(state.q.shape)
    scales = state.robot.singularity.task.column_scales
    away = (state.q - singularity.nearest_singular) / scales
    length = np.linalg.norm(away, axis=-1, keepdims=True)
    gradient = np.zeros(away.shape)
    np.divide(away, length * scales, out=gradient, where=length > 0.0)
    along = np.swapaxes(basis, -1, -2) @ gradient[..., None]
    return np.asarray((basis @ along)[..., 0])
