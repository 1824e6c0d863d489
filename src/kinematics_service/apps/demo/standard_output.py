# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write lines to standard output: a terminal, a file, or a pipe whose reader may end."""

import os
import sys


class StandardOutput:
    """
    Writes lines to standard output without a delay.

    If the reader of a pipe ends (`| head`), lines are ignored without an error.

    Attributes
    ----------
    closed
        Whether the reader of the pipe has ended.
    """

    def __init__(self) -> None:
        self.closed = False

    @property
    def is_terminal(self) -> bool:
        """Return whether standard output is a terminal that can show a live table."""
        return sys.stdout.isatty() and os.environ.get('TERM', '') not in ('', 'dumb')

    @property
    def shows_blocks(self) -> bool:
        """Return whether the encoding of standard output is UTF-8, which has block characters."""
        return (sys.stdout.encoding or '').lower().replace('-', '') == 'utf8'

    def line(self, *lines: str) -> None:
        """Write lines to standard output, and flush its buffer."""
        if self.closed:
            return
        try:
            sys.stdout.write(''.join(f'{line}\n' for line in lines))
            sys.stdout.flush()
        except BrokenPipeError:
            self.closed = True
            # Send the unwritten rest of the buffer to /dev/null. Otherwise Python raises
            # BrokenPipeError again when it exits.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
