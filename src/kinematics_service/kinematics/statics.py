# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the joint torques J^T F for a wrench F, and estimate the wrench from torques by least
squares.

A wrench is a force (N) and then a torque (N m) at a reference point. The torque of a joint is in N
m; a prismatic joint has a force in N instead. The power of the joints equals the power of the
wrench, so tau = J^T F.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import JointVectorError, WrenchError
from ..kernel import Floats
from ..robot.chain import FrozenArrays
from ..robot.points import TOOL
from ..robot.robot import AnyRobot, Robot, as_robot
from .arguments import finite_rows
from .forward import BASE, jacobian
from .pseudo_inverse import DAMPED_BELOW, inverted


@dataclass(frozen=True, eq=False)
class WrenchEstimate(FrozenArrays):
    """
    A wrench estimated from joint torques, and the wrench directions that have no effect on the
    joints.

    Attributes
    ----------
    wrench : shape (..., 6), N and N m
        The smallest of all wrenches with the least squared error.
    residual : shape (..., n), N m or N
        The torques minus J^T times `wrench`.
    rank : shape (...)
        Number of independent directions of wrench that act on the joints.
    damping : shape (...)
        Largest d / L over the singular values, without unit: d is the damping (m) of a singular
        value, L is the characteristic length.
    damped : shape (..., 6, 6)
        Nonzero rows are directions of wrench that act weakly on the joints. Because of the
        damping, the estimate along these directions is too small. The rows are unit vectors as in
        `hidden`.
    hidden : shape (..., 6, 6)
        Rows 0 to rank - 1 are zero. Each other row is a direction of wrench that does not act on
        any joint. A multiple of this row may be added to `wrench` without a change of the torques.
        The rows are orthonormal. Columns 0 to 2 are the force; columns 3 to 5 are the torque,
        divided by the characteristic length.
    """

    wrench: Floats
    residual: Floats
    rank: npt.NDArray[np.int64]
    damping: Floats
    damped: Floats
    hidden: Floats


def joint_torques(
    robot: AnyRobot,
    q: npt.ArrayLike,
    wrench: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the joint torques J^T F with which the arm exerts a wrench, shape (..., n), N m or N.

    Gravity and friction are not included.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    wrench : shape (..., 6), N and N m
        Force and torque that the arm exerts, at the reference point.
    axes, of, at
        As in `jacobian`.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, or a number is not finite.
    WrenchError
        `wrench` is not six finite numbers, or its leading dimensions do not fit those of `q`.
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.

    Examples
    --------
    An arm with two links of 1 m, stretched along x, pushes along y with 3 N:

    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> ks.joint_torques(robot, [0, 0], [0, 3.0, 0, 0, 0, 0]).tolist()
    [6.0, 3.0]
    """
    robot = as_robot(robot)
    J = jacobian(robot, q, axes, of=of, at=at)
    F = finite_rows(WrenchError, 'wrench', wrench, 6, (*J.shape[:-2], robot.dof))
    return np.asarray(np.einsum('...ij,...i->...j', J, F))


def wrench_from_torques(
    robot: AnyRobot,
    q: npt.ArrayLike,
    torques: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
    damping: float = 0.0,
    damped_below: float = DAMPED_BELOW,
) -> WrenchEstimate:
    """
    Return the wrench that joint torques exert, by least squares, and the wrench directions that
    the torques do not determine.

    In the norms of the least squares, forces of prismatic joints are multiplied by the
    characteristic length, and torques of the wrench are divided by it.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    torques : shape (..., n), N m or N
        Joint torques without gravity and friction.
    axes, of, at
        As in `jacobian`.
    damping, damped_below
        As in `pseudo_inverse`. Without damping, friction and noise give large wrenches along
        directions that act weakly on the joints.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `torques` is not n, or a number is not finite.
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.
    ServoSettingsError
        `damping` or `damped_below` is negative or not finite.
    """
    robot = as_robot(robot)
    J = jacobian(robot, q, axes, of=of, at=at)
    q_shape = *J.shape[:-2], robot.dof
    tau = finite_rows(JointVectorError, 'torques', torques, robot.dof, q_shape)
    return wrench_of(robot, J, tau, damping, damped_below)


def wrench_of(
    robot: Robot, J: Floats, torques: Floats, damping: float, damped_below: float
) -> WrenchEstimate:
    """
    Return the wrench that joint torques exert, as `wrench_from_torques` does, but for a given
    Jacobian J (..., 6, n). The wrench has the axes and the reference point of J.
    """
    length = robot.singularity.task.length
    # Scale F to F' = (force, torque / length), and tau to tau' by the scale of each joint. Then
    # tau' = J'^T F' with the scaled Jacobian J'.
    row_scales = np.array([1.0, 1.0, 1.0, length, length, length])
    column_scales = robot.singularity.task.column_scales
    U, sigma, Vt = np.linalg.svd(row_scales[:, None] * J * column_scales)
    inverse = inverted(sigma, length, damping, damped_below)
    count = sigma.shape[-1]
    along = np.einsum('...kj,...j->...k', Vt[..., :count, :], torques * column_scales)
    wrench = np.einsum('...ik,...k->...i', U[..., :, :count], inverse.gains * along) * row_scales
    felt, hardly = np.arange(6) < inverse.rank[..., None], np.zeros((*inverse.rank.shape, 6), bool)
    hardly[..., :count] = inverse.damping > 0.0
    directions = np.swapaxes(U, -1, -2)
    return WrenchEstimate(
        wrench=wrench,
        residual=torques - np.einsum('...ij,...i->...j', J, wrench),
        rank=inverse.rank,
        damping=np.max(inverse.damping, axis=-1, initial=0.0),
        damped=np.where((felt & hardly)[..., None], directions, 0.0),
        hidden=np.where(felt[..., None], 0.0, directions),
    )
