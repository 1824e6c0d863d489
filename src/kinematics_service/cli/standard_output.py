"""Write all bytes to standard output, or fail."""

import io
from typing import Any, TextIO

from ..errors import KinematicsError


class _CheckedFile(io.FileIO):
    # Only the first failure raises; the rest of the buffer must not raise again at the end.
    failed = False

    def write(self, data: Any, /) -> int:
        if self.failed:
            return len(memoryview(data).cast('B'))
        try:
            return super().write(data)
        except BrokenPipeError:
            self.failed = True
            raise
        except OSError as error:
            self.failed = True
            reason = error.strerror or error
            raise KinematicsError(f'standard output cannot be written: {reason}') from None


def checked_output(stream: TextIO) -> TextIO:
    """
    Return a stream to the same file that raises KinematicsError.

    With PYTHONUNBUFFERED, which containers set, Python's own stream drops the rest of a text
    silently if a full disk has taken a part of it. The buffer of this stream writes the rest, too.

    Raises
    ------
    OSError
        The stream does not have a file.
    """
    stream.flush()
    unbuffered = isinstance(stream.buffer, io.RawIOBase)
    return io.TextIOWrapper(
        io.BufferedWriter(_CheckedFile(stream.fileno(), 'w', closefd=False)),
        stream.encoding,
        stream.errors,
        line_buffering=unbuffered or bool(stream.line_buffering),
    )
