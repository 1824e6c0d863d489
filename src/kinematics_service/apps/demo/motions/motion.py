# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define joint motions of a simulated arm, and the limits of their positions and speeds."""

from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot

# Smallest distance of a path from a position limit of a joint, divided by the range between the
# limits.
MARGIN_RATIO = 0.05
# Smallest distance (rad or m) of a path from the position limit of a joint with only one limit.
ONE_SIDED_MARGIN = 0.05
# Largest speed of a joint on a path, divided by its velocity limit.
SPEED_RATIO = 0.5


class JointMotion(NamedTuple):
    """Joint positions (..., n) in rad or m, and velocities (..., n) in rad/s or m/s."""

    q: Floats
    qdot: Floats


def inside_limits(robot: Robot) -> Floats:
    """Return the position limits of a robot, narrowed by a margin, shape (n, 2), rad or m."""
    low, high = np.array(robot.limits[:, 0]), np.array(robot.limits[:, 1])
    both = np.isfinite(high - low)
    margin = np.where(both, MARGIN_RATIO * np.where(both, high - low, 0.0), ONE_SIDED_MARGIN)
    return np.stack([low + margin, high - margin], axis=1)


def allowed_speeds(robot: Robot) -> Floats:
    """
    Return the largest speed of each joint on a path, (n,), rad/s or m/s; inf without a limit.
    """
    return SPEED_RATIO * robot.velocity_limits
