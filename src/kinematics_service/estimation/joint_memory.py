# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Keep the last position, velocity, stamp and time of arrival of each joint, by joint name."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kernel import Floats, JointMemory, OurJoints
from ..robot.robot import Robot

# Number of different lists of joint names that are remembered. Each driver has one list, and a
# topic has few drivers.
MAX_LISTS = 16

# Jumps of a joint's position within this time are counted together, ns. Several jumps mean that
# two drivers send different positions.
DISPUTE_WINDOW = 2_000_000_000
# A joint is disputed between drivers if its position jumps at least this number of times within
# DISPUTE_WINDOW.
JUMPS = 4

# A joint that exceeds its limit by at most this, rad or m, is taken as inside, because encoders
# round the position of a joint at its limit.
LIMIT_TOLERANCE = 1e-6

# Columns of `JointMemory` that are kept for a joint if the node replaces the arm by another arm
# with a joint of the same name.
JOINT_COLUMNS = (
    *('position', 'before', 'velocity', 'differenced', 'known', 'stamped', 'stamp', 'arrival'),
    *('jump_count', 'jumps'),
)


class MessageJoints(NamedTuple):
    """
    The indices of the arm's joints in messages with one list of joint names.

    Attributes
    ----------
    ours
        For each of the arm's joints in the message, its index in the arm and its index in the
        message.
    duplicates
        Names of the arm's joints that occur more than once in the message.
    """

    ours: OurJoints
    duplicates: tuple[str, ...]


def joint_names(robot: Robot, prefix: str) -> tuple[str, ...]:
    """Return the joint names that messages must have: `prefix` and the name in the robot file."""
    return tuple(prefix + name for name in robot.joint_names)


def _closure_width(robot: Robot) -> int:
    closure = robot.chain.closure
    return 0 if closure is None else closure.width


class NamedJoints(JointMemory):
    """
    Stores the last position, velocity and times of each joint of an arm, by joint name.

    The function `kernel.observe` writes into this memory.

    Parameters
    ----------
    robot
        The arm.
    prefix
        Text that messages have before each joint name of the robot file.
    source
        Source of velocities: kernel.AUTO, FROM_MESSAGE or FROM_DIFFERENCE.
    timeout : ns
        A joint is missing if its last position is older than `timeout`. If stamps step back by
        more than `timeout`, all joints are forgotten.
    """

    def __init__(self, robot: Robot, prefix: str, source: int, timeout: int) -> None:
        super().__init__(robot.dof, _closure_width(robot))
        self.names = joint_names(robot, prefix)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._lists: dict[tuple[str, ...], MessageJoints] = {}
        self.configure(robot, source, timeout)

    def configure(self, robot: Robot, source: int, timeout: int) -> None:
        """Apply new settings and keep the joint positions."""
        self.velocity_source = source
        # Limit the timeout to 2^62 ns (146 years), so that differences of stamps do not overflow.
        self.timeout = min(timeout, 2**62)
        self.columns.wraps[:] = robot.continuous

    def remember(self, former: 'NamedJoints') -> None:
        """
        Copy the positions, velocities and stamps of joints with equal names from another arm's
        memory.
        """
        ours, theirs = self.columns, former.columns
        for j, name in enumerate(self.names):
            k = former._index.get(name)
            if k is not None:
                for column in JOINT_COLUMNS:
                    getattr(ours, column)[j] = getattr(theirs, column)[k]

    def joint_vectors(self) -> tuple[Floats, Floats | None] | None:
        """
        Return positions (n,) and velocities (n,) of the joints, or None if a position is unknown.

        The velocities are None if a velocity is unknown.
        """
        if not self.columns.known.all():
            return None
        qdot = self.columns.velocity.copy()
        return self.columns.position.copy(), None if np.isnan(qdot).any() else qdot

    def positions(self) -> Floats:
        """Return the last joint positions, shape (n,), rad or m; NaN for unknown positions."""
        return self.columns.position.copy()

    def fits(self, robot: Robot) -> bool:
        """Return whether the memory has as many numbers for closed loops as `robot` needs."""
        return self.closure == _closure_width(robot)

    def joints_in(self, names: Sequence[str]) -> MessageJoints:
        """Return the indices of the arm's joints in a message with the joint names `names`."""
        key = tuple(names)
        entry = self._lists.get(key)
        if entry is not None:
            return entry
        indices = [index for index, name in enumerate(key) if name in self._index]
        named = [key[index] for index in indices]
        joints = np.array([self._index[name] for name in named], dtype=np.int64)
        ours = OurJoints(joints, np.array(indices, dtype=np.int64))
        duplicates = (name for k, name in enumerate(named) if named.index(name) < k)
        entry = MessageJoints(ours, tuple(duplicates))
        if len(self._lists) >= MAX_LISTS:
            self._lists.pop(next(iter(self._lists)))
        if len(key) <= 8 * len(self.names) + 256:  # do not cache huge lists
            self._lists[key] = entry
        return entry

    def unmatched(self) -> tuple[tuple[str, ...], ...]:
        """
        Return the joint-name lists of the messages if none of the lists names a joint of the arm.
        Returns an empty tuple otherwise.
        """
        has_ours = any(entry.ours.count for entry in self._lists.values())
        return () if has_ours else tuple(self._lists)

    def newest(self) -> int | None:
        """Return the latest stamp of all joints, ns; None if no joint position is known."""
        known = self.columns.known != 0
        return int(self.columns.stamp[known].max()) if known.any() else None

    def missing(self, arrival: int) -> tuple[str, ...]:
        """
        Return the names of the joints that were in no message within the timeout before `arrival`
        (steady clock, ns).
        """
        columns = zip(self.names, self.columns.arrival.tolist(), self.columns.known.tolist())
        return tuple(
            name for name, at, known in columns if not known or arrival - at > self.timeout
        )

    def age(self, arrival: int) -> float:
        """Return the age of the oldest joint position, s; inf if a joint has no position yet."""
        if not self.columns.known.all():
            return math.inf
        return (arrival - int(self.columns.arrival.min())) * 1e-9

    def beyond(self, limits: Floats) -> tuple[str, ...]:
        """
        Return the names of joints whose positions are outside `limits`, shape (n, 2), rad or m.
        """
        columns = zip(self.names, self.columns.position.tolist(), limits.tolist())
        return tuple(
            name
            for name, position, (low, high) in columns
            if position < low - LIMIT_TOLERANCE or position > high + LIMIT_TOLERANCE
        )

    def disputed(self, arrival: int) -> tuple[str, ...]:
        """
        Return the names of joints whose positions jumped at least JUMPS times within
        DISPUTE_WINDOW before `arrival`.
        """
        columns = zip(self.names, self.columns.jump_count.tolist(), self.columns.jumps.tolist())
        return tuple(
            name
            for name, count, times in columns
            if sum(arrival - time < DISPUTE_WINDOW for time in times[:count]) >= JUMPS
        )
