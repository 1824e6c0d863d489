# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the conventions of robot files: what a table row contains, and its transform T."""

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

Axis = Literal['Rx', 'Ry', 'Rz', 'Tx', 'Ty', 'Tz']
RowKind = Literal['quantities', 'motion', 'shape']

# The two quantities of a table row that may contain joint variables, with their elementary
# motions. All other quantities of a row are constant.
MOVING = {'theta': 'Rz', 'd': 'Tz'}
FACTOR = re.compile(r'([RT][xyz])\((\w+)\)')


class NamedMotion(NamedTuple):
    """
    An elementary motion in the transform of a row, such as Rz(theta): its kind and axis `Rz`, and
    its quantity `theta`.
    """

    axis: Axis
    quantity: str


@dataclass(frozen=True)
class Convention:
    """
    A convention of tables: what a row contains, and the transform T that a row describes.

    Attributes
    ----------
    name
        The name of the convention in robot files.
    product
        The transform T of a row as a product of elementary motions, each with a named quantity.
        Only theta in Rz(theta) and d in Tz(d) may contain joint variables; these two factors are
        next to each other. Empty if rows do not have named quantities.
    rows
        The content of a row: named quantities, one elementary motion, or a motion between two
        constant matrices (Sheth and Uicker's shape matrices).
    reading
        The formula of T for messages; empty if `product` is the formula.
    written
        The form of a row in a robot file, for the reference page of the documentation; empty if
        `product` shows the form.
    author
        The author of the convention, such as Craig. Messages have the author in brackets after the
        name. Empty if the name alone is clear.
    also
        Names of the convention in textbooks and other programs. If a file has such a name, the
        error suggests `name`.
    notes
        The comment that the command `new` writes above the table.
    """

    name: str
    product: str = ''
    rows: RowKind = 'quantities'
    reading: str = ''
    written: str = ''
    author: str = ''
    also: tuple[str, ...] = ()
    notes: str = ''

    @property
    def words(self) -> str:
        """
        Return the name of the convention, and the author in brackets if `author` is not empty.
        """
        return f'{self.name} ({self.author})' if self.author else self.name

    @property
    def formula(self) -> str:
        """Return the name of the convention and the formula of a row's transform T."""
        return f'{self.words}, T = {self.product}' if self.product else self.reading

    @cached_property
    def motions(self) -> tuple[NamedMotion, ...]:
        """Return the elementary motions of a row's transform T, from left to right."""
        return tuple(NamedMotion(*factor) for factor in FACTOR.findall(self.product))

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """Return the names of a row's quantities, in alphabetical order."""
        return tuple(sorted(motion.quantity for motion in self.motions))

    @property
    def joint_motions(self) -> tuple[NamedMotion, ...]:
        """
        Return the elementary motions of the quantities theta and d in a row's transform T. Only
        these motions may contain joint variables.
        """
        return tuple(motion for motion in self.motions if motion.quantity in MOVING)

    @property
    def before_joint(self) -> tuple[NamedMotion, ...]:
        """
        Return the constant motions of a row before its joint. These motions belong to the previous
        link.
        """
        return self.motions[: self._joint_at]

    @property
    def after_joint(self) -> tuple[NamedMotion, ...]:
        """Return the constant motions of a row after its joint."""
        return self.motions[self._joint_at + len(self.joint_motions) :]

    @property
    def _joint_at(self) -> int:
        places = (i for i, motion in enumerate(self.motions) if motion.quantity in MOVING)
        return next(places, 0)

    @property
    def others(self) -> 'tuple[Convention, ...]':
        """
        Return the other conventions whose rows have the same quantities as this convention.

        Their transform T multiplies the elementary motions of the quantities in another order.
        """
        return tuple(
            other
            for other in CONVENTIONS.values()
            if other is not self and self.product and other.quantities == self.quantities
        )


CONVENTIONS = {
    convention.name: convention
    for convention in (
        # The convention of Denavit and Hartenberg (1955), as in the books of Paul and Siciliano.
        Convention(
            'standard',
            'Rz(theta) Tz(d) Tx(a) Rx(alpha)',
            also=('dh', 'sdh', 'standard_dh', 'dh_standard', 'classic', 'classical', 'distal')
            + ('paul', 'denavit_hartenberg'),
            notes="""\
# The table, a row for each link.  Standard Denavit-Hartenberg: T = Rz(theta) Tz(d) Tx(a) Rx(alpha)
#   theta  angle about the joint's axis z; the variable of a revolute joint stands here
#   d      distance along z; the variable of a prismatic joint stands here
#   a      length of the link: from this joint's axis to the next, along x
#   alpha  twist of the link: from this joint's axis to the next, about x
# Signs, offsets and coupled joints are written as they are: theta: -q2, or q2 - q1.""",
        ),
        # The convention of Craig, "Introduction to Robotics", eq. 3.6.
        Convention(
            'modified',
            'Rx(alpha) Tx(a) Rz(theta) Tz(d)',
            author='Craig',
            also=('mdh', 'modified_dh', 'dh_modified', 'craig', 'proximal'),
            notes="""\
# The table, a row for each joint.  Modified (Craig): T = Rx(alpha) Tx(a) Rz(theta) Tz(d)
#   a      length of the link before this joint: from the axis before to this one, along x
#   alpha  twist of the link before this joint: from the axis before to this one, about x
#   theta  angle about the joint's axis z; the variable of a revolute joint stands here
#   d      distance along z; the variable of a prismatic joint stands here
# A last row without a variable is fixed: it leads from the last axis to the tool.
# Signs, offsets and coupled joints are written as they are: theta: -q2, or q2 - q1.""",
        ),
        Convention(
            'elementary',
            rows='motion',
            reading='elementary motions, left to right',
            written='one of `Rx() Ry() Rz() Tx() Ty() Tz()`, left to right',
            also=('ets', 'elementary_transforms', 'transforms'),
            notes="""\
# The arm as one motion after another, base to tool: Rx Ry Rz turn about an axis of the frame
# reached so far, Tx Ty Tz move along it.  The variable of a revolute joint stands in an R, that of
# a prismatic one in a T.  There are no a, alpha, d, theta here: each length and angle is a motion.
# Signs, offsets and coupled joints are written as they are: Rz(-q2), Ry(q2 - q1).""",
        ),
        # The convention of Sheth and Uicker (1971).
        Convention(
            'shape',
            rows='shape',
            reading='shape (Sheth-Uicker), T = in * joint * inverse(out)',
            written='`{in: M, joint: Rz(q), out: M}`: in * joint * inverse(out), M a matrix or '
            '`{xyz, rpy}`',
            author='Sheth-Uicker',
            also=('sheth_uicker', 'sheth', 'uicker', 'su'),
            notes="""\
# The arm as links (Sheth-Uicker): T = in * joint * inverse(out), row by row.
#   in     from the frame before to the joint's axis: {xyz, rpy}, or a matrix of 3 rows of 4
#   joint  the motion: Rx Ry Rz turn, Tx Ty Tz slide; the variable stands here: Rz(q1)
#   out    from the next frame back to the joint's axis; without it: the same frame
# There are no a, alpha, d, theta here.  A row without a joint is fixed.""",
        ),
    )
}
# The names of the quantities of all conventions, in alphabetical order.
QUANTITIES = tuple(
    sorted({name for convention in CONVENTIONS.values() for name in convention.quantities})
)
