# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a table row of any convention as a screw about z between two constant motions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import groupby

import numpy as np

from ..kernel import Floats
from ..rigid_motion import Z_INTO, inverse, screw
from .file.parts.convention_table import CONVENTIONS, NamedMotion
from .file.parts.description import DhRow, ElementaryMotion, Link, RobotDescription
from .file.text.expressions import Affine

ZERO = Affine(0.0, ())


@dataclass(frozen=True)
class Row:
    """
    One row of a table: T = before @ Rz(theta) Tz(d) @ after.

    `theta` and `d` are affine in the joint variables, rad and m; `before` and `after` have shape
    (4, 4).
    """

    before: Floats
    theta: Affine
    d: Affine
    after: Floats


def row_of(link: Link, convention: str) -> Row:
    """Return a table row of any convention as a screw about z between two constant motions."""
    if isinstance(link, DhRow):
        product = CONVENTIONS[convention]
        return Row(
            _constants(product.before_joint, link),
            link['theta'].affine if 'theta' in link.names else ZERO,
            link['d'].affine if 'd' in link.names else ZERO,
            _constants(product.after_joint, link),
        )
    if isinstance(link, ElementaryMotion):
        # Write the motion as a motion about or along z: Rx(a) = turn @ Rz(a) @ turn.T, where
        # `turn` rotates z into x. Ry, Tx and Ty are written in the same way.
        turn = Z_INTO[link.axis[1]]
        argument = link.argument.affine
        theta, d = (argument, ZERO) if link.turns else (ZERO, argument)
        return Row(turn, theta, d, turn.T)
    # Sheth and Uicker (1971): a row is T = S_in Phi inverse(S_out). Phi is the joint motion; the
    # constant matrices S_in and S_out are the keys `in` and `out` of the row (`inner` and
    # `outer`).
    out = inverse(link.outer.matrix)
    if link.joint is None:
        return Row(link.inner.matrix, ZERO, ZERO, out)
    joint = row_of(link.joint, convention)
    return Row(link.inner.matrix @ joint.before, joint.theta, joint.d, joint.after @ out)


def _constants(motions: Sequence[NamedMotion], link: DhRow) -> Floats:
    # A rotation about an axis and a translation along the same axis commute. So multiply both into
    # one screw.
    screws = []
    for axis, together in groupby(motions, key=lambda motion: motion.axis[1]):
        values = [(motion.axis[0], link[motion.quantity].affine.constant) for motion in together]
        angle, length = (sum(value for kind, value in values if kind == letter) for letter in 'RT')
        screws.append(screw(axis, angle, length))
    return reduce(np.matmul, screws) if screws else np.eye(4)


def table_rows(description: RobotDescription) -> tuple[Row, ...]:
    """Return the rows of a robot's table as screws, without base and tool."""
    return tuple(row_of(link, description.convention) for link in description.links)
