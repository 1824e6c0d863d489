# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Turn the names of a robot file into sympy symbols, and its texts into expressions of these symbols.

Joint angles are in rad even if the unit of the file is deg, so that Jacobian columns are per rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from .....errors import DerivationError
from .....robot.file.parts.description import RigidMotion, RobotDescription, ShapeRow
from .....robot.file.text.expression_syntax import names_in
from .....robot.file.text.plain_expression import plain_expression
from .....typography import plain_names
from .expression import exact

# An affine expression: constant part, and the factor of each joint variable.
Affine = tuple[sympy.Expr, dict[sympy.Symbol, sympy.Expr]]


@dataclass(frozen=True)
class Names:
    """
    The names of a file and their meanings.

    Attributes
    ----------
    variables
        One symbol for each joint, in the order of the Jacobian's columns; rad or length unit.
    lengths
        Symbols of the constants that stay symbols in formulas. The other constants, such as
        angles, are replaced by their expressions.
    values
        The value of each length, in the file's units.
    meanings
        The expression of each name of the file, in the file's units. It is a symbol if the name
        stays in formulas; otherwise it is the formula or the number of the constant.
    angle_unit
        The file's unit of angles, 'rad' or 'deg'.
    length_unit
        Factor that converts a length from the file's unit to the unit of the symbols. It is 1/1000
        if the file is in mm and the symbols stand for metres.
    """

    variables: tuple[sympy.Symbol, ...]
    lengths: tuple[sympy.Symbol, ...]
    values: Mapping[sympy.Symbol, float]
    meanings: Mapping[str, sympy.Expr]
    angle_unit: str
    length_unit: sympy.Expr = sympy.Integer(1)

    def expression(self, text: str) -> sympy.Expr:
        """Return a text of the robot file as a sympy expression, in the file's units."""
        return exact(text, self.meanings, self.angle_unit)

    def angle(self, text: str) -> sympy.Expr:
        """Return the text of an angle in the robot file as a sympy expression, in rad."""
        return self.expression(text) * angle_in_rad(self.angle_unit)

    def length(self, text: str) -> sympy.Expr:
        """
        Return the text of a length in the robot file as a sympy expression. The expression has the
        length unit of the symbols in `variables` and `lengths`.
        """
        return self.expression(text) * self.length_unit

    def affine(self, text: str, is_angle: bool) -> Affine:
        """
        Return an angle or length of the robot file that is affine in the joint variables: its
        constant part, and the factor of each joint variable.
        """
        value = self.angle(text) if is_angle else self.length(text)
        expanded = sympy.expand(value)
        factors = {
            symbol: factor for symbol in self.variables if (factor := expanded.coeff(symbol)) != 0
        }
        return value.subs(dict.fromkeys(factors, 0)), factors


def angle_in_rad(unit: str) -> sympy.Expr:
    """Return the size of an angle unit, 'rad' or 'deg', in rad."""
    return sympy.pi / 180 if unit == 'deg' else sympy.Integer(1)


def names_of(description: RobotDescription, locked: Mapping[str, str] | None = None) -> Names:
    """
    Return the names in a robot file, with their sympy symbols or expressions.

    Parameters
    ----------
    description
        The robot file.
    locked
        Joint variables that are held still, and the texts of the expressions that replace them.
    """
    known = [joint.variable for joint in description.joints]
    unit = description.angle_unit
    if not isinstance(locked, Mapping | None):
        raise DerivationError(
            f'locked must map joint variables to expressions, not {locked!r:.80}',
            code='wrong-type',
        )
    locked = {
        plain_names(name): plain_expression(plain_names(str(text)), known, unit, None)
        for name, text in (locked or {}).items()
    }
    for name in locked:
        if name not in known:
            message = f'no joint variable {name!r} to lock (known: {", ".join(known)})'
            raise DerivationError(message, code='unknown-name')
    used = names_by_use(description)
    in_angles = used['angle'] | used['number']
    meanings: dict[str, sympy.Expr] = {}
    values: dict[sympy.Symbol, float] = {}
    for constant in description.constants:
        if constant.letter and constant.name in in_angles:
            message = f'constants.{constant.name} stands in an angle or a ratio: it needs a value'
            raise DerivationError(message, code='missing-value')
        derived = exact(constant.text, meanings, description.angle_unit)
        if constant.value == 0.0 or constant.name in in_angles or derived.free_symbols:
            meanings[constant.name] = derived
            continue
        symbol = sympy.Symbol(constant.name, real=True)
        meanings[constant.name] = symbol
        values[symbol] = constant.value
    variables = []
    for joint in description.joints:
        name = joint.variable
        if name in locked:
            meanings[name] = exact(locked[name], meanings, description.angle_unit)
            continue
        symbol = sympy.Symbol(name, real=True)
        slides = joint.type == 'prismatic'
        meanings[name] = symbol if slides else symbol / angle_in_rad(description.angle_unit)
        variables.append(symbol)
    if not variables:
        raise DerivationError('every joint is locked; leave at least one free', code='too-few')
    return Names(tuple(variables), tuple(values), values, meanings, description.angle_unit)


def names_by_use(description: RobotDescription) -> dict[str, set[str]]:
    """
    Return the names that are used in each kind of expression: 'length', 'angle' or 'number'.

    A 'number' is an entry of a rotation matrix. If an expression uses a constant that is computed
    from other constants, the expression counts as using the other constants, too.
    """
    by_use: dict[str, set[str]] = {'length': set(), 'angle': set(), 'number': set()}
    loops = description.loops
    rows = (*description.links, *(link for loop in loops for link in loop.links))
    poses = [description.base.motion, description.tool.motion]
    poses += [end.motion for loop in loops for end in (loop.start, loop.meets)]
    for row in rows:
        for motion in row.motions:
            by_use['angle' if motion.turns else 'length'] |= names_in(motion.argument.text)
        poses += [row.inner, row.outer] if isinstance(row, ShapeRow) else []
    for pose in poses:
        for text, use in zip(pose.texts, uses_of(pose)):
            by_use[use] |= names_in(text)
    for constant in reversed(description.constants):
        for names in by_use.values():
            if constant.name in names:
                names |= names_in(constant.text)
    return by_use


def uses_of(motion: RigidMotion) -> Sequence[str]:
    """
    Return what each expression of a constant pose is: a 'length', an 'angle' or a 'number'. The
    expressions are x, y, z, roll, pitch, yaw, or the 16 entries of a 4 x 4 matrix, row by row.
    """
    if len(motion.texts) == 6:
        return ['length'] * 3 + ['angle'] * 3
    return ['length' if k % 4 == 3 and k < 12 else 'number' for k in range(16)]
