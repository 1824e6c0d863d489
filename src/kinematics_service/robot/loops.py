# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert the closed loops of an arm to the kernel's data, and check that the loops close.

Each loop has two chains. The variables of both chains are the joints of the arm, followed by the
passive joints of all loops.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from .. import kernel
from ..kernel import Chain, Closure, Floats, Loop, LoopGroup
from ..rigid_motion import inverse, skew_part
from .chain import fold, poses_and_jacobians
from .conventions import row_of, table_rows
from .file.parts.description import (
    JointDescription,
    Link,
    LoopDescription,
    PointDescription,
    RobotDescription,
    SingularityDescription,
)
from .file.parts.links import names_in_rows
from .file.parts.loop_groups import loop_groups, names_in_loop, passive_of
from .file.parts.singularity import ROWS
from .file.reader import refuse

# A rotation (rad) or translation (m) between the ends of a loop's two chains counts as zero up to
# this number.
ROTATION_TOLERANCE = 1e-9
# The two chains of a loop must meet at their ends. A passive joint changes some components of the
# pose of one end relative to the other end. To find these components, the joint is moved by this
# step, rad or m.
JOINT_STEP = 0.1


def passive_names(description: RobotDescription) -> frozenset[str]:
    """Return the names of the passive joints."""
    return frozenset(joint.name for joint in passive_of(description.loops))


def opened(description: RobotDescription) -> RobotDescription:
    """
    Return an arm without its closed loops. The passive joints become actuated joints without
    limits.
    """
    passive = tuple(
        JointDescription(joint.name, joint.name, joint.type, -np.inf, np.inf, np.inf)
        for joint in passive_of(description.loops)
    )
    return replace(
        description,
        joints=description.joints + passive,
        singularity=SingularityDescription(),
        known_poses=(),
        loops=(),
    )


def variables_of(description: RobotDescription) -> tuple[str, ...]:
    """Return the joint variables, followed by the passive joints of all loops."""
    passive = (joint.name for joint in passive_of(description.loops))
    return (*(joint.variable for joint in description.joints), *passive)


def moving_variables(description: RobotDescription, links: Sequence[Link]) -> frozenset[str]:
    """Return the variables that move one of the rows `links`, directly or by closed loops."""
    moving = names_in_rows(links)
    for group in reversed(loop_groups(description.loops)):
        if moving & {joint.name for joint in passive_of(group)}:
            moving = moving.union(*map(names_in_loop, group))
    return moving


def chain_of(
    description: RobotDescription, closure: Closure | None, point: PointDescription | None = None
) -> Chain:
    """Return the kernel's chain of an arm from the base to the tool, or to the point `point`."""
    rows, end = table_rows(description), description.tool.motion
    if point is not None:
        rows, end = rows[: point.row], point.motion
    base = description.base.motion.matrix
    return fold(rows, variables_of(description), base, end.matrix, closure)


def closure_of(description: RobotDescription) -> Closure | None:
    """
    Return the closed loops of an arm as an object of the kernel; None if it has no loops.

    Raises
    ------
    RobotFileError
        A loop does not close near the position `assembled`, or the loop equations are singular at
        this position.
    """
    if not description.loops:
        return None
    variables = variables_of(description)
    n = len(description.joints)
    chains = [_chains(description, loop, variables) for loop in description.loops]
    size = max(_size(chain) for pair in chains for chain in pair) or 1.0
    units = _units(description, chains, size)
    groups = loop_groups(description.loops)
    following = _grouped(groups, chains, n, size, units)
    start = np.zeros(kernel.section_width(n, following))
    values = [value for loop in description.loops for value in loop.assembled]
    start[: len(variables)] = [*description.loops[0].q, *values]
    given = start[: len(variables)].copy()
    failed = kernel.assemble(following, len(groups), n, start)
    if failed:
        _refuse(description, len(groups) - failed, chains, given, start)
    closure = Closure(n, following, _turns(description, chains), start)
    for loop, pair in zip(description.loops, chains):
        _check_rest(description, loop, pair, start[: len(variables)])
    return closure


def _grouped(
    groups: Sequence[Sequence[LoopDescription]],
    chains: Sequence[tuple[Chain, Chain]],
    dof: int,
    size: float,
    units: Floats,
) -> LoopGroup:
    # Return the closed loops as the kernel needs them: a linked list of groups. Each group refers
    # to the next group, and the result is the first group.
    before = list(chains)
    first, following = dof + sum(len(passive_of(group)) for group in groups), None
    for group in reversed(groups):
        row, loop = sum(len(description.rows) for description in group), None
        first -= row
        for description in reversed(group):
            row -= len(description.rows)
            axes = np.array([ROWS.index(name) for name in description.rows], dtype=np.int64)
            loop = Loop(*before.pop(), axes, row, loop)
        assert loop is not None
        following = LoopGroup(loop, first, size, units, following)
    assert following is not None
    return following


def _chains(
    description: RobotDescription, loop: LoopDescription, variables: Sequence[str]
) -> tuple[Chain, Chain]:
    # Return the two chains of a closed loop: the chain of table rows, and the chain of the rows in
    # the loop's own list. Both chains begin in the frame `loop.start`.
    convention, identity = description.convention, np.eye(4)
    table_rows = [row_of(link, convention) for link in loop.there]
    loop_rows = [row_of(link, convention) for link in loop.links]
    return (
        fold(table_rows, variables, inverse(loop.start.motion.matrix), loop.meets.motion.matrix),
        fold(loop_rows, variables, identity, identity),
    )


def _size(chain: Chain) -> float:
    # Return the sum of the constant lengths of a chain, m.
    lengths = np.linalg.norm(chain.table.before[:, :, 3], axis=1)
    return float(np.sum(lengths) + np.sum(np.abs(chain.table.d_0)))


def _units(
    description: RobotDescription, chains: Sequence[tuple[Chain, Chain]], size: float
) -> Floats:
    # Return, for each joint and passive joint, the motion that counts as much as a rotation by 1
    # rad when the loop equations are solved. It is 1 rad for a joint that turns, `size` (m) for a
    # joint that slides, and infinite for a joint that moves no loop.
    kinds = [joint.type for joint in description.joints]
    kinds += [joint.type for joint in passive_of(description.loops)]
    inside = {int(j) for pair in chains for chain in pair for j in chain.table.joint}
    units = (size if kind == 'prismatic' else 1.0 for kind in kinds)
    return np.array([unit if j in inside else np.inf for j, unit in enumerate(units)])


def _turns(
    description: RobotDescription, chains: Sequence[tuple[Chain, Chain]]
) -> kernel.Integers:
    # Return 1 for each joint that has no limits and whose full turn leaves every closed loop
    # unchanged, and 0 for the other joints.
    turns = np.zeros(len(description.joints), dtype=np.int64)
    tables = [chain.table for pair in chains for chain in pair]
    for j, joint in enumerate(description.joints):
        endless = joint.type == 'revolute' and np.isinf([joint.lower, joint.upper]).all()
        shares = np.concatenate([table.by_theta[table.joint == j] for table in tables])
        turns[j] = endless and len(shares) > 0 and bool(np.all(shares == np.round(shares)))
    return turns


def _gap(pair: tuple[Chain, Chain], x: Floats) -> Floats:
    # Return the difference between the ends of a loop's two chains, (6,), in the coordinates of
    # the frame in which both chains begin: translation, m, and rotation as unit vector times sine
    # of the angle.
    (first,), (second,) = (poses_and_jacobians(chain, x[None])[0] for chain in pair)
    return gap_between(first, second)


def gap_between(first: Floats, second: Floats) -> Floats:
    """
    Return the translation (m) and the rotation (unit vector times sine of the angle) from pose
    `first` to pose `second`, in the frame in which both poses are given.

    Poses have shape (..., 4, 4), the result has shape (..., 6).
    """
    turn = second[..., :3, :3] @ np.swapaxes(first[..., :3, :3], -1, -2)
    translation = second[..., :3, 3] - first[..., :3, 3]
    return np.concatenate([translation, 0.5 * skew_part(turn)], axis=-1)


def _refuse(
    description: RobotDescription,
    g: int,
    chains: Sequence[tuple[Chain, Chain]],
    given: Floats,
    start: Floats,
) -> NoReturn:
    groups = loop_groups(description.loops)
    group, first = groups[g], sum(len(earlier) for earlier in groups[:g])
    variables, n = len(given), len(description.joints)
    failure = start[2 * variables + (variables - n) * n + 3 * g :]
    passive = passive_of(group)
    begin = n + sum(len(passive_of(earlier)) for earlier in groups[:g])
    moved = np.arange(begin, begin + len(passive))
    alone = len(group) == 1
    its = 'its' if alone else 'their'
    for k, loop in enumerate(group, first):
        if idle := _idle_rows(loop, chains[k], moved, given):
            message = (
                f'no passive joint of the {"loop" if alone else "loops closed together"} moves '
                f'{" or ".join(idle)}; write the rows of the plane in which it moves'
            )
            refuse(description.file, message, 'no-effect', loop.line, f'loops[{k}].rows')
    names = ' and '.join(repr(loop.name) for loop in group)
    if failure[1] <= 1e-9:
        message = (
            f'{"the loop is" if alone else f"the loops {names} together are"} flat at this '
            f'position: det of {its} closure by {", ".join(joint.name for joint in passive)} is '
            f'0, and two of {its} branches meet; give a position on one branch'
        )
        code = 'flat-loop'
    else:
        gaps = [_gap_in_words(loop, chains[k], given) for k, loop in enumerate(group, first)]
        apart = [gap if alone else f'{loop.name}: {gap}' for loop, gap in zip(group, gaps)]
        message = (
            f'{"the loop does not close" if alone else f"the loops {names} do not close together"}'
            f' here: {its} ends are apart by {"; ".join(apart)} (m, rad), and '
            "Newton's method finds no closed position nearby; correct assembled, or the lengths"
        )
        code = 'open-loop'
    refuse(description.file, message, code, group[0].line, f'loops[{first}].assembled')


def _gap_in_words(loop: LoopDescription, pair: tuple[Chain, Chain], x: Floats) -> str:
    gap = np.round(_gap(pair, x), 12) + 0.0
    return ', '.join(f'{row} {gap[ROWS.index(row)]:.3g}' for row in loop.rows)


def _idle_rows(
    loop: LoopDescription, pair: tuple[Chain, Chain], passive: kernel.Integers, x: Floats
) -> list[str]:
    # Return the names (such as `rx`) of the components of position and rotation that must agree at
    # the ends of the loop's two chains, but that no passive joint changes. `passive` has the
    # indices of the passive joints in the loop's group, `x` the positions of all joints. Test at
    # other joint positions, because at `x` the loop equations may be singular.
    away = np.array(x)
    away[passive] += JOINT_STEP * (1.0 + np.arange(len(passive)))
    moved = np.zeros(len(ROWS))
    for j in passive:
        step = np.zeros(len(x))
        step[j] = JOINT_STEP
        moved = np.maximum(moved, np.abs(_gap(pair, away + step) - _gap(pair, away - step)))
    return [row for row in loop.rows if moved[ROWS.index(row)] < ROTATION_TOLERANCE]


def _check_rest(
    description: RobotDescription, loop: LoopDescription, pair: tuple[Chain, Chain], x: Floats
) -> None:
    # Refuse a loop if its key `rows` has only one or two of the rotations rx, ry, rz, and the end
    # frames of the loop's two chains are not parallel at the assembled position. For such frames,
    # the solver's derivatives of rx, ry and rz are wrong, and its steps do not close the loop.
    # With all three rotations, the closed loop makes the frames parallel.
    named = [row for row in loop.rows if row in ROWS[3:]]
    if len(named) in (0, 3):
        return
    gap = _gap(pair, x)
    turned = zip(ROWS[3:], np.abs(gap[3:]) > ROTATION_TOLERANCE)
    others = [row for row, turns in turned if turns and row not in named]
    if others:
        k = description.loops.index(loop)
        message = (
            f'the ends are turned against each other about {" and ".join(others)} at the '
            f'assembled position, and rows has only {" ".join(named)}; '
            'write rx, ry and rz, or none of them'
        )
        refuse(description.file, message, 'missing-rows', loop.line, f'loops[{k}].rows')
