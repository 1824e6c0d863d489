# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the null space of the rows of the Jacobian J that a target uses, and a measure of how
nearly J has lost rank.

The null space comes from a singular value decomposition (one-sided Jacobi). The measure is the
ratio of the last to the first pivot of Gaussian elimination with complete pivoting, which takes
much less time than the singular values (Golub and Van Loan, Matrix Computations, sections 3.4.8
and 8.6).
"""

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import singular_values
from .residuals import Residual


def free_motions(
    residual: Residual, scales: Floats, q: Floats, sigma: Floats, motions: Floats
) -> None:
    """
    Fill `sigma` and `motions` with the singular values and right singular vectors of the Jacobian
    J, restricted to the rows that a target uses.

    Parameters
    ----------
    residual
        The residual of the target, which selects and weights the rows of J.
    scales : shape (n,), rad or m
        Factor of each column of J: for each joint, the motion that is taken as equal to 1 rad.
    q : shape (N, n), rad or m
        Joint positions.
    sigma : shape (N, n), m
        Singular values, descending. If an arm has n > 6 joints, the last n - 6 singular values are
        0.
    motions : shape (N, n, n)
        Right singular vectors, one row for each singular value. A row has the motions of the
        joints, divided by `scales`. The norm of a row is 1.
    """
    n, count = residual.n, arrays.extent(q, 0)
    width = 6 + n
    weights, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    values, turns = arrays.results(sigma, count * n), arrays.results(motions, count * n * n)
    W = arrays.scratch(n * width)
    with arrays.without_lock():
        for k in range(count):
            residual.evaluate(arrays.after(positions, k * n), places.JACOBIAN)
            residual.write_columns(weights)
            for i in range(n):
                row = arrays.after(W, i * width)
                arrays.copy(row, 6, arrays.after(residual.columns, 6 * i))
                arrays.fill(arrays.after(row, 6), n, 0.0)
                row[6 + i] = 1.0
            singular = arrays.after(values, k * n)
            singular_values.orthogonalise(W, n, 6, width, 1)
            singular_values.sort_by_norm(W, singular, n, 6, width, 1)
            for i in range(n):
                motion = arrays.after(turns, (k * n + i) * n)
                arrays.copy(motion, n, arrays.after(W, i * width + 6))
    arrays.give_back(W)


def pivot_ratio(residual: Residual, scales: Flat, q: Flat) -> float:
    """
    Return the pivot ratio of J at joint positions q (n,).

    The ratio is the last pivot divided by the first pivot of Gaussian elimination with complete
    pivoting. The ratio is 0 if J has lost rank. It is also 0 if the arm has more than six joints,
    because J then always has a null space.
    """
    if residual.n > 6:
        return 0.0
    residual.evaluate(q, places.JACOBIAN)
    residual.write_columns(scales)
    return singular_values.least_pivot(residual.columns, residual.n, 6)


def pivots(residual: Residual, scales: Floats, q: Floats, shares: Floats) -> None:
    """
    Fill `shares` (N,) with the pivot ratio of J at each row of q.

    The ratio is the last pivot divided by the first pivot of Gaussian elimination with complete
    pivoting. The ratio is 0 if J has lost rank. It is also 0 if the arm has more than six joints,
    because J then always has a null space. The pivot ratio is rarely more than ten times the ratio
    of the smallest to the largest singular value of J.

    Parameters
    ----------
    residual
        The residual of the target, which selects and weights the rows of J.
    scales : shape (n,), rad or m
        Factor of each column of J: for each joint, the motion that is taken as equal to 1 rad.
    q : shape (N, n), rad or m
        Joint positions.
    """
    n, count = residual.n, arrays.extent(q, 0)
    weights, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    result = arrays.results(shares, count)
    for k in range(count):
        result[k] = pivot_ratio(residual, weights, arrays.after(positions, k * n))
