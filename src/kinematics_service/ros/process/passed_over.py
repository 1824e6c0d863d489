"""Messages that are passed over because they come faster than they can be answered."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.subscription import Subscription

from ..node.waiting_messages import take_waiting

# Of each subscription this number of the newest messages is answered all the same.
KEPT = 10


class _Passed(NamedTuple):
    # A subscription, and how its messages are answered.
    node: Node
    subscription: Subscription
    callback: Callable[..., None]
    with_info: bool


class PassedOver:
    """
    Empties the queue of an events executor of the messages in it, and of nothing else.

    For every message there is an event in the queue. What is in it by now is worked off, messages
    unanswered. In the meantime others come, perhaps as fast. So the executor is told to let go of
    the subscriptions, and the events of theirs that are in the queue by then cost it next to
    nothing. When those have gone it takes the subscriptions up again, without the messages that
    wait: if there are fewer events than messages, the last message waits for the event of the next
    one, and so does every later message.

    Parameters
    ----------
    executor
        It may be turned by another thread.
    nodes
        Whose messages are passed over.
    then
        Called in the end, in the executor's thread, with the number of messages that had been
        received and were thrown away.
    """

    def __init__(self, executor: Any, nodes: Sequence[Node], then: Callable[[int], None]) -> None:
        self._executor, self._then, self._left_out = executor, then, 0
        self._is_let_go = False
        self._passed = [
            _Passed(
                node,
                one,
                one.callback,
                one._callback_type is Subscription.CallbackType.WithMessageInfo,
            )
            for node in nodes
            for one in node.subscriptions
        ]
        for passed in self._passed:
            passed.subscription.callback = self._leave_out
        executor.create_task(self._let_go)

    def _leave_out(self, *message: Any) -> None:
        self._left_out += 1
        self._let_go()  # at the first one, long before the task's turn

    def _let_go(self) -> None:
        if self._is_let_go:
            return
        self._is_let_go = True
        # Without those that the node has destroyed.
        self._passed = [one for one in self._passed if one.subscription in one.node.subscriptions]
        for passed in self._passed:
            passed.node._subscriptions.remove(passed.subscription)
        self._executor.wake()
        self._executor.create_task(self._take_up)

    def _take_up(self) -> None:
        waiting = [take_waiting(passed.subscription, KEPT) for passed in self._passed]
        for passed in self._passed:
            passed.node._subscriptions.append(passed.subscription)
        self._executor.wake()
        # Messages that come until it has done so have one event in common. In that one they are
        # left out, too: nothing else would be done until the last of them is answered.
        self._executor.create_task(lambda: self._executor.create_task(self._end))
        for passed, (newest, count) in zip(self._passed, waiting):
            self._left_out += count - len(newest)
            for message in newest:
                # As the executor hands them over: with their information as one tuple.
                passed.callback(message if passed.with_info else message[0])

    def _end(self) -> None:
        for passed in self._passed:
            passed.subscription.callback = passed.callback
        self._then(self._left_out)
