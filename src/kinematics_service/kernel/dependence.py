"""
How near to dependent the columns of the rows of J that count are, and the motions they leave free.

"""

from . import aims, arrays, chain_pass, places, singular_values
from .arrays import Floats
from .chain import Chain


def free_motions(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    q: Floats,
    sigma: Floats,
    motions: Floats,
) -> None:
    """
    Fill the singular values of the aim's rows of J, and the joint motions that belong to them.

    Parameters
    ----------
    chain, aim, scales
        As `refine` takes them.
    q : shape (N, n), rad or m
        Joint positions.
    sigma : shape (N, n), m
        Singular values, descending; those beyond the rows asked for are 0.
    motions : shape (N, n, n)
        Unit joint motions, scaled ones, a row a singular value.

    """
    arrays.given(chain)
    n, count = chain.dof, arrays.extent(q, 0)
    target = arrays.numbers(aim, places.AIM_SIZE)
    counted, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    values, turns = arrays.results(sigma, count * n), arrays.results(motions, count * n * n)
    width = 6 + n
    columns = arrays.scratch(6 * n + n * width + chain.frames_at)
    W = arrays.after(columns, 6 * n)
    row = arrays.after(W, n * width)
    lock = arrays.let_go()
    for k in range(count):
        q_k = arrays.after(positions, k * n)
        chain_pass.evaluate_row(chain, q_k, q_k, places.JACOBIAN, row)
        aims.write_columns(target, n, row, counted, columns)
        for i in range(n):
            for j in range(6):
                W[i * width + j] = columns[6 * i + j]
            for j in range(n):
                W[i * width + 6 + j] = 1.0 if i == j else 0.0
        singular_values.orthogonalise(W, n, 6, width)
        singular_values.sort_by_norm(W, arrays.after(values, k * n), n, 6, width)
        for i in range(n):
            for j in range(n):
                turns[(k * n + i) * n + j] = W[i * width + 6 + j]
    arrays.take_back(lock)
    arrays.give_back(columns)


def share_of_last_pivot(
    chain: Chain, aim: Floats, scales: Floats, q: Floats, work: Floats
) -> float:
    """
    Return one of the shares of `pivots`; `work` has room for 6 n numbers and a row.

    """
    n = chain.dof
    row = arrays.after(work, 6 * n)
    if n > 6:
        return 0.0
    chain_pass.evaluate_row(chain, q, q, places.JACOBIAN, row)
    aims.write_columns(aim, n, row, scales, work)
    return singular_values.least_pivot(work, n, 6)


def pivots(chain: Chain, aim: Floats, scales: Floats, q: Floats, shares: Floats) -> None:
    """
    Fill `shares` (N,) with how near to dependent the columns of the aim's rows of J are: 0 if so.

    The last pivot as a share of the first, by complete pivoting: much faster than the singular
    values, and hardly ever more than some ten times the smallest of them, as a share as well.

    Parameters
    ----------
    chain, aim, scales, q
        As `free_motions` takes them; 0 too where there are more joints than rows.

    """
    arrays.given(chain)
    n, count = chain.dof, arrays.extent(q, 0)
    target = arrays.numbers(aim, places.AIM_SIZE)
    counted, positions = arrays.numbers(scales, n), arrays.numbers(q, count * n)
    result = arrays.results(shares, count)
    work = arrays.scratch(6 * n + chain.frames_at)
    for k in range(count):
        result[k] = share_of_last_pivot(
            chain, target, counted, arrays.after(positions, k * n), work
        )
    arrays.give_back(work)
