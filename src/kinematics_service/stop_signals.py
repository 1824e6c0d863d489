"""
SIGINT and SIGTERM as a flag.

"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StopSignal:
    """
    Whether SIGINT or SIGTERM has come.

    """

    def __init__(self) -> None:
        self.came = False

    def __call__(self, signum: int, frame: FrameType | None) -> None:
        """
        Note that it came: the signal handler.

        """
        self.came = True


@contextmanager
def stop_signals() -> Iterator[StopSignal]:
    """
    Handle SIGINT and SIGTERM with a flag inside the block, and ignore both from its end on.

    rclpy's own handlers end a busy node with a traceback most of the time. A second signal during
    the clean-up must do no harm, so the process stays deaf to both.

    """
    stop = StopSignal()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    try:
        yield stop
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
