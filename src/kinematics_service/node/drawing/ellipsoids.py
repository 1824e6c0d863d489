# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute manipulability ellipsoids: tool velocities for joint velocities with unit norm.

Three rows of the Jacobian map the unit ball of joint velocities to an ellipsoid. The radii are the
singular values of the three rows, the axes are the left singular vectors (Yoshikawa 1985).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...robot.closed_poses import closed_poses
from ...robot.robot import Robot
from ...robot.task import seeded_poses

# Drawn length of an ellipsoid's longest radius, divided by the arm's size. The length is a median
# over random configurations, because the radius changes with the configuration.
MEDIAN_RADII = {'linear': 0.3, 'angular': 0.15}
# Number of random configurations for the median of an ellipsoid's longest radius.
MEDIAN_POSES = 200


class Ellipsoid(NamedTuple):
    """
    A manipulability ellipsoid of tool velocities, from the three linear or angular rows of J.

    Attributes
    ----------
    axes : shape (3, 3)
        The principal axes, one in each column: unit vectors in the base frame. They are left
        singular vectors of the rows of J, with signs so that the three axes are right-handed.
    radii : shape (3,), m/s or rad/s per unit of joint velocity (rad/s or m/s)
        Singular values of the rows of J, largest first; 0 for a direction in which the tool cannot
        move.
    """

    axes: Floats
    radii: Floats


class EllipsoidScales(NamedTuple):
    """
    The lengths (m) that represent a singular value of 1 in a drawing, for linear and for angular
    rows of the Jacobian.
    """

    linear: float
    angular: float


def ellipsoid_of(block: Floats) -> Ellipsoid:
    """Return the manipulability ellipsoid of three rows of a Jacobian, shape (3, n)."""
    U, sigma, _ = np.linalg.svd(block)
    if np.linalg.det(U) < 0.0:
        U[:, 2] = -U[:, 2]  # reverse one axis, so that U is a rotation
    radii = np.zeros(3)
    radii[: len(sigma)] = sigma[:3]
    return Ellipsoid(U, radii)


@lru_cache(maxsize=8)
def ellipsoid_scales(robot: Robot, size: float) -> EllipsoidScales:
    """
    Return the drawing scales of the ellipsoids for an arm of a given size (m). The scales are
    constant for an arm, so that a drawing shows how the radii change.
    """
    q = closed_poses(robot.chain, seeded_poses(robot.limits, robot.prismatic)[:MEDIAN_POSES])
    J = evaluate(robot, q).jacobian

    def scale(block: Floats, fraction: float) -> float:
        longest = float(np.median(np.linalg.svd(block, compute_uv=False)[:, 0]))
        return fraction * size / longest if longest > 0.0 else fraction * size

    return EllipsoidScales(
        scale(J[:, :3], MEDIAN_RADII['linear']), scale(J[:, 3:], MEDIAN_RADII['angular'])
    )
