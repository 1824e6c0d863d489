"""
Lets a log line pass once in a while.

rclpy's own throttle costs 270 us for each line it suppresses, so the node asks here first.
"""

import time


class Throttle:
    """Remembers when each kind of line last passed; there are few and fixed kinds."""

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
