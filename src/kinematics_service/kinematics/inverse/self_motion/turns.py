"""
Maximal runs of pieces of a curve inside the joint limits, with full turns counted as intervals.

The full turns by which a piece is inside all limits are a box of integers, one interval a joint.
A run of pieces is followed with every vector of turns in the intersection of its boxes. By
inclusion and exclusion the sizes of four boxes give the number of vectors for which the run can
be extended at neither end.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

Turns = tuple[int, ...]
# The least and the largest number of turns of each joint; empty if one interval is.
Box = list[list[int]]


class PieceRun(NamedTuple):
    """
    Pieces that follow each other with the same turns, and nothing before or after them.

    Attributes
    ----------
    first, pieces
        The first piece, and the number of pieces, lap after lap.
    turns
        Turns of the first piece for which this is so, one number a joint.
    closed
        Whether the last piece leads to the first one with the same turns.
    windings
        The number of vectors of turns for which this is so.
    """

    first: int
    pieces: int
    turns: Turns
    closed: bool
    windings: int


def runs_of(boxes: Sequence[Box], closed: bool, lap: Sequence[int]) -> Iterator[PieceRun]:
    """
    Yield the maximal runs of pieces inside the limits.

    Parameters
    ----------
    boxes
        The turns by which each piece is inside.
    closed
        Whether the first piece follows the last one.
    lap
        The turns that each joint has moved then.
    """

    def box(k: int) -> Box:
        laps, i = divmod(k, len(boxes))
        if laps and not closed:
            return [[0, -1]] * len(lap)
        return [[low - laps * way, high - laps * way] for (low, high), way in zip(boxes[i], lap)]

    for i, whole in enumerate(boxes):
        before, common, count = box(i - 1), whole, 1
        both = _common(common, before)
        while (size := _size(common)) > _size(both):
            if count == len(boxes) and closed and not any(lap):
                break
            after = box(i + count)
            further, all_three = _common(common, after), _common(both, after)
            windings = size - _size(both) - _size(further) + _size(all_three)
            if windings > 0:
                yield PieceRun(i, count, _outside(common, before, after), False, windings)
            common, both, count = further, all_three, count + 1
    if closed and not any(lap):
        common = list(boxes[0])
        for other in boxes[1:]:
            common = _common(common, other)
        if (size := _size(common)) > 0:
            yield PieceRun(0, len(boxes), tuple(low for low, _ in common), True, size)


def _common(one: Box, other: Box) -> Box:
    return [[max(a, c), min(b, d)] for (a, b), (c, d) in zip(one, other)]


def _size(box: Box) -> int:
    return math.prod(max(high - low + 1, 0) for low, high in box)


def _outside(box: Box, *others: Box) -> Turns:
    # A vector of a box that is in none of the others: a corner, or next to one of theirs.
    ways = []
    for (low, high), *beside in zip(box, *others):
        ends = {low, *(end for a, b in beside for end in (a - 1, b + 1) if low < end <= high)}
        ways.append(sorted(ends))
    inside = (
        turns
        for turns in itertools.product(*ways)
        if all(any(not a <= t <= b for t, (a, b) in zip(turns, other)) for other in others)
    )
    return next(inside)
