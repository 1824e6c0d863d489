# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the exact frames of an arm, as products of the transforms T of the rows of its table."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate, groupby

import numpy as np
import sympy

from ....errors import DerivationError
from ....rigid_motion import roll_pitch_yaw
from ....robot.file.parts.convention_table import CONVENTIONS, NamedMotion
from ....robot.file.parts.description import (
    DhRow,
    ElementaryMotion,
    Link,
    RigidMotion,
    RobotDescription,
)
from .algebra.arithmetic import NOTHING, Arithmetic
from .algebra.matrices import Matrix, identity, inverse, terms_in
from .algebra.names import Affine

# Maximum number of terms of the tool's pose, because more terms would take minutes. The pose of
# the largest bundled arm has 5000.
MAX_POSE_TERMS = 6000


@dataclass(frozen=True)
class ExactRow:
    """
    A row of the table as exact polynomials: T = before @ Rz(theta) Tz(d) @ after.

    Parameters
    ----------
    before, after : 4 x 4, constant
    theta, d
        Constant part, and factor of each joint variable; rad for theta, the file's length unit for
        d.
    """

    before: Matrix
    theta: Affine
    d: Affine
    after: Matrix

    @property
    def moves(self) -> bool:
        """Return whether a joint moves this row."""
        return bool(self.theta[1] or self.d[1])


@dataclass(frozen=True)
class Frames:
    """
    The exact rows of an arm, and all its frames in the base frame.

    Attributes
    ----------
    arithmetic
        The polynomial ring to which the entries of all matrices in this class belong.
    rows
        The rows of the table.
    row_transforms
        T of each row, 4 x 4.
    tool
        Pose of the tool in the last frame of the table.
    in_base
        Poses of frame 0, then of frame i at the end of each row i, in the base frame.
    T_base_tool
        Pose of the tool in the base frame.
    """

    arithmetic: Arithmetic
    rows: tuple[ExactRow, ...]
    row_transforms: tuple[Matrix, ...]
    tool: Matrix
    in_base: tuple[Matrix, ...]
    T_base_tool: Matrix


def frames_of(description: RobotDescription, arithmetic: Arithmetic) -> Frames:
    """
    Return the exact frames of an arm.

    Raises
    ------
    DerivationError
        The tool's pose has too many terms.
    """
    rows = tuple(_row(link, description.convention, arithmetic) for link in description.links)
    transforms = tuple(
        row.before @ arithmetic.screw_z(row.theta, row.d) @ row.after for row in rows
    )
    tool = _motion(description.tool.motion, arithmetic)
    base = _motion(description.base.motion, arithmetic)
    in_base = tuple(accumulate(transforms, np.matmul, initial=base))
    T = in_base[-1] @ tool
    size = terms_in(T)
    if size > MAX_POSE_TERMS:
        approximate = any(factor.approximate for factor in description.singularity.factors)
        uncertainty = description.uncertainty
        advice = (
            'too many lengths and angles that are no quarter turns; round the angles, or lock '
            'joints'
        )
        # The condition is true if a calibration wrote the robot file.
        if approximate or (uncertainty is not None and uncertainty.factor):
            advice = (
                'its table is a nominal one with corrections, and no formula of it is short: '
                'derive the nominal robot file'
            )
        if approximate:
            advice += '; the factors here are those of that one, approximately'
        message = f'the pose of the tool has {size} terms (at most {MAX_POSE_TERMS}): {advice}'
        raise DerivationError(message, code='too-large')
    return Frames(arithmetic, rows, transforms, tool, in_base, T)


def _row(link: Link, convention: str, arithmetic: Arithmetic) -> ExactRow:
    names = arithmetic.names
    if isinstance(link, DhRow):
        product_of_row = CONVENTIONS[convention]
        may_move = link.names
        return ExactRow(
            _constants(product_of_row.before_joint, link, arithmetic),
            names.affine(link['theta'].text, is_angle=True) if 'theta' in may_move else NOTHING,
            names.affine(link['d'].text, is_angle=False) if 'd' in may_move else NOTHING,
            _constants(product_of_row.after_joint, link, arithmetic),
        )
    if isinstance(link, ElementaryMotion):
        argument = names.affine(link.argument.text, is_angle=link.turns)
        turn = arithmetic.turn(link.axis[1])
        theta, d = (argument, NOTHING) if link.turns else (NOTHING, argument)
        return ExactRow(turn, theta, d, turn.T)
    before = _motion(link.inner, arithmetic)
    after = inverse(_motion(link.outer, arithmetic))
    if link.joint is None:
        return ExactRow(before, NOTHING, NOTHING, after)
    joint = _row(link.joint, convention, arithmetic)
    return ExactRow(before @ joint.before, joint.theta, joint.d, joint.after @ after)


def _constants(motions: Sequence[NamedMotion], link: DhRow, arithmetic: Arithmetic) -> Matrix:
    # Join consecutive motions about and along one axis into one screw, because such motions
    # commute.
    names, screws = arithmetic.names, []
    for axis, together in groupby(motions, key=lambda motion: motion.axis[1]):
        angle = length = sympy.Integer(0)
        for motion in together:
            text = link[motion.quantity].text
            if motion.axis[0] == 'R':
                angle += names.angle(text)
            else:
                length += names.length(text)
        screws.append(arithmetic.about_axis(axis, (angle, {}), (length, {})))
    return reduce(np.matmul, screws) if screws else identity(arithmetic.ring)


def _motion(motion: RigidMotion, arithmetic: Arithmetic) -> Matrix:
    names = arithmetic.names
    if len(motion.texts) == 16:
        e = [names.expression(text) for text in motion.texts]
        x, y, z = e[3], e[7], e[11]
        turns = [[e[4 * i + j] for j in range(3)] for i in range(3)]
        if all(entry in (-1, 0, 1) for row in turns for entry in row):
            R = arithmetic.constant_matrix([*([*row, 0] for row in turns), [0, 0, 0, 1]])
        else:
            R = _rotation(_roll_pitch_yaw(turns, motion), arithmetic)
    else:
        x, y, z = (names.length(text) for text in motion.texts[:3])
        R = _rotation([names.angle(text) for text in motion.texts[3:]], arithmetic)
    translation = arithmetic.constant_matrix(
        [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]
    )
    return translation @ R


def _rotation(angles: Sequence[sympy.Expr], arithmetic: Arithmetic) -> Matrix:
    roll, pitch, yaw = angles
    about = arithmetic.about_axis
    turned = about('z', (yaw, {}), NOTHING) @ about('y', (pitch, {}), NOTHING)
    return turned @ about('x', (roll, {}), NOTHING)


def _roll_pitch_yaw(turns: list[list[sympy.Expr]], motion: RigidMotion) -> list[sympy.Expr]:
    # If the file gives a rotation as a matrix of rounded decimals, the matrix is not orthogonal.
    # Use the nearest rotation, as the reader of robot files does.
    R = sympy.Matrix(turns)
    if sympy.simplify(R * R.T) != sympy.eye(3):
        return [sympy.Rational(repr(angle)) for angle in roll_pitch_yaw(motion.matrix).tolist()]
    level = sympy.sqrt(sympy.simplify(R[0, 0] ** 2 + R[1, 0] ** 2))
    pitch = sympy.atan2(-R[2, 0], level)
    if level == 0:
        return [sympy.atan2(-R[1, 2], R[1, 1]), pitch, sympy.Integer(0)]
    return [sympy.atan2(R[2, 1], R[2, 2]), pitch, sympy.atan2(R[1, 0], R[0, 0])]
