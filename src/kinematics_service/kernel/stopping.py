# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Set a deadline for the end of the process after a signal. The process ends even if its Python
interpreter is blocked.
"""

from .layout import stop_timer


def end_in_time(number: int, seconds: int) -> None:
    """
    Let the process end with the exit code 128 + `number`, `seconds` after the first signal with
    number `number`.

    `signal.alarm(0)` cancels the deadline. Set Python's own signal handler before you call this
    function.
    """
    stop_timer.start_at(number, seconds)
