"""The end of a process whose Python cannot run."""

from .layout import stop_timer


def end_in_time(number: int, seconds: int) -> None:
    """
    End the process some seconds after the first signal `number`, with the code 128 + `number`.

    `signal.alarm(0)` cancels the timer. Set Python's handler before.
    """
    stop_timer.start_at(number, seconds)
