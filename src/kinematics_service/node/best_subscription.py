"""
A subscription that is reliable if every publisher offers that, and receives from the others, too,
and whose queue is bounded in bytes.

`ReliabilityPolicy.BEST_AVAILABLE` is settled when a subscription is created, by the publishers
known then: messages of one that comes later and offers less would never be received.
"""

import contextlib
import copy
import ctypes
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import (
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .losses import Losses
from .waiting_messages import take_waiting

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
# Number of messages remembered while two subscriptions receive the same ones, so that each is
# taken once.
REMEMBERED = 4096
# The former one ends this time (s) after the new one is connected to every publisher.
OVERLAP = 1.0
# Messages that wait in the middleware take no more than this (bytes), or there is but one. It is
# half a second's reading: a message of ten thousand joints takes 16 ms.
MOST_WAITING = 1 << 23
# A message is large if a thousand of them take more.
LARGE = MOST_WAITING // 1000
# The queue has its full depth again when no large message came for this long (s).
QUIET = 10.0

Take = Callable[[bytes], None]
Info = Mapping[str, Any]
# Numbers of messages with the times at which they were sent.
Recent = dict[tuple[int | None, int], None]


class BestSubscription:
    """
    Subscribes to a topic as bytes, as reliably as its publishers offer, and counts lost messages.

    It begins with best effort, which every publisher matches: a reliable one would make the
    middleware of a publisher that offers less log an error, and discovery takes up to 1.8 s. When
    all publishers offer reliability, and were the same at two calls of `settle`, a reliable
    subscription replaces the first one. When one comes that offers less, or none is left, one with
    best effort replaces that. While there are two, each message is taken once.

    The middleware bounds a queue by the number of its messages, and keeps the memory that they
    took. So when messages are large, a subscription with a shorter queue replaces the one that is.

    Parameters
    ----------
    node, kind, topic
        As for `Node.create_subscription`.
    qos
        With `ReliabilityPolicy.BEST_AVAILABLE`. A user's override by parameter is final.
    take
        Called with each message.
    size
        Returns the size (bytes) of the messages for which `fit` is not called any more.
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
        self._node, self._kind, self.given_topic, self._take = node, kind, topic, take
        self._size = size
        self._adapts = False
        # Messages that were lost before `_counting` counted them, and whether they are more.
        self._lost: int | None = 0
        self._lost_more = False
        # The messages taken recently, while some of them may come once more.
        self._recent: Recent | None = None
        self._former: _Numbered | None = None
        self._all_heard_since = 0.0  # time since which all publishers are connected, s
        self._large = 0.0  # time of the last message that asked for a shorter queue, s
        self._qos = copy.copy(qos)  # overrides are written into it
        self._current = self._open(
            self._qos,
            QoSOverridingOptions.with_default_policies(callback=self._settle_reliability),
        )
        self._counting = self._current  # while there are two, one counts what is lost
        self._wanted = self._qos
        self._full_depth = self._qos.depth
        self._known: set[tuple[int, ...]] = set()  # publishers
        self._is_ending = False  # whether events of a subscription may wait that has ended

    def _settle_reliability(self, qos: QoSProfile) -> SetParametersResult:
        # After a user's overrides.
        if qos.reliability is ReliabilityPolicy.BEST_AVAILABLE:
            self._adapts = True
            qos.reliability = BEST_EFFORT
        return SetParametersResult(successful=True)

    def _open(self, qos: QoSProfile, overrides: QoSOverridingOptions | None = None) -> '_Numbered':
        return _Numbered(
            self._node,
            self._kind,
            self.given_topic,
            qos,
            self._heard,
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
        return self._qos.reliability is RELIABLE

    @property
    def lost(self) -> int | None:
        """Return the number of messages lost, None if the middleware does not number them."""
        now = self._counting.losses.count
        return None if now is None or self._lost is None else now + self._lost

    @property
    def lost_is_lower_bound(self) -> bool:
        """Return whether more messages than `lost` may be lost."""
        return self._lost_more or self._counting.losses.is_lower_bound

    def settle(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        """Adapt to the publishers of the topic; the node calls it periodically."""
        now = time.monotonic()
        self.fit(self._size())
        self._look_at(publishers)
        if self.publisher_count < len(publishers):
            self._all_heard_since = now
        elif now - self._all_heard_since < OVERLAP:
            pass
        elif self._former is not None:
            self._take_of(self._former)
            self._end(self._former)
            self._all_heard_since = now
        elif not self._is_ending:
            self._recent = None
            if self._qos.depth < self._full_depth and now - self._large > QUIET:
                self._want(depth=self._full_depth)
        if self._wanted is not self._qos:
            self._replace()

    def fit(self, size: int) -> None:
        """Shorten the queue if many messages of this size (bytes) would take too much memory."""
        if size * self._full_depth <= MOST_WAITING:
            return
        self._large = time.monotonic()
        depth = 1 << max(MOST_WAITING // size, 1).bit_length() - 1  # few depths: few changes
        if depth < self._wanted.depth:
            self._want(depth=depth)

    def _want(self, **policies: Any) -> None:
        # The present subscription is replaced when no message is being handled.
        wanted = copy.copy(self._wanted)
        for policy, value in policies.items():
            setattr(wanted, policy, value)
        self._wanted = self._qos if wanted == self._qos else wanted

    def _replace(self) -> None:
        former = self._former
        if former is not None:
            self._take_of(former)  # first: it is older than the present one
            if former is not self._former or former.qos != self._wanted:
                self._end(former)  # and the present one later
                return
            self._current, self._former = former, self._current
        elif self._is_ending:
            return
        else:
            self._former, self._recent = self._current, {}
            self._current = self._open(self._wanted)
        self._qos = self._wanted
        self._all_heard_since = time.monotonic()

    def _end(self, former: '_Numbered') -> None:
        if former is not self._former or former.subscription not in self._node.subscriptions:
            return  # it has ended, or is being passed over by the executor
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
        _give_back_memory()

    def _heard(self, one: '_Numbered', data: bytes, info: Info) -> None:
        former = self._former
        if self._recent is None:
            self._take(data)
        elif self._is_ending and (len(data) > LARGE or one is not self._current):
            return  # until the memory of the one that ends is free
        elif former is None:
            self._take_once(self._recent, data, info)
        else:
            if one is not former:
                self._take_of(former)  # which is older
            self._take_once(self._recent, data, info)
            if former.qos.depth > self._qos.depth:
                # Nothing must wait in a queue that is too long.
                self._take_of(former)
                if one is self._current:
                    self._end(former)
        if self._wanted is not self._qos:
            self._replace()

    def _take_once(self, recent: Recent, data: bytes, info: Info) -> None:
        key = info['publication_sequence_number'], info['source_timestamp']
        if key in recent:
            return
        recent[key] = None
        if len(recent) > REMEMBERED:
            del recent[next(iter(recent))]
        self._take(data)

    def _take_of(self, former: '_Numbered') -> None:
        recent = self._recent
        if former is not self._former or recent is None:
            return  # it has ended
        newest, count = take_waiting(former.subscription, self._qos.depth)
        # Where more wait than the present queue has room for, the former one ends.
        is_full = count > len(newest)
        for data, info in (newest[-1],) if is_full else newest:
            former.losses.heard(info['publication_sequence_number'], info['source_timestamp'])
            self._take_once(recent, data, info)
        if is_full:
            self._end(former)

    def _look_at(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        # Not by the middleware's events: one of them in the queue of `EventsExecutor` ends the
        # process if its subscription is destroyed meanwhile.
        known, self._known = self._known, {tuple(info.endpoint_gid) for info in publishers}
        if known != self._known:
            for one in {self._counting, self._current}:
                one.losses.publishers_changed()
        offered = {info.qos_profile.reliability for info in publishers}
        reliability = RELIABLE if offered == {RELIABLE} else BEST_EFFORT
        if self._adapts and (reliability is BEST_EFFORT or known == self._known):
            self._want(reliability=reliability)
        for info in publishers:
            if tuple(info.endpoint_gid) not in known:
                self._warn_of(info.qos_profile)

    def _warn_of(self, offered: QoSProfile) -> None:
        compatibility, reason = qos_check_compatible(offered, self._wanted)
        if compatibility == QoSCompatibility.ERROR:
            self._node.get_logger().warning(
                f'messages of a publisher of {self.topic_name} are not received: its quality of '
                f'service does not match ({reason})'
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
        overrides: QoSOverridingOptions | None,
    ) -> None:
        self._node, self.qos = node, qos
        self.losses = losses = Losses(self._publishers)
        heard = losses.heard

        def taken(*arguments: Any) -> None:
            # `EventsExecutor` of Jazzy hands over message and information as one tuple.
            data, info = arguments if len(arguments) == 2 else arguments[0]
            heard(info['publication_sequence_number'], info['source_timestamp'])
            take(self, data, info)

        # rclpy looks at this to see whether the information is wanted.
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
        except InvalidHandle:  # it has ended while a message of it was handled
            return 0

    def end(self, then: Callable[[], None]) -> None:
        """
        Destroy the subscription when the executor has no more to do with it, then call `then`.

        The executor's events name a subscription by its address. So it is destroyed when the
        executor has let go of it, and another one may be made at the same address when its events
        have gone from the queue.
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


def _give_back_memory() -> None:
    # What messages took is free, but not given back by itself: 200 MiB after large ones.
    with contextlib.suppress(OSError, AttributeError):  # it is glibc's
        ctypes.CDLL(None).malloc_trim(0)
