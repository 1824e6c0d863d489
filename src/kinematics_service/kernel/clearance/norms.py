# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute an upper bound of the largest singular value of a matrix by Gershgorin's theorem."""

import math

from ..layout import arrays
from ..measures import symmetric

# Bound of the relative round-off error of a computed norm: about 5,000 machine epsilons.
ROUND_OFF = 1e-12
# Let G = W W^T for the matrix W whose norm is computed. The diagonalization of G stops if all
# off-diagonal entries of G are at most this tolerance times the largest diagonal entry. The
# remaining off-diagonal entries increase the bound of the norm of W, by at most the relative
# amount tolerance * (number of rows of W).
OFF_DIAGONAL_TOLERANCE = 1e-4


class Norms:
    """
    Computes upper bounds of the spectral norm of matrices with at most `rows` rows and `size`
    entries.

    Attributes
    ----------
    W
        The entries of the matrix, row by row. The caller writes them before `norm`.
    """

    def __init__(self, rows: int, size: int) -> None:
        self.W, self.G, self.Z = arrays.rooms(size, rows * rows, rows * rows)

    def norm(self, count: int, length: int) -> float:
        """
        Return an upper bound of the largest singular value of the matrix in W, shape (count,
        length).
        """
        # The Frobenius norm is an upper bound of the largest singular value. Return it if the
        # matrix has more rows than columns.
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
