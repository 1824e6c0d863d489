# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find singular poses of an arm inside joint limits, by Newton's method from seeded random poses.
"""

import numpy as np

from ..kernel import Floats
from ..robot.robot import Robot
from ..robot.task import seeded_poses
from .singularity import singularity

# Number of seeded random poses from which Newton's method searches singular poses.
STARTS = 200
# Number of steps of Newton's method from each start. Newton's method converges quadratically, so a
# start that has not converged after these steps has come to a joint limit, which it cannot pass.
STEPS = 25
# Largest motion of a joint in one Newton step toward a singular pose, rad (prismatic joints
# divided by the characteristic length).
MAX_STEP = 0.3
# A pose is taken as singular if its distance from a singular pose is below this, rad. This
# distance is far below the resolution of encoders.
SINGULAR_DISTANCE = 1e-6


def singular_poses(robot: Robot, inside: Floats) -> Floats:
    """
    Return joint positions (k, n) of singular poses, rad or m; k is 0 if none was found.

    Equal arguments give equal results.

    For an arm with closed loops k is always 0.

    Parameters
    ----------
    robot
        The arm; its task defines singular poses.
    inside : shape (n, 2), rad or m
        Joint limits; the function returns only poses inside these limits. Infinite for joints
        without limits.
    """
    if robot.chain.loops:
        # Newton's method is not possible: after a Newton step the loops may be open.
        return np.empty((0, robot.dof))
    q = seeded_poses(inside, robot.prismatic)[:STARTS]
    scale = np.where(robot.prismatic, robot.singularity.task.length, 1.0)
    for _ in range(STEPS):
        near = singularity(robot, q)
        # The motion -step leads from q to the nearest singular pose that was found. If none was
        # found, the motion -step is opposite to `way_out` and has the length `distance`. `way_out`
        # is the direction of the gradient of ln w, where w is the manipulability. To first order,
        # w is 0 after this motion.
        finite = np.isfinite(near.nearest_singular)
        step = np.where(finite, q - near.nearest_singular, near.distance[:, None] * near.way_out)
        fastest = np.max(np.abs(step) / scale, axis=1, keepdims=True)
        shorter = MAX_STEP / np.maximum(fastest, MAX_STEP)
        q = np.clip(q - shorter * step, inside[:, 0], inside[:, 1])
    distance = singularity(robot, q).distance
    return q[np.argsort(distance, kind='stable')][: int(np.sum(distance < SINGULAR_DISTANCE))]
