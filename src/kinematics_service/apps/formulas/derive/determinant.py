"""
The determinant of the task rows, or their minors, by expansion along rows in the best frame.

Turning all linear rows together, or all angular ones, does not change a determinant; nor, with all
six rows, does moving the reference point: both are chosen so that most entries vanish.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

from sympy.combinatorics import Permutation

from .algebra.arithmetic import Arithmetic
from .algebra.laurent import Laurent, total
from .algebra.matrices import Matrix, Vector
from .frames import Frames
from .jacobian import about, axes_seen_from, in_axes_of, jacobian_of

# The linear ones and the angular ones.
ROWS = ((0, 1, 2), (3, 4, 5))


@dataclass(frozen=True)
class View:
    """
    The Jacobian as it is simplest.

    Parameters
    ----------
    J
        Six rows, or the task's rows.
    axes, point
        In words: whose axes the rows are in, and what their reference point is.
    """

    J: Matrix
    axes: str
    point: str


@dataclass(frozen=True)
class Minors:
    """
    The largest square parts of the task rows.

    Parameters
    ----------
    view
        The Jacobian they are parts of.
    columns
        Indices of the columns left when joints that only repeat others are left out.
    values
        One determinant where the task rows are square, else every one of that size.
    """

    view: View
    columns: tuple[int, ...]
    values: tuple[Laurent, ...]

    @property
    def square(self) -> bool:
        """Return whether there is one determinant."""
        return len(self.values) == 1


def _size(J: Matrix) -> int:
    return sum(len(entry) for row in J for entry in row)


def simplest_view(
    J: Matrix,
    frames: Frames,
    arithmetic: Arithmetic,
    rows: Sequence[int],
    columns: Sequence[int],
    any_point: bool,
) -> View:
    """
    Return J in the axes, and about the point, with the fewest terms that leave the minors alone.

    Parameters
    ----------
    J
        Jacobian of the tool, base axes.
    frames, arithmetic
        The arm.
    rows
        Indices of the task rows. Without all three of a kind the axes stay those of frame 0.
    columns
        Indices of those that count.
    any_point
        Whether the point may be another than the tool: where minors of six rows are looked at.
    """
    turnable = all(set(part) <= set(rows) or not set(part) & set(rows) for part in ROWS)
    if not any_point:
        views = [
            View(in_axes_of(J, T), f'frame {k}', 'the tool')
            for k, T in enumerate(frames.in_base if turnable else frames.in_base[:1])
        ]
        return min(views, key=lambda v: sum(len(v.J[i][j]) for i in rows for j in columns))
    best: tuple[tuple[int, int, int], View] | None = None
    n = len(frames.rows)
    origin: Vector = (arithmetic.ring.number(0),) * 3
    # Frames in the middle first, since they see axes through the fewest rows: a frame cannot be
    # better if its angular rows alone are longer than the best found.
    for frame in sorted(range(n + 1), key=lambda k: abs(2 * k - n)):
        axes = axes_seen_from(frames, frame)
        angular = jacobian_of(frames, arithmetic, axes, [origin] * len(axes))
        if best is not None and _size(angular) > best[0][0]:
            continue
        named = [(f'the origin of frame {frame}', origin)]
        named += [(f'the origin of the axis of row {axis.row + 1}', axis.o) for axis in axes]
        for index, (name, point) in enumerate(named):
            seen = about(frames, arithmetic, axes, point)
            order = (_size(seen), frame, index)
            if best is None or order < best[0]:
                best = (order, View(seen, f'frame {frame}', name))
    assert best is not None
    return best[1]


def minors_of(view: View, rows: Sequence[int], columns: Sequence[int], rank: int) -> Minors:
    """
    Return the determinant, or the minors of size `rank`, of the task rows.

    Parameters
    ----------
    view
        The Jacobian.
    rows
        Indices of the task rows.
    columns
        Indices of the columns to be used.
    rank
        The generic rank of the task rows: the size of the minors.
    """
    values = (value.without_cancelled() for value in minors(view.J, rows, columns, rank))
    return Minors(view, tuple(columns), tuple(values))


def minors(J: Matrix, rows: Sequence[int], columns: Sequence[int], size: int) -> Iterator[Laurent]:
    """Yield the determinants of all square parts of a size of these rows and columns."""
    for chosen_rows, chosen in product(combinations(rows, size), combinations(columns, size)):
        yield determinant_of([[J[i][j] for j in chosen] for i in chosen_rows])


def determinant_of(matrix: Sequence[Sequence[Laurent]]) -> Laurent:
    """Return a determinant by minors along the rows, each minor once; zeros are skipped."""
    ring = matrix[0][0].ring
    # Rows with the fewest terms last: the small minors, which are used most often, stay short.
    order = sorted(range(len(matrix)), key=lambda i: -sum(len(e) for e in matrix[i]))
    rows = [matrix[i] for i in order]
    known: dict[tuple[int, ...], Laurent] = {(): ring.number(1)}

    def minor(columns: tuple[int, ...]) -> Laurent:
        if columns not in known:
            row = rows[len(rows) - len(columns)]
            summands = []
            for index, column in enumerate(columns):
                if row[column]:
                    below = minor(columns[:index] + columns[index + 1 :])
                    if below:
                        value = row[column] * below
                        summands.append(-value if index % 2 else value)
            known[columns] = total(ring, summands)
        return known[columns]

    return minor(tuple(range(len(matrix)))).scaled(Permutation(order).signature())
