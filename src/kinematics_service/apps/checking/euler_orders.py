# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert rotations to three angles and back, in any of the 24 orders of Craig, appendix B."""

import itertools

import numpy as np
import numpy.typing as npt

from ...kernel import Floats
from ...rigid_motion import turn_about

# The 24 orders of three angles (Craig, appendix B). Letter k is the axis of angle k. Small letters
# are fixed axes; capitals are axes that turn with the body. The order xyz is roll pitch yaw.
EULER_ORDERS = tuple(
    order
    for axes in itertools.product('xyz', repeat=3)
    if axes[0] != axes[1] != axes[2]
    for order in (''.join(axes), ''.join(axes).upper())
)


def rotation_of_euler(order: str, angles: npt.ArrayLike) -> Floats:
    """
    Return the rotations (..., 3, 3) of three angles (..., 3), rad, in an order of `EULER_ORDERS`.

    For angles (a, b, c), the order xyz (fixed axes) gives the rotation Rz(c) Ry(b) Rx(a). The
    order XYZ (axes that turn with the body) gives Rx(a) Ry(b) Rz(c).
    """
    about = [
        turn_about(np.eye(3)['xyz'.index(axis)], angle)
        for axis, angle in zip(order.lower(), np.moveaxis(np.asarray(angles), -1, 0))
    ]
    first, second, third = about if order.isupper() else about[::-1]
    return np.asarray(first @ second @ third)


def euler_angles(order: str, R: Floats) -> Floats:
    """
    Return the three angles (..., 3), rad, of rotations (..., 3, 3), in an order of `EULER_ORDERS`.

    The middle angle is from -90 to 90 degrees, or from 0 to 180 degrees if the first axis is also
    the third. The other angles are from -180 to 180 degrees.
    """
    axes = order.upper() if order.isupper() else order[::-1].upper()
    i, j, k = ('XYZ'.index(axis) for axis in axes)
    last = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    if i != k:
        a = np.arctan2(-sign * R[..., j, k], R[..., k, k])
        b = np.arctan2(sign * R[..., i, k], np.hypot(R[..., i, i], R[..., i, j]))
    else:
        a = np.arctan2(R[..., j, i], -sign * R[..., last, i])
        b = np.arctan2(np.hypot(R[..., i, j], R[..., i, last]), R[..., i, i])
    # Near a singular orientation, the turns a and c (the first and the third) are about the same
    # line, so a may have any value. Remove the turn a from R, and compute c from the remaining
    # rotation. Then the product of the three turns is R for any a.
    M = np.swapaxes(turn_about(np.eye(3)[i], a), -1, -2) @ R
    other = i if i != k else last
    c = np.arctan2((sign if i != k else -sign) * M[..., j, other], M[..., j, j])
    three = (a, b, c) if order.isupper() else (c, b, a)
    return np.stack(three, axis=-1)
