# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Interpolate a real trigonometric polynomial from samples, and find its complex roots z = e^(i t).

The polynomial of degree n is the sum of c[k] z^k for k from -n to n, where c[-k] and c[k] are
conjugate. A discrete Fourier transform computes the coefficients c[k] from samples at equally
spaced angles. The iteration of Aberth and Ehrlich (O. Aberth, Math. Comp. 27 (1973) 339; L. W.
Ehrlich, Comm. ACM 10 (1967) 107) finds the 2n roots at once. Gershgorin discs (B. T. Smith, J. ACM
17 (1970) 661) bound the errors of the roots.
"""

import math

from ..forward import chain_pass
from ..layout import places
from ..layout.arrays import Flat, Numbers
from . import complex_numbers, pairs
from .pairs import Complex

# Largest number of sweeps of Aberth's method, which improves all roots together; a sweep improves
# each root once. Simple roots take 10 to 20 sweeps; clusters of roots converge linearly.
MAX_ITERATIONS = 60
# Angle of the first starting point, rad. The angle is not 0, because if the coefficients are real,
# the iteration cannot leave the real axis from a start on it.
START_ANGLE = 0.4
# `is_alone` compares a root with the other roots z, but ignores roots with |z| above this. Roots
# come in pairs z and 1 / conj(z), so each ignored root has a mirror image inside the unit circle,
# which is not ignored.
MAX_RADIUS = 1.5


def write_circle(samples: int, circle: Flat) -> None:
    """Write to `circle` (samples, 2) the cosines and sines of equally spaced angles."""
    for k in range(samples):
        s, c = chain_pass.sincos(places.TAU * k / samples)
        circle[2 * k], circle[2 * k + 1] = c, s


def write_coefficients(
    values: Flat, count: int, circle: Flat, largest: float, degree: int, c: Flat
) -> float:
    """
    Compute the coefficients c[0] to c[degree] of a trigonometric polynomial from its samples.

    The samples are the `count` numbers in `values`, divided by `largest`. A discrete Fourier
    transform of the samples gives c[0] to c[degree], and also coefficients with higher indices.
    Without round-off, the coefficients with higher indices would be 0. Returns the largest of
    their absolute values as a measure of the round-off.
    """
    noise = 0.0
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


def write_both_halves(c: Numbers, degree: int, a: Numbers) -> None:
    """
    Write to `a` the coefficients of the polynomial z^degree P(z), where P is trigonometric.

    The trigonometric polynomial P(z) is the sum of c[k] z^k for k from -degree to degree. The
    factor z^degree removes the negative powers of z. So `a` has `2 * degree + 1` coefficients. The
    array c has only c[0] to c[degree], because c[-k] is the conjugate of c[k].
    """
    for k in range(degree, -1, -1):
        pairs.put(a, degree - k, (c[2 * k], -c[2 * k + 1]))
        pairs.put(a, degree + k, pairs.pair(c, k))


def write_starts(count: int, inner: float, outer: float, z: Numbers) -> None:
    """
    Write to z starting points for the roots, alternately on two circles about 0 with radii `inner`
    and `outer`.
    """
    for k in range(count):
        turn = places.TAU * k / count + START_ANGLE
        radius = inner if k % 2 == 0 else outer
        pairs.put(z, k, (radius * math.cos(turn), radius * math.sin(turn)))


def find_roots(a: Numbers, count: int, z: Numbers) -> None:
    """Move the starting points z to the roots of the sum of a[k] z^k for k from 0 to count."""
    converged = [0] * 24
    remaining = count
    for _ in range(MAX_ITERATIONS):
        if remaining == 0:
            break
        for k in range(count):
            if converged[k] == 0 and _improve(a, count, z, k):
                converged[k] = 1
                remaining -= 1


def _improve(a: Numbers, count: int, z: Numbers, k: int) -> bool:
    # Improves root k by one Aberth step. Returns whether the root has converged.
    root = pairs.pair(z, k)
    size = complex_numbers.absolute(root)
    outside = size > 1.0
    # If |z| > 1, evaluate the polynomial in 1 / z (Horner's scheme backwards), so that no power
    # overflows.
    x = pairs.over((1.0, 0.0), root) if outside else root
    shrink = 1.0 / size if outside else size
    value, slope = pairs.pair(a, 0 if outside else count), (0.0, 0.0)
    terms: float = complex_numbers.absolute(value)
    for i in range(1, count + 1):
        term = pairs.pair(a, i if outside else count - i)
        slope = pairs.plus(pairs.times(slope, x), 1.0, value)
        value = pairs.plus(pairs.times(value, x), 1.0, term)
        terms = terms * shrink + abs(term[0]) + abs(term[1])
    if outside:
        # Let P be the polynomial whose roots are searched, and q the polynomial with the
        # coefficients in reverse order: P(z) = z^count q(1/z). So far, `value` and `slope` are q
        # and q' at 1/z. Replace them by P and P' up to a common factor:
        # P'/P = count / z - q' / (z^2 q).
        scaled, bent = pairs.times(value, x), pairs.times(pairs.times(x, x), slope)
        slope = (count * scaled[0] - bent[0], count * scaled[1] - bent[1])
    step = _step(value, slope, z, k, count)
    pairs.put(z, k, pairs.plus(root, -1.0, step))
    # The root has converged in two cases: the value is within its round-off (four roundings for
    # each term), or the step is below ten units in the last place.
    small = complex_numbers.absolute(value) < 4 * complex_numbers.ROUND_OFF * terms
    smallest = 10.0 * complex_numbers.ROUND_OFF * size
    return small or pairs.square_of(step) < smallest * smallest


def _step(value: Complex, slope: Complex, z: Numbers, k: int, count: int) -> Complex:
    # Let p be the polynomial, and s the sum of 1 / (z[k] - z[i]) over all roots i except k.
    # Returns the Aberth step p / (p' - p s) at z[k]. The same step results from Newton's method
    # for another function: p(z) divided by the product of z - z[i] over all roots i except k.
    root = pairs.pair(z, k)
    re, im = 0.0, 0.0
    for i in range(count):
        dx, dy = root[0] - z[2 * i], root[1] - z[2 * i + 1]
        square = dx * dx + dy * dy
        if i != k and square > 0.0:
            re += dx / square
            im -= dy / square
    below = pairs.plus(slope, -1.0, pairs.times(value, (re, im)))
    if pairs.square_of(below) == 0.0:
        return (0.0, 0.0)
    return pairs.over(value, below)


def write_bounds(c: Numbers, count: int, noise: float, z: Numbers, bounds: Numbers) -> None:
    """
    Write to `bounds` a bound of the relative error of each root z[k] of a polynomial P.

    P has the degree `count` and the coefficients c. Each root z[k] has an error disc: its center
    is z[k], and its radius, divided by |z[k]|, is bounds[k]. All exact roots of P are inside the
    discs, and each connected set of m discs contains m exact roots (Smith 1970).

    Let D be the product of z[k] - z[i] over all i except k. The radius is
    `count * (|P(z[k])| + e) / |c[count] * D|`. The number e bounds the change of P(z[k]) if each
    coefficient changes by at most `noise`.
    """
    leading = complex_numbers.absolute(pairs.pair(c, count))
    for k in range(count):
        root = pairs.pair(z, k)
        size = complex_numbers.absolute(root)
        outside = size > 1.0
        x = pairs.over((1.0, 0.0), root) if outside else root
        shrink = 1.0 / size if outside else size
        value, terms = (0.0, 0.0), 0.0
        for i in range(count + 1):
            a = pairs.pair(c, i if outside else count - i)
            value = pairs.plus(pairs.times(value, x), 1.0, a)
            terms = terms * shrink + 1.0
        # The bound is `count * residual / product`. The product has the factors |c[count]|, |z|,
        # and the distances from the root z to the count - 1 other roots. If |z| > 1, `value` and
        # `terms` are divided by z^count. So divide the product by |z|^count: leave out the factor
        # |z|, and divide each distance by |z|.
        product = leading * (1.0 if outside else size)
        for i in range(count):
            if i != k:
                distance = complex_numbers.absolute(pairs.plus(root, -1.0, pairs.pair(z, i)))
                product *= distance / size if outside else distance
        residual = complex_numbers.absolute(value) + noise * terms
        bounds[k] = count * residual / product if product > 0.0 else places.INFINITY


def is_alone(z: Numbers, bounds: Numbers, count: int, k: int) -> bool:
    """
    Return whether the error disc of root k meets no error disc of another root.

    Roots z[i] with |z[i]| >= `MAX_RADIUS` are not compared with root k. `write_bounds` defines the
    discs.
    """
    root = pairs.pair(z, k)
    size = complex_numbers.absolute(root)
    for i in range(count):
        other = pairs.pair(z, i)
        other_size = complex_numbers.absolute(other)
        if i != k and other_size < MAX_RADIUS:
            radii = bounds[k] * size + bounds[i] * other_size
            if pairs.square_of(pairs.plus(root, -1.0, other)) <= radii * radii:
                return False
    return True
