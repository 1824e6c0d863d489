# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert expressions to a plain form: names as the file defines them, and no degree signs.

Code that uses an expression afterwards, such as the derivation of formulas, needs to know only the
plain form.
"""

import re
from collections.abc import Collection
from fractions import Fraction

from ....errors import ExpressionError
from ....typography import DEGREE, plain_names
from .expression_syntax import ARGUMENTS_OF, names_in

NAME = re.compile(r'(?<![\w.])[A-Za-z_]\w*', re.ASCII)
IN_DEGREES = re.compile(rf'(?<![\w.])(\d{{1,15}}\.?\d{{0,15}}|\.\d{{1,15}})\s*{DEGREE}', re.ASCII)
OPENED_OR_CLOSED = re.compile(r'(\w*)\s*\(|\)', re.ASCII)


def plain_expression(
    text: str, known: Collection[str], angle_unit: str, quantity: int | None
) -> str:
    """
    Return the expression with names spelled as the file defines them, and without degree signs.

    Parameters
    ----------
    text
        The expression, ASCII except for degree signs.
    known
        Defined names. A name in the expression, such as `theta_1`, becomes the defined name
        `theta1` if the two names are equal without underscores. If several defined names fit, the
        name stays unchanged.
    angle_unit
        The file's unit of angles: 90° becomes `pi/2` for 'rad', and `90` for 'deg'.
    quantity
        The expected quantity: 1 for an angle, 0 for a length or a ratio, None for any of the
        three.

    Raises
    ------
    ExpressionError
        The text has a degree sign, but a length or a ratio is expected.
    """
    text = _with_known_names(text, known)
    for match in IN_DEGREES.finditer(text) if quantity == 0 else ():
        if not _in_a_function(text[: match.start()]):
            message = f"'{match[0]}' is an angle; write a length or a ratio here"
            raise ExpressionError(message, code='wrong-unit')
    return IN_DEGREES.sub(lambda match: _without_sign(match, angle_unit), text)


def known_names_in(text: str, known: Collection[str]) -> frozenset[str]:
    """
    Return the names in an expression. If a name differs from a known name only by underscores, the
    result has the known name instead.
    """
    return names_in(_with_known_names(plain_names(text), known))


def _with_known_names(text: str, known: Collection[str]) -> str:
    def name(match: re.Match[str]) -> str:
        bare = match[0].replace('_', '')
        same = [word for word in known if word.replace('_', '') == bare]
        return same[0] if len(same) == 1 and match[0] not in ARGUMENTS_OF else match[0]

    return NAME.sub(name, text) if '_' in text or any('_' in word for word in known) else text


def _in_a_function(before: str) -> bool:
    # Return whether the text `before` ends inside the parentheses of a sine or cosine.
    closed = 0
    for match in reversed(list(OPENED_OR_CLOSED.finditer(before))):
        if match[0] == ')':
            closed += 1
        elif closed:
            closed -= 1
        elif match[1] in ('sin', 'cos'):
            return True
    return False


def _without_sign(match: re.Match[str], angle_unit: str) -> str:
    if angle_unit == 'deg':
        return match[1]
    fraction = Fraction(match[1]) / 180  # the angle divided by pi, as an exact fraction
    over = '' if fraction.denominator == 1 else f'/{fraction.denominator}'
    times = '' if fraction.numerator == 1 else f'{fraction.numerator}*'
    if not fraction:
        return '0'
    # If the angle comes after `/`, write parentheses around it: 1/90° becomes 1/(pi/2).
    divides = match.string[: match.start()].rstrip('+- \t\n').endswith('/')
    return f'({times}pi{over})' if divides else f'{times}pi{over}'
