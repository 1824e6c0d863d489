"""The values of expressions at many poses at once: a walk over their trees, without any eval."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

DEGREE = np.pi / 180.0


class Evaluation:
    """
    The values of symbols at N poses, and of every expression that was asked for.

    Parameters
    ----------
    values
        For each symbol N numbers.
    poses
        N.
    degrees
        Whether angles are in degrees: arguments of sin, cos, tan, and what the inverses return.
    """

    def __init__(self, values: Mapping[Any, Floats], poses: int, degrees: bool = False) -> None:
        self.poses = poses
        self.values = values
        self.degrees = degrees
        self._known: dict[Any, Floats] = dict(values)

    def of(self, expression: Any) -> Floats:
        """Return N numbers, NaN or infinite where the expression has no value."""
        with np.errstate(all='ignore'):
            return self._of(expression)

    def of_matrix(self, matrix: Any) -> Floats:
        """Return the values of a matrix, shape (N, rows, columns)."""
        with np.errstate(all='ignore'):
            entries = [self._of(entry) for entry in _entries(matrix)]
        result = np.empty((self.poses, len(entries)), np.result_type(*entries))
        for k, entry in enumerate(entries):
            result[:, k] = entry
        return result.reshape(self.poses, matrix.rows, matrix.cols)

    def _of(self, expression: Any) -> Floats:
        found = self._known.get(expression)
        if found is None:
            found = self._computed(expression)
            self._known[expression] = found
        return found

    def _computed(self, e: Any) -> Floats:
        if e.is_Add or e.is_Mul:
            total = self._of(e.args[0])
            for part in e.args[1:]:
                value = self._of(part)
                total = total + value if e.is_Add else total * value
            return total
        if e.is_number and not e.args:
            return np.full(self.poses, float(e) if e.is_finite and e.is_real else np.nan)
        arguments = [self._of(part) for part in e.args]
        if e.is_Pow:
            result: Floats = np.power(arguments[0], arguments[1])
            return result
        name = type(e).__name__
        if self.degrees and name in ('sin', 'cos', 'tan'):
            arguments = [arguments[0] * DEGREE]
        result = FUNCTIONS.get(name, _nowhere)(*arguments)
        return result / DEGREE if self.degrees and name.startswith('a') else result


@lru_cache(maxsize=4096)
def _entries(matrix: Any) -> tuple[Any, ...]:
    # Sympy takes longer to list them than they take to be computed.
    return tuple(matrix.flat())


def _nowhere(first: Floats, *_: Floats) -> Floats:
    # Of what sympy alone brings in, where a number may not be real.
    return np.full_like(first, np.nan)


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


def size_of(expression: Any) -> int:
    """Return the number of nodes of an expression as a tree, shared parts counted each time."""
    known: dict[Any, int] = {}

    def count(e: Any) -> int:
        if e not in known:
            known[e] = 1 + sum(count(part) for part in e.args)
        return known[e]

    return count(expression)
