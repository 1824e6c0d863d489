# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Keep the last message of a topic, the number of messages, and their rate."""

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

# Time over which the rate of messages is computed, s.
RATE_WINDOW = 2.0


class LatestMessage:
    """
    A subscription that keeps the last message, and decodes it when it is read.

    Parameters
    ----------
    node, topic, type, qos
        The arguments of `Node.create_subscription`.
    then
        A function that is called with the bytes of each kept message; None: no call.
    accepts
        A function that returns whether to keep a message; None: keep every message.

    Attributes
    ----------
    topic
        Resolved name of the topic.
    count
        Number of kept messages so far.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        type: Any,
        qos: QoSProfile,
        then: Callable[[bytes], None] | None = None,
        accepts: Callable[[Any], bool] | None = None,
    ) -> None:
        self.count, self._accepts = 0, accepts
        self._type, self._then = type, then
        self._bytes: bytes | None = None
        self._message: Any = None
        self._arrival = time.monotonic()
        self._marks: deque[tuple[float, int]] = deque([(self._arrival, 0)])
        self.topic = node.create_subscription(type, topic, self._take, qos, raw=True).topic_name

    def _take(self, message: bytes) -> None:
        if self._accepts and not self._accepts(deserialize_message(message, self._type)):
            return
        self.count += 1
        self._bytes, self._message = message, None
        self._arrival = time.monotonic()
        if self.count == 1:
            self._marks = deque([(self._arrival, 1)])
        if self._then is not None:
            self._then(message)

    @property
    def message(self) -> Any:
        """Return the last message; None before the first message."""
        if self._message is None and self._bytes is not None:
            self._message = deserialize_message(self._bytes, self._type)
        return self._message

    @property
    def age(self) -> float:
        """Return the time since the last message, or since the start of the subscription, s."""
        return time.monotonic() - self._arrival

    def rate(self) -> float:
        """
        Return the mean rate of messages, 1/s, since the last call of this method that is at least
        `RATE_WINDOW` ago, or since the first call.
        """
        now = time.monotonic()
        self._marks.append((now, self.count))
        while len(self._marks) > 2 and now - self._marks[1][0] >= RATE_WINDOW:
            self._marks.popleft()
        then, count = self._marks[0]
        return (self.count - count) / (now - then) if now > then else 0.0
