# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Turn the equations of a file of formulas into definitions, and statements to be checked."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from .....errors import FormulaError
from .....robot.file.text.expression_syntax import folded, postorder
from ...arm.numbers import size_of
from ..arm.quantities import Quantity, quantity_of, refusal_of
from ..text.build import Value, build, is_matrix, number
from ..text.file import FormulaFile, Raw, Settings
from ..text.syntax import PARTS, Node
from ..text.tokens import FormulaToken
from .names import COORDINATES, FormulaNames

# Maximum number of tree nodes of an expression that is compared.
MAX_NODES = 200_000
# Maximum depth of nested definitions. Definitions are nested if a definition uses another
# definition.
MAX_DEFINITION_DEPTH = 40
# A number with at least this many decimals counts as rounded. A number with fewer decimals is
# exact: 0.5 is a half.
MIN_ROUNDED_DECIMALS = 4
TOO_DEEP = 'the formula is nested too deep; compare a part of it'


@dataclass(frozen=True)
class Statement:
    """
    A formula of the file that is compared with the robot.

    Parameters
    ----------
    kind
        `quantity`, `solution` (inverse kinematics), `equation` or `claim`.
    name
        The left side as written in the file.
    value
        The right side as a matrix; 1 x 1 for a scalar.
    quantity
        The quantity of the robot that the name means, or None.
    joint
        Index of the joint that a solution formula gives; -1 for other kinds.
    left
        The left side of an equation.
    conditions
        The conditions of a claim, where k stands for every integer. A condition such as q3 = k*pi
        is the pair (joint index, the joint's value). A condition such as sin(q2 + q3) = 0 is the
        pair (-1, expression that is 0).
    decimals
        Number of decimal places if the formula contains only numbers, else None.
    inexact
        The statement in which x + s replaces each rounded number x, where the symbol s is the
        rounding error; None if the statement has no rounded numbers.
    half_units
        One pair for each symbol s in `inexact`: (s, half a unit of the last decimal of the number
        x).
    """

    kind: str
    name: str
    line: int
    settings: Settings
    value: sp.Matrix
    quantity: Quantity | None = None
    joint: int = -1
    left: sp.Expr | None = None
    conditions: tuple[tuple[int, sp.Expr], ...] = ()
    decimals: int | None = None
    inexact: 'Statement | None' = None
    half_units: tuple[tuple[sp.Symbol, float], ...] = ()

    @property
    def symbols(self) -> frozenset[sp.Symbol]:
        """Return the symbols of the statement's two sides."""
        left = set() if self.left is None else self.left.free_symbols
        return frozenset(self.value.free_symbols | left)

    def fault(self, message: str, code: str) -> FormulaError:
        """Return an error with this message, code and the statement's line."""
        return FormulaError(message, self.line, 1, code=code)


@dataclass(frozen=True)
class Understood:
    """
    The content of a file of formulas: statements, given constants (`L1 = 0.2`), errors, and unused
    definitions.
    """

    statements: tuple[Statement, ...]
    fixed: tuple[tuple[sp.Symbol, sp.Expr], ...]
    faults: tuple[FormulaError, ...]
    passed_over: tuple[FormulaError, ...]


def understand(file: FormulaFile, names: FormulaNames) -> Understood:
    """Return the statements about a robot in a file of formulas, and the errors of the file."""
    return _Reader(file, names).read()


@dataclass(frozen=True)
class _Context:
    # The context in which an expression is read.
    # `index`: index of the equation that contains the expression.
    # `general`: whether the expression may contain symbols of a general row, such as a_i.
    # `integers`: whether it may contain the integer k of a claim such as q3 = k*pi.
    # `inexact`: whether x + s replaces each rounded number x, where the symbol s is the rounding
    # error.
    index: int
    general: bool = False
    integers: bool = False
    inexact: bool = False


class _Reader:
    def __init__(self, file: FormulaFile, names: FormulaNames) -> None:
        self.names = names
        self.file = file
        self.faults = list(file.faults)
        self.global_: dict[str, Raw] = {}
        self.local: dict[int, dict[str, Raw]] = {}  # definitions after `where`, by formula index
        trees = (tree for raw in file.raw for tree in (raw.left, raw.right))
        self.has_rounded = any(_is_rounded(node.text) for tree in trees for node in _numbers(tree))
        self.half_units: dict[sp.Symbol, float] = {}
        self.used: set[int] = set()
        self.known: dict[tuple[int, _Context], Value] = {}

    def read(self) -> Understood:
        formulas: list[tuple[int, Raw]] = []
        last = -1
        for index, raw in enumerate(self.file.raw):
            key = self._definition_key(raw)
            if raw.local and key and last >= 0 and not _is_formula(key, raw.right):
                self.local.setdefault(last, {})[key] = raw
                continue
            if key:
                if other := self.global_.get(key):
                    message = (
                        f'{raw.left.at.written!r} is defined twice, here and in line '
                        f"{other.line}; write 'where' before definitions for one formula only"
                    )
                    self.faults.append(raw.left.at.fault(message, 'duplicate-name'))
                self.global_[key] = raw
            formulas.append((index, raw))
            last = index
        statements: list[Statement] = []
        fixed: list[tuple[sp.Symbol, sp.Expr]] = []
        maybe_unused: list[tuple[Raw, FormulaError | None]] = []
        for index, raw in formulas:
            try:
                parsed = self._statement(_Context(index), raw)
                if isinstance(parsed, Statement) and self.has_rounded:
                    parsed = self._with_half_units(parsed, _Context(index, inexact=True), raw)
            except FormulaError as fault:
                key = self._definition_key(raw)
                if key and quantity_of(key) is None:
                    maybe_unused.append((raw, fault))  # an error only if the name is used
                else:
                    self.faults.append(fault)
                continue
            except RecursionError:
                self.faults.append(FormulaError(TOO_DEEP, raw.line, 1, code='too-deep'))
                continue
            if isinstance(parsed, Statement):
                statements.append(parsed)
            elif parsed is not None:
                fixed.append(parsed)
            else:
                maybe_unused.append((raw, None))
        unused = []
        for raw, cause in maybe_unused:
            if id(raw) not in self.used:
                error = f' ({cause.line}:{cause.column}: {cause.message})' if cause else ''
                message = 'is not a known formula, and no other formula uses it'
                code = cause.code if cause else 'unused'
                unused.append(raw.left.at.fault(f'{raw.left.at.written!r} {message}{error}', code))
        return Understood(tuple(statements), tuple(fixed), tuple(self.faults), tuple(unused))

    def _definition_key(self, raw: Raw) -> str:
        # Return the name on the left side of an equation, if it defines a new name. Return '' if
        # the name is a joint, constant or coordinate of the robot.
        key = dict(raw.settings.meanings).get(raw.left.text, raw.left.text)
        if raw.left.kind != 'name' or raw.claim or key in COORDINATES:
            return ''
        if self.names.joint(key) is not None or key in self.names.constants:
            return ''
        return key

    def _with_half_units(self, exact: Statement, context: _Context, raw: Raw) -> Statement:
        try:
            inexact = self._statement(context, raw)
        except (FormulaError, RecursionError):
            # `_statement` has put x + s in place of each rounded number x; the symbol s is the
            # rounding error. Some formulas are invalid with x + s, for example if x is an
            # exponent. For these formulas, the effect of rounding is not estimated.
            return exact
        assert isinstance(inexact, Statement)
        half_units = tuple(
            (s, half) for s, half in self.half_units.items() if s in inexact.symbols
        )
        return replace(exact, inexact=inexact, half_units=half_units) if half_units else exact

    def _number(self, text: str, at: FormulaToken) -> sp.Expr:
        value = number(text, at)
        if not _is_rounded(text) or not value.is_Rational:
            return value
        symbol = sp.Symbol(f'half a unit of {text}')
        self.half_units[symbol] = 0.5 * 10.0 ** -_decimals(text)
        return value + symbol

    def _statement(
        self, context: _Context, raw: Raw
    ) -> Statement | tuple[sp.Symbol, sp.Expr] | None:
        if raw.claim:
            return self._claim(context, raw)
        key = dict(raw.settings.meanings).get(raw.left.text, raw.left.text)
        general = raw.left.kind == 'name' and quantity_of(key) == Quantity('general')
        value = self._value(raw.right, replace(context, general=general))
        if raw.left.kind == 'name' and key not in COORDINATES:
            if (constant := self.names.constants.get(key)) is not None and not is_matrix(value):
                if not value.is_number:
                    message = f'{constant} is a constant of the robot; give it a number'
                    raise raw.left.at.fault(message, 'not-a-number')
                return constant, value
            joint = self.names.joint(key)
            if joint is not None:
                self._refuse_matrix(value, raw)
                return self._made('solution', raw, value, joint=joint)
            quantity = quantity_of(key)
            if quantity is not None and quantity.kind == 'det':
                self._refuse_matrix(value, raw)
            elif quantity is None or not is_matrix(value):
                return None
            if refusal := refusal_of(quantity, self.names.table, raw.settings):
                raise raw.left.at.fault(*refusal)
            return self._made('quantity', raw, value, quantity=quantity)
        left = self._value(raw.left, context)
        if is_matrix(left) or is_matrix(value):
            raise raw.left.at.fault(
                'a matrix needs a name on the left side; write NAME = ..., such as '
                'T_02 = T_01*T_12, or matrices of one size on both sides',
                'wrong-shape',
            )
        return self._made('equation', raw, value, left=left)

    def _made(self, kind: str, raw: Raw, value: sp.Expr, **more: Any) -> Statement:
        matrix = value if is_matrix(value) else sp.ImmutableDenseMatrix([[value]])
        _refuse_long(matrix, raw.left.at)
        decimals = None
        if all(entry.is_Rational for entry in matrix):
            decimals = max((_decimals(n.text) for n in _numbers(raw.right)), default=0)
        return Statement(
            kind, _text(raw.left), raw.line, raw.settings, matrix, decimals=decimals, **more
        )

    def _refuse_matrix(self, value: sp.Expr, raw: Raw) -> None:
        if is_matrix(value):
            message = f'{_text(raw.left)!r}: write a number, not a matrix'
            raise raw.left.at.fault(message, 'wrong-shape')

    def _claim(self, context: _Context, raw: Raw) -> Statement:
        conditions, table, context = [], self.names.table, replace(context, integers=True)
        for condition in raw.claim:
            is_name = condition.left.kind == 'name'
            joint = self.names.joint(condition.left.text) if is_name else None
            value = self._value(condition.right, context)
            self._refuse_matrix(value, condition)
            if joint is None:
                left = self._value(condition.left, context)
                self._refuse_matrix(left, condition)
                value = left - value
            symbols = value.free_symbols
            moves = joint is not None or not symbols.isdisjoint(table.variables)
            if not moves or symbols - {*table.variables, *table.constants, sp.Symbol('k')}:
                message = (
                    'singular: write a condition of joints, constants and the integer k, such as '
                    'q3 = k*pi or L2*cos(q2) + L3*cos(q2 + q3) = 0'
                )
                raise condition.left.at.fault(message, 'unsupported')
            conditions.append((-1 if joint is None else joint, value))
        statement = self._made('claim', raw, sp.Integer(0), conditions=tuple(conditions))
        text = ', '.join(
            f'{value} = 0' if joint < 0 else f'{table.variables[joint]} = {value}'
            for joint, value in conditions
        )
        return replace(statement, name=f'singular: {text}', decimals=None)

    def _value(self, node: Node, context: _Context, open_: tuple[str, ...] = ()) -> Value:
        equation = self.file.raw[context.index]

        def lookup(token: FormulaToken) -> Value:
            key = token.text
            if context.integers and key == 'k':
                return sp.Symbol('k')
            raw = self._definition(key, context.index)
            if raw is None or (key in opened and quantity_of(key) is not None):
                return self.names.value(token, equation.settings, context.general)
            if key in opened:
                message = f'{token.written!r} is defined by itself; write its value'
                raise token.fault(message, 'circular')
            if len(opened) > MAX_DEFINITION_DEPTH:
                message = f'definitions follow each other more than {MAX_DEFINITION_DEPTH} deep'
                raise token.fault(f'{message}; write the values of some', 'too-deep')
            self.used.add(id(raw))
            if (id(raw), context) not in self.known:
                value = self._value(raw.right, context, (*opened, key))
                _refuse_long(value, token)
                self.known[id(raw), context] = value
            return self.known[id(raw), context]

        left = equation.left
        opened = open_ or ((left.text,) if left.kind == 'name' else ())
        return build(node, lookup, self._number if context.inexact else number)

    def _definition(self, key: str, index: int) -> Raw | None:
        raw = self.local.get(index, {}).get(key) or self.global_.get(key)
        if raw is not None or self.names.joint(key) is not None:
            return raw
        others = [local[key] for local in self.local.values() if key in local]
        return others[0] if len(others) == 1 else None


def _refuse_long(value: sp.Expr, at: FormulaToken) -> None:
    entries = value if is_matrix(value) else (value,)
    if any(size_of(entry) > MAX_NODES for entry in entries):
        message = f'{at.written!r} is longer than compare accepts; compare a part of it'
        raise at.fault(message, 'too-large')


def _is_formula(key: str, right: Node) -> bool:
    # Return whether an equation after `where` is a formula to be compared, not a definition.
    quantity = quantity_of(key)
    return quantity is not None and (quantity.kind == 'det' or right.kind == 'matrix')


def _numbers(node: Node) -> Iterator[Node]:
    return (part for part in postorder(node, PARTS) if part.kind == 'number')


def _is_rounded(text: str) -> bool:
    return _decimals(text) >= MIN_ROUNDED_DECIMALS and 'e' not in text.lower()


def _decimals(text: str) -> int:
    return len(text.lower().partition('e')[0].partition('.')[2])


def _text(root: Node) -> str:
    # Return the tree of an equation's left side as text for reports.
    return folded(root, PARTS, _text_of)


def _text_of(node: Node, inner: list[str]) -> str:
    if node.kind in ('name', 'number'):
        return node.at.written if node.kind == 'name' else node.text
    if node.kind == 'call':
        return f'{node.text}({", ".join(inner)})'
    if node.kind == 'neg':
        return f'-{inner[0]}'
    if node.kind == '*':
        return f'{inner[0]} {inner[1]}'
    return f' {node.kind} '.join(inner).replace('+ -', '- ')
