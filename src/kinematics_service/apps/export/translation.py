# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Translate functions of the kernel's source to C, statement by statement.

The kernel's dialect of Python has types by annotations. Only the part of the dialect that the
exported functions use is translated; anything else raises TypeError.
"""

import ast
import inspect
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

# The C type of each annotation.
TYPES = {
    'float': 'double',
    'int': 'int',
    'bool': 'int',
    'Int32': 'int',
    'None': 'void',
    'Flat': 'double *',
    'Numbers': 'double *',
    'FlatIntegers': 'int *',
    'WholeNumbers': 'int *',
    'tuple[float, float]': 'pair',
    'tuple[float, float, float]': 'triple',
}
TUPLES = ('pair', 'triple')  # structures of doubles
# Operators of Python and of C.
ARITHMETIC = {'Add': '+', 'Sub': '-', 'Mult': '*', 'Div': '/'}
COMPARISONS = {
    'Eq': '==', 'NotEq': '!=', 'Lt': '<', 'LtE': '<=', 'Gt': '>', 'GtE': '>=', 'Is': '==',
    'IsNot': '!=',
}  # fmt: skip
OPERATORS = {
    **ARITHMETIC, **COMPARISONS, 'FloorDiv': '/', 'Mod': '%', 'LShift': '<<', 'RShift': '>>',
    'BitAnd': '&', 'BitOr': '|', 'And': '&&', 'Or': '||', 'Not': '!', 'USub': '-',
}  # fmt: skip
# How tightly an operator binds, so that the order of operations needs few parentheses.
ATOM, PRODUCT, SUM, OTHER = 3, 2, 1, 0


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
    type: str
    level: int = ATOM
    array: str = ''

    def at(self, level: int) -> str:
        """Return the text as an operand, in parentheses if it binds less than `level`."""
        return self.text if self.level >= level else f'({self.text})'


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
    """

    def __init__(
        self, prefix: str, std: str, head: str, fields: dict[str, dict[str, str]]
    ) -> None:
        self.prefix, self.std, self.head, self.fields = prefix, std, head, fields
        self.functions: dict[str, FunctionText] = {}

    def function(self, function: FunctionType) -> 'FunctionText':
        """Return a function in C; translate it if it is new."""
        name = self.prefix + function.__name__.lstrip('_')
        if name not in self.functions:
            text = self.functions[name] = FunctionText(self, name, function)
            text.translate()
            self.functions[name] = self.functions.pop(name)  # after those that it calls
        return self.functions[name]

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
    written
        The names of parameters whose arrays the function writes.
    """

    def __init__(self, whole: Translation, name: str, function: FunctionType) -> None:
        self.whole, self.name, self.text = whole, name, ''
        self.names = function.__globals__
        node = ast.parse(inspect.getsource(function)).body[0]
        assert isinstance(node, ast.FunctionDef)
        self.node, self.parameters = node, [one.arg for one in node.args.args]
        self.types = {one.arg: self._type_of(one.annotation) for one in node.args.args}
        self.result = self._type_of(node.returns)
        self.written: set[str] = set()
        self.parts: dict[str, str] = {}  # local addresses, and the arrays that they are parts of
        self.lengths: dict[str, int] = {}  # of local arrays
        self.temporaries = 0

    def translate(self) -> None:
        """Translate the function, twice: at first it is not known which arrays it writes."""
        for _ in range(2):
            self.temporaries = 0
            body = [line for one in self.node.body for line in self._statement(one)]
        kinds = [self._declared(name) for name in self.parameters]
        lines = [f'{self.whole.head}{self.result} {self.name}({", ".join(kinds)})', '{']
        for name, kind in self.types.items():
            if name in self.lengths:
                lines.append(f'    {kind} {name}[{self.lengths[name]}] = {{0}};')
            elif name not in self.parameters:
                lines.append(f'    {self._declared(name)};')
        self.text = '\n'.join([*lines, *(f'    {line}' for line in body), '}', ''])

    def _declared(self, name: str) -> str:
        kind = self.types[name]
        constant = kind.endswith('*') and not kind.startswith('const') and name not in self.written
        return f'{"const " * constant}{kind}{" " * (not kind.endswith("*"))}{name}'

    def _type_of(self, annotation: ast.expr | None) -> str:
        text = ast.unparse(annotation) if annotation else ''
        if text in self.whole.fields:
            return f'const {self.whole.prefix}{text} *'
        if text not in TYPES:
            raise TypeError(f'{self.name}: {text} has no type in C')
        kind = TYPES[text]
        return self.whole.prefix + kind if kind in TUPLES else kind

    def _write(self, array: str) -> None:
        # Notes that the function writes to an array, which may be a part of another array.
        while array and array not in self.written:
            self.written.add(array)
            array = self.parts.get(array, '')

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Expr(ast.Constant(str())) | ast.Pass():
                return []
            case ast.Expr(value):
                return [f'{self._expression(value).text};']
            case ast.Return(None):
                return ['return;']
            case ast.Return(ast.Tuple(values)):
                numbers = ', '.join(self._expression(one).text for one in values)
                return [f'const {self.result} result = {{{{{numbers}}}}};', 'return result;']
            case ast.Return(ast.expr() as value):
                return [f'return {self._expression(value).text};']
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
            case ast.AnnAssign(ast.Name(name) as target, annotation, value) if value:
                self.types[name] = self._type_of(annotation)
                return self._assign(target, value)
            case ast.AugAssign(target, operator, value):
                place = self._place(target)
                text = self._expression(value).text
                return [f'{place} {OPERATORS[type(operator).__name__]}= {text};']
            case ast.Break() | ast.Continue():
                return [f'{ast.unparse(node)};']
        raise TypeError(f'{self.name}: cannot be translated: {ast.unparse(node)}')

    def _block(self, body: list[ast.stmt]) -> list[str]:
        return [f'    {line}' for one in body for line in self._statement(one)]

    def _loop(self, name: str, bounds: list[ast.expr], body: list[ast.stmt]) -> list[str]:
        if name == '_':
            self.temporaries += 1
            name = f'turn_{self.temporaries}'
        self.types[name] = 'int'
        texts = [self._expression(one).text for one in bounds]
        start, end = texts[:2] if len(texts) > 1 else ('0', texts[0])
        step = texts[2] if len(texts) > 2 else '1'
        sign = '>' if step[0] == '-' else '<'
        head = f'for ({name} = {start}; {name} {sign} {end}; {name} += {step}) {{'
        return [head, *self._block(body), '}']

    def _assign_several(self, targets: list[ast.expr], value: ast.expr) -> list[str]:
        if not isinstance(value, ast.Tuple):
            self.temporaries += 1
            both, call = f'both_{self.temporaries}', self._expression(value)
            self.types[both] = call.type
            parts = [Text(f'{both}.at[{k}]', 'double') for k in range(len(targets))]
            lines = [f'{both} = {call.text};']
            return lines + [self._store(one, part) for one, part in zip(targets, parts)]
        names = {ast.unparse(one) for one in targets}
        read = {ast.unparse(one) for later in value.elts[1:] for one in ast.walk(later)}
        if not names & read:
            pairs = zip(targets, value.elts)
            return [line for one, part in pairs for line in self._assign(one, part)]
        lines, held = [], []
        for part in value.elts:
            self.temporaries += 1
            text = self._expression(part)
            held.append(Text(f'old_{self.temporaries}', text.type))
            self.types[held[-1].text] = text.type
            lines.append(f'{held[-1].text} = {text.text};')
        return lines + [self._store(one, part) for one, part in zip(targets, held)]

    def _assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        match value:
            case ast.BinOp(
                ast.List([ast.Constant(zero)]), ast.Mult(), ast.Constant(int() as length)
            ):
                name = ast.unparse(target)
                self.types[name] = 'double' if isinstance(zero, float) else 'int'
                self.lengths[name] = length
                return []
        return [self._store(target, self._expression(value))]

    def _store(self, target: ast.expr, value: Text) -> str:
        if isinstance(target, ast.Name):
            self.types.setdefault(target.id, value.type)
            if value.array:
                self.parts[target.id] = value.array
                if target.id in self.written:
                    self._write(value.array)
        return f'{self._place(target)} = {value.text};'

    def _place(self, target: ast.expr) -> str:
        if isinstance(target, ast.Subscript):
            self._write(ast.unparse(target.value))
        return self._expression(target).text

    def _expression(self, node: ast.expr) -> Text:
        match node:
            case ast.Constant(None):
                return Text('0', 'const void *')
            case ast.Constant(value):
                return self._constant(value)
            case ast.Name(name) if name in self.types:
                kind = self.types[name] + (' *' if name in self.lengths else '')
                return Text(name, kind, array=name if kind.endswith('*') else '')
            case ast.Name() | ast.Attribute(ast.Name()) if self._known(node) is not None:
                return self._constant(self._known(node))
            case ast.Attribute(value, field):
                of = self._expression(value)
                name = of.type.removeprefix(f'const {self.whole.prefix}').removesuffix(' *')
                return Text(f'{of.text}->{field}', self.whole.fields[name][field])
            case ast.Subscript(value, index):
                of, at = self._expression(value), self._expression(index).text
                kind = of.type.removeprefix('const ').removesuffix(' *')
                if kind.removeprefix(self.whole.prefix) in TUPLES:
                    return Text(f'{of.text}.at[{at}]', 'double')
                return Text(f'{of.text}[{at}]', kind)
            case ast.UnaryOp(operator, value):
                one = self._expression(value)
                sign = OPERATORS[type(operator).__name__]
                return Text(f'{sign}{one.at(ATOM)}', one.type, PRODUCT)
            case ast.BinOp(left, operator, right):
                return self._operation(left, type(operator).__name__, right)
            case ast.Compare(left, operators, others):
                pairs = zip([left, *others], operators, others)
                parts = [self._operation(a, type(by).__name__, b) for a, by, b in pairs]
                text = ' && '.join(one.at(len(parts) > 1) for one in parts)
                return Text(text, 'int', OTHER)
            case ast.BoolOp(operator, values):
                sign = OPERATORS[type(operator).__name__]
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
        kind = 'double' if isinstance(value, float) else 'int'
        return Text(literal(value), kind, ATOM if value == value and value >= 0 else PRODUCT)

    def _known(self, node: ast.expr) -> Any:
        # Returns the value of a name outside of the function: a number, a function or a class.
        if isinstance(node, ast.Name):
            return self.names.get(node.id)
        assert isinstance(node, ast.Attribute)
        module = self.names.get(ast.unparse(node.value))
        return getattr(module, node.attr) if isinstance(module, ModuleType) else None

    def _operation(self, left: ast.expr, name: str, right: ast.expr) -> Text:
        a, b = self._expression(left), self._expression(right)
        kind = 'double' if 'double' in (a.type, b.type) else 'int'
        sign = OPERATORS[name]
        if name in ARITHMETIC:
            level = SUM if sign in '+-' else PRODUCT
            return Text(f'{a.at(level)} {sign} {b.at(level + 1)}', kind, level)
        least = SUM if name in COMPARISONS else ATOM
        return Text(f'{a.at(least)} {sign} {b.at(least)}', kind, OTHER)

    def _call(self, function: ast.expr, arguments: list[ast.expr]) -> Text:
        name, parts = ast.unparse(function), [self._expression(one) for one in arguments]
        texts = [one.text for one in parts]
        if name in ('min', 'max'):
            a, b, sign = *texts, '<' if name == 'min' else '>'
            kind = 'double' if 'double' in (parts[0].type, parts[1].type) else 'int'
            return Text(f'({b}) {sign} ({a}) ? ({b}) : ({a})', kind, OTHER)
        if name in ('int', 'float'):
            kind = TYPES[name]
            return Text(f'({kind}){parts[0].at(ATOM)}', kind, PRODUCT)
        if name == 'abs':
            return Text(f'{self.whole.std}fabs({texts[0]})', 'double')
        if name.startswith('math.'):
            return Text(f'{self.whole.std}{name[5:]}({texts[0]})', 'double')
        if name == 'arrays.after':
            begin, place = parts
            return Text(f'{begin.text} + {place.at(SUM)}', begin.type, SUM, begin.array)
        found = self._known(function)
        if not isinstance(found, FunctionType):
            raise TypeError(f'{self.name}: calls {name}, which cannot be translated')
        called = self.whole.function(found)
        for parameter, part in zip(called.parameters, parts):
            if parameter in called.written:
                self._write(part.array)
        return Text(f'{called.name}({", ".join(texts)})', called.result)
