"""Roots of the equations of closed forms."""

import math

from ..layout import places
from ..layout.arrays import Numbers

# Tolerance at the border of a joint's reach: a cosine beyond 1 by less is taken as 1, since the
# target may be on that border up to its last digits; a target beyond it fails the proof
# afterwards.
BORDER = 1e-6
# Two roots nearer than the square root of this are one, up to round-off.
APART = 1e-16
SWEEPS = 60


def circle_roots(A: float, B: float, C: float, roots: Numbers) -> int:
    """
    Write the angles with A cos + B sin = C; return their number, up to 2.

    -1 if every angle is a root.
    """
    radius = math.sqrt(A * A + B * B)
    if radius == 0.0 or radius <= 1e-14 * abs(C):
        return -1 if C == 0.0 else 0
    share = C / radius
    if abs(share) > 1.0 + BORDER:
        return 0
    middle = math.atan2(B, A)
    # There are always two: if they meet, round-off would hide that other joints tell them apart.
    half = math.atan2(math.sqrt(max((1.0 - share) * (1.0 + share), APART)), share)
    roots[0] = middle + half
    roots[1] = middle - half
    return 2


def square_root_apart(square: float, size: float) -> float:
    """
    Return the root of a number with terms of a size, never so near to zero that two roots meet.

    -1 if it has none.
    """
    if square < -BORDER * size:
        return -1.0
    return math.sqrt(max(square, APART * size))


def absolute(x: float, y: float) -> float:
    """Return the absolute value of a complex number."""
    return math.sqrt(x * x + y * y)


def polynomial_roots(c: Numbers, degree: int, z: Numbers) -> None:
    """
    Write all roots of c[0] + ... + c[degree] z^degree, c[degree] not 0.

    The method is the iteration of Aberth (1973) and Ehrlich (1967). Complex numbers are pairs of
    real and imaginary part: languages divide them differently.
    """
    radius = 0.0
    last = absolute(c[2 * degree], c[2 * degree + 1])
    for k in range(degree):
        share = absolute(c[2 * k], c[2 * k + 1]) / last
        radius = max(radius, math.pow(share, 1.0 / (degree - k)))
    for k in range(degree):
        turn = 2.0 * places.PI * k / degree + 0.4
        z[2 * k] = radius * math.cos(turn)
        z[2 * k + 1] = radius * math.sin(turn)
    if radius == 0.0:
        return
    for _ in range(SWEEPS):
        largest = 0.0
        for k in range(degree):
            dx, dy = _correction(c, degree, z, k)
            z[2 * k] -= dx
            z[2 * k + 1] -= dy
            largest = max(largest, absolute(dx, dy))
        if largest <= 4e-16 * radius:
            return


def _correction(c: Numbers, degree: int, z: Numbers, k: int) -> tuple[float, float]:
    # Newton's step of root k of the polynomial divided by the other roots' factors.
    x, y = z[2 * k], z[2 * k + 1]
    value, value_i = c[2 * degree], c[2 * degree + 1]
    slope, slope_i = 0.0, 0.0
    for i in range(degree - 1, -1, -1):
        product = slope * x - slope_i * y
        slope_i = slope * y + slope_i * x + value_i
        slope = product + value
        product = value * x - value_i * y
        value_i = value * y + value_i * x + c[2 * i + 1]
        value = product + c[2 * i]
    if value == 0.0 and value_i == 0.0:
        return 0.0, 0.0
    # The sum of 1 / (z[k] - z[i]) over the other roots.
    others, others_i = 0.0, 0.0
    for i in range(degree):
        dx, dy = x - z[2 * i], y - z[2 * i + 1]
        square = dx * dx + dy * dy
        if i != k and square != 0.0:
            others += dx / square
            others_i -= dy / square
    below = slope - (value * others - value_i * others_i)
    below_i = slope_i - (value * others_i + value_i * others)
    square = below * below + below_i * below_i
    if square == 0.0:
        return 0.0, 0.0
    return (
        (value * below + value_i * below_i) / square,
        (value_i * below - value * below_i) / square,
    )
