# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Bound the largest value of a quantity over a motion from below and above, by branch and bound
(Land and Doig, 1960).

The motion is divided into pieces, which are intervals of time. If the upper bound of the quantity
in a piece exceeds a limit, the piece is halved. The bounds in the two halves are tighter than the
bound in the piece.
"""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ....kernel import Floats
from .polynomials import Pieces, PolynomialMotion, joined
from .verdicts import PlanVerdict

# Largest number of times that a segment between two points of the motion is halved.
MAX_HALVINGS = 40
# Largest number of pieces (intervals of time) for which a quantity is evaluated at once. The
# number is limited to bound the memory.
MAX_ROWS = 16_384


class Extreme(NamedTuple):
    """
    The largest value of a quantity over a motion, and where in the motion it occurs.

    `segment` is the number of the segment. `s` is the fraction of the segment's duration: 0 at the
    begin of the segment, 1 at the end.
    """

    value: float
    segment: int
    s: float


class Bounded(NamedTuple):
    """
    The values of a quantity in N pieces of a motion (intervals of time), with an upper bound for
    each piece.

    Attributes
    ----------
    value : shape (N,)
        The value of the quantity at the middle of each piece.
    upper : shape (N,)
        An upper bound of the values of the quantity in each piece.
    short : shape (N,)
        Whether a piece is too short to be halved.
    """

    value: Floats
    upper: Floats
    short: npt.NDArray[np.bool_]


Quantity: TypeAlias = Callable[[Pieces], Bounded]


class Bracket(NamedTuple):
    """
    Lower and upper bound of the largest value of a quantity over a motion.

    The motion is divided into pieces, which are intervals of time.

    Attributes
    ----------
    seen
        The lower bound: the largest value of the quantity at the middles of pieces and the ends of
        segments.
    bound
        The upper bound: the largest of the upper bounds of all pieces. `segment` and `s` of
        `bound` give the middle of the piece with the largest upper bound.
    pieces, upper
        Pieces that cover the whole motion, and the upper bound of the quantity in each piece.
    """

    seen: Extreme
    bound: Extreme
    pieces: Pieces
    upper: Floats


def verdict_of(seen: float, bound: float, limit: float) -> PlanVerdict:
    """
    Return whether a quantity is proved to stay within `limit`, refuted, or neither. `seen` is its
    largest known value, `bound` an upper bound.
    """
    if seen > limit:
        return 'refuted'
    return 'proved' if bound <= limit else 'not decided'


def bracketed(
    motion: PolynomialMotion, quantity: Quantity, enough: Callable[[float], float], budget: int
) -> Bracket:
    """
    Return a lower and an upper bound of the largest value of a quantity over a motion.

    Parameters
    ----------
    quantity
        A function that evaluates the quantity in pieces of the motion (intervals of time). For a
        piece of length 0 at an end of a segment, it evaluates the quantity at this end.
    enough
        A function of the largest value of the quantity that was found so far. The function returns
        a limit. If the upper bound of the quantity in a piece exceeds the limit, the piece is
        halved; otherwise the upper bound is accepted.
    budget
        Largest number of pieces that halving may make. The bisection starts with one piece for
        each segment, and these are not counted.
    """
    count = len(motion.begins)
    ends = Pieces(np.tile(np.arange(count), 2), np.repeat([0.0, 1.0], count), np.zeros(2 * count))
    pieces, seen = joined([ends, motion.whole()]), Extreme(-math.inf, 0, 0.0)
    parts, bounds = [], []
    for halvings in range(MAX_HALVINGS + 1):
        value, upper, short = _in_parts(quantity, pieces)
        seen = max(seen, _largest(pieces, value), key=lambda extreme: extreme.value)
        split = (upper > enough(seen.value)) & ~short
        budget -= 2 * int(np.sum(split))
        split &= budget >= 0 and halvings < MAX_HALVINGS
        parts.append(pieces.chosen(~split))
        bounds.append(upper[~split])
        if not np.any(split):
            break
        pieces = pieces.chosen(split).halved()
    pieces, upper = joined(parts), np.concatenate(bounds)
    return Bracket(seen, _largest(pieces, upper), pieces, upper)


def _in_parts(quantity: Quantity, pieces: Pieces) -> Bounded:
    begins = range(0, len(pieces.segment), MAX_ROWS)
    parts = [quantity(pieces.chosen(slice(begin, begin + MAX_ROWS))) for begin in begins]
    return Bounded(*(np.concatenate(columns) for columns in zip(*parts)))


def _largest(pieces: Pieces, values: Floats) -> Extreme:
    k = int(np.argmax(values))
    return Extreme(float(values[k]), int(pieces.segment[k]), float(pieces.middle[k]))
