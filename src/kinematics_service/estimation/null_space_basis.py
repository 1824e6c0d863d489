# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute a basis of the null space of the task Jacobian after each message, continuous over time.
"""

from ..kernel import Floats
from ..kinematics.null_space import basis_of
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity
from .joint_memory import NamedJoints


class NullSpaceBasis(StreamQuantity):
    """
    Computes a basis (n, k) of the null space of the task Jacobian, continuous over time.

    A null space has many bases. `take` chooses the basis nearest to the one that it returned for
    the previous message.
    """

    _last: Floats | None = None

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """Apply new settings. If the chain changes, the last basis is forgotten."""
        if robot.chain is not self.robot.chain:
            self._last = None
        super().configure(robot, settings)

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """Return the null-space basis at the new state, shape (n, k)."""
        state = answer.state
        self._last = basis_of(state.robot.singularity.task, state.jacobian, self._last)
        return self._last
