# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the arm from a topic with its URDF, as robot_state_publisher publishes it."""

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
# With this quality of service, a subscriber that starts late receives the last description.
QOS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
# While the node waits for a description, it checks with this period (s) whether it must stop.
STOP_CHECK_PERIOD = 0.1
# If no description arrives within this time (s), the node logs why. This is also the shortest time
# between two log lines.
LOG_PERIOD = 5.0
# Period (s) of the reports that say why the node still waits.
REPORT_PERIOD = 1.0


def last_of(count: int) -> str:
    """
    Return a text that says that a log line reports only the last of `count` events; '' for one
    event.
    """
    return f' (the last of {count} in {LOG_PERIOD:g} s)' if count > 1 else ''


class StoppedWaiting(Exception):
    """A stop was requested before a robot was received."""


class DescriptionTopic:
    """
    A subscription to a topic with robot descriptions (URDF), which keeps the last description.

    Parameters
    ----------
    node
        The node that subscribes.
    source
        `topic:NAME`, or `topic:NAME:BASE:TIP` for the chain between two links.

    Attributes
    ----------
    then
        A function that is called after a different description has arrived.

    Raises
    ------
    SettingsError
        The name is not valid for a topic.
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
            raise SettingsError(
                f'parameter robot: {topic!r} is not the name of a topic: {error}', code='syntax'
            ) from None
        self._topic = str(subscription.topic_name)

    def _take(self, message: String) -> None:
        if message.data == self._text:
            return
        self._text = message.data
        publishers = self._node.count_publishers(self._topic)
        if publishers > max(self._publishers, 1):
            self._node.get_logger().warning(
                f'{publishers} publishers on {self._topic}: the last description is used; end all '
                'but one'
            )
        self._publishers = publishers
        self.then()

    def robot(self) -> Robot:
        """
        Return the arm in the last description.

        Raises
        ------
        KinematicsError
            The description is not a URDF of an arm.
        """
        # Import the importer only here, because it loads slowly.
        from ...robot.urdf.importer import urdf_as_robot_file

        content = (self._text or '').encode('utf-8', 'replace')
        text = urdf_as_robot_file(content, self._source, self._base, self._tip)
        return build_robot(described(text, self._source, content))

    def first_robot(self, stopped: Callable[[], bool], report: Callable[[str], None]) -> Robot:
        """
        Wait for a description of an arm, and return the arm.

        Parameters
        ----------
        stopped
            A function that returns whether to end the wait.
        report
            A function that is called once a second with the reason for the wait.

        Raises
        ------
        StoppedWaiting
            `stopped()` was true first.
        """
        self._node.get_logger().info(f'waiting for the robot from {self._topic}')
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        refused: str | None = None
        reason, unlogged, report_time = '', 0, 0.0
        log_time = time.monotonic() + LOG_PERIOD
        try:
            while not stopped() and self._node.context.ok():
                executor.spin_once(timeout_sec=STOP_CHECK_PERIOD)
                if self._text != refused:
                    try:
                        return self.robot()
                    except KinematicsError as error:
                        log_time = log_time if refused is not None else 0.0
                        refused, unlogged = self._text, unlogged + 1
                        reason = f'the robot is refused: {error}'
                if (now := time.monotonic()) > report_time:
                    report_time = now + REPORT_PERIOD
                    reason = reason if refused is not None else self._why_none()
                    report(f'waits for a robot description on {self._topic}: {reason}')
                if now > log_time and (unlogged or refused is None):
                    self._node.get_logger().warning(f'{reason}{last_of(unlogged)}')
                    log_time, unlogged = now + (LOG_PERIOD if unlogged else math.inf), 0
            raise StoppedWaiting
        finally:
            executor.remove_node(self._node)
            executor.shutdown()

    def _why_none(self) -> str:
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        if publishers:
            lasting = DurabilityPolicy.TRANSIENT_LOCAL
            late = [
                info.node_name for info in publishers if info.qos_profile.durability != lasting
            ]
            if late:
                return (
                    f'{self._topic} is published by {", ".join(late)} with durability volatile, '
                    'so this node does not receive it; publish it as transient_local, as '
                    'robot_state_publisher does'
                )
            return f'{self._topic} has a publisher, and no description has come from it yet'
        name = self._topic.rpartition('/')[2]
        others = [
            topic
            for topic, kinds in self._node.get_topic_names_and_types()
            if KIND in kinds and name in topic and self._node.count_publishers(topic)
        ]
        hint = (
            f'others here: {", ".join(others)} (--robot-description {others[0]})'
            if others
            else 'publish it by: ros2 run robot_state_publisher robot_state_publisher arm.urdf'
        )
        return f'no publisher of {self._topic} (std_msgs/String, transient_local); {hint}'
