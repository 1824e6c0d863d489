# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Run parts of a batch in several threads, because compiled functions release the interpreter lock.
"""

import os
from collections.abc import Callable

# Smallest number of rows (poses) in a part of a batch. A part of this size takes milliseconds,
# while a thread starts in 50 us.
MIN_PART = 10_000


def cores() -> int:
    """Return the number of cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # systems other than Linux lack this function
        return os.cpu_count() or 1


def in_parts(count: int, work: Callable[[int, int], int], least: int = 0) -> int:
    """
    Call `work(begin, end)` for successive parts of a batch of `count` rows, on all cores if that
    is faster.

    Returns the smallest index of a row that failed, or -1 if no row failed.

    Parameters
    ----------
    count
        Number of rows; their results must not depend on each other.
    work
        Computes the rows from `begin` up to `end`, without `end`. Returns -1, or the index of the
        row that failed.
    least
        Smallest number of rows of a part; 0: `MIN_PART`.
    """
    parts = count // (least or MIN_PART)
    workers = min(cores(), parts)
    if workers < 2:
        return work(0, count)
    from concurrent.futures import ThreadPoolExecutor  # import here, because it takes 10 ms

    bounds = [count * k // parts for k in range(parts + 1)]
    # Let a thread that has finished take the next part, so that a busy core does not delay the
    # other threads.
    with ThreadPoolExecutor(workers) as pool:
        rows = list(pool.map(work, bounds[:-1], bounds[1:]))
    return min((row for row in rows if row >= 0), default=-1)
