"""The states of points at the joint positions of an answer; computed where somebody listens."""

import numpy as np

from ..estimation.estimator import EstimatorOutput
from ..kernel import Floats
from ..kinematics.tool_state import evaluate_point
from ..robot.robot import Robot


class PointStates:
    """Makes of an answer about the tool that about a point; remembers signs of quaternions."""

    def __init__(self) -> None:
        self._last: dict[str, Floats] = {}

    def answer(self, of: str, robot: Robot, answer: EstimatorOutput) -> EstimatorOutput:
        """
        Return the same answer with a point in the place of the tool.

        Parameters
        ----------
        of
            The name of the point.
        robot
            The arm.
        answer
            The answer about the tool.
        """
        state = evaluate_point(robot, robot.point(of), answer.state.q, answer.state.qdot)
        quaternion_xyzw = state.continuous_quaternion_xyzw
        last = self._last.get(of)
        if last is not None and np.dot(last, quaternion_xyzw) < 0.0:
            quaternion_xyzw *= -1.0
        self._last[of] = quaternion_xyzw
        return answer._replace(state=state)
