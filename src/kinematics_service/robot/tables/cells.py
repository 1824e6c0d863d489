# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Turn the cells of a pasted table into plain expressions with units."""

import re
from typing import NamedTuple

from ...typography import DEGREE
from ..file.parts.quantities import QUARTERS
from ..file.text.expression_syntax import ARGUMENTS_OF
from ..urdf.quantity import as_rounded_part_of_pi

# Regular expressions and their replacements, applied to a cell in this order. The replacements
# turn marks of LaTeX, Markdown and programming languages into plain signs.
PLAIN = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r'</?\w+[^<>]*>', ''),
        (r'\\[dt]?frac\s*(\\[a-z]+|\d)\s*(\w)', r'\\frac{\1}{\2}'),
        (r'\\[dt]?frac\{(\\?\w+)\}\{(\w+)\}', r'\1/\2'),
        (r'\\[dt]?frac\{([^{}]*)\}\{([^{}]*)\}', r'(\1)/(\2)'),
        (r'\^\s*\{?\s*\\circ\s*\}?|\\(?:text)?degree|\\deg\b', DEGREE),
        # Matches a raised star, which marks a joint variable, as in theta_3^*.
        (r'\^\s*\{?\s*(?:\*|\\ast|\\star)\s*\}?', '*'),
        (r'\\(?:text|math)\w*\{([^{}]*)\}', r'\1'),
        (r'\\(?:cdot|times)\b', '*'),
        (r'\\(?:left|right|quad|[,;:! ])', ' '),
        (r'\\(?=[A-Za-z])|[${}]', ''),
        (r'(?<=\d)\s*(?=pi\b)', '*'),
        (r'\b(?:numpy|np|jnp|[Mm]ath|sympy|sp|sy|torch|std|cmath)\.(?=[A-Za-z])', ''),
        (r'\b(?:M_PI|FRAC_PI|pi)_([2-9])\b', r'pi/\1'),
        (r'^\s*=|\((?:variable|var)\)', ''),
        (r'\b(?:M_PI|PI|Pi|pi)\b(?:\(\))?', 'pi'),
        (r"\bsym\(\s*'?(\w+)'?\s*\)", r'\1'),
        (r'\b(?:deg2rad|radians|toRadians|d2r|DEG2RAD)\(\s*([-+]?[\d.]+)\s*\)', rf'\1{DEGREE}'),
        (r'(?<=[\d.])\s*\*\s*(?:DEG2RAD|deg2rad|D2R|d2r)\b', DEGREE),
        (r'(?<=[\d.])\s*(?:degrees|degree|deg)\b', DEGREE),
        (r'(?<=\w)\(t\)', ''),
        (r'(?<=\d)f\b', ''),
    )
)
INDEX = re.compile(r'\b([A-Za-z_]\w*)[\[(](\d+)[\])]')


class PastedRow(NamedTuple):
    """The cells of a table row, and the line of the row in the pasted text."""

    line: int
    cells: tuple[str, ...]


def plain_cell(text: str) -> str:
    """Return a cell without marks of LaTeX, Markdown or program code; `q(1)` becomes `q1`."""
    for pattern, plain in PLAIN:
        text = pattern.sub(plain, text)
    text = INDEX.sub(
        lambda match: match[0] if match[1] in ARGUMENTS_OF else match[1] + match[2], text
    )
    text = text.strip(' \t\n`"\'')
    return text.strip('* ') if text.startswith('*') else text


def is_quarter(number: str) -> bool:
    """Return whether a number such as `1.57` is a rounded multiple of pi/2, up to 2 pi."""
    return '.' in number and as_rounded_part_of_pi(number) in QUARTERS
