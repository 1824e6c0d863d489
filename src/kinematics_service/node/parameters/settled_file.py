"""Read a file that another program may still be writing, when it is written."""

import os
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from ...errors import KinematicsError, SettingsError
from ...robot.robot import file_state

# A file is complete if it did not change for this time, s: programs that write pieces pause less.
SETTLED = 0.1
# The longest wait for that, s: longer than an upload of a robot file, shorter than a user waits.
PATIENCE = 5.0
# A file with faults that changed within this time may be half of one, ns.
RECENT = 1_000_000_000
Content = TypeVar('Content')


def read_settled(read: Callable[[], Content], files: Sequence[str | os.PathLike[str]]) -> Content:
    """
    Return what `read` returns while none of the files changes, and `SETTLED` s after they did.

    Raises
    ------
    SettingsError
        They change for longer than `PATIENCE` s.
    KinematicsError
        As `read` raises it, if they do not change; a SettingsError if they just did.
    """
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        before = _states(files)
        if any(time.time_ns() - changed < SETTLED * 1e9 for changed, _, _ in before):
            time.sleep(SETTLED)
            if _states(files) != before:
                continue
        try:
            content = read()
        except KinematicsError as error:
            if _states(files) != before:
                continue
            age = time.time_ns() - max((changed for changed, _, _ in before), default=0)
            if age < RECENT:
                raise SettingsError(
                    f'{error}; it changed {age / 1e9:.1f} s ago: is it being written?'
                ) from None
            raise
        else:
            if _states(files) == before:
                return content
    raise SettingsError(
        f'{", ".join(map(str, files))}: another program still writes it after {PATIENCE:g} s; '
        'reload it when it is saved'
    )


def _states(files: Sequence[str | os.PathLike[str]]) -> list[tuple[int, int, int]]:
    return [file_state(file) for file in files if os.path.exists(file)]
