"""The largest value of polynomials over their segments, exact to round-off."""

import math
from typing import NamedTuple

import numpy as np

from ....kernel import Floats

# Nothing is split that could exceed the largest value seen by less than this share.
ROUND_OFF = 1e-12
# Splits of a segment; each makes what is left to find four times smaller.
SPLITS = 40


class Extreme(NamedTuple):
    """A largest value, and where it is: the segment and the share of it."""

    value: float
    segment: int
    s: float


def largest(coefficients: Floats) -> Extreme:
    """
    Return the largest value of S polynomials over 0 to 1.

    A polynomial stays below the largest of its Bernstein coefficients, and has the first and the
    last of them at its ends: segments that may hold more than has been seen are split in two.

    Parameters
    ----------
    coefficients : shape (S, degree + 1)
        By powers of s.
    """
    controls = _bernstein(coefficients)
    segment = np.arange(len(controls))
    begin, length = np.zeros(len(controls)), 1.0
    best = Extreme(-math.inf, 0, 0.0)
    for _ in range(SPLITS):
        ends = np.stack([controls[:, 0], controls[:, -1]])
        side, k = np.unravel_index(int(np.argmax(ends)), ends.shape)
        if ends[side, k] > best.value:
            place = float(begin[k]) + float(side) * length
            best = Extreme(float(ends[side, k]), int(segment[k]), place)
        slack = ROUND_OFF * max(1.0, abs(best.value))
        left = np.max(controls, axis=1) > best.value + slack
        if not np.any(left):
            break
        first, second = _split(controls[left])
        length *= 0.5
        controls = np.concatenate([first, second])
        segment = np.tile(segment[left], 2)
        begin = np.concatenate([begin[left], begin[left] + length])
    return best


def _bernstein(coefficients: Floats) -> Floats:
    degree = coefficients.shape[1] - 1
    shares = [
        [math.comb(j, i) / math.comb(degree, i) for i in range(degree + 1)]
        for j in range(degree + 1)
    ]
    return np.asarray(coefficients @ np.array(shares).T)


def _split(controls: Floats) -> tuple[Floats, Floats]:
    # De Casteljau: the controls of both halves.
    first, second, row = [controls[:, 0]], [controls[:, -1]], controls
    while row.shape[1] > 1:
        row = 0.5 * (row[:, :-1] + row[:, 1:])
        first.append(row[:, 0])
        second.append(row[:, -1])
    return np.stack(first, axis=1), np.stack(second[::-1], axis=1)
