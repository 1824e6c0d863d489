"""
The numbers of an arm that may be off: those of its table, its base and tool, and extra angles.

The table's own numbers do not always say all that measured poses can tell. Where two axes are
parallel no row of Denavit and Hartenberg's can turn one of them out of their common plane, short
of a d of kilometres: an extra angle does (Hayati 1983). Such extra corrections are taken only
where, over random poses, they move the tool as no number of the table can.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...rigid_motion import screw_z
from ...robot.conventions import Row, table_rows
from ...robot.file.convention_table import CONVENTIONS, NamedMotion
from ...robot.file.description import DhRow, ElementaryMotion, Link, RobotDescription, ShapeRow
from ...robot.file.expressions import Affine
from ...robot.file.tolerances import GEAR
from ...robot.robot import Robot
from ...robot.task import seeded_poses
from .corrected_chain import (
    CorrectedChain,
    CorrectingMotion,
    GearMotion,
    JointScrew,
    Part,
    pose_change,
    small_motion,
)
from .triangle import triangle_of

# Standard deviations of lengths (m) and angles (rad): what is usual between a datasheet and a
# robot, and what corrections are scaled by so that they compare.
LENGTH, ANGLE = 1e-3, np.radians(0.2)
# Of a gear ratio, as a share of it.
RATIO = 1e-3
# An extra correction is taken if it moves the tool by this share of LENGTH as nothing else does;
# directions that move it less than the second share count as no way to do so.
EXTRA, WEAK = 0.1, 0.02
# Number of random poses by which that is judged, and of those that tell the rank.
POSES = 60
# Singular values below this share of the largest are round-off.
NOTHING = 1e-9

AXES = 'xyz'
# Conventions in which a row more can say the extra corrections, and where in a row these are.
WITH_EXTRA, EXTRA_PLACES = ('standard', 'modified'), ('Ry', 'Ty')
ENDS = ('base', 'tool')
GEARS = 'gears'
TABLE_GROUPS = ('offsets', 'lengths', 'angles', GEARS)
GROUPS = (*TABLE_GROUPS, *ENDS, 'lag')
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
        which the joints are where the poses have them.
    group
        offsets (of joint positions), lengths, angles, gears, base, tool or lag.
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


@dataclass(frozen=True)
class ArmParameters:
    """
    The parameters of an arm, and its chain with them.

    Attributes
    ----------
    table
        Those of the table, extra ones included.
    chain
        From frame 0 to the frame of the last row; corrections are counted as in `table`.
    """

    table: tuple[ArmParameter, ...]
    chain: CorrectedChain


class _Placed(NamedTuple):
    # A correction and its motion; extra ones are taken where they are needed.
    parameter: ArmParameter
    axis: str
    extra: bool = False


def placement(
    chain: CorrectedChain, base: Floats, tool: Floats, first: tuple[int, int]
) -> CorrectedChain:
    """
    Return a chain between base and tool, with six corrections of each.

    Parameters
    ----------
    base, tool : shape (4, 4)
        Frame 0 in the frame of the poses; the tool in the frame of the last row.
    first
        Number of the first correction of the base, and of the tool; x y z rx ry rz follow. They
        are about the axes of frame 0, and of the frame of the last row.
    """
    begin, end = (
        tuple(CorrectingMotion(k > 2, k % 3, index + k) for k in range(6)) for index in first
    )
    still = list(chain.still)
    still[0] = (base, *begin, *still[0])
    still[-1] = (*still[-1], *end, tool)
    return chain._replace(still=tuple(still))


def parameters_of(robot: Robot, gears: bool = False) -> ArmParameters:
    """
    Return the parameters of an arm, with the extra ones that it needs.

    Parameters
    ----------
    gears
        Whether the gear ratio of each joint that moves something is among them.
    """
    arm = _of_rows(robot)
    if not gears:
        return arm
    joints = [k for k, joint in enumerate(robot.description.joints) if not joint.unused]
    count = len(arm.table)
    own = (ArmParameter(f'{GEAR}{k + 1}', GEARS, False, k, GEAR) for k in joints)
    motions = tuple(GearMotion(k, count + at) for at, k in enumerate(joints))
    return ArmParameters((*arm.table, *own), arm.chain._replace(gears=motions))


def _of_rows(robot: Robot) -> ArmParameters:
    description = robot.description
    every = _built(description, None)
    extra = tuple(
        one.parameter.name for row in _placed_rows(description) for one in row if one.extra
    )
    if not extra:
        return every
    count = len(every.table)
    chain = placement(every.chain, np.eye(4), np.eye(4), (count, count + 6))
    ends = [one for end in ENDS for one in end_parameters(end, 0)]
    J = scaled_jacobian(robot, chain, [*every.table, *ends])
    own = [k for k, one in enumerate(every.table) if one.name not in extra]
    span = _span(J[:, [*own, *range(count, count + 12)]])
    taken = set()
    for k, one in enumerate(every.table):
        if one.name in extra:
            rest = J[:, k] - span @ (span.T @ J[:, k])
            size = float(np.linalg.norm(rest))
            if size > EXTRA:
                span = np.column_stack([span, rest / size])
                taken.add(one.name)
    return _built(description, taken)


def scaled_jacobian(
    robot: Robot,
    chain: CorrectedChain,
    parameters: Sequence[ArmParameter],
    positions: bool = False,
) -> Floats:
    """
    Return how random poses move with usual errors of parameters, as the chain counts them.

    In units of LENGTH, RMS over the poses; angles of the tool count by the characteristic length.
    With `positions`, of the tool's origin alone. Of the rows of all poses their triangle (P, P).
    """
    prismatic = [kind == 'prismatic' for kind in robot.joint_types]
    q = seeded_poses(robot.limits, prismatic)[:POSES]
    scales = np.array([one.scale for one in parameters])
    J = pose_change(chain, np.zeros(len(scales)), q).jacobian * scales
    J[:, 3:] *= robot.task.length
    if positions:
        J = J[:, :3]
    return triangle_of(J.reshape(-1, len(scales)) / (LENGTH * np.sqrt(len(q))))


def structural_rank(J: Floats) -> int:
    """Return the rank of a scaled Jacobian, up to round-off."""
    values = np.linalg.svd(J, compute_uv=False)
    return int(np.sum(values > NOTHING * values[0])) if len(values) else 0


def _span(J: Floats) -> Floats:
    U, values, _ = np.linalg.svd(J, full_matrices=False)
    return np.asarray(U[:, values > WEAK])


def _built(description: RobotDescription, extra: set[str] | None) -> ArmParameters:
    # With the extra corrections of these names; None: with all of them.
    variables = tuple(joint.variable for joint in description.joints)
    still: list[list[Part]] = [[]]
    screws: list[JointScrew] = []
    table: list[ArmParameter] = []
    rows = table_rows(description)
    for link, row, placed in zip(description.links, rows, _placed_rows(description)):
        kept = [
            one for one in placed if not one.extra or extra is None or one.parameter.name in extra
        ]
        first = len(table)
        table += [one.parameter for one in kept]
        motions = {
            one.parameter.name: CorrectingMotion(
                one.parameter.angle, AXES.index(one.axis), first + k
            )
            for k, one in enumerate(kept)
        }
        before, after = _arranged(description.convention, link, row, kept, motions)
        still[-1] += before
        if row.theta.coefficients or row.d.coefficients:
            screws.append(_joint_screw(row, variables))
            still.append([])
        else:
            still[-1].append(screw_z(row.theta.constant, row.d.constant))
        still[-1] += after
    return ArmParameters(tuple(table), CorrectedChain(tuple(map(tuple, still)), tuple(screws)))


def _arranged(
    convention: str,
    link: Link,
    row: Row,
    kept: Sequence[_Placed],
    motions: dict[str, CorrectingMotion],
) -> tuple[list[Part], list[Part]]:
    # The parts of a row before its screw, and after it.
    if isinstance(link, DhRow):
        at = {one.parameter.place: motions[one.parameter.name] for one in kept}
        product = CONVENTIONS[convention]
        extra: list[Part] = [at[place] for place in EXTRA_PLACES if place in at]
        before, after = (
            [part for one in part_of for part in _constant(one, link, at)]
            for part_of in (product.before_joint, product.after_joint)
        )
        along: list[Part] = [at[one.quantity] for one in product.joint_motions]
        if product.after_joint:
            return [*before, *along], [*after, *extra]
        return [*before, *extra, *along], after
    if isinstance(link, ShapeRow):
        if link.joint is None:
            return [row.before], [row.after]
        # The corrections stand between the matrix `in` and the joint, in the joint's own axes.
        return [link.inner.matrix, *motions.values(), _from(link.inner.matrix, row)], [row.after]
    return [*motions.values(), row.before], [row.after]


def _constant(
    motion: NamedMotion, link: DhRow, at: dict[str, CorrectingMotion]
) -> tuple[Part, Part]:
    # A constant factor of a row's product, and its correction.
    value = link[motion.quantity].affine.constant
    still = small_motion(motion.axis[0] == 'R', AXES.index(motion.axis[1]), value)
    return still, at[motion.quantity]


def _from(inner: Floats, row: Row) -> Floats:
    # The rest of a row's constant behind the matrix `in`.
    return np.asarray(np.linalg.solve(inner, row.before))


def _joint_screw(row: Row, variables: Sequence[str]) -> JointScrew:
    return JointScrew(
        row.theta.constant,
        row.d.constant,
        _coefficients(row.theta, variables),
        _coefficients(row.d, variables),
    )


def _coefficients(affine: Affine, variables: Sequence[str]) -> Floats:
    factors = dict(affine.coefficients)
    return np.array([factors.get(variable, 0.0) for variable in variables])


def _placed_rows(description: RobotDescription) -> Iterator[list[_Placed]]:
    for k, link in enumerate(description.links):
        if isinstance(link, DhRow):
            yield list(_of_dh_row(k, link, description.convention))
        elif isinstance(link, ShapeRow):
            yield [] if link.joint is None else list(_of_joint(k, link.joint))
        elif link.argument.affine.coefficients:
            yield list(_of_joint(k, link))
        else:
            angle = link.axis[0] == 'R'
            own = ArmParameter(
                f'{link.axis}{k + 1}', 'angles' if angle else 'lengths', angle, k, 'own'
            )
            yield [_Placed(own, link.axis[1])]


def _of_dh_row(k: int, link: DhRow, convention: str) -> Iterator[_Placed]:
    moving = [name for name in link.names if link[name].affine.coefficients]
    offset = 'theta' if 'theta' in moving else 'd' if 'd' in moving else ''
    row = k + 1
    for axis, quantity in CONVENTIONS[convention].motions:
        angle = axis[0] == 'R'
        group = 'offsets' if quantity == offset else 'angles' if angle else 'lengths'
        parameter = ArmParameter(f'{quantity}{row}', group, angle, k, quantity)
        yield _Placed(parameter, axis[1])
    if convention in WITH_EXTRA:
        yield _Placed(ArmParameter(f'beta{row}', 'angles', True, k, 'Ry'), 'y', extra=True)
        yield _Placed(ArmParameter(f'b{row}', 'lengths', False, k, 'Ty'), 'y', extra=True)


def _of_joint(k: int, joint: ElementaryMotion) -> Iterator[_Placed]:
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
            yield _Placed(ArmParameter(name, group, kind == 'R', k, place), axis, extra=True)
    yield _Placed(own, joint.axis[1])


LAG = ArmParameter('lag', 'lag', False)


def end_parameters(end: str, number: int, angles: bool = True) -> list[ArmParameter]:
    """Return the parameters of a base or tool; numbered from the second one on."""
    label = end if number == 0 else f'{end}{number + 1}'
    return [
        replace(ArmParameter(f'{label}.{name}', end, k > 2), place=name)
        for k, name in enumerate(SIX)
        if angles or k < 3
    ]
