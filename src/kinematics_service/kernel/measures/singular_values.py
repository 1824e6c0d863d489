# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute determinants of small matrices, and their singular values by one-sided Jacobi rotations.

The array W has a matrix A of `count` rows, and to its right the matrix V, the product of the
rotations: each row has `length` numbers of A, then `count` numbers of V. W can also have `lanes`
interleaved matrices: first the first number of each matrix, then the second number of each matrix,
and so on. A matrix has bit for bit the same results, alone or interleaved with others, if no
number is -0.0. In interleaved matrices a rotation by zero changes -0.0 to 0.0.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Int32, Numbers

# Largest number of sweeps; a sweep rotates all pairs of rows. In experiments, matrices of six
# rows, with 6 to 96 numbers in a row, needed at most 8 sweeps.
MAX_SWEEPS = 60
# Largest squared cosine, (a.b)^2 / (|a|^2 |b|^2), between two rows a and b that are taken as
# orthogonal: the square of 4.5 machine epsilons.
SQUARED_COSINE_TOLERANCE = 1e-15 * 1e-15
# The iteration ends after a sweep in which all squared cosines between rows were at most
# LAST_SQUARED_COSINE. Convergence is quadratic, so the squared cosines after the sweep are
# round-off, and a further sweep would not improve the result. If two singular values are equal,
# more sweeps do not reduce the round-off.
LAST_SQUARED_COSINE = 1e-26
# Tolerance that stops the rotations of a matrix that has converged. Two rows are rotated only if
# the squared cosine of their angle exceeds the tolerance. No squared cosine exceeds 1.
NO_ROTATION = 2.0


def _rotate_pair(
    a: Flat,
    b: Flat,
    length: int,
    width: int,
    tolerances: Numbers,
    worst: Numbers,
    room: Numbers,
    lanes: int,
) -> None:
    # Rotates two rows a and b of `width` numbers, so that their first `length` numbers are
    # orthogonal. Orthogonal rows are rotated by 0. If the squared cosine of the angle between the
    # rows exceeds `worst`, `worst` is set to this squared cosine. `room` holds |a|^2, |b|^2 and
    # a.b, then the cosine and sine of the rotation.
    for lane in range(lanes):
        room[lane] = room[lanes + lane] = room[2 * lanes + lane] = 0.0
    for column in range(length):
        k = column * lanes
        for lane in range(lanes):
            x, y = a[k + lane], b[k + lane]
            room[lane] += x * x
            room[lanes + lane] += y * y
            room[2 * lanes + lane] += x * y
    for lane in range(lanes):
        aa, bb, ab = room[lane], room[lanes + lane], room[2 * lanes + lane]
        square = ab * ab
        limit = tolerances[lane] * aa * bb
        if lanes == 1 and square <= limit:
            return
        # Compute the tangent t, cosine c and sine s of the rotation that makes the rows
        # orthogonal. Two rotation angles do so; take the smaller one.
        away = bb - aa
        root = math.sqrt(away * away + 4.0 * square)
        both = abs(away) + root
        t: float = 2.0 * abs(ab) / both
        t = -t if away < 0.0 else t
        t = -t if ab < 0.0 else t
        c = math.sqrt(0.5 * both / root)
        s: float = c * t
        cosine = square / (aa * bb)
        # Use conditional expressions instead of branches, so that the compiler can compute several
        # lanes at once.
        room[lane] = c if square > limit else 1.0
        room[lanes + lane] = s if square > limit else 0.0
        cosine = cosine if square > limit else 0.0
        worst[lane] = cosine if cosine > worst[lane] else worst[lane]
    for column in range(width):
        k = column * lanes
        for lane in range(lanes):
            x, y = a[k + lane], b[k + lane]
            a[k + lane] = room[lane] * x - room[lanes + lane] * y
            b[k + lane] = room[lanes + lane] * x + room[lane] * y


def orthogonalise(W: Flat, count: int, length: int, width: int, lanes: int) -> None:
    """
    Rotate the rows of A until they are orthogonal, and rotate the rows of V by the same rotations.

    W contains the matrix A, and to its right the matrix V, so that one loop rotates the rows of
    both matrices. If `width` equals `length`, W contains only A. The method is one-sided Jacobi
    (Hestenes, 1958). It keeps all digits of small singular values; the eigenvalues of A A^T would
    lose digits. W may have several interleaved matrices. A matrix that has converged is not
    rotated any more while the iteration continues for the others.
    """
    if lanes == 1:
        room = [0.0] * 3
        _orthogonalise(W, count, length, width, room, 1)
    else:
        rooms = [0.0] * 48
        _orthogonalise(W, count, length, width, rooms, places.LANES)


def _orthogonalise(
    W: Flat, count: int, length: int, width: int, room: Numbers, lanes: int
) -> None:
    # Each sweep rotates all pairs of rows in the order of a round-robin tournament (Brent and Luk,
    # 1985). Successive pairs share no row, so the processor works on several pairs at once.
    last = count - 1 if count % 2 == 0 else count
    tolerances, worst = [0.0] * 16, [0.0] * 16  # one number for each of LANES matrices
    for lane in range(lanes):
        tolerances[lane] = SQUARED_COSINE_TOLERANCE
    for _ in range(MAX_SWEEPS):
        for lane in range(lanes):
            worst[lane] = 0.0
        for turn in range(last):
            i, j = turn, last
            for _ in range((last + 1) // 2):
                if j < count:
                    a = arrays.after(W, min(i, j) * width * lanes)
                    b = arrays.after(W, max(i, j) * width * lanes)
                    _rotate_pair(a, b, length, width, tolerances, worst, room, lanes)
                i = i + 1 if i + 1 < last else 0
                j = turn if j == last else j
                j = j - 1 if j > 0 else last - 1
        # Stop the rotation of a matrix whose last rotations were tiny. Convergence is quadratic,
        # so the rotations of the next sweep would be round-off.
        turning = 0
        for lane in range(lanes):
            settled = worst[lane] <= LAST_SQUARED_COSINE
            tolerances[lane] = NO_ROTATION if settled else tolerances[lane]
            turning += 0 if settled else 1
        if turning == 0:
            return


def _swap(numbers: Flat, first: int, second: int, count: int, lanes: int) -> None:
    # Swaps two rows of `count` numbers in one of `lanes` interleaved matrices. The first numbers
    # of the rows are at numbers[first] and numbers[second]. The numbers of a row are `lanes`
    # apart.
    for column in range(count):
        k = column * lanes
        numbers[first + k], numbers[second + k] = numbers[second + k], numbers[first + k]


def sort_by_norm(W: Flat, sigma: Flat, count: int, length: int, width: int, lanes: int) -> None:
    """
    Sort the rows of W by norm, the largest first, and write the norms to `sigma`.

    The first `length` numbers of a row of W are a row of the matrix A. Only these numbers count
    for the norm.
    """
    if lanes == 1:
        _sort_by_norm(W, sigma, count, length, width, 1)
    else:
        _sort_by_norm(W, sigma, count, length, width, places.LANES)


def _sort_by_norm(W: Flat, sigma: Flat, count: int, length: int, width: int, lanes: int) -> None:
    squares, largest, best = [0.0] * 16, [0.0] * 16, [0.0] * 16
    for i in range(count):
        row, norms = arrays.after(W, i * width * lanes), arrays.after(sigma, i * lanes)
        for lane in range(lanes):
            squares[lane] = 0.0
        for column in range(length):
            k = column * lanes
            for lane in range(lanes):
                squares[lane] += row[k + lane] * row[k + lane]
        for lane in range(lanes):
            norms[lane] = math.sqrt(squares[lane])
    for i in range(count - 1):
        for lane in range(lanes):
            largest[lane], best[lane] = sigma[i * lanes + lane], i
        for j in range(i + 1, count):
            norms = arrays.after(sigma, j * lanes)
            for lane in range(lanes):
                larger = norms[lane] > largest[lane]
                best[lane] = j if larger else best[lane]
                largest[lane] = norms[lane] if larger else largest[lane]
        for lane in range(lanes):
            other: Int32 = int(best[lane])
            if other != i:
                _swap(sigma, i * lanes + lane, other * lanes + lane, 1, lanes)
                first, second = i * width * lanes + lane, other * width * lanes + lane
                _swap(W, first, second, width, lanes)


def unit_rows(W: Flat, sigma: Flat, count: int, length: int, lanes: int) -> None:
    """
    Divide each row of A, the left part of W, by its norm in `sigma`.

    The direction of a row that is only round-off is meaningless. If W has one matrix, such a row
    is replaced by a unit vector orthogonal to the rows above it. If W has several interleaved
    matrices, the caller must discard the results of each matrix with such a row.
    """
    if lanes == 1:
        _unit_rows(W, sigma, count, length, 1)
    else:
        _unit_rows(W, sigma, count, length, places.LANES)


def _unit_rows(W: Flat, sigma: Flat, count: int, length: int, lanes: int) -> None:
    width = length + count
    scales = [0.0] * 16
    for i in range(count):
        row, norms = arrays.after(W, i * width * lanes), arrays.after(sigma, i * lanes)
        if lanes == 1 and not (norms[0] > places.RANK_TOLERANCE * sigma[0] and norms[0] > 0.0):
            write_orthogonal_row(W, i, length, width)
            continue
        for lane in range(lanes):
            scales[lane] = 1.0 / norms[lane]
        for column in range(length):
            k = column * lanes
            for lane in range(lanes):
                row[k + lane] *= scales[lane]


def write_orthogonal_row(W: Flat, i: int, length: int, width: int) -> None:
    """
    Replace row i of the matrix A by a unit vector that is orthogonal to the rows above row i.

    A is the left part of W, with `length` columns. The rows above row i must be unit vectors. The
    method is Gram-Schmidt. It starts from the coordinate vector with the smallest projection onto
    the rows above.
    """
    row = arrays.after(W, i * width)
    axis, least = 0, 2.0
    for k in range(length):
        used = 0.0
        for j in range(i):
            used += W[j * width + k] * W[j * width + k]
        if used < least - 1e-9:
            axis, least = k, used
    arrays.fill(row, length, 0.0)
    row[axis] = 1.0
    for _ in range(
        2
    ):  # two Gram-Schmidt passes suffice (Kahan; Parlett, The Symmetric Eigenvalue Problem, 6.9)
        for j in range(i):
            above = arrays.after(W, j * width)
            along = arrays.dot(row, above, length)
            for k in range(length):
                row[k] -= along * above[k]
    norm = math.sqrt(arrays.dot(row, row, length))
    for k in range(length):
        row[k] /= norm


def write_determinant(A: Flat, size: int, determinants: Numbers, lanes: int) -> None:
    """
    Write the determinants of the matrices in A: one matrix, or several interleaved matrices.

    The method is elimination with partial pivoting, which overwrites A.
    """
    if lanes == 1:
        _write_determinant(A, size, determinants, 1)
    else:
        _write_determinant(A, size, determinants, places.LANES)


def _write_determinant(A: Flat, size: int, determinants: Numbers, lanes: int) -> None:
    largest, pivots, zeros, factors = [0.0] * 16, [0.0] * 16, [0.0] * 16, [0.0] * 16
    for lane in range(lanes):
        determinants[lane], zeros[lane] = 1.0, 0.0
    for i in range(size):
        at = (i * size + i) * lanes
        for lane in range(lanes):
            largest[lane], pivots[lane] = abs(A[at + lane]), i
        for j in range(i + 1, size):
            below = arrays.after(A, (j * size + i) * lanes)
            for lane in range(lanes):
                larger = abs(below[lane]) > largest[lane]
                pivots[lane] = j if larger else pivots[lane]
                largest[lane] = abs(below[lane]) if larger else largest[lane]
        for lane in range(lanes):
            pivot: Int32 = int(pivots[lane])
            _swap(A, at + lane, (pivot * size + i) * lanes + lane, size - i, lanes)
        for lane in range(lanes):
            zeros[lane] = 1.0 if largest[lane] == 0.0 else zeros[lane]
            determinants[lane] = determinants[lane] if pivots[lane] == i else -determinants[lane]
            determinants[lane] *= A[at + lane]
        for j in range(i + 1, size):
            row = arrays.after(A, (j * size + i) * lanes)
            for lane in range(lanes):
                factors[lane] = row[lane] / A[at + lane]
            for column in range(1, size - i):
                k = column * lanes
                for lane in range(lanes):
                    row[k + lane] -= factors[lane] * A[at + k + lane]
    for lane in range(lanes):
        determinants[lane] = 0.0 if zeros[lane] > 0.0 else determinants[lane]


def least_pivot(A: Flat, count: int, length: int) -> float:
    """
    Return the ratio of the last to the first pivot of a matrix A in elimination with complete
    pivoting.

    A has shape (count, length) and is overwritten.
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
                A[k * length + j], A[row * length + j] = A[row * length + j], A[k * length + j]
        if column != k:
            for i in range(count):
                row_i = arrays.after(A, i * length)
                row_i[k], row_i[column] = row_i[column], row_i[k]
        for i in range(k + 1, count):
            factor = A[i * length + k] / A[k * length + k]
            for j in range(k + 1, length):
                A[i * length + j] -= factor * A[k * length + j]
    return last / first


def decompose(work: Floats, sigma: Floats) -> None:
    """
    Compute the singular value decomposition A = V^T diag(sigma) U of a matrix A (count, length).

    Parameters
    ----------
    work : shape (count, length + count)
        Input: A with the identity beside it. Output: U with orthonormal rows, and the orthogonal V
        beside it.
    sigma : shape (count,)
        Singular values, descending.
    """
    count = arrays.extent(work, 0)
    length = arrays.extent(work, 1) - count
    W, values = arrays.results(work, 0), arrays.results(sigma, count)
    orthogonalise(W, count, length, length + count, 1)
    sort_by_norm(W, values, count, length, length + count, 1)
    unit_rows(W, values, count, length, 1)


def determinant_of(A: Floats) -> float:
    """Return the determinant of A (size, size), which is overwritten."""
    size = arrays.extent(A, 0)
    determinants = [0.0]
    write_determinant(arrays.results(A, size * size), size, determinants, 1)
    return determinants[0]
