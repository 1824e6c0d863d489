"""Integrate velocities of messages without positions, by the trapezoidal rule."""

import math
from collections.abc import Sequence

import numpy as np

from ..kernel import Floats, Integers, OurJoints
from ..robot.file.parts.joints import FASTEST_JOINT
from ..robot.robot import Robot
from .joint_memory import NamedJoints
from .joint_sample import JointSample

# Largest ratio of a reported velocity to the joint's limit: encoders are noisy.
LIMIT_MARGIN = 1.1


class Integration:
    """
    Integrates from the last reported positions of the joints by the trapezoidal rule.

    Parameters
    ----------
    robot
        The arm.
    """

    def __init__(self, robot: Robot) -> None:
        self._seconds = np.zeros(robot.dof)
        self._squares = np.zeros(robot.dof)  # of the steps of time, summed
        limits = robot.velocity_limits
        self._fastest = np.where(np.isfinite(limits), LIMIT_MARGIN * limits, FASTEST_JOINT)

    @property
    def seconds(self) -> float:
        """Return the longest time of integration since a joint's last reported position, s."""
        return float(self._seconds.max())

    def deviation(self, robot: Robot) -> float | None:
        """
        Return the largest standard deviation of an integrated position, rad or m; None without
        `velocity_noise` in the robot file.
        """
        said = robot.description.uncertainty
        if said is None or said.velocity_noise is None:
            return None
        # Errors of messages are taken as independent, each over its time step.
        return float(np.max(np.array(said.velocity_noise) * np.sqrt(self._squares)))

    def forget(self, joints: slice | Integers = slice(None)) -> None:
        """Start again at positions that a message has reported."""
        self._seconds[joints] = self._squares[joints] = 0.0

    def too_fast(self, velocities: Floats, names: Sequence[str], ours: OurJoints) -> str:
        """
        Return a sentence if a joint moves faster than its limit; empty otherwise, and for NaN.

        The limit of a joint without one in the robot file is `FASTEST_JOINT`. `names` are the
        names of the arm's joints.
        """
        for j, place in zip(*ours.table):
            if place < len(velocities) and abs(velocities[place]) > self._fastest[j]:
                return (
                    f'velocity of joint {names[j]!r} is {velocities[place]:.6g}: '
                    f'at most {self._fastest[j]:.6g} is integrated'
                )
        return ''

    def positions(
        self, sample: JointSample, velocities: Floats, memory: NamedJoints, ours: OurJoints
    ) -> Floats | None:
        """
        Return positions for a message without positions, one for each of its names.

        None if a joint of the arm in it has no position yet, or a stale one; if a velocity is not
        finite; or if its stamp is missing or does not advance.

        Parameters
        ----------
        sample, velocities
            The message and its velocities.
        memory
            The memory of the joints.
        ours
            The arm's joints in the message.
        """
        columns, (joints, places) = memory.columns, ours.table
        steps = (sample.stamp - columns.stamp[joints]) * 1e-9
        usable = columns.known[joints].all() and columns.stamped[joints].all()
        if not (usable and sample.stamp and (steps > 0.0).all()):
            return None
        if steps.max() * 1e9 > memory.timeout or len(velocities) != len(sample.names):
            return None
        now, before = velocities[places], columns.velocity[joints]
        found = np.zeros(len(sample.names))
        mean = 0.5 * (now + np.where(np.abs(before) <= self._fastest[joints], before, now))
        found[places] = columns.position[joints] + mean * steps
        if not all(map(math.isfinite, found[places])):
            return None
        self._seconds[joints] += steps
        self._squares[joints] += steps * steps
        return found
