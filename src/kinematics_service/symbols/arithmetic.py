"""
The arithmetic of one arm: its ring, and what a file's angles and lengths are in it.

"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from ..description import DhRow, ElementaryMotion, RobotDescription, ShapeRow
from ..rigid_motion import Z_INTO
from .laurent import Laurent, Ring
from .matrices import Matrix, product
from .names import DerivationError, Names

Affine = tuple[Any, dict[Any, Any]]
NOTHING: Affine = (sympy.Integer(0), {})


@dataclass(frozen=True)
class Arithmetic:
    """
    The ring an arm is computed in, and where its joint variables are in it.

    Attributes
    ----------
    ring
        The generators.
    units
        exp(i q / unit) is the generator of a joint variable: 1 but for gear ratios.

    """

    ring: Ring
    names: Names
    units: Mapping[Any, int]

    def angle_place(self, variable: Any) -> int:
        """
        Return the place of exp(i variable / unit).

        """
        return self.ring.place('angle', variable)

    def derivative(self, value: Laurent, variable: Any) -> Laurent:
        """
        Return the derivative by a joint variable, as an angle and as a length.

        """
        ring = self.ring
        by_angle = value.derivative(self.angle_place(variable), self.units[variable])
        return by_angle + value.derivative(ring.place('number', variable))

    def exponential(self, angle: Affine) -> Laurent:
        """
        Return exp(i angle) of an angle affine in the joint variables.

        """
        constant, factors = angle
        result = exponential(self.ring, constant)
        for variable, factor in factors.items():
            exponent = int(factor * self.units[variable])
            result = result * self.ring.power(self.angle_place(variable), exponent)
        return result

    def length(self, length: Affine) -> Laurent:
        """
        Return a length affine in the joint variables.

        """
        constant, factors = length
        result = self.ring.length(sympy.expand(constant))
        for variable, factor in factors.items():
            result = result + self.ring.length(variable) * self.ring.length(factor)
        return result

    def identity(self) -> Matrix:
        """
        Return the 4 x 4 identity.

        """
        return self.constant_matrix(sympy.eye(4).tolist())

    def constant_matrix(self, rows: Sequence[Sequence[Any]]) -> Matrix:
        """
        Return a matrix of sympy expressions without angles.

        """
        return tuple(tuple(self.ring.length(sympy.sympify(e)) for e in row) for row in rows)

    def screw_z(self, theta: Affine, d: Affine) -> Matrix:
        """
        Return Rz(theta) Tz(d).

        """
        cosine, sine = self._cosine_and_sine(theta)
        zero, one = self.ring.number(0), self.ring.number(1)
        return (
            (cosine, -sine, zero, zero),
            (sine, cosine, zero, zero),
            (zero, zero, one, self.length(d)),
            (zero, zero, zero, one),
        )

    def about_axis(self, axis: str, theta: Affine, d: Affine) -> Matrix:
        """
        Return the rotation about, and translation along, axis x, y or z.

        """
        turn = self.turn(axis)
        return product(product(turn, self.screw_z(theta, d)), transposed(turn))

    def turn(self, axis: str) -> Matrix:
        """
        Return the rotation that puts the z axis where `axis` is.

        """
        return self.constant_matrix([[int(round(e)) for e in row] for row in Z_INTO[axis]])

    def _cosine_and_sine(self, angle: Affine) -> tuple[Laurent, Laurent]:
        z = self.exponential(angle)
        negative = (-angle[0], {v: -f for v, f in angle[1].items()})
        inverse = self.exponential(negative)
        return (z + inverse).scaled(1, 2), (z - inverse).times_i(3).scaled(1, 2).reduced()


def transposed(matrix: Matrix) -> Matrix:
    """
    Return a matrix with rows and columns exchanged.

    """
    return tuple(zip(*matrix))


def inverse(T: Matrix) -> Matrix:
    """
    Return the inverse of a rigid motion.

    """
    R_t = tuple(tuple(T[j][i] for j in range(3)) for i in range(3))
    p = tuple((T[i][3],) for i in range(3))
    moved = product(R_t, p)
    return (*((*R_t[i], -moved[i][0]) for i in range(3)), T[3])


def arithmetic_of(description: RobotDescription, names: Names) -> Arithmetic:
    """
    Return the ring of an arm, with its joint variables in it.

    Raises
    ------
    DerivationError
        A joint turns an axis by an irrational part of its angle.

    """
    units = dict.fromkeys(names.variables, 1)
    for link in description.links:
        for text in _turning_texts(link):
            for variable, factor in names.affine(text, is_angle=True)[1].items():
                if not factor.is_Rational:
                    raise DerivationError(
                        f'{text}: the factor {factor} of {variable} is not a fraction, so that '
                        'the frames are no polynomials in sines and cosines of the joints'
                    )
                units[variable] = int(sympy.ilcm(units[variable], factor.q))
    arithmetic = Arithmetic(Ring(), names, units)
    for variable in names.variables:
        arithmetic.angle_place(variable)
    for variable in names.variables:
        arithmetic.ring.place('number', variable)
    return arithmetic


def _turning_texts(link: DhRow | ElementaryMotion | ShapeRow) -> tuple[str, ...]:
    match link:
        case DhRow():
            return (link.theta.text,)
        case ElementaryMotion():
            return (link.argument.text,) if link.axis.startswith('R') else ()
        case ShapeRow(joint=ElementaryMotion() as joint) if joint.axis.startswith('R'):
            return (joint.argument.text,)
    return ()


def exponential(ring: Ring, angle: Any) -> Laurent:
    """
    Return exp(i angle) of a constant angle, a sympy expression in rad; quarter turns exactly.

    """
    quarters = sympy.nsimplify(angle * 2 / sympy.pi) if angle.has(sympy.pi) else angle
    if quarters.is_Integer:
        if angle == 0 or angle.has(sympy.pi):
            return ring.number(1).times_i(int(quarters))
        quarters = None
    if angle.is_negative:
        return ring.power(ring.place('fixed_angle', -angle), -1)
    return ring.power(ring.place('fixed_angle', angle))
