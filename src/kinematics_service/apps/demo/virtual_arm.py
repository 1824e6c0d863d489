# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Simulate an arm: a node publishes joint states along a path or from a recording."""

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

# Number of joint states per second along a path.
RATE = 50.0
# If a joint state is late by at most this (s), the arm catches up: later joint states are on time.
# If the lateness is larger, for example because the process was stopped, the rest of the motion is
# delayed by the lateness.
MAX_DELAY = 0.5
QUEUE_DEPTH = 1000
# Shortest period of the timer (s). If the joint states of a recording are closer in time, one call
# of the timer publishes several joint states.
MIN_PERIOD = 0.001


class TimedJointState(NamedTuple):
    """
    One joint state: the time after the start at which it is due (s), its stamp (ns), positions
    (rad or m) and velocities (rad/s or m/s).
    """

    due: float
    stamp: int
    q: Floats
    qdot: Floats | None


def moments_of_trajectory(trajectory: Trajectory, start: int) -> Iterator[TimedJointState]:
    """Yield endlessly the joint states along a periodic path; the first stamp is `start` (ns)."""
    for k in itertools.count():
        due = k / RATE
        yield TimedJointState(due, start + round(due * 1e9), *trajectory.at(due))


def period_of_recording(due: Floats) -> float:
    """
    Return the period (s) for the timer of `VirtualArm`, from the times `due` (N,), s, at which the
    joint states of a recording must be published.
    """
    median = float(np.median(np.diff(due))) if len(due) > 1 else math.inf
    return min(max(median, MIN_PERIOD), 1.0 / RATE)


def moments_of_recording(
    due: Floats, stamps: npt.NDArray[np.int64], q: Floats, qdot: Floats | None
) -> Iterator[TimedJointState]:
    """
    Yield the N joint states of a recording, with the stamps of the recording, ns. Positions and
    velocities have shape (N, n).
    """
    velocities = [None] * len(due) if qdot is None else qdot
    return map(TimedJointState, due.tolist(), stamps.tolist(), q, velocities)


class VirtualArm:
    """
    A simulated arm that publishes each joint state when it is due after `start`.

    Parameters
    ----------
    node
        The node that publishes `joint_states` in its namespace.
    names
        Joint names, in the order of the positions.
    moments
        The joint states, in the order of their times.
    period
        Period of the timer that publishes due joint states, s.
    command
        The topic on which the velocities are also published as commands; '' for none.

    Attributes
    ----------
    node
        The node that publishes.
    sent
        Number of published joint states.
    finished
        Whether the last joint state has been published.
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
        # Use a timer with a constant period that is started only once. If the callback reset the
        # timer, each reset would add an event to the queue of the executor, and the end of the
        # period would add another event. With an executor that is slower than the period, each
        # call of the callback would then cause two further calls.
        self._timer = steady_timer(node, period, self._turn, autostart=False)

    @property
    def heard(self) -> bool:
        """Return whether a subscriber receives the joint states."""
        return bool(self._publisher.get_subscription_count() > 0)

    def start(self) -> None:
        """Publish the first joint state now, and each later one when its time comes."""
        self._start = time.monotonic()
        self._advance()
        self._turn()
        self._timer.reset()

    def stop(self) -> None:
        """Stop publishing joint states."""
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
