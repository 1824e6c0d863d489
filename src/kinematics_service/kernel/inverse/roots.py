"""Roots of the equations of closed forms."""

import math

from ..forward import vectors
from ..layout import places
from ..layout.arrays import Numbers, Vector

# Tolerance at the border of a joint's reach: a cosine beyond 1 by less is taken as 1, since the
# target may be on that border up to its last digits; a target beyond it fails the proof
# afterwards.
BORDER = 1e-6
# Two roots nearer than the square root of this are one, up to round-off.
APART = 1e-16
SWEEPS = 60
# What is not so many times as large as its error may be 0: errors are added up to first order.
MARGIN = 8.0


def circle_roots(A: float, B: float, C: float, error: float, roots: Numbers) -> int:
    """
    Write the angles with A cos + B sin = C; return their number, up to 2.

    -1 if every angle is a root. Behind the two, how far they are from those of the exact
    equation, whose coefficients differ by up to `error`: infinite if it may have others.
    """
    radius = math.sqrt(A * A + B * B)
    room, unsure = radius - abs(C), MARGIN * error
    roots[2] = places.INFINITY
    if room < -unsure:
        roots[2] = 0.0
        return 0
    if radius == 0.0 or radius <= 1e-14 * abs(C):
        return -1 if C == 0.0 else 0
    share = C / radius
    if abs(share) > 1.0 + BORDER:
        return 0
    middle = math.atan2(B, A)
    # There are always two: if they meet, round-off would hide that other joints tell them apart.
    sine = math.sqrt(max((1.0 - share) * (1.0 + share), APART))
    half = math.atan2(sine, share)
    roots[0] = middle + half
    roots[1] = middle - half
    if room > unsure:
        roots[2] = (1.0 + 1.0 / sine) * error / radius
    return 2


def square_roots(middle: float, square: float, size: float, error: float, roots: Numbers) -> int:
    """
    Write the numbers whose distance to `middle` squared is `square`; return their number, up to 2.

    `square` has terms of a size, and is known up to `error`. Behind the two, their error, as in
    `circle_roots`. They are never so near to each other that they meet.
    """
    roots[2] = places.INFINITY
    if square < -MARGIN * error:
        roots[2] = 0.0
        return 0
    if square < -BORDER * size:
        return 0
    half = math.sqrt(max(square, APART * size))
    roots[0], roots[1] = middle + half, middle - half
    if square > MARGIN * error:
        roots[2] = 0.5 * error / half
    return 2


def turn_error(axis: Vector, v: Vector, error: float) -> float:
    """Return how far v's angle about an axis is off if v is by `error`; infinite if all may be."""
    across = vectors.plus(v, -vectors.dot(axis, v), axis)
    length = math.sqrt(vectors.dot(across, across))
    return error / length if length > MARGIN * error else places.INFINITY


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


def root_bound(c: Numbers, degree: int, error: float, z: Numbers, k: int) -> float:
    """
    Return the radius of the disc about root k that holds one of the exact polynomial.

    That differs by up to `error` there. Discs that meet hold as many roots as there are discs
    (Smith 1970).
    """
    x, y = z[2 * k], z[2 * k + 1]
    value, value_i = 0.0, 0.0
    for i in range(degree, -1, -1):
        product = value * x - value_i * y + c[2 * i]
        value_i = value * y + value_i * x + c[2 * i + 1]
        value = product
    away = absolute(c[2 * degree], c[2 * degree + 1])
    for i in range(degree):
        if i != k:
            away *= absolute(x - z[2 * i], y - z[2 * i + 1])
    if not away > 0.0:
        return places.INFINITY
    return degree * (absolute(value, value_i) + error) / away


def is_apart(z: Numbers, bounds: Numbers, count: int, k: int) -> bool:
    """Return whether the disc of root k, five times as large, meets none of the others."""
    for i in range(count):
        away = absolute(z[2 * k] - z[2 * i], z[2 * k + 1] - z[2 * i + 1])
        if i != k and not away > 5.0 * bounds[k] + bounds[i]:
            return False
    return True
