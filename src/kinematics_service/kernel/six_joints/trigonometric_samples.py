"""Coefficients of real trigonometric polynomials from their values at equal turns."""

import math

from ..forward import chain_pass
from ..layout import places
from ..layout.arrays import Flat


def write_circle(samples: int, circle: Flat) -> None:
    """Write cosine and sine of so many equal turns."""
    for k in range(samples):
        s, c = chain_pass.sincos(places.TAU * k / samples)
        circle[2 * k], circle[2 * k + 1] = c, s


def write_coefficients(
    values: Flat, count: int, circle: Flat, largest: float, degree: int, c: Flat
) -> float:
    """
    Write the complex coefficients of e^(i k t) up to a degree; those of -k are conjugate.

    They are divided by the largest value. Returns the largest coefficient beyond the degree: the
    round-off of the values, or what is left where their polynomial vanishes.
    """
    noise = 0.0
    # Real values have as many different coefficients as half of them.
    for k in range((count + 1) // 2):
        re, im = 0.0, 0.0
        for n in range(count):
            m = (k * n) % count
            re += values[n] * circle[2 * m]
            im -= values[n] * circle[2 * m + 1]
        re, im = re / (count * largest), im / (count * largest)
        if k <= degree:
            c[2 * k], c[2 * k + 1] = re, im
        else:
            noise = max(noise, math.sqrt(re * re + im * im))
    return noise
