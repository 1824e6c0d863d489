# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
r"""
Split a formula into tokens, in plain, sympy, MATLAB or LaTeX syntax or a mixture of them.

Names lose their underscores and braces (`\theta_{1}`, `theta_1` and `theta1` are one name). Greek
letters get their English names. LaTeX commands for spacing and size are left out.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from .....errors import FormulaError
from .....typography import GREEK, SUBSCRIPTS, plain_signs

# Unicode signs with a meaning in formulas: a cross product, powers, a transpose, an index.
UNICODE = {
    '×': '\\times ', '′': "'", 'ᵀ': "'", 'ᵢ': '_i',
    **{sign: f'^{digit}' for digit, sign in enumerate('⁰¹²³⁴⁵⁶⁷⁸⁹')},
}  # fmt: skip
SUBSCRIPT = re.compile('[₀₁₂₃₄₅₆₇₈₉]+')
SAME_LETTER = {'varphi': 'phi', 'vartheta': 'theta', 'varsigma': 'sigma'}

_END = '(?![A-Za-z])'
_GROUP = r'\{(?:[^{}]|\{[^{}]*\})*\}'
_MATRIX = r'\s*\{\s*(?:[pbvB]|small)?matrix\*?\s*\}|\s*\{\s*array\s*\}'
_LETTERED = r'\\(?:text|operatorname|math(?:rm|cal|bf|it|sf|bb)|boldsymbol|bm|mbox|hat|vec)\s*\*?'
# Kind, pattern and plain text of each token. If the plain text is None, the token keeps the text
# in the formula. A token with an empty kind has no meaning and is skipped. If several patterns
# match, the first one is used.
TOKENS = tuple(
    (kind, re.compile(pattern), plain)
    for kind, pattern, plain in (
        ('', r'[\s$~]+|(?:[#%]|\.\.\.).*|(?:sp|sympy|np|numpy|math)\.(?=[A-Za-z])|\.[\s$]*$', ''),
        ('degrees', rf'\^\s*(?:\{{\s*\\circ\s*\}}|\\circ{_END})|°|\\degree{_END}', 'deg'),
        ('number', r'(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][-+]?\d+)?', None),
        ('row', r'\\\\(?:\s*\[[^\]]*(?:pt|em|ex|mm)\])?', '\\\\'),
        ('begin', rf'\\begin(?:{_MATRIX})(?:(?<=array\}})\s*{_GROUP})?', None),
        ('end', rf'\\end(?:{_MATRIX})', None),
        ('', r'\\[,;:! \[\]()]|\\(?:begin|end)\s*\{[^{}\\]*\}?', ''),
        ('', rf'\\(?:left|right|[bB]igg?[lr]?|displaystyle|q?quad|limits|nonumber|hfill){_END}',
         ''),
        ('operator', rf'\\cdot{_END}|\.?\*(?!\*)', '*'),
        ('operator', rf'\\times{_END}', 'x'),
        ('operator', r'\*\*|\.?\^', '^'),
        ('operator', r'\./|/', '/'),
        ('operator', r":?=", '='),
        ('operator', r"\.?'", "'"),
        ('operator', r'[-+()\[\]{},;&]', None),
        ('name', rf'{_LETTERED}\s*{_GROUP}', None),
        # Accept a letter c or s before theta or phi, because `s\theta_2` means sin(theta2).
        ('name', r'(?:[cCsS](?=\\(?:var)?(?:theta|phi)))?\\[A-Za-z]+', None),
        ('name', r'[A-Za-z][A-Za-z0-9]*', None),
    )
)  # fmt: skip
WORD = re.compile(r'[A-Za-z][A-Za-z0-9]*')
# Patterns of a subscript. BELOW takes a whole word; BELOW_COMMAND, for the subscript of a LaTeX
# command, takes one letter or a number.
BELOW = re.compile(rf'\s*_\s*({_GROUP}|\\[A-Za-z]+|[A-Za-z0-9]+)')
BELOW_COMMAND = re.compile(rf'\s*_\s*({_GROUP}|\\[A-Za-z]+|\d+|[A-Za-z])')
# A superscript after one of these letters may be the number of a frame. After all other letters, a
# superscript is a power.
FRAMED = ('T', 'A', 'H', 'R', 'z', 'o', 'O', 'p', 'P', 'J')
ABOVE = re.compile(r'\s*\^\s*(?P<brace>\{\s*)?(?P<index>[0-9n])(?(brace)\s*\}|(?![A-Za-z0-9.]))')
INDEX = re.compile(r'\s*_\s*\{?\s*[0-9nevwx\\]')
BEFORE = re.compile(
    r'(?:\{\s*\}\s*)?\^\s*(?P<brace>\{\s*)?(?P<above>[0-9n])(?(brace)\s*\})(?P<glued>(?=\S))?'
    rf'\s*(?:_\s*(?P<below>\w|{_GROUP})\s*)?'
    rf'(?P<letter>{_LETTERED}\s*\{{[TAHRzoOpPJ]\}}|[TAHRzoOpPJ](?![A-Za-z0-9]))'
)
ADVICE = {
    '|': '; write det(J) for a determinant',
    '_': '; write an index before a power, as in L_1^2',
}
# `+-` is an error, because it is ambiguous: it means plus or minus, or the sum with a negative
# number.
PLUS_MINUS = re.compile(r'[±∓]|\\(?:pm|mp)(?![A-Za-z])|\+/?-')
# Maximum number of tokens of a file, because more tokens would take minutes.
MAX_TOKENS = 50_000


@dataclass(frozen=True)
class FormulaToken:
    """
    One token of a formula.

    Parameters
    ----------
    kind
        `number`, `name`, `operator`, `begin`, `end`, `row` (the end of a matrix row in LaTeX),
        `newline`, `degrees`.
    text
        The number, the operator in its plain form, or the name without underscores. If a name has
        a frame number as superscript, the superscript comes first: z^0_1 becomes `0z1`. In the
        name of a pose, the superscript comes after T: T^0_2 becomes `T02`.
    written
        The text in the file.
    line, column
        Counted from 1.
    spaced
        Whether white space precedes the token. White space separates the entries of a MATLAB row.
    """

    kind: str
    text: str
    written: str
    line: int
    column: int
    spaced: bool

    def fault(self, message: str, code: str) -> FormulaError:
        """Return an error with this message and code at the token's line and column."""
        return FormulaError(message, self.line, self.column, code=code)


def plain_letters(text: str) -> str:
    """Return a line in which plain text replaces Greek letters, typographic signs and indices."""
    if text.isascii():
        return text
    for sign, plain in UNICODE.items():
        text = text.replace(sign, plain)
    text = plain_signs(text)
    text = SUBSCRIPT.sub(lambda match: '_' + match[0].translate(SUBSCRIPTS), text)
    # Join a Greek letter and a following number by `_`: `θ1` is one name, but `θa` is a product.
    text = re.sub(f'([{"".join(GREEK)}])(?=[0-9])', r'\1_', text)
    text = re.sub(f'([{"".join(GREEK)}])(?=[A-Za-z])', r'\1 ', text)
    return text.translate({ord(sign): f'\\{name}' for sign, name in GREEK.items()})


def tokens_of(text: str, line: int = 1, column: int = 1) -> list[FormulaToken]:
    """
    Return the tokens of a text that begins at a line and column of its file.

    Raises
    ------
    FormulaError
        A character or LaTeX command has no meaning in a formula.
    """
    tokens: list[FormulaToken] = []
    for offset, part in enumerate(text.split('\n')):
        if offset:
            tokens.append(FormulaToken('newline', '\n', '', line + offset - 1, 0, True))
        first = column if offset == 0 else 1
        tokens.extend(_tokens_of_line(part, line + offset, first))
        if len(tokens) > MAX_TOKENS:
            message = f'the formula has more than {MAX_TOKENS} words; split it'
            raise FormulaError(message, line + offset, 1, code='too-large')
    return tokens


def _tokens_of_line(text: str, line: int, column: int) -> Iterator[FormulaToken]:
    at, spaced, operand = 0, False, False
    while at < len(text):
        start = at
        kind, word, at = _before(text, at, operand, spaced) or _token(text, at, line, column)
        if kind:
            yield FormulaToken(kind, word, text[start:at].strip(), line, column + start, spaced)
            operand = kind in ('number', 'name', 'end', 'degrees') or word in ")]}'"
        spaced = not kind


def _token(text: str, at: int, line: int, column: int) -> tuple[str, str, int]:
    # Return kind, text and end index of the token at `at`. The kind is empty for spaces and size
    # commands, which are skipped.
    place = line, column + at
    if match := PLUS_MINUS.match(text, at):
        message = (
            f"'{match[0]}' is two signs; write the line once with + and once with -, or + (-1) to "
            'add a negative number'
        )
        raise FormulaError(message, *place, code='ambiguous')
    for kind, pattern, plain in TOKENS:
        if match := pattern.match(text, at):
            word = match[0] if plain is None else plain
            return _name(word, text, match.end()) if kind == 'name' else (kind, word, match.end())
    if text[at : at + 1] == '\\':
        message = 'the backslash has no command; write for example \\cos'
        raise FormulaError(message, *place, code='syntax')
    sign = text[at : at + 1]
    message = (
        f'{sign!r} has no meaning in a formula{ADVICE.get(sign, "")} (accepted: numbers, names, '
        '+ - * / ^ = , ; brackets, and LaTeX commands)'
    )
    raise FormulaError(message, *place, code='syntax')


def _before(text: str, at: int, operand: bool, spaced: bool) -> tuple[str, str, int] | None:
    # Return the token of a name that begins with a superscript; None if no such name begins at
    # `at`. `{}^{0}T_{2}` and `{}^0_2T` mean frame 2 in frame 0. After an operand, `^` usually
    # begins a power, as in `A_1^2`. In `A_1 ^1T_2`, it begins a name, because a space precedes
    # `^`, and no space follows the superscript.
    match = BEFORE.match(text, at) if text[at] in '{^' else None
    if match is None or (
        operand and text[at] == '^' and not (spaced and match['glued'] is not None)
    ):
        return None
    return _name(match['letter'], text, match.end(), match['above'], match['below'] or '')


def _name(word: str, text: str, at: int, above: str = '', below: str = '') -> tuple[str, str, int]:
    command, word = '\\' in word, word.replace('\\', '', 1)
    if '{' in word:
        word = re.sub(r'[\\_{}]', '', word[word.index('{') :]).strip()
        if not WORD.fullmatch(word):
            # Skip text of several words: it is a remark, as in `\text{ according to base axes}`.
            return '', '', at
    word, below = SAME_LETTER.get(word, word), _plain_index(below)
    while True:
        if match := (BELOW_COMMAND if command else BELOW).match(text, at):
            below += _plain_index(match[1])
        elif not above and (match := ABOVE.match(text, at)) and _is_frame(word, match, below):
            above = match['index']
        else:
            break
        at = match.end()
    # A frame number as superscript comes before the letter: z^0_1 becomes 0z1. In the name of a
    # pose, the superscript comes after the letter, which is T: T^0_2 and A^0_2 become T02.
    word = 'T' if above and word in 'AH' else word
    return 'name', (word + above if word == 'T' else above + word) + below, at


def _is_frame(word: str, match: re.Match[str], below: str) -> bool:
    # Return whether a superscript is the number of a frame, as in `R^0_1` and `{}^0J`. The
    # superscript of `R_1^0` is a frame, because a power 0 or 1 makes no sense. The superscript of
    # `T_1^2` is a power.
    if word not in FRAMED:
        return False
    if below:
        return match['index'] in '01' and (below.isdigit() or word == 'J')
    return word == 'J' or bool(INDEX.match(match.string, match.end()))


def _plain_index(group: str) -> str:
    plain = re.sub(r'[\s\\_{},]|mathrm|text', '', group)
    return plain.replace('-', 'm').replace('+', 'p')
