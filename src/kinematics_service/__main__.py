"""
The way in: `python -m kinematics_service`, installed as `kinematics_service`.

"""

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
    try:
        # Imported here, so that Ctrl-C while numba loads ends as quietly as later.
        from .commands.command_line import run

        return run(argv)
    except KeyboardInterrupt:
        return 130


if __name__ == '__main__':
    sys.exit(main())
