"""Common factors of all minors, by factoring the shortest and dividing the others."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy

from ....kernel import Floats
from .algebra.arithmetic import Arithmetic
from .algebra.factors import Factored, RealFactor, factored
from .algebra.laurent import Laurent, total
from .algebra.quotient import divided
from .determinant import Minors
from .sampled_poses import PoseSampler
from .trigonometry import Writer

# Minors of more terms are not multiplied out to see whether the sum of squares is shorter.
MOST_SQUARED = 200
# Minors of more terms together are written as they are, not as products.
MOST_WRITTEN = 600


def product_of(minors: Minors, arithmetic: Arithmetic) -> tuple[Factored, list[Laurent]]:
    """
    Return the common factors of all minors, and the rest of each minor.

    Only the shortest minor is factored: common factors are among its factors, and division tells
    whether a factor divides another minor.
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
        # A product of two halves that does not divide all of them: one of the two may.
        for half in factor.halves:
            more, rests = _often_divided(values, half, factor.power - power)
            if more:
                common.append(RealFactor(half, more, alone=arithmetic.ring.parts == 1))
                values = rests
    return Factored(arithmetic.ring.number(1), tuple(common), first.complete), values


def _often_divided(values: list[Laurent], factor: Laurent, most: int) -> tuple[int, list[Laurent]]:
    # The power of a factor that divides all values, and the quotients.
    power = 0
    while power < most:
        left: list[Laurent] = []
        for value in values:
            if (quotient := divided(value, factor)) is None:
                return power, values
            left.append(quotient)
        values, power = left, power + 1
    return power, values


def remainder_of(rests: Sequence[Laurent], writer: Writer, arithmetic: Arithmetic) -> sympy.Expr:
    """
    Return the root of the sum of the squared rests of the minors, its constant part outside.
    """
    if not rests:
        return sympy.Integer(1)
    written = [writer.expression(rest) for rest in rests]
    if sum(map(len, rests)) <= MOST_WRITTEN:
        products = [_product(rest, writer, arithmetic) for rest in rests]
        written = [min(pair, key=sympy.count_ops) for pair in zip(products, written)]
    squares = sympy.factor_terms(sympy.Add(*_without_pythagoras([e**2 for e in written])))
    if sum(map(len, rests)) > MOST_SQUARED:
        return sympy.sqrt(squares)
    summed = total(arithmetic.ring, (rest * rest for rest in rests))
    return sympy.sqrt(min((_product(summed, writer, arithmetic), squares), key=sympy.count_ops))


def _product(value: Laurent, writer: Writer, arithmetic: Arithmetic) -> sympy.Expr:
    product = factored(value, arithmetic)
    powers = (writer.expression(factor.value) ** factor.power for factor in product.factors)
    return math.prod(powers, start=writer.expression(product.constant))


def _without_pythagoras(terms: Sequence[sympy.Expr]) -> list[sympy.Expr]:
    # g sin^2 + g cos^2 = g: two minors that differ in the axes they are seen in only.
    left = list(terms)
    for term in terms:
        for sine in (
            a
            for a in sympy.Mul.make_args(term)
            if a.is_Pow and a.exp == 2 and a.base.func == sympy.sin
        ):
            partner = term / sine * sympy.cos(sine.base.args[0]) ** 2
            if term in left and partner in left:
                left.remove(term)
                left.remove(partner)
                left.append(term / sine)
    return left


def independent_columns(sampler: PoseSampler) -> tuple[int, ...]:
    """Return the joints left when those that only repeat others are left out, first ones first."""
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
