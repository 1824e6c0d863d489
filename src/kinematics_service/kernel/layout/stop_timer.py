"""A timer of the operating system that a signal starts, whatever Python does meanwhile."""


def start_at(number: int, seconds: int) -> None:
    """
    Let the first signal `number` start a timer that ends the process with the code 128 + `number`.

    Call it after Python's own handler is set: the timer is started in C, then that handler is
    called as before. Uncompiled it does nothing: no call keeps the interpreter's lock for long.
    """
