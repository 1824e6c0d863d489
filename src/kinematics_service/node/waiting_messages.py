# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Take the messages that wait in the middleware for a subscription."""

from collections import deque
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.subscription import Subscription

# Assumed queue depth of a subscription that keeps all messages.
ASSUMED_DEPTH = 10_000


def take_waiting(subscription: Subscription, keep: int) -> tuple[deque[Any], int]:
    """
    Take all messages that wait for a subscription. Return the newest messages, and the number of
    messages that were taken.

    The function takes at most as many messages as the queue can hold; later messages are left to
    the executor.

    Parameters
    ----------
    subscription
        The subscription; if it was destroyed, the result is empty.
    keep
        Largest number of messages to return. Each message comes with the information of the
        middleware about it.
    """
    handle, newest, count = subscription.handle, deque[Any](maxlen=keep), 0
    try:
        with handle:
            while count < (subscription.qos_profile.depth or ASSUMED_DEPTH):
                message = handle.take_message(subscription.msg_type, subscription.raw)
                if message is None:
                    break
                count += 1
                newest.append(message)
    except InvalidHandle:
        pass
    return newest, count
