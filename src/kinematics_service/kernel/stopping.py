"""Set a deadline for the end of a process, even if its Python interpreter is blocked."""

from .layout import stop_timer


def end_in_time(number: int, seconds: int) -> None:
    """
    Let the process end `seconds` after the first signal `number`, with the code 128 + `number`.

    `signal.alarm(0)` cancels the timer. Set Python's own handler before you call this.
    """
    stop_timer.start_at(number, seconds)
