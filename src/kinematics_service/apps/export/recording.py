# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Record the operations of a function by calling it with numbers that store how they were computed.

The result is a list of steps without loops and branches. Equal steps are one step, and steps that
no result needs are left out. All other changes keep the bits of finite numbers, too: operations on
constants are computed, x * 1 and x - 0 are x, x * -1 is -x, and x + 0 * y is x if x is not -0.0.
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
    no_negative_zero
        Whether the number is never -0.0. A sum is -0.0 only if both operands are.
    """

    __array_ufunc__ = None  # numpy's numbers then leave operations to this class
    __slots__ = ('no_negative_zero', 'operands', 'operation')

    def __init__(self, operation: str, *operands: Any, no_negative_zero: bool = False) -> None:
        self.operation, self.operands = operation, operands
        self.no_negative_zero = no_negative_zero

    def __bool__(self) -> bool:
        raise TypeError('the function branches on a recorded number; translate it instead')

    def __eq__(self, other: object) -> bool:
        raise TypeError('the function compares a recorded number; translate it instead')

    __hash__ = object.__hash__


def never_negative_zero(value: Any) -> bool:
    """Return whether a recorded number or a constant is never -0.0."""
    if isinstance(value, Recorded):
        return value.no_negative_zero
    return float(value).hex() != '-0x0.0p+0'


def _is_zero(value: Any) -> bool:
    # Returns whether a value is 0.0, -0.0, or the product of one of these and a finite number.
    if isinstance(value, Recorded):
        return value.operation == '*' and any(map(_is_zero, value.operands))
    return bool(value == 0.0)


def _sum(a: Any, b: Any) -> Any:
    for one, other in ((a, b), (b, a)):
        if _is_zero(other) and never_negative_zero(one):
            return one
    safe = never_negative_zero(a) or never_negative_zero(b)
    return Recorded('+', a, b, no_negative_zero=safe)


def _difference(a: Any, b: Any) -> Any:
    if _is_zero(b) and (never_negative_zero(a) or _is_positive_zero(b)):
        return a
    return Recorded('-', a, b, no_negative_zero=never_negative_zero(a))


def _is_positive_zero(value: Any) -> bool:
    return not isinstance(value, Recorded) and value == 0.0 and never_negative_zero(value)


def _product(a: Any, b: Any) -> Any:
    for one, other in ((a, b), (b, a)):
        if not isinstance(one, Recorded) and abs(one) == 1.0:
            return other if one > 0.0 else Recorded('-', other)
    return Recorded('*', a, b)


_OPERATIONS = {
    'add': _sum,
    'sub': _difference,
    'mul': _product,
    'truediv': lambda a, b: Recorded('/', a, b),
    'neg': lambda a: Recorded('-', a),
    'abs': lambda a: Recorded('fabs', a),
}
for _name, _operation in _OPERATIONS.items():
    setattr(Recorded, f'__{_name}__', _operation)
    setattr(Recorded, f'__r{_name}__', lambda a, b, by=_operation: by(b, a))


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
            known = not isinstance(one, Recorded) or one in self._index
            missing = [] if known else [k for k in one.operands if self._place(k) is None]
            waiting += reversed(missing)
            if not missing:
                waiting.pop()
            if not known and not missing:
                operands = tuple(self._place(k) for k in one.operands)
                self._index[one] = self._once(one.operation, operands)
        return int(self._place(value))

    def _place(self, value: Any) -> Any:
        # Returns the index of the step of a value, or None if it has none yet.
        if isinstance(value, Recorded):
            return self._index.get(value)
        return self._once(float(value).hex(), ())

    def _once(self, *step: Any) -> int:
        if step not in self._found:
            self._found[step] = len(self.steps)
            self.steps.append(step)
        return self._found[step]
