# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make timers, and limit the rate of log lines. Both use the steady clock, because the ROS clock can
be set or stopped.
"""

import time
from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

from ..errors import KinematicsError


def steady_timer(
    node: Node, period: float, call: Callable[[], None], autostart: bool = True
) -> Timer:
    """Return a timer that calls `call` every `period` seconds, measured by the steady clock."""
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    return node.create_timer(period, call, clock=steady, autostart=autostart)


class Throttle:
    """
    Limits the rate of log lines of each kind, by the time at which the kind was last logged.

    The throttle of rclpy takes 270 us for each suppressed line. Use few kinds of lines, because
    each kind stays in memory.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._passed: dict[str, float] = {}

    def passes(self, kind: str) -> bool:
        """Return whether a line of this kind may be written now."""
        now = time.monotonic()
        last = self._passed.get(kind)
        if last is not None and now - last < self._seconds:
            return False
        self._passed[kind] = now
        return True

    def reason_of(self, node: Node, item: str, error: Exception) -> str:
        """
        Return a text with the reason why `item`, such as a target, is refused. Log the error if it
        is internal.
        """
        if isinstance(error, KinematicsError):
            return str(error)
        self.internal_error(node, item, error)
        return 'internal error'

    def internal_error(self, node: Node, item: str, error: Exception) -> None:
        """Log an internal error that occurred while `item` was handled."""
        if self.passes('internal'):
            node.get_logger().error(
                f'internal error while handling {item}, please report it: {error!a}'
            )
