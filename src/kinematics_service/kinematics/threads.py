"""A batch on all cores: the compiled functions release the interpreter, so plain threads do it."""

import os
import threading
from collections.abc import Callable

# Rows of a part, at least: some milliseconds of work, while starting a thread costs some 50 us.
LEAST_PART = 10_000


def cores() -> int:
    """Return the number of cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1


def in_parts(count: int, work: Callable[[int, int], int], least: int = 0) -> int:
    """
    Do `work(begin, end)` for all of `count` rows, part by part, on all cores if that is faster.

    Returns -1, or the least row that a part returned: where the first thing went wrong.

    Parameters
    ----------
    count
        Number of rows; each one's result must not depend on the others.
    work
        Computes rows begin to end and returns -1, or the row where it stopped.
    least
        Rows of a part, at least; 0: `LEAST_PART`.
    """
    parts = count // (least or LEAST_PART)
    workers = min(cores(), parts)
    if workers < 2:
        return work(0, count)
    bounds = [count * k // parts for k in range(parts + 1)]
    found = [-1] * parts
    errors: list[BaseException] = []
    left = iter(
        range(parts)
    )  # a thread that is done takes the next part: a busy core does not hold up the others

    def run() -> None:
        try:
            for k in left:
                found[k] = work(bounds[k], bounds[k + 1])
        except BaseException as error:  # the caller gets it below
            errors.append(error)

    threads = [threading.Thread(target=run, daemon=True) for _ in range(workers - 1)]
    for thread in threads:
        thread.start()
    run()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]
    return min((row for row in found if row >= 0), default=-1)
