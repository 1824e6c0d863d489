"""
A subscription that is reliable if every publisher offers that, and receives from the others, too.

`ReliabilityPolicy.BEST_AVAILABLE` is settled when a subscription is created, by the publishers
known then: messages of one that comes later and offers less would never be received.
"""

import copy
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .losses import Losses

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
# Number of messages remembered while two subscriptions receive the same ones, so that each is
# taken once.
REMEMBERED = 4096
# The former one ends this time (s) after the new one is connected to every publisher.
OVERLAP = 1.0

Take = Callable[[bytes], None]
Info = Mapping[str, Any]


class BestSubscription:
    """
    Subscribes to a topic as bytes, as reliably as its publishers offer, and counts lost messages.

    It begins reliable. When a publisher comes that offers best effort only, a second subscription
    with best effort replaces the first one; when the last such publisher is gone, a reliable one
    replaces that. While there are two, each message is taken once.

    Parameters
    ----------
    node, kind, topic
        As for `Node.create_subscription`.
    qos
        With `ReliabilityPolicy.BEST_AVAILABLE`. A user's override by parameter is final.
    take
        Called with each message.
    """

    def __init__(self, node: Node, kind: Any, topic: str, qos: QoSProfile, take: Take) -> None:
        self._node, self._kind, self._topic, self._take = node, kind, topic, take
        self._adapts = False
        self._lost: int | None = 0  # by subscriptions that are closed
        # The messages taken recently, while some of them may come once more.
        self._recent: dict[tuple[int | None, int], None] | None = None
        self._former: _Numbered | None = None
        self._all_heard_since = 0.0  # time since which all publishers are connected, s
        self._qos = copy.copy(qos)  # overrides are written into it
        self._current = self._open(
            QoSOverridingOptions.with_default_policies(callback=self._settle_reliability)
        )

    def _settle_reliability(self, qos: QoSProfile) -> SetParametersResult:
        # After a user's overrides.
        if qos.reliability is ReliabilityPolicy.BEST_AVAILABLE:
            self._adapts = True
            qos.reliability = RELIABLE
        return SetParametersResult(successful=True)

    def _open(self, overrides: QoSOverridingOptions | None = None) -> '_Numbered':
        return _Numbered(
            self._node,
            self._kind,
            self._topic,
            self._qos,
            self._heard,
            self._on_incompatible,
            overrides,
        )

    @property
    def topic_name(self) -> str:
        """Return the full name of the topic."""
        return str(self._current.subscription.topic_name)

    @property
    def publisher_count(self) -> int:
        """Return the number of publishers that are connected."""
        return int(self._current.subscription.get_publisher_count())

    @property
    def is_reliable(self) -> bool:
        """Return whether lost messages are sent again."""
        return self._current.reliability is RELIABLE

    @property
    def lost(self) -> int | None:
        """Return the number of messages lost, None if the middleware does not number them."""
        now = self._current.losses.count
        return None if now is None or self._lost is None else now + self._lost

    def settle(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        """Adapt to the publishers of the topic; the node calls it periodically."""
        now = time.monotonic()
        if self.publisher_count < len(publishers):
            self._all_heard_since = now
        elif now - self._all_heard_since < OVERLAP:
            pass
        elif self._former is not None:
            self._end(self._former)
            self._former, self._all_heard_since = None, now
        else:
            self._recent = None
            offered = [info.qos_profile.reliability for info in publishers]
            if self._adapts and not self.is_reliable and BEST_EFFORT not in offered and offered:
                self._change(RELIABLE)

    def _end(self, former: '_Numbered') -> None:
        former.take_what_waits()
        count = former.losses.count
        self._lost = None if count is None or self._lost is None else self._lost + count
        self._node.destroy_subscription(former.subscription)

    def _change(self, reliability: ReliabilityPolicy) -> None:
        self._all_heard_since = time.monotonic()
        if self._former is not None:  # it has the other reliability
            self._current, self._former = self._former, self._current
            return
        self._former, self._recent = self._current, {}
        self._qos = copy.copy(self._qos)
        self._qos.reliability = reliability
        self._current = self._open()

    def _heard(self, one: '_Numbered', data: bytes, info: Info) -> None:
        if self._recent is not None:
            if self._former is not None and one is self._current:
                self._former.take_what_waits()  # which is older
            key = info['publication_sequence_number'], info['source_timestamp']
            if key in self._recent:
                return
            self._recent[key] = None
            if len(self._recent) > REMEMBERED:
                del self._recent[next(iter(self._recent))]
        self._take(data)

    def _on_incompatible(self, event: Any) -> None:
        kind = event.last_policy_kind
        if kind == QoSPolicyKind.RELIABILITY and self._adapts:
            if self.is_reliable:
                self._change(BEST_EFFORT)
            return
        self._node.get_logger().warning(
            f'messages of a publisher of {self.topic_name} are not received: its quality of '
            f'service does not match ({qos_policy_name_from_kind(kind)})'
        )


class _Numbered:
    # One subscription of rclpy, with the numbers of its messages looked at.

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        qos: QoSProfile,
        take: Callable[['_Numbered', bytes, Info], None],
        on_incompatible: Callable[[Any], None],
        overrides: QoSOverridingOptions | None,
    ) -> None:
        self.losses = losses = Losses(lambda: int(self.subscription.get_publisher_count()))
        heard = losses.heard

        def taken(*arguments: Any) -> None:
            # `EventsExecutor` of Jazzy hands over message and information as one tuple.
            data, info = arguments if len(arguments) == 2 else arguments[0]
            heard(info['publication_sequence_number'])
            take(self, data, info)

        # rclpy looks at this to see whether the information is wanted.
        setattr(taken, '__signature__', inspect.signature(lambda data, info: None))  # noqa: B010
        self.subscription = node.create_subscription(
            kind,
            topic,
            taken,
            qos,
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=on_incompatible,
                matched=lambda event: losses.forget(),
            ),
            qos_overriding_options=overrides,
        )
        self.reliability = qos.reliability
        self._taken = taken

    def take_what_waits(self) -> None:
        """Take the messages that the executor has not handled."""
        handle = self.subscription.handle
        with handle:
            while (message := handle.take_message(self.subscription.msg_type, True)) is not None:
                self._taken(message)
