"""
Roll, pitch and yaw as URDF means them, both ways, without losing a digit.

"""

import numpy as np
import numpy.typing as npt

from ..kernel import Floats
from ..rigid_motion import roll_pitch_yaw, rotation_of_roll_pitch_yaw

# Below it cos(pitch) is round-off, and so would be the yaw read from it: yaw is then 0.
ROUND_OFF = 1e-15


def exact_rpy(R: Floats) -> tuple[float, float, float]:
    """
    Return (roll, pitch, yaw) of a rotation, R = Rz(yaw) Ry(pitch) Rx(roll), in rad.

    Unlike those for people to read, the three angles multiply out to R within round-off at every
    R, pitch = +-pi/2 included.

    """
    roll, pitch, yaw = roll_pitch_yaw(R, ROUND_OFF).tolist()
    return roll, pitch, yaw


def pose_of(xyz: npt.ArrayLike, rpy: tuple[float, float, float]) -> Floats:
    """
    Return the pose (4, 4) of an `<origin>`: xyz in m, rpy in rad, Rz(yaw) Ry(pitch) Rx(roll).

    """
    T = np.eye(4)
    T[:3, :3] = rotation_of_roll_pitch_yaw(rpy)
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
