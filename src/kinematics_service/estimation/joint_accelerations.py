"""Joint accelerations from the velocities of the last messages."""

import numpy as np

from ..kernel import Floats, Integers
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity
from .joint_memory import NamedJoints

# Velocities kept of each joint: a window that has more of them is shortened.
KEPT = 64


class JointAccelerations(StreamQuantity):
    """
    The slope of the straight line that fits the last velocities of each joint best.

    It is the acceleration half a window ago, exact where the acceleration changes at a constant
    rate and messages come at one; noise of s (rad/s) in N velocities over a window of T seconds
    leaves about 3.5 s / (T sqrt(N)).

    They are of velocities that messages report: differences of positions differ by the noise of
    these over the square of the time between them. Velocities older than the window of the
    settings are left out, but for the last but one. A gap between stamps that is longer than the
    timeout, or a step back, starts a joint anew.

    Attributes
    ----------
    delay
        Mean age of the velocities of the last slope, of the joint where it is largest, s.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        super().__init__(robot, settings)
        joints = robot.dof
        self._stamps: Integers = np.zeros((KEPT, joints), dtype=np.int64)
        self._velocities = np.zeros((KEPT, joints))
        self._count: Integers = np.zeros(joints, dtype=np.int64)
        self._last: Integers = np.zeros(joints, dtype=np.int64)
        self._step: Integers = np.zeros(joints, dtype=np.int64)
        self.delay = 0.0

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """Return the accelerations, rad/s^2 or m/s^2; None if they are not known."""
        if answer.velocity_source != 'message':
            self._count[:] = 0
            return None
        return self.slope(joints.columns.stamp, joints.columns.velocity)

    def slope(self, stamps: Integers, qdot: Floats) -> Floats | None:
        """
        Return the accelerations, rad/s^2 or m/s^2; None where a joint has only one velocity.

        Parameters
        ----------
        stamps : shape (n,), ns
            Of each joint's last message: a joint without a new one has told nothing new.
        qdot : shape (n,), rad/s or m/s
            Its velocity.
        """
        told = (stamps != self._last) | (self._count == 0)
        step = np.where(told, stamps - self._last, self._step)
        self._count[told & ((step <= 0) | (step > self.settings.timeout))] = 0
        (fresh,) = np.nonzero(told)
        at = self._count[fresh] % KEPT
        self._stamps[at, fresh], self._velocities[at, fresh] = stamps[fresh], qdot[fresh]
        self._count[fresh] += 1
        self._last, self._step = stamps.copy(), step
        if self._count.min() < 2:
            return None
        age = stamps - self._stamps
        used = (np.arange(KEPT)[:, None] < self._count) & (
            age <= np.maximum(self.settings.acceleration_window, step)
        )
        ages = age * 1e-9
        count = np.sum(used, axis=0)
        mean = np.sum(ages, axis=0, where=used) / count
        since = np.where(used, mean - ages, 0.0)
        # Velocities from the last one on: what they have in common would only round.
        with np.errstate(over='ignore', invalid='ignore'):
            changes = self._velocities - qdot
            slope = np.sum(since * changes, axis=0) / np.sum(since * since, axis=0)
        self.delay = float(mean.max())
        return slope if np.isfinite(slope).all() else None
