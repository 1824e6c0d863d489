# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert between representations of rotations and rigid motions, with numpy, not the kernel."""

import math

import numpy as np
import numpy.typing as npt

# Define this type here. An import of the kernel's type would load the kernel, but a robot file can
# be read without the kernel.
Floats = npt.NDArray[np.float64]

# If the difference between pitch and +-pi/2 is below this, rad, `roll_pitch_yaw` sets yaw to 0,
# because yaw is not unique.
ANGLE_TOLERANCE = 1e-9
# If the difference between pitch and +-pi/2 is below this, rad, `exact_rpy` sets yaw to 0. The
# value is about the round-off of an angle.
ANGLE_ROUND_OFF = 1e-15
# If 2 cos(angle) is below this, `rotation_vector` computes the axis from R + R^T, because R - R^T
# is small. The value means an angle within 18 degrees of half a turn.
HALF_TURN_COSINE = -1.9

# Rotation matrices that turn the z axis into the named axis. The matrices are permutations, so
# they have no round-off.
Z_INTO = {
    'x': np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    'y': np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
    'z': np.eye(4),
}


def screw_z(theta: float, d: float) -> Floats:
    """Return the matrix (4, 4) of Rz(theta) Tz(d), theta in rad, d in m."""
    return screw('z', theta, d)


def screw(axis: str, angle: float, length: float) -> Floats:
    """
    Return the matrix (4, 4) of a screw motion: turn by `angle` (rad) about an axis, and move by
    `length` (m) along the axis.
    """
    k, T = 'xyz'.index(axis), np.eye(4)
    i, j = (k + 1) % 3, (k + 2) % 3
    T[i, i] = T[j, j] = math.cos(angle)
    T[j, i] = math.sin(angle)
    T[i, j] = -T[j, i]
    T[k, 3] = length
    return T


def screw_x(alpha: float, a: float) -> Floats:
    """Return the matrix (4, 4) of Tx(a) Rx(alpha) = Rx(alpha) Tx(a), alpha in rad, a in m."""
    return screw('x', alpha, a)


def inverse(T: Floats) -> Floats:
    """Return the inverse of a rigid motion (4, 4), by the transpose of its rotation."""
    result = np.eye(4)
    result[:3, :3] = T[:3, :3].T
    result[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return result


def inverses(T: Floats) -> Floats:
    """Return the inverses of rigid motions (N, 4, 4), by the transposes of their rotations."""
    result = np.array(T)
    result[:, :3, :3] = np.swapaxes(T[:, :3, :3], 1, 2)
    result[:, :3, 3:] = -result[:, :3, :3] @ T[:, :3, 3:]
    return result


def rotation_of_quaternion(quaternion_xyzw: npt.ArrayLike) -> Floats:
    """
    Return the rotations (..., 3, 3) of quaternions x y z w (..., 4) of any length but zero.

    The Euler-Rodrigues formula is R = I + s (w [v]x + [v]x [v]x) with v = (x, y, z). With
    s = 2 / |q|^2 the formula needs no square root, so quarter turns about the axes are exact. The
    rotation is NaN if q is zero or not finite.
    """
    q = np.moveaxis(np.asarray(quaternion_xyzw, dtype=np.float64), -1, 0)
    with np.errstate(invalid='ignore'):
        # Divide by the largest of the four numbers, because the square of the quaternion's length
        # might overflow.
        x, y, z, w = q / np.max(np.abs(q), axis=0)
    s = 2.0 / (x * x + y * y + z * z + w * w)
    R = np.empty((*q.shape[1:], 3, 3))
    R[..., 0, 0] = 1.0 - s * (y * y + z * z)
    R[..., 1, 1] = 1.0 - s * (x * x + z * z)
    R[..., 2, 2] = 1.0 - s * (x * x + y * y)
    R[..., 0, 1], R[..., 1, 0] = s * (x * y - z * w), s * (x * y + z * w)
    R[..., 0, 2], R[..., 2, 0] = s * (x * z + y * w), s * (x * z - y * w)
    R[..., 1, 2], R[..., 2, 1] = s * (y * z - x * w), s * (y * z + x * w)
    return R


def skew_part(R: Floats) -> Floats:
    """
    Return the axis times 2 sin(angle), shape (..., 3), of rotations R (..., 3, 3).

    The three numbers are entries of R - R^T.
    """
    return np.stack(
        [
            R[..., 2, 1] - R[..., 1, 2],
            R[..., 0, 2] - R[..., 2, 0],
            R[..., 1, 0] - R[..., 0, 1],
        ],
        axis=-1,
    )


def rotation_vector(R: Floats) -> Floats:
    """
    Return the rotation vectors (axis times angle), (..., 3), rad, of rotations (..., 3, 3).

    Angles are at most pi. The result is exact to round-off at every angle. For half a turn, two
    opposite vectors are right, and the function returns one of the two.
    """
    skew = skew_part(R)
    sine = np.sqrt(np.einsum('...i,...i->...', skew, skew))
    cosine = np.trace(R, axis1=-2, axis2=-1) - 1.0
    angle = np.arctan2(sine, cosine)
    ratio = np.divide(angle, sine, out=np.full_like(sine, 0.5), where=sine > 0.0)
    vectors: Floats = skew * ratio[..., None]
    half_turns = cosine < HALF_TURN_COSINE
    if np.any(half_turns):
        # R + R^T = 2 cos(angle) I + 2 (1 - cos(angle)) axis axis^T. The column with the largest
        # diagonal element gives the axis with the least error. The skew part gives the sign of the
        # axis.
        outer = (
            R[half_turns]
            + np.swapaxes(R[half_turns], -1, -2)
            - cosine[half_turns][:, None, None] * np.eye(3)
        )
        column = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
        axis = outer[np.arange(len(outer)), column]
        along = np.copysign(angle[half_turns], np.einsum('ni,ni->n', axis, skew[half_turns]))
        vectors[half_turns] = axis * (along / np.linalg.norm(axis, axis=-1))[:, None]
    return vectors


def apart(poses: Floats, others: Floats) -> tuple[Floats, Floats]:
    """Return the distances (...,), m, and the angles (...,), rad, between poses (..., 4, 4)."""
    R = poses[..., :3, :3] @ np.swapaxes(others[..., :3, :3], -1, -2)
    distances = np.linalg.norm(poses[..., :3, 3] - others[..., :3, 3], axis=-1)
    return distances, np.asarray(np.linalg.norm(rotation_vector(R), axis=-1))


def roll_pitch_yaw(R: Floats, tolerance: float = ANGLE_TOLERANCE) -> Floats:
    """
    Return (roll, pitch, yaw) of a rotation matrix, R = Rz(yaw) Ry(pitch) Rx(roll), in rad.

    If cos(pitch) is below `tolerance`, only the sum or difference of roll and yaw is determined.
    Then yaw is set to 0. Otherwise the product of the three rotations is R within round-off, even
    near pitch = +-pi/2. Roll is computed from Rz(-yaw) R, whose second row is (0, cos roll, -sin
    roll). So roll compensates the error of an ill-conditioned yaw.
    """
    yaw = math.atan2(R[1, 0], R[0, 0])
    if math.hypot(R[0, 0], R[1, 0]) < tolerance:
        yaw = 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    pitch = math.atan2(-R[2, 0], max(c * R[0, 0] + s * R[1, 0], 0.0))
    return np.array([roll, pitch, yaw]) + 0.0  # the sum changes -0.0 to 0.0


def rotation_of_roll_pitch_yaw(rpy: npt.ArrayLike) -> Floats:
    """Return the rotation Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3), of angles (3,) in rad."""
    roll, pitch, yaw = np.asarray(rpy, dtype=np.float64).tolist()
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    R = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return R + 0.0  # the sum changes -0.0 to 0.0


def exact_rpy(R: Floats) -> tuple[float, float, float]:
    """
    Return (roll, pitch, yaw) of a rotation, R = Rz(yaw) Ry(pitch) Rx(roll), in rad.

    The product of the three rotations is R within round-off for every R, even at pitch = +-pi/2.
    `roll_pitch_yaw` is less exact within `ANGLE_TOLERANCE` of +-pi/2.
    """
    roll, pitch, yaw = roll_pitch_yaw(R, ANGLE_ROUND_OFF).tolist()
    return roll, pitch, yaw


def pose_of(xyz: npt.ArrayLike, rpy: tuple[float, float, float]) -> Floats:
    """
    Return the pose (4, 4) of a URDF `<origin>`: xyz in m, rpy in rad, Rz(yaw) Ry(pitch) Rx(roll).
    """
    T = np.eye(4)
    T[:3, :3] = rotation_of_roll_pitch_yaw(rpy)
    T[:3, 3] = xyz
    return T


def turn_about(axis: Floats, angle: npt.ArrayLike) -> Floats:
    """
    Return the rotations by angles (...), rad, about a unit axis (3,), shape (..., 3, 3).

    Rodrigues: R = cos I + sin [w]x + (1 - cos) w w^T.
    """
    angle = np.asarray(angle, dtype=np.float64)[..., None, None]
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.cos(angle) * np.eye(3)
        + np.sin(angle) * cross
        + (1.0 - np.cos(angle)) * np.outer(axis, axis)
    )


def exponential(w: Floats) -> Floats:
    """
    Return the rotations (..., 3, 3) of rotation vectors (..., 3), rad, by Rodrigues' formula.
    """
    angle = np.sqrt(np.einsum('...i,...i->...', w, w))[..., None, None]
    K = np.zeros((*w.shape, 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    K[..., 1, 2], K[..., 2, 0], K[..., 0, 1] = -w[..., 0], -w[..., 1], -w[..., 2]
    b = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * K + b * K @ K)


def across(direction: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors (3,) that complete a unit vector to a right-handed basis."""
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(direction)))] = 1.0
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return x, np.cross(direction, x)
