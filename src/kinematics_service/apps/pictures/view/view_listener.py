# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Receive the inputs of the live view: joint states, and the outputs of a node.

The view shows pose, frames, Jacobian, twist, distance and level as the kinematics node publishes
them. From the joint states it computes other values (the time to the threshold, the impossible
direction of motion, the joint axes) by the functions of the node. Without a node it computes all
values.
"""

import os
import time
from typing import Any

from rclpy.context import Context
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ....estimation.estimator import Estimator, EstimatorOutput, EstimatorSettings
from ....kernel import Floats
from ....kinematics.singularity import singularity_of
from ....node.drawing.observation import Observation, observation_of
from ....node.messages.graph import kinematics_nodes
from ....node.messages.messages import sample_of, time_message
from ....node.messages.topics import DESCRIBE, JOINT_STATES, JOINT_STATES_QOS, OUTPUT_QOS, WARNING
from ....node.process.session import destroy, helper_node
from ....node.process.spin import Spinner
from ....robot.robot import Robot
from .node_facts import NodeFacts, ask_node
from .view_outputs import MAX_AGE, ViewOutputs

# Messages may arrive faster than the view reads them. The view skips older messages if its delay
# exceeds this value (s).
MAX_DELAY = 0.2
# Period of the requests for a node's description, s.
REQUEST_PERIOD = 1.0
# Time limit for the description of a node that has changed, s.
ANSWER_TIMEOUT = 0.5


class ViewListener:
    """
    The ROS node of the view: it subscribes to an arm's topics, and can publish the positions of
    the sliders.

    Parameters
    ----------
    context
        The ROS context of the node; `close` does not shut it down.
    source
        Full name of the kinematics node.

    Attributes
    ----------
    facts
        The last description of the kinematics node, or None if none has arrived.
    """

    def __init__(self, context: Context, source: str) -> None:
        self.source = '/' + source.strip('/')
        self._node = helper_node(f'kinematics_view_{os.getpid()}', context)
        self._spinner = Spinner(context, [self._node])
        self.facts: NodeFacts | None = None
        self._known_publishers: frozenset[bytes] = frozenset()
        self._request_time = -REQUEST_PERIOD
        self._estimator: Estimator | None = None
        self._answer: EstimatorOutput | None = None
        self._arrival = 0.0
        self._joint_states = 0
        self._publisher: Any = None
        self._subscription: Any = None
        self._mismatch = self._edited = ''
        self.outputs = ViewOutputs(self._node, self.source)
        self._client = self._node.create_client(Trigger, DESCRIBE.replace('~', self.source))
        self._request: Any = None

    def close(self) -> None:
        """Destroy the node."""
        self._spinner.close()
        destroy(self._node)

    def listen(self, seconds: float) -> None:
        """
        Receive messages for `seconds`, then read the messages that are still waiting.
        """
        deadline = time.monotonic() + seconds
        while (remaining := deadline - time.monotonic()) > 0.0:
            self._spinner.spin_once(timeout_sec=remaining)
        while time.monotonic() < deadline + MAX_DELAY:
            before = self._message_count
            self._spinner.spin_once(timeout_sec=0.0)
            if self._message_count == before:
                return
        self._spinner.catch_up(MAX_DELAY)

    @property
    def _message_count(self) -> int:
        return self._joint_states + self.outputs.count

    def ask(self, timeout: float) -> NodeFacts | None:
        """
        Ask the kinematics node for its description, and wait at most `timeout` s. Return the last
        description received.
        """
        self._request_time, self._request = time.monotonic(), None
        facts = ask_node(self._node, self._spinner, self.source, timeout)
        if facts is not None:
            self.facts, self._known_publishers = facts, self._publishers()
        return self.facts

    def changed(self) -> bool:
        """
        Return whether the kinematics node has appeared, restarted or changed; then `facts` has its
        new description.
        """
        answer = self._request
        if answer is not None and answer.done():
            self._request = None
            text = '' if answer.exception() else answer.result().message
            before = self.facts
            restarted = self._publishers() - self._known_publishers
            if text and (before is None or text != before.text or restarted):
                return self.ask(ANSWER_TIMEOUT) is not before
        if time.monotonic() - self._request_time > REQUEST_PERIOD:
            self._request_time = time.monotonic()
            if self._request is not None:  # the node ended without an answer
                self._client.remove_pending_request(self._request)
            ready = self._client.service_is_ready()
            self._request = self._client.call_async(Trigger.Request()) if ready else None
        return False

    def _publishers(self) -> frozenset[bytes]:
        # Return the identifiers of the kinematics node's publishers, which change if the node
        # restarts.
        topic = WARNING.replace('~', self.source)
        infos = self._node.get_publishers_info_by_topic(topic)
        return frozenset(bytes(info.endpoint_gid) for info in infos)

    def sources(self) -> tuple[str, ...]:
        """Return the full names of the running kinematics nodes."""
        return tuple(kinematics_nodes(self._node))

    def show(self, robot: Robot) -> None:
        """Subscribe to the joint states of an arm."""
        facts, self._answer = self.facts, None
        self._mismatch = self._edited = ''
        namespace = self.source.rpartition('/')[0]
        topic = f'{namespace}/{JOINT_STATES}'
        if facts is not None:
            self._mismatch, self._edited = facts.mismatch(robot), facts.edited(robot)
            topic = facts.joint_states
            robot = robot if self._mismatch else facts.judged(robot)
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._estimator = Estimator(robot, EstimatorSettings())
        self._names = robot.joint_names
        self._subscription = self._node.create_subscription(
            JointState, topic, self._take, JOINT_STATES_QOS
        )

    def _take(self, message: JointState) -> None:
        assert self._estimator is not None
        self._joint_states += 1
        try:
            output = self._estimator.take(sample_of(message, self._node.get_clock()))
        except Exception as error:  # a faulty message must not end the view
            self._node.get_logger().error(f'joint state: {error!a}')
            return
        if isinstance(output, EstimatorOutput):
            self._answer, self._arrival = output, time.monotonic()

    @property
    def _live(self) -> bool:
        return self._answer is not None and time.monotonic() - self._arrival < MAX_AGE

    @property
    def _node_live(self) -> bool:
        return self.facts is not None and not self._mismatch and self.outputs.live

    @property
    def status(self) -> str:
        """Return one line of text: whether sliders, joint states or a node move the shown arm."""
        if self._mismatch:
            return self._mismatch
        topic = JOINT_STATES if self._subscription is None else self._subscription.topic_name
        if not self._live:
            return f'moved by the sliders: no joint states arrive on {topic}'
        if self._node_live:
            live = f'live from {self.source}, {self.outputs.pose.rate():.0f} Hz'
            return f'{live}; {self._edited}' if self._edited else live
        silent = 'sends nothing' if self.facts is not None else 'does not run'
        return f'live from {topic}; the node {self.source} {silent}'

    def observation(self) -> Observation | None:
        """Return the newest observation, or None while joint states are missing."""
        if not self._live or self._mismatch:
            return None
        assert self._answer is not None
        state = self._answer.state
        seen = observation_of(state, singularity_of(state))
        if self.facts is not None and self._node_live:
            return self.outputs.shown(seen, self.facts.axes)
        return seen

    def publish(self, q: Floats) -> str:
        """
        Publish joint positions. If another node publishes joint states, publish nothing and return
        the reason.
        """
        assert self._subscription is not None
        topic = self._subscription.topic_name
        if self._publisher is None or self._publisher.topic_name != topic:
            if self._publisher is not None:
                self._node.destroy_publisher(self._publisher)
            self._publisher = self._node.create_publisher(JointState, topic, OUTPUT_QOS)
        if self._node.count_publishers(topic) > 1:
            return f'there is another publisher on {topic}'
        message = JointState(name=self._names, position=q.tolist())
        message.header.stamp = time_message(self._node.get_clock().now().nanoseconds)
        self._publisher.publish(message)
        return ''
