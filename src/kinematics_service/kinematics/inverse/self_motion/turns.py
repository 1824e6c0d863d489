# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find maximal runs (sequences) of pieces of a curve inside the joint limits, by intersection of
boxes.

A vector of full turns has a whole number for each joint. If these turns are added to the joint
positions of a piece, the piece may come inside the limits. The vectors that bring a piece inside
the limits form a box, the box of the piece: an interval of whole numbers for each joint.

A run is a sequence of pieces whose boxes have common vectors. Let R be the intersection of the
boxes, A the box of the piece before the run, and B the box of the piece after the run. The run is
maximal with a vector of R if this vector is neither in A nor in B. Let size(X) be the number of
vectors in a box X. Then the number of vectors with which the run is maximal is size(R) - size(R
and A) - size(R and B) + size(R and A and B), by inclusion and exclusion.
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
    A maximal sequence of pieces of a curve that are inside the limits after equal full turns are
    added to the joint positions of all pieces.

    Attributes
    ----------
    first, pieces
        Index of the first piece, and the number of pieces; a run may continue over several laps.
    turns
        The full turns that are added, one number for each joint. They bring all pieces of the run
        inside the limits, but neither the piece before nor the piece after.
    closed
        Whether the last piece leads to the first piece with equal turns.
    windings
        Several vectors of full turns may have this effect; `turns` is one of them. `windings` is
        the number of these vectors.
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
        For each piece, the full turns that bring the piece inside the limits: for each joint, the
        least and the largest number of turns.
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
    # Returns a vector of turns that is in `box` and in none of the boxes `others`. A box has an
    # interval low to high for each joint. Candidates for each number of the vector are the joint's
    # low in `box`, and high + 1 for each high in `others`.
    ways = [
        sorted({low, *(end + 1 for _, end in beside if low <= end < high)})
        for (low, high), *beside in zip(box, *others)
    ]
    return next(
        turns
        for turns in itertools.product(*ways)
        if not any(all(a <= t <= b for t, (a, b) in zip(turns, one)) for one in others)
    )
