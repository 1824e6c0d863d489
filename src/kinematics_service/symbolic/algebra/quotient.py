"""What is left of a polynomial when its factors with joint variables are divided out."""

import math
from collections.abc import Sequence
from typing import Any

import sympy
from sympy.polys.domains import QQ_I
from sympy.polys.rings import ring as polynomial_ring

from .arithmetic import Arithmetic
from .half_factors import Terms
from .laurent import Laurent, from_terms


def quotient_constant(value: Laurent, product: Laurent, arithmetic: Arithmetic) -> Laurent | None:
    """Return value / product where no joint variable is left in it, multiplied back; else None."""
    indices = [*range(len(arithmetic.names.variables))]
    indices += [arithmetic.ring.index('number', v) for v in arithmetic.names.variables]
    ours, theirs = _by_joints(product, indices), _by_joints(value, indices)
    if set(ours) != set(theirs):
        return None
    key = next((key for key, part in ours.items() if len(part) == 1), None)
    if key is None:
        key = next(iter(ours))
        return _long_quotient(value, product, ours[key], theirs[key], arithmetic)
    ((e, (a, b)),) = ours[key].items()
    size = a * a + b * b
    quotient: Terms = {}
    for f, (c, d) in theirs[key].items():
        # (c + i d) / (a + i b), a power of i times an integer but for the divisor.
        quotient[tuple(x - y for x, y in zip(f, e))] = (c * a + d * b, d * a - c * b)
    result = from_terms(arithmetic.ring, quotient, size * value.divisor)
    result = result.scaled(product.divisor).reduced()
    return result if not (result * product - value) else None


def _long_quotient(
    value: Laurent, product: Laurent, ours: Terms, theirs: Terms, arithmetic: Arithmetic
) -> Laurent | None:
    generators = [sympy.Symbol(f'x{k}') for k in range(len(arithmetic.ring.generators))]

    def polynomial(terms: Terms) -> Any:
        return sympy.Add(
            *(
                (a + sympy.I * b) * sympy.Mul(*(g**x for g, x in zip(generators, e)))
                for e, (a, b) in terms.items()
            )
        )

    quotient = sympy.cancel(polynomial(theirs) / polynomial(ours))
    numerator, denominator = sympy.fraction(sympy.together(quotient))
    if denominator.free_symbols:
        return None
    terms = {}
    lcm = 1
    poly = sympy.Poly(sympy.expand(numerator / denominator), *generators, domain=sympy.QQ_I)
    for _, c in poly.terms():
        c = sympy.sympify(c)
        lcm = int(sympy.ilcm(lcm, sympy.re(c).q, sympy.im(c).q))
    for e, c in poly.terms():
        c = sympy.sympify(c)
        terms[e] = (int(sympy.re(c) * lcm), int(sympy.im(c) * lcm))
    result = from_terms(arithmetic.ring, terms, lcm * value.divisor).scaled(product.divisor)
    result = result.reduced()
    return result if not (result * product - value) else None


def _by_joints(value: Laurent, indices: Sequence[int]) -> dict[tuple[int, ...], Terms]:
    groups: dict[tuple[int, ...], Terms] = {}
    joint = set(indices)
    for e, c in value.terms().items():
        key = tuple(e[k] for k in indices)
        groups.setdefault(key, {})[tuple(0 if k in joint else x for k, x in enumerate(e))] = c
    return groups


def divided(value: Laurent, factor: Laurent) -> Laurent | None:
    """
    Return value / factor where nothing is left, else None.

    A monomial of angles divides everything; one of lengths, which may be 0, does not.
    """
    n = len(value.ring.generators)
    R, *_ = polynomial_ring([f'x{k}' for k in range(n)], QQ_I)
    above, high = _lowered(value, R)
    below, low = _lowered(factor, R)
    quotient, rest = above.div(below)
    lengths = [k for k, g in enumerate(value.ring.generators) if g.kind == 'number']
    if rest or any(high[k] < low[k] for k in lengths):
        return None
    pairs = {
        tuple(e + h - s for e, h, s in zip(exponents, high, low)): (c.x, c.y)
        for exponents, c in quotient.terms()
    }
    divisor = math.lcm(*(int(part.denominator) for c in pairs.values() for part in c))
    terms = {e: (int(a * divisor), int(b * divisor)) for e, (a, b) in pairs.items()}
    result = from_terms(value.ring, terms, divisor * value.divisor)
    return result.scaled(factor.divisor).reduced()


def _lowered(value: Laurent, R: Any) -> tuple[Any, tuple[int, ...]]:
    terms = value.terms()
    lowest = tuple(map(min, zip(*terms)))
    polynomial = {
        tuple(x - low for x, low in zip(e, lowest)): QQ_I(a, b) for e, (a, b) in terms.items()
    }
    return R.from_dict(polynomial), lowest
