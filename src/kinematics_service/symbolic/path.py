"""Velocity of the tool along a path q(t), and when the path crosses the singular set."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from ..errors import DerivationError
from ..kernel import Floats
from ..robot.file.expression_syntax import names_in
from .algebra.expression import exact
from .derivation import Derivation

TIME = sympy.Symbol('t', real=True)
SAMPLES = 4001
BISECTIONS = 80


@dataclass(frozen=True)
class PathCrossing:
    """A time at which a factor vanishes."""

    time: float
    name: str
    touches: bool


@dataclass(frozen=True, eq=False)
class Path:
    """
    A derivation along a path.

    Attributes
    ----------
    q, qdot
        By t, rad and the file's length unit, per second.
    p, v, omega
        Position and velocities of the tool by t, base axes.
    """

    derivation: Derivation
    q: Any
    qdot: Any
    p: Any
    v: Any
    omega: Any

    def sampled(self, expression: Any, times: Floats) -> Floats:
        """Return the values of an expression of t, with the lengths of the file."""
        numbers = expression.subs(dict(self.derivation.names.values))
        function = sympy.lambdify(TIME, numbers, 'numpy')
        return np.broadcast_to(function(times), times.shape).astype(float)

    def crossings(self, start: float, end: float) -> tuple[PathCrossing, ...]:
        """
        Return when the path meets the singular set in [start, end], s.

        A factor that changes its sign is followed by halving; one that only touches zero is found
        at the smallest of its samples and marked.
        """
        found = []
        along = dict(zip(self.derivation.variables, self.q))
        times = np.linspace(start, end, SAMPLES)
        for factor in self.derivation.singular_set.factors:
            value = factor.expression.subs(along)
            f = self.sampled(value, times)
            size = float(np.max(np.abs(f))) or 1.0
            for k in np.flatnonzero(np.sign(f[:-1]) * np.sign(f[1:]) < 0):
                time = self._bisected(value, float(times[k]), float(times[k + 1]))
                found.append(PathCrossing(time, factor.name, False))
            found += [
                PathCrossing(float(times[k]), factor.name, False) for k in np.flatnonzero(f == 0.0)
            ]
            low = np.abs(f)
            valleys = np.flatnonzero((low[1:-1] < low[:-2]) & (low[1:-1] < low[2:])) + 1
            for k in valleys:
                same = f[k - 1] * f[k] > 0 and f[k] * f[k + 1] > 0
                if same and low[k] < 1e-5 * size:
                    found.append(PathCrossing(float(times[k]), factor.name, True))
        return tuple(sorted(found, key=lambda crossing: crossing.time))

    def _bisected(self, value: Any, low: float, high: float) -> float:
        at_low = float(self.sampled(value, np.array([low]))[0])
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            at_middle = float(self.sampled(value, np.array([middle]))[0])
            if at_low * at_middle <= 0:
                high = middle
            else:
                low, at_low = middle, at_middle
            if high - low < 1e-15 * max(1.0, abs(high)):
                break
        return (low + high) / 2


def parse_path(text: str, derivation: Derivation) -> dict[Any, Any]:
    """
    Return q(t) of a text such as `theta1=sin(t), theta2=cos(2*t), d3=sin(3*t)`.

    Raises
    ------
    DerivationError
        A joint is missing, unknown, given twice, or its expression has other names than t.
    ExpressionError
        An expression cannot be read.
    """
    variables = {symbol.name: symbol for symbol in derivation.variables}
    known = ', '.join(variables)
    found: dict[Any, Any] = {}
    for part in re.split(r',(?![^()]*\))', text):
        name, equals, expression = part.partition('=')
        name = name.strip()
        if not equals or name not in variables:
            raise DerivationError(
                f'{part.strip()!r} is not JOINT=EXPRESSION with a joint variable ({known})'
            )
        if variables[name] in found:
            raise DerivationError(f'{name} is given twice')
        strange = names_in(expression) - {'t', 'pi'} - set(derivation.names.meanings)
        if strange:
            raise DerivationError(f'{name}: unknown name {min(strange)!r} (known: t, pi, lengths)')
        meanings: Mapping[str, Any] = {**derivation.names.meanings, 't': TIME}
        found[variables[name]] = exact(expression, meanings)
    missing = [name for name, symbol in variables.items() if symbol not in found]
    if missing:
        raise DerivationError(f'no path for {", ".join(missing)}')
    return found


def along(derivation: Derivation, path: Mapping[Any, Any]) -> Path:
    """Return position and velocity of the tool along q(t)."""
    q = sympy.ImmutableMatrix([path[variable] for variable in derivation.variables])
    qdot = q.diff(TIME)
    values = dict(zip(derivation.variables, q))
    J = derivation.jacobian.subs(values)
    twist = J * qdot
    position = derivation.position.subs(values)
    return Path(derivation, q, qdot, position, twist[:3, :], twist[3:, :])
