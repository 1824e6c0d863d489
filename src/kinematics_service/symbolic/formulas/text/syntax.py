r"""
The grammar of formulas: a recursive descent from tokens to a tree; nothing is ever evaluated.

Accepted are sums, products (also implicit: `2 L1 c1`), powers, functions, `\frac`, `\sqrt`,
matrices as `[a b; c d]`, `[[a, b], [c, d]]`, `Matrix(...)` or `\begin{bmatrix}`, transposes,
inverses and cross products.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter

from ....errors import FormulaError
from ....typography import counted
from .tokens import FormulaToken

FUNCTIONS = {
    'sin': 1, 'cos': 1, 'tan': 1, 'asin': 1, 'acos': 1, 'atan': 1, 'arcsin': 1, 'arccos': 1,
    'arctan': 1, 'atan2': 2, 'arctan2': 2, 'sind': 1, 'cosd': 1, 'tand': 1, 'atan2d': 2,
    'sqrt': 1, 'abs': 1, 'cross': 2, 'inv': 1, 'transpose': 1, 'simplify': 1, 'rad': 1,
    'radians': 1, 'deg2rad': 1,
}  # fmt: skip
MATRIX_CALLS = frozenset(('Matrix', 'ImmutableMatrix', 'array'))
INVERSE = {'sin': 'asin', 'cos': 'acos', 'tan': 'atan'}
DEEPEST = 60
# A Jacobian of dozens of joints has fewer.
MOST_ENTRIES = 1000


@dataclass(frozen=True)
class Node:
    """
    A part of a formula.

    Parameters
    ----------
    kind
        `number`, `name`, `call`, `matrix`, or an operator: + - * / ^ x (cross), neg, deg, '.
    text
        The number, the name, or the function.
    parts
        Operands, arguments, or the entries of a matrix row by row.
    at
        The first word, for messages.
    rows
        Entries in each row of a matrix.
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
        All of it.
    last
        What a message about a missing end points at.

    Raises
    ------
    FormulaError
        The words do not make an expression.
    """
    parser = _Parser(list(tokens), last)
    parser.skip_newlines()
    node = parser.sum()
    parser.skip_newlines()
    if parser.next is not None:
        raise parser.error(f'{parser.next.written!r} was not expected here')
    return node


def parse_lines(tokens: Sequence[FormulaToken], last: FormulaToken) -> Node:
    """Return the matrix of lines without brackets, a row each."""
    opening = FormulaToken('operator', '[', '[', last.line, last.column, False)
    closing = FormulaToken('operator', ']', ']', last.line, last.column, False)
    return parse([opening, *tokens, closing], last)


class _Parser:
    def __init__(self, tokens: list[FormulaToken], last: FormulaToken) -> None:
        self.tokens = tokens
        self.last = last
        self.at = 0
        self.depth = 0
        self.by_blanks = False  # inside a row whose entries blanks separate

    @property
    def next(self) -> FormulaToken | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def error(self, message: str) -> FormulaError:
        token = self.next or self.last
        return token.fault(message)

    def is_next(self, *texts: str) -> bool:
        token = self.next
        return token is not None and token.kind in ('operator', 'row') and token.text in texts

    def take(self) -> FormulaToken:
        token = self.next
        if token is None:
            raise self.error('the formula ends too early')
        self.at += 1
        return token

    def expect(self, text: str) -> None:
        self.skip_newlines()
        if not self.is_next(text):
            found = 'the end' if self.next is None else repr(self.next.written)
            raise self.error(f'expected {text!r}, found {found}')
        self.at += 1

    def skip_newlines(self) -> None:
        while self.next is not None and self.next.kind == 'newline':
            self.at += 1

    def sum(self) -> Node:
        self.depth += 1
        if self.depth > DEEPEST:
            raise self.error(f'brackets nested more than {DEEPEST} deep')
        node = self.product()
        while self.is_next('+', '-') and not self._begins_an_entry():
            operator = self.take()
            self._line_goes_on()
            node = Node(operator.text, '', (node, self.product()), operator)
        self.depth -= 1
        return node

    def product(self) -> Node:
        node = self.signed()
        while True:
            if self.is_next('*', '/', 'x'):
                operator = self.take()
                self._line_goes_on()
                node = Node(operator.text, '', (node, self.signed()), operator)
            elif self._begins_a_factor():
                at = self.next
                assert at is not None
                node = Node('*', '', (node, self.power()), at)
            else:
                return node

    def signed(self) -> Node:
        signs = []
        while self.is_next('+', '-'):
            signs.append(self.take())
            if len(signs) > DEEPEST:
                raise self.error('too many signs')
        node = self.power()
        for sign in reversed(signs):
            node = Node('neg', '', (node,), sign) if sign.text == '-' else node
        return node

    def power(self) -> Node:
        node = self.postfix(self.primary())
        if self.is_next('^'):
            operator = self.take()
            if self.next is not None and self.next.text == 'T':
                self.take()
                return self.postfix(Node("'", '', (node,), operator))
            if exponent := self._braced_transpose():
                return self.postfix(Node("'", '', (node,), exponent))
            node = Node('^', '', (node, self.exponent()), operator)
        return self.postfix(node)

    def _braced_transpose(self) -> FormulaToken | None:
        ahead = self.tokens[self.at : self.at + 3]
        if [t.text for t in ahead] in (['{', 'T', '}'], ['{', 'top', '}']):
            self.at += 3
            return ahead[1]
        return None

    def exponent(self) -> Node:
        if self.is_next('-', '+'):
            sign = self.take()
            node = self.primary()
            return Node('neg', '', (node,), sign) if sign.text == '-' else node
        return self.primary()

    def postfix(self, node: Node) -> Node:
        first = self.at
        while (token := self.next) is not None:
            if self.at - first > DEEPEST:
                raise self.error('too many signs')
            if token.kind == 'degrees' or (token.kind == 'name' and token.text == 'deg'):
                node = Node('deg', '', (node,), self.take())
            elif token.text == "'" and not token.spaced:
                node = Node("'", '', (node,), self.take())
            else:
                break
        return node

    def primary(self) -> Node:
        self.depth += 1
        if self.depth > 4 * DEEPEST:
            raise self.error('nested too deep')
        token = self.take()
        node = self._primary_of(token)
        self.depth -= 1
        return node

    def _primary_of(self, token: FormulaToken) -> Node:
        if token.kind == 'number':
            return Node('number', token.text, (), token)
        if token.kind == 'name':
            return self._named(token)
        if token.kind == 'begin':
            return self._environment(token)
        if token.kind == 'operator' and token.text in '({':
            return self._bracketed({'(': ')', '{': '}'}[token.text])
        if token.kind == 'operator' and token.text == '[':
            return self._matrix(token)
        self.at -= 1
        raise self.error(f'{token.written!r} was not expected here: a number, a name or a bracket')

    def _bracketed(self, closing: str) -> Node:
        before, self.by_blanks = self.by_blanks, False
        self.skip_newlines()
        node = self.sum()
        self.expect(closing)
        self.by_blanks = before
        return node

    def _named(self, token: FormulaToken) -> Node:
        if token.text == 'frac':
            parts = []
            for _ in range(2):
                self.expect('{')
                parts.append(self._bracketed('}'))
            return Node('/', '', tuple(parts), token)
        if token.text in MATRIX_CALLS and self.is_next('('):
            return self._matrix_call(token)
        if token.text in FUNCTIONS:
            return self._function(token)
        return Node('name', token.text, (), token)

    def _matrix_call(self, token: FormulaToken) -> Node:
        arguments = self._arguments()
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
        raise token.fault(f'{token.text} takes a list of rows, or rows, columns and entries')

    def _arguments(self) -> tuple[Node, ...]:
        self.expect('(')
        before, self.by_blanks = self.by_blanks, False
        arguments = [self._argument()]
        while self.is_next(','):
            self.take()
            self.skip_newlines()
            if self.is_next(')'):
                break
            arguments.append(self._argument())
        self.expect(')')
        self.by_blanks = before
        return tuple(arguments)

    def _argument(self) -> Node:
        self.skip_newlines()
        node = self.sum()
        self.skip_newlines()
        return node

    def _function(self, token: FormulaToken) -> Node:
        name, exponent = token.text, None
        if self.is_next('^'):
            power = self.take()
            exponent = self._bracketed('}') if self._took('{') else self.exponent()
            minus_one = exponent.kind == 'neg' and exponent.parts[0].text == '1'
            if minus_one and name in INVERSE:
                name, exponent = INVERSE[name], None
        arguments = self._arguments() if self.is_next('(') else (self._bare_argument(token),)
        wanted = FUNCTIONS[name]
        if len(arguments) != wanted:
            takes = f'{name} takes {counted(wanted, "argument")}'
            raise token.fault(f'{takes}, not {len(arguments)}')
        node = Node('call', name, arguments, token)
        return node if exponent is None else Node('^', '', (node, exponent), power)

    def _took(self, text: str) -> bool:
        if self.is_next(text):
            self.at += 1
            return True
        return False

    def _bare_argument(self, function: FormulaToken) -> Node:
        # LaTeX: `\cos \phi_1 \cos \phi_2` is a product of two, `\sin 2 t` is sin(2 t).
        token = self.next
        if token is None or token.kind not in ('number', 'name', 'operator', 'begin'):
            raise function.fault(f'{function.text} has no argument: write {function.text}(...)')
        node = self.postfix(self.primary())
        after = self.next
        if node.kind != 'number' or after is None or after.kind != 'name':
            return node
        if after.text in FUNCTIONS or after.text == 'frac':
            return node
        return Node('*', '', (node, self.primary()), after)

    def _environment(self, opening: FormulaToken) -> Node:
        before, self.by_blanks = self.by_blanks, False
        rows: list[list[Node]] = [[]]
        while True:
            self.skip_newlines()
            token = self.next
            if token is None:
                raise self.error(f'\\begin{{{opening.text}}} has no \\end')
            if token.kind == 'end':
                self.take()
                break
            if token.kind == 'row':
                self.take()
                rows.append([])
            elif token.text == '&':
                self.take()
            else:
                rows[-1].append(self.sum())
                self.skip_newlines()
                if self.next is not None and not (
                    self.next.kind in ('row', 'end') or self.next.text == '&'
                ):
                    raise self.error(f'{self.next.written!r} was not expected here: & or \\\\')
        self.by_blanks = before
        return self._grid(opening, [row for row in rows if row], 'environment')

    def _matrix(self, opening: FormulaToken) -> Node:
        before = self.by_blanks
        rows: list[list[Node]] = [[]]
        has_commas = self._row_has_commas()
        while True:
            token = self.next
            if token is None:
                raise self.error("the bracket '[' is not closed")
            self.by_blanks = not has_commas
            if self.is_next(']'):
                self.take()
                break
            if self.is_next(',', '&'):
                self.take()
                self.skip_newlines()
            elif token.kind in ('newline', 'row') or token.text == ';':
                self.take()
                rows.append([])
                has_commas = self._row_has_commas()
            else:
                rows[-1].append(self.sum())
        self.by_blanks = before
        full = [row for row in rows if row]
        nested = all(n.kind == 'matrix' and len(n.rows) == 1 for row in full for n in row)
        if full and nested and has_commas and len(full) == 1:
            # [[a, b], [c, d]]: each inner list is a row.
            return self._grid(opening, [list(n.parts) for n in full[0]], 'nested')
        return self._grid(opening, full, 'list' if len(full) == 1 and has_commas else 'rows')

    def _row_has_commas(self) -> bool:
        depth = 0
        for token in self.tokens[self.at :]:
            if token.text in ('(', '[', '{') and token.kind == 'operator':
                depth += 1
            elif token.text in (')', ']', '}') and token.kind == 'operator':
                depth -= 1
                if depth < 0:
                    return False
            elif depth == 0 and token.kind == 'operator' and token.text in (',', '&'):
                return True
            elif depth == 0 and (token.kind in ('newline', 'row') or token.text == ';'):
                return False
        return False

    def _grid(self, opening: FormulaToken, rows: list[list[Node]], text: str) -> Node:
        if not rows:
            raise opening.fault('a matrix without entries')
        parts = tuple(node for row in rows for node in row)
        if len(parts) > MOST_ENTRIES:
            raise opening.fault(f'a matrix of more than {MOST_ENTRIES} entries')
        return Node('matrix', text, parts, opening, tuple(len(row) for row in rows))

    def _line_goes_on(self) -> None:
        if not self.by_blanks:
            self.skip_newlines()

    def _begins_an_entry(self) -> bool:
        # MATLAB: [a -b] has two entries, [a - b] and [a-b] one.
        if not self.by_blanks:
            return False
        sign, after = self.tokens[self.at], self.tokens[self.at + 1 : self.at + 2]
        return sign.spaced and bool(after) and not after[0].spaced

    def _begins_a_factor(self) -> bool:
        token = self.next
        if token is None or (self.by_blanks and token.spaced):
            return False
        if token.kind in ('number', 'name', 'begin'):
            return True
        return token.kind == 'operator' and token.text in ('(', '[', '{')
