"""Frames that are missing in a motion, repeated, or far off: what even stamps do not show."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .....kernel import Floats
from .....robot.measures import Level
from .....typography import counted
from ..findings import Finding

# A step over missing frames is nearly a multiple of those around it, at most this one, and goes
# the same way (cosine): a person's motion may take a fast step as well.
MULTIPLE_BY, MOST, WAY = 0.25, 6.0, 0.97
# Of the two steps before and the two after, each differs from the next by less than this share.
ALIKE = 0.4
# A motion stands out of its noise if its steps are this many times those that change at random.
CLEAR = 6.0
# A row is off if it is this many times the noise, this far (rad, m), and more than this many times
# the way between its neighbours, away from their middle.
OFF, OFF_BY, OFF_WAY = 25.0, 0.02, 3.0
# Fewer steps tell no noise.
FEWEST = 12


class Breaks(NamedTuple):
    """Rows after which frames are missing, rows that repeat the one before, and rows far off."""

    missing: list[int]
    repeated: list[int]
    off: list[int]


def breaks_of(q: Floats) -> Breaks:
    """
    Return where a motion misses a frame, has one twice, or one that is far off.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Of rows at even times, turns of joints without limits undone.
    """
    steps = np.diff(q, axis=0)
    if len(steps) < FEWEST:
        return Breaks([], [], [])
    before, own, after = steps[:-2], steps[1:-1], steps[2:]
    first, size, last = (np.linalg.norm(one, axis=1) for one in (before, own, after))
    around = 0.5 * (first + last)
    # What is left of a step by its neighbours is noise wherever the motion is smooth.
    noise = float(np.median(np.linalg.norm(own - 0.5 * (before + after), axis=1)))
    with np.errstate(invalid='ignore', divide='ignore'):
        cosine = np.sum(own * (before + after), axis=1) / (2.0 * size * around)
        straight = np.sum(before * after, axis=1) / (first * last)
        times = np.where(around > 0.0, size / around, 0.0)
    clear = np.minimum(first, last) > CLEAR * noise
    changes = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    near = ALIKE * around + 2.0 * noise
    alike = np.linalg.norm(after - before, axis=1) < near
    alike[:1] = alike[-1:] = False  # two steps before and after are needed
    alike[1:-1] &= np.maximum(changes[:-3], changes[3:]) < near[1:-1]
    whole = (times > 1.5) & (times < MOST) & (np.abs(times - np.rint(times)) < MULTIPLE_BY)
    missing = clear & alike & whole & (cosine > WAY)
    repeated = clear & (size == 0.0) & (straight > WAY)
    middle = np.linalg.norm(q[1:-1] - 0.5 * (q[:-2] + q[2:]), axis=1)
    way = np.linalg.norm(q[2:] - q[:-2], axis=1)
    off = (middle > np.maximum(OFF * noise, OFF_BY)) & (middle > OFF_WAY * way)
    return Breaks(
        (np.flatnonzero(missing) + 1).tolist(),
        (np.flatnonzero(repeated) + 2).tolist(),
        (np.flatnonzero(off) + 1).tolist(),
    )


def break_findings(q: Floats, t: Floats) -> Iterator[Finding]:
    """Yield findings on frames that are missing or repeated; q (N, n), rad or m; t (N,), s."""
    found = breaks_of(q)
    for rows, one, many in (
        (found.missing, 'is missing', 'are missing'),
        (found.repeated, 'repeats the one before while the arm moves', 'repeat the one before'),
        (
            found.off,
            'is far from those before and after it',
            'are far from those before and after',
        ),
    ):
        if rows:
            words = one if len(rows) == 1 else many
            yield Finding(
                Level.WARN,
                f'{counted(len(rows), "frame")} {words}, by the steps of the joints; the first '
                f'at row {rows[0]}, {t[rows[0]]:.3f} s.',
            )
