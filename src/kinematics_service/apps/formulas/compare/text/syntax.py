# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
r"""
Parse the tokens of a formula into a tree by a Pratt parser; no text is ever executed.

Source: Pratt, Top down operator precedence, POPL 1973. Each operator has a binding power. An
expression ends at an operator with a lower binding power than the operator before the expression.

The parser accepts sums, products (also implicit: `2 L1 c1`), powers, functions, `\frac`, `\sqrt`,
matrices as `[a b; c d]`, `[[a, b], [c, d]]`, `Matrix(...)` or `\begin{bmatrix}`, transposes,
inverses and cross products.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

from .....errors import FormulaError
from .....typography import counted
from .tokens import FormulaToken

FUNCTIONS = {
    'sin': 1, 'cos': 1, 'tan': 1, 'asin': 1, 'acos': 1, 'atan': 1, 'arcsin': 1, 'arccos': 1,
    'arctan': 1, 'atan2': 2, 'arctan2': 2, 'sind': 1, 'cosd': 1, 'tand': 1, 'atan2d': 2,
    'sqrt': 1, 'abs': 1, 'cross': 2, 'inv': 1, 'transpose': 1, 'simplify': 1, 'rad': 1,
    'radians': 1, 'deg2rad': 1, 'sign': 1, 'sgn': 1,
}  # fmt: skip
MATRIX_CALLS = frozenset(('Matrix', 'ImmutableMatrix', 'array'))
INVERSE = {'sin': 'asin', 'cos': 'acos', 'tan': 'atan'}
MAX_DEPTH = 60
# Binding powers of operators. An operand between two operators belongs to the operator with the
# larger power. Toward its right operand, the power of an operator is larger by 1. So the b in
# a - b - c belongs to the first minus: (a - b) - c.
SUM, PRODUCT, SIGN, POWER, POSTFIX = range(1, 6)
BINDING = {'+': SUM, '-': SUM, '*': PRODUCT, '/': PRODUCT, 'x': PRODUCT, '^': POWER, "'": POSTFIX}
TRANSPOSE = (('T',), ('top',), ('{', 'T', '}'), ('{', 'top', '}'))
CLOSING = {'(': ')', '[': ']', '{': '}'}
# Maximum number of entries of a matrix; a Jacobian of 100 joints has 600.
MAX_MATRIX_ENTRIES = 1000
LARGE_MATRIX = f'the matrix has more than {MAX_MATRIX_ENTRIES} entries; compare a part of it'


@dataclass(frozen=True)
class Node:
    """
    A node of the tree of a formula: a number, a name, a function, a matrix or an operator.

    Parameters
    ----------
    kind
        `number`, `name`, `call`, `matrix`, or an operator: + (of many terms), *, /, ^, x (cross
        product), neg (negative), deg (degrees), ' (transpose).
    text
        The number, the name, or the function.
    parts
        Operands, arguments, or the entries of a matrix row by row.
    at
        The token at which an error of this node is reported.
    rows
        Number of entries in each row of a matrix.
    """

    kind: str
    text: str
    parts: tuple['Node', ...]
    at: FormulaToken
    rows: tuple[int, ...] = ()


PARTS: Callable[[Node], tuple[Node, ...]] = attrgetter('parts')


def parse(tokens: Sequence[FormulaToken], last: FormulaToken) -> Node:
    """
    Return the tree of an expression.

    Parameters
    ----------
    tokens
        All tokens of the expression.
    last
        The token at which an error is reported if the expression ends too early.

    Raises
    ------
    FormulaError
        The tokens are not a valid expression.
    """
    parser = _Parser(list(tokens), last)
    parser.skip_newlines()
    node = parser.expression()
    parser.skip_newlines()
    if parser.next is not None:
        written = parser.next.written
        message = f'{written!r} is not expected here; the formula is complete before it'
        raise parser.error(message, 'syntax')
    return node


def parse_lines(tokens: Sequence[FormulaToken], last: FormulaToken) -> Node:
    """Return the matrix whose rows are the lines of a text without brackets."""
    opening = FormulaToken('operator', '[', '[', last.line, last.column, False)
    closing = FormulaToken('operator', ']', ']', last.line, last.column, False)
    return parse([opening, *tokens, closing], last)


@dataclass
class _Parser:
    tokens: list[FormulaToken]
    last: FormulaToken
    at: int = 0
    depth: int = 0
    by_blanks: bool = False  # whether blanks separate the entries of a matrix row

    @property
    def next(self) -> FormulaToken | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def error(self, message: str, code: str) -> FormulaError:
        return (self.next or self.last).fault(message, code)

    def is_next(self, *texts: str) -> bool:
        token = self.next
        return token is not None and token.kind in ('operator', 'row') and token.text in texts

    def take(self) -> FormulaToken:
        token = self.next
        if token is None:
            message = 'the formula ends too early; write a number, a name or a bracket'
            raise self.error(message, 'syntax')
        self.at += 1
        return token

    def took(self, *texts: str) -> bool:
        # If the next tokens have the given texts, skip them and return True.
        if tuple(t.text for t in self.tokens[self.at : self.at + len(texts)]) != texts:
            return False
        self.at += len(texts)
        return True

    def expect(self, text: str) -> None:
        self.skip_newlines()
        if not self.took(text):
            token = 'the end' if self.next is None else repr(self.next.written)
            raise self.error(f'the bracket is not closed; write {text!r} before {token}', 'syntax')

    def skip_newlines(self) -> None:
        while self.next is not None and self.next.kind == 'newline':
            self.at += 1

    def expression(self, least: int = SUM) -> Node:
        """
        Parse an expression up to the first operator whose binding power is lower than `least`.
        """
        self.depth += 1
        if self.depth > MAX_DEPTH:
            message = f'brackets and signs are nested more than {MAX_DEPTH} deep; use definitions'
            raise self.error(message, 'too-deep')
        node = self.operand(self.take())
        while (power := self.binding()) >= least:
            node = self.combined(node, power)
        self.depth -= 1
        return node

    def binding(self) -> int:
        # Return the binding power of the next token; 0 if the token ends the expression.
        token = self.next
        if token is None:
            return 0
        if token.kind == 'degrees' or (token.kind == 'name' and token.text == 'deg'):
            return POSTFIX
        if token.kind == 'operator' and token.text in BINDING:
            entry = token.text in '+-' and self.begins_an_entry()
            stray = token.text == "'" and token.spaced
            return 0 if entry or stray else BINDING[token.text]
        factor = token.kind in ('number', 'name', 'begin') or self.is_next(*CLOSING)
        return PRODUCT if factor and not (self.by_blanks and token.spaced) else 0

    def combined(self, left: Node, power: int) -> Node:
        """
        Return the node of the next operator with `left` as its left operand; parse its right
        operand.
        """
        token = self.next
        assert token is not None  # the binding power is above 0, so a token follows
        if power == POSTFIX:
            return Node("'" if token.text == "'" else 'deg', '', (left,), self.take())
        if token.kind != 'operator' or token.text in CLOSING:
            return Node('*', '', (left, self.expression(SIGN)), token)
        self.at += 1
        if power == POWER:
            return self.power(left, token)
        if not self.by_blanks:
            self.skip_newlines()
        right = self.expression(power + 1)
        if power > SUM:
            return Node(token.text, '', (left, right), token)
        right = Node('neg', '', (right,), token) if token.text == '-' else right
        return Node('+', '', (*(left.parts if left.kind == '+' else (left,)), right), token)

    def power(self, base: Node, operator: FormulaToken) -> Node:
        if any(self.took(*texts) for texts in TRANSPOSE):
            return Node("'", '', (base,), operator)
        node = Node('^', '', (base, self.exponent()), operator)
        if self.is_next('^'):
            message = "'^' after a power is ambiguous; write (a^b)^c or a^(b*c)"
            raise self.error(message, 'ambiguous')
        return node

    def exponent(self) -> Node:
        return self.expression(SIGN) if self.is_next('-', '+') else self.operand(self.take())

    def operand(self, token: FormulaToken) -> Node:
        """Return the operand that begins with a token."""
        if token.kind == 'number':
            return Node('number', token.text, (), token)
        if token.kind == 'name':
            return self.named(token)
        if token.kind == 'begin' or (token.kind, token.text) == ('operator', '['):
            return self.matrix(token)
        if token.kind == 'operator' and token.text in CLOSING:
            return self.bracketed(CLOSING[token.text])
        if token.kind == 'operator' and token.text in '+-':
            node = self.expression(SIGN)
            return Node('neg', '', (node,), token) if token.text == '-' else node
        self.at -= 1
        message = f'{token.written!r} is not expected here; write a number, a name or a bracket'
        raise self.error(message, 'syntax')

    def bracketed(self, closing: str) -> Node:
        before, self.by_blanks = self.by_blanks, False
        self.skip_newlines()
        node = self.expression()
        self.expect(closing)
        self.by_blanks = before
        return node

    def named(self, token: FormulaToken) -> Node:
        called = self.is_next('(', '[')
        name = token.text.lower() if called and token.text not in FUNCTIONS else token.text
        if name == 'frac':
            return Node('/', '', (self.group(), self.group()), token)
        if token.text in MATRIX_CALLS and called:
            return self.matrix_call(token)
        if token.written == '\\sqrt' and self.took('['):
            exponent = Node('/', '', (Node('number', '1', (), token), self.bracketed(']')), token)
            return Node('^', '', (self.group(), exponent), token)
        if name in FUNCTIONS:
            return self.function(token, name)
        return Node('name', token.text, (), token)

    def group(self) -> Node:
        """
        Return the argument of a LaTeX command: a group in braces, or one letter, digit or command.
        """
        if self.took('{'):
            return self.bracketed('}')
        token = self.take()
        if token.kind not in ('name', 'number'):
            message = f'{token.written!r} is not a group; write braces, as in \\frac{{a}}{{b}}'
            raise token.fault(message, 'syntax')
        if token.written[0] != '\\' and len(token.text) > 1:
            self.at -= 1
            self.tokens[self.at] = replace(token, text=token.text[1:], spaced=False)
            token = replace(token, text=token.text[0], written=token.text[0])
        return Node(token.kind, token.text, (), token)

    def matrix_call(self, token: FormulaToken) -> Node:
        arguments = self.arguments()
        if len(arguments) == 1:
            inner = arguments[0]
            if inner.kind == 'matrix' and inner.text == 'list':
                # sympy's Matrix([a, b, c]) is a column.
                return Node('matrix', '', inner.parts, token, (1,) * len(inner.parts))
            return inner
        sizes = [a.text for a in arguments[:2] if a.kind == 'number']
        sized = len(sizes) == 2 and all(size.isdigit() and len(size) < 5 for size in sizes)
        if len(arguments) == 3 and sized and arguments[2].kind == 'matrix':
            entries = arguments[2].parts
            rows, columns = map(int, sizes)
            if rows * columns == len(entries):
                return Node('matrix', '', entries, token, (columns,) * rows)
        message = f'{token.text}: write a list of rows, or rows, columns and a list of entries'
        raise token.fault(message, 'wrong-shape')

    def arguments(self) -> tuple[Node, ...]:
        closing = CLOSING[self.take().text]
        before, self.by_blanks = self.by_blanks, False
        arguments: list[Node] = []
        self.skip_newlines()
        while not arguments or not self.is_next(closing):
            arguments.append(self.expression())
            self.skip_newlines()
            if not self.took(','):
                break
            self.skip_newlines()
        self.expect(closing)
        self.by_blanks = before
        return tuple(arguments)

    def function(self, token: FormulaToken, name: str) -> Node:
        exponent = None
        if self.is_next('^'):
            power = self.take()
            exponent = self.bracketed('}') if self.took('{') else self.exponent()
            minus_one = exponent.kind == 'neg' and exponent.parts[0].text == '1'
            if minus_one and name in INVERSE:
                name, exponent = INVERSE[name], None
        called = self.is_next('(', '[')
        arguments = self.arguments() if called else (self.bare_argument(token, name),)
        arity = FUNCTIONS[name]
        if len(arguments) != arity:
            advice = '; write atan2(y, x)' if 'tan' in name else ''
            takes = f'{token.written} takes {counted(arity, "argument")}'
            raise token.fault(f'{takes}, not {len(arguments)}{advice}', 'wrong-length')
        node = Node('call', name, arguments, token)
        return node if exponent is None else Node('^', '', (node, exponent), power)

    def bare_argument(self, function: FormulaToken, name: str) -> Node:
        # Parse a function's argument without brackets. In LaTeX, `\cos \phi_1 \cos \phi_2` is a
        # product of two cosines, and `\sin 2 t` is sin(2 t).
        token = self.next
        if token is None or token.kind not in ('number', 'name', 'operator', 'begin'):
            message = f'{function.text} has no argument; write {function.text}(...)'
            raise function.fault(message, 'wrong-length')
        if function.written == '\\sqrt':
            return self.group()
        node, after = self.expression(POSTFIX), self.next
        if node.kind != 'number' or after is None or after.kind != 'name':
            return node
        if after.text in FUNCTIONS or after.text == 'frac':
            return node
        return Node('*', '', (node, self.expression(POSTFIX)), after)

    def matrix(self, opening: FormulaToken) -> Node:
        """
        Parse a matrix in brackets or in a LaTeX environment. A line break ends a row in brackets,
        but not in an environment.
        """
        environment, before = opening.kind == 'begin', self.by_blanks
        rows: list[list[Node]] = [[]]
        has_commas = environment or self.row_has_commas()
        while True:
            self.by_blanks = not has_commas
            if environment:
                self.skip_newlines()
            token = self.next
            if token is None:
                closing = 'its \\end' if environment else "']'"
                name = opening.text if environment else "the bracket '['"
                raise self.error(f'{name} is not closed; write {closing}', 'syntax')
            if self.took(']') or (token.kind == 'end' and self.took(token.text)):
                break
            if self.is_next(',', '&'):
                self.take()
                self.skip_newlines()
            elif token.kind in ('newline', 'row') or token.text == ';':
                self.take()
                rows.append([])
                has_commas = environment or self.row_has_commas()
            else:
                rows[-1].append(self.expression())
        self.by_blanks = before
        full = [row for row in rows if row]
        nested = all(n.kind == 'matrix' and len(n.rows) == 1 for row in full for n in row)
        if full and nested and has_commas and len(full) == 1 and not environment:
            # In a matrix of lists, such as [[a, b], [c, d]], each inner list is a row.
            return self.grid(opening, [list(n.parts) for n in full[0]], 'nested')
        is_list = len(full) == 1 and has_commas and not environment
        return self.grid(opening, full, 'list' if is_list else 'rows')

    def row_has_commas(self) -> bool:
        depth = 0
        for token in self.tokens[self.at :]:
            sign = token.text if token.kind == 'operator' else token.kind
            depth += (sign in CLOSING) - (sign in CLOSING.values())
            if depth < 0 or (depth == 0 and sign in ('newline', 'row', ';')):
                return False
            if depth == 0 and sign in (',', '&'):
                return True
        return False

    def grid(self, opening: FormulaToken, rows: list[list[Node]], text: str) -> Node:
        if not rows:
            raise opening.fault('the matrix is empty; write for example [a, b; c, d]', 'empty')
        parts = tuple(node for row in rows for node in row)
        if len(parts) > MAX_MATRIX_ENTRIES:
            raise opening.fault(LARGE_MATRIX, 'too-large')
        return Node('matrix', text, parts, opening, tuple(len(row) for row in rows))

    def begins_an_entry(self) -> bool:
        # As in MATLAB, [a -b] has two entries, but [a - b] and [a-b] have one entry.
        sign, after = self.tokens[self.at], self.tokens[self.at + 1 : self.at + 2]
        return self.by_blanks and sign.spaced and bool(after) and not after[0].spaced
