"""Write all bytes of a text to standard output, or raise an error."""

import io
from typing import Any, TextIO

from ..errors import KinematicsError


class _CheckedFile(io.FileIO):
    # Whether a write has failed. Only the first failure raises an error, so that the rest of the
    # buffer raises no second error at exit.
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
            message = f'standard output cannot be written: {reason}'
            raise KinematicsError(message, code='unwritable') from None


def checked_output(stream: TextIO) -> TextIO:
    """
    Return a stream that writes to the file of `stream`, and raises KinematicsError if this fails.

    Containers often set PYTHONUNBUFFERED. With it Python's own stream writes a part of a text to a
    full disk and silently drops the rest. The buffer of the returned stream writes the rest as
    well, so that the failure is seen.

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
