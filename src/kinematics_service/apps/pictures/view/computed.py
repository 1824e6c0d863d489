# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the values that the live view shows, without a ROS node."""

import numpy.typing as npt

from .... import kernel
from ....kinematics.singularity import singularity_of
from ....kinematics.tool_state import evaluate
from ....node.drawing.observation import Observation, observation_of
from ....robot.robot import Robot


def observe(robot: Robot, q: npt.ArrayLike, qdot: npt.ArrayLike | None = None) -> Observation:
    """
    Return the values that the view shows for an arm at joint positions q (n,), rad or m.

    The values contain the tool's velocity if joint velocities qdot (n,), rad/s or m/s, are given.

    Raises
    ------
    JointVectorError
        `q` or `qdot` does not have n numbers, or a number is not finite.
    """
    state = evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    return observation_of(state, singularity_of(state))
