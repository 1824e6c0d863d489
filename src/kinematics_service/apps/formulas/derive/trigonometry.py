# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write polynomials in exp(i q) as sympy expressions in sines and cosines.

The angles are treated one after another. For the first angle u, a polynomial is written as
C + P cos u + S sin u. The coefficients C, P and S contain the remaining angles, and are written in
the same way for the next angle.
"""

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import sympy
from sympy.core.mul import _keep_coeff

from .algebra.arithmetic import Arithmetic
from .algebra.laurent import Exponents, Laurent, Terms, from_terms
from .algebra.matrices import Matrix
from .frames import Frames

# Maximum number of terms of a polynomial that is written in several forms to find the shortest. A
# longer polynomial is written in one form only.
MAX_COMPARED_TERMS = 400
MAX_FACTORED_TERMS = 24
# Coefficients of a polynomial are written as fractions if their common denominator is at most
# this, otherwise as decimals. A larger denominator comes from constant angles that were replaced
# by angles with rational sine and cosine.
MAX_INTEGER = 10**15
DIGITS = 17
# Maximum number of terms of a polynomial that is simplified. For longer polynomials, sympy takes
# minutes.
MAX_TIDIED_TERMS = 1000


@dataclass(frozen=True)
class Basis:
    """
    The arguments u_j of sines and cosines: integer combinations of the joint angles.

    Attributes
    ----------
    angles
        The arguments u_j as sympy expressions, one for each joint.
    to_angles
        Integer matrix E. Let q_k be the angle of joint k, n_k the integer of joint k in
        `Arithmetic.units`, and i the imaginary unit. Then the generator exp(i q_k / n_k) of joint
        k is the product of the powers exp(i u_j)^E[k][j] over all j.
    """

    angles: tuple[sympy.Expr, ...]
    to_angles: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Writer:
    """
    Writes the polynomials of one arm as sympy expressions.

    Attributes
    ----------
    sums, singles
        The arguments of the sines and cosines, in two versions. In `sums`, the arguments are sums
        of the angles of parallel joints. In `singles`, each argument is the angle of one joint.
    divisor
        None if expressions are simplified. Otherwise the common denominator of the coefficients of
        the polynomial that is being written.
    """

    arithmetic: Arithmetic
    sums: Basis
    singles: Basis
    divisor: int | None = None
    _numbers: dict[sympy.Expr, sympy.Expr] = field(default_factory=dict)
    _written: dict[Hashable, sympy.Expr] = field(default_factory=dict)
    # Cache of written polynomials. A polynomial is written as C + P cos u + S sin u, and the
    # entries of a matrix share many of the polynomials C, P and S.
    _nested_before: dict[Hashable, sympy.Expr] = field(default_factory=dict)

    def expression(self, value: Laurent) -> sympy.Expr:
        """Return a real polynomial as a sympy expression, the shortest of a few forms."""
        if not value:
            return sympy.Integer(0)
        key = (frozenset(value.real.items()), frozenset(value.imaginary.items()), value.divisor)
        if key not in self._written:
            self._written[key] = self._shortest(value)
        return self._written[key]

    def _shortest(self, value: Laurent) -> sympy.Expr:
        if value.divisor > MAX_INTEGER or len(value) > MAX_TIDIED_TERMS:
            plain = replace(self, divisor=value.divisor, _nested_before={})
            return self._with_numbers(plain._products(value, self.sums))
        candidates = [self._products(value, self.sums)]
        if len(value) <= MAX_COMPARED_TERMS and self.singles != self.sums:
            candidates.append(self._products(value, self.singles))
        lengths = [sympy.count_ops(form) for form in candidates]
        # Each angle q has a generator exp(i q). Group the terms that have equal exponents of all
        # generators of angles. The terms of a group differ in lengths only, so each group is a
        # polynomial in lengths, times a product of generators.
        moving = range(len(self.arithmetic.names.variables))
        split = value.grouped([*moving, *self._fixed_places()])
        if len(value) <= MAX_COMPARED_TERMS and self._fewest_operations(split) < min(lengths):
            candidates.append(self._cosines_of_sums(split))
            lengths.append(sympy.count_ops(candidates[-1]))
        shortest = candidates[lengths.index(min(lengths))]
        return self._with_numbers(shortest / value.divisor)

    def _with_numbers(self, expression: sympy.Expr) -> sympy.Expr:
        # Replace theta by q + offset. `_shortest` calls this method after it has counted the
        # operations in each form of the polynomial, so the sums q + offset are not counted.
        numbers = {symbol: number for number, symbol in self._numbers.items()}
        return expression.xreplace(numbers | self.arithmetic.in_variables)

    def matrix(self, rows: Matrix) -> sympy.Matrix:
        """Return a matrix of real polynomials as an immutable sympy matrix."""
        return sympy.ImmutableMatrix([[self.expression(entry) for entry in row] for row in rows])

    def _fixed_places(self) -> tuple[int, ...]:
        generators = self.arithmetic.ring.generators
        return tuple(k for k, g in enumerate(generators) if g.kind == 'fixed_angle')

    def _leaf(self, terms: Mapping[Exponents, tuple[int, int]], imaginary: bool) -> sympy.Expr:
        # Return the real part (or, if `imaginary`, the imaginary part) of terms without joint
        # angles, as a sympy polynomial in lengths.
        generators = self.arithmetic.ring.generators
        summands = []
        for exponents, c in terms.items():
            if c[imaginary]:
                powers = (
                    self._letter(generators[k].meaning) ** e for k, e in enumerate(exponents) if e
                )
                summands.append(sympy.Mul(self._coefficient(c[imaginary]), *powers))
        if self.divisor is not None:
            return sympy.Add(*summands)
        return _tidied(sympy.Add(*summands)) if summands else sympy.Integer(0)

    def _coefficient(self, c: int) -> sympy.Expr:
        if self.divisor is None:
            return sympy.Integer(c)
        fraction = sympy.Rational(c, self.divisor)
        return fraction if self.divisor <= MAX_INTEGER else sympy.Float(fraction, DIGITS)

    def _letter(self, meaning: sympy.Expr) -> sympy.Expr:
        # Use a symbol for each number while an expression is built. With numbers, sympy would
        # write 0.0825 cos q + 0.4 as a fraction times a sum with integers.
        if meaning.is_Symbol:
            return meaning
        return self._numbers.setdefault(meaning, sympy.Symbol(f'_{len(self._numbers)}'))

    def _cosines_of_sums(self, groups: Mapping[Exponents, Terms]) -> sympy.Expr:
        # Write one cosine and one sine for the two terms whose exponents of the angles are e and
        # -e. The polynomial is real, so the coefficients of these two terms are conjugate.
        angles = self._angles_of_generators()
        result = sympy.Integer(0)
        for exponents, terms in groups.items():
            if exponents < tuple(-e for e in exponents):
                continue
            angle = sympy.Add(*(e * angle for e, angle in zip(exponents, angles)))
            weight = 1 if not any(exponents) else 2
            result += weight * self._leaf(terms, False) * sympy.cos(angle)
            result -= weight * self._leaf(terms, True) * sympy.sin(angle)
        return sympy.factor_terms(result)

    def _fewest_operations(self, groups: Mapping[Exponents, Terms]) -> int:
        # Return a lower bound of the number of operations in the result of `_cosines_of_sums`. The
        # bound counts the sines and cosines, the sums in their arguments, and the outer sum. If
        # another form of the polynomial needs no more operations than the bound, the caller does
        # not compute `_cosines_of_sums`.
        functions = 0
        inside = 0
        for exponents, terms in groups.items():
            if any(exponents) and exponents > tuple(-e for e in exponents):
                count = any(a for a, _ in terms.values()) + any(b for _, b in terms.values())
                functions += count
                inside += count * (sum(map(bool, exponents)) - 1)
        return 2 * functions - 1 + inside

    def _angles_of_generators(self) -> list[sympy.Expr]:
        arithmetic = self.arithmetic
        generators = arithmetic.ring.generators
        moving = [arithmetic.angles[v] / arithmetic.units[v] for v in arithmetic.names.variables]
        return [*moving, *(generators[k].meaning for k in self._fixed_places())]

    def _products(self, value: Laurent, basis: Basis) -> sympy.Expr:
        n, ring = len(basis.angles), self.arithmetic.ring
        changed: Terms = {}
        for exponents, c in value.terms().items():
            moved = (sum(exponents[k] * basis.to_angles[k][j] for k in range(n)) for j in range(n))
            changed[(*moved, *exponents[n:])] = c
        angles = dict(enumerate(basis.angles))
        angles |= {k: ring.generators[k].meaning for k in self._fixed_places()}
        return self._nested(from_terms(ring, changed), tuple(angles.items()))

    def _nested(self, value: Laurent, angles: Sequence[tuple[int, sympy.Expr]]) -> sympy.Expr:
        # Write the polynomial as C + P cos u + S sin u in the first angle u. Write C, P and S in
        # the other angles.
        if not angles:
            return self._leaf(value.terms(), False)
        key = (frozenset(value.real.items()), frozenset(value.imaginary.items()), angles)
        if key not in self._nested_before:
            self._nested_before[key] = self._sum_over(value, angles)
        return self._nested_before[key]

    def _sum_over(self, value: Laurent, angles: Sequence[tuple[int, sympy.Expr]]) -> sympy.Expr:
        (index, u), *others = angles
        inner, nothing = tuple(others), self.arithmetic.ring.number(0)
        by_power = value.by_power(index)
        result = self._nested(by_power.get(0, nothing), inner)
        for power in sorted({abs(e) for e in by_power if e}):
            above, below = by_power.get(power, nothing), by_power.get(-power, nothing)
            cosine = self._nested(above + below, inner)
            sine = self._nested((above - below).times_i(), inner)
            angle = power * u
            if self.divisor is None:
                angle = sympy.factor_terms(angle)
            result += cosine * sympy.cos(angle) + sine * sympy.sin(angle)
        return _taken_out(result) if self.divisor is None else result


def _taken_out(sum_: sympy.Expr) -> sympy.Expr:
    # Factor the sum as `sympy.factor_terms` does, but save time: do not factor the summands again,
    # because they are factored already. An exception is a summand such as 2 (a + b). If the number
    # 2 is taken out of the whole sum, a + b remains, and may have another common factor. So factor
    # it again.
    content, primitive = sum_.as_content_primitive(clear=False)
    if not primitive.is_Add:
        return sum_
    terms = [sympy.factor_terms(term) if term.is_Add else term for term in primitive.args]
    if all(term.as_coeff_Mul()[0].is_negative for term in terms):
        content, terms = -content, [-term for term in terms]
    total = _nothing_shared(terms)
    if total is None:
        total = sympy.gcd_terms(sympy.Add._from_args(terms), isprimitive=True, clear=False)
    return _keep_coeff(content, total, sign=True)


def _nothing_shared(terms: Sequence[sympy.Expr]) -> sympy.Expr | None:
    # Return the sum of the terms, as `sympy.gcd_terms` does, if no factor is in every term;
    # otherwise None. This function takes a tenth of the time of `gcd_terms`, which saves 13 to 30
    # % of a derivation.
    pairs = [term.as_coeff_Mul() for term in terms]
    if not all(c.is_Integer for c, _ in pairs) or math.gcd(*(int(c) for c, _ in pairs)) != 1:
        return None
    shared = None
    for _, product in pairs:
        powers = [factor.as_base_exp() for factor in sympy.Mul.make_args(product)]
        if not all(power.is_Integer and power.is_positive for _, power in powers):
            return None
        bases = {base for base, _ in powers}
        shared = bases if shared is None else shared & bases
    return None if shared else sympy.Add(*(c * product for c, product in pairs))


@lru_cache(maxsize=4096)
def _tidied(leaf: sympy.Expr) -> sympy.Expr:
    if leaf.is_Add and len(leaf.args) <= MAX_FACTORED_TERMS:
        leaf = sympy.factor(leaf)
    return sympy.factor_terms(leaf)


def writer_of(frames: Frames) -> Writer:
    """
    Return the writer of an arm; it uses sums of angles if the arm has parallel joints.
    """
    arithmetic = frames.arithmetic
    singles, sums = _basis(arithmetic, ()), _basis(arithmetic, _parallel_sums(frames))
    assert singles is not None  # the joint angles alone always form a basis
    return Writer(arithmetic, sums or singles, singles)


def _parallel_sums(frames: Frames) -> list[tuple[int, ...]]:
    # Add up the angles of successive rows with parallel z axes. Return each sum as a tuple with an
    # integer coefficient for each joint angle.
    arithmetic, variables = frames.arithmetic, frames.arithmetic.names.variables
    total = [0] * len(variables)
    sums: list[tuple[int, ...]] = []
    sign = 1
    for row in frames.rows:
        for matrix in (row.before, None, row.after):
            if matrix is None:
                for k, variable in enumerate(variables):
                    factor = row.theta[1].get(variable, 0) * arithmetic.units[variable]
                    total[k] += sign * int(factor)
                if any(total):
                    # Divide by `parts`, because the exponents are doubled in a ring with half
                    # angles.
                    sums.append(tuple(e // arithmetic.ring.parts for e in total))
                continue
            upright = [z for z in (1, -1) if not matrix[2][2] - arithmetic.ring.number(z)]
            if upright:
                sign *= upright[0]
            else:
                total, sign = [0] * len(variables), 1
    return sums


def _basis(arithmetic: Arithmetic, vectors: Iterable[tuple[int, ...]]) -> Basis | None:
    # Return a basis of the integer combinations of the joint angles. Take the sums of joint angles
    # in `vectors` one after another. Leave out a sum that depends linearly on the sums before.
    # Complete the basis by single joint angles. Return None if the matrix of the basis has no
    # inverse over the integers.
    variables = arithmetic.names.variables
    n = len(variables)
    chosen: list[Sequence[int]] = []
    for vector in (*vectors, *sympy.eye(n).tolist()):
        upright = [-e for e in vector] if next(e for e in vector if e) < 0 else vector
        if sympy.Matrix([*chosen, upright]).rank() > len(chosen):
            chosen.append(upright)
    matrix = sympy.Matrix(chosen)
    if abs(matrix.det()) != 1:
        return None
    # Row j of `matrix` has the coefficients of an argument u_j = sum_k matrix[j, k] q_k. So exp(i
    # q_k) is the product of exp(i u_j)^(inverse[k, j]) over all j.
    inverse = matrix.inv()
    angles = tuple(
        sympy.Add(
            *(e * arithmetic.angles[v] / arithmetic.units[v] for e, v in zip(row, variables))
        )
        for row in chosen
    )
    return Basis(angles, tuple(tuple(int(e) for e in inverse.row(k)) for k in range(n)))
