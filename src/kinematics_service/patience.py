"""
A word to whoever waits while the kernel is compiled, once on each machine.

"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from . import kernel
from .robot import load_robot
from .singularities import singularity

# Reading the kernel from its cache takes less (s).
LONG = 1.0
MAIN = threading.main_thread()


@contextmanager
def patience() -> Iterator[None]:
    """
    Say on standard error, after a while, that the kernel is being compiled, if that is why.

    """

    over = threading.Event()
    handler = signal.getsignal(signal.SIGINT)
    # A KeyboardInterrupt inside a callback of the compiler would be lost, with a traceback.
    bare = handler is signal.default_int_handler and threading.current_thread() is MAIN

    def tell() -> None:
        # On a busy machine the compiler may begin long after the first look.
        while not over.wait(LONG):
            if kernel.is_being_compiled():
                print(
                    'kinematics_service: compiling the kernel; this takes about half a minute, '
                    'once',
                    file=sys.stderr,
                    flush=True,
                )
                return

    threading.Thread(target=tell, daemon=True).start()
    if bare:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        over.set()
        if bare:
            signal.signal(signal.SIGINT, handler)


def ready_kernel() -> None:
    """
    Compile the kernel, or read it from its cache, before anything else is begun.

    So Ctrl-C meets nothing that would have to be cleaned up.

    """
    with patience():
        robot = load_robot('planar_2r')
        singularity(robot, [0.1, 0.2], [0.3, 0.4])
