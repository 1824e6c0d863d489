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
from sympy.polys.domains import ZZ
from sympy.polys.rings import ring as polynomial_ring

from .frames import Arithmetic
from .laurent import Laurent, from_terms

Terms = dict[tuple[int, ...], tuple[int, int]]

# Random lines a polynomial is cut with; one on which it does not factor shows that it does not.
LINES = 3
SEED = 1955
# Above this many terms the full factoring, whose time grows steeply, is not tried.
MOST_TERMS = 6000


@dataclass(frozen=True)
class RealFactor:
    """
    A factor and how often it stands in the product.

    """

    value: Laurent
    power: int


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
        Whether no factor can be split further; False where that was not tried.

    """

    constant: Laurent
    factors: tuple[RealFactor, ...]
    complete: bool


def factored(value: Laurent, arithmetic: Arithmetic) -> Factored:
    """
    Return a polynomial that is real for real angles as a product.

    """
    polynomial = _Polynomial.of(value)
    if polynomial is None:
        return _whole(value, arithmetic, complete=False)
    pieces, complete = _pieces(polynomial)
    if pieces is None:
        return _whole(value, arithmetic, complete)
    halves = [(_turned_back(piece, polynomial, value), power) for piece, power in pieces]
    real = _paired(halves, arithmetic)
    factors = [RealFactor(_upright(factor, arithmetic), power) for factor, power in real]
    moving = [f for f in factors if _moves(f.value, arithmetic)]
    moving += _sliding_monomials(value, arithmetic)
    constant = _quotient_constant(value, moving, arithmetic)
    if constant is None:
        return _whole(value, arithmetic, complete=False)
    return Factored(constant, tuple(moving), complete)


def _sliding_monomials(value: Laurent, arithmetic: Arithmetic) -> list[RealFactor]:
    # A prismatic variable that divides every term was taken off with the exponents.
    ring, terms = arithmetic.ring, value.terms()
    found = []
    for variable in arithmetic.names.variables:
        place = ring.place('number', variable)
        power = min(e[place] for e in terms)
        if power:
            found.append(RealFactor(ring.power(place), power))
    return found


def _whole(value: Laurent, arithmetic: Arithmetic, complete: bool) -> Factored:
    one = arithmetic.ring.number(1)
    if not _moves(value, arithmetic):
        return Factored(value, (), True)
    return Factored(one, (RealFactor(value, 1),), complete)


@dataclass(frozen=True)
class _Polynomial:
    # A sympy polynomial over the integers, the exponents taken off, and the quarter turns.
    element: Any
    turns: tuple[int, ...]

    @classmethod
    def of(cls, value: Laurent) -> '_Polynomial | None':
        terms = value.terms()
        turns = _quarter_turns(terms)
        if turns is None:
            return None
        n = len(value.ring.generators)
        lowest = [min(e[k] for e in terms) for k in range(n)]
        names = [f'x{k}' for k in range(n)]
        R, *_ = polynomial_ring(names, ZZ)
        whole, phase = {}, None
        for exponents, (a, b) in terms.items():
            turned = sum(t * e for t, e in zip(turns, exponents)) + (1 if b else 0)
            phase = turned % 2 if phase is None else phase
            sign = 1 if (turned - phase) % 4 == 0 else -1
            whole[tuple(e - low for e, low in zip(exponents, lowest))] = ZZ(sign * (a or b))
        return cls(R.from_dict(whole), turns)


def _quarter_turns(terms: Terms) -> tuple[int, ...] | None:
    # Wanted: t with (sum t_k e_k + [coefficient is imaginary]) the same parity for every term.
    # Linear over the field of two elements; None where a coefficient is neither real nor imaginary.
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
    if len(element) > 12 and _irreducible_on_a_line(element):
        return None, True
    if len(element) > MOST_TERMS:
        return None, False
    _, factors = element.factor_list()
    return [(factor, int(power)) for factor, power in factors], True


def _irreducible_on_a_line(element: Any) -> bool:
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
        if cut.degree() == degree and cut.primitive()[1].is_irreducible:
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
        terms[tuple(exponents)] = ((c, 0), (0, c), (-c, 0), (0, -c))[quarter]
    assert len(value.ring.generators) >= len(next(iter(terms)))
    return terms


def _angle_places(arithmetic: Arithmetic) -> list[int]:
    return [k for k, g in enumerate(arithmetic.ring.generators) if g.kind != 'number']


def _degrees(terms: Terms, places: Sequence[int]) -> list[int]:
    return [max(e[k] for e in terms) + min(e[k] for e in terms) for k in places]


def _paired(halves: list[tuple[Terms, int]], arithmetic: Arithmetic) -> list[tuple[Terms, int]]:
    # Those of even degree in every angle are whole. The others come in pairs: with the factor that
    # half a turn of their odd angles makes of them, with their conjugate, or with themselves.
    places = _angle_places(arithmetic)
    open_: dict[int, tuple[Terms, int]] = {}
    result: list[tuple[Terms, int]] = []
    for k, (terms, power) in enumerate(halves):
        if _is_whole(terms, places):
            result.append((terms, power))
        else:
            open_[k] = (terms, power)
    while open_:
        k, (terms, power) = next(iter(open_.items()))
        del open_[k]
        partner = next(
            (
                j
                for j, (other, _) in open_.items()
                for wanted in (_shifted(terms, places), _conjugate(terms, places))
                if _proportional(wanted, other) and _is_whole(_times(terms, other), places)
            ),
            None,
        )
        if partner is None:
            partner = next(
                (j for j, (o, _) in open_.items() if _is_whole(_times(terms, o), places)), None
            )
        if partner is None:
            square = _times(terms, terms)
            result.append((square, power // 2) if power % 2 == 0 else (terms, power))
            continue
        other, other_power = open_.pop(partner)
        shared = min(power, other_power)
        result.append((_times(terms, other), shared))
        for rest, count in ((terms, power - shared), (other, other_power - shared)):
            if count:
                open_[k if rest is terms else partner] = (rest, count)
    return result


def _is_whole(terms: Terms, places: Sequence[int]) -> bool:
    return not any(d % 2 for d in _degrees(terms, places)) and _proportional(
        _conjugate(terms, places), terms
    )


def _shifted(terms: Terms, places: Sequence[int]) -> Terms:
    odd = [k for k, d in zip(places, _degrees(terms, places)) if d % 2]
    # One of the odd angles is turned by half a turn; turning two of a sum would be a full one.
    return (
        {e: (a, b) if e[odd[0]] % 2 == 0 else (-a, -b) for e, (a, b) in terms.items()}
        if odd
        else terms
    )


def _conjugate(terms: Terms, places: Sequence[int]) -> Terms:
    angles = set(places)
    return _lowered(
        {
            tuple(-x if k in angles else x for k, x in enumerate(e)): (a, -b)
            for e, (a, b) in terms.items()
        }
    )


def _lowered(terms: Terms) -> Terms:
    n = len(next(iter(terms)))
    lowest = [min(e[k] for e in terms) for k in range(n)]
    return {tuple(x - low for x, low in zip(e, lowest)): c for e, c in terms.items()}


def _times(one: Terms, other: Terms) -> Terms:
    result: Terms = {}
    for e, (a, b) in one.items():
        for f, (c, d) in other.items():
            key = tuple(x + y for x, y in zip(e, f))
            p, q = result.get(key, (0, 0))
            result[key] = (p + a * c - b * d, q + a * d + b * c)
    return {e: c for e, c in result.items() if c != (0, 0)}


def _proportional(one: Terms, other: Terms) -> bool:
    # Up to a complex number; monomials are taken off before.
    one, other = _lowered(one), _lowered(other)
    if set(one) != set(other):
        return False
    key = next(iter(one))
    (a, b), (c, d) = one[key], other[key]
    return all(
        # one[e] * other[key] == other[e] * one[key]
        (p * c - q * d, p * d + q * c) == (r * a - s * b, r * b + s * a)
        for e, (p, q) in one.items()
        for r, s in [other[e]]
    )


def _upright(terms: Terms, arithmetic: Arithmetic) -> Laurent:
    # The monomial and the complex number taken off that make it real: f = conjugate of f.
    places = _angle_places(arithmetic)
    n = len(next(iter(terms)))
    shift = [0] * n
    for k, d in zip(places, _degrees(terms, places)):
        shift[k] = d // 2
    for k in range(n):
        if k not in places:
            shift[k] = min(0, *(e[k] for e in terms))
    moved = {tuple(x - s for x, s in zip(e, shift)): c for e, c in terms.items()}
    angles = set(places)

    def mirrored(e: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(-x if k in angles else x for k, x in enumerate(e))

    e = next(iter(moved))
    (a, b), (c, d) = moved[e], moved[mirrored(e)]
    # g = u f with u c(e) conjugate to u c(-e): u^2 = conj(c(-e)) / c(e), a unit; all of ours are
    # powers of i times 1 + i at most.
    for p, q in ((1, 0), (0, 1), (1, 1), (1, -1)):
        one = (p * a - q * b, p * b + q * a)
        two = (p * c - q * d, p * d + q * c)
        if one == (two[0], -two[1]):
            unit = (p, q)
            break
    else:
        unit = (1, 0)
    p, q = unit
    real = {e: (p * a - q * b, p * b + q * a) for e, (a, b) in moved.items()}
    common = math.gcd(*(x for pair in real.values() for x in pair))
    real = {e: (a // common, b // common) for e, (a, b) in real.items()}
    if _leading_is_negative(real):
        real = {e: (-a, -b) for e, (a, b) in real.items()}
    result = from_terms(arithmetic.ring, real)
    # A pair e, -e is 2 cos or 2 sin: halved, unless a constant part would become a fraction.
    still = [c for e, c in real.items() if not any(e[k] for k in places)]
    turning = len(still) < len(real)
    balanced = all(a % 2 == 0 and b % 2 == 0 for a, b in still)
    return result.scaled(1, 2).reduced() if turning and balanced else result


def _leading_is_negative(terms: Terms) -> bool:
    # A convention: sin q and cos q, not their negatives.
    a, b = terms[max(terms)]
    return a < 0 or (a == 0 and b > 0)


def _moves(value: Laurent, arithmetic: Arithmetic) -> bool:
    variables = arithmetic.names.variables
    moving = set(range(len(variables)))
    moving |= {arithmetic.ring.place('number', v) for v in variables}
    return any(e[k] for e in value.terms() for k in moving)


def _quotient_constant(
    value: Laurent, factors: Sequence[RealFactor], arithmetic: Arithmetic
) -> Laurent | None:
    # value / product, known to have no joint variables; checked by multiplying back.
    product = arithmetic.ring.number(1)
    for factor in factors:
        for _ in range(factor.power):
            product = product * factor.value
    places = [*range(len(arithmetic.names.variables))]
    places += [arithmetic.ring.place('number', v) for v in arithmetic.names.variables]
    ours, theirs = _by_joints(product, places), _by_joints(value, places)
    if set(ours) != set(theirs):
        return None
    for key, part in ours.items():
        if len(part) == 1:
            break
    else:
        key = next(iter(ours))
        return _long_quotient(value, product, ours[key], theirs[key], arithmetic)
    ((e, (a, b)),) = part.items()
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


def _by_joints(value: Laurent, places: Sequence[int]) -> dict[tuple[int, ...], Terms]:
    groups: dict[tuple[int, ...], Terms] = {}
    joint = set(places)
    for e, c in value.terms().items():
        key = tuple(e[k] for k in places)
        groups.setdefault(key, {})[tuple(0 if k in joint else x for k, x in enumerate(e))] = c
    return groups
