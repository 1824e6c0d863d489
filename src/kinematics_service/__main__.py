# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the program: `python -m kinematics_service`, installed as `kinematics_service`."""

import sys
from collections.abc import Sequence

from .stop_signals import INTERRUPTED


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run a command line and return the exit code: 0, 1 for a failure, 2 for wrong usage.

    Parameters
    ----------
    argv
        The arguments without the program's name; default: those of this process.
    """
    # Import the command line only now, so that Ctrl-C has its default action during the import
    # (see `__init__`).
    from .cli.command_line import run

    try:
        return run(argv)
    except KeyboardInterrupt:
        return INTERRUPTED


if __name__ == '__main__':
    sys.exit(main())
