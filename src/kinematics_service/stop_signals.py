# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Handle SIGINT and SIGTERM. The first signal requests the end of the process. A second signal or a
time-out forces the end.
"""

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
# Shortest time for a clean-up after the first signal, s. One press of Ctrl-C can reach a process
# twice, so a second signal does not end the process before this time.
GRACE = 1.0
# Period, s, with which `StopSignal.follow` calls the function `meanwhile`.
CALL_PERIOD = 0.25
# Time for the clean-up after Ctrl-C interrupted a command, s. The command removes half-written
# files, ends processes and shows the cursor.
CLEAN_UP_TIME = 0.8
INTERRUPTED = 130  # exit code after SIGINT, as in shells
# C code ends the process if Python code has not run for this time, s, after a signal.
PYTHON_TIMEOUT = 3
SHOW_CURSOR = b'\x1b[?25h'
# True if the system has alarms, and pipes on which `select` can wait. Windows has neither.
HAS_ALARM = hasattr(signal, 'alarm')


class StopSignal:
    """
    The state of the stop signals SIGINT and SIGTERM in this process.

    Attributes
    ----------
    came
        Whether SIGINT or SIGTERM has come.
    then
        Function that is called at the first signal, from the thread of `follow`.
    meanwhile
        Function that is called every CALL_PERIOD until the first signal, from the thread of
        `follow`.
    time_out
        Time for a clean-up after the first signal, s. After this time the process ends. None means
        no limit.
    last_words
        Text for standard output if a second signal or the time-out ends the process, for example
        to reset a terminal.
    """

    def __init__(self) -> None:
        self.came = False
        self.then: Callable[[], None] = lambda: None
        self.meanwhile: Callable[[], None] = lambda: None
        self.time_out: float | None = None
        self.last_words = b''

    def handle(self, number: int, frame: FrameType | None) -> None:
        """
        Handle a stop signal; Python's `signal` module calls this method. The second signal ends
        the process.
        """
        if self.came:
            os._exit(0)
        self.came = True
        self.then()

    def follow(self, signals: int) -> None:
        """
        Wait for stop signals on a pipe until the pipe is closed.

        At the first signal, call the function `then`. After that, a second signal ends the
        process. Without a second signal, the process ends after the time `time_out`.

        Parameters
        ----------
        signals
            File descriptor of the pipe, which gets one byte for each signal.
        """
        while not select.select([signals], [], [], CALL_PERIOD)[0]:
            with suppress(Exception):  # an error must not end this thread
                self.meanwhile()
        if not os.read(signals, 1):
            return
        first = time.monotonic()
        # Start an alarm. If the clean-up holds the interpreter lock, this thread cannot run, but
        # SIGALRM still ends the process.
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
    Handle SIGINT and SIGTERM inside the block, and ignore both signals after the block.

    The signal handlers of rclpy often end a busy node with a traceback. Here a thread waits for
    the signals, so that the signals work while the main thread is inside a library. After the
    block the interpreter ends, so the process ignores both signals. On Windows, Python handlers
    handle the signals. These handlers run only when the main thread returns to Python, and
    `meanwhile` is not called.
    """
    stop = StopSignal()
    if HAS_ALARM:
        # The Python handlers do nothing, because the thread of `follow` reads the signals as
        # bytes from a pipe.
        descriptor = _watched(NUMBERS, lambda number, frame: None, stop.follow)
    else:
        for number in NUMBERS:
            signal.signal(number, stop.handle)
    try:
        yield stop
    finally:
        for number in NUMBERS:
            signal.signal(number, signal.SIG_IGN)
        if HAS_ALARM:
            signal.set_wakeup_fd(-1)
            signal.alarm(0)
            os.close(descriptor)  # closing the pipe ends the thread of `follow`


@contextmanager
def interruptible() -> Iterator[None]:
    """
    Raise KeyboardInterrupt at Ctrl-C. If the process does not stop soon, end the process.

    Python raises the exception only after a running library function returns. A library that calls
    Python may lose the exception. A second Ctrl-C ends the process at once.
    """
    if not HAS_ALARM or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        # Change no signal handler. If the process ignores SIGINT, as a background process of a
        # shell does, SIGINT stays ignored. On Windows, Python's own handler raises
        # KeyboardInterrupt.
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
    # Install the handler for the signals. Start a thread that calls `follow` with the reading end
    # of a pipe. Return the file descriptor of the other end, to which Python writes the signals.
    from .kernel import end_in_time

    signals, descriptor = os.pipe()
    os.set_blocking(descriptor, False)
    signal.set_wakeup_fd(descriptor, warn_on_full_buffer=False)
    for number in numbers:
        signal.signal(number, handler)
        end_in_time(number, PYTHON_TIMEOUT)
    threading.Thread(target=follow, args=(signals,), daemon=True).start()
    return descriptor


def _end_in_time(signals: int) -> None:
    os.read(signals, 1)
    select.select([signals], [], [], CLEAN_UP_TIME)
    for stream in (1, 2):
        if os.isatty(stream):
            os.write(stream, SHOW_CURSOR)
            break
    os._exit(INTERRUPTED)
