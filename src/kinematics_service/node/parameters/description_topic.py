"""The arm from a topic that its URDF is published on, as robot_state_publisher does."""

import math
import time
from collections.abc import Callable

from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from ...errors import KinematicsError, SettingsError
from ...robot.bundled import TOPIC, split_ends
from ...robot.file.reader import described
from ...robot.robot import Robot, build_robot

KIND = 'std_msgs/msg/String'
# Late subscribers get the last description.
QOS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
# Longest time until a request for the end is seen while no description has come (s).
TURN = 0.1
# Time of silence after which the reason is logged (s), and at least between two lines.
SILENCE = 5.0
# Period of the reports on the wait (s).
PERIOD = 1.0


def last_of(count: int) -> str:
    """Return that a line stands for more than one; empty for one."""
    return f' (the last of {count} in {SILENCE:g} s)' if count > 1 else ''


class StoppedWaiting(Exception):
    """The process was asked to end before there was a robot."""


class DescriptionTopic:
    """
    The last description that came on a topic.

    Parameters
    ----------
    node
        The node that subscribes.
    source
        `topic:NAME`, or `topic:NAME:BASE:TIP` for the chain between two links.

    Attributes
    ----------
    then
        Called when another description has come; the same one again is none.

    Raises
    ------
    SettingsError
        No topic can have that name.
    """

    def __init__(self, node: Node, source: str) -> None:
        self._node = node
        self._source, self._base, self._tip = split_ends(source)
        self._text: str | None = None
        self._publishers = 1
        self.then: Callable[[], None] = lambda: None
        topic = self._source.removeprefix(TOPIC)
        try:
            subscription = node.create_subscription(String, topic, self._take, QOS)
        except NameValidationException as error:
            raise SettingsError(f'parameter robot: {topic!r} is no topic: {error}') from None
        self._topic = str(subscription.topic_name)

    def _take(self, message: String) -> None:
        if message.data == self._text:
            return
        self._text = message.data
        publishers = self._node.count_publishers(self._topic)
        if publishers > max(self._publishers, 1):
            self._node.get_logger().warning(
                f'{publishers} publishers on {self._topic}: the description that came last counts'
            )
        self._publishers = publishers
        self.then()

    def robot(self) -> Robot:
        """
        Return the arm of the last description.

        Raises
        ------
        KinematicsError
            It is no URDF of an arm.
        """
        from ...robot.urdf.importer import urdf_as_robot_file  # only if it is asked for

        content = (self._text or '').encode('utf-8', 'replace')
        text = urdf_as_robot_file(content, self._source, self._base, self._tip)
        return build_robot(described(text, self._source, content))

    def first_robot(self, stopped: Callable[[], bool], report: Callable[[str], None]) -> Robot:
        """
        Return the arm of the first description that describes one; wait for it.

        Parameters
        ----------
        stopped
            Whether to wait no longer.
        report
            Called once a second with the reason for the wait.

        Raises
        ------
        StoppedWaiting
            `stopped()` was true before.
        """
        self._node.get_logger().info(f'waiting for the robot from {self._topic}')
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        refused: str | None = None
        why, unsaid, reporting = '', 0, 0.0
        saying = time.monotonic() + SILENCE
        try:
            while not stopped() and self._node.context.ok():
                executor.spin_once(timeout_sec=TURN)
                if self._text != refused:
                    try:
                        return self.robot()
                    except KinematicsError as error:
                        saying = saying if refused is not None else 0.0
                        refused, unsaid = self._text, unsaid + 1
                        why = f'the robot is not taken: {error}'
                if (now := time.monotonic()) > reporting:
                    reporting = now + PERIOD
                    why = why if refused is not None else self._why_none()
                    report(f'waits for a robot description on {self._topic}: {why}')
                if now > saying and (unsaid or refused is None):
                    self._node.get_logger().warning(f'{why}{last_of(unsaid)}')
                    saying, unsaid = now + (SILENCE if unsaid else math.inf), 0
            raise StoppedWaiting
        finally:
            executor.remove_node(self._node)
            executor.shutdown()

    def _why_none(self) -> str:
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        if publishers:
            lasting = DurabilityPolicy.TRANSIENT_LOCAL
            late = [one.node_name for one in publishers if one.qos_profile.durability != lasting]
            if late:
                return (
                    f'{self._topic} is published by {", ".join(late)} with durability volatile, '
                    'which this node cannot hear: it must be transient_local, as '
                    'robot_state_publisher has it'
                )
            return f'{self._topic} has a publisher, and no description has come from it yet'
        name = self._topic.rpartition('/')[2]
        others = [
            topic
            for topic, kinds in self._node.get_topic_names_and_types()
            if KIND in kinds and name in topic and self._node.count_publishers(topic)
        ]
        known = (
            f'others here: {", ".join(others)} (--robot-description {others[0]})'
            if others
            else 'publish it by: ros2 run robot_state_publisher robot_state_publisher arm.urdf'
        )
        return f'nobody publishes {self._topic} (std_msgs/String, transient_local); {known}'
