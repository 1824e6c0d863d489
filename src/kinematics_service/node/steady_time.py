"""Timers and log lines by a time that nobody sets or stops, as the ROS clock can be."""

import time
from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

from ..errors import KinematicsError


def steady_timer(
    node: Node, period: float, call: Callable[[], None], autostart: bool = True
) -> Timer:
    """Return a timer of a node with a period in s."""
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    return node.create_timer(period, call, clock=steady, autostart=autostart)


class Throttle:
    """
    Lets a log line pass once in a while: it remembers when each of few, fixed kinds last passed.

    rclpy's own throttle costs 270 us for each line it suppresses, so the node asks here first.
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

    def reason_of(self, node: Node, what: str, error: Exception) -> str:
        """Return why `what` is refused; an error of our own is logged."""
        if isinstance(error, KinematicsError):
            return str(error)
        self.internal_error(node, what, error)
        return 'internal error'

    def internal_error(self, node: Node, what: str, error: Exception) -> None:
        """Log an error of our own while `what` was handled."""
        if self.passes('internal'):
            node.get_logger().error(
                f'internal error while handling {what}, please report it: {error!a}'
            )
