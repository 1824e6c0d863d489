"""Standard output: a terminal, a file, or a pipe whose reader may end."""

import os
import sys


class StandardOutput:
    """
    Writes lines at once. If the reader ends (`| head`), the output ends without an error.

    Attributes
    ----------
    closed
        Whether the reader has ended.
    """

    def __init__(self) -> None:
        self.closed = False

    @property
    def is_terminal(self) -> bool:
        """Return whether the output is a terminal."""
        return sys.stdout.isatty() and os.environ.get('TERM', '') not in ('', 'dumb')

    @property
    def shows_blocks(self) -> bool:
        """Return whether the encoding has block characters."""
        return (sys.stdout.encoding or '').lower().replace('-', '') == 'utf8'

    def line(self, *lines: str) -> None:
        """Write lines and flush."""
        if self.closed:
            return
        try:
            sys.stdout.write(''.join(f'{line}\n' for line in lines))
            sys.stdout.flush()
        except BrokenPipeError:
            self.closed = True
            # The rest of the buffer must not raise an error again when the interpreter ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
