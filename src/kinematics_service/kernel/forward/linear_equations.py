# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Solve the linear equations A x = b and A' x = b by LU decomposition with partial pivoting."""

from ..layout.arrays import Numbers, WholeNumbers


def factorise(A: Numbers, size: int, order: WholeNumbers) -> float:
    """
    Overwrite the matrix A (size, size) with its LU factors, and return the determinant of A.

    The determinant is 0 if A is singular. `solve` uses the LU factors and `order` (size,), which
    gets the pivot row of each elimination step.
    """
    product = 1.0
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(A[j * size + i]) > abs(A[pivot * size + i]):
                pivot = j
        order[i] = pivot
        if not abs(A[pivot * size + i]) > 0.0:
            return 0.0
        if pivot != i:
            product = -product
            for k in range(size):
                A[i * size + k], A[pivot * size + k] = A[pivot * size + k], A[i * size + k]
        product *= A[i * size + i]
        inverse = 1.0 / A[i * size + i]
        for j in range(i + 1, size):
            factor = A[j * size + i] * inverse
            A[j * size + i] = factor
            for k in range(i + 1, size):
                A[j * size + k] -= factor * A[i * size + k]
    return product


def solve(A: Numbers, size: int, order: WholeNumbers, x: Numbers) -> None:
    """Solve A y = x and overwrite x (size,) with y. `factorise` must have filled A and `order`."""
    for i in range(size):
        pivot = order[i]
        value = x[pivot]
        x[pivot] = x[i]
        for k in range(i):
            value -= A[i * size + k] * x[k]
        x[i] = value
    for i in range(size - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, size):
            value -= A[i * size + k] * x[k]
        x[i] = value / A[i * size + i]


def solve_transposed(A: Numbers, size: int, order: WholeNumbers, x: Numbers) -> None:
    """
    Solve A' y = x and overwrite x (size,) with y. `factorise` must have filled A and `order`.
    """
    for i in range(size):
        value = x[i]
        for k in range(i):
            value -= A[k * size + i] * x[k]
        x[i] = value / A[i * size + i]
    for i in range(size - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, size):
            value -= A[k * size + i] * x[k]
        x[i] = value
    for i in range(size - 1, -1, -1):
        pivot = order[i]
        value = x[pivot]
        x[pivot] = x[i]
        x[i] = value
