"""Complex angles, and roots of complex numbers."""

import math

from ..forward import chain_pass
from ..layout.arrays import Numbers
from . import pairs
from .pairs import Complex

# Angles farther from the real ones have a cosine beyond 1e10: nothing is left of a real one's
# digits beside it.
FARTHEST = 25.0


def is_near(t: Complex) -> bool:
    """Return whether a position is a number not too far from the real ones."""
    return abs(t[0]) < 1e8 and abs(t[1]) <= FARTHEST


def root(a: Complex) -> Complex:
    """Return the square root whose real part is not negative."""
    size = math.sqrt(pairs.square_of(a))
    if not size > 0.0:
        return (0.0, 0.0)
    larger = math.sqrt(0.5 * (size + abs(a[0])))
    smaller = 0.5 * a[1] / larger
    if a[0] >= 0.0:
        return (larger, smaller)
    return (abs(smaller), larger if a[1] >= 0.0 else -larger)


def angle_of(unit: Complex) -> Complex:
    """Return the t with e^(i t) = unit, beyond `FARTHEST` where it is 0 or no number."""
    square = pairs.square_of(unit)
    if not 0.0 < square < 1e300:
        return (0.0, 2.0 * FARTHEST)
    return (math.atan2(unit[1], unit[0]), -0.5 * math.log(square))


def angle(cosine: Complex, sine: Complex) -> Complex:
    """Return the t whose cosine and sine are proportional to these."""
    length = root(pairs.plus(pairs.times(cosine, cosine), 1.0, pairs.times(sine, sine)))
    if pairs.square_of(length) == 0.0:
        return (0.0, 0.0)
    return angle_of(pairs.over((cosine[0] - sine[1], cosine[1] + sine[0]), length))


def write_turn(t: Complex, turn: Numbers) -> None:
    """Write cosine and sine of an angle not beyond `FARTHEST`: two pairs."""
    s, c = chain_pass.sincos(t[0])
    up = math.exp(t[1])
    down = 1.0 / up
    even, odd = 0.5 * (up + down), 0.5 * (up - down)
    turn[0], turn[1] = c * even, -s * odd
    turn[2], turn[3] = s * even, c * odd
