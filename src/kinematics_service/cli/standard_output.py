"""Standard output whose every byte is written, or the command fails."""

import io
from typing import Any, TextIO

from ..errors import KinematicsError


class _CheckedFile(io.FileIO):
    # The first failure is told; what is left over must not raise again when the interpreter ends.
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
    Return a stream to the same file whose errors are a KinematicsError.

    With PYTHONUNBUFFERED, which containers set, Python's own leaves out the rest of a text of
    which a full disk took a part, without a word: there is no buffer that would write it again.

    Raises
    ------
    OSError
        The stream has no file.
    """
    stream.flush()
    unbuffered = isinstance(stream.buffer, io.RawIOBase)
    return io.TextIOWrapper(
        io.BufferedWriter(_CheckedFile(stream.fileno(), 'w', closefd=False)),
        stream.encoding,
        stream.errors,
        line_buffering=unbuffered or bool(stream.line_buffering),
    )
