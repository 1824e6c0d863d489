"""Bound the largest singular value of a matrix from above by Gershgorin's theorem."""

import math

from ..layout import arrays
from ..measures import symmetric

# Bound of the relative round-off of a norm, about 5,000 machine epsilons.
ROUND_OFF = 1e-12
# Tolerance of off-diagonal entries, relative to the largest diagonal entry. The bound is too large
# by at most this times the number of rows.
OFF_DIAGONAL_TOLERANCE = 1e-4


class Norms:
    """
    Compute norms of matrices with at most `rows` rows and `size` numbers.

    Attributes
    ----------
    W
        The numbers of a matrix, row by row.
    """

    def __init__(self, rows: int, size: int) -> None:
        self.W, self.G, self.Z = arrays.rooms(size, rows * rows, rows * rows)

    def norm(self, count: int, length: int) -> float:
        """Return an upper bound of the largest singular value of W (count, length)."""
        # If the matrix is tall, use the Frobenius norm.
        if count > length:
            squares = arrays.dot(self.W, self.W, count * length)
            return (1.0 + ROUND_OFF) * math.sqrt(squares)
        for i in range(count):
            a = arrays.after(self.W, i * length)
            for j in range(i + 1):
                value = arrays.dot(a, arrays.after(self.W, j * length), length)
                self.G[i * count + j] = value
                self.G[j * count + i] = value
        symmetric.diagonalise(self.G, self.Z, count, OFF_DIAGONAL_TOLERANCE)
        largest = 0.0
        for i in range(count):
            around = 0.0  # Gershgorin: no eigenvalue is larger than the largest row sum
            for j in range(count):
                around += abs(self.G[i * count + j])
            largest = max(largest, around)
        return (1.0 + ROUND_OFF) * math.sqrt(largest)
