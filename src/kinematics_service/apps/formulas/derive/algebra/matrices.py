"""Matrices and vectors of exact polynomials."""

from collections.abc import Sequence

from .laurent import Laurent, Ring, total

Matrix = tuple[tuple[Laurent, ...], ...]
Vector = tuple[Laurent, ...]


def product(one: Matrix, other: Matrix) -> Matrix:
    """Return a matrix product."""
    ring = one[0][0].ring
    columns = tuple(zip(*other))
    return tuple(tuple(dot(ring, row, column) for column in columns) for row in one)


def dot(ring: Ring, one: Sequence[Laurent], other: Sequence[Laurent]) -> Laurent:
    """Return the sum of products."""
    return total(ring, (a * b for a, b in zip(one, other) if a and b))


def cross(one: Sequence[Laurent], other: Sequence[Laurent]) -> Vector:
    """Return the vector product of two triples."""
    return tuple(
        one[(k + 1) % 3] * other[(k + 2) % 3] - one[(k + 2) % 3] * other[(k + 1) % 3]
        for k in range(3)
    )
