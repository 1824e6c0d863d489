# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read files only when no other program is still writing them."""

import os
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from ...errors import KinematicsError, SettingsError
from ...robot.robot import file_state

# A file counts as complete after this time without changes, s. Programs that write a file make
# shorter pauses.
SETTLING_TIME = 0.1
# Longest wait for complete files, s. An upload of a robot file takes less time.
SETTLING_TIMEOUT = 5.0
# A file with faults may be incomplete if it changed less than this time ago, ns.
INCOMPLETE_AGE = 1_000_000_000
Content = TypeVar('Content')


def read_settled(read: Callable[[], Content], files: Sequence[str | os.PathLike[str]]) -> Content:
    """
    Call `read` until no file changed during the call, nor in the `SETTLING_TIME` before the call.
    Return the result of this call.

    Raises
    ------
    SettingsError
        The files change for longer than `SETTLING_TIMEOUT` s. Or `read` failed, and the last
        change of a file was less than 1 s before, so the file may be incomplete.
    KinematicsError
        `read` failed, and no file has changed for 1 s.
    """
    end = time.monotonic() + SETTLING_TIMEOUT
    while time.monotonic() < end:
        before = _states(files)
        if any(time.time_ns() - changed < SETTLING_TIME * 1e9 for changed, _, _ in before):
            time.sleep(SETTLING_TIME)
            if _states(files) != before:
                continue
        try:
            content = read()
        except KinematicsError as error:
            if _states(files) != before:
                continue
            age = time.time_ns() - max((changed for changed, _, _ in before), default=0)
            if age < INCOMPLETE_AGE:
                raise SettingsError(
                    f'{error}; it changed {age / 1e9:.1f} s ago: is it being written?'
                ) from None
            raise
        else:
            if _states(files) == before:
                return content
    raise SettingsError(
        f'{", ".join(map(str, files))}: another program still writes it after '
        f'{SETTLING_TIMEOUT:g} s; reload it when it is saved'
    )


def _states(files: Sequence[str | os.PathLike[str]]) -> list[tuple[int, int, int]]:
    return [file_state(file) for file in files if os.path.exists(file)]
