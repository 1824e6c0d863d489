# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Receive the messages of the demo's node, and keep what the demo's table and summary show."""

import math
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from ...node.messages.readings import WarningReading, warned_of
from ...node.messages.topics import JOINT_STATES, OUTPUT_QOS
from ...node.process.latest_message import LatestMessage
from ...robot.measures import MEASURES
from .echo_topics import ECHO_TOPICS
from .readings import PoseReading, pose_of

# Each entry of `DemoListener.history` and `DemoListener.speeds` covers an interval of this length,
# s.
INTERVAL = 0.25
# Largest number of entries of `DemoListener.history` and `DemoListener.speeds`; older entries are
# dropped.
HISTORY_LENGTH = 400


class Nearest(NamedTuple):
    """
    The smallest received distance to a singular pose (rad), the time of its receipt since the
    start of the demo (s), and the tool's pose at that time.
    """

    distance: float
    time: float
    pose: PoseReading | None


class DemoListener:
    """
    Subscribes to the outputs of a node, and keeps what the demo's table and summary show.

    Parameters
    ----------
    node
        The ROS node that owns the subscriptions.
    source
        Full name of the node whose messages are received.

    Attributes
    ----------
    nearest
        The smallest distance to a singular pose so far, the time of its receipt, and the tool's
        pose at that time.
    history
        The smallest distance to a singular pose in each time interval of length `INTERVAL`, rad;
        inf if no message came.
    joints
        The latest joint states; None before `start` is called.
    speeds
        The speed of the fastest joint in each time interval of length `INTERVAL`, rad/s or m/s.
    warned
        The last warning.
    levels
        The sequence of warning levels (OK, WARN, ERROR, STALE), with one entry for each change.
    scale
        The latest message with the factor (0 to 1) by which a velocity command of the arm is to be
        multiplied. The simulated arm ignores the factor.
    reason
        The latest message with the reason for this factor.
    then
        A function that is called with each received warning.
    """

    def __init__(self, node: Node, source: str) -> None:
        self.source = source
        self.started = time.monotonic()
        self.nearest = Nearest(math.inf, 0.0, None)
        self.history: deque[float] = deque(maxlen=HISTORY_LENGTH)
        self.speeds: deque[float] = deque(maxlen=HISTORY_LENGTH)
        self.joints: LatestMessage | None = None
        self._node = node
        self._intervals = 0
        self.warned: WarningReading | None = None
        self.levels: list[str] = []
        self.then: Callable[[WarningReading], None] = lambda warned: None

        self.pose, self.jacobian, self.twist, self.scale, self.reason = (
            ECHO_TOPICS[name].subscribed_by(node, source)
            for name in ('pose', 'jacobian', 'twist', 'scale', 'scale_reason')
        )
        self.warning = ECHO_TOPICS['warning'].subscribed_by(node, source, self._warn)
        self.measures = {
            name: LatestMessage(node, f'{source}/singularity/{name}', Float64, OUTPUT_QOS, took)
            for name, took in {**dict.fromkeys(MEASURES), 'distance': self._note}.items()
        }
        self.distance = self.measures['distance']

    def is_discovered(self, node: Node) -> bool:
        """Return whether the publishers of `node` have discovered all subscriptions."""
        subscriptions = [self.pose, self.jacobian, self.twist, self.warning, self.scale]
        subscriptions += [self.reason, *self.measures.values()]
        topics = {subscription.topic for subscription in subscriptions}
        connected = {p.topic_name for p in node.publishers if p.get_subscription_count() > 0}
        return topics <= connected

    def start(self) -> None:
        """Set the start time of the demo to now, and subscribe to the arm's joint states."""
        # Subscribe to the joint states only now. The demo starts the arm as soon as the topic of
        # the joint states has a subscriber. The first subscriber must be the kinematics node, not
        # this listener.
        topic = f'{self.source.rpartition("/")[0]}/{JOINT_STATES}'
        self.joints = LatestMessage(self._node, topic, JointState, OUTPUT_QOS)
        self.started = time.monotonic()

    @property
    def time(self) -> float:
        """Return the time since `start` was called, s."""
        return time.monotonic() - self.started

    @property
    def answered(self) -> int:
        """
        Return for how many joint states the node has published all its results.

        This is the number of messages with the distance to singular poses, because the node
        publishes this distance last for each joint state.
        """
        return self.distance.count

    def measure(self, name: str) -> float | None:
        """
        Return the latest value of a singularity measure, such as `distance`; None if no message
        came.
        """
        message = self.measures[name].message
        return None if message is None else float(message.data)

    def joint_speeds(self) -> dict[str, float]:
        """
        Return the latest velocity of each joint by name, rad/s or m/s; empty if no velocities
        came.
        """
        message = None if self.joints is None else self.joints.message
        return {} if message is None else dict(zip(message.name, message.velocity))

    def _note(self, message: bytes) -> None:
        distance = float(self.distance.message.data)
        now = self.time
        if distance < self.nearest.distance:
            # Store the latest pose together with this smallest distance. Both belong to the same
            # joint state, because the node publishes the pose before the distance.
            pose = None if self.pose.message is None else pose_of(self.pose.message)
            self.nearest = Nearest(distance, now, pose)
        while self._intervals * INTERVAL <= now:
            self._intervals += 1
            self.history.append(math.inf)
            self.speeds.append(0.0)
        self.history[-1] = min(self.history[-1], distance)
        speeds = [abs(speed) for speed in self.joint_speeds().values() if math.isfinite(speed)]
        self.speeds[-1] = max([self.speeds[-1], *speeds])

    def _warn(self, message: bytes) -> None:
        self.warned = warned_of(self.warning.message)
        if not self.levels or self.levels[-1] != self.warned.level:
            self.levels.append(self.warned.level)
        self.then(self.warned)
