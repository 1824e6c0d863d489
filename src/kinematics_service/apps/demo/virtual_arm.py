"""A simulated arm: a node that publishes joint states along a path or from a recording."""

import itertools
import math
import time
from array import array
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ...kernel import Floats
from ...node.messages.messages import time_message
from ...node.messages.topics import JOINT_STATES
from ...node.steady_time import steady_timer
from .motions.trajectory import Trajectory

# Joint states per second along a path.
RATE = 50.0
# After a longer pause (s), for example of a stopped process, the motion continues where it was.
MAX_DELAY = 0.5
QUEUE_DEPTH = 1000
# Shortest period of the timer (s); several joint states of a faster recording share a call.
MIN_PERIOD = 0.001


class TimedJointState(NamedTuple):
    """One joint state: its time after the start (s), its stamp (ns), positions, velocities."""

    due: float
    stamp: int
    q: Floats
    qdot: Floats | None


def moments_of_trajectory(trajectory: Trajectory, start: int) -> Iterator[TimedJointState]:
    """Yield joint states along a path without end, with stamps from `start` (ns) on."""
    for k in itertools.count():
        due = k / RATE
        yield TimedJointState(due, start + round(due * 1e9), *trajectory.at(due))


def period_of_recording(due: Floats) -> float:
    """Return the period of the timer for joint states that are due at times (N,), all in s."""
    median = float(np.median(np.diff(due))) if len(due) > 1 else math.inf
    return min(max(median, MIN_PERIOD), 1.0 / RATE)


def moments_of_recording(
    due: Floats, stamps: npt.NDArray[np.int64], q: Floats, qdot: Floats | None
) -> Iterator[TimedJointState]:
    """Yield the joint states of a recording, (N, ...) each, with its own stamps in ns."""
    velocities = [None] * len(due) if qdot is None else qdot
    return map(TimedJointState, due.tolist(), stamps.tolist(), q, velocities)


class VirtualArm:
    """
    Publishes joint states at their times after `start`.

    Parameters
    ----------
    node
        The node that publishes `joint_states` in its namespace.
    names
        Joint names, in the order of the positions.
    moments
        The joint states.
    period
        Period of the timer that publishes due joint states, s.
    command
        The topic on which the velocities are also published as commands; empty for none.

    Attributes
    ----------
    node
        As given.
    sent
        Number of published joint states.
    finished
        Whether the last joint state is published.
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
        self._publisher = node.create_publisher(JointState, JOINT_STATES, QUEUE_DEPTH)
        self._command = (
            node.create_publisher(JointState, command, QUEUE_DEPTH) if command else None
        )
        # The timer has a constant period and is started once. Each reset of a timer, and each call
        # of a timer that is due again, adds an event to the queue of the executor. A timer that is
        # reset in its callback would double its calls if the queue took longer than its period.
        self._timer = steady_timer(node, period, self._turn, autostart=False)

    @property
    def heard(self) -> bool:
        """Return whether there is a subscriber."""
        return bool(self._publisher.get_subscription_count() > 0)

    def start(self) -> None:
        """Publish the first joint state now, and the others when they are due."""
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
        if late > MAX_DELAY:
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
