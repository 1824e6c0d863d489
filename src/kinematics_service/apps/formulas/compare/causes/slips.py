# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Generate wrong versions of a formula: wrong sign, units or inverse, another quantity, or a Jacobian
with wrong row order, axes or reference point.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from .....rigid_motion import inverses
from .....robot.file.parts.convention_table import CONVENTIONS
from ...arm.numbers import DEGREE, Floats
from ...arm.world import World
from ..arm.quantities import Quantity, arranged, refusal_of, value_of
from ..statements.checks import QuantityCheck
from .variant import POSES, Variant

MILLIMETRES_PER_METRE = 1000.0  # by definition


def own_axes(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the z axis of a frame written in the frame's own axes, instead of base axes."""
    values = np.zeros_like(check.right)
    values.reshape(len(values), 3)[:, 2] = 1.0
    sentence = 'z in the axes of its own frame: it must be turned into base axes, R [0; 0; 1]'
    yield Variant(sentence, values)


def millimetres(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the values of the quantity with lengths in millimetres instead of metres."""
    if check.quantity.kind == 'jacobian':
        J = check.world.jacobian.copy()
        J[:, :3] *= MILLIMETRES_PER_METRE
        yield mistaken(check, 'the linear rows are in mm', J)
        J[:, :3, list(check.world.table.slides)] /= MILLIMETRES_PER_METRE
        yield mistaken(check, 'lengths are in mm', J)
    elif check.quantity.kind in POSES:
        values = check.right.copy()
        values[:, :3, 3:] *= MILLIMETRES_PER_METRE
        yield Variant('the position is in mm', values)
    else:
        yield Variant('lengths are in mm', check.right * MILLIMETRES_PER_METRE)


def transposed(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield three wrong forms of the correct matrix: transposed, with only its rotation part
    transposed, and inverted.
    """
    right = check.right
    rows, columns = right.shape[1:]
    if rows == columns and rows > 1:
        kind = 'inverse (its transpose)' if check.quantity.kind == 'rotation' else 'transpose'
        yield Variant(f'it is the {kind} of the right matrix', np.swapaxes(right, 1, 2))
    if right.shape[1:] in ((4, 4), (3, 4)):
        turned = right.copy()
        turned[:, :3, :3] = np.swapaxes(right[:, :3, :3], 1, 2)
        yield Variant('its rotation is transposed', turned)
        yield Variant('it is the inverse of the right matrix', inverses(right))


def base_and_tool(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the tool's pose with and without the base transform and the tool transform.

    If the formula defines T, poses without one of the two transforms are mistakes. If the formula
    defines T_06 of an arm with six rows, the pose with both transforms is a mistake, because T_06
    contains neither transform.
    """
    frames = check.world.frames
    versions = (
        (np.linalg.solve(frames[0], frames[-1]), 'the base is left out'),
        (frames[-2], 'the tool is left out'),
        (np.linalg.solve(frames[0], frames[-2]), 'base and tool are left out'),
        (frames[-1], 'base and tool are included'),
    )
    for pose, sentence in versions:
        whole = np.asarray(pose[:, :3, 3:] if check.quantity.kind == 'position' else pose)
        yield Variant(sentence, check.cut(whole, check.quantity))


def bottom_row(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the derivative of the tool's pose with a mistake: entry (4,4) is 1 instead of 0."""
    values = check.right.copy()
    values[:, 3, 3] = 1.0
    yield Variant('(4,4) is the derivative of the constant 1: it is 0, not 1', values)


def another_quantity(check: QuantityCheck) -> Iterator[Variant]:
    """Yield all other quantities of the arm that have the shape of the user's formula."""
    for quantity, name in _quantities(check):
        values = check.cut(value_of(quantity, check.world, check.reading), quantity)
        if quantity != check.quantity and values.shape[1:] == check.shape:
            yield Variant(f'it is {name}', values)


def _quantities(check: QuantityCheck) -> Iterator[tuple[Quantity, str]]:
    table = check.world.table
    rows, joints = len(table.rows), len(table.variables)
    first = check.reading.first_frame
    for i in range(1, joints + 1):
        for part, name in (('v', 'J_v'), ('w', 'J_w'), ('all', 'J_')):
            yield Quantity('jacobian', i, part=part), f'{name}{i}'
    yield from ((Quantity('jacobian', part=part), f'J_{part}') for part in 'vw')
    for i in range(rows + 1):
        for kind, name in (('rotation', 'R_'), ('axis', 'z_'), ('origin', 'o_')):
            quantity = Quantity(kind, i + first)
            if refusal_of(quantity, table, check.reading) is None:
                yield quantity, f'{name}{i + first}'
    for i in range(1, rows + 1):
        yield Quantity('row', i), f'the matrix of row {i}'
        for j in range(rows) if check.quantity.kind in ('pose', 'tool', 'row') else ():
            if j != i:
                yield Quantity('pose', j + first, i + first), f'T_{j + first}{i + first}'


def sign(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the correct values with the opposite sign."""
    yield Variant('the sign is wrong', -check.right)


def mistaken(
    check: QuantityCheck, sentence: str, J: Floats, columns: tuple[int, ...] = ()
) -> Variant:
    """
    Return a mistaken Jacobian J as a `Variant` with the axes, rows and row order of the user's
    formula. The input J has base axes and linear rows first. `columns` holds the indices of the
    columns that the mistake changes; empty: all.
    """
    whole = arranged(J, check.world, check.quantity, check.reading)
    return Variant(sentence, check.cut(whole, check.quantity), columns)


def row_order(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the Jacobian with the linear rows and the angular rows exchanged."""
    if check.right.shape[1] == 6:
        other = 'linear' if check.reading.angular_first else 'angular'
        swapped = np.roll(check.right, 3, axis=1)
        hint = f"write 'rows: {other} first'"
        yield Variant(f'the {other} rows stand first (if that is meant, {hint})', swapped)


def other_axes(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the Jacobian in tool axes instead of base axes, or the reverse."""
    other = 'tool' if check.reading.axes == 'base' else 'base'
    reading = replace(check.reading, axes=other)
    sentence = (
        f'the rows are in {other} axes, not in {check.reading.axes} axes (if that is meant, '
        f"write 'frame: {other}')"
    )
    yield Variant(sentence, check.right_of(check.world, reading=reading))


def other_point(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the Jacobian with another frame's origin as reference point."""
    world, first = check.world, check.reading.first_frame
    p, w = world.pose[:, :3, 3], world.jacobian[:, 3:]
    for k, frame in enumerate(world.frames[:-1]):
        arm = frame[:, :3, 3] - p
        if np.all(np.abs(arm) < 1e-12):
            continue
        J = world.jacobian.copy()
        J[:, :3] += np.cross(w, arm[:, :, None], axis=1)
        sentence = f'o_{k + first} stands where o_n belongs: the point is not the tool'
        yield mistaken(check, sentence, J)


def axis_index(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield Jacobians in which z axes, origins, or both come from a neighbouring frame.

    For example, z_i stands instead of z_i-1. If the rows of the table have no DH quantities, yield
    Jacobians with a wrong letter (x, y or z) of the axis of rotation.
    """
    convention = CONVENTIONS[check.world.table.convention]
    if not convention.product:
        yield from _other_letters(check)
    if not convention.product or (convention.before_joint and convention.after_joint):
        return
    step = -1 if convention.before_joint else 1
    right, wrong = ('i-1', 'i') if step == 1 else ('i', 'i-1')
    versions = (
        (step, 0, f'z_{wrong} stands where z_{right} belongs (the axis of joint i)'),
        (0, step, f'o_{wrong} stands where o_{right} belongs'),
        (step, step, f'z_{wrong}, o_{wrong} stand where z_{right}, o_{right} belong'),
    )
    for axis, origin, sentence in versions:
        yield mistaken(check, sentence, _geometric(check.world, axis, origin))


def _geometric(world: World, axis: int, origin: int) -> Floats:
    J = np.zeros_like(world.jacobian)
    late = int(bool(CONVENTIONS[world.table.convention].before_joint))
    for i, k in world.row_columns:
        row, variable = world.table.rows[i], world.table.variables[k]
        frame = i + late
        z = world.frames[frame + axis][:, :3, 2]
        arm = world.pose[:, :3, 3] - world.frames[frame + origin][:, :3, 3]
        turn = float(row['theta'].coeff(variable))
        slide = float(row['d'].coeff(variable))
        J[:, :3, k] += turn * np.cross(z, arm) + slide * z
        J[:, 3:, k] += turn * z
    return J


def _other_letters(check: QuantityCheck) -> Iterator[Variant]:
    world = check.world
    for wrong in range(3):
        J = world.jacobian.copy()
        for (i, k), column in world.row_columns.items():
            row = world.table.rows[i]
            if row.axis[:1] != 'R':
                continue
            start = world.frames[i] @ world.evaluation.of_matrix(row.inner)
            z = start[:, :3, wrong] * float(row.argument.coeff(world.table.variables[k]))
            part = np.concatenate([np.cross(z, world.pose[:, :3, 3] - start[:, :3, 3]), z], axis=1)
            J[:, :, k] += part - column
        yield mistaken(check, f'the {"xyz"[wrong]} axis is taken for the axis of rotation', J)


def moment_arm(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian without the cross products in its linear rows, or with wrong moment arms.
    """
    world = check.world
    p = world.pose[:, :3, 3]
    bare, from_base, at_joint = (world.jacobian.copy() for _ in range(3))
    for (i, k), column in world.row_columns.items():
        w = column[:, 3:]
        if np.all(np.abs(w) < 1e-12):
            continue
        start = world.frames[i][:, :3, 3]
        bare[:, :3, k] = p - start
        from_base[:, :3, k] = np.cross(w, p)
        at_joint[:, :3, k] = np.cross(w, start)
    sentence = 'the cross product is left out: o_n - o_i-1 instead of z x (o_n - o_i-1)'
    yield mistaken(check, sentence, bare)
    sentence = 'o_i-1 is not subtracted: z x o_n instead of z x (o_n - o_i-1)'
    yield mistaken(check, sentence, from_base)
    yield mistaken(check, 'z x o_i-1 instead of z x (o_n - o_i-1)', at_joint)


def joint_type(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian with the column of a prismatic joint computed as for a revolute joint, or
    the reverse.
    """
    world = check.world
    for (i, k), column in world.row_columns.items():
        v, w = column[:, :3], column[:, 3:]
        J = world.jacobian.copy()
        name = world.table.variables[k]
        if world.table.slides[k]:
            arm = world.pose[:, :3, 3] - world.frames[i][:, :3, 3]
            versions: tuple[tuple[Floats, Floats, str], ...] = (
                (np.cross(v, arm), v, f'the column of {name} is that of a revolute joint'),
                (np.zeros_like(v), v, f'the column of {name} is [0; axis] instead of [axis; 0]'),
                (v, v, f'the column of {name} has its axis in the angular rows too'),
            )
        else:
            zero = np.zeros_like(w)
            versions = ((w, zero, f'the column of {name} is that of a prismatic joint'),)
        for linear, angular, sentence in versions:
            J[:, :3, k], J[:, 3:, k] = linear, angular
            yield mistaken(check, sentence, J, _column(check, k))


def _column(check: QuantityCheck, k: int) -> tuple[int, ...]:
    return (0,) if check.quantity.i else (k,)


def column_order(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the Jacobian with two columns exchanged, and with the columns reversed."""
    n = check.right.shape[2]
    names = check.names.table.variables
    for i, j in combinations(range(n), 2):
        order = list(range(n))
        order[i], order[j] = j, i
        sentence = f'the columns of {names[i]} and {names[j]} are exchanged'
        yield Variant(sentence, check.right[:, :, order], (i, j))
    yield Variant('the columns stand in reverse order', check.right[:, :, ::-1])


def column_sums(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield Jacobians in which one column is wrong.

    If the column is a sum over several rows of the table, one summand has the wrong sign or is
    left out. In further Jacobians, J_k + J_j or J_k - J_j stands instead of column J_k.
    """
    world = check.world
    n = len(world.table.variables)
    for (i, k), column in world.row_columns.items():
        rows = [r for r, joint in world.row_columns if joint == k]
        if len(rows) < 2:
            continue
        name = world.table.variables[k]
        J = world.jacobian.copy()
        J[:, :, k] -= 2.0 * column
        sentence = (
            f'J_{k + 1} is {_sum_text(check, k, rows)}, where c_i is the column of row i of the '
            f'table; here it is {_sum_text(check, k, rows, flipped=i)}'
        )
        yield mistaken(check, sentence, J, _column(check, k))
        J[:, :, k] += column
        sentence = f'the column of {name} lacks what row {i + 1} of the table adds'
        yield mistaken(check, sentence, J, _column(check, k))
    for k, j in permutations(range(n), 2):
        for sign, text in ((1.0, '+'), (-1.0, '-')):
            J = world.jacobian.copy()
            J[:, :, k] += sign * world.jacobian[:, :, j]
            sentence = f'J_{k + 1} {text} J_{j + 1} stands where J_{k + 1} belongs'
            yield mistaken(check, sentence, J, _column(check, k))


def _sum_text(check: QuantityCheck, k: int, rows: list[int], flipped: int = -1) -> str:
    variable = check.world.table.variables[k]
    text = ''
    for r in rows:
        positive = float(check.world.table.rows[r].moving.coeff(variable)) > 0.0
        sign = '+' if positive != (r == flipped) else '-'
        text += f' {sign} c_{r + 1}' if text or sign == '-' else f'c_{r + 1}'
    return text.strip()


def per_degree(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the Jacobian for joint velocities in deg/s, or with angular rows in degrees."""
    J = check.world.jacobian
    turning = ~np.array(check.world.table.slides)
    scale = np.where(turning, DEGREE, 1.0)
    sentence = 'the columns of turning joints are per degree, not per radian'
    yield mistaken(check, sentence, J * scale)
    rows = np.array([1.0] * 3 + [1.0 / DEGREE] * 3)[:, None]
    yield mistaken(check, 'the angular rows are in degrees', J * rows)
