# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the eigenvectors of a small symmetric matrix by Jacobi rotations, and solve damped
equations by Cholesky.
"""

import math

from ..layout import arrays
from ..layout.arrays import Flat, Floats

# Largest number of sweeps; a sweep visits all off-diagonal entries. In experiments, matrices of 12
# rows needed 8 sweeps.
MAX_SWEEPS = 30
# An off-diagonal entry is taken as round-off if it is below this multiple of the largest diagonal
# entry. The factor is 4.5 machine epsilons.
ROUND_OFF = 1e-15


def _rotate(H: Flat, Z: Flat, size: int, i: int, j: int) -> None:
    # Rotates H and Z in the plane of the axes i and j, so that H[i, j] becomes zero (Golub and Van
    # Loan, 8.5.2).
    off = H[i * size + j]
    half = 0.5 * (H[j * size + j] - H[i * size + i])
    root = math.sqrt(half * half + off * off)
    t = off / (half + root) if half >= 0.0 else off / (half - root)
    c = 1.0 / math.sqrt(1.0 + t * t)
    s = t * c
    for k in range(size):
        x, y = H[k * size + i], H[k * size + j]
        H[k * size + i] = c * x - s * y
        H[k * size + j] = s * x + c * y
    for k in range(size):
        x, y = H[i * size + k], H[j * size + k]
        H[i * size + k] = c * x - s * y
        H[j * size + k] = s * x + c * y
        x, y = Z[i * size + k], Z[j * size + k]
        Z[i * size + k] = c * x - s * y
        Z[j * size + k] = s * x + c * y


def diagonalise(H: Flat, Z: Flat, size: int, tolerance: float) -> None:
    """
    Make a symmetric matrix H (size, size) diagonal, and fill Z with its eigenvectors.

    The eigenvectors are the rows of Z, not sorted; H[i, i] is the eigenvalue of row i. The
    iteration ends if off-diagonal entries are at most `tolerance` times the largest diagonal
    entry.
    """
    for i in range(size):
        for j in range(size):
            Z[i * size + j] = 1.0 if i == j else 0.0
    for _ in range(MAX_SWEEPS):
        largest, worst = 0.0, 0.0
        for i in range(size):
            largest = max(largest, abs(H[i * size + i]))
            for j in range(i + 1, size):
                worst = max(worst, abs(H[i * size + j]))
        if not worst > tolerance * largest:
            return
        for i in range(size):
            for j in range(i + 1, size):
                if abs(H[i * size + j]) > ROUND_OFF * ROUND_OFF * largest:
                    _rotate(H, Z, size, i, j)


def damped_step(n: int, A: Flat, g: Flat, damping: float, L: Flat, step: Flat) -> bool:
    """
    Solve (A + damping I) step = g for `step` by Cholesky, where I is the identity. Return False if
    the matrix A + damping I is not positive definite.
    """
    for i in range(n):
        for j in range(i + 1):
            value = A[i * n + j]
            if i == j:
                value += damping
            for k in range(j):
                value -= L[i * n + k] * L[j * n + k]
            if i == j:
                if not value > 0.0:
                    return False
                L[i * n + i] = math.sqrt(value)
            else:
                L[i * n + j] = value / L[j * n + j]
    for i in range(n):
        value = g[i]
        for k in range(i):
            value -= L[i * n + k] * step[k]
        step[i] = value / L[i * n + i]
    for i in range(n - 1, -1, -1):
        value = step[i]
        for k in range(i + 1, n):
            value -= L[k * n + i] * step[k]
        step[i] = value / L[i * n + i]
    return True


def eigenvectors(H: Floats, Z: Floats) -> None:
    """Make H (size, size) diagonal and fill Z with its eigenvectors by `diagonalise`."""
    size = arrays.extent(H, 0)
    diagonalise(arrays.results(H, size * size), arrays.results(Z, size * size), size, ROUND_OFF)
