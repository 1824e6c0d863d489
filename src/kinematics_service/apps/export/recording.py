# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Record the operations of a function by calling it with numbers that store how they were computed.

The result is a list of steps without loops and branches. Equal steps are one step, and steps that
no result needs are left out. All other changes keep the bits, too: x * 1 and x - 0 are x, x * -1
is -x, and operations on constants are computed.
"""

from collections.abc import Mapping
from typing import Any


class Recorded:
    """
    A number that an operation computes from other numbers.

    Attributes
    ----------
    operation
        An operator, the name of a function, or the name of the number, such as q[0].
    operands
        The numbers that the operation takes.
    """

    __array_ufunc__ = None  # numpy's numbers then leave operations to this class
    __slots__ = ('operands', 'operation')

    def __init__(self, operation: str, *operands: Any) -> None:
        self.operation, self.operands = operation, operands

    def __add__(self, other: Any) -> Any:
        return _combined('+', self, other)

    def __radd__(self, other: Any) -> Any:
        return _combined('+', other, self)

    def __sub__(self, other: Any) -> Any:
        return _combined('-', self, other)

    def __rsub__(self, other: Any) -> Any:
        return _combined('-', other, self)

    def __mul__(self, other: Any) -> Any:
        return _combined('*', self, other)

    def __rmul__(self, other: Any) -> Any:
        return _combined('*', other, self)

    def __truediv__(self, other: Any) -> Any:
        return _combined('/', self, other)

    def __neg__(self) -> 'Recorded':
        return Recorded('-', self)

    def __abs__(self) -> 'Recorded':
        return Recorded('fabs', self)

    def __bool__(self) -> bool:
        raise TypeError('the function branches on a recorded number; translate it instead')

    def __eq__(self, other: object) -> bool:
        raise TypeError('the function compares a recorded number; translate it instead')

    __hash__ = object.__hash__


def _combined(operation: str, a: Any, b: Any) -> Any:
    constants = [float(one) for one in (a, b) if not isinstance(one, Recorded)]
    if operation == '*' and constants == [1.0]:
        return a if isinstance(a, Recorded) else b
    if operation == '*' and constants == [-1.0]:
        return -(a if isinstance(a, Recorded) else b)
    if operation == '-' and not isinstance(b, Recorded) and is_positive_zero(b):
        return a
    return Recorded(operation, a, b)


def is_positive_zero(number: float) -> bool:
    """Return whether a number is 0.0, not -0.0."""
    return float(number).hex() == '0x0.0p+0'


class Steps:
    """
    The steps that compute the results of a recording, each step once, in an order that works.

    Attributes
    ----------
    steps
        Operation and operands of each step. An operand is the index of an earlier step. The
        operation of a constant is its text by float.hex.
    results
        For each result, the index of its step.
    uses
        How many steps and results need each step.
    """

    def __init__(self, results: Mapping[str, Any]) -> None:
        self.steps: list[tuple[str, tuple[int, ...]]] = []
        self._found: dict[tuple[str, tuple[int, ...]], int] = {}
        self._index: dict[Recorded, int] = {}
        self.results = {name: self._add(value) for name, value in results.items()}
        self.uses = [0] * len(self.steps)
        needed = [one for _, operands in self.steps for one in operands]
        for k in [*needed, *self.results.values()]:
            self.uses[k] += 1

    def _add(self, value: Any) -> int:
        # Use a stack instead of a recursion, because recordings are deep.
        waiting = [value]
        while waiting:
            one = waiting[-1]
            if not isinstance(one, Recorded) or one in self._index:
                waiting.pop()
                continue
            missing = [
                other
                for other in reversed(one.operands)
                if isinstance(other, Recorded) and other not in self._index
            ]
            waiting += missing
            if not missing:
                operands = tuple(map(self._place, one.operands))
                self._index[one] = self._once(one.operation, operands)
        return self._place(value)

    def _place(self, value: Any) -> int:
        if isinstance(value, Recorded):
            return self._index[value]
        return self._once(float(value).hex(), ())

    def _once(self, operation: str, operands: tuple[int, ...]) -> int:
        key = operation, operands
        if key not in self._found:
            self._found[key] = len(self.steps)
            self.steps.append(key)
        return self._found[key]
