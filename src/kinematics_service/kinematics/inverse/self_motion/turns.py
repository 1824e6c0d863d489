# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find maximal runs (sequences) of pieces of a curve inside the joint limits, by intersection of
boxes.

A piece may be inside all limits with several vectors of full turns, one whole number for each
joint. These vectors are a box: one interval for each joint. A run of pieces is inside the limits
with every vector of turns in the intersection of the boxes of its pieces. The run is maximal with
a vector if neither the piece before nor the piece after is inside with this vector. The number of
vectors with which a run is maximal follows by inclusion and exclusion from the sizes of four
boxes: the box of the run, and its intersections with the box of the piece before, of the piece
after, and of both.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

Turns = tuple[int, ...]
# A box of vectors of full turns: the least and the largest number of full turns of each joint. The
# box is empty if one interval is empty.
Box = list[list[int]]


class PieceRun(NamedTuple):
    """
    A maximal sequence of pieces of a curve that are inside the limits with one vector of full
    turns.

    Attributes
    ----------
    first, pieces
        Index of the first piece, and the number of pieces; a run may continue over several laps.
    turns
        A vector of full turns, one number for each joint, with which the run is maximal: neither
        the piece before nor the piece after is inside the limits.
    closed
        Whether the last piece leads to the first piece with equal turns.
    windings
        The number of vectors of turns with which the run is maximal.
    """

    first: int
    pieces: int
    turns: Turns
    closed: bool
    windings: int


def runs_of(boxes: Sequence[Box], closed: bool, lap: Sequence[int]) -> Iterator[PieceRun]:
    """
    Yield the maximal runs (sequences) of pieces of a curve inside the limits.

    Parameters
    ----------
    boxes
        For each piece, the box of full turns with which the piece is inside the limits.
    closed
        Whether the first piece follows the last one.
    lap
        Number of full turns that each joint makes in one lap.
    """

    def box(k: int) -> Box:
        laps, i = divmod(k, len(boxes))
        if laps and not closed:
            return [[0, -1]] * len(lap)
        return [[low - laps * way, high - laps * way] for (low, high), way in zip(boxes[i], lap)]

    for i, common in enumerate(boxes):
        count = 1
        while size := _size(common):
            both = _common(common, before := box(i - 1))
            if (of_both := _size(both)) == size:
                break
            further = _common(common, after := box(i + count))
            windings = size - of_both - _size(further) + _size(_common(both, after))
            if windings > 0:
                yield PieceRun(i, count, _outside(common, before, after), False, windings)
            common, count = further, count + 1
    ends = closed and not any(lap)
    if ends and (size := _size(common := functools.reduce(_common, boxes))) > 0:
        yield PieceRun(0, len(boxes), tuple(low for low, _ in common), True, size)


def _common(one: Box, other: Box) -> Box:
    return [[max(a, c), min(b, d)] for (a, b), (c, d) in zip(one, other)]


def _size(box: Box) -> int:
    return math.prod([max(high - low + 1, 0) for low, high in box])


def _outside(box: Box, *others: Box) -> Turns:
    # Returns a vector of turns that is in `box` and in none of the boxes `others`. Each number of
    # the vector is the smallest number of `box`, or the first number beyond another box.
    ways = [
        sorted({low, *(end + 1 for _, end in beside if low <= end < high)})
        for (low, high), *beside in zip(box, *others)
    ]
    return next(
        turns
        for turns in itertools.product(*ways)
        if not any(all(a <= t <= b for t, (a, b) in zip(turns, one)) for one in others)
    )
