r"""
The words of a formula as people type it: plain, sympy, MATLAB or LaTeX, in one stream of tokens.

Names lose their underscores and braces (`\theta_{1}`, `theta_1` and `theta1` are one name), Greek
letters get their English names, and what only spaces or sizes a LaTeX formula is left out.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from ....errors import FormulaError
from ....typography import GREEK, SUBSCRIPTS, plain_signs

NUMBER = re.compile(r'(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][-+]?\d+)?')
WORD = re.compile(r'[A-Za-z][A-Za-z0-9]*')
COMMAND = re.compile(r'\\([A-Za-z]+)')
MODULE = re.compile(r'(?:sp|sympy|np|numpy|math)\.(?=[A-Za-z])')
DEGREES = re.compile(r'\^\s*(?:\{\s*\\circ\s*\}|\\circ(?![A-Za-z]))|°|\\degree(?![A-Za-z])')
OPERATORS = ('**', '.*', './', '.^', ':=', '+', '-', '*', '/', '^', '(', ')', '[', ']', '{', '}',
             ',', ';', '=', "'", '&')  # fmt: skip
SAME = {'**': '^', '.^': '^', '.*': '*', './': '/', ':=': '='}
# What has a meaning of its own in a formula: a cross product, powers, a transpose.
UNICODE = {'×': '\\times ', '²': '^2', '³': '^3', '′': "'", 'ᵀ': "'"}
GREEK_LETTER = re.compile(f'([{"".join(GREEK)}])([A-Za-z0-9]?)')
# `{}^{0}T_{2}`, `{}^0_2T`: frame 2 in frame 0.
FRAME_BEFORE = re.compile(
    r'(\{\s*\}|^[\s$]*|[=&(,*+-]\s*)\^\s*\{?\s*(\d)\s*\}?\s*'
    r'(?:_\s*\{?\s*(\d)\s*\}?\s*[TA](?!\w)|[TA]\s*_\s*\{?\s*(\d)\s*\}?)'
)
SUBSCRIPT = re.compile('[₀₁₂₃₄₅₆₇₈₉]+')
NO_MEANING = frozenset((
    'left', 'right', 'big', 'Big', 'bigg', 'Bigg', 'displaystyle', 'quad', 'qquad', 'limits',
    'nonumber', 'hfill',
))  # fmt: skip
LETTERED = frozenset((
    'text', 'operatorname', 'mathrm', 'mathcal', 'mathbf', 'mathit', 'boldsymbol', 'mbox',
))  # fmt: skip
ENVIRONMENTS = frozenset((
    'matrix', 'pmatrix', 'bmatrix', 'vmatrix', 'Bmatrix', 'smallmatrix', 'array',
))  # fmt: skip
SAME_LETTER = {'varphi': 'phi', 'vartheta': 'theta', 'varsigma': 'sigma'}

MOST_TOKENS = 50_000


@dataclass(frozen=True)
class FormulaToken:
    """
    One word of a formula.

    Parameters
    ----------
    kind
        `number`, `name`, `operator`, `begin`, `end`, `row` (of LaTeX), `newline`, `degrees`.
    text
        The number, the name without underscores, or the operator in its plain form.
    written
        As it stands in the file.
    line, column
        Counted from 1.
    spaced
        Whether white space stands before it, which separates the entries of a MATLAB row.
    """

    kind: str
    text: str
    written: str
    line: int
    column: int
    spaced: bool

    def fault(self, message: str) -> FormulaError:
        """Return an error about what stands here."""
        return FormulaError(message, self.line, self.column)


def plain_letters(text: str) -> str:
    """
    Return a line with Greek letters, typographic signs and indices before a name in plain form.
    """
    text = FRAME_BEFORE.sub(_frames_behind, text)
    if text.isascii():
        return text
    for sign, plain in UNICODE.items():
        text = text.replace(sign, plain)
    text = plain_signs(text)
    text = SUBSCRIPT.sub(lambda found: '_' + found[0].translate(SUBSCRIPTS), text)
    # `θ1` is one name, `θa` a product.
    return GREEK_LETTER.sub(
        lambda found: (
            f'\\{GREEK[found[1]]}{"_" if found[2].isdigit() else " " * bool(found[2])}' + found[2]
        ),
        text,
    )


def _frames_behind(found: re.Match[str]) -> str:
    # As wide as before, so that columns stay those of the file.
    before = '' if found[1].startswith('{') else found[1]
    return f'{before}T_{found[2]}{found[3] or found[4]}'.ljust(len(found[0]))


def tokens_of(text: str, line: int = 1, column: int = 1) -> list[FormulaToken]:
    """
    Return the words of a text that begins at a line and column of its file.

    Raises
    ------
    FormulaError
        A character or LaTeX command with no meaning here.
    """
    tokens: list[FormulaToken] = []
    for offset, part in enumerate(text.split('\n')):
        if offset:
            tokens.append(FormulaToken('newline', '\n', '', line + offset - 1, 0, True))
        first = column if offset == 0 else 1
        tokens.extend(_tokens_of_line(part, line + offset, first))
        if len(tokens) > MOST_TOKENS:
            raise FormulaError(f'more than {MOST_TOKENS} words', line + offset, 1)
    return tokens


def _tokens_of_line(text: str, line: int, column: int) -> Iterator[FormulaToken]:
    at, spaced = 0, False
    while at < len(text):
        if text[at].isspace() or text[at] in '$~':
            at, spaced = at + 1, True
            continue
        if text[at] in '#%':
            return
        if text.startswith('...', at):
            return
        start = at
        kind, word, at = _word(text, at, line, column)
        if kind:
            yield FormulaToken(kind, word, text[start:at].strip(), line, column + start, spaced)
            spaced = False
        else:
            spaced = True


def _word(text: str, at: int, line: int, column: int) -> tuple[str, str, int]:
    # The kind, the word and where it ends; an empty kind is what has no meaning.
    if found := DEGREES.match(text, at):
        return 'degrees', 'deg', found.end()
    if found := NUMBER.match(text, at):
        return 'number', found[0], found.end()
    if found := MODULE.match(text, at):
        return '', '', found.end()
    if text[at] == '\\':
        return _latex(text, at, line, column)
    if found := WORD.match(text, at):
        return _name(found[0], text, found.end(), latex=False)
    for operator in OPERATORS:
        if text.startswith(operator, at):
            return 'operator', SAME.get(operator, operator), at + len(operator)
    advice = ': write det(J) for a determinant' if text[at] == '|' else ''
    raise FormulaError(
        f'{text[at]!r} has no meaning in a formula{advice} (accepted: numbers, names, '
        '+ - * / ^ = , ; brackets, and LaTeX commands)',
        line,
        column + at,
    )


def _latex(text: str, at: int, line: int, column: int) -> tuple[str, str, int]:
    if text.startswith('\\\\', at):
        end = at + 2
        spacing = re.compile(r'\s*\[[^\]]*(?:pt|em|ex|mm)\]').match(text, end)
        return 'row', '\\\\', spacing.end() if spacing else end
    found = COMMAND.match(text, at)
    if found is None:
        if text[at : at + 2] in ('\\,', '\\;', '\\:', '\\!', '\\ ', '\\[', '\\]', '\\(', '\\)'):
            return '', '', at + 2
        raise FormulaError('a backslash without a command', line, column + at)
    command, end = found[1], found.end()
    if command in ('begin', 'end'):
        group, end = _group(text, end)
        if group.rstrip('*') in ENVIRONMENTS:
            if command == 'begin' and group == 'array':
                _, end = _group(text, end)
            return command, group, end
        return '', '', end
    if command in NO_MEANING:
        return '', '', end
    if command in LETTERED:
        group, end = _group(text, end)
        # Text of several words is a remark, as in `\text{ according to base axes}`.
        word = re.sub(r'[\\_{}]', '', group).strip()
        if not WORD.fullmatch(word):
            return '', '', end
        return _name(word, text, end, latex=True)
    if command == 'cdot':
        return 'operator', '*', end
    if command == 'times':
        return 'operator', 'x', end
    if command in ('frac', 'dfrac', 'tfrac', 'sqrt'):
        return 'name', 'sqrt' if command == 'sqrt' else 'frac', end
    return _name(SAME_LETTER.get(command, command), text, end, latex=True)


def _name(word: str, text: str, at: int, latex: bool) -> tuple[str, str, int]:
    while at < len(text) and text[at] == '_':
        if text.startswith('{', at + 1):
            group, at = _group(text, at + 1)
            word += (
                re.sub(r'[\s\\_{},]|mathrm|text', '', group).replace('-', 'm').replace('+', 'p')
            )
        elif found := re.compile(r'[A-Za-z0-9]+').match(text, at + 1):
            # `\cos\phi_1x` is unheard of; `\theta_12` is joint twelve or a slip, never a product.
            digits = re.compile(r'\d+|[A-Za-z]').match(text, at + 1) if latex else found
            assert digits is not None  # `found` begins with one of them
            word, at = word + digits[0], digits.end()
        else:
            break
    return 'name', word, at


def _group(text: str, at: int) -> tuple[str, int]:
    # What stands in braces from `at` on, and where they close; nothing where none open.
    while at < len(text) and text[at].isspace():
        at += 1
    if not text.startswith('{', at):
        return '', at
    if text.find('}', at) < 0:
        return text[at + 1 :], len(text)
    depth = 0
    for end in range(at, len(text)):
        depth += {'{': 1, '}': -1}.get(text[end], 0)
        if depth == 0:
            return text[at + 1 : end], end + 1
    return text[at + 1 :], len(text)
