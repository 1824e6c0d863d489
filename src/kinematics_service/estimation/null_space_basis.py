"""Compute a basis of the task's null space after each message, continuous over time."""

from ..kernel import Floats
from ..kinematics.null_space import basis_of
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity
from .joint_memory import NamedJoints


class NullSpaceBasis(StreamQuantity):
    """
    A basis of the joint motions that leave the task's rows at rest, shape (n, k): at each message
    the basis nearest to the one before.
    """

    _last: Floats | None = None

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """Apply new settings; another chain starts with a new basis."""
        if robot.chain is not self.robot.chain:
            self._last = None
        super().configure(robot, settings)

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """Return the basis (n, k) at a new state."""
        state = answer.state
        self._last = basis_of(state.robot.singularity.task, state.jacobian, self._last)
        return self._last
