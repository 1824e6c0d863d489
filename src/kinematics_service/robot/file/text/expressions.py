# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate expressions of a robot file: numbers, names, + - * / ( ), sqrt, sin, cos, atan2.

`expression_syntax` parses a text into a tree of these elements only; `eval` is never called.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ....errors import ExpressionError
from . import expression_syntax
from .entries import did_you_mean, meant_by

# Patterns that find suggestions for unknown names: usual names of joint variables, the number at
# the end of a name, and names such as `pi2`, which may mean pi/2.
JOINT = re.compile('(?:theta|th|t|phi|q|d|s|joint|j)_?([0-9]+)', re.IGNORECASE)
END = re.compile('[0-9]+$')
PART_OF_PI = re.compile('pi([1-9])')

MAX_LISTED = 20  # largest number of names in a message
MAX_ADVISED_LENGTH = 80  # characters; messages propose corrections only of shorter expressions


@dataclass(frozen=True)
class Affine:
    """
    An affine function of q: a constant plus a linear combination of joint variables.

    Parameters
    ----------
    constant
    coefficients : pairs (variable, factor)
        The pairs in the order of the joints; no factor is 0.
    """

    constant: float
    coefficients: tuple[tuple[str, float], ...]

    def at(self, values: Mapping[str, float]) -> float:
        """Return the value of the function, given the values of the joint variables by name."""
        return self.constant + sum(factor * values[name] for name, factor in self.coefficients)


@dataclass(frozen=True)
class Expression:
    """
    An expression of the robot file: its text, and its value as an affine function of q, in rad or
    m.
    """

    text: str
    affine: Affine


@dataclass(frozen=True)
class Scope:
    """
    The names that an expression may use at one place of a robot file, and their values.

    Parameters
    ----------
    angle_unit
        'rad' or 'deg', for the trigonometric functions. `pi` is accepted only with 'rad'.
    constants
        Values of the constants by name, in the file's units.
    variables
        Accepted joint variables, in the order of the joints.
    refused
        Names that the file defines but the expression may not use, each with the reason.
    quantity
        The expected quantity: 1 for an angle, 0 for a length or a ratio, None for any of the
        three.
    """

    angle_unit: str = 'rad'
    constants: Mapping[str, float] = field(default_factory=dict)
    variables: tuple[str, ...] = ()
    refused: Mapping[str, expression_syntax.NameRefusal] = field(default_factory=dict)
    quantity: int | None = None

    @property
    def known(self) -> tuple[str, ...]:
        """Return the names that an expression may use, without functions."""
        pi = ('pi',) if self.angle_unit == 'rad' else ()
        return (*pi, *self.constants, *self.variables)

    def why_not(self, name: str) -> expression_syntax.NameRefusal | None:
        """Return the reason why an expression may not use a name; None if the name is allowed."""
        if name in self.known or name == 'pi':
            return None  # here `pi` is allowed; in a file with degrees, `_value` refuses it
        hint = did_you_mean(self._suggestion(name))
        if not hint and self.variables and JOINT.fullmatch(name):
            hint = '; add a joint of that name to joints, or take a known one'
        elif not hint and not self.constants and self.quantity is not None:
            hint = (
                f': name it under constants, as in {{{name}: 0.3}}, or {{{name}: }} for a letter'
            )
        message = (
            f'unknown name {expression_syntax.short(name)!r}{hint} (known: {_listed(self.known)})'
        )
        return self.refused.get(name) or expression_syntax.NameRefusal(message, 'unknown-name')

    def _suggestion(self, name: str) -> str | None:
        # Return a suggestion for an unknown name: pi/2 for `pi2`, sin(q1) for `sinq1`, the joint
        # variable with the same number, or a known name with other letter case.
        if (part := PART_OF_PI.fullmatch(name)) and self.angle_unit == 'rad':
            return f'pi/{part[1]}'
        for function in expression_syntax.ARGUMENTS_OF:
            if name.removeprefix(function) in self.known and name.startswith(function):
                return f'{function}({name.removeprefix(function)})'
        if joint := JOINT.fullmatch(name):
            same = [known for known in self.variables if END.sub('', known) + joint[1] == known]
            if len(same) == 1:
                return same[0]
        cases = {known.lower().replace('_', ''): known for known in self.known}
        return cases.get(name.lower().replace('_', '')) or meant_by(name, self.known)


def _listed(names: Sequence[str]) -> str:
    more = [f'and {len(names) - MAX_LISTED} more'] if len(names) > MAX_LISTED else []
    return ', '.join([*map(expression_syntax.short, names[:MAX_LISTED]), *more]) or 'none'


class _NotLinearError(ExpressionError):
    code = 'not-linear'


def parse_affine(text: str, scope: Scope) -> Affine:
    """
    Return the value of an expression that is linear in the joint variables, in the file's units.

    Raises
    ------
    ExpressionError
        The expression has wrong syntax, has an unknown name, is not linear in the joint variables,
        or is not finite. The message has the reason.
    """
    value = _value(text, scope, must_be_linear=True)
    assert value is not None  # `_value` returns None only for nonlinear expressions
    return value


def check_function(text: str, scope: Scope) -> None:
    """
    Raise an error if an expression, such as a singular factor, has wrong syntax or names.

    Raises
    ------
    ExpressionError
        The expression has wrong syntax, an unknown name, or a constant part that is not finite.
        The message has the reason.
    """
    _value(text, scope, must_be_linear=False)


def _value(text: str, scope: Scope, must_be_linear: bool) -> Affine | None:
    # Most texts are one number. With a tree for each of these, reading a robot file takes 1.3 to
    # 1.8 times as long (ur5e, panda).
    number = expression_syntax.number_of(text)
    if number is not None:
        return _finite(Affine(number, ()), scope)
    tree = expression_syntax.syntax_tree(text, scope.why_not)
    if scope.angle_unit == 'deg' and 'pi' in expression_syntax.names_in(text):
        raise ExpressionError(_advice_on_pi(text, scope), code='pi-in-degrees')

    def worth(symbol: float | str, values: list[Affine | None]) -> Affine | None:
        operands = [value for value in values if value is not None]
        if len(operands) < len(values):
            if symbol == '/' and values[1] == Affine(0.0, ()):
                raise ExpressionError('division by zero', code='division-by-zero')
            return None
        try:
            return _finite(_combined(symbol, operands, scope), scope)
        except _NotLinearError:
            if must_be_linear:
                raise
            return None

    return expression_syntax.evaluated(tree, worth)


def _advice_on_pi(text: str, scope: Scope) -> str:
    # Return a message about `pi` in a file with degrees. In such a file, pi as an angle is 180,
    # but pi as a number is 3.14. If the expression is only a sum of multiples of pi and of joint
    # variables, such as `q1 - pi/2`, pi must be an angle. Then the message has the corrected
    # expression.
    undecided = (
        "'pi' is not accepted in a file with 'angle: deg': an angle of pi is 180 here, the number "
        f'is {math.pi!r}'
    )
    try:
        named = replace(scope, angle_unit='rad', variables=(*scope.variables, 'pi'))
        value = parse_affine(text, named)
    except ExpressionError:
        return undecided
    factors = dict(value.coefficients)
    whole, others = 180.0 * factors.pop('pi', 0.0), bool(factors)
    if scope.quantity == 0 or value.constant or not whole or len(text) > MAX_ADVISED_LENGTH:
        return undecided
    shown, number, instead = 'pi', '180', re.sub(r'\bpi\b', '180', text).strip()
    if not others and math.isclose(float(f'{whole:.6g}'), whole, rel_tol=1e-14):
        shown, number, instead = text.strip(), f'{whole:.6g}', f'{whole:.6g}'
    where = 'here' if others or scope.quantity else 'here, if it is an angle'
    return f"{shown} is {number} {where}: write {instead} (the file has 'angle: deg')"


def _combined(symbol: float | str, operands: list[Affine], scope: Scope) -> Affine:
    if isinstance(symbol, float):
        return Affine(symbol, ())
    if symbol in expression_syntax.ARGUMENTS_OF:
        return _called(symbol, operands, scope.angle_unit == 'deg')
    if operands:
        return OPERATIONS[symbol](*operands)
    if symbol in scope.variables:
        return Affine(0.0, ((symbol, 1.0),))
    return Affine(math.pi if symbol == 'pi' else scope.constants[symbol], ())


def _scaled(value: Affine, factor: float) -> Affine:
    return Affine(value.constant * factor, tuple((n, c * factor) for n, c in value.coefficients))


def _sum(left: Affine, right: Affine) -> Affine:
    coefficients = dict(left.coefficients)
    for name, coefficient in right.coefficients:
        coefficients[name] = coefficients.get(name, 0.0) + coefficient
    return Affine(left.constant + right.constant, tuple(coefficients.items()))


def _product(left: Affine, right: Affine) -> Affine:
    if left.coefficients and right.coefficients:
        raise _not_linear(f'{_names(left)} is multiplied by {_names(right)}')
    return _scaled(right, left.constant) if right.coefficients else _scaled(left, right.constant)


def _quotient(left: Affine, right: Affine) -> Affine:
    if right.coefficients:
        raise _not_linear(f'division by {_names(right)}')
    if right.constant == 0.0:
        raise ExpressionError('division by zero', code='division-by-zero')
    divisor = right.constant
    # Divide each coefficient by the divisor. A product with the reciprocal of the divisor would be
    # rounded twice.
    coefficients = tuple((name, value / divisor) for name, value in left.coefficients)
    return Affine(left.constant / divisor, coefficients)


def _called(name: str, operands: list[Affine], degrees: bool) -> Affine:
    for operand in operands:
        if operand.coefficients:
            raise _not_linear(f'{_names(operand)} is inside {name}()')
    arguments = [operand.constant for operand in operands]
    if name == 'sqrt' and arguments[0] < 0.0:
        message = f'square root of a negative number, {arguments[0]:g}'
        raise ExpressionError(message, code='out-of-range')
    if degrees and name in ('sin', 'cos'):
        arguments = [math.radians(arguments[0])]
    value: float = getattr(math, name)(*arguments)
    return Affine(math.degrees(value) if degrees and name == 'atan2' else value, ())


OPERATIONS: dict[str, Callable[..., Affine]] = {
    '+': _sum,
    '-': lambda left, right: _sum(left, _scaled(right, -1.0)),
    '*': _product,
    '/': _quotient,
    'neg': lambda value: _scaled(value, -1.0),
}


def _not_linear(reason: str) -> _NotLinearError:
    accepted = 'accepted: sums such as 2*q1 - q2'
    return _NotLinearError(f'not linear in the joint variables: {reason} ({accepted})')


def _names(value: Affine) -> str:
    return ' and '.join(name for name, _ in value.coefficients)


def _finite(value: Affine, scope: Scope) -> Affine:
    if not all(map(math.isfinite, (value.constant, *(c for _, c in value.coefficients)))):
        raise ExpressionError('the result is too large: not a finite number', code='not-finite')
    order = {name: index for index, name in enumerate(scope.variables)}
    kept = ((name, c) for name, c in value.coefficients if c != 0.0)
    # Add 0.0 to the constant, so that -0.0 becomes 0.0.
    return Affine(value.constant + 0.0, tuple(sorted(kept, key=lambda pair: order[pair[0]])))
