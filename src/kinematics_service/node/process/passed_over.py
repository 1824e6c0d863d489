"""
Messages that are passed over because they come faster than they can be answered.

Only the subscription that is behind loses some: the one with the most messages in the queue.
"""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from ..waiting_messages import take_waiting

# Number of the newest messages that are answered of the subscription that is behind.
KEPT = 10
# Number of the newest messages that are answered of each other one: 2.5 s at 200 Hz.
KEPT_OF_OTHERS = 500


class _Passed:
    # A subscription whose messages are kept instead of being answered: the newest of them.

    def __init__(
        self, node: Node, subscription: Subscription, at_first: Callable[[], None]
    ) -> None:
        self.node, self.subscription, self._at_first = node, subscription, at_first
        self.received = 0
        self._newest: deque[tuple[Any, ...]] = deque(maxlen=KEPT_OF_OTHERS)
        self._callback = subscription.callback
        # Not by its property, which is about the form of the arguments, too: that stays.
        subscription._callback = self.keep

    def keep(self, *arguments: Any) -> None:
        self.received += 1
        self._newest.append(arguments)
        if self.received == 1:
            self._at_first()

    def take_waiting(self) -> None:
        with_info = self.subscription._callback_type is Subscription.CallbackType.WithMessageInfo
        newest, count = take_waiting(self.subscription, KEPT_OF_OTHERS)
        for one in newest:
            # As the executor hands them over: with their information as one tuple.
            self._newest.append((one if with_info else one[0],))
        self.received += count

    def restore(self) -> list[tuple[Any, ...]]:
        self.subscription._callback = self._callback
        newest = list(self._newest)
        self._newest.clear()  # now: messages can be large, and this is in a reference cycle
        return newest

    def answer(self, most: int) -> int:
        newest = self.restore()[-most:]
        for arguments in newest:
            self._callback(*arguments)
        return self.received - len(newest)


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
        self._executor, self._then = executor, then
        self._is_let_go = False
        self._passed = [
            _Passed(node, one, self._let_go) for node in nodes for one in node.subscriptions
        ]
        executor.create_task(self._let_go)  # at the first message, if there is one in the queue

    def _let_go(self) -> None:
        if self._is_let_go:
            return
        self._is_let_go = True
        for one in list(self._passed):
            if one.subscription in one.node.subscriptions:
                one.node._subscriptions.remove(one.subscription)
            else:  # the node is destroying it
                one.restore()
                self._passed.remove(one)
        self._executor.wake()
        self._executor.create_task(self._take_up)

    def _take_up(self) -> None:
        for one in self._passed:
            one.take_waiting()
            one.node._subscriptions.append(one.subscription)
        self._executor.wake()
        # Messages that come until it has done so have one event in common. In that one they are
        # kept, too: nothing else would be done until the last of them is answered.
        self._executor.create_task(lambda: self._executor.create_task(self._end))

    def _end(self) -> None:
        behind = max((one.received for one in self._passed), default=0)
        kept = [KEPT if one.received == behind else KEPT_OF_OTHERS for one in self._passed]
        self._then(sum(one.answer(most) for one, most in zip(self._passed, kept)))
