# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a file of formulas: settings, definitions and formulas, each with its line."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .....errors import FormulaError
from .syntax import CLOSING, Node, parse, parse_lines
from .tokens import FormulaToken, plain_letters, tokens_of

SETTING = re.compile(
    r'\s*(rows|frame|units|at|first frame|point|meaning|singular)\s*:(?!=)(.*)', re.IGNORECASE
)
WHERE = re.compile(r'\s*,?\s*where\b[\s,:]*', re.IGNORECASE)
LATEX_WHERE = re.compile(r'\\(?:text|mathrm)\s*\{\s*where\s*\}')
GOES_ON = re.compile(r'(=|(?<![*/])[*/+-]|&|\\\\|\.\.\.)\s*$')
BEGINS_A_MATRIX = re.compile(r'\s*(\$|\[|\\begin|\\left|\\\[|Matrix|sp\.|sympy\.|np\.)')
BRACED = re.compile(r'\\(?:begin|end)\s*\{[^{}]{0,40}\}')

# Maximum number of formulas in a file, because a formula takes up to a second.
MAX_FORMULAS = 200

# Names of matrices whose determinant a file may define, as in `det(J) = ...`.
DETERMINANT_OF = ('J', 'Jv', 'Jt', 'Jacobian')
# Matches the name of a matrix or vector. On the left side of an equation, joint variables may
# follow the name, as in `J(q) = ...` or `T(\theta_1, \theta_2) = ...`.
DEPENDS = re.compile(r'\d?[JTRADHzop]\w*')
JOINTS = re.compile(r'(?:q|theta|Theta|th|phi|d)\d*')


# Accepted values of each setting, and the fields of `Settings` that they set.
CHOICES: dict[str, dict[str, dict[str, Any]]] = {
    'rows': {'linear first': {'angular_first': False}, 'angular first': {'angular_first': True}},
    'frame': {'base': {'axes': 'base'}, 'tool': {'axes': 'tool'}},
    'units': {'rad': {'degrees': False}, 'deg': {'degrees': True}},
    'first frame': {'0': {'first_frame': 0}, '1': {'first_frame': 1}},
}


@dataclass(frozen=True)
class Settings:
    """
    Settings in a file of formulas. Each setting applies to the formulas after it.

    Parameters
    ----------
    angular_first
        Whether the angular rows of a Jacobian come first, as after `rows: angular first`. None:
        the usual order, which is angular first for `J_s` and `J_b`, else linear first.
    axes
        Axes of the Jacobian's rows: `base`, or `tool` after `frame: tool`.
    degrees
        Whether `units: deg` is set: angles in formulas, in `at`, and results of inverse kinematics
        are in deg.
    first_frame
        The number, 0 or 1, that formulas give to the table's first frame.
    point
        Name of the point whose coordinates are x, y, z; empty: the tool.
    at
        Joint values of a numeric example, such as `theta3=90 deg`; empty: random configurations.
    meanings
        Pairs (new name, known name), from lines such as `meaning: R_C = o_3`.
    """

    angular_first: bool | None = None
    axes: str = 'base'
    degrees: bool = False
    first_frame: int = 0
    point: str = ''
    at: tuple['Raw', ...] = ()
    meanings: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Raw:
    """
    A parsed equation of the file: two trees whose names are not yet looked up.

    Parameters
    ----------
    left, right
        Trees of both sides; in a chain a = b = c these are a and c.
    local
        Whether the equation follows `where`. It is then a definition for the formula above only.
    claim
        The conditions of a `singular:` line, else empty; `left` and `right` are the sides of the
        first condition.
    """

    left: Node
    right: Node
    local: bool
    settings: Settings
    claim: tuple['Raw', ...] = ()

    @property
    def line(self) -> int:
        """Return the number of the line on which the equation begins."""
        return self.left.at.line


@dataclass(frozen=True)
class FormulaFile:
    """The equations of a file of formulas, and the errors of lines that could not be read."""

    raw: tuple[Raw, ...]
    faults: tuple[FormulaError, ...]


@dataclass(frozen=True)
class _Chunk:
    # The text of consecutive lines that form one setting or formula. The text begins at `column`
    # of line number `line`.
    text: str
    line: int
    by_lines: bool = False
    column: int = 1

    def after(self, at: int) -> '_Chunk':
        return replace(self, text=self.text[at:], column=at + 1)

    def fault(self, message: str, code: str) -> FormulaError:
        return FormulaError(message, self.line, self.column, code=code)


def read_formulas(text: str) -> FormulaFile:
    """
    Return the equations in a text of formulas, each with the settings that apply to it. Return
    also the errors of lines that could not be read.
    """
    raw: list[Raw] = []
    faults: list[FormulaError] = []
    settings, local = Settings(), False
    lines = [plain_letters(line) for line in text.splitlines()]
    for chunk in _chunks(lines):
        try:
            if match := SETTING.fullmatch(chunk.text):
                local = False
                words = match[1].lower()
                value = chunk.after(len(chunk.text) - len(match[2].lstrip()))
                if words == 'singular':
                    conditions = tuple(_equations(value, settings))
                    if not conditions:
                        message = 'singular: the condition is missing; write for example q3 = k*pi'
                        raise value.fault(message, 'empty')
                    raw.append(replace(conditions[0], claim=conditions))
                else:
                    settings = _set(settings, words, value)
                continue
            body = LATEX_WHERE.sub(lambda match: f'{"where":<{len(match[0])}}', chunk.text)
            whole = replace(chunk, text=body)
            if start := WHERE.match(body):
                local, whole = True, whole.after(start.end())
            raw.extend(_equations(whole, settings, local))
        except FormulaError as fault:
            faults.append(fault)
        if len(raw) > MAX_FORMULAS:
            message = f'more than {MAX_FORMULAS} formulas; split the file'
            faults.append(FormulaError(message, chunk.line, 1, code='too-many'))
            break
    return FormulaFile(tuple(raw), tuple(faults))


def _chunks(lines: Sequence[str]) -> Iterator[_Chunk]:
    at = 0
    while at < len(lines):
        if not _bare(lines[at]):
            at += 1
            continue
        first = at
        depth = _depth(lines[at])
        at += 1
        if SETTING.fullmatch(lines[first]) and depth <= 0:
            yield _Chunk(_bare(lines[first]), first + 1)
            continue
        by_lines = False
        while at < len(lines):
            text = _bare(lines[at])
            before = _bare(lines[at - 1])
            if depth <= 0 and text.lstrip().startswith(('=', '&=', '&:=')):
                pass
            elif depth <= 0 and before.endswith('=') and at == first + 1:
                at = next((k for k in range(at, len(lines)) if _bare(lines[k])), len(lines))
                if at == len(lines) or not BEGINS_A_MATRIX.match(lines[at]):
                    by_lines, at = True, _end_of_rows(lines, at)
                    break
            elif depth <= 0 and not GOES_ON.search(before):
                break
            elif depth > 0 and (_begins_another(text) or SETTING.fullmatch(text)):
                break  # the next formula begins, although a bracket was not closed
            depth += _depth(lines[at])
            at += 1
        yield _Chunk('\n'.join(lines[first:at]), first + 1, by_lines)


def _begins_another(text: str) -> bool:
    left, equals, _ = text.partition('=')
    left = left.rstrip().removesuffix(':').rstrip()
    return bool(equals and left) and '&' not in left and not left.endswith(':')


def _end_of_rows(lines: Sequence[str], at: int) -> int:
    # Return the index of the line after a matrix without brackets. The matrix ends before a blank
    # line, a setting, or the next formula.
    while at < len(lines):
        text = _bare(lines[at])
        if not text or '=' in text or SETTING.fullmatch(lines[at]) or WHERE.match(lines[at]):
            break
        at += 1
    return at


def _bare(line: str) -> str:
    # Return a line without its comment; `\%` does not begin a comment.
    comment = re.search(r'(?<!\\)[#%]', line)
    text = (line[: comment.start()] if comment else line).rstrip()
    return '' if text.strip() in ('$$', '$', '\\[', '\\]') else text


def _depth(line: str) -> int:
    text = _bare(line)
    environments = BRACED.findall(text)
    begun = sum(environment.startswith('\\begin') for environment in environments)
    text = BRACED.sub('', text)
    depth: int = 2 * begun - len(environments)
    return depth + sum((c in CLOSING) - (c in CLOSING.values()) for c in text)


def _equations(chunk: _Chunk, settings: Settings, local: bool = False) -> Iterator[Raw]:
    for part in _split(tokens_of(chunk.text, chunk.line, chunk.column), (';', ',')):
        raw = _equation(part, settings, local, chunk.by_lines)
        left, right = raw.left, raw.right
        if left.kind == right.kind == "'":
            left, right = left.parts[0], right.parts[0]
        if left.kind == right.kind == 'matrix' and left.rows == right.rows:
            entries = zip(left.parts, right.parts)
            yield from (replace(raw, left=left, right=right) for left, right in entries)
        else:
            yield raw


def _split(tokens: Sequence[FormulaToken], at: Sequence[str]) -> list[list[FormulaToken]]:
    # Split tokens at those separators in `at` that are outside all brackets.
    parts: list[list[FormulaToken]] = [[]]
    depth = 0
    for token in tokens:
        sign = token.text if token.kind == 'operator' else token.kind
        depth += (sign in ('begin', *CLOSING)) - (sign in ('end', *CLOSING.values()))
        if depth == 0 and sign in at:
            parts.append([])
        else:
            parts[-1].append(token)
    return [part for part in parts if any(token.kind != 'newline' for token in part)]


def _equation(tokens: list[FormulaToken], settings: Settings, local: bool, by_lines: bool) -> Raw:
    sides = _split(tokens, ('=',))
    first = next(token for token in tokens if token.kind != 'newline')
    if len(sides) < 2 and any(token.text == '=' for token in tokens):
        raise first.fault('the formula has one side only; write NAME = ...', 'empty')
    if len(sides) < 2:
        advice = '; decimals have a point, as in 0.5' if first.kind == 'number' else ''
        raise first.fault(
            f'{first.written!r} does not begin a formula{advice} (accepted: NAME = ..., a setting '
            "such as 'rows: angular first', a comment after #)",
            'syntax',
        )
    left = _of_a_jacobian(
        parse(_without_joints([token for token in sides[0] if token.text != '&']), tokens[-1])
    )
    right = _trimmed(sides[-1])
    is_rows = by_lines and any(token.kind == 'newline' for token in right)
    tree = parse_lines(right, tokens[-1]) if is_rows else parse(right, tokens[-1])
    return Raw(left, tree, local, settings)


def _of_a_jacobian(left: Node) -> Node:
    # The parser reads det(J) as the product det * J. On the left side of an equation, replace this
    # product by the name `det`.
    if left.kind != '*' or left.parts[0].text != 'det':
        return left
    det, of = left.parts
    if of.text not in DETERMINANT_OF:
        message = "det: only the determinant of J is compared; write 'det(J) = ...'"
        raise det.at.fault(message, 'unsupported')
    return replace(det, at=replace(det.at, written=f'{det.at.written}({of.at.written})'))


def _trimmed(tokens: list[FormulaToken]) -> list[FormulaToken]:
    # Return the tokens without the newlines at both ends.
    words = [k for k, token in enumerate(tokens) if token.kind != 'newline']
    return tokens[words[0] : words[-1] + 1] if words else []


def _without_joints(tokens: list[FormulaToken]) -> list[FormulaToken]:
    name, *tail = _trimmed(tokens)
    if not tail or not DEPENDS.fullmatch(name.text) or [tail[0].text, tail[-1].text] != ['(', ')']:
        return tokens
    inside = [token.text for token in tail[1:-1] if token.text != ',']
    return [name] if inside and all(map(JOINTS.fullmatch, inside)) else tokens


def _set(settings: Settings, name: str, value: _Chunk) -> Settings:
    word = ' '.join(value.text.split()).lower()
    if name in CHOICES:
        if word not in CHOICES[name]:
            choices = ' or '.join(repr(choice) for choice in CHOICES[name])
            raise value.fault(f'{name}: {word!r} is not accepted; write {choices}', 'unknown-name')
        return replace(settings, **CHOICES[name][word])
    if name == 'point' and word in ('', 'tool'):
        return replace(settings, point='')
    if name == 'point':
        tokens = tokens_of(value.text, value.line, value.column)
        if len(tokens) != 1 or tokens[0].kind != 'name':
            raise value.fault(f'point: {word!r} is not one name; write for example o_3', 'syntax')
        return replace(settings, point=tokens[0].text)
    if name == 'at' and word in ('', 'random', 'random poses'):
        return replace(settings, at=())
    pairs = tuple(_equations(value, settings))
    if name == 'at':
        return replace(settings, at=pairs)
    if any(pair.left.kind != 'name' or pair.right.kind != 'name' for pair in pairs):
        message = f'meaning: {word!r} is not NAME = NAME; write for example R_C = o_3'
        raise value.fault(message, 'syntax')
    meanings = tuple((pair.left.text, pair.right.text) for pair in pairs)
    return replace(settings, meanings=settings.meanings + meanings)
