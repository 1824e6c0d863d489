"""What is known of each joint: its position, its velocity, and when it was heard."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import kernel
from ..kernel import Floats, JointMemory, OurJoints
from ..robot.robot import Robot

# Number of layouts kept: a topic has few drivers, and names must not pile up.
LAYOUTS = 16

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


class JointLayout(NamedTuple):
    """
    Where a message with certain names has the joints of the arm.

    Attributes
    ----------
    joints, places
        The arm's joints in the message (index in the arm), and their index in the message.
    duplicates
        Names of the arm's joints that occur twice in it.
    ours
        Joints and indices as the kernel takes them.
    """

    joints: tuple[int, ...]
    indices: tuple[int, ...]
    duplicates: tuple[str, ...]
    ours: OurJoints


def joint_names(robot: Robot, prefix: str) -> tuple[str, ...]:
    """Return the names of the joints in messages."""
    return tuple(prefix + name for name in robot.joint_names)


def _closure_width(robot: Robot) -> int:
    closure = robot.chain.closure
    return 0 if closure is None else closure.width


class JointTable:
    """
    What is known of each joint of an arm: the estimator's memory, and the questions to it.

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

    Attributes
    ----------
    memory
        What `kernel.observe` writes.
    """

    def __init__(self, robot: Robot, prefix: str, source: int, timeout: int) -> None:
        self.names = joint_names(robot, prefix)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._layouts: dict[tuple[str, ...], JointLayout] = {}
        self.memory = JointMemory(len(self.names), _closure_width(robot))
        self._columns = self.memory.columns
        self.configure(robot, source, timeout)

    def configure(self, robot: Robot, source: int, timeout: int) -> None:
        """Apply other settings; the joints' states are kept."""
        self.memory.velocity_source = source
        # Stamps are far below 2^62 ns, 146 years; their differences must fit too.
        self.memory.timeout = min(timeout, 2**62)
        self._columns.wraps[:] = robot.continuous

    def remember(self, former: 'JointTable') -> None:
        """Take over the states of the joints that have the same names in another table."""
        ours, theirs = self._columns, former._columns
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
        if not self._columns.known.all():
            return None
        qdot = self._columns.velocity.copy()
        return self._columns.position.copy(), None if np.isnan(qdot).any() else qdot

    def positions(self) -> Floats:
        """Return the joint positions that are known, shape (n,); NaN for the others."""
        return self._columns.position.copy()

    def fits(self, robot: Robot) -> bool:
        """Return whether the memory is of an arm with loops as this one has."""
        return self.memory.closure == _closure_width(robot)

    def forget_loops(self) -> None:
        """Let the loops be closed from their known position."""
        self.memory.is_closed = False

    def forget(self) -> None:
        """Forget the states of all joints."""
        kernel.forget(self.memory)

    def forget_tool(self) -> None:
        """Let the sign of the next quaternion be free."""
        self.memory.is_new_tool = True

    def layout(self, names: Sequence[str]) -> JointLayout:
        """Return where a message with these names has the joints of the arm."""
        key = tuple(names)
        layout = self._layouts.get(key)
        if layout is not None:
            return layout
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
        layout = JointLayout(tuple(joints), tuple(indices), tuple(duplicates), ours)
        if len(self._layouts) >= LAYOUTS:
            self._layouts.pop(next(iter(self._layouts)))
        if len(key) <= 8 * len(self.names) + 256:  # a hostile list of names is not worth keeping
            self._layouts[key] = layout
        return layout

    def newest(self) -> int | None:
        """Return the latest time (ns) for which a joint is known, None if there is none."""
        known = self._columns.known != 0
        return int(self._columns.stamp[known].max()) if known.any() else None

    def missing(self, arrival: int, timeout: int) -> tuple[str, ...]:
        """Return the names of joints not heard within `timeout` before `arrival` (ns)."""
        heard = self._columns.arrival.tolist()
        known = self._columns.known.tolist()
        return tuple(
            name
            for name, at, ever in zip(self.names, heard, known)
            if not ever or arrival - at > timeout
        )

    def age(self, arrival: int) -> float:
        """Return the age in seconds of the oldest joint position, inf if a joint has none."""
        if not self._columns.known.all():
            return math.inf
        return (arrival - int(self._columns.arrival.min())) * 1e-9

    def beyond(self, limits: Floats) -> tuple[str, ...]:
        """Return the names of known joints outside limits (n, 2)."""
        return tuple(
            name
            for name, position, (low, high) in zip(
                self.names, self._columns.position.tolist(), limits.tolist()
            )
            if position < low - LIMIT_SLACK or position > high + LIMIT_SLACK
        )

    def disputed(self, arrival: int, jumps: int) -> tuple[str, ...]:
        """Return the names of joints that jumped at least `jumps` times within DISPUTE_WINDOW."""
        counts = self._columns.jump_count.tolist()
        times = self._columns.jumps.tolist()
        return tuple(
            name
            for name, count, all_times in zip(self.names, counts, times)
            if sum(arrival - time < DISPUTE_WINDOW for time in all_times[:count]) >= jumps
        )
