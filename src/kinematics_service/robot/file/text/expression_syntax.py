# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Parse expressions: a tokenizer checks the text, then Python's parser builds a syntax tree.

`ast.parse` runs no code. The tokenizer refuses Python that is not accepted in a robot file:
`0x10`, `1_0`, `1j`, `True`, `**`, attributes, and strings.
"""

import ast
import keyword
import math
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from ....errors import ExpressionError
from ....typography import DEGREE, counted, plain_names

ARGUMENTS_OF = {'sqrt': 1, 'sin': 1, 'cos': 1, 'atan2': 2}
MAX_CHARACTERS = 400  # longer than every formula in a datasheet
MAX_DEPTH = 32

NUMBER = r'(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?'
SIGNED_NUMBER = re.compile(f'[-+]?{NUMBER}', re.ASCII)
TOKEN = re.compile(
    rf'\s*(?:(?P<number>{NUMBER})'
    r'|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<operator>\*\*|//|[-+*/(),]))',
    re.ASCII,
)
IDENTIFIER = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
SEXAGESIMAL = re.compile(r'[-+]?\d+(:\d+)+(\.\d*)?')

DECIMAL_COMMA = re.compile('[0-9]+,[0-9]+')
SQUARE = 'x*x for a square'
POWERS = {'²': SQUARE, '^': SQUARE, '³': 'x*x*x for a cube'}
UNITS = ('deg', 'degrees', 'rad', 'mm', 'cm', 'm')


class NameRefusal(NamedTuple):
    """The reason why an expression may not use a name, as text, and the code of the fault."""

    message: str
    code: str


WhyNot = Callable[[str], NameRefusal | None]

# Allows only one thread at a time to call ast.parse. Up to Python 3.12, threads that parse at the
# same time share a depth counter, so ast.parse can raise SystemError (python/cpython issue
# 106905).
_ONE_AT_A_TIME = threading.Lock()


class Token(NamedTuple):
    """A number, name or operator of an expression, with the indices of its start and end."""

    kind: str
    text: str
    start: int
    end: int


def why_no_name(name: str) -> NameRefusal | None:
    """
    Return why a text cannot name a constant or joint variable; None if the text is a valid name.
    """
    if not IDENTIFIER.fullmatch(name):
        plain = plain_names(name)
        advice = f': write {plain}' if IDENTIFIER.fullmatch(plain) else ''
        message = f'is not an identifier (letters a-z, digits, underscore; no digit first){advice}'
        return NameRefusal(message, 'wrong-name')
    if name == 'pi' or name in ARGUMENTS_OF:
        reserved = ', '.join(('pi', *ARGUMENTS_OF))
        return NameRefusal(f'already has a meaning (reserved: {reserved})', 'reserved-name')
    if name in ('inf', 'nan') or keyword.iskeyword(name):
        return NameRefusal('is a reserved word; take another name', 'reserved-name')
    return None


def names_in(text: str) -> frozenset[str]:
    """
    Return the names in an expression, except names of functions. The expression may have wrong
    syntax.
    """
    return frozenset(IDENTIFIER.findall(plain_names(text))).difference(ARGUMENTS_OF)


def number_of(text: str) -> float | None:
    """
    Return the value of a text that is one number, with or without a sign.

    Return None for every other text, and for a number that `syntax_tree` refuses.
    """
    if len(text) > MAX_CHARACTERS or not SIGNED_NUMBER.fullmatch(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def syntax_tree(text: str, why_not: WhyNot) -> ast.expr:
    """
    Return the syntax tree of an expression with floats, names, signs, + - * / and known functions.

    Parameters
    ----------
    text
        The expression as the user wrote it.
    why_not
        A function that returns why a name is not accepted, or None if the name is accepted.

    Raises
    ------
    ExpressionError
        The expression is invalid; the message has the reason and quotes the text.
    """
    tokens = _tokens(text, why_not)
    _check_names(tokens, why_not)
    _check_order(tokens, text)
    # Write each number as Python prints a float, because Python's parser refuses 017 and very long
    # integers.
    words = (repr(float(t.text)) if t.kind == 'number' else t.text for t in tokens)
    source = ' '.join(words)
    try:
        with _ONE_AT_A_TIME:
            tree = ast.parse(source, mode='eval').body
    except (SyntaxError, RecursionError, MemoryError):
        raise ExpressionError(f'cannot be read as an expression: {short(text)}') from None
    for node in postorder(tree, operands_of):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            required = ARGUMENTS_OF[node.func.id]
            if len(node.args) != required:
                takes = f'{node.func.id}() takes {counted(required, "argument")}'
                raise ExpressionError(f'{takes}, not {len(node.args)}', code='wrong-length')
    return tree


def operands_of(node: ast.expr) -> tuple[ast.expr, ...]:
    """Return the operands of a node in a syntax tree, left to right."""
    match node:
        case ast.UnaryOp():
            return (node.operand,)
        case ast.BinOp():
            return (node.left, node.right)
        case ast.Call():
            return tuple(node.args)
    return ()


Tree = TypeVar('Tree')
Worth = TypeVar('Worth')


def postorder(tree: Tree, parts_of: Callable[[Tree], Sequence[Tree]]) -> Iterator[Tree]:
    """
    Yield every node of a syntax tree, operands before operators.

    The function does not use recursion, because trees may be deep.
    """
    stack = [(tree, False)]
    while stack:
        node, parts_done = stack.pop()
        if parts_done:
            yield node
        else:
            stack.append((node, True))
            stack.extend((part, False) for part in reversed(parts_of(node)))


def folded(
    tree: Tree,
    parts_of: Callable[[Tree], Sequence[Tree]],
    worth: Callable[[Tree, list[Worth]], Worth],
) -> Worth:
    """
    Return the value of a syntax tree, computed from the leaves to the root without recursion.

    `worth` computes the value of a node from the node and the values of its operands.
    """
    values: list[Worth] = []
    for node in postorder(tree, parts_of):
        first = len(values) - len(parts_of(node))
        parts, values = values[first:], values[:first]
        values.append(worth(node, parts))
    return values[0]


OPERATORS = {ast.Add: '+', ast.Sub: '-', ast.Mult: '*', ast.Div: '/', ast.USub: 'neg'}


def evaluated(tree: ast.expr, worth: Callable[[float | str, list[Worth]], Worth]) -> Worth:
    """
    Return the value of an expression, given its syntax tree.

    `worth` computes the value of each node from a symbol and the values of the operands. The
    symbol is a number, a name, an operator (+ - * / neg), or the name of a function.
    """

    def of_node(node: ast.expr, operands: list[Worth]) -> Worth:
        match node:
            case ast.UnaryOp(op=ast.UAdd()):
                return operands[0]
            case ast.UnaryOp(op=operator) | ast.BinOp(op=operator):
                return worth(OPERATORS[type(operator)], operands)
            case ast.Constant(value=float(symbol)) | ast.Name(id=symbol):
                return worth(symbol, [])
            case ast.Call(func=ast.Name(id=function)):
                return worth(function, operands)
        raise ExpressionError(f'{type(node).__name__} is not accepted in an expression')

    return folded(tree, operands_of, of_node)


def short(text: str) -> str:
    """Return a text for a message, shortened to 40 characters."""
    return text if len(text) <= 40 else f'{text[:37]}...'


def _tokens(text: str, why_not: WhyNot) -> list[Token]:
    if len(text) > MAX_CHARACTERS:
        message = f'too long: {len(text)} characters (at most {MAX_CHARACTERS})'
        raise ExpressionError(message, code='too-long')
    if SEXAGESIMAL.fullmatch(text.strip()):
        message = f"'{text.strip()}' is text, not a number: write 90 or 1.5 for 1:30"
        raise ExpressionError(message, code='not-a-number')
    tokens: list[Token] = []
    position, end = 0, len(text.rstrip())
    while position < end:
        match = TOKEN.match(text, position)
        if match is None or match.lastgroup is None:
            raise ExpressionError(_strange(text[position:end].lstrip()[0]))
        kind = match.lastgroup
        token = Token(kind, match[kind], match.start(kind), match.end())
        _check_token(token)
        if tokens and tokens[-1].end == token.start:
            _check_touching(tokens[-1], token, text, why_not)
        tokens.append(token)
        position = token.end
    if not tokens:
        message = 'expected a number or an expression, not an empty text'
        raise ExpressionError(message, code='empty')
    return tokens


def _strange(character: str) -> str:
    if character in POWERS:
        return f"'{character}' is not accepted: write {POWERS[character]}"
    if character == DEGREE:
        return f"'{DEGREE}' is accepted only behind a number: write 90{DEGREE}"
    if not character.isascii():
        return f'character {character!r} is not ASCII: write names in the letters a to z'
    return f'unexpected character {character!r} (accepted: numbers, names, + - * / ( ) ,)'


def _check_token(token: Token) -> None:
    if token.text == '**':
        raise ExpressionError(f"'**' is not accepted: write {SQUARE}")
    if token.text == '//':
        raise ExpressionError("'//' is not accepted: write / to divide")
    if token.kind == 'number' and float(token.text) == float('inf'):
        message = f'{short(token.text)} is too large: not a finite number'
        raise ExpressionError(message, code='not-finite')


def _check_touching(before: Token, token: Token, text: str, why_not: WhyNot) -> None:
    # Refuse a number if a name or another number follows without a space: 2q1, 0x10, 1_0, 1j or
    # 1.2.3.
    if before.kind != 'number' or token.kind == 'operator':
        return
    _check_unit(before, token, why_not)
    word = text[before.start :].split()[0]
    advice = 'write decimal digits'
    if token.kind == 'name' and why_not(token.text) is None:
        advice = f'write {before.text}*{token.text} for a product'
    raise ExpressionError(f"'{short(word)}' is not a number: {advice}", code='not-a-number')


def _check_unit(before: Token, token: Token, why_not: WhyNot) -> None:
    if before.kind != 'number' or token.text not in UNITS or why_not(token.text) is None:
        return
    advice = f'{before.text} alone, in the unit that the file has under units'
    if token.text.startswith('deg'):
        advice = f'{before.text}{DEGREE}'
    message = f"'{before.text} {token.text}' has a unit; write {advice}"
    raise ExpressionError(message, code='unit-in-number')


def _check_names(tokens: list[Token], why_not: WhyNot) -> None:
    around = zip([None, *tokens], tokens, [*tokens[1:], None], strict=False)
    for before, token, following in around:
        if token.kind != 'name':
            continue
        if before is not None:
            _check_unit(before, token, why_not)
        called = following is not None and following.text == '('
        if token.text in ARGUMENTS_OF:
            if not called:
                inside = following.text if following and following.kind != 'operator' else '...'
                message = f"'{token.text}' is a function: write {token.text}({inside})"
                raise ExpressionError(message)
            continue
        reason = why_not(token.text)
        if called:
            if reason is None:
                raise ExpressionError(
                    f"'{token.text}' is not a function: write {token.text}*(...) for a product"
                )
            known = ', '.join(ARGUMENTS_OF)
            message = f"unknown function '{token.text}' (known: {known})"
            raise ExpressionError(message, code='unknown-name')
        if reason is not None:
            raise ExpressionError(reason.message, code=reason.code)


def _check_order(tokens: list[Token], text: str) -> None:
    # Check that operands and operators alternate. `open_calls` has an item for each open
    # parenthesis: True if it belongs to a function, whose parentheses may contain commas.
    open_calls: list[bool] = []
    last = ''
    for token in tokens:
        operand_next = last in '+-*/(,' or last in ARGUMENTS_OF
        if token.text == '(' or token.kind != 'operator':
            if not operand_next:
                between = f"between '{last}' and '{token.text}'"
                raise ExpressionError(f'an operator is missing {between}')
            if token.text == '(':
                open_calls.append(last in ARGUMENTS_OF)
            if len(open_calls) > MAX_DEPTH:
                message = f'nested too deeply (at most {MAX_DEPTH} parentheses)'
                raise ExpressionError(message, code='too-deep')
        elif operand_next and token.text not in '+-':
            raise ExpressionError(f"'{token.text}' where a number or a name is expected")
        elif token.text == ')':
            if not open_calls:
                raise ExpressionError("')' without '('; delete it, or write '(' before it")
            open_calls.pop()
        elif token.text == ',' and not (open_calls and open_calls[-1]):
            raise _comma(text, token.start)
        last = token.text
    if last in '+-*/(,':
        whole = text[: tokens[-1].start].strip('+-*/ ')
        advice = f': write {whole}' if 0 < len(whole) <= 40 and last != '(' else ''
        raise ExpressionError(f"ends after '{last}'{advice}")
    if open_calls:
        raise ExpressionError("'(' is never closed; write ')'")


def _comma(text: str, at: int) -> ExpressionError:
    for match in DECIMAL_COMMA.finditer(text):
        if match.start() < at < match.end():
            message = f"'{match[0]}' is not a number; write {match[0].replace(',', '.')}"
            return ExpressionError(message, code='decimal-comma')
    return ExpressionError("',' is accepted only between the arguments of a function")
