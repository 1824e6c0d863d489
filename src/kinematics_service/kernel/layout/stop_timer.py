# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Let a signal start a timer of the operating system. The timer ends the process, even if the
interpreter is blocked.
"""


def start_at(number: int, seconds: int) -> None:
    """
    Let the first signal with number `number` start a timer that ends the process with the code 128
    + `number`.

    The process ends `seconds` after the signal. Set Python's own handler of the signal before you
    call this function. The compiled function then installs a handler in C, which starts the timer
    and calls Python's handler. In plain Python the function does nothing, because no call holds
    the interpreter's lock for long.
    """
