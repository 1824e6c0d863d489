# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute exactly with sines and cosines as Laurent polynomials in lengths and exp(i q).

cos q = (z + 1/z) / 2 and sin q = (z - 1/z) / 2i with z = exp(i q). Expressions that are equal for
every q have equal terms in this form. So a difference is proved to be zero without a simplifier.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import sympy

# A monomial is stored as one integer. Its digits to the base 2^16 are the signed exponents, so
# adding two integers multiplies two monomials.
BITS = 16
HALF = 1 << (BITS - 1)
MASK = (1 << BITS) - 1

Kind = Literal['angle', 'fixed_angle', 'number']
Exponents = tuple[int, ...]
# Terms of a polynomial: exponents as key, coefficient (real, imaginary) as value.
Terms = dict[Exponents, tuple[int, int]]


@dataclass(frozen=True)
class Generator:
    """
    A variable of Laurent polynomials: its exponents may be negative.

    Parameters
    ----------
    kind
        `angle`: exp(i q / u) with the joint variable q (`meaning`) and an integer u from
        `Arithmetic.units`. `fixed_angle`: exp(i c) with the constant angle c (`meaning`). In both,
        i is the imaginary unit. `number`: `meaning` itself, which is a length, a prismatic
        variable, or an irrational or decimal number.
    meaning
        A sympy expression; angles in rad, lengths in the file's unit.
    """

    kind: Kind
    meaning: sympy.Expr


@dataclass
class Ring:
    """
    The generators of the polynomials of an arm.

    The ring is the only mutable object in this module: new generators are appended.

    Attributes
    ----------
    parts
        2 if the generators are exp(i q / 2), so that sines and cosines of half angles are
        polynomials, too; else 1.
    """

    parts: int = 1
    generators: list[Generator] = field(default_factory=list)
    indices: dict[tuple[Kind, sympy.Expr], int] = field(default_factory=dict)

    def index(self, kind: Kind, meaning: sympy.Expr) -> int:
        """Return the index of a generator; add the generator if it is new."""
        key = (kind, meaning)
        if key not in self.indices:
            self.indices[key] = len(self.generators)
            self.generators.append(Generator(kind, meaning))
        return self.indices[key]

    @property
    def offset(self) -> int:
        """
        Return the number that shifts all exponents of a monomial by 2^15, so that none is
        negative.

        A monomial is stored as one integer, 16 bits for each exponent. Add the result to this
        integer.
        """
        return sum(HALF << (BITS * k) for k in range(len(self.generators)))

    def exponents(self, monomial: int) -> tuple[int, ...]:
        """Return the exponents of a monomial (stored as an integer), one for each generator."""
        shifted = monomial + self.offset
        return tuple(((shifted >> (BITS * k)) & MASK) - HALF for k in range(len(self.generators)))

    def monomial(self, exponents: Iterable[int]) -> int:
        """Return the integer that stores the monomial with these exponents."""
        return sum(e << (BITS * k) for k, e in enumerate(exponents))

    def number(self, value: int, divisor: int = 1) -> 'Laurent':
        """Return the constant polynomial value / divisor."""
        return Laurent(self, {0: value} if value else {}, {}, divisor)

    def power(self, index: int, exponent: int = 1) -> 'Laurent':
        """Return a power of a generator as a polynomial."""
        return Laurent(self, {exponent << (BITS * index): 1}, {}, 1)

    def length(self, expression: sympy.Expr) -> 'Laurent':
        """
        Return a sympy expression of numbers and symbols, without angles, as a polynomial.

        Integers, halves and quarters become coefficients. Any other number, such as a square root
        or a decimal, becomes a generator, that is, a variable of the polynomial. So polynomials
        factor as if roots and decimals were symbols. All denominators of coefficients are powers
        of 2.
        """
        if expression.is_Integer:
            return self.number(int(expression))
        if expression.is_Add:
            return total(self, (self.length(part) for part in expression.args))
        if expression.is_Mul:
            result = self.number(1)
            for part in expression.args:
                result = result * self.length(part)
            return result
        if expression.is_Pow and expression.exp.is_Integer and expression.base.is_Symbol:
            return self.power(self.index('number', expression.base), int(expression.exp))
        if expression.is_Rational and expression.q in (2, 4):
            return self.number(int(expression.p), int(expression.q))
        if expression.is_Rational and expression.is_negative:
            return -self.length(-expression)
        return self.power(self.index('number', expression))


@dataclass(frozen=True, eq=False)
class Laurent:
    """
    A polynomial with complex coefficients (real + i imaginary) / divisor.

    `real` and `imaginary` map each monomial, stored as an integer, to an integer.
    """

    ring: Ring
    real: Mapping[int, int]
    imaginary: Mapping[int, int]
    divisor: int = 1

    def __bool__(self) -> bool:
        return bool(self.real or self.imaginary)

    def __len__(self) -> int:
        return len(self.real) + len(self.imaginary)

    def __neg__(self) -> 'Laurent':
        return self.scaled(-1)

    def __add__(self, other: 'Laurent') -> 'Laurent':
        return total(self.ring, (self, other))

    def __sub__(self, other: 'Laurent') -> 'Laurent':
        return total(self.ring, (self, -other))

    def __mul__(self, other: 'Laurent') -> 'Laurent':
        real: dict[int, int] = {}
        imaginary: dict[int, int] = {}
        _add_product(real, self.real, other.real, 1)
        _add_product(real, self.imaginary, other.imaginary, -1)
        _add_product(imaginary, self.real, other.imaginary, 1)
        _add_product(imaginary, self.imaginary, other.real, 1)
        return Laurent(
            self.ring,
            _without_zeros(real),
            _without_zeros(imaginary),
            self.divisor * other.divisor,
        )

    def scaled(self, factor: int, divisor: int = 1) -> 'Laurent':
        """Return the polynomial times a fraction that is not 0."""
        return Laurent(
            self.ring,
            {m: factor * c for m, c in self.real.items()},
            {m: factor * c for m, c in self.imaginary.items()},
            self.divisor * divisor,
        )

    def times_i(self, power: int = 1) -> 'Laurent':
        """Return the polynomial times i^power, with the imaginary unit i."""
        result = self
        for _ in range(power % 4):
            minus = {m: -c for m, c in result.imaginary.items()}
            result = Laurent(self.ring, minus, result.real, self.divisor)
        return result

    def derivative(self, index: int, per_unit: int = 1) -> 'Laurent':
        """
        Return the derivative of the polynomial by a joint angle, or by a generator.

        If the generator is exp(i q / per_unit), the derivative is by the angle q. If the kind of
        the generator is `number`, the derivative is by the generator itself.

        Parameters
        ----------
        index
            Index of the generator in the ring.
        per_unit
            The integer in exp(i q / per_unit); not used if the kind of the generator is `number`.
        """
        shift, offset = BITS * index, self.ring.offset
        is_angle = self.ring.generators[index].kind != 'number'
        lowered = 0 if is_angle else 1 << shift

        def part(terms: Mapping[int, int]) -> dict[int, int]:
            result = {}
            for monomial, c in terms.items():
                e = (((monomial + offset) >> shift) & MASK) - HALF
                if e:
                    result[monomial - lowered] = e * c
            return result

        result = Laurent(self.ring, part(self.real), part(self.imaginary), self.divisor)
        return result.times_i().scaled(1, per_unit) if is_angle else result

    def terms(self) -> Terms:
        """
        Return the terms: exponents as key, coefficient (real, imaginary) as value. The
        coefficients are not divided by `divisor`.
        """
        return {
            self.ring.exponents(m): (self.real.get(m, 0), self.imaginary.get(m, 0))
            for m in {**self.real, **self.imaginary}
        }

    def by_power(self, index: int) -> dict[int, 'Laurent']:
        """Return the coefficient of each power of one variable of the polynomial, by the power."""
        groups = self.grouped((index,)).items()
        return {power: from_terms(self.ring, terms, self.divisor) for (power,), terms in groups}

    def grouped(self, indices: Sequence[int]) -> dict[Exponents, Terms]:
        """
        Group the terms by their exponents of the generators in `indices`; set these exponents to 0
        in each group.
        """
        chosen, groups = set(indices), dict[Exponents, Terms]()
        for e, c in self.terms().items():
            others = tuple(0 if k in chosen else x for k, x in enumerate(e))
            groups.setdefault(tuple(e[k] for k in indices), {})[others] = c
        return groups

    def without_cancelled(self) -> 'Laurent':
        """
        Return the polynomial without terms whose decimals cancel, as in (0.1 + 0.2 - 0.3) cos q.

        Each decimal is a generator, so the ring does not see that such terms sum to 0.
        """
        generators = self.ring.generators
        decimals = [k for k, g in enumerate(generators) if g.meaning.is_Rational]
        groups: dict[Exponents, Terms] = {}
        for e, c in self.terms().items():
            others = tuple(0 if k in decimals else x for k, x in enumerate(e))
            groups.setdefault(others, {})[e] = c
        kept: Terms = {}
        for terms in groups.values():
            sizes = [math.prod(generators[k].meaning ** e[k] for k in decimals) for e in terms]
            for part in (0, 1):
                if sum(c[part] * size for c, size in zip(terms.values(), sizes)) != 0:
                    kept |= terms
        return from_terms(self.ring, kept, self.divisor) if len(kept) < len(self) else self

    def reduced(self) -> 'Laurent':
        """
        Return an equal polynomial whose integer coefficients and divisor have no common divisor.
        """
        common = math.gcd(self.divisor, *self.real.values(), *self.imaginary.values())
        if common == 1:
            return self
        return Laurent(
            self.ring,
            {m: c // common for m, c in self.real.items()},
            {m: c // common for m, c in self.imaginary.items()},
            self.divisor // common,
        )


def _add_product(
    into: dict[int, int], f: Mapping[int, int], g: Mapping[int, int], sign: int
) -> None:
    if len(f) > len(g):
        f, g = g, f
    pairs = tuple(g.items())
    get = into.get
    for m, c in f.items():
        c *= sign
        for n, d in pairs:
            # Compute m + n only once: this saves 20 % of the time of the loop, which takes a third
            # of a long derivation.
            monomial = m + n
            into[monomial] = get(monomial, 0) + c * d


def _without_zeros(terms: dict[int, int]) -> dict[int, int]:
    return {m: c for m, c in terms.items() if c}


def total(ring: Ring, parts: Iterable[Laurent]) -> Laurent:
    """Return the sum of polynomials of one ring."""
    summands = [part for part in parts if part]
    if len(summands) == 1:
        return summands[0]
    divisor = math.lcm(1, *(part.divisor for part in summands))
    real: dict[int, int] = {}
    imaginary: dict[int, int] = {}
    for part in summands:
        factor = divisor // part.divisor
        for into, terms in ((real, part.real), (imaginary, part.imaginary)):
            for m, c in terms.items():
                into[m] = into.get(m, 0) + factor * c
    return Laurent(ring, _without_zeros(real), _without_zeros(imaginary), divisor).reduced()


def from_terms(
    ring: Ring, terms: Mapping[Exponents, tuple[int, int]], divisor: int = 1
) -> Laurent:
    """Return the polynomial with these terms: exponents as key, (real, imaginary) as value."""
    real = {ring.monomial(e): a for e, (a, _) in terms.items() if a}
    imaginary = {ring.monomial(e): b for e, (_, b) in terms.items() if b}
    return Laurent(ring, real, imaginary, divisor).reduced()
