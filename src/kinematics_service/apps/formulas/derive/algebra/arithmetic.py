# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the polynomial ring of an arm, and turn angles and lengths of its robot file into
polynomials.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain, count

import numpy as np
import numpy.typing as npt
import sympy

from .....errors import DerivationError
from .....rigid_motion import Z_INTO
from .....robot.file.parts.description import RobotDescription
from .laurent import Laurent, Ring, from_terms
from .matrices import Matrix
from .names import Affine, Names

# Maximum number of constant angles that become symbols of the polynomials; quarter turns need no
# symbol. If an arm has more constant angles, `exponential` replaces the others by angles with
# rational sine and cosine, which differ by at most 1e-16 rad.
MAX_ANGLE_SYMBOLS = 2
# If a row of the table turns by p/q times a joint's angle, p and q may be at most this. In the
# polynomials of the row, p is an exponent. The exponents in a product of dozens of rows then fit
# 16 bits.
MAX_ANGLE_PARTS = 500
# A decimal angle is read as an exact multiple of pi/2 if it differs by less than this, in quarter
# turns. The tolerance is needed, because programs print pi/2 as 1.5707963267948966.
QUARTER_TURN_TOLERANCE = 1e-15

NOTHING: Affine = (sympy.Integer(0), {})


@dataclass(frozen=True)
class Arithmetic:
    """
    The ring of polynomials of an arm, and the generators of its joint variables.

    Let q be the variable of a revolute joint. The table may add a constant angle to q, so let
    theta = q + offset. The generator of the joint is exp(i theta / u) with an integer u.

    Attributes
    ----------
    ring
        The ring with its generators.
    units
        The integer u of each joint variable: `ring.parts` times the common denominator of the gear
        ratios of the joint.
    steps
        An integer for each joint variable. The rows of the table contain powers of the variable's
        generator. The integer is the greatest common divisor of the exponents of these powers.
    offsets
        The offset (rad) of each joint variable; 0 if the table adds only whole quarter turns.
        Formulas in theta are as short as those of a table without offsets.
    angles
        The symbol theta of each joint variable q, or q itself if the offset is 0.
    """

    ring: Ring
    names: Names
    units: Mapping[sympy.Symbol, int]
    steps: Mapping[sympy.Symbol, int]
    offsets: Mapping[sympy.Symbol, sympy.Expr]
    angles: Mapping[sympy.Symbol, sympy.Expr]

    @property
    def in_variables(self) -> dict[sympy.Symbol, sympy.Expr]:
        """
        Return the symbol theta and the expression q + offset of each joint whose offset is not 0.
        """
        return {
            angle: v + self.offsets[v] for v, angle in self.angles.items() if self.offsets[v] != 0
        }

    @cached_property
    def values(self) -> npt.NDArray[np.complex128]:
        """
        Return the complex values of all generators: numbers for constants, nan for joint
        variables.
        """
        moving, known = set(self.names.variables), dict(self.names.values)
        values = np.full(len(self.ring.generators), np.nan, dtype=complex)
        for k, generator in enumerate(self.ring.generators):
            if generator.meaning not in moving:
                number = float(generator.meaning.subs(known))
                values[k] = np.exp(1j * number) if generator.kind == 'fixed_angle' else number
        return values

    def angle_index(self, variable: sympy.Symbol) -> int:
        """
        Return the index of the generator of a joint variable q in the ring.

        The generator is exp(i q / u) with the imaginary unit i and the integer u = `units[q]`.
        """
        return self.ring.index('angle', variable)

    @property
    def joint_indices(self) -> list[int]:
        """
        Return the indices of the generators of the joint variables: first an angle generator for
        each joint, then a length generator for each joint. A joint uses only one of its two
        generators.
        """
        variables = self.names.variables
        lengths = (self.ring.index('number', variable) for variable in variables)
        return [*map(self.angle_index, variables), *lengths]

    def moves(self, exponents: Iterable[Sequence[int]]) -> bool:
        """Return whether a joint variable occurs in monomials with these exponents."""
        joints = self.joint_indices
        return any(e[k] for e in exponents for k in joints)

    def derivative(self, value: Laurent, variable: sympy.Symbol) -> Laurent:
        """
        Return the derivative of a polynomial by a joint variable, per rad or per length unit of
        the file.
        """
        ring = self.ring
        by_angle = value.derivative(self.angle_index(variable), self.units[variable])
        return by_angle + value.derivative(ring.index('number', variable))

    def exponential(self, angle: Affine) -> Laurent:
        """Return exp(i angle) for an angle that is affine in the joint variables."""
        constant, factors = angle
        shifted = constant - sum(f * self.offsets[v] for v, f in factors.items())
        result = exponential(self.ring, shifted)
        for variable, factor in factors.items():
            exponent = int(factor * self.units[variable])
            result = result * self.ring.power(self.angle_index(variable), exponent)
        return result

    def length(self, length: Affine) -> Laurent:
        """Return a length that is affine in the joint variables, as a polynomial."""
        constant, factors = length
        result = self.ring.length(sympy.expand(constant))
        for variable, factor in factors.items():
            result = result + self.ring.length(variable) * self.ring.length(factor)
        return result

    def constant_matrix(self, rows: Sequence[Sequence[sympy.Expr]]) -> Matrix:
        """Return sympy expressions without angles as a matrix of polynomials."""
        return np.array([[self.ring.length(sympy.sympify(e)) for e in row] for row in rows])

    def screw_z(self, theta: Affine, d: Affine) -> Matrix:
        """Return the 4 x 4 screw motion Rz(theta) Tz(d)."""
        z = self.exponential(theta)
        inverse = self.exponential((-theta[0], {v: -f for v, f in theta[1].items()}))
        cosine = (z + inverse).scaled(1, 2)
        sine = (z - inverse).times_i(3).scaled(1, 2).reduced()
        zero, one = self.ring.number(0), self.ring.number(1)
        return np.array(
            [
                [cosine, -sine, zero, zero],
                [sine, cosine, zero, zero],
                [zero, zero, one, self.length(d)],
                [zero, zero, zero, one],
            ]
        )

    def about_axis(self, axis: str, theta: Affine, d: Affine) -> Matrix:
        """
        Return the rotation by theta about axis x, y or z, times the translation by d along the
        axis.
        """
        turn = self.turn(axis)
        return turn @ self.screw_z(theta, d) @ turn.T

    def turn(self, axis: str) -> Matrix:
        """Return the 4 x 4 rotation that maps the z axis to `axis`."""
        return self.constant_matrix([[int(round(e)) for e in row] for row in Z_INTO[axis]])


def arithmetic_of(description: RobotDescription, names: Names, parts: int = 1) -> Arithmetic:
    """
    Return the polynomial ring of an arm, with generators for its joint variables.

    Parameters
    ----------
    description, names
        The arm.
    parts
        2 for a ring with half angles, else 1.

    Raises
    ------
    DerivationError
        A joint turns an axis by an irrational multiple of the joint's angle.
    """
    units = dict.fromkeys(names.variables, 1)
    turns = []
    for motion in (motion for link in description.links for motion in link.motions):
        if not (motion.turns and motion.argument.affine.coefficients):
            continue
        text = motion.argument.text
        turns.append(names.affine(text, is_angle=True))
        for variable, factor in turns[-1][1].items():
            if not factor.is_Rational:
                raise DerivationError(
                    f'{text}: the factor {factor} of {variable} is not a fraction, so that the '
                    'frames are no polynomials in sines and cosines of the joints',
                    code='unsupported',
                )
            units[variable] = int(sympy.ilcm(units[variable], factor.q))
            if max(units[variable], abs(factor) * units[variable]) > MAX_ANGLE_PARTS:
                raise DerivationError(
                    f'{text}: {variable} turns an axis by {float(factor):.12g} of its angle, '
                    'whose sine and cosine are no short polynomials in those of the joint; '
                    'derive the nominal robot file, without the gear ratios that were found',
                    code='unsupported',
                )
    offsets = _offsets(turns, names)
    units = {variable: parts * unit for variable, unit in units.items()}
    steps = {
        v: math.gcd(*(int(factors.get(v, 0) * unit) for _, factors in turns)) or unit
        for v, unit in units.items()
    }
    arithmetic = Arithmetic(Ring(parts), names, units, steps, offsets, _angles(offsets, names))
    for variable in names.variables:
        arithmetic.angle_index(variable)
    for variable in names.variables:
        arithmetic.ring.index('number', variable)
    return arithmetic


def _offsets(turns: Sequence[Affine], names: Names) -> dict[sympy.Symbol, sympy.Expr]:
    # The offset of a joint is the constant angle of the first row that the joint turns. If the
    # joint turns further rows, each of them keeps its constant angle minus the offset.
    offsets: dict[sympy.Symbol, sympy.Expr] = {}
    for constant, factors in turns:
        unknown = [variable for variable in factors if variable not in offsets]
        if not unknown:
            continue
        offsets.update(dict.fromkeys(unknown, sympy.Integer(0)))
        angle = sympy.expand(constant - sum(f * offsets[v] for v, f in factors.items()))
        if angle.is_number and not _in_quarters(angle)[1].is_zero:
            offsets[unknown[0]] = angle / factors[unknown[0]]
    return {variable: offsets.get(variable, sympy.Integer(0)) for variable in names.variables}


def _angles(
    offsets: Mapping[sympy.Symbol, sympy.Expr], names: Names
) -> dict[sympy.Symbol, sympy.Expr]:
    numbers = range(1, len(offsets) + 1)
    stems = chain(('theta', 'phi', 'psi'), (f'angle_{n}_' for n in count()))
    stem = next(s for s in stems if not {f'{s}{k}' for k in numbers} & set(names.meanings))
    return {
        variable: variable if offset == 0 else sympy.Symbol(f'{stem}{k}', real=True)
        for k, (variable, offset) in zip(numbers, offsets.items())
    }


def exponential(ring: Ring, angle: sympy.Expr) -> Laurent:
    """
    Return exp(i angle) for a constant angle, a sympy expression in rad.

    A whole number of quarter turns is exact. Any other angle becomes a symbol, if the ring has
    fewer than two symbols of angles. More symbols would make formulas too long to read, so for
    further angles exp(i angle) becomes the number (1 + i t)^2 / (1 + t^2), where t is a fraction
    near tan(angle / 2). The number has modulus exactly 1, so rotations stay rotations. The angle
    of the number is within 1e-16 rad of the file's angle.
    """
    quarters, remainder = _in_quarters(angle)
    result = ring.number(1).times_i(quarters)
    return result * _odd_angle(ring, remainder) if remainder != 0 else result


def _in_quarters(angle: sympy.Expr) -> tuple[int, sympy.Expr]:
    # Split an angle into a whole number of quarter turns and the remainder. If the angle has
    # another multiple of pi, as in pi/3, return 0 and the angle itself.
    turns = sympy.expand(angle).coeff(sympy.pi)
    remainder = sympy.expand(angle - turns * sympy.pi)
    if remainder.is_number and not remainder.is_zero:
        printed = float(remainder) * 2 / math.pi
        if round(printed) and abs(printed - round(printed)) < QUARTER_TURN_TOLERANCE:
            turns, remainder = turns + sympy.Rational(round(printed), 2), sympy.Integer(0)
    quarters = 2 * turns
    return (int(quarters), remainder) if quarters.is_Integer else (0, angle)


def _odd_angle(ring: Ring, angle: sympy.Expr) -> Laurent:
    upright, sign = (-angle, -1) if angle.is_negative else (angle, 1)
    letters = [g for g in ring.generators if g.kind == 'fixed_angle']
    part = upright / ring.parts
    if ('fixed_angle', part) in ring.indices or len(letters) < MAX_ANGLE_SYMBOLS:
        return ring.power(ring.index('fixed_angle', part), sign * ring.parts)
    tangent = Fraction(float(sympy.tan(angle / 2))).limit_denominator(10**9)
    p, q = tangent.numerator, tangent.denominator
    return from_terms(ring, {(): (q * q - p * p, 2 * p * q)}, q * q + p * p)
