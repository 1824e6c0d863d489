"""
Joint states as they come in: as bytes, or as messages of rclpy.

"""

import copy
import time
from collections.abc import Callable

from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState

from ..joint_sample import JointSample
from .messages import sample_of, stamp_of
from .topics import JOINT_STATES, JOINT_STATES_QOS
from .wire_reader import JointStateReader, WireError

UNREADABLE = 'not a JointState'


class Input:
    """
    The subscription to joint states.

    Parameters
    ----------
    node
        The node it belongs to.
    transport
        `bytes` or `messages`.
    take
        Called with each sample.
    drop
        Called with the reason where there is none: what is no JointState, the middleware would
        have dropped before a message was made of it.

    """

    def __init__(
        self,
        node: Node,
        transport: str,
        take: Callable[[JointSample], None],
        drop: Callable[[str], None],
    ) -> None:
        self._take, self._drop = take, drop
        self._clock = node.get_clock()
        self._reader = JointStateReader()
        raw = transport == 'bytes'
        # Overrides are written into the profile that is given: it must be a copy.
        self.subscription = node.create_subscription(
            JointState,
            JOINT_STATES,
            self._on_bytes if raw else self._on_message,
            copy.copy(JOINT_STATES_QOS),
            raw=raw,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    @property
    def topic_name(self) -> str:
        """
        Return the full name of the topic.

        """
        return str(self.subscription.topic_name)

    def _received(self, stamp: int) -> int:
        return stamp or int(self._clock.now().nanoseconds)

    def _on_message(self, message: JointState) -> None:
        received = self._received(stamp_of(message))
        self._take(sample_of(message, received, time.monotonic_ns()))

    def _on_bytes(self, data: bytes) -> None:
        try:
            names, positions, velocities, stamp = self._reader.read(data)
        except WireError:
            self._drop(UNREADABLE)
            return
        arrival = time.monotonic_ns()
        self._take(
            JointSample(names, positions, velocities, stamp, self._received(stamp), arrival)
        )
