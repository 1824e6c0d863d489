"""A timer of the operating system that a signal starts, even if Python does not run."""


def start_at(number: int, seconds: int) -> None:
    """
    Let the first signal `number` start a timer that ends the process with the code 128 + `number`.

    Call it after you have set Python's own handler. C starts the timer, and then calls that
    handler. Uncompiled it does nothing, because no call holds the interpreter's lock for long.
    """
