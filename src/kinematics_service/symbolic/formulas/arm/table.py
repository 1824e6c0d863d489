"""
A robot's table in symbols: what each row's matrix is, for this table and for mistaken readings.

Symbols stand for SI values, whatever units the file has, since people write formulas in them.
"""

import operator
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, reduce
from typing import Any

import numpy as np
import sympy as sp  # type: ignore[import-untyped]

from ....robot.file.parts.convention_table import CONVENTIONS, MOVING, Convention
from ....robot.file.parts.description import (
    DhRow,
    ElementaryMotion,
    Link,
    RigidMotion,
    RobotDescription,
    ShapeRow,
)
from ....robot.file.text.expression_syntax import names_in
from ....robot.file.text.expressions import Expression
from ....robot.loops import opened
from ...algebra.expression import exact

ZERO = sp.Integer(0)
EYE = sp.ImmutableDenseMatrix(sp.eye(4))
SAME = 1e-12
AXES = {'x': 0, 'y': 1, 'z': 2}


@dataclass(frozen=True)
class TableRow:
    """
    One row: named quantities that multiply as the convention says, or in * motion * inverse(out).

    Parameters
    ----------
    convention
        As in the robot file.
    quantities : pairs (name, value)
        m and rad; none where the rows of the convention are no quantities.
    axis, argument
        An elementary motion, `Rz` for example; no axis: none.
    inner, outer
        Constant poses of a shape row.
    """

    convention: str
    quantities: tuple[tuple[str, Any], ...] = ()
    axis: str = ''
    argument: Any = ZERO
    inner: Any = EYE
    outer: Any = EYE

    def __getitem__(self, name: str) -> Any:
        """Return a quantity by its name, 0 where the convention has none of this name."""
        return dict(self.quantities).get(name, ZERO)

    @property
    def order(self) -> Convention:
        """Return its convention, which says in which order the quantities multiply."""
        return CONVENTIONS[self.convention]

    @property
    def moving(self) -> Any:
        """Return what the joint variables of the row stand in, for searching."""
        return sum((self[name] for name in MOVING), self.argument)

    def with_quantities(self, changes: Mapping[str, Any]) -> 'TableRow':
        """Return the row with some of its quantities changed."""
        return replace(
            self, quantities=tuple((name, changes.get(name, old)) for name, old in self.quantities)
        )


@dataclass(frozen=True)
class Table:
    """
    A robot's table, its base and tool, and the values of its names in the file.

    Parameters
    ----------
    variables
        Symbols of the joint variables, and behind them of the joints that closed loops move, of
        which there are `passive`.
    constants
        Symbols of the named constants; `given` has those that are plain numbers in the file,
        `derived` the expressions of the others.
    """

    convention: str
    rows: tuple[TableRow, ...]
    base: Any
    tool: Any
    variables: tuple[Any, ...]
    joint_types: tuple[str, ...]
    constants: tuple[Any, ...]
    given: Mapping[Any, float] = field(hash=False)
    derived: Mapping[Any, Any] = field(hash=False)
    passive: int = 0

    @property
    def joints(self) -> int:
        """Return the number of joints: variables that no loop moves."""
        return len(self.variables) - self.passive

    def with_row(self, index: int, row: TableRow) -> 'Table':
        """Return the table with another row in one place."""
        rows = list(self.rows)
        rows[index] = row
        return replace(self, rows=tuple(rows))


def rotation(axis: str, angle: Any) -> Any:
    """Return the 4 x 4 rotation about x, y or z."""
    i, j = [k for k in range(3) if k != AXES[axis]]
    if axis == 'y':
        i, j = j, i
    R = sp.eye(4)
    R[i, i] = R[j, j] = sp.cos(angle)
    R[i, j], R[j, i] = -sp.sin(angle), sp.sin(angle)
    return R


def translation(x: Any, y: Any, z: Any) -> Any:
    """Return the 4 x 4 translation."""
    T = sp.eye(4)
    T[0, 3], T[1, 3], T[2, 3] = x, y, z
    return T


def inverse_pose(T: Any) -> Any:
    """Return the inverse of a 4 x 4 pose."""
    R = T[:3, :3].T
    result = sp.eye(4)
    result[:3, :3] = R
    result[:3, 3] = -R * T[:3, 3]
    return result


def motion(axis: str, argument: Any) -> Any:
    """Return the 4 x 4 matrix of an elementary motion such as Rz or Tx; identity for no axis."""
    if not axis:
        return sp.eye(4)
    if axis[0] == 'R':
        return rotation(axis[1], argument)
    along = [ZERO, ZERO, ZERO]
    along[AXES[axis[1]]] = argument
    return translation(*along)


@lru_cache(maxsize=4096)
def row_matrix(row: TableRow) -> Any:
    """Return the 4 x 4 matrix of a row."""
    if row.quantities:
        factors = [motion(axis, row[name]) for axis, name in row.order.motions]
    else:
        factors = [row.inner, motion(row.axis, row.argument), inverse_pose(row.outer)]
    return sp.ImmutableDenseMatrix(reduce(operator.mul, factors))


@lru_cache(maxsize=4096)
def row_derivative(row: TableRow, variable: Any) -> Any:
    """Return the derivative of a row's matrix by a joint variable."""
    return row_matrix(row).diff(variable)


class _FileUnits:
    # Texts of the file are in its units; symbols are SI.
    def __init__(self, description: RobotDescription) -> None:
        self.angle = sp.pi / 180 if description.angle_unit == 'deg' else sp.Integer(1)
        self.length = sp.Rational(1, 1000) if description.length_unit == 'mm' else sp.Integer(1)
        self.angle_unit = description.angle_unit
        self.si = description.angle_unit == 'rad' and description.length_unit == 'm'
        self.variables = {
            joint.variable: sp.Symbol(joint.variable) for joint in opened(description).joints
        }
        self.constants = {c.name: sp.Symbol(c.name) for c in description.constants}
        self.factors = self._factors(description)

    def _factors(self, description: RobotDescription) -> dict[str, Any]:
        # SI value = factor * file's value; what is used both as length and angle is a ratio.
        used: dict[str, set[str]] = {'length': set(), 'angle': set()}
        for kind, text in _texts(description):
            used[kind] |= names_in(text)
        for constant in reversed(description.constants):
            for names in used.values():
                if constant.name in names:
                    names |= names_in(constant.text)
        factors = {}
        for name in self.constants:
            is_length, is_angle = name in used['length'], name in used['angle']
            factor = self.length if is_length else self.angle if is_angle else sp.Integer(1)
            factors[name] = sp.Integer(1) if is_length and is_angle else factor
        return factors

    def meanings(self) -> dict[str, Any]:
        return {name: symbol / self.factors[name] for name, symbol in self.constants.items()}

    def fixed(self, text: str, kind: str) -> Any:
        factor = {'length': self.length, 'angle': self.angle}.get(kind, sp.Integer(1))
        return exact(text, self.meanings(), self.angle_unit) * factor

    def moving(self, expression: Expression, kind: str) -> Any:
        coefficients = expression.affine.coefficients
        if self.si:
            return exact(expression.text, {**self.meanings(), **self.variables}, 'rad')
        # Coefficients are SI in the description already; the constant part keeps its names.
        still = {**self.meanings(), **dict.fromkeys(self.variables, ZERO)}
        factor = self.length if kind == 'length' else self.angle
        total = exact(expression.text, still, self.angle_unit) * factor
        for name, coefficient in coefficients:
            total += sp.Rational(repr(coefficient)) * self.variables[name]
        return total

    def pose(self, rigid: RigidMotion) -> Any:
        if len(rigid.texts) == 6:
            x, y, z = (self.fixed(text, 'length') for text in rigid.texts[:3])
            roll, pitch, yaw = (self.fixed(text, 'angle') for text in rigid.texts[3:])
            turn = rotation('z', yaw) * rotation('y', pitch) * rotation('x', roll)
            return sp.ImmutableDenseMatrix(translation(x, y, z) * turn)
        kinds = ['length' if k % 4 == 3 and k < 12 else 'number' for k in range(16)]
        entries = [self.fixed(text, kind) for text, kind in zip(rigid.texts, kinds)]
        rotations = [k for k in range(11) if k % 4 < 3]
        if any(not entries[k].is_number for k in rotations) or any(
            abs(float(entries[k]) - rigid.matrix.flat[k]) > SAME for k in rotations
        ):
            # The reader took the nearest rotation of printed digits.
            for k in rotations:
                entries[k] = sp.Rational(repr(float(rigid.matrix.flat[k])))
        return sp.ImmutableDenseMatrix(4, 4, entries)


def _texts(description: RobotDescription) -> list[tuple[str, str]]:
    texts = []
    loops = description.loops
    for row in (*description.links, *(link for loop in loops for link in loop.links)):
        if isinstance(row, ShapeRow):
            for rigid in (row.inner, row.outer):
                lengths = rigid.texts[:3] if len(rigid.texts) == 6 else rigid.texts[3:12:4]
                texts += [('length', text) for text in lengths]
        else:
            texts += [(_kind(one), one.argument.text) for one in row.motions]
    ends = [end.motion for loop in loops for end in (loop.start, loop.meets)]
    for rigid in (description.base.motion, description.tool.motion, *ends):
        texts += [('length', text) for text in rigid.texts[:3]]
    return texts


def _kind(motion: ElementaryMotion) -> str:
    return 'angle' if motion.turns else 'length'


def _row(row: Link, convention: str, units: _FileUnits) -> TableRow:
    if isinstance(row, DhRow):
        quantities = []
        for name, one in zip(row.names, row.motions):
            if name in MOVING:
                value = units.moving(one.argument, _kind(one))
            else:
                value = units.fixed(one.argument.text, _kind(one))
            quantities.append((name, value))
        return TableRow(convention, tuple(quantities))
    result = TableRow(convention)
    for one in row.motions:
        argument = units.moving(one.argument, _kind(one))
        result = replace(result, axis=one.axis, argument=argument)
    if isinstance(row, ShapeRow):
        result = replace(result, inner=units.pose(row.inner), outer=units.pose(row.outer))
    return result


def general_row(table: Table) -> TableRow:
    """Return a row of the table's convention with symbols such as a_i, alpha_i, d_i, theta_i."""
    names = CONVENTIONS[table.convention].quantities
    return TableRow(table.convention, tuple((name, sp.Symbol(f'{name}_i')) for name in names))


def table_of(description: RobotDescription) -> Table:
    """Return the table of a robot file, in symbols."""
    units = _FileUnits(description)
    given: dict[Any, float] = {}
    derived: dict[Any, Any] = {}
    for constant in description.constants:
        symbol, factor = units.constants[constant.name], units.factors[constant.name]
        if names_in(constant.text) & set(units.constants):
            value = exact(constant.text, units.meanings(), units.angle_unit) * factor
            derived[symbol] = value
        else:
            given[symbol] = float(np.float64(constant.value) * float(factor))
    return Table(
        convention=description.convention,
        rows=tuple(_row(row, description.convention, units) for row in description.links),
        base=units.pose(description.base.motion),
        tool=units.pose(description.tool.motion),
        variables=tuple(units.variables.values()),
        joint_types=tuple(joint.type for joint in opened(description).joints),
        constants=tuple(units.constants.values()),
        given=given,
        derived=derived,
        passive=len(units.variables) - len(description.joints),
    )
