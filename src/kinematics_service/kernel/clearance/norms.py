"""The largest singular value of a matrix with few rows, rounded up."""

import math

from ..layout import arrays
from ..measures import symmetric

# Of a norm, as a share.
ROUND_OFF = 1e-12
# What is left beside a diagonal, as a share of it: a bound is larger by a few of these.
COARSE = 1e-4


class Norms:
    """
    Room for matrices of up to so many rows, and so many numbers.

    Attributes
    ----------
    W
        The numbers of a matrix, row by row.
    """

    def __init__(self, rows: int, size: int) -> None:
        self.W, self.G, self.Z = arrays.rooms(size, rows * rows, rows * rows)

    def norm(self, count: int, length: int) -> float:
        """Return at least the largest singular value of W, `count` rows of `length` numbers."""
        # With more rows than numbers in them Frobenius' norm is enough.
        if count > length:
            squares = arrays.dot(self.W, self.W, count * length)
            return (1.0 + ROUND_OFF) * math.sqrt(squares)
        for i in range(count):
            a = arrays.after(self.W, i * length)
            for j in range(i + 1):
                value = arrays.dot(a, arrays.after(self.W, j * length), length)
                self.G[i * count + j] = value
                self.G[j * count + i] = value
        symmetric.diagonalise(self.G, self.Z, count, COARSE)
        largest = 0.0
        for i in range(count):
            around = 0.0  # Gershgorin: no eigenvalue is beyond the sum of a row
            for j in range(count):
                around += abs(self.G[i * count + j])
            largest = max(largest, around)
        return (1.0 + ROUND_OFF) * math.sqrt(largest)
