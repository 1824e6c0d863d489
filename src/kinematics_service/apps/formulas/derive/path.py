# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive the tool's velocity along a path q(t), and find the times at which the path is singular. At
these times, a factor of the determinant changes its sign or has a minimum 0 of its absolute value.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy

from ....errors import DerivationError
from ....kernel import Floats
from ....robot.file.text.expression_syntax import names_in
from ....typography import plain_names
from .algebra.expression import exact
from .algebra.numeric import bisected
from .derivation import Derivation

TIME = sympy.Symbol('t', real=True)
SAMPLES = 4001
# Number of steps in the search for the time at which a factor's absolute value is smallest. Each
# step narrows the interval of time to a sixteenth.
NARROWING_STEPS = 9
# A value of a factor is 0 up to round-off if its ratio to the largest value on the path is below
# this.
ROUND_OFF = 1e-12

Values = Callable[[Floats], Floats]


@dataclass(frozen=True)
class PathCrossing:
    """
    A time (or an interval) at which a factor of the determinant is 0.

    Attributes
    ----------
    time, until
        The factor is 0 from `time` to `until`, s. The two times are equal if the factor is 0 for
        an instant only.
    touches
        Whether the factor has equal signs before `time` and after `until`. If so, the path touches
        the family of singular poses at which the factor is 0, but does not cross it.
    name
        The name of the factor.
    """

    time: float
    until: float
    touches: bool
    name: str


@dataclass(frozen=True, eq=False)
class Path:
    """
    The position and velocity of an arm's tool along a path q(t), exactly.

    Attributes
    ----------
    q, qdot
        Joint positions (rad or the file's length unit) and joint velocities (the same per second)
        as functions of t.
    p, v, omega
        Position, linear and angular velocity of the tool as functions of t, base axes.
    span : s
        Start and end of the time in which crossings with the singular set are searched.
    """

    derivation: Derivation
    q: sympy.Matrix
    qdot: sympy.Matrix
    p: sympy.Matrix
    v: sympy.Matrix
    omega: sympy.Matrix
    span: tuple[float, float]

    def sampled(self, expression: sympy.Expr, times: Floats) -> Floats:
        """Evaluate an expression of t at times (N,) with the link lengths of the robot file."""
        return self._function(expression)(times)

    def motion(self, times: Floats) -> tuple[Floats, Floats]:
        """Return q and qdot of all joints of the arm at times, shape (N, n), SI units."""
        sampler = self.derivation.exact.sampler
        q, qdot = (
            np.stack([self.sampled(e, times) for e in vector], axis=-1)
            for vector in (self.q, self.qdot)
        )
        rates = np.zeros((len(times), sampler.robot.dof))
        rates[:, list(sampler.moving)] = qdot * sampler.to_si
        return sampler.whole(q), rates

    def _function(self, expression: sympy.Expr) -> Values:
        numbers = expression.subs(dict(self.derivation.names.values))
        function = sympy.lambdify(TIME, numbers, 'numpy')
        return lambda times: np.broadcast_to(function(times), times.shape).astype(float)

    @cached_property
    def crossings(self) -> tuple[PathCrossing, ...]:
        """
        Return the times within `span` at which the path meets the singular set.

        If a factor of the determinant changes its sign between two samples, bisection finds the
        time. If the factor has equal signs at two samples, a search finds the minimum of |factor|
        between the samples. If the minimum is 0, the path touches the singular set. If the factor
        changes its sign during the search, the path crosses the singular set twice.
        """
        along = dict(zip(self.derivation.variables, self.q))
        times = np.linspace(*self.span, SAMPLES)
        crossings = []
        for factor in self.derivation.singular_set.factors:
            value = self._function(factor.expression.subs(along))
            crossings += [PathCrossing(*zero, factor.name) for zero in _zeros(value, times)]
        return tuple(sorted(crossings, key=lambda crossing: crossing.time))


def _zeros(value: Values, times: Floats) -> list[tuple[float, float, bool]]:
    # Return the time intervals in which the function `value` is 0. An interval is a tuple: start,
    # end, and whether the function has equal signs before the start and after the end. If the
    # function is 0 for an instant only, start and end are equal.
    def at(time: float) -> float:
        return float(value(np.array([time]))[0])

    f = value(times)
    size = float(np.max(np.abs(f))) or 1.0
    # If |f| has a local minimum at a sample, the nearby time at which |f| is smallest becomes
    # another sample.
    low = np.abs(f)
    valleys = np.flatnonzero((low[1:-1] <= low[:-2]) & (low[1:-1] < low[2:])) + 1
    alike = f[valleys - 1] * f[valleys + 1] > 0
    bottoms = [
        _bottom(value, times[k - 1], times[k + 1]) for k in valleys[alike & (f[valleys] != 0)]
    ]
    times = np.unique(np.concatenate([times, bottoms]))
    f = value(times)
    f = np.where(np.abs(f) < ROUND_OFF * size, 0.0, f)
    zeros = [
        (time, time, False)
        for k in np.flatnonzero(f[:-1] * f[1:] < 0)
        for time in [bisected(at, float(times[k]), float(times[k + 1]))]
    ]
    zero = np.concatenate([[False], f == 0.0, [False]])
    begins, ends = (np.flatnonzero(zero[:-1] < zero[1:]), np.flatnonzero(zero[:-1] > zero[1:]) - 1)
    for begin, last in zip(begins, ends):
        inside = begin > 0 and last < len(f) - 1
        touches = bool(inside and f[begin - 1] * f[last + 1] > 0)
        zeros.append((float(times[begin]), float(times[last]), touches))
    return zeros


def _bottom(value: Values, low: float, high: float) -> float:
    # Let f be the function `value`. Search the time between `low` and `high` at which |f| is
    # smallest. If the search meets a time at which f is 0, or at which the sign of f differs from
    # the sign at `low`, return this time at once.
    for _ in range(NARROWING_STEPS):
        times = np.linspace(low, high, 33)
        f = value(times)
        k = int(np.argmin(f * np.sign(f[0])))
        if f[k] * f[0] <= 0:
            return float(times[k])
        low, high = float(times[max(k - 1, 0)]), float(times[min(k + 1, 32)])
    return (low + high) / 2


def parse_path(text: str, derivation: Derivation) -> dict[sympy.Symbol, sympy.Expr]:
    """
    Return q(t) from a text such as `theta1=sin(t), theta2=cos(2*t), d3=sin(3*t)`.

    Raises
    ------
    DerivationError
        A joint is missing, unknown, given twice, or its expression has other names than t.
    ExpressionError
        An expression cannot be read.
    """
    names = derivation.names
    variables = {symbol.name: symbol for symbol in derivation.variables}
    known, example = ', '.join(variables), f'{next(iter(variables))}=sin(t)'
    path: dict[sympy.Symbol, sympy.Expr] = {}
    for part in re.split(r',(?![^()]*\))', plain_names(text)):
        name, equals, expression = part.partition('=')
        name = name.strip()
        if not equals:
            message = f'{part.strip()!r} is not JOINT=EXPRESSION; write for example {example}'
            raise DerivationError(message, code='syntax')
        if name not in variables:
            message = f'{name!r} is not a joint variable (known: {known})'
            raise DerivationError(message, code='unknown-name')
        if variables[name] in path:
            message = f'{name} is given twice; write one expression'
            raise DerivationError(message, code='duplicate-name')
        strange = names_in(expression) - {'t', 'pi'} - (set(names.meanings) - set(variables))
        if strange:
            message = f'{name}: unknown name {min(strange)!r} (known: t, pi, lengths)'
            raise DerivationError(message, code='unknown-name')
        path[variables[name]] = exact(expression, {**names.meanings, 't': TIME})
    missing = [name for name, symbol in variables.items() if symbol not in path]
    if missing:
        message = f'{", ".join(missing)}: no path is given; write {missing[0]}=f(t)'
        raise DerivationError(message, code='missing-key')
    return path


def along(derivation: Derivation, text: str, span: tuple[float, float] = (0.0, 6.3)) -> Path:
    """
    Return position and velocity of the tool along q(t).

    Parameters
    ----------
    text
        The path, as `parse_path` reads it.
    span
        See `Path`.
    """
    path = parse_path(text, derivation)
    q = sympy.ImmutableMatrix([path[variable] for variable in derivation.variables])
    qdot = q.diff(TIME)
    values = dict(zip(derivation.variables, q))
    twist = derivation.jacobian.subs(values) * qdot
    position = derivation.position.subs(values)
    return Path(derivation, q, qdot, position, twist[:3, :], twist[3:, :], span)
