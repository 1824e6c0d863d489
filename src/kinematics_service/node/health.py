"""The node's diagnostics: once a second, its input and the outcome of each message."""

import math
import re
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..estimation.estimator import RESETS, Estimator
from ..estimation.input_checks import messages_of
from ..estimation.status_text import StatusText
from .diagnostics import (
    RECENT,
    InputState,
    Work,
    incomplete_in_words,
    input_status,
    input_warnings,
    message_warnings,
    unstamped_in_words,
)
from .input import Input
from .messages.graph import kinematics_nodes
from .messages.messages import full_name, status_message
from .messages.topics import DIAGNOSTICS, DIAGNOSTICS_QOS, POSE
from .steady_time import Throttle, steady_timer

PERIOD = 1.0
# After a stall the timer makes up for its calls, some at once: a rate over a shorter time means
# nothing, so nothing is said.
SHORTEST = 0.5 * PERIOD
# A node that was not turned for longer (s) cannot have heard a message.
STALL = 2.0 * PERIOD
# The log says why no joint state comes after this time, s, and again after the other.
PATIENCE, AGAIN = 5.0, 60.0
JOINT_STATES = 'sensor_msgs/msg/JointState'
# The node of a publisher that was discovered before its node.
UNKNOWN = '_NODE_NAME_UNKNOWN_'


def why_no_joint_states(node: Node, topic: str, given: str) -> str:
    """
    Return that no joint state comes on a topic, and the topics on which others publish some.

    `given`: its name before names are remapped.
    """
    kinds = {
        kind
        for name, kinds in node.get_topic_names_and_types()
        if name == topic
        for kind in kinds
        if kind != JOINT_STATES
    }
    who = 'its publishers are silent' if node.count_publishers(topic) else 'nobody publishes it'
    if kinds:
        who = f'it is published as {", ".join(sorted(kinds))}, not as {JOINT_STATES}'
    # The joint states that a kinematics node publishes are goals.
    nodes = tuple(f'{name}/' for name in kinematics_nodes(node))
    own = {topic, *(publisher.topic_name for publisher in node.publishers)}
    others = sorted(
        name
        for name, types in node.get_topic_names_and_types()
        if JOINT_STATES in types and name not in own and not name.startswith(nodes)
        # Unlike get_publishers_info_by_topic, this does not remap the name.
        if node.count_publishers(name)
    )
    elsewhere = 'no other topic here has a publisher of joint states'
    if others:
        elsewhere = f'joint states are published on {", ".join(others)}'
        elsewhere += f': try -r {given}:={others[0]}'
    return f'no joint state has come on {topic}: {who}; {elsewhere}'


def namesakes_in_words(node: Node) -> str:
    """Return that other nodes publish the node's poses, too; empty if none does."""
    publishers = node.get_publishers_info_by_topic(POSE)
    names = [_name_of(info) for info in publishers if info.node_name != UNKNOWN]
    if (own := f'/{full_name(node)}') in names:
        names.remove(own)
    if not names:
        return ''
    who, topic = ' and '.join(dict.fromkeys(names)), node.resolve_topic_name(POSE)
    return f'a second node, {who}, publishes {topic}, too: end it, or rename it (-r __node:=NAME)'


def _name_of(info: TopicEndpointInfo) -> str:
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def without_numbers(sentence: str) -> str:
    """Return the cause: sentences that differ in numbers or behind their colon have the same."""
    return re.sub(r'[\d.]+', '', sentence.partition(':')[0])


def diagnostics_publisher(node: Node) -> Publisher:
    """Return a publisher of /diagnostics."""
    return node.create_publisher(DiagnosticArray, DIAGNOSTICS, DIAGNOSTICS_QOS)


def publish_statuses(node: Node, publisher: Publisher, statuses: Mapping[str, StatusText]) -> None:
    """Publish statuses of a node, by their subjects, in one message."""
    message, name = DiagnosticArray(), full_name(node)
    message.header.stamp = node.get_clock().now().to_msg()
    message.status = [status_message(f'{name}: {of}', text) for of, text in statuses.items()]
    publisher.publish(message)


class Health:
    """
    Counts work and publishes the state of the input once a second.

    Attributes
    ----------
    work
        Processing times of messages since the last diagnostics.
    warnings
        The warnings about the input of the last diagnostics.
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
        self.work = Work()
        self._node, self._publisher, self._estimator = node, publisher, estimator
        self._subscription, self._recent = joint_states.subscription, joint_states.recent
        self._others = others
        self._velocity_source, self._silent = velocity_source, silent
        self._counts_said: Counter[str] = Counter()
        self._said = self._answered = time.monotonic()
        self._throttle, self._once = Throttle(AGAIN), Throttle(math.inf)
        self.warnings: list[str] = []
        # Times of diagnostics, s, and the numbers of messages lost and of resets by then.
        self._losses: deque[tuple[float, int, int]] = deque([(self._said, 0, 0)])
        steady_timer(node, PERIOD, self.say_when_due)

    def _of_late(self, now: float, lost: int, resets: int) -> tuple[int, int]:
        # Messages lost and resets within `RECENT`.
        losses = self._losses
        losses.append((now, lost, resets))
        while now - losses[0][0] > RECENT:
            losses.popleft()
        return lost - losses[0][1], resets - losses[0][2]

    def _explain_silence(self, now: float, heard: InputState) -> None:
        # The node's own terminal is where people look.
        topic = self._subscription.topic_name
        why = heard.silent or incomplete_in_words(self._estimator, topic, heard, self.warnings)
        if heard.silent or not why or heard.interval > STALL:
            self._answered = now
        elif now - self._answered >= PATIENCE:
            if not heard.counts:
                given = self._subscription.given_topic
                why = why_no_joint_states(self._node, topic, given)
            if self._throttle.passes(without_numbers(why)):
                self._node.get_logger().warning(why)

    def _log(self, unstamped: str, logged: Sequence[str]) -> None:
        logger = self._node.get_logger()
        if unstamped and self._once.passes('unstamped'):
            logger.info(f'joint states: {unstamped}')
        for sentence in self.warnings:
            if sentence not in logged and self._throttle.passes(without_numbers(sentence)):
                logger.warning(f'joint states: {sentence}')

    def say_when_due(self) -> None:
        """Say it, but not where the timer makes up for a call soon after another."""
        if time.monotonic() - self._said >= SHORTEST:
            self.say()

    def say(self) -> None:
        """Check the input since the last diagnostics; publish its state if anybody listens."""
        node, estimator, subscription = self._node, self._estimator, self._subscription
        now, arrival = time.monotonic(), time.monotonic_ns()
        publishers = node.get_publishers_info_by_topic(subscription.given_topic)
        subscription.settle(publishers)
        lost = subscription.lost or 0
        counts, work = Counter(estimator.counts), self.work
        lost_of_late, resets_of_late = self._of_late(now, lost, counts[RESETS])
        namesakes = namesakes_in_words(node)
        if namesakes and self._throttle.passes('namesakes'):
            node.get_logger().warning(namesakes)
        interval, news = now - self._said, counts - self._counts_said
        self.work, self._counts_said, self._said = Work(), counts, now
        silent, clock = self._silent(), node.get_clock()
        names = sorted(map(_name_of, publishers))
        heard = InputState(
            counts,
            news,
            interval,
            arrival,
            names,
            lost_of_late,
            resets_of_late,
            'at least ' if lost and subscription.lost_is_lower_bound else '',
            work,
            self._velocity_source(),
            silent,
            [] if silent else messages_of(self._recent, arrival),
            clock.now().nanoseconds if clock.ros_time_is_active else None,
        )
        logged = list(message_warnings(heard))
        self.warnings = [*input_warnings(estimator, heard), *logged]
        self._log(unstamped_in_words(estimator, heard), logged)
        self._explain_silence(now, heard)
        if not self._publisher.get_subscription_count():
            return
        warnings = [namesakes, *self.warnings] if namesakes else self.warnings
        text = input_status(estimator, subscription, heard, warnings)
        publish_statuses(node, self._publisher, {'input': text, **self._others()})
