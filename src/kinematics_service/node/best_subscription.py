# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Subscribe to a topic with the reliability of its publishers and a queue of limited size.

With `ReliabilityPolicy.BEST_AVAILABLE`, rclpy chooses the reliability once, when a subscription is
created, from the publishers at that time. If it chooses `RELIABLE`, the subscription never
receives messages of a best-effort publisher that starts later. So this module changes the
reliability later by a new subscription.
"""

import contextlib
import copy
import ctypes
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .losses import Losses
from .waiting_messages import take_waiting

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
# Largest number of remembered messages. While two subscriptions exist, both receive every message.
# The messages from either are remembered, so that the copy from the other is ignored.
MAX_REMEMBERED = 4096
# Time (s) for which a replaced subscription is kept after its successor is connected to every
# publisher.
OVERLAP_TIME = 1.0
# Largest size of the queue in the middleware (bytes), unless a single message is larger. The node
# reads a queue of this size in 0.5 s. Reading one message of 10,000 joints takes 16 ms.
MAX_QUEUE_SIZE = 1 << 23
# Size (bytes) of a message above which 1000 such messages exceed `MAX_QUEUE_SIZE`.
LARGE_SIZE = MAX_QUEUE_SIZE // 1000
# Time (s) without large messages after which a shortened queue gets its full depth again.
DEPTH_RECOVERY_TIME = 10.0

Take = Callable[[bytes], None]
Info = Mapping[str, Any]
# The messages remembered while two subscriptions exist, in the order of arrival. A key of the
# dictionary is the sequence number and the send time of a message.
Recent = dict[tuple[int | None, int], None]


class BestSubscription:
    """
    Subscribes to the bytes of a topic's messages, and counts lost messages. The subscription is
    reliable if all publishers offer reliability.

    The first subscription has best effort, which every publisher matches. A reliable subscription
    would make the middleware of a best-effort publisher log an error. If all publishers offer
    reliability, and no publisher started or ended between two calls of `settle`, a reliable
    subscription replaces the first one. If a best-effort publisher starts, or the last publisher
    ends, a best-effort subscription replaces the reliable subscription. While two subscriptions
    exist, each message is taken once.

    The middleware limits a queue by the number of messages, not by their size, and keeps the
    memory of old messages. If messages are large, a subscription with a shorter queue replaces the
    present subscription.

    Parameters
    ----------
    node, kind, topic
        The arguments of `Node.create_subscription`: node, message type, and name of the topic.
    qos
        Quality of service with `ReliabilityPolicy.BEST_AVAILABLE`. If a parameter overrides this
        policy, the subscription keeps the reliability of the parameter.
    take
        A function that is called with each message.
    size
        A function that returns the size (bytes) of the last message, or 0 if the size is unknown.
        The method `settle` calls this function periodically and shortens the queue if messages are
        large. To shorten the queue at once, for example when messages become larger, call the
        method `fit`.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        qos: QoSProfile,
        take: Take,
        size: Callable[[], int] = lambda: 0,
    ) -> None:
        self._node, self.given_topic, self._take = node, topic, take
        self._size = size
        self._adapts = False
        # Number of messages that were lost by earlier subscriptions, before each was replaced.
        # `_lost_more` is true if this number is a lower bound.
        self._lost: int | None = 0
        self._lost_more = False
        # The remembered messages, by which a second copy of a message is recognized. None if only
        # one subscription receives messages.
        self._recent: Recent | None = None
        self._former: _CountedSubscription | None = None
        self._all_connected_since = 0.0  # time since which all publishers are connected, s
        # Time of arrival (s) of the last large message. A message is large if a full queue of such
        # messages would exceed `MAX_QUEUE_SIZE`.
        self._large_message_time = 0.0
        self._qos = copy.copy(qos)  # a copy, because rclpy writes overrides into this profile
        self._open = partial(_CountedSubscription, node, kind, topic, self._on_message)
        overrides = QoSOverridingOptions.with_default_policies(callback=self._settle_reliability)
        self._current = self._open(self._qos, overrides)
        self._counting = self._current  # the subscription whose losses are counted
        self._next_qos = self._qos
        self._full_depth = self._qos.depth
        # the ids of the publishers at the last call of `settle`
        self._known_publishers: set[tuple[int, ...]] = set()
        # whether events of a subscription that was ended may still be in the executor's queue
        self._is_ending = False

    def _settle_reliability(self, qos: QoSProfile) -> SetParametersResult:
        # rclpy calls this function after it has applied the parameters that override the quality
        # of service.
        if qos.reliability is ReliabilityPolicy.BEST_AVAILABLE:
            self._adapts = True
            qos.reliability = BEST_EFFORT
        return SetParametersResult(successful=True)

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
        """Return whether the middleware sends lost messages again."""
        return self._qos.reliability is RELIABLE

    @property
    def lost(self) -> int | None:
        """Return the number of lost messages; None if the middleware does not number messages."""
        now = self._counting.losses.count
        return None if now is None or self._lost is None else now + self._lost

    @property
    def lost_is_lower_bound(self) -> bool:
        """Return whether `lost` is a lower bound of the number of lost messages."""
        return self._lost_more or self._counting.losses.is_lower_bound

    def settle(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        """
        Adapt reliability and queue to the publishers of the topic; the node calls this method
        periodically.
        """
        now = time.monotonic()
        self.fit(self._size())
        self._follow_publishers(publishers)
        if self.publisher_count < len(publishers):
            self._all_connected_since = now
        elif now - self._all_connected_since < OVERLAP_TIME:
            pass
        elif self._former is not None:
            self._take_waiting(self._former)
            self._end(self._former)
            self._all_connected_since = now
        elif not self._is_ending:
            self._recent = None
            if (
                self._qos.depth < self._full_depth
                and now - self._large_message_time > DEPTH_RECOVERY_TIME
            ):
                self._set_policies(depth=self._full_depth)
        if self._next_qos is not self._qos:
            self._replace()

    def fit(self, size: int) -> None:
        """Shorten the queue if many messages of this size (bytes) would take too much memory."""
        if size * self._full_depth <= MAX_QUEUE_SIZE:
            return
        self._large_message_time = time.monotonic()
        # round down to a power of 2, so that the depth changes rarely
        depth = 1 << max(MAX_QUEUE_SIZE // size, 1).bit_length() - 1
        if depth < self._next_qos.depth:
            self._set_policies(depth=depth)

    def _set_policies(self, **policies: Any) -> None:
        # Store quality-of-service policies. `_replace` applies them between two messages, by a new
        # subscription.
        qos = copy.copy(self._next_qos)
        for policy, value in policies.items():
            setattr(qos, policy, value)
        self._next_qos = self._qos if qos == self._qos else qos

    def _replace(self) -> None:
        former = self._former
        if former is not None:
            # take the older messages of the former subscription first
            self._take_waiting(former)
            if former is not self._former or former.qos != self._next_qos:
                # At most two subscriptions may exist. So only end the former subscription here.
                # The next call of `_replace` opens the new subscription.
                self._end(former)
                return
            self._current, self._former = former, self._current
        elif self._is_ending:
            return
        else:
            self._former, self._recent = self._current, {}
            self._current = self._open(self._next_qos)
        self._qos = self._next_qos
        self._all_connected_since = time.monotonic()

    def _end(self, former: '_CountedSubscription') -> None:
        if former is not self._former or former.subscription not in self._node.subscriptions:
            return  # it has ended, or `PassedOver` (which skips messages) has removed it for now
        self._former = None
        if self._counting is former:
            lost, now = self.lost, self._current.losses.count
            self._lost_more = self.lost_is_lower_bound
            self._lost = None if lost is None or now is None else lost - now
            self._counting = self._current
        self._is_ending = True
        former.end(self._has_ended)

    def _has_ended(self) -> None:
        self._is_ending = False
        # Return freed memory to the system, because the allocator would keep 200 MiB after large
        # messages.
        with contextlib.suppress(OSError, AttributeError):  # only glibc has malloc_trim
            ctypes.CDLL(None).malloc_trim(0)

    def _on_message(self, subscription: '_CountedSubscription', data: bytes, info: Info) -> None:
        former = self._former
        if self._recent is None:
            self._take(data)
        elif self._is_ending and (len(data) > LARGE_SIZE or subscription is not self._current):
            return  # ignore messages until the memory of the ending subscription is free
        else:
            if former is not None and subscription is not former:
                # take the older messages of the former subscription first
                self._take_waiting(former)
            self._take_once(self._recent, data, info)
            if former is not None and former.qos.depth > self._qos.depth:
                # Messages are large, so the present queue was shortened. The former subscription's
                # queue is longer, and would take too much memory. Empty this queue.
                self._take_waiting(former)
                if subscription is self._current:
                    self._end(former)
        if self._next_qos is not self._qos:
            self._replace()

    def _take_once(self, recent: Recent, data: bytes, info: Info) -> None:
        key = info['publication_sequence_number'], info['source_timestamp']
        if key in recent:
            return
        recent[key] = None
        if len(recent) > MAX_REMEMBERED:
            del recent[next(iter(recent))]
        self._take(data)

    def _take_waiting(self, former: '_CountedSubscription') -> None:
        recent = self._recent
        if former is not self._former or recent is None:
            return  # the former subscription has ended already
        newest, count = take_waiting(former.subscription, self._qos.depth)
        # If the former subscription had more waiting messages than the present queue can hold,
        # take only the newest message, and end the former subscription.
        is_full = count > len(newest)
        for data, info in (newest[-1],) if is_full else newest:
            former.losses.take(info['publication_sequence_number'], info['source_timestamp'])
            self._take_once(recent, data, info)
        if is_full:
            self._end(former)

    def _follow_publishers(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        # Compare the publishers at each call, and do not use events of the middleware.
        # `EventsExecutor` would end the process if its queue contained an event of a destroyed
        # subscription.
        offered = {tuple(info.endpoint_gid): info.qos_profile for info in publishers}
        before, self._known_publishers = self._known_publishers, set(offered)
        has_changed = before != self._known_publishers
        if has_changed:
            for subscription in {self._counting, self._current}:
                subscription.losses.publishers_changed()
        is_reliable = {qos.reliability for qos in offered.values()} == {RELIABLE}
        if self._adapts and not (is_reliable and has_changed):
            self._set_policies(reliability=RELIABLE if is_reliable else BEST_EFFORT)
        for publisher in self._known_publishers - before:
            compatibility, reason = qos_check_compatible(offered[publisher], self._next_qos)
            if compatibility == QoSCompatibility.ERROR:
                self._node.get_logger().warning(
                    f'messages of a publisher of {self.topic_name} are not received: its quality '
                    f'of service does not match ({reason})'
                )


class _CountedSubscription:
    # A subscription of rclpy that counts its lost messages.

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        take: Callable[['_CountedSubscription', bytes, Info], None],
        qos: QoSProfile,
        overrides: QoSOverridingOptions | None = None,
    ) -> None:
        self._node, self.qos = node, qos
        self.losses = losses = Losses(self._publishers)
        count = losses.take

        def taken(*arguments: Any) -> None:
            # Accept two arguments or one tuple, because `EventsExecutor` of Jazzy passes message
            # and information as one tuple.
            data, info = arguments if len(arguments) == 2 else arguments[0]
            count(info['publication_sequence_number'], info['source_timestamp'])
            take(self, data, info)

        # Set a signature with two arguments, from which rclpy finds out that the callback takes
        # the information about a message.
        setattr(taken, '__signature__', inspect.signature(lambda data, info: None))  # noqa: B010
        self.subscription = node.create_subscription(
            kind,
            topic,
            taken,
            qos,
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=overrides,
        )

    def _publishers(self) -> int:
        try:
            return int(self.subscription.get_publisher_count())
        except InvalidHandle:  # the subscription ended during the handling of a message
            return 0

    def end(self, then: Callable[[], None]) -> None:
        """
        Destroy the subscription when the executor has released it, then call `then`.

        Events in the queue of the executor refer to a subscription by its address, and a new
        subscription may get the same address. So make a new subscription only after `then` is
        called: at that time the old events have left the queue.
        """
        node, subscription = self._node, self.subscription
        node._subscriptions.remove(subscription)
        executor = node.executor
        if executor is None:
            subscription.destroy()
            then()
            return

        def destroy() -> None:
            subscription.destroy()
            executor.create_task(then)

        executor.wake()
        executor.create_task(destroy)
