# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the longest sequences of curve pieces inside the joint limits, by intersection of boxes.

A piece is the part of a curve between two places at which a joint passes a limit. A vector of full
turns has a whole number for each joint. These turns are added to the joint positions of a piece.
The vectors that bring the piece inside the limits form a box, the box of the piece: an interval of
whole numbers for each joint.

A run is a sequence of successive pieces, all brought inside the limits by one vector. The vector
must not also bring the piece before or after the run inside the limits. Let R be the intersection
of the boxes of the sequence, A the box of the piece before, and B the box of the piece after. Then
the vector is in R, but neither in A nor in B. Let size(X) be the number of vectors in a box X. The
number of possible vectors is size(R) - size(R and A) - size(R and B) + size(R and A and B), by
inclusion and exclusion.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

Turns = tuple[int, ...]
# A box is a set of vectors of full turns. It has an interval for each joint: the least and the
# largest number of full turns. If the interval of one joint is empty, the box is empty.
Box = list[list[int]]


class PieceRun(NamedTuple):
    """
    Successive pieces of a curve, brought inside the joint limits by one vector of full turns.

    Attributes
    ----------
    first, pieces
        Index of the first piece, and the number of pieces. On a closed curve, a run may continue
        over several laps.
    turns
        The full turns to add to the joint positions, one number for each joint. They bring all
        pieces of the run inside the limits, but neither the piece before nor the piece after.
    closed
        Whether the run is a whole closed curve on which each joint returns to its position without
        a full turn.
    windings
        Number of vectors of full turns that could replace `turns`, including `turns`.
    """

    first: int
    pieces: int
    turns: Turns
    closed: bool
    windings: int


def runs_of(boxes: Sequence[Box], closed: bool, lap: Sequence[int]) -> Iterator[PieceRun]:
    """
    Yield the runs of a curve: longest sequences of successive pieces inside the limits.

    Full turns are added to the joint positions of a piece to bring the piece inside the limits.
    Within a run, the number of full turns added to each joint is constant.

    Parameters
    ----------
    boxes
        For each piece of the curve, the full turns that bring the piece inside the limits: for
        each joint, the least and the largest number of turns.
    closed
        Whether the curve is closed: the first piece follows the last one.
    lap
        Number of full turns that each joint makes in one lap of a closed curve.
    """

    def box(k: int) -> Box:
        laps, i = divmod(k, len(boxes))
        if laps and not closed:
            return [[0, -1]] * len(lap)
        return [[low - laps * t, high - laps * t] for (low, high), t in zip(boxes[i], lap)]

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


def _common(box: Box, other: Box) -> Box:
    return [[max(a, c), min(b, d)] for (a, b), (c, d) in zip(box, other)]


def _size(box: Box) -> int:
    return math.prod([max(high - low + 1, 0) for low, high in box])


def _outside(box: Box, *others: Box) -> Turns:
    # Returns a vector of full turns that is in `box` and in none of the boxes `others`. A few
    # candidates for each joint's number of turns are enough: the lower end of the joint's interval
    # in `box`, and the number just above the joint's interval in each of `others`.
    choices = [
        sorted({low, *(end + 1 for _, end in beside if low <= end < high)})
        for (low, high), *beside in zip(box, *others)
    ]
    return next(
        turns
        for turns in itertools.product(*choices)
        if not any(all(a <= t <= b for t, (a, b) in zip(turns, other)) for other in others)
    )
