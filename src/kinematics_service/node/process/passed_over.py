# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Skip messages that arrive faster than the node can answer them.

The subscription with the most messages in the queue keeps only its newest messages.
"""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from ..waiting_messages import take_waiting

# If messages arrive too fast, the node skips old messages. It keeps and handles this number of
# newest messages of one subscription: the subscription that has received the most messages.
KEPT_OF_FULLEST = 10
# If messages arrive too fast, the node skips old messages. It keeps and handles this number of
# newest messages of each subscription, except the subscription that has received the most
# messages: there it keeps only KEPT_OF_FULLEST. The value is the number of messages in 2.5 s at
# 200 Hz.
KEPT_OF_OTHERS = 500


class _Passed:
    # A subscription whose callback is replaced for a short time. Until the executor's queue is
    # empty, the new callback `keep` only stores the newest messages. Then the old callback is
    # restored and handles the stored messages.

    def __init__(
        self, node: Node, subscription: Subscription, at_first: Callable[[], None]
    ) -> None:
        self.node, self.subscription, self._at_first = node, subscription, at_first
        self.received = 0
        self._newest: deque[tuple[Any, ...]] = deque(maxlen=KEPT_OF_OTHERS)
        self._callback = subscription.callback
        # Set the private attribute `_callback`, because setting the property `callback` would also
        # change the form of the arguments.
        subscription._callback = self.keep

    def keep(self, *arguments: Any) -> None:
        self.received += 1
        self._newest.append(arguments)
        if self.received == 1:
            self._at_first()

    def take_waiting(self) -> None:
        with_info = self.subscription._callback_type is Subscription.CallbackType.WithMessageInfo
        newest, count = take_waiting(self.subscription, KEPT_OF_OTHERS)
        for message in newest:
            # Append one tuple of message and information, as the executor does.
            self._newest.append((message if with_info else message[0],))
        self.received += count

    def restore(self) -> list[tuple[Any, ...]]:
        self.subscription._callback = self._callback
        newest = list(self._newest)
        self._newest.clear()  # free large messages, which a reference cycle would keep
        return newest

    def answer(self, limit: int) -> int:
        newest = self.restore()[-limit:]
        for arguments in newest:
            self._callback(*arguments)
        return self.received - len(newest)


class PassedOver:
    """
    Removes the events of messages, and no other events, from the queue of an events executor.

    The queue has an event for every message. New messages may arrive as fast as the executor
    handles events, so the queue may never become empty. This class empties the queue in steps:

    1. The subscriptions get callbacks that only store the newest messages.
    2. The subscriptions are removed from the executor. The remaining events of their messages now
       take nearly no time.
    3. After these events the executor gets the subscriptions back. All messages that wait in the
       middleware are taken, and the newest are stored. If a message stayed in the middleware
       without its event, it would be taken at the event of the next message, and every later
       message would also be one event late.
    4. The node handles the stored messages.

    Parameters
    ----------
    executor
        The executor; another thread may run it.
    nodes
        The nodes whose messages are skipped.
    then
        A function that is called at the end, in the thread of the executor, with the number of
        messages that were thrown away.
    """

    def __init__(self, executor: Any, nodes: Sequence[Node], then: Callable[[int], None]) -> None:
        self._executor, self._then = executor, then
        self._is_let_go = False
        self._passed = [
            _Passed(node, subscription, self._let_go)
            for node in nodes
            for subscription in node.subscriptions
        ]
        # `_let_go` removes the subscriptions from the executor. `_Passed.keep` calls `_let_go`
        # when the first message is handled. If no message comes, this task calls `_let_go` after
        # all events that are now in the queue.
        executor.create_task(self._let_go)

    def _let_go(self) -> None:
        if self._is_let_go:
            return
        self._is_let_go = True
        for passed in list(self._passed):
            if passed.subscription in passed.node.subscriptions:
                passed.node._subscriptions.remove(passed.subscription)
            else:  # the node is destroying the subscription
                passed.restore()
                self._passed.remove(passed)
        self._executor.wake()
        self._executor.create_task(self._take_up)

    def _take_up(self) -> None:
        for passed in self._passed:
            passed.take_waiting()
            passed.node._subscriptions.append(passed.subscription)
        self._executor.wake()
        # All messages that arrive before the executor has woken share one event. If the callbacks
        # of the node were restored before this event, they would handle all these messages at
        # once, and other events would have to wait. So call `_end`, which restores the callbacks,
        # after the shared event. The outer task runs when the executor has woken and has put the
        # shared event into its queue. The inner task comes after this event in the queue.
        self._executor.create_task(lambda: self._executor.create_task(self._end))

    def _end(self) -> None:
        largest = max((passed.received for passed in self._passed), default=0)
        left_out, kept = 0, {largest: KEPT_OF_FULLEST}
        for passed in self._passed:
            left_out += passed.answer(kept.get(passed.received, KEPT_OF_OTHERS))
        self._then(left_out)
