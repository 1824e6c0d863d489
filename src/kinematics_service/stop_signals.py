"""SIGINT and SIGTERM: the first one asks for the end, a second one, or time, makes it."""

import math
import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

NUMBERS = (signal.SIGINT, signal.SIGTERM)
# Shortest time for a clean-up after the first signal, even if a second one comes (s): one press of
# Ctrl-C can reach a process twice.
GRACE = 1.0
# Period of what is done while no signal comes (s).
MEANWHILE = 0.25
# A command that Ctrl-C interrupts cleans up within this (s): half-written files, its processes,
# the cursor.
UNWINDING = 0.8
INTERRUPTED = 130  # as shells have it
# Time after which C ends the process if Python has not run since a signal (s).
DEAF = 3
SHOW_CURSOR = b'\x1b[?25h'


class StopSignal:
    """
    Whether SIGINT or SIGTERM has come.

    Attributes
    ----------
    came
        Whether one has come.
    then
        Called when the first one comes, from another thread.
    meanwhile
        Called every MEANWHILE until then, from that thread.
    time_out
        Time for a clean-up after the first signal, s; the process ends then, as at a second one.
        None: as long as it takes.
    last_words
        Text written to standard output if a second one or time ends the process, such as a
        terminal's reset.
    """

    def __init__(self) -> None:
        self.came = False
        self.then: Callable[[], None] = lambda: None
        self.meanwhile: Callable[[], None] = lambda: None
        self.time_out: float | None = None
        self.last_words = b''

    def follow(self, signals: int) -> None:
        """
        Read signals from a file until it ends; a second one, or time, ends the process.

        Parameters
        ----------
        signals
            Descriptor of the file.
        """
        while not select.select([signals], [], [], MEANWHILE)[0]:
            with suppress(Exception):  # a signal must be followed all the same
                self.meanwhile()
        if not os.read(signals, 1):
            return
        first = time.monotonic()
        # Python ends the process now, or C if the clean-up keeps the interpreter's lock.
        signal.alarm(0 if self.time_out is None else math.ceil(self.time_out + GRACE))
        self.came = True
        self.then()
        if select.select([signals], [], [], self.time_out)[0]:
            if not os.read(signals, 1):
                return
            time.sleep(max(0.0, first + GRACE - time.monotonic()))
        with suppress(OSError):
            os.write(1, self.last_words)
        os._exit(0)


@contextmanager
def stop_signals() -> Iterator[StopSignal]:
    """
    Handle SIGINT and SIGTERM inside the block, and ignore both from its end on.

    rclpy's own handlers end a busy node with a traceback most of the time. A thread follows the
    signals, so that they take effect also while the main thread is inside a library that does not
    return to Python. A signal while the interpreter ends must do no harm, so the process ignores
    both after the block.
    """
    stop = StopSignal()
    # The descriptor reports it.
    told = _watched(NUMBERS, lambda number, frame: None, stop.follow)
    try:
        yield stop
    finally:
        for number in NUMBERS:
            signal.signal(number, signal.SIG_IGN)
        signal.set_wakeup_fd(-1)
        signal.alarm(0)
        os.close(told)  # which ends the thread


@contextmanager
def interruptible() -> Iterator[None]:
    """
    Raise KeyboardInterrupt at Ctrl-C, and end the process if that takes too long.

    Inside a library the exception waits until it comes back, and one that calls Python may lose
    it. A second Ctrl-C does not wait either.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        # A shell starts its background processes with it ignored.
        yield
        return
    _watched((signal.SIGINT,), signal.default_int_handler, _end_in_time)
    try:
        yield
    finally:
        signal.set_wakeup_fd(-1)


def _watched(
    numbers: Iterable[int],
    handler: Callable[[int, FrameType | None], object],
    follow: Callable[[int], None],
) -> int:
    # Handle signals, follow them in a thread, and return the descriptor they are written to.
    from .kernel import end_in_time

    signals, told = os.pipe()
    os.set_blocking(told, False)
    signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    for number in numbers:
        signal.signal(number, handler)
        end_in_time(number, DEAF)
    threading.Thread(target=follow, args=(signals,), daemon=True).start()
    return told


def _end_in_time(signals: int) -> None:
    os.read(signals, 1)
    select.select([signals], [], [], UNWINDING)
    for stream in (1, 2):
        if os.isatty(stream):
            os.write(stream, SHOW_CURSOR)
            break
    os._exit(INTERRUPTED)
