# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the observation of an arm without a node."""

import numpy.typing as npt

from .... import kernel
from ....kinematics.singularity import singularity_of
from ....kinematics.tool_state import evaluate
from ....node.drawing.observation import Observation, observation_of
from ....robot.robot import Robot


def observe(robot: Robot, q: npt.ArrayLike, qdot: npt.ArrayLike | None = None) -> Observation:
    """
    Return the observation of an arm at joint positions q (n,), in rad and m.

    Raises
    ------
    JointVectorError
        `q` or `qdot` does not have n numbers, or a number is not finite.
    """
    state = evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    return observation_of(state, singularity_of(state))
