"""A simulated arm: a node that publishes joint states along a path or from a recording."""

import time
from array import array
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ...kernel import Floats
from ...node.messages.messages import time_message
from ...node.messages.topics import JOINT_STATES
from ...node.steady_time import steady_timer
from .motions.motion import Trajectory

# Joint states per second along a path.
RATE = 50.0
# After a longer pause (the process was stopped, say) the motion goes on where it was, in s.
LATE = 0.5
QUEUE = 1000
# Shortest period (s): joint states of a faster recording are published several at once.
SHORTEST = 0.001


class RecordedStates(Protocol):
    """Joint states of a recording: stamps (N,), ns, and when each is due, (N,), s."""

    stamps: npt.NDArray[np.int64]
    positions: Floats
    velocities: Floats | None

    @property
    def due(self) -> Floats:
        """Return when each row is due after the first, shape (N,), s."""


class TimedJointState(NamedTuple):
    """One joint state: its time after the start (s), its stamp (ns), positions, velocities."""

    due: float
    stamp: int
    q: Floats
    qdot: Floats | None


def moments_of_trajectory(trajectory: Trajectory, start: int) -> Iterator[TimedJointState]:
    """Yield joint states along a path without end, stamped from `start` (ns) on."""
    k = 0
    while True:
        due = k / RATE
        yield TimedJointState(due, start + round(due * 1e9), *trajectory.at(due))
        k += 1


def period_of_recording(recording: RecordedStates) -> float:
    """Return the period of looks for joint states of a recording that are due, in s."""
    steps = np.diff(recording.due)
    return min(max(float(np.median(steps)), SHORTEST), 1.0 / RATE) if steps.size else 1.0 / RATE


def moments_of_recording(recording: RecordedStates) -> Iterator[TimedJointState]:
    """Yield the joint states of a recording, with its own stamps."""
    velocities = recording.velocities
    for k, due in enumerate(recording.due.tolist()):
        qdot = None if velocities is None else velocities[k]
        yield TimedJointState(due, int(recording.stamps[k]), recording.positions[k], qdot)


class VirtualArm:
    """
    Publishes moments when they are due, from `start` on.

    Parameters
    ----------
    node
        Its node; the topic is `joint_states` in its namespace.
    names
        Joint names, in the order of the moments' positions.
    moments
        What to publish.
    period
        Period of looks for joint states that are due, in s.
    command
        The topic on which the velocities are asked for, too; empty for none.

    Attributes
    ----------
    node
        As given.
    sent
        Number of joint states so far.
    finished
        Whether the last moment is past.
    """

    def __init__(
        self,
        node: Node,
        names: Sequence[str],
        moments: Iterator[TimedJointState],
        period: float = 1.0 / RATE,
        command: str = '',
    ) -> None:
        self.node = node
        self.sent = 0
        self.finished = False
        self._message = JointState(name=names)
        self._moments = moments
        self._publisher = node.create_publisher(JointState, JOINT_STATES, QUEUE)
        self._command = node.create_publisher(JointState, command, QUEUE) if command else None
        # The timer has one period and is started once: each reset of a timer, and each call of one
        # that is due again, adds an event to the executor's queue. A timer that is reset in its
        # own callback doubles its calls without end whenever the queue is longer than its pause.
        self._timer = steady_timer(node, period, self._turn, autostart=False)

    @property
    def heard(self) -> bool:
        """Return whether there is a subscriber."""
        return bool(self._publisher.get_subscription_count() > 0)

    def start(self) -> None:
        """Publish the first moment now and the others when they are due."""
        self._start = time.monotonic()
        self._advance()
        self._turn()
        self._timer.reset()

    def stop(self) -> None:
        """Publish nothing more."""
        self._timer.cancel()

    def _advance(self) -> None:
        moment = next(self._moments, None)
        self.finished = moment is None
        if moment is not None:
            self._next = moment

    def _turn(self) -> None:
        late = time.monotonic() - self._start - self._next.due
        if late > LATE:
            self._start += late
        while not self.finished and time.monotonic() >= self._start + self._next.due:
            self._publish(self._next)
            self._advance()
        if self.finished:
            self._timer.cancel()

    def _publish(self, moment: TimedJointState) -> None:
        message = self._message
        message.header.stamp = time_message(moment.stamp)
        message.position = array('d', moment.q.tobytes())
        message.velocity = array('d', b'' if moment.qdot is None else moment.qdot.tobytes())
        self._publisher.publish(message)
        if self._command is not None and moment.qdot is not None:
            self._command.publish(message)
        self.sent += 1
