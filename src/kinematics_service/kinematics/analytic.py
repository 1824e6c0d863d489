# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute analytic Jacobians, whose angular rows are rates of orientation coordinates instead of the
angular velocity.

Orientation coordinates have singularities of their own. At pitch = +-90 degrees roll and yaw turn
about one axis. A rotation vector jumps at half a turn.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import PointError
from ..kernel import Floats
from ..rigid_motion import ANGLE_TOLERANCE, roll_pitch_yaw, rotation_vector
from ..robot.chain import FrozenArrays
from ..robot.points import TOOL
from ..robot.robot import AnyRobot, as_robot
from .forward import BASE, chosen, state_of

# Names of the orientation rows for each kind of orientation coordinates.
COORDINATES = {
    'rpy': ('roll', 'pitch', 'yaw'),
    'quaternion': ('qx', 'qy', 'qz', 'qw'),
    'rotation_vector': ('rx', 'ry', 'rz'),
}


@dataclass(frozen=True, eq=False)
class AnalyticJacobian(FrozenArrays):
    """
    A Jacobian whose rows are the rates of the position and of orientation coordinates.

    Attributes
    ----------
    rows
        Names of the rows: x y z, then the orientation coordinates.
    jacobian : shape (..., 6 or 7, n)
        In m and rad, base axes. At pitch = +-90 degrees roll and yaw have no rates, so the rows
        of the orientation are NaN.
    coordinates : shape (..., 3 or 4)
        Roll, pitch and yaw, R = Rz(yaw) Ry(pitch) Rx(roll); the unit quaternion x y z w, w >= 0;
        or the rotation vector, of length up to pi.
    amplification : shape (...)
        The largest rate of the coordinates for an angular velocity of 1 rad/s. Roll, pitch, yaw:
        sqrt(1 + |sin(pitch)|) / cos(pitch), infinite at pitch = +-90 degrees. Quaternions: 0.5.
        Rotation vectors: at most pi / 2.
    singular : shape (...)
        Whether the coordinates are singular: roll, pitch and yaw at pitch = +-90 degrees, a
        rotation vector at half a turn; quaternions never. At half a turn the rotation vector jumps
        to its opposite, so its rates are valid up to the jump, not across it.
    """

    rows: tuple[str, ...]
    jacobian: Floats
    coordinates: Floats
    amplification: Floats
    singular: npt.NDArray[np.bool_]


def analytic_jacobian(
    robot: AnyRobot,
    q: npt.ArrayLike,
    rates: str = 'rpy',
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> AnalyticJacobian:
    """
    Return a Jacobian whose rows are the rates of the position and of orientation coordinates.

    The result also has the orientation coordinates, and whether they are singular at `q`.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    rates
        The orientation coordinates: `rpy`, `quaternion` or `rotation_vector`.
    of
        The frame that moves: `tool`, the name of a point in the robot file, or the number of a
        row, as in `jacobian`.
    at
        The point of the frame whose velocity is meant, as in `jacobian`.

    Raises
    ------
    JointVectorError
        The last dimension of `q` is not n, or a number is not finite.
    PointError
        The arm has no point or row `of`, `at` is not three finite numbers, or `rates` is unknown.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> result = ks.analytic_jacobian(robot, [0.1, 0.2])
    >>> result.rows[5], result.jacobian[5].tolist(), float(result.amplification)
    ('yaw', [1.0, 1.0], 1.0)
    """
    robot = as_robot(robot)
    if not isinstance(rates, str) or rates not in COORDINATES:
        raise PointError.unknown_name('rates', COORDINATES, rates)
    state = state_of(robot, of, q)
    J = chosen(robot, q, state, state.jacobian, of, at, BASE)
    R = state.pose[..., :3, :3]
    if rates == 'rpy':
        coordinates, by_turn, amplification, singular = _of_rpy(R)
    elif rates == 'quaternion':
        coordinates, by_turn, amplification, singular = _of_quaternion(state.quaternion_xyzw)
    else:
        coordinates, by_turn, amplification, singular = _of_rotation_vector(R)
    return AnalyticJacobian(
        rows=('x', 'y', 'z', *COORDINATES[rates]),
        jacobian=np.concatenate([J[..., :3, :], by_turn @ J[..., 3:, :]], axis=-2),
        coordinates=coordinates,
        amplification=amplification,
        singular=singular,
    )


# Four results for one kind of orientation coordinates: the coordinates, the matrix from angular
# velocity to their rates, the norm of this matrix, and whether the coordinates are singular.
_Map = tuple[Floats, Floats, Floats, npt.NDArray[np.bool_]]


def _of_rpy(R: Floats) -> _Map:
    angles = [roll_pitch_yaw(matrix) for matrix in R.reshape(-1, 3, 3)]
    coordinates = np.array(angles).reshape(*R.shape[:-2], 3)
    cos_pitch = np.hypot(R[..., 0, 0], R[..., 1, 0])
    singular = np.asarray(cos_pitch < ANGLE_TOLERANCE)
    by = np.where(singular, np.nan, cos_pitch)
    c, s = R[..., 0, 0] / by, R[..., 1, 0] / by
    tangent = -R[..., 2, 0] / by
    zero = np.where(singular, np.nan, 0.0)
    # Let x, y, z be the unit vectors, and let Ry = Ry(pitch) and Rz = Rz(yaw) be rotation
    # matrices. The angular velocity is w = roll' Rz Ry x + pitch' Rz y + yaw' z. Solve this
    # equation for the rates roll', pitch', yaw'.
    by_turn = _stacked(
        [c / by, s / by, zero], [-s, c, zero], [c * tangent, s * tangent, zero + 1.0]
    )
    # The amplification is the largest ratio of the rates (roll', pitch', yaw') to the angular
    # velocity. It is 1 / s, where s is the smallest singular value of the matrix with the columns
    # Rz Ry x, Rz y and z: s = sqrt(1 - |sin(pitch)|) = cos(pitch) / sqrt(1 + |sin(pitch)|).
    growth = np.sqrt(1.0 + np.abs(R[..., 2, 0]))
    amplification = np.where(singular, np.inf, growth / np.where(singular, 1.0, cos_pitch))
    return coordinates, by_turn, amplification, singular


def _of_quaternion(quaternion_xyzw: Floats) -> _Map:
    x, y, z, w = np.moveaxis(quaternion_xyzw, -1, 0)
    # The rate of a quaternion q is 0.5 (omega, 0) q: half the product of two quaternions. omega is
    # the angular velocity, and (omega, 0) has the scalar part 0.
    by_turn = 0.5 * _stacked([w, z, -y], [-z, w, x], [y, -x, w], [-x, -y, -z])
    return (
        quaternion_xyzw.copy(),
        by_turn,
        np.full(w.shape, 0.5),
        np.zeros(w.shape, dtype=np.bool_),
    )


def _of_rotation_vector(R: Floats) -> _Map:
    vector = rotation_vector(R.reshape(-1, 3, 3)).reshape(*R.shape[:-2], 3)
    x, y, z = np.moveaxis(vector, -1, 0)
    angle = np.sqrt(x * x + y * y + z * z)
    half = 0.5 * angle
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    # Compute (1 - h cot(h)) / angle^2, where h is half of the rotation angle. For a small angle
    # use the Taylor series.
    factor = np.where(
        small,
        1.0 / 12.0 + angle * angle / 720.0,
        (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / (safe * safe),
    )
    zero = np.zeros_like(x)
    cross = _stacked([zero, -z, y], [z, zero, -x], [-y, x, zero])
    # Compute the inverse of the left Jacobian of SO(3), which maps the angular velocity to the
    # rate of the rotation vector.
    by_turn = np.eye(3) - 0.5 * cross + factor[..., None, None] * (cross @ cross)
    return (
        vector,
        by_turn,
        np.asarray(1.0 / np.sinc(half / np.pi)),
        np.asarray(angle > np.pi - ANGLE_TOLERANCE),
    )


def _stacked(*rows: list[Floats]) -> Floats:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
