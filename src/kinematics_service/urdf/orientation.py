"""
Roll, pitch and yaw as URDF means them, both ways, without losing a digit.

"""

import math

import numpy as np
import numpy.typing as npt

from ..kernel import Floats

# Below it cos(pitch) is round-off, and so would be the yaw read from it: yaw is then 0.
ROUND_OFF = 1e-15


def exact_rpy(R: Floats) -> tuple[float, float, float]:
    """
    Return (roll, pitch, yaw) of a rotation, R = Rz(yaw) Ry(pitch) Rx(roll), in rad.

    Unlike `rigid_motion.roll_pitch_yaw`, which is for people to read, the three angles multiply
    out to R within round-off at every R, pitch = +-pi/2 and its neighbourhood included: roll is
    read from Rz(-yaw) R, whose second row is (0, cos roll, -sin roll), and so undoes what an
    ill-conditioned yaw does.

    """
    yaw = math.atan2(R[1, 0], R[0, 0])
    if math.hypot(R[0, 0], R[1, 0]) < ROUND_OFF:
        yaw = 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    pitch = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    return roll + 0.0, pitch + 0.0, yaw + 0.0  # no -0.0


def pose_of(xyz: npt.ArrayLike, rpy: tuple[float, float, float]) -> Floats:
    """
    Return the pose (4, 4) of an `<origin>`: xyz in m, rpy in rad, Rz(yaw) Ry(pitch) Rx(roll).

    """
    roll, pitch, yaw = rpy
    x, y, z = np.eye(3)
    T = np.eye(4)
    T[:3, :3] = turn_about(z, yaw) @ turn_about(y, pitch) @ turn_about(x, roll)
    T[:3, 3] = xyz
    return T


def turn_about(axis: Floats, angle: npt.ArrayLike) -> Floats:
    """
    Return the rotation by angles (...) about a unit axis (3,), shape (..., 3, 3).

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
