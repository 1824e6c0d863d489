# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Divide polynomials exactly, over the Gaussian rationals."""

import math

from sympy.polys.domains import QQ_I
from sympy.polys.rings import ring as polynomial_ring

from .arithmetic import Arithmetic
from .half_factors import lowered, lowest
from .laurent import Laurent, from_terms


def quotient_constant(value: Laurent, product: Laurent, arithmetic: Arithmetic) -> Laurent | None:
    """Return value / product if the division is exact and no joint variable is left; else None."""
    joints = arithmetic.joint_indices
    ours, theirs = product.grouped(joints), value.grouped(joints)
    if set(ours) != set(theirs):
        return None
    # A group holds all terms with equal exponents of the joint variables. Choose the exponents
    # whose group in `product` has the fewest terms. For these exponents, divide the group of
    # `value` by the group of `product`, to get a candidate for the quotient. Then check
    # candidate * product = value.
    ring, key = arithmetic.ring, min(ours, key=lambda key: len(ours[key]))
    quotient = divided(from_terms(ring, theirs[key]), from_terms(ring, ours[key]))
    if quotient is None:
        return None
    result = quotient.scaled(product.divisor, value.divisor).reduced()
    return result if not (result * product - value) else None


def divided(value: Laurent, factor: Laurent) -> Laurent | None:
    """
    Return value / factor if the division leaves no remainder, else None.

    Exponents of angles may be negative, so a monomial of angles such as exp(i q) divides every
    polynomial. A length may be 0, so it divides a polynomial only if every term contains it.
    """
    n = len(value.ring.generators)
    R, *_ = polynomial_ring([f'x{k}' for k in range(n)], QQ_I)
    high, low = lowest(value.terms()), lowest(factor.terms())
    above, below = (
        R.from_dict({e: QQ_I(*c) for e, c in lowered(polynomial.terms()).items()})
        for polynomial in (value, factor)
    )
    quotient, remainder = above.div(below)
    lengths = [k for k, g in enumerate(value.ring.generators) if g.kind == 'number']
    if remainder or any(high[k] < low[k] for k in lengths):
        return None
    pairs = {
        tuple(e + h - s for e, h, s in zip(exponents, high, low)): (c.x, c.y)
        for exponents, c in quotient.terms()
    }
    divisor = math.lcm(*(int(part.denominator) for c in pairs.values() for part in c))
    terms = {e: (int(a * divisor), int(b * divisor)) for e, (a, b) in pairs.items()}
    result = from_terms(value.ring, terms, divisor * value.divisor)
    return result.scaled(factor.divisor).reduced()
