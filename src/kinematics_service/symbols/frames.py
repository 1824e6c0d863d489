"""
The exact frames of an arm: each row's T, each T_0i, and the whole from base to tool.

"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from ..description import DhRow, ElementaryMotion, RigidMotion, RobotDescription, ShapeRow
from ..rigid_motion import Z_INTO, roll_pitch_yaw
from .laurent import Laurent, Matrix, Ring, exponential, product
from .names import DerivationError, Names

Affine = tuple[Any, dict[Any, Any]]
NOTHING: Affine = (sympy.Integer(0), {})


@dataclass(frozen=True)
class ExactRow:
    """
    A row: T = before @ Rz(theta) Tz(d) @ after.

    Parameters
    ----------
    before, after : 4 x 4, constant
    theta, d
        A constant part and the factor of each joint variable; rad, the file's length unit.

    """

    before: Matrix
    theta: Affine
    d: Affine
    after: Matrix

    @property
    def moves(self) -> bool:
        """
        Return whether a joint moves this row.

        """
        return bool(self.theta[1] or self.d[1])


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


@dataclass(frozen=True)
class Frames:
    """
    An arm as exact rows, and every frame of it in the base frame.

    Attributes
    ----------
    rows
        The table.
    row_transforms
        T of each row.
    base, tool
        Frame 0 in the base frame, the tool in the last row's frame.
    in_base
        Frame 0, then the frame after each row, in the base frame.
    T_base_tool
        The whole.

    """

    rows: tuple[ExactRow, ...]
    row_transforms: tuple[Matrix, ...]
    base: Matrix
    tool: Matrix
    in_base: tuple[Matrix, ...]
    T_base_tool: Matrix


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


def frames_of(description: RobotDescription, arithmetic: Arithmetic) -> Frames:
    """
    Return the exact frames of an arm.

    """
    rows = tuple(_row(link, description, arithmetic) for link in description.links)
    transforms = tuple(
        product(product(row.before, arithmetic.screw_z(row.theta, row.d)), row.after)
        for row in rows
    )
    base = _motion(description.base.motion, arithmetic)
    tool = _motion(description.tool.motion, arithmetic)
    in_base = [base]
    for transform in transforms:
        in_base.append(product(in_base[-1], transform))
    return Frames(rows, transforms, base, tool, tuple(in_base), product(in_base[-1], tool))


def _row(
    link: DhRow | ElementaryMotion | ShapeRow,
    description: RobotDescription,
    arithmetic: Arithmetic,
) -> ExactRow:
    names, identity = arithmetic.names, arithmetic.identity()
    match link:
        case DhRow():
            theta = names.affine(link.theta.text, is_angle=True)
            d = names.affine(link.d.text, is_angle=False)
            alpha = (names.angle(link.alpha.text), {})
            a = (names.expression(link.a.text), {})
            screw_x = arithmetic.about_axis('x', alpha, a)
            if description.convention == 'standard':
                return ExactRow(identity, theta, d, screw_x)
            return ExactRow(screw_x, theta, d, identity)
        case ElementaryMotion():
            turns = link.axis.startswith('R')
            argument = names.affine(link.argument.text, is_angle=turns)
            turn = arithmetic.turn(link.axis[1])
            theta, d = (argument, NOTHING) if turns else (NOTHING, argument)
            return ExactRow(turn, theta, d, transposed(turn))
    before = _motion(link.inner, arithmetic)
    after = inverse(_motion(link.outer, arithmetic))
    if link.joint is None:
        return ExactRow(before, NOTHING, NOTHING, after)
    joint = _row(link.joint, description, arithmetic)
    return ExactRow(
        product(before, joint.before), joint.theta, joint.d, product(joint.after, after)
    )


def _motion(motion: RigidMotion, arithmetic: Arithmetic) -> Matrix:
    names = arithmetic.names
    if len(motion.texts) == 16:
        e = [names.expression(text) for text in motion.texts]
        x, y, z = e[3], e[7], e[11]
        turns = [[e[4 * i + j] for j in range(3)] for i in range(3)]
        if all(entry in (-1, 0, 1) for row in turns for entry in row):
            R = arithmetic.constant_matrix(
                [*([*row, 0] for row in turns), [0, 0, 0, 1]],
            )
        else:
            R = _rotation(*_roll_pitch_yaw(turns, motion), arithmetic)
    else:
        x, y, z = (names.expression(text) for text in motion.texts[:3])
        R = _rotation(*(names.angle(text) for text in motion.texts[3:]), arithmetic)
    place = arithmetic.constant_matrix([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])
    return product(place, R)


def _rotation(roll: Any, pitch: Any, yaw: Any, arithmetic: Arithmetic) -> Matrix:
    about = arithmetic.about_axis
    turned = product(about('z', (yaw, {}), NOTHING), about('y', (pitch, {}), NOTHING))
    return product(turned, about('x', (roll, {}), NOTHING))


def _roll_pitch_yaw(turns: list[list[Any]], motion: RigidMotion) -> list[Any]:
    # Angles instead of entries: their sines and cosines are orthogonal by themselves. A matrix of
    # rounded decimals is no rotation; the library takes the nearest one, and so does this.
    R = sympy.Matrix(turns)
    if sympy.simplify(R * R.T) != sympy.eye(3):
        return [sympy.Rational(repr(angle)) for angle in roll_pitch_yaw(motion.matrix).tolist()]
    level = sympy.sqrt(sympy.simplify(R[0, 0] ** 2 + R[1, 0] ** 2))
    pitch = sympy.atan2(-R[2, 0], level)
    if level == 0:
        return [sympy.atan2(-R[1, 2], R[1, 1]), pitch, sympy.Integer(0)]
    return [sympy.atan2(R[2, 1], R[2, 2]), pitch, sympy.atan2(R[1, 0], R[0, 0])]
