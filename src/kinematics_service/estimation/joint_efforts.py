"""Joint efforts as messages report them, and the bias that is taken from them."""

from collections import deque

import numpy as np

from .. import kernel
from ..kernel import Floats, OurJoints
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity, doubles
from .joint_memory import NamedJoints

# The bias is the mean of the last so many messages.
AVERAGED = 100


class JointEfforts(StreamQuantity):
    """
    The last effort of each joint, less a bias, in N m or N.

    Attributes
    ----------
    efforts : shape (n,)
        NaN where the joint's last message has none, or one that is no number to compute with.
    bias : shape (n,)
        What `torques` are counted from; None until it is taken.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        super().__init__(robot, settings)
        self.efforts = np.full(robot.dof, np.nan)
        self.bias: Floats | None = None
        self._recent: deque[Floats] = deque(maxlen=AVERAGED)

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """Return the efforts less the bias, shape (n,); None where one is not known."""
        ours = joints.joints_in(message.names).ours
        self.note(ours, len(message.names), doubles(message.efforts))
        if np.isnan(self.efforts).any():
            return None
        return self.efforts if self.bias is None else self.efforts - self.bias

    def note(self, ours: OurJoints, names: int, efforts: Floats) -> None:
        """Note the efforts of a message of so many names, which has the arm's joints `ours`."""
        joints, places = ours.table
        told = efforts[places] if len(efforts) == names else np.full(len(joints), np.nan)
        # Copied: what has been handed out stays.
        self.efforts = self.efforts.copy()
        self.efforts[joints] = np.where(np.abs(told) <= kernel.LARGEST, told, np.nan)
        if np.isnan(self.efforts).any():
            self._recent.clear()
        else:
            self._recent.append(self.efforts)

    def take_bias(self) -> int:
        """Take the mean of the last messages as bias, and return their number; 0 for none."""
        if self._recent:
            self.bias = np.mean(self._recent, axis=0)
        return len(self._recent)
