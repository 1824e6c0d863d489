"""
The way in: `python -m kinematics_service`, installed as `kinematics_service`.

"""

import signal
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run a command line and return its exit code: 0, 1 for a failure, 2 for wrong usage.

    Parameters
    ----------
    argv
        Without the program's name; default: that of this process.

    """
    if argv is None and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # A command that has nothing to put in order ends at once, also from inside a library:
        # a KeyboardInterrupt waits for it to come back, and in a callback of LLVM it is lost.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        # Imported here, so that Ctrl-C while numba loads ends as quietly as later.
        from .commands.command_line import run

        return run(argv)
    except KeyboardInterrupt:
        return 130


if __name__ == '__main__':
    sys.exit(main())
