"""
The numbers of an arm that may be off, with its chain.

Extra angles and lengths are taken only where, over random poses, they move the tool as no number
of the table can.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...kernel import Floats
from ...rigid_motion import screw_z
from ...robot.conventions import Row, table_rows
from ...robot.file.parts.convention_table import CONVENTIONS, NamedMotion
from ...robot.file.parts.description import DhRow, Link, RobotDescription, ShapeRow
from ...robot.file.parts.parameters import (
    AXES,
    ENDS,
    LENGTH,
    ArmParameter,
    PlacedParameter,
    end_parameters,
    gear_parameters,
    placed_rows,
)
from ...robot.file.text.expressions import Affine
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

# An extra correction is taken if it moves the tool by this share of LENGTH as nothing else does;
# directions that move it less than the second share count as no way to do so.
EXTRA, WEAK = 0.1, 0.02
# Number of random poses by which that is judged, and of those that tell the rank.
POSES = 60

# Where in a row of a table the extra corrections are.
EXTRA_PLACES = ('Ry', 'Ty')


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
    return replace(chain, still=tuple(still))


def every_parameter_of(description: RobotDescription) -> ArmParameters:
    """Return the parameters of an arm, with all extra ones, needed or not."""
    return _built(description, None)


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
    own = gear_parameters(robot.description.joints)
    count = len(arm.table)
    motions = tuple(GearMotion(one.row, count + at) for at, one in enumerate(own))
    return ArmParameters((*arm.table, *own), replace(arm.chain, gears=motions))


def _of_rows(robot: Robot) -> ArmParameters:
    description = robot.description
    every = every_parameter_of(description)
    extra = tuple(
        one.parameter.name
        for row in placed_rows(description.links, description.convention)
        for one in row
        if one.extra
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
    q = seeded_poses(robot.limits, robot.prismatic)[:POSES]
    scales = np.array([one.scale for one in parameters])
    J = pose_change(chain, np.zeros(len(scales)), q).jacobian * scales
    J[:, 3:] *= robot.singularity.task.length
    if positions:
        J = J[:, :3]
    return triangle_of(J.reshape(-1, len(scales)) / (LENGTH * np.sqrt(len(q))))


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
    for link, row, placed in zip(
        description.links, rows, placed_rows(description.links, description.convention)
    ):
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
    kept: Sequence[PlacedParameter],
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
