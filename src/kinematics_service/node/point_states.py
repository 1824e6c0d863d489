# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the states of points other than the tool, for subscribers to their topics."""

import numpy as np

from ..estimation.estimator import EstimatorOutput
from ..kernel import Floats
from ..kinematics.tool_state import evaluate
from ..robot.robot import Robot


class PointStates:
    """
    Computes the states of points of the arm. The sign of a quaternion does not jump between two
    successive states of a point.
    """

    def __init__(self) -> None:
        self._last: dict[str, Floats] = {}

    def answer(self, of: str, robot: Robot, answer: EstimatorOutput) -> EstimatorOutput:
        """
        Return the state of a point of the arm, given the state of the tool.

        Parameters
        ----------
        of
            The name of the point.
        robot
            The arm.
        answer
            The tool's state, from which the joint positions and velocities are taken.
        """
        q, qdot = answer.state.q, answer.state.qdot
        state = evaluate(robot, q, qdot, point=robot.point(of))
        quaternion_xyzw = state.continuous_quaternion_xyzw
        last = self._last.get(of)
        if last is not None and np.dot(last, quaternion_xyzw) < 0.0:
            quaternion_xyzw *= -1.0
        self._last[of] = quaternion_xyzw
        return answer._replace(state=state)
