# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Translate functions of the kernel's source to C, statement by statement.

The kernel's dialect of Python has types by annotations. Only the part of the dialect that the
exported functions use is translated; anything else raises TypeError. The kernel can compute
several poses side by side, in lanes; the translation has one lane.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Sequence
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

WIDTH = 99  # columns of a line in C
# The C type of each annotation. Tuples of numbers are structures.
TYPES = {
    'float': 'double', 'int': 'int', 'bool': 'int', 'Int32': 'int', 'None': 'void',
    'Flat': 'double *', 'Numbers': 'double *', 'FlatIntegers': 'int *', 'WholeNumbers': 'int *',
    'tuple[float, float]': 'pair', 'tuple[float, float, float]': 'triple',
}  # fmt: skip
TUPLES = ('pair', 'triple')
ARITHMETIC = {'Add': '+', 'Sub': '-', 'Mult': '*', 'Div': '/'}
COMPARISONS = {
    'Eq': '==', 'NotEq': '!=', 'Lt': '<', 'LtE': '<=', 'Gt': '>', 'GtE': '>=', 'Is': '==',
    'IsNot': '!=',
}  # fmt: skip
OPERATORS = {
    **ARITHMETIC, **COMPARISONS, 'FloorDiv': '/', 'Mod': '%', 'LShift': '<<', 'RShift': '>>',
    'BitAnd': '&', 'BitOr': '|', 'And': '&&', 'Or': '||', 'Not': '!', 'USub': '-',
}  # fmt: skip
# How tightly the outer operator of an expression binds. An operand that binds less than its
# operator needs parentheses.
ATOM = 3
PRODUCT = 2
SUM = 1
OTHER = 0


class Text(NamedTuple):
    """
    An expression in C.

    Attributes
    ----------
    text, type
        The expression and its C type.
    level
        How tightly its operator binds: ATOM, PRODUCT, SUM or OTHER.
    array
        The name of the local array that it is a part of.
    """

    text: str
    type: str = 'double'
    level: int = ATOM
    array: str = ''

    def at(self, level: int) -> str:
        """Return the text as an operand, in parentheses if it binds less than `level`."""
        return self.text if self.level >= level else f'({self.text})'


def operation(a: Text, sign: str, b: Text) -> Text:
    """Return the sum, difference, product or quotient of two expressions."""
    if (sign, b.text) == ('*', '1'):
        return a
    level = SUM if sign in '+-' else PRODUCT
    kind = next((one for one in ('double', 'long long') if one in (a.type, b.type)), 'int')
    return Text(f'{a.at(level)} {sign} {b.at(level + 1)}', kind, level)


def literal(number: float) -> str:
    """Return a number in C, exactly; a number with few binary digits in decimals."""
    if isinstance(number, int):
        return str(int(number))
    if number != number:
        return 'NAN'
    if number in (float('inf'), float('-inf')):
        return 'INFINITY' if number > 0.0 else '-INFINITY'
    short = abs(number) < 1e6 and number % 0.125 == 0.0
    return repr(float(number)) if short else float(number).hex()


def wrapped(line: str) -> list[str]:
    """Return a line of C as lines of at most WIDTH columns."""
    own = line[: len(line) - len(line.lstrip())]
    own += '// ' if line.startswith('// ') else '    '
    return textwrap.wrap(
        line, WIDTH, subsequent_indent=own, break_long_words=False, break_on_hyphens=False
    )


class OneLane(ast.NodeTransformer):
    """Replace the number of lanes by 1, and remove branches for more lanes."""

    def visit_arguments(self, node: ast.arguments) -> ast.arguments:
        """Remove the parameter `lanes`."""
        node.args = [one for one in node.args if one.arg != 'lanes']
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace `lanes` by 1."""
        return ast.Constant(1) if node.id == 'lanes' else node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """Compute a comparison of constants."""
        self.generic_visit(node)
        match node:
            case ast.Compare(ast.Constant(a), [ast.Eq()], [ast.Constant(b)]):
                return ast.Constant(a == b)
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        """Remove conditions that are true."""
        self.generic_visit(node)
        node.values = [one for one in node.values if not isinstance(one, ast.Constant)]
        return node if len(node.values) > 1 else node.values[0]

    def visit_If(self, node: ast.If | ast.IfExp) -> Any:
        """Keep one branch if the condition is constant."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node

    visit_IfExp = visit_If


class Translation:
    """
    Functions of the kernel in C, each after those that it calls.

    Parameters
    ----------
    prefix, std
        Text before the names of functions: of the translated ones, and of those of the C library.
    head
        Text before each definition, such as `static inline`.
    fields
        The C types of the fields of the kernel's classes, by the name of the class.

    Attributes
    ----------
    used
        The names of the fields that the functions use, by the name of the class.
    """

    def __init__(
        self, prefix: str, std: str, head: str, fields: dict[str, dict[str, str]]
    ) -> None:
        self.prefix, self.std, self.head, self.fields = prefix, std, head, fields
        self.functions: dict[FunctionType, FunctionText] = {}
        self.used: dict[str, set[str]] = {name: set() for name in fields}

    def function(self, function: FunctionType) -> 'FunctionText':
        """Return a function in C; translate it if it is new."""
        if function not in self.functions:
            name = self.prefix + function.__name__.lstrip('_')
            while name in [one.name for one in self.functions.values()]:
                name += '_'
            text = self.functions[function] = FunctionText(self, name, function)
            text.translate()
            self.functions[function] = self.functions.pop(function)  # after those that it calls
        return self.functions[function]

    def text(self) -> str:
        """Return the definitions of all functions."""
        return '\n'.join(one.text for one in self.functions.values())


class FunctionText:
    """
    A function of the kernel in C.

    Attributes
    ----------
    name, text
        Its name and definition in C.
    parameters
        The names of its parameters.
    types
        The C types of its parameters and variables.
    written
        The names of parameters and variables whose arrays the function writes.
    """

    def __init__(self, whole: Translation, name: str, function: FunctionType) -> None:
        self.whole, self.name, self.text = whole, name, ''
        self.names = function.__globals__
        tree = OneLane().visit(ast.parse(inspect.getsource(function)))
        self.node: ast.FunctionDef = ast.fix_missing_locations(tree).body[0]
        self.parameters = [one.arg for one in self.node.args.args]
        self.types = {one.arg: self._type_of(one.annotation) for one in self.node.args.args}
        self.result = self._type_of(self.node.returns)
        self.written: set[str] = set()
        self.parts: dict[str, set[str]] = {}  # addresses, and the arrays that they are parts of
        self.lengths: dict[str, int] = {}  # of local arrays
        self.temporaries = 0

    def translate(self) -> None:
        """Translate the function, twice: at first it is not known which arrays it writes."""
        for _ in range(2):
            self.temporaries = 0
            body = self._block(self.node.body)
        kinds = ', '.join(self._declared(name) for name in self.parameters)
        head = f'{self.whole.head}{self.result} {self.name}({kinds or "void"})'
        needed = set(re.findall(r'\w+', ' '.join(body))).difference(self.parameters)
        own = [self._declared(name) for name in self.types if name in needed]
        lines = [*(f'    {line};' for line in own), *body]
        self.text = '\n'.join(
            one for line in [head, '{', *lines, '}', ''] for one in wrapped(line)
        )

    def _declared(self, name: str) -> str:
        kind = self.types[name]
        if name in self.lengths:
            return f'{kind} {name}[{self.lengths[name]}] = {{0}}'
        if not kind.endswith('*'):
            return f'{kind} {name}'
        return f'{"const " * (name not in self.written)}{kind}{name}'

    def _type_of(self, annotation: ast.expr | None) -> str:
        text = ast.unparse(annotation) if annotation else ''
        kind = TYPES.get(text, f'{text} *')
        if text not in TYPES and text not in self.whole.fields:
            raise TypeError(f'{self.name}: {text} has no type in C')
        return self.whole.prefix + kind if text not in TYPES or kind in TUPLES else kind

    def _write(self, array: str) -> None:
        # Notes that the function writes to an array, which may be a part of another array.
        if array and array not in self.written:
            self.written.add(array)
            for one in self.parts.get(array, ()):
                self._write(one)

    def _new(self, word: str, kind: str) -> Text:
        # Returns a new variable.
        self.temporaries += 1
        name = f'{word}_{self.temporaries}'
        self.types[name] = kind
        return Text(name, kind)

    def _block(self, body: list[ast.stmt]) -> list[str]:
        return [f'    {line}' for one in body for line in self._statement(one)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Expr(ast.Constant()) | ast.Pass():
                return []
            case ast.Expr(value):
                return [f'{self._expression(value).text};']
            case ast.Return(None) | ast.Break() | ast.Continue():
                return [f'{ast.unparse(node)};']
            case ast.Return(ast.Tuple(values)):
                numbers = ', '.join(self._expression(one).text for one in values)
                return [f'const {self.result} result = {{{{{numbers}}}}};', 'return result;']
            case ast.Return(ast.expr() as value):
                return [f'return {self._expression(value).text};']
            case ast.If(
                test,
                [ast.Assign([ast.Tuple([ast.Name(), ast.Name()] as old)], ast.Tuple(new))],
                [],
            ):
                # Select numbers instead of branching: a branch would be mispredicted.
                chosen = ast.Tuple([ast.IfExp(test, *pair) for pair in zip(new, old)])
                return self._assign_several(old, chosen)
            case ast.If(test, body, other):
                lines = [f'if ({self._expression(test).text}) {{', *self._block(body)]
                return [*lines, '} else {', *self._block(other), '}'] if other else [*lines, '}']
            case ast.While(test, body):
                return [f'while ({self._expression(test).text}) {{', *self._block(body), '}']
            case ast.For(ast.Name(name), ast.Call(ast.Name('range'), bounds), body):
                return self._loop(name, bounds, body)
            case ast.Assign([ast.Tuple(targets)], value):
                return self._assign_several(targets, value)
            case ast.Assign(targets, value):
                return [line for one in targets for line in self._assign(one, value)]
            case ast.AnnAssign(ast.Name(name) as target, annotation, ast.expr() as value):
                return self._assign_annotated(target, ast.unparse(annotation), value)
            case ast.AugAssign(target, by, value):
                sign, text = OPERATORS[type(by).__name__], self._expression(value).text
                return [f'{self._place(target)} {sign}= {text};']
        raise TypeError(f'{self.name}: cannot be translated: {ast.unparse(node)}')

    def _loop(self, name: str, bounds: list[ast.expr], body: list[ast.stmt]) -> list[str]:
        name = self._new('turn', 'int').text if name == '_' else name
        self.types[name] = 'int'
        texts = [self._expression(one).at(SUM) for one in bounds]
        start, end = texts[:2] if len(texts) > 1 else ('0', texts[0])
        step = texts[2] if len(texts) > 2 else '1'
        sign = '>' if step[0] == '-' else '<'
        head = f'for ({name} = {start}; {name} {sign} {end}; {name} += {step}) {{'
        return [head, *self._block(body), '}']

    def _assign_several(self, targets: list[ast.expr], value: ast.expr) -> list[str]:
        if not isinstance(value, ast.Tuple):
            call = self._expression(value)
            both = self._new('both', call.type)
            parts = [Text(f'{both.text}.at[{k}]') for k in range(len(targets))]
            lines = [f'{both.text} = {call.text};']
            return lines + [self._store(one, part) for one, part in zip(targets, parts)]
        names = {ast.unparse(one) for one in targets}
        read = {ast.unparse(one) for later in value.elts[1:] for one in ast.walk(later)}
        if not names & read:
            pairs = zip(targets, value.elts)
            return [line for one, part in pairs for line in self._assign(one, part)]
        texts = [self._expression(part) for part in value.elts]
        held = [self._new('old', text.type) for text in texts]
        lines = [f'{one.text} = {text.text};' for one, text in zip(held, texts)]
        return lines + [self._store(one, part) for one, part in zip(targets, held)]

    def _assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        match value:
            case ast.List([ast.Constant()]):
                value = ast.BinOp(value, ast.Mult(), ast.Constant(1))
        match value:
            case ast.BinOp(ast.List([ast.Constant(zero)]), _, ast.Constant(int() as length)):
                name = ast.unparse(target)
                self.types[name] = 'double' if isinstance(zero, float) else 'int'
                self.lengths[name] = length
                return []
        return [self._store(target, self._expression(value))]

    def _assign_annotated(self, target: ast.Name, kind: str, value: ast.expr) -> list[str]:
        # The kernel's `int` has 64 bits, which an integer that is computed from a number may need.
        found = self._expression(value)
        self.types[target.id] = TYPES[kind]
        if kind == 'int' and found.text.startswith('(int)'):
            self.types[target.id] = 'long long'
            found = found._replace(text=found.text.replace('(int)', '(long long)', 1))
        return [self._store(target, found)]

    def _store(self, target: ast.expr, value: Text) -> str:
        if isinstance(target, ast.Name):
            self.types.setdefault(target.id, value.type)
            if value.array:
                self.parts.setdefault(target.id, set()).add(value.array)
                if target.id in self.written:
                    self._write(value.array)
        return f'{self._place(target)} = {value.text};'

    def _place(self, target: ast.expr) -> str:
        if isinstance(target, ast.Subscript):
            self._write(ast.unparse(target.value))
        return self._expression(target).text

    def _expression(self, node: ast.expr) -> Text:
        match node:
            case ast.Constant(value):
                return self._constant(value)
            case ast.Name(name) if name in self.types:
                kind = self.types[name] + (' *' if name in self.lengths else '')
                return Text(name, kind, array=name if kind.endswith('*') else '')
            case ast.Name() | ast.Attribute(ast.Name()) if self._known(node) is not None:
                return self._constant(self._known(node))
            case ast.Attribute(value, field):
                of = self._expression(value)
                name = of.type.removeprefix(self.whole.prefix).removesuffix(' *')
                self.whole.used[name].add(field)
                return Text(f'{of.text}->{field}', self.whole.fields[name][field])
            case ast.Subscript(value, index):
                of, at = self._expression(value), self._expression(index).text
                if of.type.removeprefix(self.whole.prefix) in TUPLES:
                    return Text(f'{of.text}.at[{at}]')
                return Text(f'{of.text}[{at}]', of.type.removesuffix(' *'))
            case ast.UnaryOp(by, value):
                one, sign = self._expression(value), OPERATORS[type(by).__name__]
                return Text(f'{sign}{one.at(ATOM)}', one.type, PRODUCT)
            case ast.BinOp(left, by, right):
                return self._operation(left, type(by).__name__, right)
            case ast.Compare(left, operators, others):
                pairs = zip([left, *others], operators, others)
                parts = [self._operation(a, type(by).__name__, b) for a, by, b in pairs]
                if len(parts) == 1:
                    return parts[0]
                return Text(' && '.join(f'({one.text})' for one in parts), 'int', OTHER)
            case ast.BoolOp(by, values):
                sign = OPERATORS[type(by).__name__]
                text = f' {sign} '.join(self._expression(one).at(SUM) for one in values)
                return Text(text, 'int', OTHER)
            case ast.IfExp(test, body, other):
                a, b = self._expression(body), self._expression(other)
                text = f'{self._expression(test).at(SUM)} ? {a.at(SUM)} : {b.at(SUM)}'
                return Text(text, 'double' if 'double' in (a.type, b.type) else a.type, OTHER)
            case ast.Call(function, arguments):
                return self._call(function, arguments)
        raise TypeError(f'{self.name}: cannot be translated: {ast.unparse(node)}')

    def _constant(self, value: Any) -> Text:
        if value is None:
            return Text('0', 'int')
        kind = 'double' if isinstance(value, float) else 'int'
        return Text(literal(value), kind, PRODUCT if value < 0 else ATOM)

    def _known(self, node: ast.expr) -> Any:
        # Returns the value of a name outside of the function: a number or a function.
        if isinstance(node, ast.Name):
            return self.names.get(node.id)
        assert isinstance(node, ast.Attribute)
        module = self.names.get(ast.unparse(node.value))
        return getattr(module, node.attr) if isinstance(module, ModuleType) else None

    def _operation(self, left: ast.expr, name: str, right: ast.expr) -> Text:
        a, b = self._expression(left), self._expression(right)
        if name in ARITHMETIC:
            return operation(a, ARITHMETIC[name], b)
        least = SUM if name in COMPARISONS else ATOM
        return Text(f'{a.at(least)} {OPERATORS[name]} {b.at(least)}', 'int', OTHER)

    def _call(self, function: ast.expr, arguments: list[ast.expr]) -> Text:
        name = ast.unparse(function)
        parts = [self._expression(one) for one in arguments]
        texts = [one.text for one in parts]
        if name in ('min', 'max'):
            a, b, sign = *(one.at(SUM) for one in parts), '<' if name == 'min' else '>'
            kind = 'double' if 'double' in (parts[0].type, parts[1].type) else 'int'
            return Text(f'{b} {sign} {a} ? {b} : {a}', kind, OTHER)
        if name in ('int', 'float'):
            return Text(f'({TYPES[name]}){parts[0].at(ATOM)}', TYPES[name], PRODUCT)
        if name == 'abs' or name.startswith('math.'):
            called = 'fabs' if name == 'abs' else name.removeprefix('math.')
            return Text(f'{self.whole.std}{called}({", ".join(texts)})')
        if name == 'arrays.after':
            begin, place = parts
            return operation(begin, '+', place)._replace(type=begin.type, array=begin.array)
        if name in ('arrays.copy', 'arrays.fill'):
            self._write(parts[0].array)
            return Text(f'{self.whole.prefix}{name[7:]}({", ".join(texts)})', 'void')
        return self._translated_call(self._known(function), parts)

    def _translated_call(self, function: Any, parts: Sequence[Text]) -> Text:
        called = self.whole.function(function)
        texts = []
        for parameter, part in zip(called.parameters, parts):  # without the number of lanes
            if parameter in called.written:
                self._write(part.array)
            wide = part.type == 'long long' and called.types[parameter] == 'int'
            texts.append(f'(int)({part.text})' if wide else part.text)
        return Text(f'{called.name}({", ".join(texts)})', called.result)
