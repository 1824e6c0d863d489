# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate sympy expressions at many configurations at once; equal subexpressions are evaluated once.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, reduce

import numpy as np
import numpy.typing as npt
import sympy as sp

Floats = npt.NDArray[np.float64]

DEGREE = np.pi / 180.0


class Evaluation:
    """
    Evaluates expressions at N configurations from the values of their symbols, and caches the
    results.

    Parameters
    ----------
    values
        N values of each symbol, one for each configuration.
    poses
        The number N of configurations.
    degrees
        Whether sin, cos and tan take degrees and the inverse functions return degrees.
    """

    def __init__(
        self, values: Mapping[sp.Symbol, Floats], poses: int, degrees: bool = False
    ) -> None:
        self.poses = poses
        self.values = values
        self.degrees = degrees
        self._known: dict[sp.Expr, Floats] = dict(values)

    def of(self, expression: sp.Expr) -> Floats:
        """
        Return the expression's values at the N configurations; undefined values are NaN or
        infinite.
        """
        with np.errstate(all='ignore'):
            return self._of(expression)

    def of_matrix(self, matrix: sp.Matrix) -> Floats:
        """Return the values of a matrix of expressions, shape (N, rows, columns)."""
        numbers, others = _entries(matrix)
        with np.errstate(all='ignore'):
            values = [(k, self._of(entry)) for k, entry in others]
        result = np.empty(
            (self.poses, len(numbers)), np.result_type(float, *(v for _, v in values))
        )
        result[:] = numbers
        for k, value in values:
            result[:, k] = value
        return result.reshape(self.poses, matrix.rows, matrix.cols)

    def with_part(self, expression: sp.Expr, path: Sequence[int], part: sp.Expr) -> Floats:
        """
        Replace one subexpression of an expression, and return the values of the new expression at
        the N configurations.

        `path` holds the argument indices that lead to the subexpression, and `part` replaces it.
        The method does not build the new expression in sympy: with building, it would take five
        times as long.
        """
        with np.errstate(all='ignore'):
            if not path:
                return self._of(part)
            values = [self._of(argument) for argument in expression.args]
            k, *tail = path
            values[k] = self.with_part(expression.args[k], tail, part)
            return self._applied(expression, values)

    def _of(self, e: sp.Expr) -> Floats:
        if e not in self._known:
            if e.is_number and not e.args:
                self._known[e] = np.full(self.poses, _number(e))
            else:
                self._known[e] = self._applied(e, [self._of(part) for part in e.args])
        return self._known[e]

    def _applied(self, e: sp.Expr, arguments: list[Floats]) -> Floats:
        # Apply the outermost function of e to the values of its arguments.
        if e.is_Add or e.is_Mul:
            return reduce(np.add if e.is_Add else np.multiply, arguments)
        if e.is_Pow:
            return np.asarray(np.power(*arguments))
        name = type(e).__name__
        if self.degrees and name in ('sin', 'cos', 'tan'):
            arguments = [arguments[0] * DEGREE]
        # Return NaN for a function that is not in FUNCTIONS. Formulas do not contain it, but sympy
        # introduces it if a value is not real, for example sinh for the sine of an imaginary
        # number.
        if name not in FUNCTIONS:
            return np.full_like(arguments[0], np.nan)
        result = FUNCTIONS[name](*arguments)
        return result / DEGREE if self.degrees and name.startswith('a') else result


@lru_cache(maxsize=4096)
def _entries(matrix: sp.Matrix) -> tuple[Floats, tuple[tuple[int, sp.Expr], ...]]:
    # Return an array with the numeric entries of a matrix, and 0 for the entries that are
    # expressions. Return also the expressions with their indices. The function is cached, because
    # sympy takes long to list the entries of a matrix.
    entries = matrix.flat()
    plain = [e.is_number and not e.args for e in entries]
    numbers = [_number(e) if is_plain else 0.0 for e, is_plain in zip(entries, plain)]
    return np.array(numbers), tuple((k, e) for k, e in enumerate(entries) if not plain[k])


def _number(e: sp.Expr) -> float:
    return float(e) if e.is_finite and e.is_real else np.nan


FUNCTIONS: dict[str, Callable[..., Floats]] = {
    'sin': np.sin,
    'cos': np.cos,
    'tan': np.tan,
    'cot': lambda x: 1.0 / np.tan(x),
    'asin': np.arcsin,
    'acos': np.arccos,
    'atan': np.arctan,
    'acot': lambda x: np.arctan(1.0 / x),
    'atan2': np.arctan2,
    'Abs': np.abs,
    'exp': np.exp,
    'arg': lambda x: np.where(x < 0, np.pi, 0.0),
    'conjugate': lambda x: x,
    're': lambda x: x,
    'im': lambda x: 0.0 * x,
    'sign': np.sign,
}


@lru_cache(maxsize=65536)
def size_of(expression: sp.Expr) -> int:
    """Return the number of nodes of an expression tree; a part that occurs twice counts twice."""
    return 1 + sum(map(size_of, expression.args))
