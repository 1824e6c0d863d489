"""
Rotations as arrays with any leading dimensions: vectors, quaternions, the nearest one.

"""

import numpy as np

from ..kernel import Floats


def skew_part(R: Floats) -> Floats:
    """
    Return 2 sin(angle) axis of rotations (..., 3, 3), shape (..., 3).

    """
    return np.stack(
        [
            R[..., 2, 1] - R[..., 1, 2],
            R[..., 0, 2] - R[..., 2, 0],
            R[..., 1, 0] - R[..., 0, 1],
        ],
        axis=-1,
    )


def rotation_vectors(R: Floats) -> Floats:
    """
    Return the rotation vectors (..., 3) of rotations (..., 3, 3), rad, of length up to pi.

    """
    skew = 0.5 * skew_part(R)
    sine = np.sqrt(np.einsum('...i,...i->...', skew, skew))
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    share = np.divide(angle, sine, out=np.ones_like(sine), where=sine > 1e-7)
    vectors: Floats = skew * share[..., None]
    # Next to half a turn the axis is that of the largest column of R + 1.
    for at in np.argwhere((sine <= 1e-7) & (cosine < 0.0)):
        place = tuple(at.tolist())
        symmetric = R[place] + np.eye(3)
        axis = symmetric[:, int(np.argmax(np.diag(symmetric)))]
        vectors[place] = np.pi * axis / np.linalg.norm(axis)
    return vectors


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


def nearest_rotation(M: Floats) -> Floats:
    """
    Return the rotations R (..., 3, 3) that maximise trace(R^T M): Procrustes (Kabsch 1976).

    """
    U, _, Vt = np.linalg.svd(M)
    U = np.array(U)
    U[..., :, 2] *= np.linalg.det(U @ Vt)[..., None]
    return np.asarray(U @ Vt)


def rotations_of(quaternions_xyzw: Floats) -> Floats:
    """
    Return the rotations (..., 3, 3) of unit quaternions x y z w (..., 4).

    """
    x, y, z, w = np.moveaxis(quaternions_xyzw, -1, 0)
    R = np.empty((*x.shape, 3, 3))
    R[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    R[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    R[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    R[..., 0, 1], R[..., 1, 0] = 2.0 * (x * y - z * w), 2.0 * (x * y + z * w)
    R[..., 0, 2], R[..., 2, 0] = 2.0 * (x * z + y * w), 2.0 * (x * z - y * w)
    R[..., 1, 2], R[..., 2, 1] = 2.0 * (y * z - x * w), 2.0 * (y * z + x * w)
    return R
