# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write files completely or not at all.

A complete new file replaces a regular file, with the permissions and the owner of the old file.
Other targets (a device, a named pipe, the standard output) are written to and not replaced.
Symbolic links are followed.
"""

import errno
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, TextIO

from .errors import KinematicsError

# An existing file is usually replaced: the new content is written to a new file, and the new file
# gets the name of the old file. At the following errors of the operating system, the new content
# is written into the old file instead. Causes are: the old file has another owner; the old file is
# a mount point, for example a single file that is mounted into a container; the new file is on
# another disk (EXDEV).
OVERWRITE_ERRORS = (errno.EPERM, errno.EACCES, errno.EBUSY, errno.EXDEV, errno.EROFS)
# File descriptors of standard output and standard error.
STREAMS = (1, 2)
# Flags to open a file for writing. On POSIX, if the file is a terminal, it does not become the
# terminal of this process. On Windows, bytes are written unchanged.
OPEN_FLAGS = os.O_WRONLY | getattr(os, 'O_NOCTTY', 0) | getattr(os, 'O_BINARY', 0)


def write_file(path: Path, content: str | bytes) -> None:
    """
    Write a file completely or not at all; a text is written in UTF-8.

    Raises
    ------
    KinematicsError
        The file cannot be written.
    """
    with new_file(path) as made:
        made.write_bytes(content.encode('utf-8') if isinstance(content, str) else content)


def write_document(file: str, text: str) -> None:
    """
    Write a text to a file, or to standard output for `-`.

    Raises
    ------
    KinematicsError
        The file cannot be written.
    """
    if file == '-':
        sys.stdout.write(text)
    else:
        write_file(Path(file), text)


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """
    Yield the path of a temporary file. After the block, this file becomes the file `path`.

    Raises
    ------
    KinematicsError
        The file cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix='.kinematics_service.', dir=_folder(path)) as temp:
            made = Path(temp) / 'made'
            yield made
            # Open for writing, because Windows refuses fsync otherwise.
            with made.open('rb+') as stream:
                os.fsync(stream.fileno())
            _put(made, path)
    except OSError as error:
        raise KinematicsError(f'{path}: cannot be written: {error.strerror or error}') from None


def unwritable(path: Path) -> str | None:
    """
    Return the reason, as text, why a file probably cannot be written; None if the file can be
    written.

    The function writes nothing.
    """
    try:
        status = _status_of(path)
        folder = _target(path).parent
        if status is None and not os.access(folder, os.W_OK):
            return f'the folder {folder} cannot be written to'
        if status is not None and not os.access(path, os.W_OK):
            return f'{path} cannot be written to'
    except OSError as error:
        return f'{path}: {error.strerror}'
    return None


def _status_of(path: Path) -> os.stat_result | None:
    # Return the status of the file at `path`. Return None if the file, or the target of a symbolic
    # link, does not exist.
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _target(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _folder(path: Path) -> Path | None:
    # Return the folder in which the temporary file is made. If the temporary file can replace the
    # old file by a rename, return the folder of `path`. Otherwise return None, which means the
    # system's folder for temporary files.
    status, folder = _status_of(path), _target(path).parent
    beside = status is None or (_may_be_replaced(path, status) and os.access(folder, os.W_OK))
    return folder if beside else None


def _may_be_replaced(path: Path, status: os.stat_result) -> bool:
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1 or _stream(status) is not None:
        return False
    # A symbolic link in /proc may lead to a file without a name, which cannot be replaced.
    target = _status_of(_target(path))
    return target is not None and os.path.samestat(status, target)


def _stream(status: os.stat_result) -> int | None:
    for number in STREAMS:
        with suppress(OSError):  # standard output or standard error may be closed
            if os.path.samestat(status, os.fstat(number)):
                return number
    return None


def _put(made: Path, path: Path) -> None:
    status = _status_of(path)
    if status is None:
        os.replace(made, _target(path))
    elif not _may_be_replaced(path, status):
        _pour(made, path, status)
    elif not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    else:
        try:
            if hasattr(os, 'chown'):  # Windows has no chown
                os.chown(made, status.st_uid, status.st_gid)
            made.chmod(stat.S_IMODE(status.st_mode) & 0o777)
            os.replace(made, _target(path))
        except OSError as error:
            if error.errno not in OVERWRITE_ERRORS:
                raise
            _pour(made, path, status)


def _pour(made: Path, path: Path, status: os.stat_result) -> None:
    number = _stream(status)
    if number is not None:
        sys.stdout.flush()  # `path` is a stream of this process, so write its buffered text first
    # Open the file without O_TRUNC and O_CREAT. If the disk is full, O_TRUNC would lose the old
    # content. Systems refuse O_CREAT for pipes of other users.
    handle = os.open(path, OPEN_FLAGS) if number is None else os.dup(number)
    with made.open('rb') as content, os.fdopen(handle, 'wb') as stream:
        whole = number is None and stat.S_ISREG(status.st_mode)
        size = made.stat().st_size
        if whole:
            _reserve(stream, size, status.st_size)
        shutil.copyfileobj(content, stream)
        if whole:
            stream.truncate(size)
            stream.flush()
            os.fsync(handle)


def _reserve(stream: BinaryIO, size: int, before: int) -> None:
    # Reserve disk space before the content is overwritten. If the disk is full, the old content
    # stays.
    if not size or not hasattr(os, 'posix_fallocate'):
        return
    try:
        os.posix_fallocate(stream.fileno(), 0, size)
    except OSError:
        stream.truncate(before)
        raise


def say_written(file: Path, stream: TextIO | None = None) -> None:
    """Print that a file was written. Print nothing for a pipe or a device."""
    if file.is_file():
        print(f'wrote {file}', file=stream)


def write_documents(
    html: Path | None, page: str, json: Path | None, document: str, print_it: Callable[[], None]
) -> None:
    """
    Write a report to files, as an HTML page and a JSON document, and print the report.

    If `json` is `-`, print the JSON document instead of the report.
    """
    printed = str(json) == '-'
    texts = {html: page, None if printed else json: f'{document}\n'}
    files = {file: text for file, text in texts.items() if file is not None}
    for file, text in files.items():
        write_file(file, text)
    if printed:
        print(document)
    else:
        print_it()
    for file in files:
        say_written(file, sys.stderr if printed else None)
