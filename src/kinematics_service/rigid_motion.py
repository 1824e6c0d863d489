"""
Constant rigid motions as 4 x 4 arrays, used while a robot is loaded (never in the kernel).

"""

import math

import numpy as np

from .kernel import Floats

# Rotations that turn the z axis into the named one: permutations, so nothing is rounded.
Z_INTO = {
    'x': np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    'y': np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
    'z': np.eye(4),
}


def screw_z(theta: float, d: float) -> Floats:
    """
    Return Rz(theta) Tz(d), theta in rad, d in m.

    """
    c, s = math.cos(theta), math.sin(theta)
    return np.array(
        [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, d], [0.0, 0.0, 0.0, 1.0]]
    )


def screw_x(alpha: float, a: float) -> Floats:
    """
    Return Tx(a) Rx(alpha) = Rx(alpha) Tx(a), alpha in rad, a in m.

    """
    c, s = math.cos(alpha), math.sin(alpha)
    return np.array(
        [[1.0, 0.0, 0.0, a], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )


def inverse(T: Floats) -> Floats:
    """
    Return the inverse of a rigid motion, by its transpose.

    """
    result = np.eye(4)
    result[:3, :3] = T[:3, :3].T
    result[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return result


def rotation_vector(R: Floats) -> Floats:
    """
    Return the rotation vector (3,) of a rotation matrix (3, 3): axis times angle in [0, pi].

    """
    vee = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(vee)), float(np.trace(R)) - 1.0
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        return vee * (angle / sine)
    if cosine > 0.0:
        return vee / 2.0
    # Half a turn: R + I = 2 axis axis^T, so any column shows the axis; the longest is the safest.
    columns = R + np.eye(3)
    column = columns[:, int(np.argmax(np.linalg.norm(columns, axis=0)))]
    return np.asarray(column / np.linalg.norm(column) * angle)


def roll_pitch_yaw(R: Floats) -> Floats:
    """
    Return (roll, pitch, yaw) of a rotation matrix, R = Rz(yaw) Ry(pitch) Rx(roll), in rad.

    At pitch = +-pi/2 only roll -+ yaw is determined; yaw is then 0.

    """
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) < 1e-9:
        return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])
