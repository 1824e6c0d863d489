# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write an arm as one C++ or C header."""

import textwrap
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...kernel import Chain
from ...kernel.layout import places
from ...robot.robot import Robot
from .kernel_source import copied, replaced, source
from .recording import Recorded, Steps
from .translation import ATOM, PRODUCT, SUM, Text, Translation, literal

WIDTH = 99  # columns of the header
LEVELS = {'+': SUM, '-': SUM, '*': PRODUCT, '/': PRODUCT}
# The sines of all joints are computed first, in loops without branches, which the compiler can
# vectorise.
SINES = """
{head}void {prefix}sines_and_cosines(const double *angle, int count, double *s, double *c)
{{
    int beyond = 0;
    for (int k = 0; k < count; ++k) {{
        beyond |= !({std}fabs(angle[k]) <= {largest});
    }}
    for (int k = 0; k < count; ++k) {{
        const {prefix}pair both =
            beyond ? {prefix}sincos(angle[k]) : {prefix}sincos_reduced(angle[k]);
        s[k] = both.at[0];
        c[k] = both.at[1];
    }}
}}
"""


class Language(NamedTuple):
    """What differs between C++ and C."""

    prefix: str
    std: str
    head: str


class Function(NamedTuple):
    """A function of the header: its name, its parameters, and its results."""

    name: str
    words: str
    parameters: str
    results: Mapping[str, Any]


def recorded_sincos(x: Any) -> tuple[Recorded, Recorded]:
    """Return the sine and the cosine of x as recorded numbers."""
    angle = Recorded('angle', x)
    return Recorded('s', angle), Recorded('c', angle)


def evaluated(chain: Chain, depth: int) -> Any:
    """Return a row of results of the kernel, as recorded numbers."""
    chain_pass, row = source('forward.chain_pass'), np.empty(chain.width, object)
    q, qdot = ([Recorded(f'{name}[{j}]') for j in range(chain.dof)] for name in ('q', 'qdot'))
    with replaced(
        chain_pass,
        sincos=recorded_sincos,
        _write_quaternion=lambda *_: None,
    ):
        chain_pass.evaluate_row(copied(chain), q, qdot, depth, row)
    return row


def body_of(results: Mapping[str, Any], prefix: str) -> list[str]:
    """Return the lines of a function that stores the results."""
    found = Steps(results)
    texts = list[Text]()
    constants, angles = dict[str, str](), list[str]()
    lines = list[str]()
    for k, (operation, operands) in enumerate(found.steps):
        parts = [texts[one] for one in operands]
        if operation == 'angle':
            angles.append(parts[0].text)
            text = Text(f'[{len(angles) - 1}]', 'double')
        elif operation in ('s', 'c'):
            text = Text(operation + parts[0].text, 'double')
        elif not parts:
            text = _leaf(operation, constants)
        elif len(parts) == 1:
            text = Text(f'-{parts[0].at(ATOM)}', 'double', PRODUCT)
        else:
            level = LEVELS[operation]
            line = f'{parts[0].at(level)} {operation} {parts[1].at(level + 1)}'
            text = Text(line, 'double', level)
        if operation in '+-*/' and found.uses[k] > 1:
            lines.append(f'const double t{len(lines)} = {text.text};')
            text = Text(f't{len(lines) - 1}', 'double')
        texts.append(text)
    stores = [f'{name} = {texts[k].text};' for name, k in found.results.items()]
    count = len(angles)
    head = [f'const double {name} = {value};' for value, name in constants.items()]
    if angles:
        head.append(f'const double angle[{count}] = {{{", ".join(angles)}}};')
        head.append(f'double s[{count}], c[{count}];')
        head.append(f'{prefix}sines_and_cosines(angle, {count}, s, c);')
    return [*head, *lines, *stores]


def _leaf(operation: str, constants: dict[str, str]) -> Text:
    if 'x' not in operation:
        return Text(operation, 'double')
    text = literal(float.fromhex(operation))
    if 'x' in text:
        text = constants.setdefault(text, f'k{len(constants)}')
    return Text(text, 'double', PRODUCT if text[0] == '-' else ATOM)


def header_of(robot: Robot, cpp: bool) -> str:
    """Return an arm as a header in C++, or else in C."""
    name = f'kinematics_{robot.name}'
    before = '' if cpp else f'{name}_'
    language = Language(f'{name}_detail_', '', 'static inline ')
    if cpp:
        language = Language('detail_', 'std::', 'inline ')
    n = robot.dof
    translation = Translation(*language, {})
    chain_pass = source('forward.chain_pass')
    translation.function(chain_pass.sincos)
    sines = SINES.format(**language._asdict(), largest=literal(places.LARGEST_REDUCED))
    row = evaluated(robot.chain, places.JACOBIAN)
    pose = {f'T[{k}]': row[places.POSE_AT + k] for k in range(12)}
    J = {f'J[{k}]': row[places.JACOBIAN_AT + k] for k in range(6 * n)}
    functions = [
        Function('pose', '', 'const double *q, double *T', pose),
        Function('jacobian', '', 'const double *q, double *T, double *J', pose | J),
    ]
    lines = ['#include <cmath>' if cpp else '#include <math.h>', '']
    if cpp:
        lines += [f'namespace {name} {{', f'inline constexpr int dof = {n};']
    else:
        lines.append(f'enum {{ {name}_dof = {n} }};')
    lines.append(f'typedef struct {{ double at[2]; }} {language.prefix}pair;')
    lines += [translation.text(), sines]
    for one in functions:
        lines += ['', f'{language.head}void {before}{one.name}({one.parameters})', '{']
        for line in body_of(one.results, language.prefix):
            lines += textwrap.wrap(
                line, WIDTH - 8, initial_indent='    ', subsequent_indent=8 * ' '
            )
        lines.append('}')
    if cpp:
        lines += ['', f'}}  // namespace {name}']
    return '\n'.join(lines) + '\n'
