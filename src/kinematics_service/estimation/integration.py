"""Positions of joints whose messages have velocities alone, counted on from the last ones."""

import math

import numpy as np

from ..kernel import Floats, Integers, OurJoints
from ..robot.robot import Robot
from .joint_memory import NamedJoints
from .joint_sample import JointSample


class Integration:
    """
    Counts on from the last reported positions of the joints by the trapezoidal rule.

    Parameters
    ----------
    joints
        Their number.
    """

    def __init__(self, joints: int) -> None:
        self._seconds = np.zeros(joints)
        self._squares = np.zeros(joints)  # of the steps of time, summed

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
        mean = 0.5 * (now + np.where(np.isfinite(before), before, now))
        found[places] = columns.position[joints] + mean * steps
        if not all(map(math.isfinite, found[places])):
            return None
        self._seconds[joints] += steps
        self._squares[joints] += steps * steps
        return found
