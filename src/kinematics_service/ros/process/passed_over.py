"""Messages that are passed over while the queue of an events executor is worked off."""

from collections.abc import Sequence
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription

from ..node.waiting_messages import take_waiting

# Of each subscription this number of the newest messages is answered in the end.
KEPT = 10
# What executors take a message with: a method of an object of C++.
Handle: Any = rclpy_implementation.Subscription
TAKE = vars(Handle)['take_message']


class PassedOver:
    """
    Some subscriptions whose events the executor passes over, until the end.

    There must never be fewer events in the queue than messages in the middleware: the last message
    would wait for the event of the next one, and so would every later one. An event without a
    message does no harm. So events may be passed over without their messages, which costs a few
    microseconds each, whatever the size of a message, if in the end all messages are taken that
    were there before.

    Parameters
    ----------
    subscriptions
        Those whose messages are passed over.
    """

    def __init__(self, subscriptions: Sequence[Subscription]) -> None:
        passed = {subscription.handle for subscription in subscriptions}
        self._subscriptions = list(subscriptions)

        def take(handle: Any, *arguments: Any) -> Any:
            return None if handle in passed else TAKE(handle, *arguments)

        # Looked up for each event. Whoever does this at the same time ends it for the others,
        # which only takes them longer.
        Handle.take_message = take

    def end(self) -> int:
        """Answer the newest messages that wait; return the number of the others."""
        Handle.take_message = TAKE
        waiting = [(one, *take_waiting(one, KEPT)) for one in self._subscriptions]
        for subscription, newest, _ in waiting:
            with_info = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
            for one in newest:
                # As the executor hands them over: with their information as one tuple.
                subscription.callback(one if with_info else one[0])
        return sum(count - len(newest) for _, newest, count in waiting)
