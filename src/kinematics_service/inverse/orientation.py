"""
Poses from the ways people write an orientation.

"""

import numpy as np

from ..kernel import Floats
from ..rigid_motion import Z_INTO, screw_z


def pose_of_roll_pitch_yaw(rpy: Floats) -> Floats:
    """
    Return Rz(yaw) Ry(pitch) Rx(roll) at the origin, shape (4, 4), of angles (3,) in rad.

    """
    roll, pitch, yaw = (float(angle) for angle in rpy)
    about_y = Z_INTO['y'] @ screw_z(pitch, 0.0) @ Z_INTO['y'].T
    about_x = Z_INTO['x'] @ screw_z(roll, 0.0) @ Z_INTO['x'].T
    return np.asarray(screw_z(yaw, 0.0) @ about_y @ about_x)


def pose_of_quaternion(quaternion_xyzw: Floats) -> Floats:
    """
    Return the rotation of a quaternion (4,) of any length but zero, at the origin, shape (4, 4).

    """
    x, y, z, w = np.asarray(quaternion_xyzw) / np.linalg.norm(quaternion_xyzw)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return pose
