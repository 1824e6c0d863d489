"""
Poses of a second source as matrices.

"""

import numpy as np

from ..kernel import Floats
from ..rigid_motion import rotation_of_quaternion
from .block import AuditError

# A quaternion may be so far from unit length: float32 and printed digits, not another thing.
UNIT = 0.05


def poses_of(rows: Floats, name: str) -> Floats:
    """
    Return poses (N, 4, 4) of rows (N, 7): x y z and a quaternion x y z w, of about unit length.

    Raises
    ------
    AuditError
        A number is not finite, or quaternions are not of unit length.

    """
    if not np.all(np.isfinite(rows)):
        raise AuditError(f'{name}: a pose is not finite')
    norms = np.linalg.norm(rows[:, 3:], axis=1)
    if np.any(np.abs(norms - 1.0) > UNIT):
        worst = float(norms[int(np.argmax(np.abs(norms - 1.0)))])
        raise AuditError(f'{name}: a quaternion has the length {worst:.3g}, which should be 1')
    T = np.zeros((len(rows), 4, 4))
    T[:, :3, :3] = rotation_of_quaternion(rows[:, 3:])
    T[:, :3, 3] = rows[:, :3]
    T[:, 3, 3] = 1.0
    return T


def poses_of_vectors(rows: Floats, name: str) -> Floats:
    """
    Return poses (N, 4, 4) of rows (N, 6): x y z and a rotation vector (rad), as UR controllers do.

    """
    vectors = rows[:, 3:]
    angles = np.linalg.norm(vectors, axis=1)
    half = 0.5 * angles
    # sin(a/2)/a, which is 1/2 at a = 0.
    share = 0.5 * np.sinc(half / np.pi)
    quaternions = np.column_stack([vectors * share[:, None], np.cos(half)])
    return poses_of(np.column_stack([rows[:, :3], quaternions]), name)
