"""Real trigonometric polynomials: coefficients from samples, and complex roots z = e^(i t)."""

import math

from ..forward import chain_pass
from ..layout import places
from ..layout.arrays import Flat, Numbers
from . import pairs
from .pairs import Complex

SWEEPS = 60
# A value below this share of its terms is round-off; so is a step below this share of the root.
ROUND_OFF, STANDS = 4e-16, 1e-15


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


def roots_on_plane(c: Numbers, degree: int, z: Numbers) -> int:
    """
    Write the points z of all roots of the sum of c[k] z^k, k from -degree to degree.

    By the iteration of Aberth (1973) and Ehrlich (1967). Coefficients of -k are conjugate to those
    of k. Returns how many there are: twice the degree.
    """
    count = 2 * degree
    arrived = [0] * 24
    for k in range(count):
        turn, radius = places.TAU * k / count + 0.4, 0.7 if k % 2 == 0 else 1.4
        pairs.put(z, k, (radius * math.cos(turn), radius * math.sin(turn)))
    left = count
    for _ in range(SWEEPS):
        if left == 0:
            break
        for k in range(count):
            if arrived[k] == 0 and _improve(c, degree, z, k):
                arrived[k] = 1
                left -= 1
    return count


def _coefficient(c: Numbers, degree: int, k: int) -> Complex:
    # Of z^k in z^degree times the sum.
    k -= degree
    if k < 0:
        return (c[-2 * k], -c[-2 * k + 1])
    return (c[2 * k], c[2 * k + 1])


def _improve(c: Numbers, degree: int, z: Numbers, k: int) -> bool:
    # One step of root k; whether it has arrived.
    count = 2 * degree
    here = pairs.pair(z, k)
    size = math.sqrt(pairs.square_of(here))
    outside = size > 1.0
    # Outside the unit circle the polynomial is taken backwards, in 1 / z.
    x = pairs.over((1.0, 0.0), here) if outside else here
    shrink = 1.0 / size if outside else size
    a = _coefficient(c, degree, 0 if outside else count)
    value, value_i, slope, slope_i = a[0], a[1], 0.0, 0.0
    terms: float = math.sqrt(pairs.square_of(a))
    for i in range(1, count + 1):
        a = _coefficient(c, degree, i if outside else count - i)
        product = slope * x[0] - slope_i * x[1]
        slope_i = slope * x[1] + slope_i * x[0] + value_i
        slope = product + value
        product = value * x[0] - value_i * x[1]
        value_i = value * x[1] + value_i * x[0] + a[1]
        value = product + a[0]
        terms = terms * shrink + abs(a[0]) + abs(a[1])
    p, derivative = (value, value_i), (slope, slope_i)
    if outside:
        # P = z^count q(1/z), so P'/P = count / z - q' / (z^2 q).
        p = pairs.times(p, x)
        bent = pairs.times(pairs.times(x, x), derivative)
        derivative = (count * p[0] - bent[0], count * p[1] - bent[1])
        p = (value, value_i)
    step = _step(p, derivative, z, k, count)
    pairs.put(z, k, pairs.plus(here, -1.0, step))
    small = math.sqrt(value * value + value_i * value_i) < ROUND_OFF * terms
    return small or pairs.square_of(step) < (STANDS * size) * (STANDS * size)


def _step(p: Complex, derivative: Complex, z: Numbers, k: int, count: int) -> Complex:
    # p / (p' - p sum of 1 / (z[k] - z[i])): the step of Newton with the other roots divided out.
    here = pairs.pair(z, k)
    re, im = 0.0, 0.0
    for i in range(count):
        dx, dy = here[0] - z[2 * i], here[1] - z[2 * i + 1]
        square = dx * dx + dy * dy
        if i != k and square > 0.0:
            re += dx / square
            im -= dy / square
    below = pairs.plus(derivative, -1.0, pairs.times(p, (re, im)))
    if pairs.square_of(below) == 0.0:
        return (0.0, 0.0)
    return pairs.over(p, below)


def write_bounds(c: Numbers, degree: int, noise: float, z: Numbers, bounds: Numbers) -> None:
    """
    Write how far each root may be from one of the exact polynomial, as a share of its size.

    Discs about the z[k] with the radius count |P(z[k])| / |c[degree] product of (z[k] - z[i])|
    hold all roots, and wherever discs are connected as many of them as there are discs (Smith
    1970). What the exact P is at z[k] is what errors of its coefficients, each up to `noise`, make
    of it.
    """
    count = 2 * degree
    leading = math.sqrt(pairs.square_of(pairs.pair(c, degree)))
    for k in range(count):
        here = pairs.pair(z, k)
        size = math.sqrt(pairs.square_of(here))
        outside = size > 1.0
        x = pairs.over((1.0, 0.0), here) if outside else here
        shrink = 1.0 / size if outside else size
        value, terms = (0.0, 0.0), 0.0
        for i in range(count + 1):
            a = _coefficient(c, degree, i if outside else count - i)
            value = pairs.plus(pairs.times(value, x), 1.0, a)
            terms = terms * shrink + 1.0
        # Outside the circle all is divided by z^count.
        away = leading * (1.0 if outside else size)
        for i in range(count):
            if i != k:
                way = math.sqrt(pairs.square_of(pairs.plus(here, -1.0, pairs.pair(z, i))))
                away *= way / size if outside else way
        missed = math.sqrt(pairs.square_of(value)) + noise * terms
        bounds[k] = count * missed / away if away > 0.0 else places.INFINITY


def is_alone(z: Numbers, bounds: Numbers, count: int, k: int) -> bool:
    """Return whether the disc of root k meets none of those inside the unit circle or near it."""
    here = pairs.pair(z, k)
    size = math.sqrt(pairs.square_of(here))
    for i in range(count):
        other = pairs.pair(z, i)
        there = math.sqrt(pairs.square_of(other))
        # Those outside are mirrored inside.
        if i != k and there < 1.5:
            radii = bounds[k] * size + bounds[i] * there
            if pairs.square_of(pairs.plus(here, -1.0, other)) <= radii * radii:
                return False
    return True
