# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the parameters of an arm that can be identified from tool poses, and build the chain of the
arm with a correction for each parameter.

Extra angles and lengths are corrections for which the table has no number. An extra correction is
added only if it moves the tool in a way that the parameters of the table cannot: the tool motion
by the extra correction is linearly independent of the tool motions by these parameters. This is
tested by projection at random poses.
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
from ...robot.robot import Robot
from ...robot.task import seeded_poses
from . import corrected_chain
from .triangle import triangle_of

# An extra parameter is a correction for which the nominal table has no number. It is added only if
# the other parameters cannot move the tool in the same way. The test computes the tool motion by
# the usual error of the extra parameter, and subtracts the best approximation by errors of the
# other parameters. The RMS of the rest over random poses must exceed MIN_EXTRA_MOTION * LENGTH,
# where LENGTH is the usual standard deviation of a length.
MIN_EXTRA_MOTION = 0.1
# An extra parameter is a correction for which the nominal table has no number. It is added only if
# errors of the other parameters cannot move the tool in the same way. Some combinations of these
# errors hardly move the tool, and are left out of the comparison. For them, the RMS of the tool
# motion over random poses is at most MIN_SPAN_MOTION * LENGTH, where LENGTH is the usual standard
# deviation of a length.
MIN_SPAN_MOTION = 0.02
# Number of random poses at which the tool motions by different parameters are compared.
POSES = 60

# Extra corrections that a row of the DH table may get: a rotation about y and a translation along
# y. The row has no quantity for them.
EXTRA_PLACES = ('Ry', 'Ty')


@dataclass(frozen=True)
class ArmParameters:
    """
    The identifiable parameters of an arm, and its chain with one correction for each parameter.

    Attributes
    ----------
    table
        The parameters of the table and the extra parameters.
    chain
        The chain from frame 0 to the frame of the last row. The columns of its Jacobian are in
        the order of `table`.
    """

    table: tuple[ArmParameter, ...]
    chain: corrected_chain.CorrectedChain


def placement(
    chain: corrected_chain.CorrectedChain, base: Floats, tool: Floats, first: tuple[int, int]
) -> corrected_chain.CorrectedChain:
    """
    Return the chain extended by the motions of base and tool, each with six corrections.

    Parameters
    ----------
    base, tool : shape (4, 4)
        `base` is the pose of frame 0 in the frame in which poses are given; `tool` is the pose of
        the tool in the frame of the last row.
    first
        Column of the first correction of the base, and of the tool. The six corrections x y z rx
        ry rz are along and about the axes of frame 0 (base), and of the frame of the last row
        (tool).
    """
    begin, end = (
        tuple(corrected_chain.CorrectingMotion(k > 2, k % 3, index + k) for k in range(6))
        for index in first
    )
    still = list(chain.still)
    still[0] = (base, *begin, *still[0])
    still[-1] = (*still[-1], *end, tool)
    return replace(chain, still=tuple(still))


def every_parameter_of(description: RobotDescription) -> ArmParameters:
    """
    Return all parameters of an arm, and the arm's chain with a correction for each parameter.

    An extra parameter is a correction for which the table has no number. All extra parameters are
    included, even if the other parameters can move the tool in exactly the same way.
    """
    return _built(description, None)


def parameters_of(robot: Robot, gears: bool = False) -> ArmParameters:
    """
    Return the parameters of an arm's table, and the extra parameters (corrections without a number
    in the table) that move the tool in a way that the table's parameters cannot.

    Parameters
    ----------
    gears
        Whether the gear ratios of the joints are added as parameters.
    """
    arm = _of_rows(robot)
    if not gears:
        return arm
    ratios, at = gear_parameters(robot.description.joints), len(arm.table)
    motions = tuple(corrected_chain.GearMotion(gear.row, at + k) for k, gear in enumerate(ratios))
    return ArmParameters((*arm.table, *ratios), replace(arm.chain, gears=motions))


def _of_rows(robot: Robot) -> ArmParameters:
    description = robot.description
    arm = every_parameter_of(description)
    extra = tuple(
        placed.parameter.name
        for row in placed_rows(description.links, description.convention)
        for placed in row
        if placed.extra
    )
    if not extra:
        return arm
    count = len(arm.table)
    chain = placement(arm.chain, np.eye(4), np.eye(4), (count, count + 6))
    ends = [parameter for end in ENDS for parameter in end_parameters(end, 0)]
    J = scaled_jacobian(robot, chain, [*arm.table, *ends])
    kept = [k for k, parameter in enumerate(arm.table) if parameter.name not in extra]
    U, values, _ = np.linalg.svd(J[:, [*kept, *range(count, count + 12)]], full_matrices=False)
    span = U[:, values > MIN_SPAN_MOTION]
    taken = set()
    for k, parameter in enumerate(arm.table):
        if parameter.name in extra:
            residual = J[:, k] - span @ (span.T @ J[:, k])
            size = float(np.linalg.norm(residual))
            if size > MIN_EXTRA_MOTION:
                span = np.column_stack([span, residual / size])
                taken.add(parameter.name)
    return _built(description, taken)


def scaled_jacobian(
    robot: Robot,
    chain: corrected_chain.CorrectedChain,
    parameters: Sequence[ArmParameter],
    positions: bool = False,
) -> Floats:
    """
    Return the QR factor R (P, P) of the scaled Jacobian of the tool's pose by P parameters.

    The Jacobian has six rows for each of POSES random poses; three rows, for the tool's origin, if
    `positions` is True. Each column is multiplied by the usual error of its parameter. Angular
    rows are multiplied by the characteristic length. Then all numbers are divided by LENGTH and by
    sqrt(POSES) (RMS). R is upper triangular.
    """
    q = seeded_poses(robot.limits, robot.prismatic)[:POSES]
    scales = np.array([parameter.scale for parameter in parameters])
    J = corrected_chain.pose_change(chain, np.zeros(len(scales)), q).jacobian * scales
    J[:, 3:] *= robot.singularity.task.length
    if positions:
        J = J[:, :3]
    return triangle_of(J.reshape(-1, len(scales)) / (LENGTH * np.sqrt(len(q))))


def _built(description: RobotDescription, extra: set[str] | None) -> ArmParameters:
    # Builds the chain with a correction for each parameter. `extra` has the names of the extra
    # parameters; None means all extra parameters.
    still: list[list[corrected_chain.Part]] = [[]]
    moving: list[Row] = []
    table: list[ArmParameter] = []
    rows = table_rows(description)
    for link, row, placed in zip(
        description.links, rows, placed_rows(description.links, description.convention)
    ):
        kept = [
            entry
            for entry in placed
            if not entry.extra or extra is None or entry.parameter.name in extra
        ]
        first = len(table)
        table += [entry.parameter for entry in kept]
        motions = {
            entry.parameter.name: corrected_chain.CorrectingMotion(
                entry.parameter.angle, AXES.index(entry.axis), first + k
            )
            for k, entry in enumerate(kept)
        }
        before, after = _arranged(description.convention, link, row, kept, motions)
        still[-1] += before
        if row.theta.coefficients or row.d.coefficients:
            moving.append(row)
            still.append([])
        else:
            still[-1].append(screw_z(row.theta.constant, row.d.constant))
        still[-1] += after
    screws = _screws_of(moving, [joint.variable for joint in description.joints])
    return ArmParameters(
        tuple(table), corrected_chain.CorrectedChain(tuple(map(tuple, still)), screws)
    )


def _arranged(
    convention: str,
    link: Link,
    row: Row,
    kept: Sequence[PlacedParameter],
    motions: dict[str, corrected_chain.CorrectingMotion],
) -> tuple[list[corrected_chain.Part], list[corrected_chain.Part]]:
    # Returns the constant motions and corrections of a row of the table in two lists, before and
    # after the joint screw of the row.
    if isinstance(link, DhRow):
        at = {entry.parameter.place: motions[entry.parameter.name] for entry in kept}
        product = CONVENTIONS[convention]
        extra: list[corrected_chain.Part] = [at[place] for place in EXTRA_PLACES if place in at]
        before, after = (
            [part for move in part_of for part in _constant(move, link, at)]
            for part_of in (product.before_joint, product.after_joint)
        )
        along: list[corrected_chain.Part] = [at[move.quantity] for move in product.joint_motions]
        if product.after_joint:
            return [*before, *along], [*after, *extra]
        return [*before, *extra, *along], after
    if isinstance(link, ShapeRow):
        if link.joint is None:
            return [row.before], [row.after]
        # The row is the product of a constant matrix (key `in` of the robot file), the joint, and
        # another constant matrix. Put the corrections directly after the first matrix. So they act
        # along and about the axes of the frame whose pose is the first matrix.
        remainder = np.asarray(np.linalg.solve(link.inner.matrix, row.before), np.float64)
        return [link.inner.matrix, *motions.values(), remainder], [row.after]
    return [*motions.values(), row.before], [row.after]


def _constant(
    motion: NamedMotion, link: DhRow, at: dict[str, corrected_chain.CorrectingMotion]
) -> tuple[corrected_chain.Part, corrected_chain.Part]:
    # A row of the table is a product of elementary motions. For the elementary motion `motion`,
    # returns two factors of the chain: the motion's matrix (4, 4) with the number in the table,
    # and the correction of this number.
    value = link[motion.quantity].affine.constant
    still = corrected_chain.small_motion(motion.axis[0] == 'R', AXES.index(motion.axis[1]), value)
    return still, at[motion.quantity]


def _screws_of(rows: Sequence[Row], variables: Sequence[str]) -> corrected_chain.MovingScrews:
    thetas, ds = [row.theta for row in rows], [row.d for row in rows]
    theta_0, d_0 = (np.array([form.constant for form in forms]) for forms in (thetas, ds))
    by_theta, by_d = (
        np.array([[dict(form.coefficients).get(key, 0.0) for key in variables] for form in forms])
        for forms in (thetas, ds)
    )
    return corrected_chain.MovingScrews(theta_0, d_0, by_theta, by_d)
