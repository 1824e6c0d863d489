# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Estimate joint accelerations: fit a straight line to the last velocities (least squares)."""

import numpy as np

from ..kernel import Floats, Integers
from ..robot.robot import Robot
from .estimator import EstimatorOutput, EstimatorSettings, JointMessage, StreamQuantity
from .joint_memory import NamedJoints

# Number of velocities that are kept for each joint. The acceleration is the slope of a straight
# line through the velocities within the time `acceleration_window`. If more than SAMPLE_COUNT
# velocities are within this time, only the last SAMPLE_COUNT are used.
SAMPLE_COUNT = 64


class JointAccelerations(StreamQuantity):
    """
    Estimates each joint's acceleration as the slope of a least-squares line through its last
    velocities.

    The slope is the acceleration half a window ago. The slope is exact if the acceleration changes
    at a constant rate and messages come at equal intervals. If N velocities in a window of T
    seconds have the standard deviation s (rad/s), the standard deviation of the slope is about 3.5
    s / (T sqrt(N)).

    Only reported velocities are used, because differences of positions would divide the noise of
    positions by the square of the time step. Velocities older than the window are left out, except
    the last two. All earlier velocities of a joint are forgotten if a stamp is older than the
    stamp before, or newer by more than the timeout.

    Attributes
    ----------
    delay
        For each joint, the velocities to which the line is fitted have a mean age. `delay` is the
        largest of the mean ages, s.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        super().__init__(robot, settings)
        joints = robot.dof
        self._stamps: Integers = np.zeros((SAMPLE_COUNT, joints), dtype=np.int64)
        self._velocities = np.zeros((SAMPLE_COUNT, joints))
        self._count: Integers = np.zeros(joints, dtype=np.int64)
        self._last: Integers = np.zeros(joints, dtype=np.int64)
        self._step: Integers = np.zeros(joints, dtype=np.int64)
        self.delay = 0.0

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """
        Return the joint accelerations after a message, rad/s^2 or m/s^2; None if one is unknown.
        """
        if answer.velocity_source != 'message':
            self._count[:] = 0
            return None
        return self.slope(joints.columns.stamp, joints.columns.velocity)

    def slope(self, stamps: Integers, qdot: Floats) -> Floats | None:
        """
        Return the slope of the last velocities of each joint, rad/s^2 or m/s^2. Returns None if a
        joint has only one velocity.

        Parameters
        ----------
        stamps : shape (n,), ns
            Stamp of each joint's last message; an unchanged stamp is not a new message.
        qdot : shape (n,), rad/s or m/s
            Velocity of each joint.
        """
        is_new = (stamps != self._last) | (self._count == 0)
        step = np.where(is_new, stamps - self._last, self._step)
        self._count[is_new & ((step <= 0) | (step > self.settings.timeout))] = 0
        (fresh,) = np.nonzero(is_new)
        at = self._count[fresh] % SAMPLE_COUNT
        self._stamps[at, fresh], self._velocities[at, fresh] = stamps[fresh], qdot[fresh]
        self._count[fresh] += 1
        self._last, self._step = stamps.copy(), step
        if self._count.min() < 2:
            return None
        age = stamps - self._stamps
        used = (np.arange(SAMPLE_COUNT)[:, None] < self._count) & (
            age <= np.maximum(self.settings.acceleration_window, step)
        )
        ages = age * 1e-9
        count = np.sum(used, axis=0)
        mean = np.sum(ages, axis=0, where=used) / count
        since = np.where(used, mean - ages, 0.0)
        # Subtract the last velocity from all: the slope does not change, and the round-off is
        # smaller.
        with np.errstate(over='ignore', invalid='ignore'):
            changes = self._velocities - qdot
            slope = np.sum(since * changes, axis=0) / np.sum(since * since, axis=0)
        self.delay = float(mean.max())
        return slope if np.isfinite(slope).all() else None
