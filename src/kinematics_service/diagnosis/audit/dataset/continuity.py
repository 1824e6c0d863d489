"""Frames that are missing in a motion, or repeated: what evenly spaced stamps do not show."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....robot.measures import Level
from ....typography import counted
from ..findings import Finding

# A step over a missing frame is about twice as long as those around it, and goes the same way.
LEAST, MOST, WAY = 1.6, 6.0, 0.97
# The steps before and after differ by less than this factor, and by less than this share.
ALIKE = 1.6
# A motion stands out of its noise if its steps are this many times those that change at random.
CLEAR = 6.0
# Fewer steps tell no noise.
FEWEST = 12


class Breaks(NamedTuple):
    """Rows after which frames are missing, and rows that repeat the one before."""

    missing: list[int]
    repeated: list[int]


def breaks_of(q: Floats) -> Breaks:
    """
    Return where a motion misses a frame, or has one twice.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Of rows at even times, turns of joints without limits undone.
    """
    steps = np.diff(q, axis=0)
    if len(steps) < FEWEST:
        return Breaks([], [])
    before, own, after = steps[:-2], steps[1:-1], steps[2:]
    sizes = np.linalg.norm(own, axis=1)
    around = 0.5 * (np.linalg.norm(before, axis=1) + np.linalg.norm(after, axis=1))
    # What is left of a step by its neighbours is noise wherever the motion is smooth.
    noise = float(np.median(np.linalg.norm(own - 0.5 * (before + after), axis=1)))
    apart = np.linalg.norm(after - before, axis=1)
    steady = (around > CLEAR * noise) & (apart < (ALIKE - 1.0) * around) & (around > 0.0)
    with np.errstate(invalid='ignore', divide='ignore'):
        cosine = np.sum(own * (before + after), axis=1) / (2.0 * sizes * around)
        times = sizes / around
    missing = steady & (times > LEAST) & (times < MOST) & (cosine > WAY)
    repeated = steady & (sizes == 0.0)
    return Breaks((np.flatnonzero(missing) + 1).tolist(), (np.flatnonzero(repeated) + 2).tolist())


def break_findings(q: Floats, t: Floats) -> Iterator[Finding]:
    """Yield findings on frames that are missing or repeated; q (N, n), rad or m; t (N,), s."""
    found = breaks_of(q)
    for rows, words in (
        (found.missing, 'is missing: a step is as long as two'),
        (found.repeated, 'repeats the one before while the arm moves'),
    ):
        if rows:
            one = words if len(rows) == 1 else words.replace('is missing', 'are missing')
            one = one.replace('repeats', 'repeat') if len(rows) > 1 else one
            yield Finding(
                Level.WARN,
                f'{counted(len(rows), "frame")} {one}; the first at row {rows[0]}, '
                f'{t[rows[0]]:.3f} s.',
            )
