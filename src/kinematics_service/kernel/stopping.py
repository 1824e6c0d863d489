"""A deadline for the end of a process, even if its Python does not run."""

from .layout import stop_timer


def end_in_time(number: int, seconds: int) -> None:
    """
    End the process some seconds after the first signal `number`, with the code 128 + `number`.

    `signal.alarm(0)` cancels the timer. Set Python's own handler before you call this.
    """
    stop_timer.start_at(number, seconds)
