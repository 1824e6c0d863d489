"""
Rotations made of other things: of rotation vectors, of any matrix the nearest one.

"""

import numpy as np

from ..kernel import Floats


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
