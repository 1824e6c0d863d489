# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the steps of a recording as C."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .recording import Recorded, Steps, never_negative_zero
from .translation import ATOM, PRODUCT, Text, literal, operation


def array(name: str, count: int) -> Any:
    """Return an array of recorded numbers, which a program gives to the recorded function."""
    return np.array([Recorded(f'{name}[{k}]') for k in range(count)], object)


def sincos(x: Any) -> tuple[Recorded, Recorded]:
    """Return the sine and the cosine of x as recorded numbers; the cosine is never 0."""
    angle = Recorded('angle', x)
    sine = Recorded('s', angle, no_negative_zero=never_negative_zero(x))
    return sine, Recorded('c', angle, no_negative_zero=True)


def partial(kind: int, number: float, a: Any, b: Any) -> tuple[Recorded, ...]:
    """Return a quotient, root or arc tangent and its derivatives as recorded numbers."""
    return tuple(Recorded(f'partial.{kind}.{k}', number, a, b) for k in range(3))


def lines_of(results: Mapping[str, Any], prefix: str, real: str) -> list[str]:
    """
    Return the lines of a function that stores the results of a recording.

    Parameters
    ----------
    results
        For each place in an array that the function writes, a recorded number or a constant.
    prefix
        Text before the names of functions.
    real
        The type of the numbers, `double` or `float`.
    """
    found, suffix = Steps(results), 'F' * (real == 'float')
    texts, late = list[Text](), list[bool]()  # late: the step follows from a sine
    constants, angles = dict[str, str](), list[str]()
    lines: dict[bool, list[str]] = {False: [], True: []}
    count = 0
    for k, (name, operands) in enumerate(found.steps):
        parts = [texts[one] for one in operands]
        after = any(late[one] for one in operands)
        if name == 'angle' and after:  # the sine of an expression with a sine
            line = f'{real} s{k}, c{k};'
            call = f'{prefix}sines_and_cosines(&angle{k}, 1, &s{k}, &c{k});'
            lines[True] += [f'const {real} angle{k} = {parts[0].text};', line, call]
            text = Text(f'{k}')
        elif name == 'angle':
            text = Text(f'[{len(angles)}]')
            angles.append(parts[0].text)
        elif name in ('s', 'c'):
            text = Text(name + parts[0].text)
        elif name.startswith('partial'):
            _, kind, component = name.split('.')
            call = f'{prefix}partial({", ".join([kind, *(one.text for one in parts)])})'
            text = Text(f'({real}){call}.at[{component}]')
        elif 'x' in name:
            written = literal(float.fromhex(name)) + suffix
            if 'x' in written:
                written = constants.setdefault(written, f'k{len(constants)}')
            text = Text(written, level=PRODUCT if written[0] == '-' else ATOM)
        elif not parts:
            text = Text(name)
        elif len(parts) == 1:
            text = Text(f'-{parts[0].at(ATOM)}', level=PRODUCT)
        else:
            text = operation(parts[0], name, parts[1])
        if name in '+-*/' and found.uses[k] > 1:
            lines[after].append(f'const {real} t{count} = {text.text};')
            text, count = Text(f't{count}'), count + 1
        texts.append(text)
        late.append(after or name in ('s', 'c'))
    head = [f'const {real} {name} = {value};' for value, name in constants.items()]
    head += lines[False]
    if angles:
        head.append(f'const {real} angle[{len(angles)}] = {{{", ".join(angles)}}};')
        head.append(f'{real} s[{len(angles)}], c[{len(angles)}];')
        head.append(f'{prefix}sines_and_cosines(angle, {len(angles)}, s, c);')
    stores = [f'{name} = {texts[k].text};' for name, k in found.results.items()]
    return [*head, *lines[True], *stores]
