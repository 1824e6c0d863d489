# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Publish the diagnostics of a node once a second: the status of its input (joint states), and
statuses of its other functions.
"""

import math
import re
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..estimation import outcomes
from ..estimation.estimator import Estimator
from ..estimation.input_checks import messages_of
from ..estimation.status_text import StatusText
from . import diagnostics
from .input import Input
from .messages.graph import kinematics_nodes
from .messages.messages import full_name, status_message
from .messages.topics import DIAGNOSTICS, DIAGNOSTICS_QOS, POSE
from .steady_time import Throttle, steady_timer

# Period of the diagnostics, s.
DIAGNOSTICS_PERIOD = 1.0
# Shortest time between two diagnostics, s. Message rates are computed over the time between two
# diagnostics. After a stall of the process, the timer makes the delayed calls one right after
# another; calls that come too soon publish nothing.
MIN_INTERVAL = 0.5 * DIAGNOSTICS_PERIOD
# If the time between two diagnostics is above this, s, the process was stalled and cannot have
# received messages.
STALL_INTERVAL = 2.0 * DIAGNOSTICS_PERIOD
# Time (s) without joint states after which the node logs the probable reason.
SILENCE_TIMEOUT = 5.0
# Shortest time (s) between two log lines that have the same cause.
LOG_PERIOD = 60.0
JOINT_STATES = 'sensor_msgs/msg/JointState'
# Node name of a publisher whose node is not discovered yet.
UNKNOWN = '_NODE_NAME_UNKNOWN_'


def why_no_joint_states(node: Node, topic: str, given: str) -> str:
    """
    Return a text that says why no joint state arrives on a topic, and which other topics have
    joint states.

    `given` is the name of the topic before remapping.
    """
    topics = dict(node.get_topic_names_and_types())
    kinds = set(topics.get(topic, ())) - {JOINT_STATES}
    cause = 'its publishers are silent' if node.count_publishers(topic) else 'it has no publisher'
    if kinds:
        cause = f'it is published as {", ".join(sorted(kinds))}, not as {JOINT_STATES}'
    # Skip topics of kinematics nodes. Such a node publishes joint states that it computed for a
    # target, not joint states of a robot.
    nodes = tuple(f'{name}/' for name in kinematics_nodes(node))
    own_topics = {topic, *(publisher.topic_name for publisher in node.publishers)}
    others = sorted(
        name
        for name, types in topics.items()
        if JOINT_STATES in types and name not in own_topics and not name.startswith(nodes)
        # Call count_publishers, because get_publishers_info_by_topic would remap the topic's name.
        if node.count_publishers(name)
    )
    elsewhere = 'no other topic here has a publisher of joint states'
    if others:
        elsewhere = f'joint states are published on {", ".join(others)}'
        elsewhere += f': try -r {given}:={others[0]}'
    return f'no joint state has come on {topic}: {cause}; {elsewhere}'


def namesakes_in_words(node: Node) -> str:
    """
    Return a text that names the other nodes that publish on this node's pose topic; '' if no other
    node does.
    """
    publishers = node.get_publishers_info_by_topic(POSE)
    names = [_name_of(info) for info in publishers if info.node_name != UNKNOWN]
    if (own_name := f'/{full_name(node)}') in names:
        names.remove(own_name)
    if not names:
        return ''
    name, topic = ' and '.join(dict.fromkeys(names)), node.resolve_topic_name(POSE)
    return f'a second node, {name}, publishes {topic}, too: end it, or rename it (-r __node:=NAME)'


def _name_of(info: TopicEndpointInfo) -> str:
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def without_numbers(sentence: str) -> str:
    """
    Return the part of a fault's sentence before the first colon, without numbers. Two faults of
    one kind have this part in common.
    """
    return re.sub(r'[\d.]+', '', sentence.partition(':')[0])


def diagnostics_publisher(node: Node) -> Publisher:
    """Return a publisher of /diagnostics."""
    return node.create_publisher(DiagnosticArray, DIAGNOSTICS, DIAGNOSTICS_QOS)


def publish_statuses(node: Node, publisher: Publisher, statuses: Mapping[str, StatusText]) -> None:
    """Publish statuses of a node in one message; each key is the subject of a status."""
    message, name = DiagnosticArray(), full_name(node)
    message.header.stamp = node.get_clock().now().to_msg()
    message.status = [status_message(f'{name}: {of}', text) for of, text in statuses.items()]
    publisher.publish(message)


class Health:
    """
    Checks the input of a node and publishes the status of the input once a second.

    Attributes
    ----------
    work : ns
        Processing times of messages since the last diagnostics.
    warnings
        The faults of the input, as sentences, that the last diagnostics reported.
    """

    def __init__(
        self,
        node: Node,
        publisher: Publisher,
        estimator: Estimator,
        joint_states: Input,
        others: Callable[[], Mapping[str, StatusText]],
        velocity_source: Callable[[], str],
        silent: Callable[[], str],
    ) -> None:
        self.work: list[int] = []
        self._node, self._publisher, self._estimator = node, publisher, estimator
        self._subscription, self._recent = joint_states.subscription, joint_states.recent
        self._others = others
        self._velocity_source, self._silent = velocity_source, silent
        self._published_counts: Counter[str] = Counter()
        self._published_at = self._answered = time.monotonic()
        self._throttle, self._first_time = Throttle(LOG_PERIOD), Throttle(math.inf)
        self.warnings: list[str] = []
        # An item for each time within `REPORTED_TIME` at which diagnostics were made: the time
        # (s), the number of lost messages, and the number of estimator resets. Both numbers are
        # counted since the start of the node.
        self._losses: deque[tuple[float, int, int]] = deque([(self._published_at, 0, 0)])
        steady_timer(node, DIAGNOSTICS_PERIOD, self.say_when_due)

    def _recent_counts(self, now: float, lost: int, resets: int) -> tuple[int, int]:
        # Return the numbers of lost messages and of estimator resets within `REPORTED_TIME`, given
        # the numbers since the start.
        losses = self._losses
        losses.append((now, lost, resets))
        while now - losses[0][0] > diagnostics.REPORTED_TIME:
            losses.popleft()
        return lost - losses[0][1], resets - losses[0][2]

    def _explain_silence(self, now: float, state: diagnostics.InputState) -> None:
        # Log why no joint states arrive, because users look at the terminal before /diagnostics.
        topic = self._subscription.topic_name
        reason = state.silent or diagnostics.incomplete_in_words(
            self._estimator, topic, state, self.warnings
        )
        if state.silent or not reason or state.interval > STALL_INTERVAL:
            self._answered = now
        elif now - self._answered >= SILENCE_TIMEOUT:
            if not state.counts:
                given = self._subscription.given_topic
                reason = why_no_joint_states(self._node, topic, given)
            if self._throttle.passes(without_numbers(reason)):
                self._node.get_logger().warning(reason)

    def _log(self, unstamped: str, logged: Sequence[str]) -> None:
        logger = self._node.get_logger()
        if unstamped and self._first_time.passes('unstamped'):
            logger.info(f'joint states: {unstamped}')
        for sentence in self.warnings:
            if sentence not in logged and self._throttle.passes(without_numbers(sentence)):
                logger.warning(f'joint states: {sentence}')

    def say_when_due(self) -> None:
        """
        Publish the status, if the last status was published at least MIN_INTERVAL ago.

        If the node was blocked, the timer makes the delayed calls one right after another. Only
        the first of these calls publishes a status.
        """
        if time.monotonic() - self._published_at >= MIN_INTERVAL:
            self.say()

    def say(self) -> None:
        """
        Check the input since the last diagnostics, and log faults. Publish the status if
        /diagnostics has a subscriber.
        """
        node, estimator, subscription = self._node, self._estimator, self._subscription
        now, arrival = time.monotonic(), time.monotonic_ns()
        publishers = node.get_publishers_info_by_topic(subscription.given_topic)
        subscription.settle(publishers)
        lost = subscription.lost or 0
        counts, work = Counter(estimator.counts), self.work
        recent_losses, recent_resets = self._recent_counts(now, lost, counts[outcomes.RESETS])
        namesakes = namesakes_in_words(node)
        if namesakes and self._throttle.passes('namesakes'):
            node.get_logger().warning(namesakes)
        interval, news = now - self._published_at, counts - self._published_counts
        self.work, self._published_counts, self._published_at = [], counts, now
        silent, clock = self._silent(), node.get_clock()
        names = sorted(map(_name_of, publishers))
        state = diagnostics.InputState(
            counts,
            news,
            interval,
            arrival,
            names,
            recent_losses,
            recent_resets,
            'at least ' if lost and subscription.lost_is_lower_bound else '',
            work,
            self._velocity_source(),
            silent,
            [] if silent else messages_of(self._recent, arrival),
            clock.now().nanoseconds if clock.ros_time_is_active else None,
        )
        logged = list(diagnostics.message_warnings(state))
        self.warnings = [*diagnostics.input_warnings(estimator, state), *logged]
        self._log(diagnostics.unstamped_in_words(estimator, state), logged)
        self._explain_silence(now, state)
        if not self._publisher.get_subscription_count():
            return
        warnings = [namesakes, *self.warnings] if namesakes else self.warnings
        text = diagnostics.input_status(estimator, subscription, state, warnings)
        publish_statuses(node, self._publisher, {'input': text, **self._others()})
