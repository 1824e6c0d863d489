"""
Singular values and directions of a small matrix by one-sided Jacobi, and its determinant.

A matrix of `count` rows stands in W with the turns beside it: each row `length` numbers of A, then
`count` numbers of V.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats

# Sweeps of one-sided Jacobi; six rows of 6 to 96 numbers were seen to need at most eight.
MAX_SWEEPS = 60
# Two rows are orthogonal when (a.b)^2 <= this times |a|^2 |b|^2: half a digit above round-off.
ORTHOGONAL = 1e-15 * 1e-15
# The largest squared cosine of a sweep after which none is needed any more: in the next one they
# are its squares, and where singular values are equal at most as large.
SETTLED = 1e-26


def _turn_pair(a: Flat, b: Flat, length: int, width: int) -> float:
    # Makes the first `length` numbers of two rows orthogonal by turning the rows, `width` numbers
    # each; returns the squared cosine of their angle before, 0 where they were orthogonal.
    aa, bb, ab = 0.0, 0.0, 0.0
    for k in range(length):
        x, y = a[k], b[k]
        aa += x * x
        bb += y * y
        ab += x * y
    square = ab * ab
    if square <= ORTHOGONAL * aa * bb or ab == 0.0:
        return 0.0
    # tan, cos and sin of the smaller of the two angles that do it.
    away = bb - aa
    root = math.sqrt(away * away + 4.0 * square)
    both = abs(away) + root
    t: float = 2.0 * abs(ab) / both
    if (away < 0.0) != (ab < 0.0):
        t = -t
    c = math.sqrt(0.5 * both / root)
    s: float = c * t
    for k in range(width):
        x, y = a[k], b[k]
        a[k] = c * x - s * y
        b[k] = s * x + c * y
    return square / (aa * bb)


def orthogonalise(W: Flat, count: int, length: int, width: int) -> None:
    """
    Turn the rows of A until they are orthogonal, and the rows of V along with them.

    One-sided Jacobi (Hestenes, 1958). Small singular values keep all their digits, which
    eigenvalues of A A^T do not. V stands beside A so that one loop without a rest turns both;
    where nobody asks for it, the width of a row is its length.
    """
    # The pairs of a sweep in the order of a tournament (Brent and Luk, 1985): neighbours in it
    # share no row, so that the processor works on several at once.
    last = count - 1 if count % 2 == 0 else count
    for _ in range(MAX_SWEEPS):
        worst = 0.0
        for turn in range(last):
            i, j = turn, last
            for _ in range((last + 1) // 2):
                if j < count:
                    a = arrays.after(W, min(i, j) * width)
                    b = arrays.after(W, max(i, j) * width)
                    worst = max(worst, _turn_pair(a, b, length, width))
                i = i + 1 if i + 1 < last else 0
                j = turn if j == last else j
                j = j - 1 if j > 0 else last - 1
        # Convergence is quadratic at the end: the next sweep would find nothing to turn.
        if worst <= SETTLED:
            return


def sort_by_norm(W: Flat, sigma: Flat, count: int, length: int, width: int) -> None:
    """
    Write the norms of the rows of A, descending, and bring the rows of A and V in that order.
    """
    for i in range(count):
        squares = 0.0
        for k in range(i * width, i * width + length):
            squares += W[k] * W[k]
        sigma[i] = math.sqrt(squares)
    for i in range(count - 1):
        best = i
        for j in range(i + 1, count):
            if sigma[j] > sigma[best]:
                best = j
        if best != i:
            sigma[i], sigma[best] = sigma[best], sigma[i]
            for k in range(width):
                W[i * width + k], W[best * width + k] = W[best * width + k], W[i * width + k]


def unit_rows(W: Flat, sigma: Flat, count: int, length: int) -> None:
    """
    Make the rows of A unit vectors.

    A row that is round-off has lost its direction: it is replaced by one orthogonal to the rows
    above it.
    """
    width = length + count
    for i in range(count):
        row = arrays.after(W, i * width)
        if sigma[i] > places.RANK_TOLERANCE * sigma[0] and sigma[i] > 0.0:
            scale = 1.0 / sigma[i]
            for k in range(length):
                row[k] *= scale
            continue
        write_orthogonal_row(W, i, length, width)


def write_orthogonal_row(W: Flat, i: int, length: int, width: int) -> None:
    """
    Make row i of A a unit vector orthogonal to the unit rows above, from the axis they use least.
    """
    row = arrays.after(W, i * width)
    axis, least = 0, 2.0
    for k in range(length):
        used = 0.0
        for j in range(i):
            used += W[j * width + k] * W[j * width + k]
        if used < least - 1e-9:
            axis, least = k, used
    for k in range(length):
        row[k] = 0.0
    row[axis] = 1.0
    for _ in range(2):  # twice is enough (Kahan)
        for j in range(i):
            above = arrays.after(W, j * width)
            along = 0.0
            for k in range(length):
                along += row[k] * above[k]
            for k in range(length):
                row[k] -= along * above[k]
    norm = 0.0
    for k in range(length):
        norm += row[k] * row[k]
    norm = math.sqrt(norm)
    for k in range(length):
        row[k] /= norm


def determinant(A: Flat, size: int) -> float:
    """Return the determinant by elimination with partial pivoting; A is overwritten."""
    product = 1.0
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(A[j * size + i]) > abs(A[pivot * size + i]):
                pivot = j
        if A[pivot * size + i] == 0.0:
            return 0.0
        if pivot != i:
            product = -product
            for k in range(i, size):
                x = A[i * size + k]
                A[i * size + k] = A[pivot * size + k]
                A[pivot * size + k] = x
        product *= A[i * size + i]
        for j in range(i + 1, size):
            factor = A[j * size + i] / A[i * size + i]
            for k in range(i + 1, size):
                A[j * size + k] -= factor * A[i * size + k]
    return product


def least_pivot(A: Flat, count: int, length: int) -> float:
    """
    Return the last pivot by elimination with complete pivoting, as a share of the first.

    A, `count` rows of `length` numbers, is overwritten.
    """
    first, last = 0.0, 0.0
    for k in range(min(count, length)):
        pivot, row, column = -1.0, k, k
        for i in range(k, count):
            for j in range(k, length):
                if abs(A[i * length + j]) > pivot:
                    pivot, row, column = abs(A[i * length + j]), i, j
        if k == 0:
            first = pivot
        last = pivot
        if pivot <= 0.0:
            return 0.0
        if row != k:
            for j in range(k, length):
                x = A[k * length + j]
                A[k * length + j] = A[row * length + j]
                A[row * length + j] = x
        if column != k:
            for i in range(count):
                x = A[i * length + k]
                A[i * length + k] = A[i * length + column]
                A[i * length + column] = x
        for i in range(k + 1, count):
            factor = A[i * length + k] / A[k * length + k]
            for j in range(k + 1, length):
                A[i * length + j] -= factor * A[k * length + j]
    return last / first


def decompose(work: Floats, sigma: Floats) -> None:
    """
    Decompose the rows of A (count, length): turns^T diag(sigma) rows is what they were.

    Parameters
    ----------
    work : shape (count, length + count)
        A, and the identity beside it; then orthonormal rows, and the turns, orthogonal.
    sigma : shape (count,)
        Singular values, descending.
    """
    count = arrays.extent(work, 0)
    length = arrays.extent(work, 1) - count
    W, values = arrays.results(work, 0), arrays.results(sigma, count)
    orthogonalise(W, count, length, length + count)
    sort_by_norm(W, values, count, length, length + count)
    unit_rows(W, values, count, length)


def determinant_of(A: Floats) -> float:
    """Return the determinant of A (size, size), which is overwritten."""
    size = arrays.extent(A, 0)
    return determinant(arrays.results(A, size * size), size)
