"""The messages that the demo receives from its own node, and the values it remembers."""

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

# The time of an entry of the history, s, and the number of entries.
INTERVAL = 0.25
LONGEST_HISTORY = 400


class Nearest(NamedTuple):
    """The smallest distance received (rad), its time (s) and the tool's position then (m)."""

    distance: float
    time: float
    pose: PoseReading | None


class DemoListener:
    """
    Subscribes to a node's outputs and remembers what the summary needs.

    Parameters
    ----------
    node
        The node of the subscriptions.
    source
        Full name of the node that publishes.

    Attributes
    ----------
    nearest
        The worst pose so far.
    history
        The smallest distance in each INTERVAL, rad; inf if there was none.
    joints
        The joint states, from `start` on; None before.
    speeds
        The speed of the fastest joint in each INTERVAL, rad/s or m/s.
    warned, levels
        The last warning, and the levels one after the other.
    scale, reason
        How much of the arm's motion may be kept as a command, and why.
    then
        Called with each warning.
    """

    def __init__(self, node: Node, source: str) -> None:
        self.source = source
        self.started = time.monotonic()
        self.nearest = Nearest(math.inf, 0.0, None)
        self.history: deque[float] = deque(maxlen=LONGEST_HISTORY)
        self.speeds: deque[float] = deque(maxlen=LONGEST_HISTORY)
        self.joints: LatestMessage | None = None
        self._node = node
        self._intervals = 0
        self.warned: WarningReading | None = None
        self.levels: list[str] = []
        self.then: Callable[[WarningReading], None] = lambda warned: None

        self.pose, self.jacobian, self.twist, self.scale, self.reason = (
            ECHO_TOPICS[name].heard_by(node, source)
            for name in ('pose', 'jacobian', 'twist', 'scale', 'scale_reason')
        )
        self.warning = ECHO_TOPICS['warning'].heard_by(node, source, self._warn)
        self.measures = {
            name: LatestMessage(node, f'{source}/singularity/{name}', Float64, OUTPUT_QOS, took)
            for name, took in {**dict.fromkeys(MEASURES), 'distance': self._note}.items()
        }
        self.distance = self.measures['distance']

    def found(self, node: Node) -> bool:
        """Return whether the node's publishers have found all subscriptions."""
        ours = [self.pose, self.jacobian, self.twist, self.warning, *self.measures.values()]
        ours += [self.scale, self.reason]
        topics = {heard.topic for heard in ours}
        found = {p.topic_name for p in node.publishers if p.get_subscription_count() > 0}
        return topics <= found

    def start(self) -> None:
        """Count the time from now on, and subscribe to the joint states, too."""
        # Not before: the arm recognises the node by its subscription to the joint states.
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
        Return the number of messages that were answered completely: the distance is published
        last.
        """
        return self.distance.count

    def measure(self, name: str) -> float | None:
        """Return the last value of a measure, None if there was none."""
        message = self.measures[name].message
        return None if message is None else float(message.data)

    def joint_speeds(self) -> dict[str, float]:
        """Return the last velocities by joint name, rad/s or m/s; none if there was none."""
        message = None if self.joints is None else self.joints.message
        return {} if message is None else dict(zip(message.name, message.velocity))

    def _note(self, message: bytes) -> None:
        distance = float(self.distance.message.data)
        now = self.time
        if distance < self.nearest.distance:
            # The node publishes the pose first, so this is the pose of this distance.
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
