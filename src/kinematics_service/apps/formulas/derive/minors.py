# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Expand the determinant or minors of the task rows in the best frame, and find common factors.

A determinant of rows of J does not change if all linear rows, or all angular rows, are rotated
together. A determinant of all six rows does not depend on the reference point of J. So J is
written in the axes, and about the reference point, in which it has the fewest terms. A common
factor of all minors is a factor of the shortest minor, and divides the other minors.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, product

import numpy as np
import sympy
from sympy.combinatorics import Permutation

from ....kernel import Floats
from .algebra.arithmetic import Arithmetic
from .algebra.factors import Factored, RealFactor, factored
from .algebra.laurent import Laurent, total
from .algebra.matrices import Matrix, terms_in
from .algebra.quotient import divided
from .frames import Frames
from .jacobian import about, axes_seen_from, in_axes_of, jacobian_of, may_turn
from .sampled_poses import PoseSampler
from .trigonometry import Writer

# The minors are divided by their common factors. If the quotients have more terms than this in
# total, the sum of their squares is not multiplied out.
MAX_SQUARED_TERMS = 200
# If the quotients of the minors have more terms than this in total, the quotients are not
# factored.
MAX_FACTORED_TERMS = 600


@dataclass(frozen=True)
class View:
    """
    The Jacobian, written in the axes and about the reference point in which it has the fewest
    terms.

    Parameters
    ----------
    J
        The Jacobian, 6 x n.
    axes, point
        Texts for reports: the frame whose axes J has, and the reference point of J.
    """

    J: Matrix
    axes: str
    point: str


@dataclass(frozen=True)
class Minors:
    """
    The determinant or minors of the task rows.

    Parameters
    ----------
    view
        The Jacobian of which these are minors.
    columns
        Indices of the columns in the minors, without the columns of dependent joints.
    values
        One determinant if the task rows are square, else all minors whose size is the generic
        rank.
    """

    view: View
    columns: tuple[int, ...]
    values: tuple[Laurent, ...]

    @property
    def square(self) -> bool:
        """Return whether `values` is one minor only: the determinant of the task rows."""
        return len(self.values) == 1


def simplest_view(
    J: Matrix, frames: Frames, rows: Sequence[int], columns: Sequence[int], any_point: bool
) -> View:
    """
    Return J in the axes, and about the reference point, in which J has the fewest terms.

    Only axes and points that do not change the minors of the task rows are tried.

    Parameters
    ----------
    J
        Jacobian of the tool, base axes.
    frames
        The arm.
    rows
        Indices of the task rows. If the task has only one or two of the three linear rows, or of
        the three angular rows, the axes stay those of frame 0.
    columns
        Indices of the columns whose terms are counted.
    any_point
        Whether other reference points are tried. This is right only if the minors contain all six
        rows of J.
    """
    if not any_point:
        seen_from = frames.in_base if may_turn(rows) else frames.in_base[:1]
        views = [View(in_axes_of(J, T), f'frame {k}', 'the tool') for k, T in enumerate(seen_from)]
        return min(views, key=lambda v: sum(len(v.J[i][j]) for i in rows for j in columns))
    candidates: list[tuple[int, int, int, View]] = []
    n = len(frames.rows)
    origin = np.full(3, frames.arithmetic.ring.number(0))
    # Try frames in the middle of the table first, because J is usually shortest in their axes.
    # Skip a frame if the angular rows alone have more terms than the best J so far.
    for frame in sorted(range(n + 1), key=lambda k: abs(2 * k - n)):
        axes = axes_seen_from(frames, frame)
        angular = jacobian_of(frames, axes, [origin] * len(axes))
        if candidates and terms_in(angular) > min(candidates)[0]:
            continue
        named = [(f'the origin of frame {frame}', origin)]
        named += [(f'the origin of the axis of row {axis.row + 1}', axis.o) for axis in axes]
        for index, (name, point) in enumerate(named):
            seen = about(frames, axes, point)
            candidates.append((terms_in(seen), frame, index, View(seen, f'frame {frame}', name)))
    return min(candidates)[3]


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
    """Yield all minors of size `size` in the rows `rows` and the columns `columns` of J."""
    for chosen_rows, chosen in product(combinations(rows, size), combinations(columns, size)):
        yield determinant_of([[J[i][j] for j in chosen] for i in chosen_rows])


def determinant_of(matrix: Sequence[Sequence[Laurent]]) -> Laurent:
    """Return a determinant by Laplace expansion along the rows; each minor is computed once."""
    ring = matrix[0][0].ring
    # Sort the rows by their numbers of terms, the longest row first. The expansion uses minors of
    # the last rows most often, and short rows make these minors short.
    order = sorted(range(len(matrix)), key=lambda i: -sum(len(e) for e in matrix[i]))
    rows = [matrix[i] for i in order]

    @cache
    def minor(columns: tuple[int, ...]) -> Laurent:
        if not columns:
            return ring.number(1)
        row, summands = rows[-len(columns)], []
        for index, column in enumerate(columns):
            if row[column] and (below := minor(columns[:index] + columns[index + 1 :])):
                value = row[column] * below
                summands.append(-value if index % 2 else value)
        return total(ring, summands)

    return minor(tuple(range(len(matrix)))).scaled(Permutation(order).signature())


def product_of(minors: Minors, arithmetic: Arithmetic) -> tuple[Factored, list[Laurent]]:
    """
    Return the common factors of all minors, and the quotient of each minor by these factors.

    Only the shortest minor is factored, because it contains all common factors. Division decides
    whether a factor divides the other minors.
    """
    values = sorted(filter(None, minors.values), key=len)
    if not values:
        return Factored(arithmetic.ring.number(0), (), True), []
    first = factored(values[0], arithmetic)
    if minors.square:
        return first, []
    common: list[RealFactor] = []
    for factor in first.factors:
        if factor.alone:
            common.append(factor)
            continue
        power, values = _often_divided(values, factor.value, factor.power)
        if power:
            common.append(replace(factor, power=power))
        # If a factor is a product of two half-angle factors and does not divide all minors, one of
        # the two half-angle factors may divide all minors.
        for half in factor.halves:
            more, quotients = _often_divided(values, half, factor.power - power)
            if more:
                common.append(RealFactor(half, more, alone=arithmetic.ring.parts == 1))
                values = quotients
    return Factored(arithmetic.ring.number(1), tuple(common), first.complete), values


def _often_divided(values: list[Laurent], factor: Laurent, n: int) -> tuple[int, list[Laurent]]:
    # Return the largest power of `factor`, up to the exponent `n`, that divides all polynomials
    # in `values`. Return also the quotients of the polynomials by this power.
    power = 0
    while power < n:
        quotients: list[Laurent] = []
        for value in values:
            if (quotient := divided(value, factor)) is None:
                return power, values
            quotients.append(quotient)
        values, power = quotients, power + 1
    return power, values


def remainder_of(quotients: Sequence[Laurent], writer: Writer) -> sympy.Expr:
    """
    Return the square root of the sum of the squares of all elements of `quotients`.

    An element is a minor, divided by the common factors of all minors. A constant factor of the
    sum is written before the root.
    """
    if not quotients:
        return sympy.Integer(1)
    written = [writer.expression(quotient) for quotient in quotients]
    if sum(map(len, quotients)) <= MAX_FACTORED_TERMS:
        products = [_product(quotient, writer) for quotient in quotients]
        written = [min(pair, key=sympy.count_ops) for pair in zip(products, written)]
    squares = sympy.factor_terms(sympy.Add(*_without_pythagoras([e**2 for e in written])))
    if sum(map(len, quotients)) > MAX_SQUARED_TERMS:
        return sympy.sqrt(squares)
    summed = total(writer.arithmetic.ring, (quotient * quotient for quotient in quotients))
    return sympy.sqrt(min((_product(summed, writer), squares), key=sympy.count_ops))


def _product(value: Laurent, writer: Writer) -> sympy.Expr:
    product = factored(value, writer.arithmetic)
    powers = (writer.expression(factor.value) ** factor.power for factor in product.factors)
    return math.prod(powers, start=writer.expression(product.constant))


def _without_pythagoras(terms: Sequence[sympy.Expr]) -> list[sympy.Expr]:
    # Replace pairs of terms g sin^2 + g cos^2 by g. Such pairs come from minors that differ only
    # in a sine or cosine.
    remaining = list(terms)
    for term in terms:
        squares = [a for a in sympy.Mul.make_args(term) if a.is_Pow and a.exp == 2]
        for sine in (square for square in squares if square.base.func == sympy.sin):
            partner = term / sine * sympy.cos(sine.base.args[0]) ** 2
            if term in remaining and partner in remaining:
                remaining.remove(term)
                remaining.remove(partner)
                remaining.append(term / sine)
    return remaining


def independent_columns(sampler: PoseSampler) -> tuple[int, ...]:
    """
    Return the indices of linearly independent columns of J, as many as possible.

    The task rows of J at all sampled configurations are stacked in one matrix. Each column of the
    matrix is tested, the first column first. A column is removed if the rank of the matrix stays
    equal without the column.
    """
    J_t = sampler.elsewhere.J_t
    stacked = J_t.reshape(-1, J_t.shape[2])
    full = _column_rank(stacked)
    kept = list(range(J_t.shape[2]))
    for j in list(kept):
        without = [k for k in kept if k != j]
        if len(kept) > full and _column_rank(stacked[:, without]) == full:
            kept = without
    return tuple(kept)


def _column_rank(stacked: Floats) -> int:
    sigma = np.linalg.svd(stacked, compute_uv=False)
    return int(np.sum(sigma > 1e-9 * sigma[0]))
