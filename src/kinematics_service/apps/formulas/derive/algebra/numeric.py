# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Evaluate polynomials and their derivatives, and find their zeros by Newton's method."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .....kernel import Floats, Integers
from .arithmetic import Arithmetic
from .laurent import Laurent, from_terms

Complexes = npt.NDArray[np.complex128]

STEPS = 60
# Newton's method ends if no step is longer than this (rad or unit of length), because shorter
# steps are round-off.
CONVERGED = 1e-12
BISECTIONS = 80


class DifferentiableFunction(Protocol):
    """A function of joint positions, shape (..., n), and its gradient."""

    def __call__(self, q: Floats) -> Floats:
        """Return the values at q, shape (...,)."""

    def gradient(self, q: Floats) -> Floats:
        """Return the derivatives of the function by each joint position at q, shape (..., n)."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """
    A real polynomial and its gradient as functions of joint positions.

    Joint positions are in rad and in the file's length unit, shape (..., n).
    """

    value: Laurent
    arithmetic: Arithmetic

    def __call__(self, q: Floats) -> Floats:
        """Return the value at q, shape (...,)."""
        c, turns, powers = self._sum
        terms: Complexes = c * np.exp(1j * (q @ turns))
        for k in np.flatnonzero(np.any(powers, axis=0)):
            terms = terms * q[..., k, None] ** powers[:, k]
        return np.asarray(np.sum(terms, axis=-1).real)

    def magnitude(self, largest: Floats) -> Floats:
        """Return an upper bound of |polynomial(q)| for all q with |q| <= largest, shape (...,)."""
        c, _, powers = self._sum
        sizes = np.broadcast_to(np.abs(c), (*largest.shape[:-1], len(powers)))
        for k in np.flatnonzero(np.any(powers, axis=0)):
            sizes = sizes * largest[..., k, None] ** powers[:, k]
        return np.asarray(np.sum(sizes, axis=-1))

    def gradient(self, q: Floats) -> Floats:
        """Return the derivatives of the polynomial by each joint variable at q, shape (..., n)."""
        return np.stack([first(q) for first in self.firsts], axis=-1)

    @property
    def moving(self) -> Floats:
        """Return whether the polynomial depends on each joint variable, booleans of shape (n,)."""
        return np.array([bool(first.value) for first in self.firsts])

    def in_reciprocal(self, joint: int) -> 'Numbers':
        """
        Return the polynomial as a function of t = 1 / d instead of the position d of a prismatic
        joint, multiplied by a power of t, so that it is a polynomial in t.
        """
        ring = self.value.ring
        index = ring.index('number', self.arithmetic.names.variables[joint])
        terms = self.value.terms()
        degree = max(e[index] for e in terms)
        turned = {(*e[:index], degree - e[index], *e[index + 1 :]): c for e, c in terms.items()}
        return Numbers(from_terms(ring, turned, self.value.divisor), self.arithmetic)

    def scaled_to(self, q: Floats) -> 'Numbers':
        """
        Return the polynomial scaled so that its root mean square at the configurations q is about
        1.
        """
        size = float(np.sqrt(np.mean(self(q) ** 2))) or 1.0
        factor, divisor = round(max(1.0, 1 / size)), round(max(1.0, size))
        if factor == divisor == 1:
            return self
        return Numbers(self.value.scaled(factor, divisor), self.arithmetic)

    @cached_property
    def _sum(self) -> tuple[Complexes, Floats, Integers]:
        # The polynomial is the sum of terms c exp(i (t_1 q_1 + ... + t_n q_n)) q_1^p_1 ...
        # q_n^p_n. Return the numbers c, t (`turns`) and p (`powers`) of all terms. The factor c
        # contains the values of the constants.
        value, arithmetic = self.value, self.arithmetic
        ring, variables, values = arithmetic.ring, arithmetic.names.variables, arithmetic.values
        terms = value.terms()
        exponents = np.array(list(terms), dtype=int).reshape(len(terms), len(ring.generators))
        c = np.array([complex(a, b) for a, b in terms.values()], dtype=complex) / value.divisor
        for k in np.flatnonzero(~np.isnan(values)):
            if np.any(exponents[:, k]):
                c = c * values[k] ** exponents[:, k]
        angles = [arithmetic.angle_index(v) for v in variables]
        units = np.array([arithmetic.units[v] for v in variables], dtype=float)
        turns = exponents[:, angles] / units
        c = c * np.exp(1j * (turns @ np.array([float(arithmetic.offsets[v]) for v in variables])))
        lengths = [ring.index('number', v) for v in variables]
        return c, turns.T, exponents[:, lengths]

    @cached_property
    def firsts(self) -> tuple['Numbers', ...]:
        """Return the derivatives of the polynomial by each joint variable, as polynomials."""
        variables, derivative = self.arithmetic.names.variables, self.arithmetic.derivative
        return tuple(replace(self, value=derivative(self.value, v)) for v in variables)


def poses_on(functions: Sequence[DifferentiableFunction], starts: Floats, scale: Floats) -> Floats:
    """
    Find configurations at which all functions are 0, by Newton's method with least-norm steps.

    Parameters
    ----------
    functions
        Functions that must vanish, at least one.
    starts : shape (N, n)
        Configurations at which Newton's method starts.
    scale : shape (n,)
        Scale of each joint, which makes metres and radians comparable; 0 for a joint that is held.
    """
    q = np.array(starts)
    for _ in range(STEPS):
        f, G = values_and_gradients(functions, q)
        step = smallest_step(f, G * scale, 1e-14)
        length = np.linalg.norm(step, axis=-1, keepdims=True)
        q = q + scale * step * np.minimum(1.0, 0.5 / np.maximum(length, 1e-300))
        if not np.any(length > CONVERGED):
            break
    f, _ = values_and_gradients(functions, q)
    return np.asarray(q[np.max(np.abs(f), axis=-1) < CONVERGED])


def values_and_gradients(
    functions: Sequence[DifferentiableFunction], q: Floats
) -> tuple[Floats, Floats]:
    """Return the values (N, m) of m functions at q (N, n), and their gradients (N, m, n)."""
    f = np.stack([function(q) for function in functions], axis=-1)
    return f, np.stack([function.gradient(q) for function in functions], axis=-2)


def smallest_step(f: Floats, G: Floats, damping: float | Floats) -> Floats:
    """
    Return the least-norm Newton step (N, n) for values f (N, m) and gradients G (N, m, n).

    Damping keeps the step finite if G lacks full rank, as at a double zero.
    """
    transposed = np.swapaxes(G, -1, -2)
    square = G @ transposed + damping * np.eye(G.shape[-2])
    return np.asarray(-(transposed @ np.linalg.solve(square, f[..., None]))[..., 0])


def bisected(value: Callable[[float], float], low: float, high: float) -> float:
    """
    Return the argument at which a function changes its sign between `low` and `high`, by
    bisection.
    """
    below = value(low)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        if below * value(middle) <= 0:
            high = middle
        else:
            low = middle
        if high - low < 1e-15 * max(1.0, abs(high)):
            break
    return (low + high) / 2
