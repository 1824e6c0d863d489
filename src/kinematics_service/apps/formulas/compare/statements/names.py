# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the value of a name in a formula: joints, constants, shorthands such as c12, frames, axes.
"""

import difflib
import re
from dataclasses import replace
from functools import cached_property

import sympy as sp

from .....errors import FormulaError
from .....robot.file.parts.convention_table import QUANTITIES
from ...arm.table import Table
from ..arm.quantities import Quantity, expression_of, quantity_of, refusal_of
from ..arm.symbols import SymbolicArm
from ..text.build import Value
from ..text.file import Settings
from ..text.tokens import FormulaToken

# Matches shorthands such as `c1`, `s23` and `ctheta1`: cosine or sine of a joint angle, or of a
# sum of joint angles.
SHORTHAND = re.compile(r'([cCsS])(?:q|theta|th|t|phi)?(\d{1,7})')
FACTOR = re.compile(r'[A-Za-z]+\d+')
ALIAS = re.compile(r'(q|theta|th|t|phi|d)(\d{1,2})')
COORDINATES = {
    **{name: name for name in 'xyz'},
    **{name: name.lower() for name in 'XYZ'},
    **{f'{p}{name}': name for p in 'pP' for name in 'xyz'},
}
# The rotation angle of the tool about z, rad. It is defined only if the tool rotates about z
# alone.
ANGLE_IN_PLANE = sp.Symbol('phi')
ROTATION_ENTRY = re.compile(r'[rR]([123])([123])')
# Symbols of the coordinates x, y, z (m) of the point in the `point` setting. ROTATION has the
# symbols of the entries of the tool's rotation matrix.
POINT = sp.symbols('x y z')
ROTATION = {(i, j): sp.Symbol(f'r{i + 1}{j + 1}') for i in range(3) for j in range(3)}


class FormulaNames:
    """The names that formulas may use, for one robot."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.variables = {s.name.replace('_', ''): s for s in table.variables}
        self.constants = {s.name.replace('_', ''): s for s in table.constants}

    @cached_property
    def arm(self) -> SymbolicArm:
        """Return the frames and the Jacobian of the arm in symbols."""
        return SymbolicArm(self.table)

    def joint(self, key: str) -> int | None:
        """
        Return the index of the joint with this name (without underscores), such as q2 or theta2,
        or None.
        """
        if key in self.variables:
            return list(self.variables).index(key)
        match = ALIAS.fullmatch(key)
        if match is None or key in self.constants:
            return None
        index, slides = int(match[2]) - 1, self.table.slides
        if not 0 <= index < len(slides):
            return None
        fits = match[1] == 'q' or (match[1] == 'd') == slides[index]
        return index if fits else None

    def value(self, token: FormulaToken, settings: Settings, general: bool = False) -> Value:
        """
        Return the value of a name: a symbol, an expression, or a matrix.

        Raises
        ------
        FormulaError
            The name is unknown; the message lists the known names.
        """
        key = dict(settings.meanings).get(token.text, token.text)
        if key == 'pi':
            return sp.pi
        if general and (symbol := general_symbol(key)) is not None:
            return symbol
        index = self.joint(key)
        if index is not None:
            return self.table.variables[index]
        if key in self.constants:
            return self.constants[key]
        if key in COORDINATES:
            return sp.Symbol(COORDINATES[key])
        if match := SHORTHAND.fullmatch(key):
            return self._shorthand(match, token)
        if match := ROTATION_ENTRY.fullmatch(key):
            if key[0] == 'R' and match[1] != match[2]:
                raise token.fault(
                    f'{token.written!r} is an entry of the rotation R, or a rotation between '
                    f'frames; write r_{match[1]}{match[2]} or R^{match[1]}_{match[2]}',
                    'ambiguous',
                )
            return sp.Symbol(f'r{match[1]}{match[2]}')
        if key in ('I', 'eye'):
            return sp.Integer(1)
        if key == 'phi':
            return ANGLE_IN_PLANE
        quantity = quantity_of(key)
        matrix = None if quantity is None else self._matrix(quantity, token, settings)
        if matrix is None and (factors := self._factors(key)):
            return sp.Mul(*(self.value(replace(token, text=f), settings) for f in factors))
        if matrix is None:
            raise self.unknown(token)
        return matrix

    def _factors(self, key: str) -> list[str]:
        # Split a name such as `L1c23` into the factors `L1` and `c23`. Each factor is a joint, a
        # constant or a shorthand, and ends in a number. Return no factors if the name is not such
        # a product.
        factors = FACTOR.findall(key)
        is_product = ''.join(factors) == key and len(factors) > 1
        are_scalars = (
            self.joint(factor) is not None
            or factor in self.constants
            or SHORTHAND.fullmatch(factor)
            for factor in factors
        )
        return factors if is_product and all(are_scalars) else []

    def _shorthand(self, match: re.Match[str], token: FormulaToken) -> sp.Expr:
        variables, total = self.table.variables, sp.Integer(0)
        for digit in match[2]:
            if not 1 <= int(digit) <= len(variables):
                message = f'{token.written!r}: the robot has {len(variables)} joints'
                raise token.fault(message, 'out-of-range')
            total += variables[int(digit) - 1]
        return sp.cos(total) if match[1] in 'cC' else sp.sin(total)

    def _matrix(
        self, quantity: Quantity, token: FormulaToken, settings: Settings
    ) -> sp.Matrix | None:
        if self.table.passive and quantity.kind == 'jacobian':
            message = f'{token.written!r}: with closed loops write J on the left side only'
            raise token.fault(message, 'unsupported')
        if refusal := refusal_of(quantity, self.table, settings):
            raise token.fault(*refusal)
        return expression_of(quantity, self.arm, settings)

    def unknown(self, token: FormulaToken) -> FormulaError:
        """Return the error about an unknown name, with the most similar known name."""
        known = [s.name for s in (*self.table.variables, *self.table.constants)]
        alike = [name for name in known if name.lower() == token.text.lower()]
        near = alike or difflib.get_close_matches(token.text, known, n=1)
        function = re.fullmatch(r'(sin|cos|tan)(\w+)', token.text)
        if function and self.joint(function[2]) is not None:
            near = [f'{function[1]}({function[2]})']
        product = re.fullmatch(r'(\w+)(sin|cos|tan)', token.text)
        if product and (alike := [n for n in known if n.lower() == product[1].lower()]):
            near = [f'{alike[0]}*{product[2]}(...)']
        if token.text == 'singular':
            near = ['singular:']
        hint = f', did you mean {near[0]!r}?' if near else ''
        message = (
            f'unknown name {token.written!r}{hint} (known: {", ".join(known)}, pi, x, y, z, '
            'c1, s12, z_1, o_1, R_1, T_01 and their like, and what the file itself defines)'
        )
        return token.fault(message, 'unknown-name')


def general_symbol(key: str) -> sp.Symbol | None:
    """Return the symbol a_i, alpha_i, d_i or theta_i of the general matrix A_i, or None."""
    match = re.fullmatch(rf'({"|".join(QUANTITIES)})(?:i|im1)?', key)
    return sp.Symbol(f'{match[1]}_i') if match else None
