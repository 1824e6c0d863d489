"""
The estimator: the one object with memory between a JointState message and the state of the tool.

"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from . import kernel
from .alarm import Alarm
from .errors import JointVectorError
from .joint_sample import JointSample
from .joint_table import JointTable, Layout
from .kernel import Floats
from .measures import Level
from .robot import Robot
from .singularities import Singularity, watched_value
from .tool_state import ToolState, evaluate

VELOCITY_SOURCES = ('auto', 'message', 'difference')


@dataclass(frozen=True)
class EstimatorSettings:
    """
    How messages become states.

    Attributes
    ----------
    joint_prefix
        Put before the joint names of the robot file.
    velocity_source
        `auto` (the message's velocities, differences where it has none), `message`, `difference`.
    timeout : ns
        A joint unheard for longer is stale; stamps that step back by more are a new start.

    """

    joint_prefix: str = ''
    velocity_source: str = 'auto'
    timeout: int = 1_000_000_000


class Answer(NamedTuple):
    """
    A new state of the tool.

    Attributes
    ----------
    state
        Pose, Jacobian, frames, and the twist where the velocities are known.
    quaternion_xyzw : shape (4,)
        Orientation, of unit length, its sign continuous from answer to answer.
    stamp : ns
        Of the message that made it; of its receipt where it has none.
    velocity_source
        `message`, `difference`, or `none`.

    """

    state: ToolState
    quaternion_xyzw: Floats
    stamp: int
    velocity_source: str


class Accepted(NamedTuple):
    """
    Joint positions and velocities that are known after a message.

    Attributes
    ----------
    q : shape (n,), rad or m
        Joint positions, in the arm's order.
    qdot : shape (n,), rad/s or m/s, or None
        Joint velocities, where all are known.
    stamp : ns
        Of the message; of its receipt where it has none.
    velocity_source
        `message`, `difference`, or `none`.

    """

    q: Floats
    qdot: Floats | None
    stamp: int
    velocity_source: str


class Refusal(NamedTuple):
    """
    A message that makes no new state.

    Attributes
    ----------
    reason
        Key of the count it was added to.
    sentence
        What to tell the user, empty where there is nothing to tell.

    """

    reason: str
    sentence: str = ''


# Reasons, as they are counted and shown in the diagnostics.
NOT_OURS = 'none of our joints'
NO_POSITION = 'no position'
MALFORMED = 'position and name of different length'
DUPLICATE = 'joint named twice'
NOT_FINITE = 'position not finite'
TOO_LARGE = 'position too large'
DROPPED = 'stamp not newer'
WAITING = 'waiting for other joints'
ACCEPTED = 'accepted'
NOT_STAMPED = 'not stamped'
RESETS = 'resets'

# At 1e15 rad neighbouring doubles are an eighth of a turn apart: such a number says nothing.
LARGEST = 1e15

# Evidence that two publishers disagree about a joint: it jumps by more than MOVED_APART (rad or m)
# and back to within a fifth of that, again and again within the window.
MOVED_APART = 1e-3
RETURNED = 0.2
JUMPS = 4


class Estimator:
    """
    Merges joint samples by name and time and runs the kernel on what is known.

    Nothing it holds grows with time, and no sample makes it raise.

    Parameters
    ----------
    robot
        The arm.
    settings
        How messages become states.

    Attributes
    ----------
    counts
        Number of messages by what became of them.

    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        self.robot = robot
        self.settings = settings
        self.counts: Counter[str] = Counter()
        self._table = JointTable(robot, settings.joint_prefix)
        self._quaternion: Floats | None = None
        self._alarm = Alarm()

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """
        Take other settings, keeping what is known unless the joints get other names.

        """
        if settings.joint_prefix != self.settings.joint_prefix:
            self._table = JointTable(robot, settings.joint_prefix)
            self._quaternion = None
        self.robot, self.settings = robot, settings

    def reset(self) -> None:
        """
        Forget every joint: the clock or the recording started anew.

        """
        self.counts[RESETS] += 1
        self._table.forget()
        self._quaternion = None

    def clock_stepped_back(self, now: int, back: int) -> bool:
        """
        Return whether the ROS clock's step back by `back` to `now` (ns) made a reset necessary.

        Where messages of the new time were faster than the clock, they have made it already.

        """
        latest = self._table.newest()
        if latest is None or latest <= now + back // 2:
            return False
        self.reset()
        return True

    def missing(self, arrival: int) -> tuple[str, ...]:
        """
        Return the names of joints not heard for the timeout before `arrival` (steady clock, ns).

        """
        return self._table.missing(arrival, self.settings.timeout)

    def age(self, arrival: int) -> float:
        """
        Return the seconds since the joint longest unheard, inf where one never was.

        """
        return self._table.age(arrival)

    def beyond_limits(self) -> tuple[str, ...]:
        """
        Return the names of known joints that stand outside their limits.

        """
        return self._table.beyond(self.robot.limits)

    def disputed(self, arrival: int) -> tuple[str, ...]:
        """
        Return the names of joints about which messages have disagreed lately.

        """
        return self._table.disputed(arrival, JUMPS)

    def judge(self, singularity: Singularity, arrival: int) -> tuple[Level, bool]:
        """
        Return the level of a new state, with hysteresis, and whether it is to be said.

        """
        level = self.robot.thresholds.level(
            watched_value(self.robot, singularity), self._alarm.level
        )
        factors = singularity.factors
        self._alarm, say = self._alarm.step(
            level,
            singularity.lost_direction,
            arrival,
            None if factors is None else factors.nearest,
        )
        return level, say

    def go_stale(self, arrival: int) -> bool:
        """
        Return whether it is to be said that the state is stale: once in each silence.

        """
        self._alarm, say = self._alarm.step(Level.STALE, None, arrival)
        return say

    def take(self, sample: JointSample) -> Answer | Refusal:
        """
        Return the new state a sample makes, or why it makes none.

        """
        accepted = self.accept(sample)
        if isinstance(accepted, Refusal):
            return accepted
        return self._answer(accepted)

    def accept(self, sample: JointSample) -> Accepted | Refusal:
        """
        Return the joints that are known after a sample, or why it makes no new state.

        The part of `take` that has a memory of its own; a recording goes through this message by
        message, and through the kernel in one batch.

        """
        refusal = self._refusal(sample)
        if refusal is not None:
            self.counts[refusal.reason] += 1
            return refusal
        self.counts[ACCEPTED] += 1
        q, qdot, source = self._table.state()
        return Accepted(q, qdot, sample.stamp or sample.received, source)

    def _refusal(self, sample: JointSample) -> Refusal | None:
        layout = self._table.layout(sample.names)
        if not layout.joints:
            return Refusal(NOT_OURS)
        if len(sample.positions) == 0:
            return Refusal(NO_POSITION)
        if len(sample.positions) != len(sample.names):
            return Refusal(
                MALFORMED,
                f'{len(sample.names)} names but {len(sample.positions)} positions',
            )
        if layout.duplicates:
            return Refusal(DUPLICATE, f'joint {layout.duplicates[0]!r} is named twice')
        positions = [float(sample.positions[i]) for i in layout.places]
        for j, position in zip(layout.joints, positions):
            if not abs(position) <= LARGEST:
                reason = TOO_LARGE if math.isfinite(position) else NOT_FINITE
                return Refusal(reason, f'position of joint {self._table.names[j]!r} is {position}')
        refusal = self._order(sample, layout, positions)
        if refusal is not None:
            return refusal
        self._store(sample, layout, positions)
        if self._table.missing(sample.arrival, self.settings.timeout):
            return Refusal(WAITING)
        return None

    def _order(
        self, sample: JointSample, layout: Layout, positions: Sequence[float]
    ) -> Refusal | None:
        # Stamps of our joints must grow; a large step back is a new start, not an old message.
        if sample.stamp == 0:
            self.counts[NOT_STAMPED] += 1
            return None
        latest = self._table.latest_stamp(layout.joints)
        if latest is None or sample.stamp > latest:
            return None
        if latest - sample.stamp > self.settings.timeout:
            self.reset()
            return None
        self._table.note_late(layout.joints, positions, sample.stamp, sample.arrival, MOVED_APART)
        return Refusal(DROPPED)

    def _store(self, sample: JointSample, layout: Layout, positions: Sequence[float]) -> None:
        velocities = self._message_velocities(sample, layout)
        stamp = sample.stamp or sample.received
        self._table.note_dispute(layout.joints, positions, sample.arrival, MOVED_APART, RETURNED)
        for place, j in enumerate(layout.joints):
            if velocities is not None:
                velocity, differenced = velocities[place], False
            elif self.settings.velocity_source == 'message':
                velocity, differenced = math.nan, False
            else:
                velocity = self._table.difference(
                    j, positions[place], stamp, self.settings.timeout
                )
                differenced = True
            self._table.store(
                j,
                positions[place],
                velocity,
                differenced,
                stamp,
                sample.stamp != 0,
                sample.arrival,
            )

    def _message_velocities(self, sample: JointSample, layout: Layout) -> list[float] | None:
        if self.settings.velocity_source == 'difference':
            return None
        if len(sample.velocities) != len(sample.names):
            return None
        velocities = [float(sample.velocities[i]) for i in layout.places]
        return velocities if all(abs(velocity) <= LARGEST for velocity in velocities) else None

    def _answer(self, accepted: Accepted) -> Answer | Refusal:
        try:
            state = evaluate(self.robot, accepted.q, accepted.qdot, depth=kernel.ALL_FRAMES)
        except JointVectorError:
            # Lengths of the robot file can still overflow; such a position must not be kept.
            self._table.forget()
            self.counts[ACCEPTED] -= 1
            self.counts[TOO_LARGE] += 1
            return Refusal(TOO_LARGE, 'positions or velocities are too large to compute with')
        quaternion = state.quaternion_xyzw
        if self._quaternion is not None and float(np.dot(quaternion, self._quaternion)) < 0.0:
            quaternion = -quaternion
        self._quaternion = quaternion
        return Answer(state, quaternion, accepted.stamp, accepted.velocity_source)
