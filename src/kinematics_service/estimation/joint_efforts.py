# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Subtract a bias from the joint efforts of messages. On request the mean of the last efforts becomes
the bias.
"""

from collections import deque

import numpy as np

from .. import kernel
from ..kernel import Floats, OurJoints
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity, doubles
from .joint_memory import NamedJoints

# Number of latest messages whose mean effort becomes the bias if the bias is requested.
AVERAGED = 100


class JointEfforts(StreamQuantity):
    """
    Remembers the last effort of each joint and subtracts a bias from it, N m or N.

    Attributes
    ----------
    efforts : shape (n,)
        Last efforts, N m or N; NaN if the joint's last message has no finite effort.
    bias : shape (n,)
        The bias, N m or N; None until `take_bias`.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        super().__init__(robot, settings)
        self.efforts = np.full(robot.dof, np.nan)
        self.bias: Floats | None = None
        self._recent: deque[Floats] = deque(maxlen=AVERAGED)

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """
        Return the joint efforts minus the bias, shape (n,), N m or N; None if an effort is
        unknown.
        """
        ours = joints.joints_in(message.names).ours
        self.note(ours, len(message.names), doubles(message.efforts))
        if np.isnan(self.efforts).any():
            return None
        return self.efforts if self.bias is None else self.efforts - self.bias

    def note(self, ours: OurJoints, names: int, efforts: Floats) -> None:
        """
        Store the efforts of a message that has `names` joint names; `ours` are the indices of the
        arm's joints in the message.
        """
        joints, places = ours.table
        new = efforts[places] if len(efforts) == names else np.full(len(joints), np.nan)
        # Copy the array before the change, because callers keep the earlier array.
        self.efforts = self.efforts.copy()
        self.efforts[joints] = np.where(np.abs(new) <= kernel.LARGEST, new, np.nan)
        if np.isnan(self.efforts).any():
            self._recent.clear()
        else:
            self._recent.append(self.efforts)

    def take_bias(self) -> int:
        """
        Set the bias to the mean effort of the last messages, and return the number of these
        messages.
        """
        if self._recent:
            self.bias = np.mean(self._recent, axis=0)
        return len(self._recent)
