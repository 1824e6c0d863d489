# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Solve a factor of the determinant for one joint, and find the condition for real solutions."""

from dataclasses import dataclass

import sympy

from .algebra.arithmetic import Arithmetic
from .algebra.laurent import Laurent, from_terms
from .trigonometry import Writer

K = sympy.Symbol('k', integer=True)


@dataclass(frozen=True)
class Family:
    """
    A family of singular poses.

    Attributes
    ----------
    variable
        The joint variable for which the equation `factor = 0` is solved; None if it is not solved.
    solutions
        Values of `variable` at which the factor is 0, as expressions of the other joint variables.
        In an expression such as k*pi, the symbol k is any integer.
    condition
        The condition for real solutions, a sympy relation; None if real solutions always exist.
    free
        The coefficients of the equation `factor = 0` for `variable`, as expressions of the other
        joint variables. If all coefficients are 0, every value of `variable` is a solution. Empty
        if the coefficients are never all 0.
    """

    variable: sympy.Symbol | None
    solutions: tuple[sympy.Expr, ...]
    condition: sympy.Basic | None
    free: tuple[sympy.Expr, ...]


@dataclass(frozen=True)
class _Solved:
    # A factor as an equation in one joint position q. If the joint is revolute, the equation is
    #     cosine * cos(y) + sine * sin(y) + constant = 0   with   y = multiple * q + shift.
    # If the joint is prismatic, the equation is cosine * q + constant = 0.
    variable: sympy.Symbol
    shift: sympy.Expr
    cosine: Laurent
    sine: Laurent
    constant: Laurent
    slides: bool
    multiple: sympy.Expr
    simplicity: tuple[sympy.Expr, ...]


def family_of(value: Laurent, arithmetic: Arithmetic, writer: Writer) -> Family:
    """Return the family of configurations at which a factor of the determinant vanishes."""
    variables = enumerate(arithmetic.names.variables)
    candidates = (_solved(value, arithmetic, variable, index) for index, variable in variables)
    equations = [equation for equation in candidates if equation is not None]
    if not equations:
        return Family(None, (), None, ())
    best = min(equations, key=lambda equation: equation.simplicity)
    solutions, condition = _roots(best, writer)
    offset = 0 if best.slides else arithmetic.offsets[best.variable]
    sums = (sympy.Add.make_args(root - best.shift) for root in solutions)
    shifted = tuple(sympy.Add(*(part / best.multiple for part in s)) - offset for s in sums)
    parts = [writer.expression(part) for part in (best.cosine, best.sine, best.constant)]
    moving = any(_has_joint(part, writer) for part in parts[:2])
    free = tuple(dict.fromkeys(part for part in parts if part != 0)) if moving else ()
    return Family(best.variable, shifted, condition, free)


def _solved(
    value: Laurent, arithmetic: Arithmetic, variable: sympy.Symbol, index: int
) -> _Solved | None:
    ring = arithmetic.ring
    turning, sliding = arithmetic.angle_index(variable), ring.index('number', variable)
    by_angle, by_length = value.by_power(turning), value.by_power(sliding)
    nothing = ring.number(0)
    if set(by_angle) == {0} and set(by_length) in ({0, 1}, {1}):
        above, constant = by_length[1], by_length.get(0, nothing)
        moves = int(arithmetic.moves(above.terms()))
        simple = (moves, 0, int(bool(constant)), 1, len(above), -index)
        return _Solved(variable, sympy.Integer(0), above, above, constant, True, 1, simple)
    multiple = max(by_angle)
    if set(by_length) != {0} or multiple < 1 or not set(by_angle) <= {-multiple, 0, multiple}:
        return None
    above, constant = by_angle[multiple], by_angle.get(0, nothing)
    n = len(arithmetic.names.variables)
    turns = {e[:n] for e in above.terms()}
    common = turns.pop() if len(turns) == 1 else (0,) * n
    shift = sympy.Add(
        *(
            e * (v + arithmetic.offsets[v]) / arithmetic.units[v]
            for e, v in zip(common, arithmetic.names.variables)
        )
    )
    pure = above * from_terms(ring, {tuple(-e for e in common): (1, 0)})
    if arithmetic.moves(pure.terms()):
        pure, shift = above, sympy.Integer(0)
    # Let y = `multiple` q + `shift` and z = exp(i y). The factor is A z + C + conj(A) / z with
    # polynomials A (`pure`) and C (`constant`). This equals 2 Re A cos y - 2 Im A sin y + C.
    conjugate = by_angle.get(-multiple, nothing)
    if shift != 0:
        conjugate = conjugate * from_terms(ring, {common: (1, 0)})
    cosine, sine = pure + conjugate, (pure - conjugate).times_i()
    moves = int(arithmetic.moves(cosine.terms()) or arithmetic.moves(sine.terms()))
    parts = int(bool(cosine)) + int(bool(sine))
    times = sympy.Rational(multiple, arithmetic.units[variable])
    simplicity = (moves, abs(times - 1), int(bool(constant)), parts, len(pure), -index)
    return _Solved(variable, shift, cosine, sine, constant, False, times, simplicity)


def _roots(solved: _Solved, writer: Writer) -> tuple[tuple[sympy.Expr, ...], sympy.Basic | None]:
    constant = writer.expression(solved.constant)
    if solved.slides:
        slope = writer.expression(solved.cosine)
        condition = None if not _has_joint(slope, writer) else sympy.Ne(slope, 0)
        return (sympy.simplify(-constant / slope),), condition
    a, b = writer.expression(solved.cosine), writer.expression(solved.sine)
    turns = 2 * K * sympy.pi
    if constant == 0:
        return (_zero_of_phase(a, b, writer) + K * sympy.pi,), None
    size = sympy.Add(*(part**2 for part in (a, b) if part != 0))
    if a == 0 or b == 0:
        phase = sympy.pi / 2 if a == 0 else sympy.Integer(0)
        inner = sympy.acos(sympy.factor_terms(-constant / (a + b)))
    else:
        phase = sympy.atan2(b, a)
        inner = sympy.acos(-constant / sympy.sqrt(size))
    exists = sympy.Le(constant**2, size)
    if exists == sympy.false:
        return (), exists
    # Use one sign if `inner` is 0 or pi, because phase + inner and phase - inner then differ by
    # whole turns only.
    signs = (1,) if inner in (0, sympy.pi) else (1, -1)
    roots = tuple(phase + sign * inner + turns for sign in signs)
    return roots, None if exists == sympy.true else exists


def _zero_of_phase(a: sympy.Expr, b: sympy.Expr, writer: Writer) -> sympy.Expr:
    if a == 0:
        return sympy.Integer(0)
    if b == 0:
        return sympy.pi / 2
    if _has_joint(a, writer) or _has_joint(b, writer):
        return sympy.atan2(-a, b)
    return sympy.atan(-a / b)


def _has_joint(expression: sympy.Expr, writer: Writer) -> bool:
    return bool(expression.free_symbols & set(writer.arithmetic.names.variables))
