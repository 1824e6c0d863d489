# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Factor a real trigonometric polynomial into real factors in whole angles, without half angles.

A polynomial is written in z = exp(i q), with one variable z (a generator) for each angle q. In
this form, sin q = (z - 1) (z + 1) / 2iz has complex coefficients and splits into two half-angle
factors: z - 1 = 2i z^(1/2) sin(q/2) and z + 1 = 2 z^(1/2) cos(q/2). The two factors z - 1 and
z + 1 must be multiplied again, so that sin q stays one factor.

The method has four steps. First, it multiplies the generators by powers of i, so that every
coefficient is real. Second, it factors over the integers. Third, it undoes the first step. Fourth,
it multiplies pairs of half-angle factors. The second step factors over the Gaussian integers
instead if powers of i cannot make all coefficients real, or if a factor over the integers may be a
product of two complex factors.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from random import Random
from typing import Any

from sympy.core.random import seed as seed_random
from sympy.polys.domains import GF, ZZ, ZZ_I
from sympy.polys.galoistools import gf_ddf_zassenhaus, gf_monic, gf_sqf_p, gf_trunc
from sympy.polys.matrices import DomainMatrix
from sympy.polys.rings import PolyElement
from sympy.polys.rings import ring as polynomial_ring

from .arithmetic import Arithmetic
from .half_factors import RealFactor as RealFactor
from .half_factors import lowered, lowest, paired
from .laurent import Laurent, Terms, from_terms
from .quotient import quotient_constant

# Number of random straight lines on which a polynomial is tested. On a line with the parameter t,
# generator k is a_k * t + b_k, so the polynomial becomes a polynomial in t. If the polynomial in t
# is irreducible and has the same degree, the polynomial itself is irreducible.
CUT_LINES = 8
# Largest integer a_k or b_k of a random line a_k * t + b_k.
MAX_LINE_COEFFICIENT = 23
SEED = 1955
# Primes p = 3 mod 4 for the test in `stays_whole_beside_i`. If a polynomial is irreducible over
# the Gaussian integers, the test succeeds modulo about half of these primes.
PRIMES = (7, 11, 19, 23, 31, 43, 47, 59, 67, 71, 79, 83)
# Maximum number of terms of a polynomial that is factored, because the time grows steeply.
MAX_TERMS = 6000
# Maximum numbers of terms and of generators of a polynomial that is factored over the Gaussian
# integers. With four generators, factoring takes seconds.
MAX_GAUSSIAN_TERMS = 40
MAX_GAUSSIAN_GENERATORS = 3
# If a determinant is not proved to be fully factored, each of its factors with at most this number
# of terms is tested for irreducibility separately.
MAX_SHORT_TERMS = 100


@dataclass(frozen=True)
class Factored:
    """
    A factored polynomial: a constant without joint variables, times factors with joint variables.

    Attributes
    ----------
    constant
        The factor that contains lengths and numbers only.
    factors
        The factors with joint variables.
    complete
        Whether every factor is proved to be irreducible: it is not a product of two real
        polynomials with rational coefficients. False if the proof failed or was not tried.
    """

    constant: Laurent
    factors: tuple[RealFactor, ...]
    complete: bool


def factored(value: Laurent, arithmetic: Arithmetic) -> Factored:
    """Factor a polynomial that is real for real angles."""
    polynomial = _Polynomial.of(value)
    pieces, complete = _pieces(polynomial)
    if pieces is None:
        return _whole(value, arithmetic, complete)
    turns, steps = polynomial.turns, polynomial.steps
    halves = [(_turned_back(piece, turns, steps), power) for piece, power in pieces]
    factors = paired([h for h in halves if arithmetic.moves(h[0])], arithmetic)
    if factors is None:
        return _whole(value, arithmetic, complete=False, alone=True)
    moving = [*factors, *_sliding_monomials(value, arithmetic)]
    constant = quotient_constant(value, _product(moving, arithmetic), arithmetic)
    if constant is None:
        return _whole(value, arithmetic, complete=False)
    return Factored(constant, tuple(moving), complete)


def stays_whole(value: Laurent, arithmetic: Arithmetic) -> bool:
    """Return whether a polynomial with few terms is proved not to split into real factors."""
    if len(value) > MAX_SHORT_TERMS:
        return False
    product = factored(value, arithmetic)
    return product.complete and [(f.power, f.splits) for f in product.factors] == [(1, False)]


def _sliding_monomials(value: Laurent, arithmetic: Arithmetic) -> list[RealFactor]:
    # Return the powers of prismatic variables that divide every term.
    ring, terms = arithmetic.ring, value.terms()
    indices = [ring.index('number', variable) for variable in arithmetic.names.variables]
    powers = [min(e[k] for e in terms) for k in indices]
    return [RealFactor(ring.power(k), power) for k, power in zip(indices, powers) if power]


def _whole(
    value: Laurent, arithmetic: Arithmetic, complete: bool, alone: bool = False
) -> Factored:
    if not arithmetic.moves(value.terms()):
        return Factored(value, (), True)
    # If a length divides all terms of the polynomial, move it to `Factored.constant`.
    terms = value.terms()
    generators = zip(lowest(terms), arithmetic.ring.generators)
    common = [low if generator.kind == 'number' else 0 for low, generator in generators]
    divided = {tuple(x - low for x, low in zip(e, common)): c for e, c in terms.items()}
    quotient = from_terms(arithmetic.ring, divided, value.divisor)
    moving = [RealFactor(quotient, 1, alone=alone), *_sliding_monomials(value, arithmetic)]
    moving = [factor for factor in moving if arithmetic.moves(factor.value.terms())]
    constant = quotient_constant(value, _product(moving, arithmetic), arithmetic)
    assert constant is not None
    return Factored(constant, tuple(moving), complete)


@dataclass(frozen=True)
class _Polynomial:
    # A polynomial for sympy. Generator k is multiplied by i^turns[k], so that all coefficients of
    # `element` are integers. If no powers of i achieve this, the coefficients are Gaussian
    # integers and `turns` are 0. The lowest exponents are 0, and the exponents of each generator
    # are divided by `steps`.
    element: PolyElement
    turns: tuple[int, ...]
    steps: tuple[int, ...]

    @classmethod
    def of(cls, value: Laurent) -> '_Polynomial':
        terms = lowered(value.terms())
        steps = tuple(
            1 if g.kind == 'number' else math.gcd(value.ring.parts, *(e[k] for e in terms))
            for k, g in enumerate(value.ring.generators)
        )
        terms = {tuple(x // step for x, step in zip(e, steps)): c for e, c in terms.items()}
        names = [f'x{k}' for k in range(len(steps))]
        turned = _turned_real(terms)
        if turned is None:
            R, *_ = polynomial_ring(names, ZZ_I)
            whole = {e: ZZ_I(a, b) for e, (a, b) in terms.items()}
            return cls(R.from_dict(whole), (0,) * len(steps), steps)
        R, *_ = polynomial_ring(names, ZZ)
        return cls(R.from_dict(turned[1]), turned[0], steps)


def _turned_real(terms: Terms) -> tuple[tuple[int, ...], dict[tuple[int, ...], Any]] | None:
    # Multiply each generator by a power of the imaginary unit i, so that all coefficients become
    # real. If all coefficients become imaginary, divide the polynomial by i. Return the exponent
    # of i for each generator. Return also the real coefficients, as a dictionary with the
    # exponents of the terms as keys. Return None if no powers of i achieve this.
    turns = _quarter_turns(terms)
    if turns is None:
        return None
    real, phase = {}, None
    for exponents, (a, b) in terms.items():
        turned = sum(t * e for t, e in zip(turns, exponents)) + (1 if b else 0)
        phase = turned % 2 if phase is None else phase
        sign = 1 if (turned - phase) % 4 == 0 else -1
        real[exponents] = ZZ(sign * (a or b))
    return turns, real


def _quarter_turns(terms: Terms) -> tuple[int, ...] | None:
    # Multiply each generator k by i^t_k. Find integers t_k with which all coefficients become
    # real, or all become imaginary. A term in which generator k has the exponent e_k is multiplied
    # by i^s with s = sum_k t_k e_k. Let b be 1 if the coefficient of the term is imaginary, else
    # 0. The sum s + b must be even for all terms (real), or odd for all terms (imaginary). This is
    # a linear system over the field of two elements. Return None if it has no solution, or if a
    # coefficient is neither real nor imaginary.
    if any(a and b for a, b in terms.values()):
        return None
    first, *others = ((*e, bool(b)) for e, (_, b) in terms.items())
    n, field = len(first) - 1, GF(2)
    rows = {tuple((a - b) % 2 for a, b in zip(other, first)) for other in others}
    equations = [list(map(field, row)) for row in sorted(rows)]
    reduced, pivots = DomainMatrix(equations, (len(rows), n + 1), field).rref()
    if n in pivots:
        return None
    turns = [0] * n
    for pivot, row in zip(pivots, reduced.to_Matrix().tolist()):
        turns[pivot] = int(row[n])
    return tuple(turns)


def _pieces(polynomial: _Polynomial) -> tuple[list[tuple[PolyElement, int]] | None, bool]:
    element = polynomial.element
    if element.ring.domain == ZZ_I:
        return _gaussian_pieces(element)
    if len(element) > 12 and _irreducible_on_a_line(element, ZZ):
        return None, _stays_whole(element)
    if len(element) > MAX_TERMS:
        return None, False
    pieces, complete = [], True
    for factor, power in _factor_list(element):
        split, proved = [(factor, 1)], _stays_whole(factor)
        if not proved:
            split, proved = _gaussian_pieces(factor.set_ring(factor.ring.clone(domain=ZZ_I)))
        pieces += [(piece, power * times) for piece, times in split]
        complete = complete and proved
    return pieces, complete


def _gaussian_pieces(element: PolyElement) -> tuple[list[tuple[PolyElement, int]], bool]:
    if element.is_ground:
        return [], True
    if _irreducible_on_a_line(element, ZZ_I):
        return [(element, 1)], True
    letters = sum(map(bool, _degrees(element)))
    if letters > MAX_GAUSSIAN_GENERATORS or len(element) > MAX_GAUSSIAN_TERMS:
        return [(element, 1)], False
    return _gaussian_factors(element), True


def _gaussian_factors(element: PolyElement) -> list[tuple[PolyElement, int]]:
    # Remove unused generators from each factor, because sympy before 1.13 does not split
    # polynomials that lack the first generator.
    ring = element.ring
    used = [symbol for symbol, degree in zip(ring.symbols, _degrees(element)) if degree]
    factors: list[tuple[PolyElement, int]] = []
    for factor, power in _factor_list(element.set_ring(ring.clone(symbols=used))):
        unused = not all(_degrees(factor))
        pieces = _gaussian_factors(factor) if unused else [(factor, 1)]
        factors += [(piece.set_ring(ring), power * times) for piece, times in pieces]
    return factors


def _degrees(element: PolyElement) -> list[int]:
    return [max(e[k] for e in element) for k in range(len(element.ring.gens))]


def _factor_list(element: PolyElement) -> list[tuple[PolyElement, int]]:
    # Fix the seed, because sympy's factoring uses random points, and a bad point costs minutes.
    seed_random(SEED)
    return [(factor, int(power)) for factor, power in element.factor_list()[1]]


def _stays_whole(element: PolyElement) -> bool:
    # The polynomial `element` is irreducible over the integers. Return whether it is proved to be
    # irreducible over the Gaussian integers, too. If `element` is reducible over the Gaussian
    # integers, it is a product g conj(g), such as z^2 + 1 = (z + i) (z - i). The degrees of g and
    # conj(g) are equal in every generator, so all degrees of g conj(g) are even. Hence an odd
    # degree of `element` proves that `element` is irreducible.
    odd = any(degree % 2 for degree in [*_degrees(element), max(sum(e) for e in element)])
    return odd or _irreducible_on_a_line(element, ZZ, stays_whole_beside_i)


def _irreducible_on_a_line(
    element: PolyElement,
    domain: Any,
    is_whole: Callable[[PolyElement], bool] = attrgetter('is_irreducible'),
) -> bool:
    # Return whether the polynomial is proved irreducible. Restrict it to a line: set every
    # generator to a_k t + b_k. Each factor of the polynomial becomes a factor of the restriction.
    # If the restriction has full degree, factors keep their degrees, so an irreducible restriction
    # proves that the polynomial is irreducible.
    R, t = polynomial_ring('t', domain)
    degrees, random = _degrees(element), Random(SEED)
    degree = max(sum(e) for e in element)
    for _ in range(CUT_LINES):
        lines = [
            random.randint(1, MAX_LINE_COEFFICIENT) * t + random.randint(1, MAX_LINE_COEFFICIENT)
            for _ in degrees
        ]
        powers = [[line**e for e in range(n + 1)] for line, n in zip(lines, degrees)]
        cut = R.zero
        for exponents, c in element.terms():
            factors = (powers[k][e] for k, e in enumerate(exponents) if e)
            cut += math.prod(factors, start=R.ground_new(domain.convert(c)))
        if cut.degree() == degree and is_whole(cut.primitive()[1]):
            return True
    return False


def stays_whole_beside_i(cut: PolyElement) -> bool:
    """
    Return whether an integer polynomial of t is proved irreducible over the Gaussian integers.

    Let f be the polynomial `cut`. It must be primitive. If f is irreducible over the integers, but
    not over the Gaussian integers, then f = g conj(g). An odd degree of f excludes this case.

    If the degree of f is even, let p be a prime with p = 3 mod 4. Suppose that h is an irreducible
    factor of f modulo p, and that the degree of h is odd. Then h is also irreducible over the
    Gaussian integers modulo p, and conj(h) = h. So if f = g conj(g), then h divides g and conj(g),
    and h^2 divides f modulo p. Hence f is irreducible over the Gaussian integers if h exists and f
    is square-free modulo p.
    """
    if not cut.is_irreducible:
        return False
    if cut.degree() % 2:
        return True
    for p in PRIMES:
        _, monic = gf_monic(gf_trunc(cut.to_dense(), p), p, ZZ)
        if gf_sqf_p(monic, p, ZZ) and any(
            degree % 2 for _, degree in gf_ddf_zassenhaus(monic, p, ZZ)
        ):
            return True
    return False


def _turned_back(piece: PolyElement, turns: Sequence[int], steps: Sequence[int]) -> Terms:
    terms: Terms = {}
    for exponents, c in piece.terms():
        c = ZZ_I.convert(c)
        a, b = int(c.x), int(c.y)
        quarter = -sum(t * e for t, e in zip(turns, exponents)) % 4
        turned = tuple(e * step for e, step in zip(exponents, steps))
        terms[turned] = ((a, b), (-b, a), (-a, -b), (b, -a))[quarter]
    return terms


def _product(factors: Sequence[RealFactor], arithmetic: Arithmetic) -> Laurent:
    values = (factor.value for factor in factors for _ in range(factor.power))
    return math.prod(values, start=arithmetic.ring.number(1))
