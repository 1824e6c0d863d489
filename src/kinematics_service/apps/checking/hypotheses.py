# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Generate hypotheses: mistakes that may explain why two sources of poses differ."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.corrected_chain import PoseChange, pose_change
from ...kinematics.uncertainty.parameters import parameters_of, placement
from ...rigid_motion import rotation_of_quaternion
from ...robot.chain import fold
from ...robot.conventions import Row, row_of, table_rows
from ...robot.file.parts.convention_table import CONVENTIONS
from ...robot.file.parts.description import DhRow
from ...robot.file.parts.parameters import ANGLE, LENGTH, RATIO, SIX
from ...robot.robot import Robot, with_chain
from .lag import Later

# Statements of mistakes. They are worded for measured poses. If the poses are the known poses of a
# robot file, `known_pose_causes` words some of the statements differently.
DEGREES = 'the joint positions are in degrees, not radians'
RADIANS_TWICE = 'the joint positions were turned from degrees into radians twice'
INVERSE = 'the poses are those of the base in the tool frame'
LENGTHS_IN_MM = 'the lengths of the table are in millimetres, not metres'
# Pairs of joints (swapped, or coupled) are tried for arms with at most 12 joints.
MAX_SWAPPED_JOINTS = 12
# A joint moves if a position differs from the mean position by more than this value (rad, m).
MIN_RANGE = 1e-3


class Hypothesis(NamedTuple):
    """
    A possible discrete mistake, with corrected joint positions, table or poses.

    Attributes
    ----------
    key
        Kind of the cause, for programs.
    sentence
        The mistake, as a statement.
    q : shape (N, n)
        Joint positions with the mistake corrected; None: they are right.
    robot
        The robot with the mistake corrected; None: it is right.
    poses : shape (N, 4, 4)
        Poses with the mistake corrected; None: they are right.
    unit
        Length (m) of one unit of the coordinates in the corrected poses.
    """

    key: str
    sentence: str
    q: Floats | None = None
    robot: Robot | None = None
    poses: Floats | None = None
    unit: float = 1.0

    def joints(self, q: Floats) -> Floats:
        """
        Return the corrected joint positions; `q` if the mistake is not in the joint positions.
        """
        return q if self.q is None else self.q

    def seen(self, poses: Floats) -> Floats:
        """Return the corrected poses; `poses` if the mistake is not in the poses."""
        return poses if self.poses is None else self.poses


class NumberHypothesis(NamedTuple):
    """
    A number of the robot file that may be wrong: a joint's zero or scale, a length or an angle.

    The scale of a joint is fitted together with the zero of the joint.

    Attributes
    ----------
    key, name
        `key`: kind of the cause, for programs. `name`: name of the joint; if the number is in the
        DH table, its quantity and row, for example `a of links[2]`.
    unit
        rad or m.
    usual
        A usual error of the number, rad or m. For a scale: the error that a usual error of the
        gear ratio causes at the end of the joint's range.
    at
        Returns the poses (1, N, 4, 4) after corrections (1, c) are added, and the derivatives (1,
        N, 6, c) of the poses by the corrections. c is 1. For a scale c is 2: correction of the
        zero, and correction at the end of the joint's range.
    columns : shape (N, 6, c)
        The derivatives of the poses at zero correction, linear rows first.
    joint
        Index of the joint whose zero or scale this is; -1 for a number of the table.
    """

    key: str
    name: str
    unit: str
    usual: float
    at: Callable[[Floats], PoseChange]
    columns: Floats
    joint: int = -1


class ComparedData(NamedTuple):
    """
    The data that are compared: a robot and its joint positions with the poses of a second source.

    Attributes
    ----------
    robot
        The robot of the file.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4)
        Poses of the second source.
    later
        The joint positions as a function of a lag; None if the stamps do not rise.
    read
        The convention by which the orientations were read, one of `pose_format.KINDS`; empty if
        unknown.
    """

    robot: Robot
    q: Floats
    poses: Floats
    later: Later | None = None
    read: str = ''


def hypotheses_of(given: ComparedData) -> Iterator[Hypothesis]:
    """
    Yield all possible discrete mistakes of joint positions, table and poses, except a wrong order
    of three angles.
    """
    yield from joint_hypotheses_of(given.robot, given.q)
    yield from _of_table(given)
    yield from _of_poses(given.poses)


def joint_hypotheses_of(robot: Robot, q: Floats) -> Iterator[Hypothesis]:
    """Yield all possible discrete mistakes of the joint positions (N, n), rad or m."""
    names, n = robot.joint_names, robot.dof
    for j in range(n):
        signs = np.ones(n)
        signs[j] = -1.0
        yield Hypothesis('joint_sign', f'joint {names[j]} counts the other way round', q * signs)
    if n > 1:
        yield Hypothesis('joint_signs', 'all joints count the other way round', -q)
    seen = {tuple(range(n))}
    for order, sentence in _orders(names):
        if order not in seen:
            seen.add(order)
            yield Hypothesis('joint_order', sentence, q[:, list(order)])
    turning = ~robot.prismatic
    if np.any(turning):
        yield Hypothesis('degrees', DEGREES, from_degrees(robot, q))
        yield Hypothesis('degrees', RADIANS_TWICE, np.where(turning, np.degrees(q), q))
    if not np.all(turning):
        sliding = 'the positions of the sliding joints are in millimetres, not metres'
        yield Hypothesis('millimetres', sliding, np.where(turning, q, 1e-3 * q))
    yield from _coupled(robot, q)


def from_degrees(robot: Robot, q: Floats) -> Floats:
    """Convert the angles of joint positions (N, n) from degrees to rad; lengths stay."""
    return np.where(robot.prismatic, q, np.radians(q))


def _coupled(robot: Robot, q: Floats) -> Iterator[Hypothesis]:
    # Yield hypotheses that one joint also turns if another joint moves, because a belt or a
    # parallelogram couples the two joints. For example, joint 3 turns with joint 2 in FANUC arms
    # and palletizers.
    turning = np.flatnonzero(~robot.prismatic).tolist()
    if len(turning) > MAX_SWAPPED_JOINTS:
        return
    for (i, j), sign in itertools.product(itertools.permutations(turning, 2), (1.0, -1.0)):
        moved = np.array(q)
        moved[:, j] += sign * q[:, i]
        yield Hypothesis(
            'joint_coupling',
            f'joint {robot.joint_names[j]} turns with joint {robot.joint_names[i]}: its row of '
            f'the table needs {robot.variables[j]} {"+" if sign > 0.0 else "-"} '
            f'{robot.variables[i]}',
            moved,
        )


def _orders(names: tuple[str, ...]) -> Iterator[tuple[tuple[int, ...], str]]:
    n = len(names)
    if n <= MAX_SWAPPED_JOINTS:
        for i, j in itertools.combinations(range(n), 2):
            order = list(range(n))
            order[i], order[j] = j, i
            yield tuple(order), f'joints {names[i]} and {names[j]} are swapped'
    yield tuple(reversed(range(n))), 'the joints are in reverse order'
    ranks = sorted(range(n), key=lambda j: names[j])
    back = tuple(ranks.index(j) for j in range(n))
    yield back, 'the joints are in alphabetical order'
    yield tuple(ranks), 'the joints were taken out of alphabetical order twice'
    yield (*range(1, n), 0), 'the joints are one place too late'
    yield (n - 1, *range(n - 1)), 'the joints are one place too early'


def _of_table(given: ComparedData) -> Iterator[Hypothesis]:
    robot = given.robot
    if robot.chain.loops:
        return  # with another table, closed loops would no longer close at the given positions
    for other in CONVENTIONS[robot.convention].others:
        sentence = f'the table is {other.name}, and is read as {robot.convention}'
        yield Hypothesis('convention', sentence, robot=read_as(robot, other.name))


def read_as(robot: Robot, convention: str) -> Robot:
    """Return the robot whose DH table has the same numbers, but is read by another convention."""
    return _with_rows(robot, [row_of(link, convention) for link in robot.description.links])


def _with_rows(
    robot: Robot, rows: Sequence[Row], base: Floats | None = None, tool: Floats | None = None
) -> Robot:
    # Return the robot with the table `rows`, and with another base or tool if one is given.
    description = robot.description
    base = description.base.motion.matrix if base is None else base
    tool = description.tool.motion.matrix if tool is None else tool
    return with_chain(robot, fold(rows, robot.variables, base, tool))


def number_signs_of(robot: Robot) -> Iterator[Hypothesis]:
    """Yield a hypothesis for each constant of the table: the sign of the constant is wrong."""
    rows = list(table_rows(robot.description))
    for k, link in enumerate(robot.description.links):
        if not isinstance(link, DhRow):
            continue
        constants = _constants(link)
        for j, name in enumerate(link.names):
            if constants[j] == 0.0:
                continue
            turned = np.where(np.arange(len(constants)) == j, -constants, constants)
            changed = [*rows[:k], _with_constants(robot, link, turned), *rows[k + 1 :]]
            number = f'the constant of {name}' if link[name].affine.coefficients else name
            sentence = f'{number} of links[{k}] has the other sign'
            yield Hypothesis('number_sign', sentence, robot=_with_rows(robot, changed))


def _constants(row: DhRow) -> Floats:
    return np.array([motion.argument.affine.constant for motion in row.motions])


def _with_constants(robot: Robot, row: DhRow, constants: Floats) -> Row:
    arguments = (
        replace(motion.argument, affine=replace(motion.argument.affine, constant=float(x)))
        for motion, x in zip(row.motions, constants)
    )
    motions = tuple(replace(motion, argument=new) for motion, new in zip(row.motions, arguments))
    return row_of(replace(row, motions=motions), robot.convention)


def exchanges_of(robot: Robot) -> Iterator[Hypothesis]:
    """
    Yield hypotheses that numbers of the table are at wrong places: two constants are exchanged, or
    a whole column is shifted by one row.
    """
    links = robot.description.links
    rows = [link for link in links if isinstance(link, DhRow)]
    if len(rows) < len(links) or len(rows) > MAX_SWAPPED_JOINTS:
        return
    table = np.array([_constants(row) for row in rows])
    tried = {table.tobytes()}
    names, count = rows[0].names, len(rows)
    angles = [motion.turns for motion in rows[0].motions]
    for column, name in enumerate(names):
        for step, where in ((1, 'high'), (-1, 'low')):
            other = np.array(table)
            other[:, column] = np.roll(table[:, column], step)
            sentence = f'column {name} of the table is one row too {where}'
            yield from _with_numbers(robot, rows, other, sentence, tried)
    slots = list(itertools.product(range(count), range(len(names))))
    for (k, i), (m, j) in itertools.combinations(slots, 2):
        if i == j or not (angles[i] or angles[j]):
            other = np.array(table)
            other[k, i], other[m, j] = table[m, j], table[k, i]
            sentence = f'{names[i]} of links[{k}] and {names[j]} of links[{m}] are exchanged'
            yield from _with_numbers(robot, rows, other, sentence, tried)


def _with_numbers(
    robot: Robot, rows: Sequence[DhRow], table: Floats, sentence: str, tried: set[bytes]
) -> Iterator[Hypothesis]:
    # Yield the hypothesis that `table` (rows, quantities) has the right constants of the DH rows
    # `rows`, unless the same constants were already tried.
    if table.tobytes() in tried:
        return
    tried.add(table.tobytes())
    changed = [_with_constants(robot, row, constants) for row, constants in zip(rows, table)]
    yield Hypothesis('exchange', sentence, robot=_with_rows(robot, changed))


def ends_left_out_of(robot: Robot) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses that the poses were given without the base offset of the file, or without
    its tool offset.
    """
    rows, description, identity = table_rows(robot.description), robot.description, np.eye(4)
    if not np.array_equal(description.base.motion.matrix, identity):
        sentence = "the poses are given in the table's frame 0, without the base of the file"
        yield Hypothesis('base', sentence, robot=_with_rows(robot, rows, base=identity))
    if not np.array_equal(description.tool.motion.matrix, identity):
        sentence = 'the poses are those of the frame after the last row, without the tool'
        yield Hypothesis('tool', sentence, robot=_with_rows(robot, rows, tool=identity))


def _of_poses(poses: Floats) -> Iterator[Hypothesis]:
    R, p = poses[:, :3, :3], poses[:, :3, 3]
    Rt = np.swapaxes(R, 1, 2)
    x, y, z, w = quaternions_of(poses).T
    from_wxyz, from_xyzw = (
        rotation_of_quaternion(np.stack(numbers, axis=1))
        for numbers in ((y, z, w, x), (w, x, y, z))
    )

    def undone(
        key: str, sentence: str, rotations: Floats, positions: Floats, unit: float = 1.0
    ) -> Hypothesis:
        T = np.array(poses)
        T[:, :3, :3], T[:, :3, 3] = rotations, positions
        return Hypothesis(key, sentence, poses=T, unit=unit)

    yield undone('millimetres', 'the poses are in millimetres, not metres', R, 1e-3 * p)
    yield undone('millimetres', LENGTHS_IN_MM, R, 1e3 * p, 1e-3)
    positions = 'the positions are in tool axes, not in base axes'
    yield undone('tool_axes', positions, R, np.einsum('nij,nj->ni', R, p))
    yield undone('tool_axes', INVERSE, Rt, -np.einsum('nij,nj->ni', Rt, p))
    yield undone('tool_axes', 'the orientations are those of the base in tool axes', Rt, p)
    read = 'the quaternions are w x y z, and are read as x y z w'
    yield undone('quaternion_order', read, from_wxyz, p)
    were_read = 'the quaternions are x y z w, and were read as w x y z'
    yield undone('quaternion_order', were_read, from_xyzw, p)


def quaternions_of(poses: Floats) -> Floats:
    """Return the unit quaternions x y z w (N, 4) of poses (N, 4, 4)."""
    quaternions_xyzw = np.empty((len(poses), 4))
    kernel.quaternions(np.ascontiguousarray(poses), quaternions_xyzw)
    return quaternions_xyzw


def number_hypotheses_of(given: ComparedData) -> Iterator[NumberHypothesis]:
    """
    Yield hypotheses that one number of the robot file is wrong: one for each joint zero, and one
    for each number of the table.
    """
    robot = given.robot
    yield from _of_joints(given, 'joint_offset', 1)
    if robot.chain.loops:
        return  # with another table, closed loops would no longer close at the given positions
    arm, nominal = parameters_of(robot), robot.description
    ends = len(arm.table), len(arm.table) + len(SIX)
    chain = placement(arm.chain, nominal.base.motion.matrix, nominal.tool.motion.matrix, ends)
    corrections = np.eye(ends[1] + len(SIX))
    columns = pose_change(chain, 0.0 * corrections[0], given.q).jacobian
    for k, number in enumerate(arm.table):
        if number.group == 'offsets':
            continue  # `_of_joints` has already yielded the hypotheses of wrong joint zeros
        row = slice(k, k + 1)

        def at(values: Floats, row: slice = row) -> PoseChange:
            change = pose_change(chain, values[0] @ corrections[row], given.q)
            return PoseChange(change.pose[None], change.jacobian[None, :, :, row])

        key, unit = ('link_twist', 'rad') if number.angle else ('link_length', 'm')
        name = f'{number.name.rstrip("0123456789")} of links[{number.row}]'
        yield NumberHypothesis(key, name, unit, number.scale, at, columns[:, :, row])


def scale_hypotheses_of(given: ComparedData) -> Iterator[NumberHypothesis]:
    """
    Yield for each moving joint the hypothesis that its positions were multiplied by a wrong factor
    (unit or gear ratio). The zero of the joint (rad, m) and the factor are fitted together.
    """
    yield from _of_joints(given, 'joint_scale', 2)


def _of_joints(given: ComparedData, key: str, count: int) -> Iterator[NumberHypothesis]:
    robot, ways = given.robot, joint_ways(given.q)
    for j, (name, unit, reach) in enumerate(
        zip(robot.joint_names, robot.units, joint_range(given.q).tolist())
    ):
        usual = RATIO * reach if count > 1 else LENGTH if unit == 'm' else float(ANGLE)
        at = partial(moved_joints, robot, given.q, [j], ways[j : j + 1, :, :count])
        if count == 1 or reach > MIN_RANGE:
            columns = at(np.zeros((1, count))).jacobian[0]
            yield NumberHypothesis(key, name, unit, usual, at, columns, j)


def joint_range(q: Floats) -> Floats:
    """
    Return the largest distance of each joint's positions from their mean, shape (n,), rad or m,
    from joint positions (N, n).
    """
    return np.asarray(np.max(np.abs(q - q.mean(axis=0)), axis=0))


def joint_ways(q: Floats) -> Floats:
    """
    Return the derivatives (n, N, 2) of joint positions q (N, n) by two corrections of each joint.

    The first correction shifts all positions of a joint (wrong zero). The second correction
    stretches the positions about their mean (wrong scale). The size of the second correction is
    the change of the position that is farthest from the mean, rad or m.
    """
    reach = np.maximum(joint_range(q), MIN_RANGE)
    return np.stack([np.ones_like(q), (q - q.mean(axis=0)) / reach], axis=-1).swapaxes(0, 1)


def moved_joints(
    robot: Robot, q: Floats, joints: Sequence[int], ways: Floats, values: Floats
) -> PoseChange:
    """
    Return the poses after the positions of one joint are corrected, and the derivatives of the
    poses. The function does this for H corrections at once.

    A correction has c parameters, rad or m, such as a change of the joint's zero. The poses have
    the shape (H, N, 4, 4). The derivatives of the poses by the parameters have the shape
    (H, N, 6, c).

    Parameters
    ----------
    q : shape (N, n), rad or m
        Joint positions before the correction.
    joints : H
        Index of the corrected joint, for each correction.
    ways : shape (H, N, c)
        Derivatives of the N positions of the corrected joint by the c parameters.
    values : shape (H, c)
        Values of the c parameters.
    """
    indices = np.arange(len(joints))
    moved = np.tile(q, (len(joints), 1, 1))
    moved[indices, :, joints] += (ways @ values[..., None])[..., 0]
    state = evaluate(robot, moved)
    J = state.jacobian[indices, :, :, joints]
    return PoseChange(state.pose, J[..., None] * ways[:, :, None])
