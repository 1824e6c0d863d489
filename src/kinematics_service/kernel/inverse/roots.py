# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the roots of A cos x + B sin x = C, of quadratic and of quartic equations, with bounds of the
errors of the roots.

The coefficients have errors, and the functions return a bound of the errors of the roots. The
bound is finite if the discriminant is larger than its error. Otherwise the bound is infinite,
because the equation with exact coefficients may have another number of roots. Quartics are solved
by the iteration of Aberth and Ehrlich (polynomials.py). The error bound of a root of a quartic is
the radius of a disc of Smith (J. ACM 17 (1970) 661).
"""

import math

from ..forward import vectors
from ..layout import places
from ..layout.arrays import Numbers, Vector
from ..six_joints import complex_numbers, pairs, polynomials

# If a target is beyond the border of the workspace, the cosine of an angle exceeds 1 or the square
# of a length is negative. Targets are given to six digits. So a target is taken as on the border
# if a cosine exceeds 1 by at most this number. It is also taken as on the border if the argument
# `square` of `square_roots` is negative, but not below -BORDER_TOLERANCE times `size`. Forward
# kinematics later rejects solutions of targets beyond the border.
BORDER_TOLERANCE = 1e-6
# Smallest value of the squared sine in `circle_roots`, and of `square` divided by `size` in
# `square_roots`. A smaller value is round-off and is replaced by this one. Therefore a double root
# is not returned as two equal angles, but as two angles 2e-8 rad apart. Each of the two angles
# gives its own positions of the other joints.
MIN_SQUARE = 1e-16
# A computed number may be 0 in exact arithmetic if its size is at most this factor times the bound
# of its error. The factor is above 1, because the bounds leave out products of errors.
ERROR_MARGIN = 8.0
# Factor that enlarges the error disc of a root before the test whether it meets another disc.
# Without this factor, round-off could separate two discs that meet.
DISC_MARGIN = 5.0
# A and B in A cos x + B sin x = C are taken as 0 if sqrt(A^2 + B^2) is at most this number times
# |C|. Then no x is a root, unless C is 0. The number is 45 machine epsilons.
MIN_RADIUS_RATIO = 1e-14


def circle_roots(A: float, B: float, C: float, error: float, roots: Numbers) -> int:
    """
    Write the angles x with A cos x + B sin x = C; return their number, 0 or 2, or -1 if every
    angle is a root.

    roots[2] is a bound of the errors of the angles, rad, if the coefficients have errors up to
    `error`. The bound is infinite if the equation with exact coefficients may have another number
    of roots.
    """
    radius = math.sqrt(A * A + B * B)
    room, margin = radius - abs(C), ERROR_MARGIN * error
    roots[2] = places.INFINITY
    if room < -margin:
        roots[2] = 0.0
        return 0
    if radius == 0.0 or radius <= MIN_RADIUS_RATIO * abs(C):
        return -1 if C == 0.0 else 0
    cosine = C / radius
    if abs(cosine) > 1.0 + BORDER_TOLERANCE:
        return 0
    middle = math.atan2(B, A)
    sine = math.sqrt(max((1.0 - cosine) * (1.0 + cosine), MIN_SQUARE))
    half = math.atan2(sine, cosine)
    roots[0] = middle + half
    roots[1] = middle - half
    if room > margin:
        roots[2] = (1.0 + 1.0 / sine) * error / radius
    return 2


def square_roots(middle: float, square: float, size: float, error: float, roots: Numbers) -> int:
    """
    Write the roots x of (x - middle)^2 = square to `roots`; return the number of roots, 0 or 2.

    `square` is a difference of numbers of about the size `size`, and its error is at most `error`.
    roots[2] is a bound of the errors of the roots. The bound is infinite if the equation with the
    exact value of `square` may have another number of roots.
    """
    roots[2] = places.INFINITY
    if square < -ERROR_MARGIN * error:
        roots[2] = 0.0
        return 0
    if square < -BORDER_TOLERANCE * size:
        return 0
    half = math.sqrt(max(square, MIN_SQUARE * size))
    roots[0], roots[1] = middle + half, middle - half
    if square > ERROR_MARGIN * error:
        roots[2] = 0.5 * error / half
    return 2


def turn_error(axis: Vector, v: Vector, error: float) -> float:
    """
    Return the error of the angle of v about `axis`, rad, if v has an error of length `error`.

    The result is infinite if v may be parallel to the axis, because the angle is then arbitrary.
    """
    perpendicular = vectors.plus(v, -vectors.dot(axis, v), axis)
    length = math.sqrt(vectors.dot(perpendicular, perpendicular))
    return error / length if length > ERROR_MARGIN * error else places.INFINITY


def polynomial_roots(c: Numbers, degree: int, z: Numbers) -> None:
    """
    Write to z the complex roots of c[0] + ... + c[degree] z^degree, where c[degree] is not 0.

    The iteration starts on a circle whose radius is half of Fujiwara's bound (1916) of the
    absolute values of the roots.
    """
    radius, last = 0.0, complex_numbers.absolute(pairs.pair(c, degree))
    for k in range(degree):
        ratio = complex_numbers.absolute(pairs.pair(c, k)) / last
        radius = max(radius, math.pow(ratio, 1.0 / (degree - k)))
    polynomials.write_starts(degree, radius, radius, z)
    polynomials.find_roots(c, degree, z)


def root_bound(c: Numbers, degree: int, error: float, z: Numbers, k: int) -> float:
    """
    Return the radius of a disc about the computed root k that contains an exact root.

    The coefficients of the polynomial c have errors. The exact polynomial has the coefficients
    without errors, and its roots are the exact roots. `error` is a bound of the difference between
    the values of c and of the exact polynomial at the computed root k. If the discs of m computed
    roots form a connected set, this set contains m exact roots (Smith 1970).
    """
    root, value = pairs.pair(z, k), (0.0, 0.0)
    for i in range(degree, -1, -1):
        value = pairs.plus(pairs.times(value, root), 1.0, pairs.pair(c, i))
    product = complex_numbers.absolute(pairs.pair(c, degree))
    for i in range(degree):
        if i != k:
            product *= complex_numbers.absolute(pairs.plus(root, -1.0, pairs.pair(z, i)))
    if not product > 0.0:
        return places.INFINITY
    return degree * (complex_numbers.absolute(value) + error) / product


def is_apart(z: Numbers, bounds: Numbers, count: int, k: int) -> bool:
    """
    Return whether the error disc of root k, enlarged by DISC_MARGIN, is disjoint from all other
    discs.
    """
    for i in range(count):
        distance = complex_numbers.absolute(pairs.plus(pairs.pair(z, k), -1.0, pairs.pair(z, i)))
        if i != k and not distance > DISC_MARGIN * bounds[k] + bounds[i]:
            return False
    return True
