# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
List the parameters that a calibration can correct: the numbers of table, base and tool.

The numbers of a Denavit-Hartenberg table cannot describe every small error. Take two axes that are
nominally parallel. If one axis turns slightly out of the common plane, the table needs a d of
kilometres. Therefore the parameters include an extra angle about y, which describes this turn
(Hayati 1983).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .convention_table import CONVENTIONS
from .description import DhRow, ElementaryMotion, JointDescription, Link, ShapeRow
from .tolerances import EXTRA, GEAR

# Usual standard deviations of the differences between a robot and its datasheet. The calibration
# divides the correction of each parameter by its standard deviation.
LENGTH = 1e-3  # m
ANGLE = np.radians(0.2)  # rad
RATIO = 1e-3  # relative error of a gear ratio
AXES = 'xyz'
# Conventions whose rows have no rotation about y and no translation along y. In these conventions
# a calibration may find that a row needs such a rotation `beta` or such a translation `b`. The
# calibrated table then has an additional row, which contains `beta` and `b`.
WITH_EXTRA = ('standard', 'modified')
ENDS = ('base', 'tool')
GEARS = 'gears'
TABLE_GROUPS = ('offsets', 'lengths', 'angles', GEARS)
GROUPS = (*TABLE_GROUPS, *ENDS, 'lag', 'backlash')
SIX = ('x', 'y', 'z', 'rx', 'ry', 'rz')


@dataclass(frozen=True)
class ArmParameter:
    """
    A number of the arm's description that may be wrong, and that a calibration can correct.

    Attributes
    ----------
    name
        `theta2`, `d2`, `a2` and `alpha2` are quantities of row 2 of the table, counted from 1.
        `beta2` is a rotation about y and `b2` a translation along y, which the nominal row 2 does
        not have. In other conventions the name begins with the axis of the motion, such as `Rz3`
        or `Tx2`. `gear2` is the relative error of the gear ratio of joint 2. The poses of base and
        tool have the parameters `base.x` to `tool.rz`, and `base2.x` for a second base. `lag` is
        the delay of the joint positions (s), `backlash` the backlash of every joint (rad).
    group
        `offsets` (of joint positions), `lengths`, `angles`, `gears`, `base`, `tool`, `lag` or
        `backlash`.
    angle
        Whether the parameter is in rad; otherwise it is in m, or relative.
    row
        The row of the table, or the joint of a gear, counted from 0; -1 for base and tool.
    place
        The quantity of the row to which the correction is added: theta, d, a, alpha, or own (the
        argument of an elementary motion). For `beta` and `b`, `place` is Ry and Ty. For the
        corrections of a single joint's axis it is the motion, such as Rx.
    """

    name: str
    group: str
    angle: bool
    row: int = -1
    place: str = ''

    @property
    def scale(self) -> float:
        """
        Return the usual standard deviation of the parameter's error: in rad for an angle, in m for
        a length, and as a fraction of the gear ratio for a gear.
        """
        if self.group == GEARS:
            return RATIO
        return float(ANGLE) if self.angle else LENGTH


class PlacedParameter(NamedTuple):
    """
    A calibration parameter, and its axis (x, y or z): the parameter is an angle about this axis or
    a length along it.

    `extra` is true for a parameter that is not a number of the table. An example is `beta2`, an
    additional rotation about y in row 2.
    """

    parameter: ArmParameter
    axis: str
    extra: bool = False


def placed_rows(links: Sequence[Link], convention: str) -> Iterator[list[PlacedParameter]]:
    """Yield, for each row of a DH table, the list of the calibration parameters in the row."""
    for k, link in enumerate(links):
        if isinstance(link, DhRow):
            yield list(_of_dh_row(k, link, convention))
        elif isinstance(link, ShapeRow):
            yield [] if link.joint is None else list(_of_joint(k, link.joint))
        elif link.argument.affine.coefficients:
            yield list(_of_joint(k, link))
        else:
            yield [_placed(k, link.axis, link.axis, 'own')]


def _placed(
    k: int, word: str, motion: str, place: str, group: str = '', extra: bool = False
) -> PlacedParameter:
    angle = motion[0] == 'R'
    group = group or ('angles' if angle else 'lengths')
    return PlacedParameter(
        ArmParameter(f'{word}{k + 1}', group, angle, k, place), motion[1], extra
    )


def _of_dh_row(k: int, link: DhRow, convention: str) -> Iterator[PlacedParameter]:
    moving = [name for name in link.names if link[name].affine.coefficients]
    offset = 'theta' if 'theta' in moving else 'd' if 'd' in moving else ''
    for axis, quantity in CONVENTIONS[convention].motions:
        yield _placed(k, quantity, axis, quantity, 'offsets' if quantity == offset else '')
    for word, motion in EXTRA.items() if convention in WITH_EXTRA else ():
        yield _placed(k, word, motion, motion, extra=True)


def _of_joint(k: int, joint: ElementaryMotion) -> Iterator[PlacedParameter]:
    # Yield the calibration parameters of a joint: two angles and two lengths that move its axis,
    # and the offset of its position. A prismatic joint has no such lengths, because only the
    # direction of its axis has an effect.
    for kind in 'RT' if joint.turns else 'R':
        for axis in AXES.replace(joint.axis[1], ''):
            yield _placed(k, kind + axis, kind + axis, kind + axis, extra=True)
    yield _placed(k, joint.axis, joint.axis, 'own', 'offsets')


def gear_parameters(joints: Sequence[JointDescription]) -> list[ArmParameter]:
    """Return, for each joint that moves a row, the parameter for the error of its gear ratio."""
    return [
        ArmParameter(f'{GEAR}{k + 1}', GEARS, False, k, GEAR)
        for k, joint in enumerate(joints)
        if not joint.unused
    ]


def end_parameters(end: str, number: int) -> list[ArmParameter]:
    """
    Return the six calibration parameters of the pose of a base or tool.

    `number` counts bases or tools from 0: names are `base.x`, then `base2.x`.
    """
    label = end if number == 0 else f'{end}{number + 1}'
    return [ArmParameter(f'{label}.{name}', end, k > 2, place=name) for k, name in enumerate(SIX)]


def uncertain_parameters(
    links: Sequence[Link],
    convention: str,
    joints: Sequence[JointDescription],
    ends: Sequence[str] = ENDS,
) -> dict[str, ArmParameter]:
    """Return, by name, all parameters of an arm whose standard deviation a robot file may give."""
    table = [entry.parameter for row in placed_rows(links, convention) for entry in row]
    placed = [parameter for end in ends for parameter in end_parameters(end, 0)]
    return {parameter.name: parameter for parameter in (*table, *placed, *gear_parameters(joints))}
