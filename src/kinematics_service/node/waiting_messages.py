"""The messages that wait for a subscription in the middleware."""

from collections import deque
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.subscription import Subscription

# A subscription that keeps all messages is taken to keep this many.
MOST_KEPT = 10_000


def take_waiting(subscription: Subscription, keep: int) -> tuple[deque[Any], int]:
    """
    Take out all messages that wait for a subscription; return the newest, and the number of all.

    No more are taken than it keeps: others arrive in the meantime, and each has an event of its
    own by which an executor takes it.

    Parameters
    ----------
    subscription
        May have been destroyed: then nothing waits.
    keep
        Number of the newest messages to be returned, each with its information.
    """
    handle, newest, count = subscription.handle, deque[Any](maxlen=keep), 0
    try:
        with handle:
            while count < (subscription.qos_profile.depth or MOST_KEPT):
                message = handle.take_message(subscription.msg_type, subscription.raw)
                if message is None:
                    break
                count += 1
                newest.append(message)
    except InvalidHandle:
        pass
    return newest, count
