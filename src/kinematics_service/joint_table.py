"""
What is known of each joint: its position, its velocity, and when it was heard.

"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import kernel
from .kernel import Floats, Integers
from .robot import Robot

# Layouts of message streams kept: drivers on one topic are few, and names must not pile up.
LAYOUTS = 16

# Disagreements older than this are forgotten.
DISPUTE_WINDOW = 2_000_000_000

# Limits are compared with this slack: encoders round, and a joint at its stop is not beyond it.
LIMIT_SLACK = 1e-6


class Layout(NamedTuple):
    """
    Where a message with certain names has our joints.

    Attributes
    ----------
    joints, places
        Our joints in the message (index in the arm), and their place in it.
    duplicates
        Names of our joints that stand in it twice.
    indices : shape (2 k,)
        Joints, then places, as `kernel.observe` takes them.

    """

    joints: tuple[int, ...]
    places: tuple[int, ...]
    duplicates: tuple[str, ...]
    indices: Integers


class JointTable:
    """
    One column for each joint of an arm: the estimator's memory, which `kernel.observe` writes.

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
        The header, then the rows, as kernel.py names them; whole numbers stand in it bit for bit.

    """

    def __init__(self, robot: Robot, prefix: str, source: int, timeout: int) -> None:
        self.names = tuple(prefix + name for name in robot.joint_names)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._layouts: dict[tuple[str, ...], Layout] = {}
        n = len(self.names)
        self.memory = np.zeros(kernel.MEMORY_HEADER + kernel.MEMORY_ROWS * n)
        self._whole: Integers = self.memory.view(np.int64)
        self._rows: Floats = self.memory[kernel.MEMORY_HEADER :].reshape(-1, n)
        self._whole_rows: Integers = self._whole[kernel.MEMORY_HEADER :].reshape(-1, n)
        self.configure(robot, source, timeout)
        self.forget()
        self.forget_tool()

    def configure(self, robot: Robot, source: int, timeout: int) -> None:
        """
        Take other settings; what is known stays.

        """
        self._whole[kernel.VELOCITY_SOURCE] = source
        # Stamps are far below 2^62 ns, 146 years; their differences must fit too.
        self._whole[kernel.TIMEOUT] = min(timeout, 2**62)
        self._whole_rows[kernel.WRAPS] = robot.continuous

    def forget(self) -> None:
        """
        Know nothing of any joint.

        """
        kernel.forget(self.memory)

    def forget_tool(self) -> None:
        """
        Let the sign of the next quaternion be anew.

        """
        self._whole[kernel.NEW_TOOL] = 1

    def layout(self, names: Sequence[str]) -> Layout:
        """
        Return where our joints stand in a message with these names.

        """
        key = tuple(names)
        layout = self._layouts.get(key)
        if layout is not None:
            return layout
        joints: list[int] = []
        places: list[int] = []
        duplicates: list[str] = []
        for place, name in enumerate(key):
            j = self._index.get(name)
            if j is None:
                continue
            if j in joints:
                duplicates.append(name)
            joints.append(j)
            places.append(place)
        indices = np.array([*joints, *places], dtype=np.int64)
        layout = Layout(tuple(joints), tuple(places), tuple(duplicates), indices)
        if len(self._layouts) >= LAYOUTS:
            self._layouts.pop(next(iter(self._layouts)))
        if len(key) <= 8 * len(self.names) + 256:  # a hostile list of names is not worth keeping
            self._layouts[key] = layout
        return layout

    def newest(self) -> int | None:
        """
        Return the latest time (ns) any joint is known for, None where none is.

        """
        known = self._whole_rows[kernel.KNOWN] != 0
        return int(self._whole_rows[kernel.STAMP][known].max()) if known.any() else None

    def missing(self, arrival: int, timeout: int) -> tuple[str, ...]:
        """
        Return the names of joints not heard within `timeout` before `arrival` (ns).

        """
        heard = self._whole_rows[kernel.ARRIVAL].tolist()
        known = self._whole_rows[kernel.KNOWN].tolist()
        return tuple(
            name
            for name, at, ever in zip(self.names, heard, known)
            if not ever or arrival - at > timeout
        )

    def age(self, arrival: int) -> float:
        """
        Return the seconds since the joint longest unheard, inf where one never was.

        """
        if not self._whole_rows[kernel.KNOWN].all():
            return math.inf
        return (arrival - int(self._whole_rows[kernel.ARRIVAL].min())) * 1e-9

    def beyond(self, limits: Floats) -> tuple[str, ...]:
        """
        Return the names of known joints outside limits (n, 2).

        """
        return tuple(
            name
            for name, position, (low, high) in zip(
                self.names, self._rows[kernel.POSITION].tolist(), limits.tolist()
            )
            if position < low - LIMIT_SLACK or position > high + LIMIT_SLACK
        )

    def disputed(self, arrival: int, jumps: int) -> tuple[str, ...]:
        """
        Return the names of joints that jumped at least so often within DISPUTE_WINDOW.

        """
        counts = self._whole_rows[kernel.JUMP_COUNT].tolist()
        times = self._whole_rows[kernel.JUMPS :].T.tolist()
        return tuple(
            name
            for name, count, all_times in zip(self.names, counts, times)
            if sum(arrival - time < DISPUTE_WINDOW for time in all_times[:count]) >= jumps
        )
