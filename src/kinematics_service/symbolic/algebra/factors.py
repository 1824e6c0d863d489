"""
Factors of a real trigonometric polynomial, each real and with every angle whole.

In exp(i q) a sine has two factors, z - 1 and z + 1 (sine and cosine of half the angle), and the
coefficients are complex. So: turn the generators by quarter turns until every coefficient is real,
factor over the integers, turn back, and multiply the halves that belong together.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy
from sympy.core.random import seed as seed_random
from sympy.polys.domains import ZZ, ZZ_I
from sympy.polys.rings import ring as polynomial_ring

from .arithmetic import Arithmetic
from .half_factors import Terms, paired, upright, upright_half
from .laurent import Laurent, from_terms
from .quotient import quotient_constant

# Random lines a polynomial is cut with; one on which it does not factor shows that it does not.
LINES = 3
SEED = 1955
# Above this many terms the full factoring, whose time grows steeply, is not tried.
MOST_TERMS = 6000
# Of a product that was not shown to be split fully shorter factors are looked at one by one.
MOST_ALONE = 100


@dataclass(frozen=True)
class RealFactor:
    """
    A factor and how often it stands in the product.

    Attributes
    ----------
    halves
        Of a product of two factors of half angles these; empty for others. They are real in a
        ring with half angles.
    alone
        As `half_factors.Whole` has it.
    """

    value: Laurent
    power: int
    halves: tuple[Laurent, ...] = ()
    alone: bool = False


@dataclass(frozen=True)
class Factored:
    """
    A product: constant (without joint variables) times factors with them.

    Attributes
    ----------
    constant
        Lengths and numbers.
    factors
        Those with joint variables.
    complete
        Whether it is proved that no factor can be split further into real ones with fractions as
        coefficients; False where that was not tried, too.
    """

    constant: Laurent
    factors: tuple[RealFactor, ...]
    complete: bool


def factored(value: Laurent, arithmetic: Arithmetic) -> Factored:
    """Return a polynomial that is real for real angles as a product."""
    polynomial = _Polynomial.of(value)
    if polynomial is None:
        return _whole(value, arithmetic, complete=False)
    pieces, complete = _pieces(polynomial)
    if pieces is None:
        return _whole(value, arithmetic, complete)
    halves = [(_turned_back(piece, polynomial, value), power) for piece, power in pieces]
    factors = [
        RealFactor(
            upright(whole.terms, arithmetic),
            whole.power,
            tuple(upright_half(half, arithmetic) for half in whole.halves),
            whole.alone,
        )
        for whole in paired(halves, arithmetic)
    ]
    moving = [f for f in factors if _moves(f.value, arithmetic)]
    moving += _sliding_monomials(value, arithmetic)
    constant = quotient_constant(value, _product(moving, arithmetic), arithmetic)
    if constant is None:
        return _whole(value, arithmetic, complete=False)
    return Factored(constant, tuple(moving), complete)


def stays_whole(value: Laurent, arithmetic: Arithmetic) -> bool:
    """Return whether it is proved of a short factor that no real factors can be split off."""
    if len(value) > MOST_ALONE:
        return False
    product = factored(value, arithmetic)
    return product.complete and [factor.power for factor in product.factors] == [1]


def _sliding_monomials(value: Laurent, arithmetic: Arithmetic) -> list[RealFactor]:
    # A prismatic variable that divides every term was taken off with the exponents.
    ring, terms = arithmetic.ring, value.terms()
    found = []
    for variable in arithmetic.names.variables:
        index = ring.index('number', variable)
        power = min(e[index] for e in terms)
        if power:
            found.append(RealFactor(ring.power(index), power))
    return found


def _whole(value: Laurent, arithmetic: Arithmetic, complete: bool) -> Factored:
    if not _moves(value, arithmetic):
        return Factored(value, (), True)
    # Lengths that divide every term are no part of what is whole.
    terms = value.terms()
    common = [
        min(e[k] for e in terms) if generator.kind == 'number' else 0
        for k, generator in enumerate(arithmetic.ring.generators)
    ]
    lowered = {tuple(x - low for x, low in zip(e, common)): c for e, c in terms.items()}
    rest = from_terms(arithmetic.ring, lowered, value.divisor)
    moving = [RealFactor(rest, 1), *_sliding_monomials(value, arithmetic)]
    moving = [factor for factor in moving if _moves(factor.value, arithmetic)]
    constant = quotient_constant(value, _product(moving, arithmetic), arithmetic)
    assert constant is not None
    return Factored(constant, tuple(moving), complete)


@dataclass(frozen=True)
class _Polynomial:
    # A sympy polynomial over the integers, the exponents taken off and divided by those of whole
    # angles, and the quarter turns.
    element: Any
    turns: tuple[int, ...]
    steps: tuple[int, ...]

    @classmethod
    def of(cls, value: Laurent) -> '_Polynomial | None':
        terms = value.terms()
        generators = value.ring.generators
        n = len(generators)
        lowest = [min(e[k] for e in terms) for k in range(n)]
        steps = [
            1 if g.kind == 'number' else math.gcd(value.ring.parts, *(e[k] - low for e in terms))
            for k, (g, low) in enumerate(zip(generators, lowest))
        ]
        terms = {
            tuple((x - low) // step for x, low, step in zip(e, lowest, steps)): c
            for e, c in terms.items()
        }
        turns = _quarter_turns(terms)
        if turns is None:
            return None
        names = [f'x{k}' for k in range(n)]
        R, *_ = polynomial_ring(names, ZZ)
        whole, phase = {}, None
        for exponents, (a, b) in terms.items():
            turned = sum(t * e for t, e in zip(turns, exponents)) + (1 if b else 0)
            phase = turned % 2 if phase is None else phase
            sign = 1 if (turned - phase) % 4 == 0 else -1
            whole[exponents] = ZZ(sign * (a or b))
        return cls(R.from_dict(whole), turns, tuple(steps))


def _quarter_turns(terms: Terms) -> tuple[int, ...] | None:
    # Wanted: t with (sum t_k e_k + [coefficient is imaginary]) the same parity for every term.
    # Linear over the field of two elements; None where a coefficient is neither.
    if any(a and b for a, b in terms.values()):
        return None
    items = [(e, 1 if b else 0) for e, (_, b) in terms.items()]
    (first, parity), n = items[0], len(items[0][0])
    rows: list[int] = []
    for exponents, other in items[1:]:
        row = sum(((a - b) & 1) << k for k, (a, b) in enumerate(zip(exponents, first)))
        row |= ((other ^ parity) & 1) << n
        for pivot in rows:
            row ^= pivot if row & pivot & -pivot else 0
        if row & ~(1 << n) == 0:
            if row:
                return None
            continue
        low = row & -row
        rows = [r ^ row if r & low else r for r in rows] + [row]
    turns = [0] * n
    for row in rows:
        low = (row & -row).bit_length() - 1
        turns[low] = row >> n & 1
    return tuple(turns)


def _pieces(polynomial: _Polynomial) -> tuple[list[tuple[Any, int]] | None, bool]:
    element = polynomial.element
    if len(element) > 12 and _irreducible_on_a_line(element, ZZ):
        return None, _stays_whole(element)
    if len(element) > MOST_TERMS:
        return None, False
    # Sympy's factoring takes points at random, and a bad one costs minutes: the same ones always.
    seed_random(SEED)
    _, factors = element.factor_list()
    complete = all(_stays_whole(factor) for factor, _ in factors)
    return [(factor, int(power)) for factor, power in factors], complete


def _stays_whole(element: Any) -> bool:
    # Whether a polynomial that is irreducible over the integers is proved not to be a product of
    # two complex ones, which might be real in the angles, as those of cos 2q = (cos q + sin q)
    # (cos q - sin q): they are conjugate, and so of one degree in every generator.
    degrees = [max(e[k] for e in element) for k in range(len(element.ring.gens))]
    odd = any(degree % 2 for degree in [*degrees, max(sum(e) for e in element)])
    return odd or _irreducible_on_a_line(element, ZZ_I)


def _irreducible_on_a_line(element: Any, domain: Any) -> bool:
    # A factor stays a factor when every generator is set to a_k t + b_k, its degree too unless the
    # leading part vanishes there: if the cut does not factor at full degree, neither does the
    # polynomial. (Content without t cannot hide: the cut has integer content only.)
    t = sympy.Symbol('t')
    degree = max(sum(e) for e in element)
    random = _Sequence(SEED)
    for _ in range(LINES):
        lines = [
            sympy.Poly(random.next() * t + random.next(), t, domain=ZZ) for _ in element.ring.gens
        ]
        powers = [[sympy.Poly(1, t, domain=ZZ)] for _ in lines]
        cut = sympy.Poly(0, t, domain=ZZ)
        for exponents, c in element.terms():
            term = sympy.Poly(int(c), t, domain=ZZ)
            for k, e in enumerate(exponents):
                while len(powers[k]) <= e:
                    powers[k].append(powers[k][-1] * lines[k])
                if e:
                    term = term * powers[k][e]
            cut += term
        if cut.degree() == degree and cut.primitive()[1].set_domain(domain).is_irreducible:
            return True
    return False


class _Sequence:
    # Small positive numbers, the same each time (Lehmer's generator, modulus 2^31 - 1).
    def __init__(self, seed: int) -> None:
        self._state = seed

    def next(self) -> int:
        self._state = self._state * 48271 % (2**31 - 1)
        return self._state % 23 + 1


def _turned_back(piece: Any, polynomial: _Polynomial, value: Laurent) -> Terms:
    terms: Terms = {}
    for exponents, c in piece.terms():
        quarter = -sum(t * e for t, e in zip(polynomial.turns, exponents)) % 4
        c = int(c)
        inflated = tuple(e * step for e, step in zip(exponents, polynomial.steps))
        terms[inflated] = ((c, 0), (0, c), (-c, 0), (0, -c))[quarter]
    assert len(value.ring.generators) >= len(next(iter(terms)))
    return terms


def _product(factors: Sequence[RealFactor], arithmetic: Arithmetic) -> Laurent:
    product = arithmetic.ring.number(1)
    for factor in factors:
        for _ in range(factor.power):
            product = product * factor.value
    return product


def _moves(value: Laurent, arithmetic: Arithmetic) -> bool:
    variables = arithmetic.names.variables
    moving = set(range(len(variables)))
    moving |= {arithmetic.ring.index('number', v) for v in variables}
    return any(e[k] for e in value.terms() for k in moving)
