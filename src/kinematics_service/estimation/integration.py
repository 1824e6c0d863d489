"""Positions of joints whose messages have velocities alone, by the trapezoidal rule."""

import math
from collections.abc import Sequence

import numpy as np

from ..kernel import Floats, Integers, OurJoints
from ..robot.file.parts.joints import FASTEST_JOINT
from ..robot.robot import Robot
from .joint_memory import NamedJoints
from .joint_sample import JointSample

# A reported velocity may exceed the joint's limit by this factor: encoders are noisy.
LIMIT_MARGIN = 1.1


class Integration:
    """
    Counts on from the last reported positions of the joints by the trapezoidal rule.

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
        """Return the time counted on since positions were reported, where it is longest, s."""
        return float(self._seconds.max())

    def deviation(self, robot: Robot) -> float | None:
        """
        Return the largest standard deviation that has come of it, rad or m; None where the file of
        the arm does not say the noise of velocities.
        """
        said = robot.description.uncertainty
        if said is None or said.velocity_noise is None:
            return None
        # Errors of messages add up as if they were independent, each over its step of time.
        return float(np.max(np.array(said.velocity_noise) * np.sqrt(self._squares)))

    def forget(self, joints: slice | Integers = slice(None)) -> None:
        """Begin at positions that a message has reported."""
        self._seconds[joints] = self._squares[joints] = 0.0

    def too_fast(self, velocities: Floats, names: Sequence[str], ours: OurJoints) -> str:
        """
        Return which joint moves faster than its limit; empty if none does, and for NaN.

        A joint without a limit in the robot file may move with `FASTEST_JOINT`. `names` are those
        of the arm's joints.
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
        Return positions for a message without any, one for each of its names.

        None where a joint of the arm in it has no position to begin with, or none that is not
        stale; where a velocity is no number; where a stamp is missing or does not advance.

        Parameters
        ----------
        sample, velocities
            The message and its velocities.
        memory
            What is known of the joints.
        ours
            Those that are in the message.
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
