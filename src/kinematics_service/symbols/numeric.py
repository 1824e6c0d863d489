"""
Polynomials in numbers, and poses on their zeros.

"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernel import Floats
from .frames import Arithmetic
from .laurent import Laurent

STEPS = 60
CONVERGED = 1e-12


def values_of(arithmetic: Arithmetic) -> Any:
    """
    Return the number of each generator that no joint moves (nan elsewhere), complex.

    """
    ring, names = arithmetic.ring, arithmetic.names
    moving = set(names.variables)
    values = np.full(len(ring.generators), np.nan, dtype=complex)
    for k, generator in enumerate(ring.generators):
        if generator.meaning in moving:
            continue
        number = float(generator.meaning.subs(dict(names.values)))
        values[k] = np.exp(1j * number) if generator.kind == 'fixed_angle' else number
    return values


@dataclass(frozen=True)
class Numbers:
    """
    A real polynomial and its gradient as functions of joint positions.

    Joint positions are in rad and in the file's length unit, shape (..., n).

    """

    value: Laurent
    arithmetic: Arithmetic

    def __call__(self, q: Floats) -> Floats:
        """
        Return the value at q, shape (...,).

        """
        return _evaluated(self.value, self.arithmetic, np.asarray(q, dtype=float))

    def gradient(self, q: Floats) -> Floats:
        """
        Return the derivatives by each joint variable, shape (..., n).

        """
        q = np.asarray(q, dtype=float)
        columns = [
            _evaluated(self.arithmetic.derivative(self.value, variable), self.arithmetic, q)
            for variable in self.arithmetic.names.variables
        ]
        return np.stack(columns, axis=-1)


def _evaluated(value: Laurent, arithmetic: Arithmetic, q: Floats) -> Floats:
    ring, variables = arithmetic.ring, arithmetic.names.variables
    terms = value.terms()
    if not terms:
        return np.zeros(q.shape[:-1])
    exponents = np.array(list(terms))
    coefficients = np.array([complex(a, b) for a, b in terms.values()]) / value.divisor
    constants = values_of(arithmetic)
    used = np.any(exponents != 0, axis=0)
    total = np.broadcast_to(coefficients, (*q.shape[:-1], len(coefficients))).astype(complex)
    for k in np.flatnonzero(used):
        generator = ring.generators[int(k)]
        if generator.meaning in variables:
            x = q[..., variables.index(generator.meaning)]
            unit = arithmetic.units[generator.meaning]
            base = np.exp(1j * x / unit) if generator.kind == 'angle' else x.astype(complex)
        else:
            base = np.broadcast_to(constants[k], q.shape[:-1])
        total = total * base[..., None] ** exponents[:, k]
    return np.asarray(np.sum(total, axis=-1).real)


def poses_on(functions: Sequence[Numbers], starts: Floats, scale: Floats) -> Floats:
    """
    Return poses where every function is 0: Newton's smallest steps from each start, the converged.

    Parameters
    ----------
    functions
        What must vanish.
    starts : shape (N, n)
    scale : shape (n,)
        What counts as one unit of each joint, so that metres and radians compare.

    """
    q = np.array(starts)
    if not functions:
        return q
    for _ in range(STEPS):
        f, G = _stacked(functions, q, scale)
        # Two zeros that touch leave no full-rank gradient: damping keeps the step finite.
        square = G @ np.swapaxes(G, -1, -2) + 1e-14 * np.eye(len(functions))
        step = np.swapaxes(G, -1, -2) @ np.linalg.solve(square, f[..., None])
        length = np.linalg.norm(step[..., 0], axis=-1, keepdims=True)
        q = q - scale * step[..., 0] * np.minimum(1.0, 0.5 / np.maximum(length, 1e-300))
    f, _ = _stacked(functions, q, scale)
    return np.asarray(q[np.max(np.abs(f), axis=-1) < CONVERGED])


def _stacked(functions: Sequence[Numbers], q: Floats, scale: Floats) -> tuple[Floats, Floats]:
    f = np.stack([function(q) for function in functions], axis=-1)
    G = np.stack([function.gradient(q) * scale for function in functions], axis=-2)
    return f, G


def typical_size(function: Numbers, q: Floats) -> float:
    """
    Return the root of the mean square of a function over poses.

    """
    return float(np.sqrt(np.mean(function(q) ** 2))) or 1.0


def substituted(expression: Any, values: Mapping[Any, float]) -> float:
    """
    Return the number a sympy expression is worth.

    """
    return float(expression.subs(dict(values)).evalf())
