"""The messages that the demo receives from its node, and values for table and summary."""

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

# Time of an entry of the history, s.
INTERVAL = 0.25
# Largest number of entries of the history.
HISTORY_LENGTH = 400


class Nearest(NamedTuple):
    """The smallest received distance (rad), its time (s), and the pose of the tool."""

    distance: float
    time: float
    pose: PoseReading | None


class DemoListener:
    """
    Subscribes to the outputs of a node, and keeps values for table and summary.

    Parameters
    ----------
    node
        The node of the subscriptions.
    source
        Full name of the node that publishes.

    Attributes
    ----------
    nearest
        The pose nearest to a singular pose.
    history
        The smallest distance in each INTERVAL, rad; inf without a message.
    joints
        The joint states, from `start` on; None before.
    speeds
        The speed of the fastest joint in each INTERVAL, rad/s or m/s.
    warned, levels
        The last warning, and all levels in their order.
    scale, reason
        The scale of the arm's motion as a command, and its reason.
    then
        Called with each warning.
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
        """Return whether the publishers of the node have discovered all subscriptions."""
        subscriptions = [self.pose, self.jacobian, self.twist, self.warning, self.scale]
        subscriptions += [self.reason, *self.measures.values()]
        topics = {subscription.topic for subscription in subscriptions}
        connected = {p.topic_name for p in node.publishers if p.get_subscription_count() > 0}
        return topics <= connected

    def start(self) -> None:
        """Start the time, and subscribe to the joint states."""
        # Not earlier: the arm waits for the first subscription to the joint states, the node's.
        topic = f'{self.source.rpartition("/")[0]}/{JOINT_STATES}'
        self.joints = LatestMessage(self._node, topic, JointState, OUTPUT_QOS)
        self.started = time.monotonic()

    @property
    def time(self) -> float:
        """Return the seconds since the start."""
        return time.monotonic() - self.started

    @property
    def answered(self) -> int:
        """
        Return the number of joint states whose answer is complete: the distance comes last.
        """
        return self.distance.count

    def measure(self, name: str) -> float | None:
        """Return the last value of a measure, or None."""
        message = self.measures[name].message
        return None if message is None else float(message.data)

    def joint_speeds(self) -> dict[str, float]:
        """Return the last velocities by joint name, rad/s or m/s; empty without a message."""
        message = None if self.joints is None else self.joints.message
        return {} if message is None else dict(zip(message.name, message.velocity))

    def _note(self, message: bytes) -> None:
        distance = float(self.distance.message.data)
        now = self.time
        if distance < self.nearest.distance:
            # The node publishes the pose before the distance, so this pose belongs to it.
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
