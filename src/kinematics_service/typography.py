# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Replace typographic signs, as in PDF files, by plain signs; write counts such as `2 joints`."""

import re
import unicodedata
from collections.abc import Iterable, Sequence

DEGREE = '°'
_MINUS = '−‐‑‒–﹣－'
# The last sign is an invisible product sign, which formulas on web pages have.
_TIMES = '×·⋅∙∗\u2062'
_DIVIDED = '⁄∕÷'
_SPACES = ('\u00a0', '\u202f', '\u205f', '\u3000', *map(chr, range(0x2000, 0x200B)))
_NO_WIDTH = '\u200b\u200c\u200d\u2060\ufeff'
SIGNS = str.maketrans({
    **dict.fromkeys(_MINUS, '-'),
    **dict.fromkeys(_TIMES, '*'),
    **dict.fromkeys(_DIVIDED, '/'),
    **dict.fromkeys(_SPACES, ' '),
    **dict.fromkeys(_NO_WIDTH, ''),
    **dict.fromkeys('º˚', DEGREE),  # an ordinal sign and an accent, which look like a degree sign
})  # fmt: skip
SUBSCRIPTS = str.maketrans('₀₁₂₃₄₅₆₇₈₉₋ᵢⱼ', '0123456789-ij')
_NAMES = (
    'alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho '
    'sigma tau upsilon phi chi psi omega'
)
GREEK = {
    **dict(zip('αβγδεζηθικλμνξοπρστυφχψω', _NAMES.split(), strict=True)),
    **dict(zip('ΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠΡΣΤΥΦΧΨΩ', _NAMES.title().split(), strict=True)),
    'ϑ': 'theta', 'ϕ': 'phi', 'ϖ': 'pi', 'ϵ': 'epsilon', 'µ': 'mu',
    '⍺': 'alpha',  # the alpha of APL, which tables of some programs use
}  # fmt: skip
_LETTERS = str.maketrans(GREEK)
_STYLED = re.compile('[\U0001d400-\U0001d7ff]')  # letters of formulas, such as an italic theta


def plain_signs(text: str) -> str:
    """
    Return a text in which signs and spaces are ASCII. Degree signs, Greek letters and indices
    stay.
    """
    if text.isascii():
        return text
    text = _STYLED.sub(lambda match: unicodedata.normalize('NFKC', match[0]), text)
    return text.translate(SIGNS)


def plain_names(text: str) -> str:
    """
    Return a text with ASCII signs, with names for Greek letters, and with plain digits for
    indices.
    """
    if text.isascii():
        return text
    return plain_signs(text).translate(_LETTERS).translate(SUBSCRIPTS)


def counted(number: int, noun: str) -> str:
    """Return a number and its noun as text, in singular or plural: `1 joint`, `3 trajectories`."""
    if number == 1:
        return f'1 {noun}'
    if noun.endswith('y'):
        return f'{number:,} {noun[:-1]}ies'
    return f'{number:,} {noun}{"es" if noun.endswith("ch") else "s"}'


def number_text(value: float) -> str:
    """Return a number as exact text, without a final `.0`: 2 for 2.0, 0 for -0.0."""
    return repr(float(value) + 0.0).removesuffix('.0')


def linear_text(terms: Iterable[tuple[float, str]]) -> str:
    """Return a sum of factors times names as text, such as `2*q1 - q2`."""
    text = ''
    for factor, name in terms:
        times = '' if abs(factor) == 1.0 else f'{number_text(abs(factor))}*'
        text += f' {"-" if factor < 0.0 else "+"} {times}{name}'
    return f'-{text[3:]}' if text.startswith(' -') else text[3:]


def listed(names: Sequence[str], limit: int, between: str = ', ') -> str:
    """
    Return the first `limit` names and the number of other names as text: `a, b and 3 more`.
    """
    more = len(names) - limit
    return between.join(names[:limit]) + (f' and {more} more' if more > 0 else '')
