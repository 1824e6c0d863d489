"""Products and inverses of matrices and vectors of exact polynomials."""

from collections.abc import Sequence

from .laurent import Laurent, Ring, total

Matrix = tuple[tuple[Laurent, ...], ...]
Vector = tuple[Laurent, ...]


def identity(ring: Ring) -> Matrix:
    """Return the 4 x 4 identity."""
    return tuple(tuple(ring.number(int(i == j)) for j in range(4)) for i in range(4))


def product(one: Matrix, other: Matrix) -> Matrix:
    """Return a matrix product."""
    ring = one[0][0].ring
    columns = tuple(zip(*other))
    return tuple(tuple(dot(ring, row, column) for column in columns) for row in one)


def times(matrix: Matrix, vector: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return tuple(dot(vector[0].ring, row, vector) for row in matrix)


def transposed(matrix: Matrix) -> Matrix:
    """Return a matrix with rows and columns exchanged."""
    return tuple(zip(*matrix))


def rotation_of(T: Matrix) -> Matrix:
    """Return the rotation of a rigid motion, 3 x 3."""
    return tuple(row[:3] for row in T[:3])


def position_of(T: Matrix) -> Vector:
    """Return the translation of a rigid motion."""
    return tuple(row[3] for row in T[:3])


def inverse(T: Matrix) -> Matrix:
    """Return the inverse of a rigid motion."""
    R_t = transposed(rotation_of(T))
    return (*((*row, -x) for row, x in zip(R_t, times(R_t, position_of(T)))), T[3])


def minus(one: Vector, other: Vector) -> Vector:
    """Return the difference of two vectors."""
    return tuple(a - b for a, b in zip(one, other))


def dot(ring: Ring, one: Sequence[Laurent], other: Sequence[Laurent]) -> Laurent:
    """Return the sum of products."""
    return total(ring, (a * b for a, b in zip(one, other) if a and b))


def cross(one: Sequence[Laurent], other: Sequence[Laurent]) -> Vector:
    """Return the vector product of two triples."""
    return tuple(
        one[(k + 1) % 3] * other[(k + 2) % 3] - one[(k + 2) % 3] * other[(k + 1) % 3]
        for k in range(3)
    )
