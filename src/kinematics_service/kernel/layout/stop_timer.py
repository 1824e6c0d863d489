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

    The process ends `seconds` after the signal. Call this function after you have set Python's own
    handler, because the C handler starts the timer and then calls Python's handler. In plain
    Python the function does nothing, because no call holds the interpreter's lock for long.
    """
