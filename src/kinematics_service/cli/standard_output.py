# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write all bytes of a text to standard output, or raise an error."""

import io
from typing import Any, TextIO

from ..errors import KinematicsError


class _CheckedFile(io.FileIO):
    # True after a write has failed. Only the first failure raises an error. Later writes do
    # nothing, because the rest of the buffer would raise a second error at exit.
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
    Return a stream that writes to the file of `stream`, and raises KinematicsError if a write
    fails.

    Containers often set PYTHONUNBUFFERED. If this variable is set and the disk is full, Python's
    own stream writes a part of a text and silently drops the rest. The returned stream has a
    buffer that writes the rest as well, so that the failure is detected.

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
