"""
How near to dependent the columns of the rows of J that count are, and the motions they leave free.
"""

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import singular_values
from .residuals import Residual


def free_motions(
    residual: Residual, scales: Floats, q: Floats, sigma: Floats, motions: Floats
) -> None:
    """
    Fill the singular values of the target's rows of J, and the joint motions that belong to them.

    Parameters
    ----------
    residual
        Of a target with these rows.
    scales : shape (n,)
        Weight of a unit of each joint.
    q : shape (N, n), rad or m
        Joint positions.
    sigma : shape (N, n), m
        Singular values, descending; those beyond the wanted rows are 0.
    motions : shape (N, n, n)
        Unit joint motions, scaled, one row per singular value.
    """
    n, count = residual.n, arrays.extent(q, 0)
    width = 6 + n
    counted, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    values, turns = arrays.results(sigma, count * n), arrays.results(motions, count * n * n)
    W = arrays.scratch(n * width)
    lock = arrays.let_go()
    for k in range(count):
        residual.evaluate(arrays.after(positions, k * n), places.JACOBIAN)
        residual.write_columns(counted)
        for i in range(n):
            row = arrays.after(W, i * width)
            arrays.copy(row, 6, arrays.after(residual.columns, 6 * i))
            arrays.fill(arrays.after(row, 6), n, 0.0)
            row[6 + i] = 1.0
        found = arrays.after(values, k * n)
        singular_values.orthogonalise(W, n, 6, width, 1)
        singular_values.sort_by_norm(W, found, n, 6, width, 1)
        for i in range(n):
            motion = arrays.after(turns, (k * n + i) * n)
            arrays.copy(motion, n, arrays.after(W, i * width + 6))
    arrays.take_back(lock)
    arrays.give_back(W)


def share_of_last_pivot(residual: Residual, scales: Flat, q: Flat) -> float:
    """Return one of the shares of `pivots`."""
    if residual.n > 6:
        return 0.0
    residual.evaluate(q, places.JACOBIAN)
    residual.write_columns(scales)
    return singular_values.least_pivot(residual.columns, residual.n, 6)


def pivots(residual: Residual, scales: Floats, q: Floats, shares: Floats) -> None:
    """
    Fill `shares` (N,) with the linear independence of the columns of the rows of J: 0 if
    dependent.

    The last pivot as a share of the first, by complete pivoting: much faster than the singular
    values, and hardly ever more than some ten times the smallest of them, as a share as well.

    Parameters
    ----------
    residual, scales, q
        As for `free_motions`; the share is 0, too, if there are more joints than rows.
    """
    n, count = residual.n, arrays.extent(q, 0)
    counted, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    result = arrays.results(shares, count)
    for k in range(count):
        result[k] = share_of_last_pivot(residual, counted, arrays.after(positions, k * n))
