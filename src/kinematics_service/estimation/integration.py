# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Integrate the velocities of messages that have no positions, by the trapezoidal rule."""

import math
from collections.abc import Sequence

import numpy as np

from ..kernel import Floats, Integers, OurJoints
from ..robot.file.parts.joints import FASTEST_JOINT
from ..robot.robot import Robot
from .joint_memory import NamedJoints
from .joint_sample import JointSample

# A velocity above the joint's velocity limit times this factor is refused. The factor is above 1,
# because encoder noise may exceed the limit.
LIMIT_MARGIN = 1.1


class Integration:
    """
    Integrates joint velocities to positions by the trapezoidal rule, from the last reported
    positions.

    Parameters
    ----------
    robot
        The arm.
    """

    def __init__(self, robot: Robot) -> None:
        self._seconds = np.zeros(robot.dof)
        self._squares = np.zeros(robot.dof)  # sum of squared time steps of each joint, s^2
        limits = robot.velocity_limits
        self._fastest = np.where(np.isfinite(limits), LIMIT_MARGIN * limits, FASTEST_JOINT)

    @property
    def seconds(self) -> float:
        """
        Return how long velocities have been integrated since the last reported position, s; the
        maximum over all joints.
        """
        return float(self._seconds.max())

    def deviation(self, robot: Robot) -> float | None:
        """
        Return the largest standard deviation of an integrated position, rad or m; None without
        `velocity_noise` in the robot file.
        """
        uncertainty = robot.description.uncertainty
        if uncertainty is None or uncertainty.velocity_noise is None:
            return None
        # The velocity errors of messages are taken as independent, so the variances of the
        # positions add up.
        return float(np.max(np.array(uncertainty.velocity_noise) * np.sqrt(self._squares)))

    def forget(self, joints: slice | Integers = slice(None)) -> None:
        """
        Restart the integration of `joints` with time 0, because a message has reported their
        positions.
        """
        self._seconds[joints] = self._squares[joints] = 0.0

    def too_fast(self, velocities: Floats, names: Sequence[str], ours: OurJoints) -> str:
        """
        Return an error sentence if a velocity is too large to integrate, otherwise ''. NaN is
        accepted.

        A velocity is too large if it exceeds LIMIT_MARGIN times the velocity limit of the joint.
        If the robot file has no limit, a velocity above `FASTEST_JOINT` is too large. `names` are
        the names of the arm's joints.
        """
        for j, place in zip(*ours.table):
            if place < len(velocities) and abs(velocities[place]) > self._fastest[j]:
                return (
                    f'velocity of joint {names[j]!r} is {velocities[place]:.6g}; '
                    f'at most {self._fastest[j]:.6g} is integrated'
                )
        return ''

    def positions(
        self, sample: JointSample, velocities: Floats, memory: NamedJoints, ours: OurJoints
    ) -> Floats | None:
        """
        Return integrated positions for a message without positions: one position for each joint
        name of the message.

        Returns None in three cases. A joint of the arm in the message has no position yet, or a
        stale one. A velocity is not finite. The stamp is missing or does not advance.

        Parameters
        ----------
        sample, velocities
            The message, and its velocities as an array, rad/s or m/s.
        memory
            The memory of the arm's joints.
        ours
            Indices of the arm's joints in the message.
        """
        columns, (joints, places) = memory.columns, ours.table
        steps = (sample.stamp - columns.stamp[joints]) * 1e-9
        usable = columns.known[joints].all() and columns.stamped[joints].all()
        if not (usable and sample.stamp and (steps > 0.0).all()):
            return None
        if steps.max() * 1e9 > memory.timeout or len(velocities) != len(sample.names):
            return None
        now, before = velocities[places], columns.velocity[joints]
        positions = np.zeros(len(sample.names))
        mean = 0.5 * (now + np.where(np.abs(before) <= self._fastest[joints], before, now))
        positions[places] = columns.position[joints] + mean * steps
        if not all(map(math.isfinite, positions[places])):
            return None
        self._seconds[joints] += steps
        self._squares[joints] += steps * steps
        return positions
