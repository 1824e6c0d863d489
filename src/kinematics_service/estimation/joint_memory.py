"""What is known of each joint: its position, its velocity, and when it was heard."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import kernel
from ..kernel import Floats, JointMemory, OurJoints
from ..robot.robot import Robot

# Layouts of message streams kept: drivers on one topic are few, and names must not pile up.
LAYOUTS = 16

# Disagreements older than this are forgotten.
DISPUTE_WINDOW = 2_000_000_000

# Limits are compared with this slack: encoders round, and a joint at its stop is not beyond it.
LIMIT_SLACK = 1e-6


class JointLayout(NamedTuple):
    """
    Where a message with certain names has our joints.

    Attributes
    ----------
    joints, places
        Our joints in the message (index in the arm), and their place in it.
    duplicates
        Names of our joints that stand in it twice.
    ours
        Joints and places as the kernel takes them.
    """

    joints: tuple[int, ...]
    indices: tuple[int, ...]
    duplicates: tuple[str, ...]
    ours: OurJoints


class JointTable:
    """
    What is known of each joint of an arm: the estimator's memory, and what is asked of it.

    Parameters
    ----------
    robot
        The arm.
    prefix
        Put before the joint names of the robot file.
    source
        kernel.AUTO, FROM_MESSAGE or FROM_DIFFERENCE: where velocities come from.
    timeout : ns
        A joint unheard for longer is missing; stamps that step back by more are a new start.

    Attributes
    ----------
    memory
        What `kernel.observe` writes.
    """

    def __init__(self, robot: Robot, prefix: str, source: int, timeout: int) -> None:
        self.names = tuple(prefix + name for name in robot.joint_names)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._layouts: dict[tuple[str, ...], JointLayout] = {}
        self.memory = JointMemory(len(self.names))
        self._columns = self.memory.columns
        self.configure(robot, source, timeout)

    def configure(self, robot: Robot, source: int, timeout: int) -> None:
        """Take other settings; what is known stays."""
        self.memory.velocity_source = source
        # Stamps are far below 2^62 ns, 146 years; their differences must fit too.
        self.memory.timeout = min(timeout, 2**62)
        self._columns.wraps[:] = robot.continuous

    def forget(self) -> None:
        """Know nothing of any joint."""
        kernel.forget(self.memory)

    def forget_tool(self) -> None:
        """Let the sign of the next quaternion be anew."""
        self.memory.is_new_tool = True

    def layout(self, names: Sequence[str]) -> JointLayout:
        """Return where our joints stand in a message with these names."""
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
        """Return the latest time (ns) any joint is known for, None where none is."""
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
        """Return the seconds since the joint longest unheard, inf where one never was."""
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
        """Return the names of joints that jumped at least so often within DISPUTE_WINDOW."""
        counts = self._columns.jump_count.tolist()
        times = self._columns.jumps.tolist()
        return tuple(
            name
            for name, count, all_times in zip(self.names, counts, times)
            if sum(arrival - time < DISPUTE_WINDOW for time in all_times[:count]) >= jumps
        )
