"""
What all minors of the task rows have in common, and what is left of them.

"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy

from ..kernel import Floats
from .arithmetic import Arithmetic
from .bench import Bench
from .determinant import Minors
from .factors import Factored, RealFactor, factored
from .laurent import Laurent
from .singular_geometry import rank_at
from .trigonometry import Writer

# Minors of more terms are not multiplied out to see whether the sum of squares is shorter.
MOST_SQUARED = 200


def product_of(minors: Minors, arithmetic: Arithmetic) -> tuple[Factored, list[Laurent]]:
    """
    Return the common factors of all minors, and what is left of each.

    """
    products = [factored(value, arithmetic) for value in minors.values if value]
    products.sort(key=lambda product: sum(len(f.value) for f in product.factors))
    if not products:
        return Factored(arithmetic.ring.number(0), (), True), []
    first = products[0]
    if len(minors.values) == 1:
        return first, []
    common = []
    for factor in first.factors:
        powers = [
            next((g.power for g in other.factors if _same(g.value, factor.value)), 0)
            for other in products
        ]
        if min(powers):
            common.append(RealFactor(factor.value, min(powers)))
    rests = []
    for other in products:
        rest = other.constant
        for g in other.factors:
            shared = next((c.power for c in common if _same(c.value, g.value)), 0)
            for _ in range(g.power - shared):
                rest = rest * g.value
        rests.append(rest)
    complete = all(product.complete for product in products)
    return Factored(arithmetic.ring.number(1), tuple(common), complete), rests


def _same(one: Laurent, other: Laurent) -> bool:
    return not (one - other) or not (one + other)


def remainder_of(rests: Sequence[Laurent], writer: Writer, arithmetic: Arithmetic) -> Any:
    """
    Return sqrt of the sum of squares of what is left of the minors, its constant part outside.

    """
    if not rests:
        return sympy.Integer(1)
    squares = sympy.factor_terms(sympy.Add(*(writer.expression(rest) ** 2 for rest in rests)))
    if sum(map(len, rests)) > MOST_SQUARED:
        return sympy.sqrt(squares)
    total = arithmetic.ring.number(0)
    for rest in rests:
        total = total + rest * rest
    product = factored(total, arithmetic)
    inside = writer.expression(product.constant)
    for factor in product.factors:
        inside *= writer.expression(factor.value) ** factor.power
    shortest = min((inside, squares), key=sympy.count_ops)
    return sympy.sqrt(shortest)


def independent_columns(bench: Bench) -> tuple[int, ...]:
    """
    Return the joints left when those that only repeat others are left out, first ones first.

    """
    J_t = bench.arm(bench.random(200)).J_t
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


def generic_rank(bench: Bench) -> int:
    """
    Return the rank of the task rows at most poses.

    """
    return rank_at(bench.arm(bench.random(200)).J_t)
