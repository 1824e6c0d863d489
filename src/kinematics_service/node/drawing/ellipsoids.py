"""
Manipulability ellipsoids: the tool velocities that joint velocities of unit norm can cause.

The image of the unit ball of joint velocities under a block of the Jacobian is an ellipsoid, its
radii the singular values of the block and its axes the left singular vectors (Yoshikawa 1985).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...robot.closed_poses import closed_poses
from ...robot.robot import Robot
from ...robot.task import seeded_poses

# In an ordinary pose the longest radius is drawn as this share of the arm's reach.
SHARE = {'linear': 0.3, 'angular': 0.15}
# Number of poses whose median is ordinary.
POSES = 200


class Ellipsoid(NamedTuple):
    """
    An ellipsoid of tool velocities.

    Attributes
    ----------
    axes : shape (3, 3)
        Columns are unit vectors in the base frame, right-handed: left singular vectors.
    radii : shape (3,), m/s or rad/s by rad/s or m/s
        Singular values, descending; 0 for directions that are lost.
    """

    axes: Floats
    radii: Floats


class EllipsoidScales(NamedTuple):
    """The length in m that a radius of 1 is drawn with, for each block of the Jacobian."""

    linear: float
    angular: float


def ellipsoid_of(block: Floats) -> Ellipsoid:
    """Return the ellipsoid of three rows of a Jacobian, shape (3, n)."""
    U, sigma, _ = np.linalg.svd(block)
    if np.linalg.det(U) < 0.0:
        U[:, 2] = -U[:, 2]  # an axis is a line, but a rotation must not mirror
    radii = np.zeros(3)
    radii[: len(sigma)] = sigma[:3]
    return Ellipsoid(U, radii)


@lru_cache(maxsize=8)
def ellipsoid_scales(robot: Robot, size: float) -> EllipsoidScales:
    """
    Return the scales that suit an arm of a size (m): constant, so that changes of size are
    visible.
    """
    q = closed_poses(robot.chain, seeded_poses(robot.limits, robot.prismatic)[:POSES])
    J = evaluate(robot, q).jacobian

    def scale(block: Floats, share: float) -> float:
        longest = float(np.median(np.linalg.svd(block, compute_uv=False)[:, 0]))
        return share * size / longest if longest > 0.0 else share * size

    return EllipsoidScales(scale(J[:, :3], SHARE['linear']), scale(J[:, 3:], SHARE['angular']))
