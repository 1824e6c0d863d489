# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the table of a robot file, such as its DH table, in symbols. The matrix of each row is a
product of elementary motions.

Symbols stand for SI values (m, rad), whatever units the file has, because users write their
formulas in SI units.
"""

import operator
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, reduce
from itertools import starmap

import numpy as np
import sympy as sp

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
from ....robot.loops import opened
from ..derive.algebra.expression import exact
from ..derive.algebra.names import Names, angle_in_rad, names_by_use, uses_of

ZERO = sp.Integer(0)
EYE = sp.ImmutableDenseMatrix(sp.eye(4))
# The reader of robot files replaces a rounded rotation matrix by the nearest rotation. If the
# replacement changes an entry by more than this tolerance, the table in symbols uses the entries
# of the nearest rotation. Otherwise it uses the expressions in the file.
ROTATION_TOLERANCE = 1e-12
AXES = {'x': 0, 'y': 1, 'z': 2}


@dataclass(frozen=True)
class TableRow:
    """
    One row of a robot's table in symbols. Its matrix is a product of motions by named quantities
    such as a and alpha, or the product inner * motion * inverse(outer).

    Parameters
    ----------
    convention
        The name of the convention in the robot file; it fixes the order of the motions in the
        product.
    quantities : pairs (name, value)
        Values in m and rad; empty if rows of the convention have no named quantities.
    axis, argument
        `axis` is the name of an elementary motion, for example `Rz`; empty: no motion. `argument`
        is its angle (rad) or length (m).
    inner, outer
        Constant 4 x 4 poses of a Sheth-Uicker row, whose matrix is inner * motion *
        inverse(outer).
    """

    convention: str
    quantities: tuple[tuple[str, sp.Expr], ...] = ()
    axis: str = ''
    argument: sp.Expr = ZERO
    inner: sp.Matrix = EYE
    outer: sp.Matrix = EYE

    def __getitem__(self, name: str) -> sp.Expr:
        """
        Return the quantity with this name, such as a or alpha; 0 if the convention lacks the name.
        """
        return dict(self.quantities).get(name, ZERO)

    @property
    def order(self) -> Convention:
        """
        Return the convention of the row, such as standard DH.

        The field `motions` of the convention lists elementary motions in the order in which their
        matrices are multiplied: Rz(theta) Tz(d) Tx(a) Rx(alpha) for standard DH.
        """
        return CONVENTIONS[self.convention]

    @property
    def factors(self) -> list[tuple[str, sp.Expr | sp.Matrix]]:
        """
        Return the factors whose product is the row's matrix, in order. A factor is an elementary
        motion (axis, argument), for example ('Rz', q1), or a constant pose ('', pose).
        """
        if self.quantities:
            return [(axis, self[name]) for axis, name in self.order.motions]
        joint = [(self.axis, self.argument)] if self.axis else []
        return [('', self.inner), *joint, ('', inverse_pose(self.outer))]

    @cached_property
    def moving(self) -> sp.Expr:
        """
        Return the sum of theta, d and `argument` of the row, the only values with joint variables.
        The sum mixes angles and lengths: it only shows which joint variables move the row, and
        with which coefficients.
        """
        return sum((self[name] for name in MOVING), self.argument)

    @cached_property
    def symbols(self) -> frozenset[sp.Symbol]:
        """
        Return the symbols in theta, d and `argument` of the row: joint variables and constants.
        """
        return frozenset(self.moving.free_symbols)

    def with_quantities(self, changes: Mapping[str, sp.Expr]) -> 'TableRow':
        """Return the row with the quantities in `changes` replaced."""
        return replace(
            self, quantities=tuple((name, changes.get(name, old)) for name, old in self.quantities)
        )


@dataclass(frozen=True)
class Table:
    """
    A robot's table, base pose and tool pose in symbols, with the values of the named constants.

    Parameters
    ----------
    variables
        Symbols of the joint variables: first the active joints, then the passive joints of closed
        loops.
    constants
        Symbols of the named constants.
    given
        Values (SI units) of the constants that are plain numbers in the file.
    derived
        Expressions of the other constants.
    passive
        Number of passive joints.
    """

    convention: str
    rows: tuple[TableRow, ...]
    base: sp.Matrix
    tool: sp.Matrix
    variables: tuple[sp.Symbol, ...]
    joint_types: tuple[str, ...]
    constants: tuple[sp.Symbol, ...]
    given: Mapping[sp.Symbol, float] = field(hash=False)
    derived: Mapping[sp.Symbol, sp.Expr] = field(hash=False)
    passive: int = 0

    @property
    def slides(self) -> tuple[bool, ...]:
        """Return for each joint variable whether its joint is prismatic."""
        return tuple(kind == 'prismatic' for kind in self.joint_types)

    @property
    def turning(self) -> list[sp.Symbol]:
        """Return the variables of the revolute joints."""
        return [v for v, slides in zip(self.variables, self.slides) if not slides]

    @property
    def joints(self) -> int:
        """
        Return the number of active joints; passive joints, which closed loops move, do not count.
        """
        return len(self.variables) - self.passive

    def with_row(self, index: int, row: TableRow) -> 'Table':
        """Return the table with `row` instead of the row at `index`."""
        return replace(self, rows=(*self.rows[:index], row, *self.rows[index + 1 :]))


def rotation(axis: str, angle: sp.Expr) -> sp.Matrix:
    """Return the 4 x 4 rotation by an angle (rad) about axis x, y or z."""
    # Set the entries of a 4 x 4 identity matrix. To enlarge sympy's own 3 x 3 rotation would take
    # 25 times as long.
    j, k = (AXES[axis] + 1) % 3, (AXES[axis] + 2) % 3
    T = sp.eye(4)
    T[j, j] = T[k, k] = sp.cos(angle)
    T[k, j] = sp.sin(angle)
    T[j, k] = -T[k, j]
    return T


def translation(x: sp.Expr, y: sp.Expr, z: sp.Expr) -> sp.Matrix:
    """Return the 4 x 4 matrix of the translation by (x, y, z)."""
    T = sp.eye(4)
    T[0, 3], T[1, 3], T[2, 3] = x, y, z
    return T


def inverse_pose(T: sp.Matrix) -> sp.Matrix:
    """Return the inverse of a 4 x 4 pose."""
    R = sp.Matrix(T[:3, :3]).T
    return sp.Matrix.vstack(sp.Matrix.hstack(R, -R * T[:3, 3]), sp.eye(4)[3, :])


def motion(axis: str, argument: sp.Expr | sp.Matrix) -> sp.Matrix:
    """
    Return the 4 x 4 matrix of an elementary motion such as Rz or Tx by `argument`. If `axis` is
    '', return `argument`, which is then a pose.
    """
    if not axis:
        return argument
    if axis[0] == 'R':
        return rotation(axis[1], argument)
    return translation(*(argument if letter == axis[1] else ZERO for letter in AXES))


@lru_cache(maxsize=4096)
def row_matrix(row: TableRow) -> sp.Matrix:
    """Return the 4 x 4 matrix of a row of the table."""
    return sp.ImmutableDenseMatrix(reduce(operator.mul, starmap(motion, row.factors)))


@lru_cache(maxsize=4096)
def row_derivative(row: TableRow, variable: sp.Symbol) -> sp.Matrix:
    """Return the derivative of the 4 x 4 matrix of a row of the table by a joint variable."""
    # Differentiate entry by entry, because sympy's derivative of a matrix takes 0.5 s of the 1.6 s
    # of a comparison.
    return row_matrix(row).applyfunc(lambda e: e.diff(variable) if e.has(variable) else ZERO)


def _pose(rigid: RigidMotion, names: Names) -> sp.Matrix:
    if len(rigid.texts) == 6:
        x, y, z = (names.length(text) for text in rigid.texts[:3])
        roll, pitch, yaw = (names.angle(text) for text in rigid.texts[3:])
        turn = rotation('z', yaw) * rotation('y', pitch) * rotation('x', roll)
        return sp.ImmutableDenseMatrix(translation(x, y, z) * turn)
    entries = [
        names.length(text) if use == 'length' else names.expression(text)
        for text, use in zip(rigid.texts, uses_of(rigid))
    ]
    rotation_read = {k: float(rigid.matrix.flat[k]) for k in range(11) if k % 4 < 3}
    if any(
        not entries[k].is_number or abs(float(entries[k]) - value) > ROTATION_TOLERANCE
        for k, value in rotation_read.items()
    ):
        # The reader of the file has replaced a rounded rotation matrix by the nearest rotation.
        # Use the entries of this rotation.
        for k, value in rotation_read.items():
            entries[k] = sp.Rational(repr(value))
    return sp.ImmutableDenseMatrix(4, 4, entries)


def _argument(motion: ElementaryMotion, names: Names) -> sp.Expr:
    constant, factors = names.affine(motion.argument.text, motion.turns)
    return constant + sum(factor * variable for variable, factor in factors.items())


def _row(row: Link, convention: str, names: Names) -> TableRow:
    if isinstance(row, DhRow):
        pairs = ((name, _argument(motion, names)) for name, motion in zip(row.names, row.motions))
        return TableRow(convention, tuple(pairs))
    result = TableRow(convention)
    for motion in row.motions:
        result = replace(result, axis=motion.axis, argument=_argument(motion, names))
    if isinstance(row, ShapeRow):
        result = replace(result, inner=_pose(row.inner, names), outer=_pose(row.outer, names))
    return result


def general_row(table: Table) -> TableRow:
    """
    Return the general row i in the convention of a table, with symbols such as a_i, alpha_i, d_i,
    theta_i.
    """
    names = CONVENTIONS[table.convention].quantities
    return TableRow(table.convention, tuple((name, sp.Symbol(f'{name}_i')) for name in names))


def table_of(description: RobotDescription) -> Table:
    """Return the table of a robot file in symbols, which stand for SI values."""
    joints, used = opened(description).joints, names_by_use(description)
    degree = angle_in_rad(description.angle_unit)
    length = sp.Rational(1, 1000) if description.length_unit == 'mm' else sp.Integer(1)
    variables = {joint.variable: sp.Symbol(joint.variable) for joint in joints}
    meanings: dict[str, sp.Expr] = {
        joint.variable: variables[joint.variable]
        / (length if joint.type == 'prismatic' else degree)
        for joint in joints
    }
    constants = {constant.name: sp.Symbol(constant.name) for constant in description.constants}
    given: dict[sp.Symbol, float] = {}
    derived: dict[sp.Symbol, sp.Expr] = {}
    for constant in description.constants:
        name, symbol = constant.name, constants[constant.name]
        # `factor` converts the constant to SI units. A constant has a unit if the file uses it
        # only as a length or only as an angle. Any other constant is a number without a unit, and
        # the factor is 1.
        is_length, is_angle = name in used['length'], name in used['angle']
        factor = sp.Integer(1) if is_length == is_angle else length if is_length else degree
        if names_in(constant.text) & set(constants):
            derived[symbol] = exact(constant.text, meanings, description.angle_unit) * factor
        else:
            given[symbol] = float(np.float64(constant.value) * float(factor))
        meanings[name] = symbol / factor
    names = Names(
        tuple(variables.values()), (), {}, meanings, description.angle_unit, length_unit=length
    )
    return Table(
        convention=description.convention,
        rows=tuple(_row(row, description.convention, names) for row in description.links),
        base=_pose(description.base.motion, names),
        tool=_pose(description.tool.motion, names),
        variables=names.variables,
        joint_types=tuple(joint.type for joint in joints),
        constants=tuple(constants.values()),
        given=given,
        derived=derived,
        passive=len(variables) - len(description.joints),
    )
