# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Translate functions of the kernel's source to C, statement by statement.

The kernel's dialect of Python has types by annotations. Only the part of the dialect that the
exported functions use is translated; anything else raises TypeError.

Some arguments of a call are known during the translation, for example the number of joints. Known
arguments are not parameters in C. Instead, the translated function contains their values as
constants, and has no branches that depend on known arguments alone. So each set of known arguments
gives a function of its own in C.
"""

import ast
import inspect
from collections.abc import Sequence
from operator import add, eq, gt, is_not, mul, sub
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

# The C types of the kernel's annotations. Arrays are not listed: an array parameter has the C type
# of the argument in the call, which may be a constant array.
TYPES = {
    'float': 'double', 'int': 'int', 'bool': 'int', 'None': 'void',
    'tuple[float, float]': 'pair', 'tuple[float, float, float]': 'triple',
}  # fmt: skip
# The C type of an integer that the kernel makes from a floating-point number, as in
# `k: Int32 = int(x)`. The key is the annotation. The kernel's `int` has 64 bits.
WHOLE_TYPES = {'int': 'long long', 'Int32': 'int'}
OPERATORS = {
    'Add': '+', 'Sub': '-', 'Mult': '*', 'Div': '/', 'FloorDiv': '/', 'Mod': '%', 'LShift': '<<',
    'RShift': '>>', 'BitAnd': '&', 'BitOr': '|', 'Eq': '==', 'NotEq': '!=', 'Lt': '<',
    'LtE': '<=', 'Gt': '>', 'GtE': '>=', 'And': '&&', 'Or': '||', 'Not': '!', 'USub': '-',
}  # fmt: skip
# The operations that are computed if both operands are known.
COMPUTED = {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Eq: eq, ast.Gt: gt, ast.IsNot: is_not}
BUILT_IN = ('min', 'max', 'float', 'abs')
UNKNOWN = object()  # stands for a value that is known only when the function runs


class Text(NamedTuple):
    """
    An expression in C.

    Attributes
    ----------
    text, type
        The expression and its C type.
    atom
        Whether it needs no parentheses as an operand.
    """

    text: str
    type: str = 'double'
    atom: bool = True

    @property
    def operand(self) -> str:
        """The text as an operand of an operation."""
        return self.text if self.atom else f'({self.text})'


def literal(number: float, real: str = 'double') -> str:
    """Return a number in C without rounding: decimal if it is short, else hexadecimal."""
    if isinstance(number, int):
        return str(int(number))
    if number != number:
        return 'NAN'
    if number in (float('inf'), float('-inf')):
        return 'INFINITY' if number > 0.0 else '-INFINITY'
    short = abs(number) < 1e6 and number % 0.125 == 0.0
    return (repr(number) if short else number.hex()) + 'F' * (real == 'float')


def listed(numbers: Any, real: str = 'double') -> str:
    """Return an array of numbers as an initializer in C, such as {1.0, 2.5}."""
    return f'{{{", ".join(literal(number, real) for number in numbers.ravel().tolist()) or 0}}}'


class Translation:
    """
    Functions of the kernel, translated to C, and the tables of constants that these functions
    read.

    Each function comes after the functions that it calls.

    Parameters
    ----------
    prefix
        Text before the names of functions, structures and tables.

    Attributes
    ----------
    functions
        The translated functions. The key is a function of the kernel with its arguments: C types,
        or known values.
    tables
        The name of each table. The key is the C type and the initializer of the table.
    """

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix
        self.functions: dict[tuple[Any, ...], _Function] = {}
        self.tables: dict[tuple[str, str], str] = {}

    def call(self, function: FunctionType, arguments: Sequence[Any]) -> Text:
        """
        Return a call of a function in C; translate the function if it is new.

        An argument is a `Text`, or a known value.
        """
        key = function, *(arg.type if isinstance(arg, Text) else repr(arg) for arg in arguments)
        if key not in self.functions:
            self.functions[key] = _Function(self, function, arguments)
        called = self.functions[key]
        texts = (arg.text for arg in arguments if isinstance(arg, Text))
        return Text(f'{called.name}({", ".join(texts)})', called.result)

    def table(self, numbers: Any) -> Text:
        """Return an array of constants in C."""
        table = 'double' if numbers.dtype == float else 'int', listed(numbers)
        name = self.tables.setdefault(table, f'{self.prefix}table_{len(self.tables)}')
        return Text(name, f'const {table[0]} *')


class _Function:
    """
    A function of the kernel, translated for given arguments.

    Attributes
    ----------
    name, result, text
        Its name, result type and definition in C.
    known
        The values of names that the function does not assign.
    types
        The C types of parameters and variables.
    variables
        The declarations of variables.
    """

    def __init__(
        self, whole: Translation, function: FunctionType, arguments: Sequence[Any]
    ) -> None:
        node: Any = ast.parse(inspect.getsource(function)).body[0]
        self.whole = whole
        self.result = self._type_of(node.returns)
        self.known: dict[str, Any] = {**function.__globals__}
        self.types: dict[str, str] = {}
        self.variables: list[str] = []
        for parameter, argument in zip(node.args.args, arguments):
            if isinstance(argument, Text):
                self.types[parameter.arg] = self._type_of(parameter.annotation, argument.type)
            else:
                self.known[parameter.arg] = argument
        parameters = ', '.join(f'{kind} {name}' for name, kind in self.types.items())
        body = self._block(node.body)
        self.name = f'{whole.prefix}{node.name.lstrip("_")}_{len(whole.functions)}'
        head = f'static inline {self.result} {self.name}({parameters or "void"})'
        self.text = '\n'.join([head, '{', *self.variables, *body, '}', ''])

    def _type_of(self, annotation: ast.expr | None, of_argument: str = '') -> str:
        kind = TYPES.get(ast.unparse(annotation) if annotation else '', of_argument)
        return self.whole.prefix + kind if kind in ('pair', 'triple') else kind

    def _declare(self, name: str, kind: str, size: str = '') -> None:
        self.types[name] = f'{kind} *' if size else kind
        self.variables.append(f'    {kind} {name}{size};')

    def _block(self, body: list[ast.stmt]) -> list[str]:
        lines: list[str] = []
        for statement in body:
            lines += self._statement(statement)
            if lines and lines[-1].startswith('return'):
                break
        return [f'    {line}' for line in lines]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Expr(ast.Constant()):  # a docstring
                return []
            case ast.Expr(value):
                return [f'{self._expression(value).text};']
            case ast.Return(None) | ast.Break() | ast.Continue():
                return [f'{ast.unparse(node)};']
            case ast.Return(ast.Tuple(values)):
                numbers = ', '.join(self._expression(value).text for value in values)
                return [f'const {self.result} result = {{{{{numbers}}}}};', 'return result;']
            case ast.Return(ast.expr() as value):
                return [f'return {self._expression(value).text};']
            case ast.If(test, body, other) if (known := self._value(test)) is not UNKNOWN:
                return [line[4:] for line in self._block(body if known else other)]
            case ast.If(test, body, other):
                lines = [f'if ({self._expression(test).text}) {{', *self._block(body)]
                return [*lines, '} else {', *self._block(other), '}'] if other else [*lines, '}']
            case ast.While(test, body):
                return [f'while ({self._expression(test).text}) {{', *self._block(body), '}']
            case ast.For(ast.Name(name), ast.Call(ast.Name('range'), bounds), body):
                return self._loop(name, [self._expression(arg).operand for arg in bounds], body)
            case ast.Assign([ast.Tuple(targets)], ast.Tuple(values)):
                return self._assign_several(targets, values)
            case ast.Assign(targets, value):
                return [line for target in targets for line in self._assign(target, value)]
            case ast.AnnAssign(
                ast.Name(name), ast.Name(kind), ast.Call(ast.Name('int'), [number])
            ):
                self._declare(name, WHOLE_TYPES[kind])
                return [f'{name} = ({WHOLE_TYPES[kind]}){self._expression(number).operand};']
            case ast.AnnAssign(target, _, ast.expr() as value):
                return self._assign(target, value)
            case ast.AugAssign(target, by, value):
                sign, text = OPERATORS[type(by).__name__], self._expression(value).text
                return [f'{self._expression(target).text} {sign}= {text};']
        raise TypeError(f'cannot be translated: {ast.unparse(node)}')

    def _loop(self, name: str, bounds: list[str], body: list[ast.stmt]) -> list[str]:
        start, end = bounds[:2] if len(bounds) > 1 else ('0', bounds[0])
        step = bounds[2] if len(bounds) > 2 else '1'
        sign = '>' if step.startswith('(-') else '<'
        head = f'for (int {name} = {start}; {name} {sign} {end}; {name} += {step}) {{'
        is_variable, self.types[name] = name in self.types, 'int'
        lines = [head, *self._block(body), '}']
        if not is_variable:
            del self.types[name]
        return lines

    def _assign_several(self, targets: list[ast.expr], values: list[ast.expr]) -> list[str]:
        # A swap needs the old values after the first assignment.
        names = {ast.unparse(target) for target in targets}
        read = {ast.unparse(node) for later in values[1:] for node in ast.walk(later)}
        if not names & read:
            return [line for pair in zip(targets, values) for line in self._assign(*pair)]
        old = [ast.Name(f'old_{len(self.variables)}_{k}') for k in range(len(values))]
        pairs = [*zip(old, values), *zip(targets, old)]
        return [line for pair in pairs for line in self._assign(*pair)]

    def _assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        zeros = self._value(value)
        if isinstance(zeros, list):
            kind = 'double' if isinstance(zeros[0], float) else 'int'
            self._declare(ast.unparse(target), kind, f'[{len(zeros)}] = {{0}}')
            return []
        expression = self._expression(value)
        if isinstance(target, ast.Name) and target.id not in self.types:
            self._declare(target.id, expression.type)
        return [f'{self._expression(target).text} = {expression.text};']

    def _value(self, node: ast.expr) -> Any:
        # Returns the value of an expression, UNKNOWN if it needs a variable or a call.
        match node:
            case ast.Constant(value):
                return value
            case ast.Name(name) if name not in self.types:
                return self.known[name]
            case ast.List([zero]):
                return [self._value(zero)]
            case ast.Attribute(value, field):
                of = self._value(value)
                return UNKNOWN if of is UNKNOWN else getattr(of, field)
            case ast.BinOp(left, by, right) | ast.Compare(left, [by], [right]):
                values, compute = [self._value(left), self._value(right)], COMPUTED.get(type(by))
                if compute and not any(value is UNKNOWN for value in values):
                    return compute(*values)
        return UNKNOWN

    def _expression(self, node: ast.expr) -> Text:
        if (known := self._value(node)) is not UNKNOWN:
            return self._constant(known)
        match node:
            case ast.Name(name):
                return Text(name, self.types[name])
            case ast.Subscript(value, index):
                of, at = self._expression(value), self._expression(index).text
                if of.type.endswith('*'):
                    kind = of.type.removeprefix('const ').removesuffix(' *')
                    return Text(f'{of.operand}[{at}]', kind)
                return Text(f'{of.text}.at[{at}]')
            case ast.UnaryOp(by, value):
                number = self._expression(value)
                return Text(f'{OPERATORS[type(by).__name__]}{number.operand}', number.type, False)
            case ast.BinOp(left, by, right):
                return self._operation(left, by, right)
            case ast.Compare(left, operators, others):
                pairs = zip([left, *others], operators, others)
                parts = [self._operation(*pair)._replace(type='int') for pair in pairs]
                if len(parts) == 1:
                    return parts[0]
                return Text(' && '.join(part.operand for part in parts), 'int', False)
            case ast.BoolOp(by, values):
                sign = f' {OPERATORS[type(by).__name__]} '
                text = sign.join(self._expression(value).operand for value in values)
                return Text(text, 'int', False)
            case ast.IfExp(test, body, other):
                a, b = self._expression(body), self._expression(other)
                text = f'{self._expression(test).operand} ? {a.operand} : {b.operand}'
                return Text(text, _wider(a, b), False)
            case ast.Call(function, arguments):
                return self._call(function, arguments)
        raise TypeError(f'cannot be translated: {ast.unparse(node)}')

    def _constant(self, value: Any) -> Text:
        if isinstance(value, np.ndarray):
            return self.whole.table(value)
        value = value.item() if isinstance(value, np.generic) else value
        text = literal(value)
        return Text(text, 'double' if isinstance(value, float) else 'int', text[0] != '-')

    def _operation(self, left: ast.expr, by: ast.AST, right: ast.expr) -> Text:
        a, b, sign = self._expression(left), self._expression(right), OPERATORS[type(by).__name__]
        if (sign, b.text) == ('*', '1'):
            return a
        return Text(f'{a.operand} {sign} {b.operand}', _wider(a, b), False)

    def _call(self, function: ast.expr, arguments: list[ast.expr]) -> Text:
        name = ast.unparse(function)
        if name not in BUILT_IN and not name.startswith(('math.', 'arrays.')):
            given = [self._argument(argument) for argument in arguments]
            return self.whole.call(self._value(function), given)
        parts = [self._expression(argument) for argument in arguments]
        texts = ', '.join(part.text for part in parts)
        if name in ('min', 'max'):
            a, b, sign = parts[0].operand, parts[1].operand, '<' if name == 'min' else '>'
            return Text(f'{b} {sign} {a} ? {b} : {a}', _wider(*parts), False)
        if name == 'float':
            return Text(f'(double){parts[0].operand}', atom=False)
        if name == 'arrays.after':
            begin, place = parts
            return Text(f'{begin.operand} + {place.operand}', begin.type, False)
        if name in ('arrays.copy', 'arrays.fill'):
            return Text(f'{self.whole.prefix}{name[7:]}({texts})', 'void')
        return Text(f'{"fabs" if name == "abs" else name.removeprefix("math.")}({texts})')

    def _argument(self, node: ast.expr) -> Any:
        # Returns an argument of a call: its value, or a `Text` if it is unknown or an array.
        value = self._value(node)
        is_text = value is UNKNOWN or isinstance(value, np.ndarray)
        return self._expression(node) if is_text else value


def _wider(a: Text, b: Text) -> str:
    # Returns the C type of an operation.
    return next((kind for kind in ('double', 'long long') if kind in (a.type, b.type)), a.type)
