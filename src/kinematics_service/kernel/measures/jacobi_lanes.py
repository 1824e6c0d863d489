"""
Singular values and determinants of LANES small matrices side by side, as `singular_values` has it.

Number k of the matrix in a lane stands at k * LANES + lane. Every number comes from the same
operations in the same order as for one matrix: it is the same to the last bit. No number may be
-0.0, which a turn by zero would make 0.0.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers
from . import singular_values

# Any rows are orthogonal by this tolerance.
ANY_ROWS = 2.0


def _turn_pairs(
    a: Flat,
    b: Flat,
    length: int,
    width: int,
    tolerances: Numbers,
    worst: Numbers,
    room: Numbers,
) -> None:
    # As singular_values turns one pair; lanes that need no turn are turned by a zero angle.
    # In `room`: |a|^2 and cosine, |b|^2 and sine, a.b.
    for lane in range(places.LANES):
        x, y = a[lane], b[lane]
        room[lane] = x * x
        room[places.LANES + lane] = y * y
        room[2 * places.LANES + lane] = x * y
    for column in range(1, length):
        k = column * places.LANES
        for lane in range(places.LANES):
            x, y = a[k + lane], b[k + lane]
            room[lane] += x * x
            room[places.LANES + lane] += y * y
            room[2 * places.LANES + lane] += x * y
    for lane in range(places.LANES):
        aa, bb = room[lane], room[places.LANES + lane]
        ab = room[2 * places.LANES + lane]
        square = ab * ab
        limit = tolerances[lane] * aa * bb
        away = bb - aa
        root = math.sqrt(away * away + 4.0 * square)
        both = abs(away) + root
        t: float = 2.0 * abs(ab) / both
        t = -t if away < 0.0 else t
        t = -t if ab < 0.0 else t
        c = math.sqrt(0.5 * both / root)
        s: float = c * t
        cosine = square / (aa * bb)
        # Selections, not branches, for several lanes at once.
        room[lane] = c if square > limit else 1.0
        room[places.LANES + lane] = s if square > limit else 0.0
        cosine = cosine if square > limit else 0.0
        worst[lane] = cosine if cosine > worst[lane] else worst[lane]
    for column in range(width):
        k = column * places.LANES
        for lane in range(places.LANES):
            x, y = a[k + lane], b[k + lane]
            a[k + lane] = room[lane] * x - room[places.LANES + lane] * y
            b[k + lane] = room[places.LANES + lane] * x + room[lane] * y


def orthogonalise(W: Flat, count: int, length: int, width: int) -> None:
    """
    Turn the rows of each matrix as `singular_values.orthogonalise` does.

    A finished matrix is not turned any more; sweeps go on while one of them is unfinished.
    """
    last = count - 1 if count % 2 == 0 else count
    # LANES numbers each, as literals because C arrays are made of them; and three times as many.
    tolerances, worst, room = [0.0] * 16, [0.0] * 16, [0.0] * 48
    for lane in range(places.LANES):
        tolerances[lane] = singular_values.ORTHOGONAL
    for _ in range(singular_values.MAX_SWEEPS):
        for lane in range(places.LANES):
            worst[lane] = 0.0
        for turn in range(last):
            i, j = turn, last
            for _ in range((last + 1) // 2):
                if j < count:
                    a = arrays.after(W, min(i, j) * width * places.LANES)
                    b = arrays.after(W, max(i, j) * width * places.LANES)
                    _turn_pairs(a, b, length, width, tolerances, worst, room)
                i = i + 1 if i + 1 < last else 0
                j = turn if j == last else j
                j = j - 1 if j > 0 else last - 1
        turning = 0
        for lane in range(places.LANES):
            settled = worst[lane] <= singular_values.SETTLED
            tolerances[lane] = ANY_ROWS if settled else tolerances[lane]
            turning += 0 if settled else 1
        if turning == 0:
            return


def _swap(numbers: Flat, first: int, second: int, count: int) -> None:
    # Swaps, in one lane, `count` numbers from one index on with those from another.
    for column in range(count):
        k = column * places.LANES
        x = numbers[first + k]
        numbers[first + k] = numbers[second + k]
        numbers[second + k] = x


def sort_by_norm(W: Flat, sigma: Flat, count: int, length: int, width: int) -> None:
    """Write norms and sort the rows of each matrix as `singular_values.sort_by_norm` does."""
    squares, largest, best = [0.0] * 16, [0.0] * 16, [0.0] * 16
    for i in range(count):
        row = arrays.after(W, i * width * places.LANES)
        norms = arrays.after(sigma, i * places.LANES)
        for lane in range(places.LANES):
            squares[lane] = 0.0
        for column in range(length):
            k = column * places.LANES
            for lane in range(places.LANES):
                squares[lane] += row[k + lane] * row[k + lane]
        for lane in range(places.LANES):
            norms[lane] = math.sqrt(squares[lane])
    for i in range(count - 1):
        for lane in range(places.LANES):
            largest[lane], best[lane] = sigma[i * places.LANES + lane], i
        for j in range(i + 1, count):
            norms = arrays.after(sigma, j * places.LANES)
            for lane in range(places.LANES):
                larger = norms[lane] > largest[lane]
                best[lane] = j if larger else best[lane]
                largest[lane] = norms[lane] if larger else largest[lane]
        for lane in range(places.LANES):
            other: int = int(best[lane])
            if other != i:
                _swap(sigma, i * places.LANES + lane, other * places.LANES + lane, 1)
                _swap(
                    W,
                    i * width * places.LANES + lane,
                    other * width * places.LANES + lane,
                    width,
                )


def unit_rows(W: Flat, sigma: Flat, count: int, length: int, width: int) -> None:
    """Make the rows of each matrix unit vectors, if all of them have a direction."""
    scales = [0.0] * 16
    for i in range(count):
        row = arrays.after(W, i * width * places.LANES)
        for lane in range(places.LANES):
            scales[lane] = 1.0 / sigma[i * places.LANES + lane]
        for column in range(length):
            k = column * places.LANES
            for lane in range(places.LANES):
                row[k + lane] *= scales[lane]


def determinants(A: Flat, size: int, found: Flat) -> None:
    """Write the determinant of each matrix as `singular_values.determinant` finds it."""
    largest, pivots, zeros = [0.0] * 16, [0.0] * 16, [0.0] * 16
    factors = [0.0] * 16
    for lane in range(places.LANES):
        found[lane], zeros[lane] = 1.0, 0.0
    for i in range(size):
        at = (i * size + i) * places.LANES
        for lane in range(places.LANES):
            largest[lane], pivots[lane] = abs(A[at + lane]), i
        for j in range(i + 1, size):
            below = arrays.after(A, (j * size + i) * places.LANES)
            for lane in range(places.LANES):
                larger = abs(below[lane]) > largest[lane]
                pivots[lane] = j if larger else pivots[lane]
                largest[lane] = abs(below[lane]) if larger else largest[lane]
        for lane in range(places.LANES):
            pivot: int = int(pivots[lane])
            _swap(A, at + lane, (pivot * size + i) * places.LANES + lane, size - i)
        for lane in range(places.LANES):
            zeros[lane] = 1.0 if largest[lane] == 0.0 else zeros[lane]
            found[lane] = found[lane] if pivots[lane] == i else -found[lane]
            found[lane] *= A[at + lane]
        for j in range(i + 1, size):
            row = arrays.after(A, (j * size + i) * places.LANES)
            for lane in range(places.LANES):
                factors[lane] = row[lane] / A[at + lane]
            for column in range(1, size - i):
                k = column * places.LANES
                for lane in range(places.LANES):
                    row[k + lane] -= factors[lane] * A[at + k + lane]
    for lane in range(places.LANES):
        found[lane] = 0.0 if zeros[lane] > 0.0 else found[lane]
