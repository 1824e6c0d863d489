# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Record the operations of a Python function, and write them as C without loops and branches.

The function is called with `Number` objects instead of floats. Each operation on a `Number` adds a
step to a list. A step is one operation, written in C, such as `t1 * q[0]`. An operation that is
already in the list is not added again. Steps that no result needs are left out of the C code. A
step is also simplified if all finite results stay exactly equal: operations on constants are
computed, x * 1 and x - 0 are x, x * -1 is -x, and x + 0 * y is x if x is not -0.0.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .kernel_source import source
from .translation import Text, Translation, literal

STEP = re.compile(r'\bt\d+\b')  # matches the C variable of a step's result, such as t12
# A step is one recorded operation, written in C. If the result of a step is used only once, and
# the step is shorter than INNER_LENGTH characters, the step is written at the place of use and
# gets no variable.
INNER_LENGTH = 60


@dataclass(eq=False)
class Number:
    """
    A number of a recorded function: an input, a constant, or the result of an operation.

    Attributes
    ----------
    recording
        The recorder that stores the operations on the number.
    text
        The number in C: a constant, an input such as q[0], or the variable of a result such as t3.
    value
        The value of a constant; None if the number is not a constant.
    is_zero
        Whether the number is a constant zero, or a product with a constant zero as a factor. If
        all other factors are finite, the product is 0.0 or -0.0.
    no_negative_zero
        Whether the number is known never to be -0.0. A sum is -0.0 only if both operands are -0.0.
    after_sines
        Whether the number is computed from a sine or cosine.
    """

    recording: 'Recorder'
    text: str
    value: float | None = None
    is_zero: bool = False
    no_negative_zero: bool = False
    after_sines: bool = False
    __array_ufunc__ = None  # numpy's numbers then leave operations to this class

    def __bool__(self) -> bool:
        raise TypeError('the function branches on a recorded number; translate it instead')

    def __eq__(self, other: object) -> bool:
        raise TypeError('the function compares a recorded number; translate it instead')

    def __neg__(self) -> 'Number':
        return self.recording.step('-{}', self)

    def __abs__(self) -> 'Number':
        return self.recording.step('fabs({})', self)


def _sum(a: Number, b: Number) -> Number:
    for number, other in ((a, b), (b, a)):
        if other.is_zero and number.no_negative_zero:
            return number
    safe = a.no_negative_zero or b.no_negative_zero
    return a.recording.step('{} + {}', a, b, no_negative_zero=safe)


def _difference(a: Number, b: Number) -> Number:
    if b.is_zero and (a.no_negative_zero or b.value is not None and b.no_negative_zero):
        return a
    return a.recording.step('{} - {}', a, b, no_negative_zero=a.no_negative_zero)


def _product(a: Number, b: Number) -> Number:
    for number, other in ((a, b), (b, a)):
        if number.value == 1.0:
            return other
        if number.value == -1.0:
            return -other
    return a.recording.step('{} * {}', a, b, is_zero=a.is_zero or b.is_zero)


def _computed(operation: Callable[[Number, Number], Number], a: Any, b: Any) -> Any:
    # Returns the result of an operation on a and b. At least one of a and b is a `Number`; the
    # other may be a float. A constant result is returned as a float, so that Python computes the
    # next operation on it.
    recording = a.recording if isinstance(a, Number) else b.recording
    result = operation(recording.number(a), recording.number(b))
    return result if result.value is None else result.value


for _name, _operation in (('add', _sum), ('sub', _difference), ('mul', _product)):
    setattr(Number, f'__{_name}__', lambda a, b, by=_operation: _computed(by, a, b))
    setattr(Number, f'__r{_name}__', lambda b, a, by=_operation: _computed(by, a, b))


class Recorder:
    """
    A list of the steps of a function, in the order in which they were recorded.

    Parameters
    ----------
    translation
        The functions that the steps call.
    real
        The C type of the numbers, `double` or `float`.

    Attributes
    ----------
    steps
        The recorded steps. The key is the text of a step in C, and the value is the number that
        the step computes.
    angles
        The texts of angles whose sines and cosines are computed together.
    """

    def __init__(self, translation: Translation, real: str) -> None:
        self.translation, self.real = translation, real
        self.steps: dict[str, Number] = {}
        self.angles: list[str] = []
        # During a recording, the kernel calls the methods `sincos` and `partial` of this class
        # instead of these two functions. The methods record calls of the functions in C.
        self.functions = source('forward.chain_pass').sincos, source('measures.factors')._partial

    def array(self, name: str, count: int) -> Any:
        """Return inputs of the recorded function: an array of `Number` objects `name[0]` etc."""
        return np.array([Number(self, f'{name}[{k}]') for k in range(count)], object)

    def number(self, value: Any) -> Number:
        """Return a constant as a `Number`; if `value` is already a `Number`, return `value`."""
        if isinstance(value, Number):
            return value
        value = float(value)
        never = value != 0.0 or math.copysign(1.0, value) > 0.0
        return Number(self, literal(value, self.real), value, value == 0.0, never)

    def step(self, text: str, *operands: Number, **facts: bool) -> Number:
        """Record an operation, and return its result; `text` is in C, with {} for each operand."""
        text = text.format(*(operand.text for operand in operands))
        after_sines = any(operand.after_sines for operand in operands)
        new = Number(self, f't{len(self.steps)}', after_sines=after_sines, **facts)
        return self.steps.setdefault(text, new)

    def sincos(self, x: Any) -> tuple[Number, ...]:
        """Return the sine and the cosine of x; the cosine is never 0."""
        x = self.number(x)
        if x.after_sines:
            call = self.translation.call(self.functions[0], [Text('{}')])
            return tuple(self.step(f'({self.real}){call.text}.at[{k}]', x) for k in range(2))
        if x.text not in self.angles:
            self.angles.append(x.text)
        k = self.angles.index(x.text)
        sine = Number(self, f's[{k}]', no_negative_zero=x.no_negative_zero, after_sines=True)
        return sine, Number(self, f'c[{k}]', no_negative_zero=True, after_sines=True)

    def partial(self, kind: int, number: float, a: Any, b: Any) -> tuple[Number, ...]:
        """Return a quotient, root or arc tangent and its derivatives."""
        known = self.translation.call(self.functions[1], [kind, number, Text('{}'), Text('{}')])
        operands = self.number(a), self.number(b)
        return tuple(self.step(f'({self.real}){known.text}.at[{k}]', *operands) for k in range(3))

    def lines(self, outputs: Mapping[str, Any]) -> list[str]:
        """Return C lines that store numbers in arrays; `outputs` has the numbers by array name."""
        texts = {
            f'{name}[{k}]': self.number(number).text
            for name, numbers in outputs.items()
            for k, number in enumerate(numbers)
        }
        uses = Counter(STEP.findall(' '.join([*texts.values(), *self.angles])))
        for text, number in reversed(self.steps.items()):
            if uses[number.text]:
                uses.update(STEP.findall(text))
        inner: dict[str, str] = {}
        # lines[False] come before the line that computes all sines and cosines. lines[True] come
        # after it, because they use a sine or cosine.
        lines: dict[bool, list[str]] = {False: [], True: []}
        for text, number in self.steps.items():
            text = STEP.sub(lambda match: inner.get(match[0], match[0]), text)
            if uses[number.text] == 1 and len(text) < INNER_LENGTH:
                inner[number.text] = f'({text})'
            elif uses[number.text]:
                step = f'const {self.real} {number.text} = {text};'
                lines[number.after_sines].append(step)
        count = len(self.angles)
        if count:
            angles = ', '.join(inner.get(angle, angle) for angle in self.angles)
            lines[False] += [
                f'const {self.real} angle[{count}] = {{{angles}}};',
                f'{self.real} s[{count}], c[{count}];',
                f'{self.translation.prefix}sines_and_cosines(angle, {count}, s, c);',
            ]
        stores = [f'{place} = {inner.get(text, text)};' for place, text in texts.items()]
        return [*lines[False], *lines[True], *stores]
