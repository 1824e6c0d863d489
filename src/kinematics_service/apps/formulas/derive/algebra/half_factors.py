# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Multiply half-angle factors in pairs, such as sin q/2 and cos q/2, into real whole-angle factors.
"""

import math
from collections.abc import Sequence, Set
from dataclasses import dataclass

from .arithmetic import Arithmetic
from .laurent import Exponents, Laurent, Ring, Terms, from_terms


def _angle_indices(arithmetic: Arithmetic) -> list[int]:
    return [k for k, g in enumerate(arithmetic.ring.generators) if g.kind != 'number']


def _degrees(terms: Terms, indices: Sequence[int]) -> list[int]:
    return [max(e[k] for e in terms) + min(e[k] for e in terms) for k in indices]


@dataclass(frozen=True)
class RealFactor:
    """
    A real factor of a polynomial that is written as a product of powers of such factors.

    Attributes
    ----------
    power
        The exponent of the factor in the product.
    halves
        Two polynomials whose product is the factor, up to a number. For sin q, these are sin q/2
        and cos q/2. In a ring without half angles, they are stored as z - 1 and z + 1 with
        z = exp(i q). Empty if the factor has no two such polynomials.
    alone
        Whether `paired` found no partner for a half-angle factor. Then the factor can be split
        only in a ring with half angles.
    splits
        Whether the two polynomials in `halves` need no half angles, as in
        cos 2q = (cos q + sin q) (cos q - sin q). Such a factor appears if a row of the table turns
        by twice the angle of a joint.
    """

    value: Laurent
    power: int
    halves: tuple[Laurent, ...] = ()
    alone: bool = False
    splits: bool = False


def paired(halves: list[tuple[Terms, int]], arithmetic: Arithmetic) -> list[RealFactor] | None:
    """
    Multiply half-angle factors (terms, power) in pairs, and return whole-angle factors.

    A factor is whole if it equals its conjugate and its degree in exp(i q) is even for every angle
    q. A factor f that is not whole is multiplied by a partner: another factor in `halves` with the
    power of f. The partner is the conjugate of f, or f with q + pi in place of q. Here q is the
    first angle for which the degree of f in exp(i q) is odd. The product of f and its partner must
    be whole.

    Return None if a factor that is not whole has no partner in `halves`.
    """
    indices, parts = _angle_indices(arithmetic), arithmetic.ring.parts
    joints = [
        (arithmetic.angle_index(v), step)
        for v in arithmetic.names.variables
        for step in dict.fromkeys((parts, arithmetic.steps[v]))
    ]
    ring = arithmetic.ring

    def fits(terms: Terms, other: Terms, partners: Sequence[Terms]) -> bool:
        alike = any(_proportional(partner, other) for partner in partners)
        return alike and _is_whole(_times(terms, other, ring), indices)

    open_ = list(halves)
    singles: list[RealFactor] = []
    result: list[RealFactor] = []
    while open_:
        terms, power = open_.pop(0)
        whole = _is_whole(terms, indices)
        turned = _half_turned(terms, joints)
        partners = [] if whole else [_conjugate(terms, indices)]
        partners += [] if turned is None else [turned]
        partner = next(
            (j for j, o in enumerate(open_) if o[1] == power and fits(terms, o[0], partners)), -1
        )
        if partner >= 0:
            other, _ = open_.pop(partner)
            is_turned = turned is not None and _proportional(turned, other)
            pair = (terms, other) if is_turned else ()
            upright = tuple(_upright_half(half, arithmetic) for half in pair)
            splits = is_turned and not any(_turns(terms, k) // parts % 2 for k in indices)
            value = _upright(_times(terms, other, ring), arithmetic)
            result.append(RealFactor(value, power, upright, splits=splits))
        elif whole:
            singles.append(RealFactor(_upright(terms, arithmetic), power))
        else:
            return None
    return singles + result


def _is_whole(terms: Terms, indices: Sequence[int]) -> bool:
    return not any(d % 2 for d in _degrees(terms, indices)) and _proportional(
        _conjugate(terms, indices), terms
    )


def _half_turned(terms: Terms, joints: Sequence[tuple[int, int]]) -> Terms | None:
    # Find the first angle q for which the degree of the polynomial in exp(i q) is odd. Add half a
    # turn to q, and return the new terms. Return None if no angle fits. Turn only one angle:
    # half a turn of both q1 and q2 would turn the sum q1 + q2 by a full turn, which changes
    # nothing.
    for k, step in joints:
        lowest = min(e[k] for e in terms)
        if _turns(terms, k) % (2 * step) == step and all(
            (e[k] - lowest) % step == 0 for e in terms
        ):
            return {
                e: (a, b) if (e[k] - lowest) % (2 * step) == 0 else (-a, -b)
                for e, (a, b) in terms.items()
            }
    return None


def _turns(terms: Terms, k: int) -> int:
    return max(e[k] for e in terms) - min(e[k] for e in terms)


def _conjugate(terms: Terms, indices: Sequence[int]) -> Terms:
    angles = set(indices)
    return lowered({_mirrored(e, angles): (a, -b) for e, (a, b) in terms.items()})


def _mirrored(e: Exponents, angles: Set[int]) -> Exponents:
    return tuple(-x if k in angles else x for k, x in enumerate(e))


def lowest(terms: Terms) -> Exponents:
    """Return the lowest exponent of each generator in the terms."""
    return tuple(map(min, zip(*terms)))


def lowered(terms: Terms) -> Terms:
    """Return the terms divided by their largest common monomial."""
    lows = lowest(terms)
    return {tuple(x - low for x, low in zip(e, lows)): c for e, c in terms.items()}


def _times(f: Terms, g: Terms, ring: Ring) -> Terms:
    return (from_terms(ring, f) * from_terms(ring, g)).terms()


def _proportional(f: Terms, g: Terms) -> bool:
    # Return whether two polynomials are equal up to a monomial and a complex factor.
    f, g = lowered(f), lowered(g)
    if set(f) != set(g):
        return False
    key = next(iter(f))
    return all(_product(c, g[key]) == _product(g[e], f[key]) for e, c in f.items())


def _product(x: tuple[int, int], y: tuple[int, int]) -> tuple[int, int]:
    # Return the product of two complex numbers (real, imaginary).
    (a, b), (c, d) = x, y
    return a * c - b * d, a * d + b * c


def _upright(terms: Terms, arithmetic: Arithmetic) -> Laurent:
    """Multiply a factor by a monomial and a number that make it real (equal to its conjugate)."""
    # Multiply the terms by a complex number that makes them real, then divide by the common
    # divisor of the coefficients.
    indices = _angle_indices(arithmetic)
    moved = _centred(terms, indices)
    e = next(iter(moved))
    unit = _unit(moved[e], moved[_mirrored(e, set(indices))])
    real = {e: _product(unit, c) for e, c in moved.items()}
    common = math.gcd(*(x for pair in real.values() for x in pair))
    # Choose the sign by convention, so that the factor is sin q and not -sin q.
    a, b = real[max(real)]
    if (a, -b) < (0, 0):
        common = -common
    real = {e: (a // common, b // common) for e, (a, b) in real.items()}
    result = from_terms(arithmetic.ring, real)
    # The terms z and 1/z with z = exp(i q) sum to 2 cos q. So halve `result`, to get cos q and not
    # 2 cos q. But if a term without angles has an odd coefficient, halving would make this
    # coefficient a fraction. Then do not halve `result`.
    still = [c for e, c in real.items() if not any(e[k] for k in indices)]
    turning = len(still) < len(real)
    balanced = all(a % 2 == 0 and b % 2 == 0 for a, b in still)
    return result.scaled(1, 2).reduced() if turning and balanced else result


def _centred(terms: Terms, indices: Sequence[int]) -> Terms:
    # Multiply the polynomial by a monomial, so that the exponents of the variable of each angle
    # are centred at 0, and no exponent of a length is negative.
    centre = dict(zip(indices, _degrees(terms, indices)))
    shift = [
        centre[k] // 2 if k in centre else min(0, *exponents)
        for k, exponents in enumerate(zip(*terms))
    ]
    return {tuple(x - s for x, s in zip(e, shift)): c for e, c in terms.items()}


def _unit(coefficient: tuple[int, int], opposite: tuple[int, int]) -> tuple[int, int]:
    # Let c and d be the numbers `coefficient` and `opposite`, the coefficients of the terms with
    # exponents e and -e. Find a complex number u such that u c is the conjugate of u d. If u = 1,
    # i, 1 + i and 1 - i fail, u = conj(c + d) is a solution.
    (a, b), (c, d) = coefficient, opposite
    for unit in ((1, 0), (0, 1), (1, 1), (1, -1), (a + c, -b - d)):
        real, imaginary = _product(unit, opposite)
        if _product(unit, coefficient) == (real, -imaginary):
            return unit
    return 1, 0


def _upright_half(terms: Terms, arithmetic: Arithmetic) -> Laurent:
    """
    Return a half-angle factor, multiplied by a monomial and a number that make it real.

    A factor such as sin q/2 becomes real only if the ring of `arithmetic` has half angles. If the
    ring has whole angles only, return sin q/2 unchanged.
    """
    if _is_whole(terms, _angle_indices(arithmetic)):
        return _upright(terms, arithmetic)
    return from_terms(arithmetic.ring, terms)
