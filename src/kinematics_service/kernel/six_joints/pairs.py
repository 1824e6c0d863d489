# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute with complex numbers as pairs (real part, imaginary part).

Python and C divide complex numbers differently. With pairs, the results have equal bits in both
languages. The build writes these functions into pairs.pxd, so that the compiler can inline them.
"""

from ..layout.arrays import Numbers

Complex = tuple[float, float]


def pair(numbers: Numbers, k: int) -> Complex:
    """Return complex number k of an array of pairs."""
    return (numbers[2 * k], numbers[2 * k + 1])


def put(numbers: Numbers, k: int, value: Complex) -> None:
    """Write `value` as complex number k of an array of pairs."""
    numbers[2 * k], numbers[2 * k + 1] = value[0], value[1]


def times(a: Complex, b: Complex) -> Complex:
    """Return the product a b of two complex numbers."""
    return (a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0])


def plus(a: Complex, factor: float, b: Complex) -> Complex:
    """Return a + factor b, where a and b are complex and the factor is real."""
    return (a[0] + factor * b[0], a[1] + factor * b[1])


def square_of(a: Complex) -> float:
    """Return |a|^2, the squared absolute value of a complex number."""
    return a[0] * a[0] + a[1] * a[1]


def inner(a: Complex, b: Complex) -> Complex:
    """Return the product of b and the conjugate of a."""
    return (a[0] * b[0] + a[1] * b[1], a[0] * b[1] - a[1] * b[0])


def over(a: Complex, b: Complex) -> Complex:
    """Return the quotient a / b of two complex numbers; b is not 0."""
    square = b[0] * b[0] + b[1] * b[1]
    return ((a[0] * b[0] + a[1] * b[1]) / square, (a[1] * b[0] - a[0] * b[1]) / square)


def subtract(to: Numbers, row: Numbers, start: int, stop: int, factor: Complex) -> None:
    """
    Subtract `factor` times the row `row` from the row `to`, in columns `start` to `stop - 1`.

    The two rows and the factor are complex. A row is an array of pairs (real part, imaginary
    part).
    """
    for j in range(start, stop):
        x, y = row[2 * j], row[2 * j + 1]
        to[2 * j] -= factor[0] * x - factor[1] * y
        to[2 * j + 1] -= factor[0] * y + factor[1] * x


def write_cross(a: Numbers, b: Numbers, to: Numbers) -> None:
    """Write to `to` the vector product a x b of two vectors of three complex numbers."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        forward, backward = times(pair(a, j), pair(b, k)), times(pair(a, k), pair(b, j))
        put(to, i, (forward[0] - backward[0], forward[1] - backward[1]))
