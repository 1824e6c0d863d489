# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Subscribe to joint states, as bytes or as messages of rclpy."""

import time
from collections import deque
from collections.abc import Callable

from rclpy.node import Node
from sensor_msgs.msg import JointState

from ..errors import WireError
from ..estimation.estimator import JointMessage
from ..estimation.input_checks import MESSAGE_LIMIT, SIZE_LIMIT
from ..estimation.joint_sample import JointSample
from ..estimation.joint_state_form import JointStateForm, SerializedSample
from .best_subscription import BestSubscription
from .messages.joint_state_reader import JointStateReader
from .messages.topics import JOINT_STATES_QOS


class Input:
    """
    The subscription of the node to joint states.

    Parameters
    ----------
    node
        The node that subscribes.
    topic
        The topic of the joint states.
    transport
        `bytes` or `messages`.
    take
        A function that is called with each message, and returns whether it accepts the message.
        With the transport `bytes`, it gets the bytes of the message if an earlier message had the
        same form (size, joint names, offsets of numbers). In all other cases, and if it does not
        accept the bytes, it gets the decoded message.
    refuse
        A function that is called with a sentence if bytes are not a JointState.

    Attributes
    ----------
    subscription
        The subscription, with its reliability and its number of lost messages.
    recent
        Times of arrival (steady clock, ns) and bytes of the last messages, for the diagnostics.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        transport: str,
        take: Callable[[JointMessage], bool],
        refuse: Callable[[str], None],
    ) -> None:
        self._take, self._refuse = take, refuse
        self._clock = node.get_clock()
        self._reader = JointStateReader()
        # Form of the last message: its size, joint names, and offsets of numbers.
        self._form: JointStateForm | None = None
        self.recent: deque[tuple[int, bytes]] = deque(maxlen=MESSAGE_LIMIT)
        self.subscription = BestSubscription(
            node,
            JointState,
            topic,
            JOINT_STATES_QOS,
            self._on_bytes if transport == 'bytes' else self._on_message,
            lambda: self._form.size if self._form is not None else 0,
        )

    def _keep(self, data: bytes, arrival: int) -> None:
        if len(data) <= SIZE_LIMIT:
            self.recent.append((arrival, data))

    def _on_message(self, data: bytes) -> None:
        arrival = time.monotonic_ns()
        self._keep(data, arrival)
        self.subscription.fit(len(data))
        self._read(self._reader.read_officially, data, arrival)

    def _on_bytes(self, data: bytes) -> None:
        arrival = time.monotonic_ns()
        self._keep(data, arrival)
        form = self._form
        if form is not None and self._take(SerializedSample(form, data, arrival)):
            return
        self.subscription.fit(len(data))
        for form in self._reader.forms(len(data)):
            if form is not self._form and self._take(SerializedSample(form, data, arrival)):
                self._form = form
                return
        self._read(self._reader.read, data, arrival)

    def _read(self, read: Callable[[bytes], JointSample], data: bytes, arrival: int) -> None:
        try:
            sample = read(data)
        except WireError as error:
            self._refuse(str(error))
            return
        received = sample.stamp or int(self._clock.now().nanoseconds)
        self._take(sample._replace(received=received, arrival=arrival))
