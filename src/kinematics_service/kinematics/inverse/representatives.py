"""
Which of the joint positions that differ by full turns are meant, and how they stand to limits.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .plan import InversePlan


class Representatives(NamedTuple):
    """
    Joint positions with the turns chosen.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Inside the limits if any turn is; the nearest to `near` of those.
    outside : shape (m, n)
        Which joints are beyond their limits.
    margin : shape (m,)
        Distance to the nearest limit, rad or m; negative beyond one.
    """

    q: Floats
    outside: npt.NDArray[np.bool_]
    margin: Floats


def representatives(robot: Robot, plan: InversePlan, q: Floats, near: Floats) -> Representatives:
    """Return the representatives of joint positions (m, n) nearest to `near` (n,)."""
    q = np.array(q, dtype=np.float64, order='C')
    kernel.representatives(plan.joints, near, q)
    room = np.minimum(q - plan.limits[:, 0], plan.limits[:, 1] - q)
    return Representatives(q, room < -kernel.AT_LIMIT, room.min(axis=1))
