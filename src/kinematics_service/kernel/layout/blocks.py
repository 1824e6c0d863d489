# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Interleave the rows of LANES poses: first the first number of each row, then the second number of
each row, and so on. A lane is the position of a pose in this order, from 0.

A loop over the lanes applies one operation to neighbours in memory, so the processor computes
several lanes at once.
"""

from . import arrays, places
from .arrays import Flat, Numbers


def put_side_by_side(rows: Flat, width: int, count: int, lanes: Flat) -> None:
    """
    Copy the first `count` numbers of each of LANES rows to `lanes`, interleaved.

    `rows` has LANES rows of `width` numbers.
    """
    for k in range(count):
        for lane in range(places.LANES):
            lanes[k * places.LANES + lane] = rows[lane * width + k]


def put_one_by_one(lanes: Flat, count: int, rows: Flat, width: int) -> None:
    """
    Copy `count` numbers of each pose from the interleaved array `lanes` to the pose's own row.

    `rows` has one row of length `width` for each of LANES poses. The numbers go to the beginning
    of the row.
    """
    for lane in range(places.LANES):
        row, of_lane = arrays.after(rows, lane * width), arrays.after(lanes, lane)
        # Copy two neighbours, row[k] and row[k + 1], in each pass. The compiler then writes both
        # numbers with one instruction.
        for k in range(0, count - 1, 2):
            first = of_lane[k * places.LANES]
            second = of_lane[(k + 1) * places.LANES]
            row[k], row[k + 1] = first, second
        if count % 2 == 1:
            row[count - 1] = of_lane[(count - 1) * places.LANES]


def all_within(numbers: Numbers, count: int, limit: float) -> bool:
    """
    Return whether the first `count` numbers of each pose are finite and at most `limit` in size.

    `numbers` has the interleaved numbers of LANES poses.
    """
    beyond = 0
    for k in range(count * places.LANES):
        beyond += 0 if abs(numbers[k]) <= limit else 1
    return beyond == 0
