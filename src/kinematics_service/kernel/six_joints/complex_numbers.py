# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute complex square roots and complex angles; define the limits of double precision.

Solutions of the inverse kinematics may be complex. A joint angle t then has an imaginary part. It
belongs to the complex number z = e^(i t), so t = -i log z and cos t = (z + 1/z) / 2.
"""

import math

from ..forward import chain_pass
from ..layout.arrays import Numbers
from . import pairs
from .pairs import Complex

# Unit round-off of double precision (IEEE 754: 2^-53 = 1.1e-16): the relative error of one
# operation.
ROUND_OFF = 1e-16
# Squared absolute values below this are taken as 0, because IEEE 754 numbers below 2e-308 lose
# digits. The inverse of a larger number is finite.
TINY = 1e-300
# Largest absolute imaginary part of an angle, rad. If the imaginary part is larger, a cosine
# exceeds e^25 / 2 = 4e10. The difference of two such cosines keeps fewer than six of sixteen
# digits.
MAX_IMAGINARY = 25.0


def is_near(t: Complex) -> bool:
    """
    Return whether the absolute imaginary part of a joint position is at most `MAX_IMAGINARY`.
    """
    return abs(t[1]) <= MAX_IMAGINARY


def absolute(a: Complex) -> float:
    """Return the absolute value |a| of a complex number."""
    return math.sqrt(pairs.square_of(a))


def root(a: Complex) -> Complex:
    """Return the square root of a complex number a, the root with a real part >= 0."""
    size = absolute(a)
    if not size > 0.0:
        return (0.0, 0.0)
    larger = math.sqrt(0.5 * (size + abs(a[0])))
    smaller = 0.5 * a[1] / larger
    if a[0] >= 0.0:
        return (larger, smaller)
    return (abs(smaller), larger if a[1] >= 0.0 else -larger)


def angle_of(unit: Complex) -> Complex:
    """
    Return the complex angle t with e^(i t) = unit, rad.

    If `unit` is 0 or not finite, the imaginary part of the result is beyond `MAX_IMAGINARY`.
    """
    square = pairs.square_of(unit)
    if not 0.0 < square < 1.0 / TINY:
        return (0.0, 2.0 * MAX_IMAGINARY)
    return (math.atan2(unit[1], unit[0]), -0.5 * math.log(square))


def angle(cosine: Complex, sine: Complex) -> Complex:
    """
    Return the complex angle, rad, whose cosine and sine are proportional to the two arguments.
    """
    length = root(pairs.plus(pairs.times(cosine, cosine), 1.0, pairs.times(sine, sine)))
    if pairs.square_of(length) == 0.0:
        return (0.0, 0.0)
    return angle_of(pairs.over((cosine[0] - sine[1], cosine[1] + sine[0]), length))


def write_turn(t: Complex, turn: Numbers) -> None:
    """
    Write to `turn` the complex cosine and the complex sine of a complex angle t.

    The four numbers are the real and imaginary part of the cosine, then those of the sine.
    `is_near` must be true for t.
    """
    s, c = chain_pass.sincos(t[0])
    up = math.exp(t[1])
    down = 1.0 / up
    even, odd = 0.5 * (up + down), 0.5 * (up - down)
    turn[0], turn[1] = c * even, -s * odd
    turn[2], turn[3] = s * even, c * odd
