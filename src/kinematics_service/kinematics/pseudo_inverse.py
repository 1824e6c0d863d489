# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the pseudo-inverse of the task Jacobian by singular values, with or without damping.

Only singular values below a bound are damped, so the inverse is exact for tool directions with
larger singular values (Nakamura and Hanafusa 1986; Maciejewski and Klein 1988). The function
`joint_velocity` damps singular values by the same formula.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import ServoSettingsError
from ..kernel import Floats
from ..robot.chain import FrozenArrays
from ..robot.points import TOOL
from ..robot.robot import AnyRobot, as_robot
from .arguments import check_positive, number_or_nan
from .forward import state_of
from .task_jacobian import task_jacobian, task_of

# By default, singular values below DAMPED_BELOW times the characteristic length are damped, as in
# ServoSettings.
DAMPED_BELOW = 0.05


@dataclass(frozen=True, eq=False)
class PseudoInverse(FrozenArrays):
    """
    The pseudo-inverse of the task Jacobian J_t, with its rank and its damping.

    Several joint motions may produce a twist with the least error; `matrix` gives the smallest of
    these motions. In the norm of the error, angular rows are multiplied by the characteristic
    length. In the norm of the joint motion, prismatic motions are divided by this length.

    Attributes
    ----------
    rows
        Names of the rows of J_t, some of x y z rx ry rz in that order, in the axes of frame 0.
    matrix : shape (..., n, m)
        Joint velocities (rad/s or m/s) for each row (m/s or rad/s).
    singular_values : shape (..., min(m, n)), m
        Singular values of the scaled J_t, in descending order.
    rank : shape (...)
        Number of singular values above 1e-10 times the largest singular value. The other singular
        values are not inverted.
    damping : shape (...)
        Largest d / L over the singular values, without unit: d is the damping (m) of a singular
        value, L is the characteristic length. 0 if the pseudo-inverse is exact.
    """

    rows: tuple[str, ...]
    matrix: Floats
    singular_values: Floats
    rank: npt.NDArray[np.int64]
    damping: Floats


@dataclass(frozen=True, eq=False)
class Inverted(FrozenArrays):
    """
    Damped inverses of k singular values.

    `gains` (..., k), 1/m, has s / (s^2 + d^2) for each singular value s (m) with the damping d
    (m). `damping` (..., k) is d divided by the characteristic length. `rank` (...) is the number
    of singular values that are inverted.
    """

    gains: Floats
    rank: npt.NDArray[np.int64]
    damping: Floats


def inverted(sigma: Floats, length: float, damping: float, damped_below: float) -> Inverted:
    """
    Return the gain s / (s^2 + d^2) of each singular value s, with the damping d.

    If s < damped_below * length, the damping follows from (d / length)^2 = damping^2 (1 - (s /
    (damped_below * length))^2). Otherwise d is 0, and the gain is 1 / s. Singular values below the
    rank tolerance have the gain 0.

    Parameters
    ----------
    sigma : shape (..., k), m
        Singular values, the largest first.
    length
        The characteristic length, m.
    damping, damped_below
        A singular value of 0 has the damping `damping * length`. Singular values below
        `damped_below * length` are damped.

    Raises
    ------
    ServoSettingsError
        `damping` is negative, `damped_below` not positive, or one of them not finite.
    """
    if not 0.0 <= number_or_nan(damping) < np.inf:
        accepted = '0 or a positive number'
        raise ServoSettingsError.refused('damping', accepted, damping, code='out-of-range')
    check_positive(ServoSettingsError, 'damped_below', damped_below)
    kept = sigma > kernel.RANK_TOLERANCE * np.maximum(sigma[..., :1], np.finfo(float).tiny)
    ratio = np.minimum(sigma / (damped_below * length), 1.0)
    of_each = damping * np.sqrt(1.0 - ratio * ratio)
    safe = np.where(kept, sigma, 1.0)
    return Inverted(
        gains=np.where(kept, 1.0 / (safe + (of_each * length) ** 2 / safe), 0.0),
        rank=np.asarray(np.sum(kept, axis=-1), dtype=np.int64),
        damping=of_each,
    )


def pseudo_inverse(
    robot: AnyRobot,
    q: npt.ArrayLike,
    rows: Sequence[str] | None = None,
    *,
    of: str | int = TOOL,
    damping: float = 0.0,
    damped_below: float = DAMPED_BELOW,
) -> PseudoInverse:
    """
    Return the pseudo-inverse of the task Jacobian J_t, with its rank and damping.

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
        The frame that moves, as in `jacobian`.
    damping, damped_below
        Singular values below `damped_below * L` are damped; L is the characteristic length. A
        singular value of 0 has the damping `damping * L`. By default, no singular value is damped.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, or a number is not finite.
    PointError
        The arm has no frame `of`; `rows` is empty or has an unknown name.
    ServoSettingsError
        `damping` or `damped_below` is negative or not finite.
    KinematicsError
        No joint moves the tool in these rows.

    Examples
    --------
    With the elbow at 90 degrees the second joint alone moves the tool along x.

    >>> import kinematics_service as ks
    >>> inverse = ks.pseudo_inverse('planar_2r', [0, 1.5707963267948966])
    >>> (inverse.matrix @ [1.0, 0.0]).round(9).tolist(), float(inverse.damping)
    ([0.0, -1.0], 0.0)
    """
    robot = as_robot(robot)
    task = task_of(robot, rows, of)
    J_t = task_jacobian(task, state_of(robot, of, q).jacobian)
    scaled = task.row_scales[:, None] * J_t * task.column_scales
    U, sigma, Vt = np.linalg.svd(scaled, full_matrices=False)
    inverse = inverted(sigma, task.length, damping, damped_below)
    matrix = np.swapaxes(Vt, -1, -2) @ (inverse.gains[..., None] * np.swapaxes(U, -1, -2))
    return PseudoInverse(
        rows=task.rows,
        matrix=task.column_scales[:, None] * matrix * task.row_scales,
        singular_values=sigma,
        rank=inverse.rank,
        damping=np.max(inverse.damping, axis=-1, initial=0.0),
    )
