"""What is known of each joint: its position, its velocity, and when it was heard."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kernel import Floats, JointMemory, OurJoints
from ..robot.robot import Robot

# Number of lists of names kept: a topic has few drivers, and names must not pile up.
MOST_LISTS = 16

# Disagreements older than this are forgotten.
DISPUTE_WINDOW = 2_000_000_000

# Limits are compared with this tolerance: encoders round, and a joint at its stop is not beyond
# it.
LIMIT_SLACK = 1e-6

# Columns of the memory with what messages have said of a joint.
PER_JOINT = (
    *('position', 'before', 'velocity', 'differenced', 'known', 'stamped', 'stamp', 'arrival'),
    *('jump_count', 'jumps'),
)


class MessageJoints(NamedTuple):
    """
    The arm's joints in a message with certain names.

    Attributes
    ----------
    ours
        Their indices in the arm and in the message, as the kernel takes them.
    duplicates
        Names of those that occur twice in it.
    """

    ours: OurJoints
    duplicates: tuple[str, ...]


def joint_names(robot: Robot, prefix: str) -> tuple[str, ...]:
    """Return the names of the joints in messages."""
    return tuple(prefix + name for name in robot.joint_names)


def _closure_width(robot: Robot) -> int:
    closure = robot.chain.closure
    return 0 if closure is None else closure.width


class NamedJoints(JointMemory):
    """
    What is known of each joint of an arm by its name: what `kernel.observe` writes.

    Parameters
    ----------
    robot
        The arm.
    prefix
        Put before the joint names of the robot file.
    source
        kernel.AUTO, FROM_MESSAGE or FROM_DIFFERENCE: where velocities come from.
    timeout : ns
        A joint without a position for longer is missing; stamps that step back by more start a new
        time.
    """

    def __init__(self, robot: Robot, prefix: str, source: int, timeout: int) -> None:
        super().__init__(robot.dof, _closure_width(robot))
        self.names = joint_names(robot, prefix)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._lists: dict[tuple[str, ...], MessageJoints] = {}
        self.configure(robot, source, timeout)

    def configure(self, robot: Robot, source: int, timeout: int) -> None:
        """Apply other settings; the joints' states are kept."""
        self.velocity_source = source
        # Stamps are far below 2^62 ns, 146 years; their differences must fit too.
        self.timeout = min(timeout, 2**62)
        self.columns.wraps[:] = robot.continuous

    def remember(self, former: 'NamedJoints') -> None:
        """Take over the states of the joints that have the same names of another arm."""
        ours, theirs = self.columns, former.columns
        for j, name in enumerate(self.names):
            k = former._index.get(name)
            if k is not None:
                for column in PER_JOINT:
                    getattr(ours, column)[j] = getattr(theirs, column)[k]

    def joint_vectors(self) -> tuple[Floats, Floats | None] | None:
        """
        Return positions (n,) and velocities (n,), None for those that are not all known; None if
        not even the positions are.
        """
        if not self.columns.known.all():
            return None
        qdot = self.columns.velocity.copy()
        return self.columns.position.copy(), None if np.isnan(qdot).any() else qdot

    def positions(self) -> Floats:
        """Return the joint positions that are known, shape (n,); NaN for the others."""
        return self.columns.position.copy()

    def fits(self, robot: Robot) -> bool:
        """Return whether the memory is of an arm with loops as this one has."""
        return self.closure == _closure_width(robot)

    def joints_in(self, names: Sequence[str]) -> MessageJoints:
        """Return the joints of the arm in a message with these names."""
        key = tuple(names)
        found = self._lists.get(key)
        if found is not None:
            return found
        joints: list[int] = []
        indices: list[int] = []
        duplicates: list[str] = []
        for index, name in enumerate(key):
            j = self._index.get(name)
            if j is None:
                continue
            if j in joints:
                duplicates.append(name)
            joints.append(j)
            indices.append(index)
        ours = OurJoints(np.array(joints, dtype=np.int64), np.array(indices, dtype=np.int64))
        found = MessageJoints(ours, tuple(duplicates))
        if len(self._lists) >= MOST_LISTS:
            self._lists.pop(next(iter(self._lists)))
        if len(key) <= 8 * len(self.names) + 256:  # a hostile list of names is not worth keeping
            self._lists[key] = found
        return found

    def unmatched(self) -> tuple[tuple[str, ...], ...]:
        """Return the lists of names heard, if none of them has a joint of the arm."""
        has_ours = any(found.ours.count for found in self._lists.values())
        return () if has_ours else tuple(self._lists)

    def newest(self) -> int | None:
        """Return the latest time (ns) for which a joint is known, None if there is none."""
        known = self.columns.known != 0
        return int(self.columns.stamp[known].max()) if known.any() else None

    def missing(self, arrival: int, timeout: int) -> tuple[str, ...]:
        """Return the names of joints not heard within `timeout` before `arrival` (ns)."""
        heard = self.columns.arrival.tolist()
        known = self.columns.known.tolist()
        return tuple(
            name
            for name, at, ever in zip(self.names, heard, known)
            if not ever or arrival - at > timeout
        )

    def age(self, arrival: int) -> float:
        """Return the age in seconds of the oldest joint position, inf if a joint has none."""
        if not self.columns.known.all():
            return math.inf
        return (arrival - int(self.columns.arrival.min())) * 1e-9

    def beyond(self, limits: Floats) -> tuple[str, ...]:
        """Return the names of known joints outside limits (n, 2)."""
        return tuple(
            name
            for name, position, (low, high) in zip(
                self.names, self.columns.position.tolist(), limits.tolist()
            )
            if position < low - LIMIT_SLACK or position > high + LIMIT_SLACK
        )

    def disputed(self, arrival: int, jumps: int) -> tuple[str, ...]:
        """Return the names of joints that jumped at least `jumps` times within DISPUTE_WINDOW."""
        counts = self.columns.jump_count.tolist()
        times = self.columns.jumps.tolist()
        return tuple(
            name
            for name, count, all_times in zip(self.names, counts, times)
            if sum(arrival - time < DISPUTE_WINDOW for time in all_times[:count]) >= jumps
        )
