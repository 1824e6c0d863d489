"""
What is known of each joint: its position, its velocity, and when it was heard.

"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .kernel import Floats
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

    """

    joints: tuple[int, ...]
    places: tuple[int, ...]
    duplicates: tuple[str, ...]


class JointTable:
    """
    One row for each joint of an arm, part of the estimator's memory.

    """

    def __init__(self, robot: Robot, prefix: str) -> None:
        self.names = tuple(prefix + name for name in robot.joint_names)
        self._index = {name: j for j, name in enumerate(self.names)}
        self._wraps = robot.continuous
        self._layouts: dict[tuple[str, ...], Layout] = {}
        self.forget()

    def forget(self) -> None:
        """
        Know nothing of any joint.

        """
        n = len(self.names)
        self._position = [math.nan] * n
        self._before = [math.nan] * n  # the position before that
        self._velocity = [math.nan] * n
        self._differenced = [False] * n
        self._stamp: list[int | None] = [None] * n
        self._stamped = [False] * n
        self._arrival: list[int | None] = [None] * n
        self._jumps: list[list[int]] = [[] for _ in range(n)]

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
        layout = Layout(tuple(joints), tuple(places), tuple(duplicates))
        if len(self._layouts) >= LAYOUTS:
            self._layouts.pop(next(iter(self._layouts)))
        if len(key) <= 8 * len(self.names) + 256:  # a hostile list of names is not worth keeping
            self._layouts[key] = layout
        return layout

    def latest_stamp(self, joints: Sequence[int]) -> int | None:
        """
        Return the latest stamp (ns) among joints, of those whose last message had one.

        """
        stamps = [stamp for j in joints if self._stamped[j] and (stamp := self._stamp[j])]
        return max(stamps, default=None)

    def newest(self) -> int | None:
        """
        Return the latest time (ns) any joint is known for, None where none is.

        """
        return max((stamp for stamp in self._stamp if stamp is not None), default=None)

    def difference(self, j: int, position: float, stamp: int, longest: int) -> float:
        """
        Return the backward difference to a position, rad/s or m/s, or NaN where there is none.

        A joint without limits may have wrapped, so it takes the shortest angle. NaN on the first
        sample and after a gap longer than `longest` (ns).

        """
        last = self._stamp[j]
        if last is None or not 0 < stamp - last <= longest:
            return math.nan
        step = position - self._position[j]
        if self._wraps[j]:
            step = math.remainder(step, math.tau)
        velocity = step / ((stamp - last) * 1e-9)
        return velocity if math.isfinite(velocity) else math.nan

    def store(
        self,
        j: int,
        position: float,
        velocity: float,
        differenced: bool,
        stamp: int,
        stamped: bool,
        arrival: int,
    ) -> None:
        """
        Take what a message says of joint j.

        """
        self._before[j] = self._position[j]
        self._position[j] = position
        self._velocity[j] = velocity
        self._differenced[j] = differenced
        self._stamp[j] = stamp
        self._stamped[j] = stamped
        self._arrival[j] = arrival

    def state(self) -> tuple[Floats, Floats | None, str]:
        """
        Return q, qdot (None where some velocity is unknown) and where the velocities come from.

        """
        q = np.array(self._position)
        if any(map(math.isnan, self._velocity)):
            return q, None, 'none'
        source = 'difference' if any(self._differenced) else 'message'
        return q, np.array(self._velocity), source

    def missing(self, arrival: int, timeout: int) -> tuple[str, ...]:
        """
        Return the names of joints not heard within `timeout` before `arrival` (ns).

        """
        return tuple(
            name
            for name, heard in zip(self.names, self._arrival)
            if heard is None or arrival - heard > timeout
        )

    def age(self, arrival: int) -> float:
        """
        Return the seconds since the joint longest unheard, inf where one never was.

        """
        heard = [math.inf if at is None else (arrival - at) * 1e-9 for at in self._arrival]
        return max(heard)

    def beyond(self, limits: Floats) -> tuple[str, ...]:
        """
        Return the names of known joints outside limits (n, 2).

        """
        return tuple(
            name
            for name, position, (low, high) in zip(self.names, self._position, limits.tolist())
            if position < low - LIMIT_SLACK or position > high + LIMIT_SLACK
        )

    def note_dispute(
        self,
        joints: Sequence[int],
        positions: Sequence[float],
        arrival: int,
        apart: float,
        returned: float,
    ) -> None:
        """
        Remember joints that jump away and back: two publishers take turns.

        """
        for j, position in zip(joints, positions):
            jump = abs(position - self._position[j])
            back = abs(position - self._before[j])
            if jump > apart and back < returned * jump:
                self._jumps[j] = [*self._jumps[j][-15:], arrival]

    def note_late(
        self,
        joints: Sequence[int],
        positions: Sequence[float],
        stamp: int,
        arrival: int,
        apart: float,
    ) -> None:
        """
        Remember joints that an older message (stamp in ns) has where they cannot have been.

        A publisher whose clock is behind another's is never accepted, but it may still disagree.

        """
        for j, position in zip(joints, positions):
            latest, velocity = self._stamp[j], self._velocity[j]
            if latest is None:
                continue
            speed = 0.0 if math.isnan(velocity) else abs(velocity)
            moved = 2.0 * speed * abs(latest - stamp) * 1e-9
            if abs(position - self._position[j]) > apart + moved:
                self._jumps[j] = [*self._jumps[j][-15:], arrival]

    def disputed(self, arrival: int, jumps: int) -> tuple[str, ...]:
        """
        Return the names of joints that jumped at least so often within DISPUTE_WINDOW.

        """
        return tuple(
            name
            for name, times in zip(self.names, self._jumps)
            if sum(arrival - time < DISPUTE_WINDOW for time in times) >= jumps
        )
