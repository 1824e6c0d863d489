"""The end of a process whose Python cannot run."""

from .layout import stop_timer


def end_in_time(number: int, seconds: int) -> None:
    """
    End the process in `seconds` after the first signal `number`, unless `signal.alarm(0)` is called.

    Its exit code is then 128 + `number`. Python's handler must be set before.
    """
    stop_timer.start_at(number, seconds)
