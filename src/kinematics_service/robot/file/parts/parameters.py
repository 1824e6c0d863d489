"""
The numbers of an arm that may be off, by name: those of its table, of its base and of its tool.

The table's own numbers do not always say all that can be off. Where two axes are parallel no row
of Denavit and Hartenberg's can turn one of them out of their common plane, short of a d of
kilometres: an extra angle does (Hayati 1983).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .convention_table import CONVENTIONS
from .description import DhRow, ElementaryMotion, JointDescription, Link, ShapeRow
from .tolerances import GEAR

# Standard deviations of lengths (m) and angles (rad): what is usual between a datasheet and a
# robot, and what corrections are scaled by so that they compare.
LENGTH, ANGLE = 1e-3, np.radians(0.2)
# Of a gear ratio, as a share of it.
RATIO = 1e-3
AXES = 'xyz'
# Conventions in which a row more can say the extra corrections.
WITH_EXTRA = ('standard', 'modified')
ENDS = ('base', 'tool')
GEARS = 'gears'
TABLE_GROUPS = ('offsets', 'lengths', 'angles', GEARS)
GROUPS = (*TABLE_GROUPS, *ENDS, 'lag', 'backlash')
SIX = ('x', 'y', 'z', 'rx', 'ry', 'rz')


@dataclass(frozen=True)
class ArmParameter:
    """
    A number of an arm that may be off.

    Attributes
    ----------
    name
        `theta2`, `d1`, `a3`, `alpha2` of row 2, 1, 3, 2 of the table, counted from 1; `beta2` is
        an extra turn about y beside that row's alpha, `b2` an extra length along y beside its a;
        `Rz3`, `Tx2` of other conventions; `gear2` of joint 2, by which share its motion is larger
        than it says; `base.x` to `tool.rz`, `base2.x` of the second set; `lag`, the time (s) after
        which the joints are where the poses have them; `backlash`, the play (rad) of every joint.
    group
        offsets (of joint positions), lengths, angles, gears, base, tool, lag or backlash.
    angle
        Whether it is in rad; otherwise it is in m, or a share.
    row
        Row of the table, or the joint of a gear, counted from 0; -1 for base and tool.
    place
        The number of that row it is added to: theta, d, a, alpha, own; or the axis of an extra
        motion, as Ry.
    """

    name: str
    group: str
    angle: bool
    row: int = -1
    place: str = ''

    @property
    def scale(self) -> float:
        """Return the size of a usual error, rad, m or a share."""
        if self.group == GEARS:
            return RATIO
        return float(ANGLE) if self.angle else LENGTH


class PlacedParameter(NamedTuple):
    """A parameter, and the axis of its motion; extra ones are taken where they are needed."""

    parameter: ArmParameter
    axis: str
    extra: bool = False


def placed_rows(links: Sequence[Link], convention: str) -> Iterator[list[PlacedParameter]]:
    """Yield the parameters of each row of a table."""
    for k, link in enumerate(links):
        if isinstance(link, DhRow):
            yield list(_of_dh_row(k, link, convention))
        elif isinstance(link, ShapeRow):
            yield [] if link.joint is None else list(_of_joint(k, link.joint))
        elif link.argument.affine.coefficients:
            yield list(_of_joint(k, link))
        else:
            angle = link.axis[0] == 'R'
            own = ArmParameter(
                f'{link.axis}{k + 1}', 'angles' if angle else 'lengths', angle, k, 'own'
            )
            yield [PlacedParameter(own, link.axis[1])]


def _of_dh_row(k: int, link: DhRow, convention: str) -> Iterator[PlacedParameter]:
    moving = [name for name in link.names if link[name].affine.coefficients]
    offset = 'theta' if 'theta' in moving else 'd' if 'd' in moving else ''
    row = k + 1
    for axis, quantity in CONVENTIONS[convention].motions:
        angle = axis[0] == 'R'
        group = 'offsets' if quantity == offset else 'angles' if angle else 'lengths'
        parameter = ArmParameter(f'{quantity}{row}', group, angle, k, quantity)
        yield PlacedParameter(parameter, axis[1])
    if convention in WITH_EXTRA:
        yield PlacedParameter(ArmParameter(f'beta{row}', 'angles', True, k, 'Ry'), 'y', extra=True)
        yield PlacedParameter(ArmParameter(f'b{row}', 'lengths', False, k, 'Ty'), 'y', extra=True)


def _of_joint(k: int, joint: ElementaryMotion) -> Iterator[PlacedParameter]:
    # The offset of its position, and the four numbers of its axis: two angles, two lengths.
    turning = joint.axis[0] == 'R'
    across = [axis for axis in AXES if axis != joint.axis[1]]
    own = ArmParameter(f'{joint.axis}{k + 1}', 'offsets', turning, k, 'own')
    for kind, group in (('R', 'angles'), ('T', 'lengths')):
        if kind == 'T' and not turning:
            continue  # where a sliding axis lies makes no difference
        for axis in across:
            name = f'{kind}{axis}{k + 1}'
            place = f'{kind}{axis}'
            yield PlacedParameter(
                ArmParameter(name, group, kind == 'R', k, place), axis, extra=True
            )
    yield PlacedParameter(own, joint.axis[1])


def gear_parameters(joints: Sequence[JointDescription]) -> list[ArmParameter]:
    """Return for each joint that moves something by which share it moves more than it says."""
    return [
        ArmParameter(f'{GEAR}{k + 1}', GEARS, False, k, GEAR)
        for k, joint in enumerate(joints)
        if not joint.unused
    ]


def end_parameters(end: str, number: int) -> list[ArmParameter]:
    """Return the parameters of a base or tool; numbered from the second one on."""
    label = end if number == 0 else f'{end}{number + 1}'
    return [ArmParameter(f'{label}.{name}', end, k > 2, place=name) for k, name in enumerate(SIX)]
