"""
Slips in the formula itself: order, axes, signs, indices, sums of columns, units, inverses.

"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .formula_checks import QuantityCheck
from .formula_numbers import DEGREE, Floats
from .formula_quantities import Quantity, numeric, why_out_of_range
from .formula_variant import Variant
from .formula_world import World

MILLI = 1000.0
EYE = np.eye(4)


def _arranged(check: QuantityCheck, J: Floats) -> Floats:
    # A base-axes, linear-first Jacobian in the order and with the rows of the person's.
    world = World(check.world.table, check.poses.values, check.poses.count)
    world.__dict__['jacobian'] = J
    world.__dict__['frames'] = check.world.frames
    return check.right_of(world)


def row_order(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian with its two halves exchanged.

    """
    if check.right.shape[1] == 6:
        other = 'linear' if check.reading.angular_first else 'angular'
        swapped = np.roll(check.right, 3, axis=1)
        hint = f"write 'rows: {other} first'"
        yield Variant(f'the {other} rows stand first (if that is meant, {hint})', swapped)


def other_axes(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian in the axes of the other frame.

    """
    other = 'tool' if check.reading.axes == 'base' else 'base'
    reading = replace(check.reading, axes=other)
    sentence = (
        f'the rows are in {other} axes, not in {check.reading.axes} axes (if that is meant, '
        f"write 'frame: {other}')"
    )
    yield Variant(sentence, check.right_of(check.world, reading=reading))


def other_point(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian of another frame's origin instead of the tool's.

    """
    world, first = check.world, check.reading.first
    p, w = world.pose[:, :3, 3], world.jacobian[:, 3:]
    for k, frame in enumerate(world.frames[:-1]):
        arm = frame[:, :3, 3] - p
        if np.all(np.abs(arm) < 1e-12):
            continue
        J = world.jacobian.copy()
        J[:, :3] += np.cross(w, arm[:, :, None], axis=1)
        sentence = f'o_{k + first} stands where o_n belongs: the point is not the tool'
        yield Variant(sentence, _arranged(check, J))


def axis_index(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian with axes, or origins, of the frame beside the right one.

    """
    convention = check.world.table.convention
    if convention not in ('standard', 'modified'):
        yield from _other_letters(check)
        return
    step = 1 if convention == 'standard' else -1
    right, wrong = ('i-1', 'i') if step == 1 else ('i', 'i-1')
    versions = (
        (step, 0, f'z_{wrong} stands where z_{right} belongs (the axis of joint i)'),
        (0, step, f'o_{wrong} stands where o_{right} belongs'),
        (step, step, f'z_{wrong}, o_{wrong} stand where z_{right}, o_{right} belong'),
    )
    for axis, origin, sentence in versions:
        yield Variant(sentence, _arranged(check, _geometric(check.world, axis, origin)))


def _geometric(world: World, axis: int, origin: int) -> Floats:
    J = np.zeros_like(world.jacobian)
    standard = world.table.convention == 'standard'
    for (i, k), _ in world.row_columns.items():
        row, variable = world.table.rows[i], world.table.variables[k]
        frame = i if standard else i + 1
        z = world.frames[frame + axis][:, :3, 2]
        arm = world.pose[:, :3, 3] - world.frames[frame + origin][:, :3, 3]
        turn = float(row.theta.coeff(variable))
        slide = float(row.d.coeff(variable))
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
        letter = 'xyz'[wrong]
        yield Variant(f'the {letter} axis is taken for the axis of rotation', _arranged(check, J))


def moment_arm(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield linear columns without their cross product, or with an arm from the wrong end.

    """
    world = check.world
    p = world.pose[:, :3, 3]
    bare, from_base, at_joint = (world.jacobian.copy() for _ in range(3))
    for (i, k), _ in world.row_columns.items():
        w = world.row_columns[i, k][:, 3:]
        if np.all(np.abs(w) < 1e-12):
            continue
        start = world.frames[i][:, :3, 3]
        bare[:, :3, k] = p - start
        from_base[:, :3, k] = np.cross(w, p)
        at_joint[:, :3, k] = np.cross(w, start)
    sentence = 'the cross product is left out: o_n - o_i-1 instead of z x (o_n - o_i-1)'
    yield Variant(sentence, _arranged(check, bare))
    sentence = 'o_i-1 is not subtracted: z x o_n instead of z x (o_n - o_i-1)'
    yield Variant(sentence, _arranged(check, from_base))
    yield Variant('z x o_i-1 instead of z x (o_n - o_i-1)', _arranged(check, at_joint))


def joint_type(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield prismatic columns written like revolute ones, and the reverse.

    """
    world = check.world
    for (i, k), column in world.row_columns.items():
        prismatic = world.table.joint_types[k] == 'prismatic'
        v, w = column[:, :3], column[:, 3:]
        J = world.jacobian.copy()
        name = world.table.variables[k]
        if prismatic:
            arm = world.pose[:, :3, 3] - world.frames[i][:, :3, 3]
            versions = (
                (np.cross(v, arm), v, f'the column of {name} is that of a revolute joint'),
                (np.zeros_like(v), v, f'the column of {name} is [0; axis] instead of [axis; 0]'),
                (v, v, f'the column of {name} has its axis in the angular rows too'),
            )
        else:
            zero = np.zeros_like(w)
            versions = ((w, zero, f'the column of {name} is that of a prismatic joint'),)
        for linear, angular, sentence in versions:
            J[:, :3, k], J[:, 3:, k] = linear, angular
            yield Variant(sentence, _arranged(check, J.copy()), _column(check, k))


def _column(check: QuantityCheck, k: int) -> tuple[int, ...]:
    return (0,) if check.quantity.i else (k,)


def column_order(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian with two columns exchanged, and with the columns reversed.

    """
    n = check.right.shape[2]
    names = check.names.table.variables
    for i in range(n):
        for j in range(i + 1, n):
            order = list(range(n))
            order[i], order[j] = j, i
            sentence = f'the columns of {names[i]} and {names[j]} are exchanged'
            yield Variant(sentence, check.right[:, :, order], (i, j))
    yield Variant('the columns stand in reverse order', check.right[:, :, ::-1])


def column_sums(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield columns in which what several rows add has a wrong sign or is left out.

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
            f'the column of {name} is a sum over the rows {", ".join(str(r + 1) for r in rows)} '
            f'of the table: that of row {i + 1} has the wrong sign'
        )
        yield Variant(sentence, _arranged(check, J.copy()), _column(check, k))
        J[:, :, k] += column
        sentence = f'the column of {name} lacks what row {i + 1} of the table adds'
        yield Variant(sentence, _arranged(check, J), _column(check, k))
    for k in range(n):
        for j in range(n):
            if j != k:
                for sign, text in ((1.0, '+'), (-1.0, '-')):
                    J = world.jacobian.copy()
                    J[:, :, k] += sign * world.jacobian[:, :, j]
                    sentence = f'J_{k + 1} {text} J_{j + 1} stands where J_{k + 1} belongs'
                    yield Variant(sentence, _arranged(check, J), _column(check, k))


def per_degree(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the Jacobian for joint velocities in degrees, or with angular rows in degrees.

    """
    J, types = check.world.jacobian, check.world.table.joint_types
    turning = np.array([kind != 'prismatic' for kind in types])
    scale = np.where(turning, DEGREE, 1.0)
    sentence = 'the columns of turning joints are per degree, not per radian'
    yield Variant(sentence, _arranged(check, J * scale))
    rows = np.array([1.0] * 3 + [1.0 / DEGREE] * 3)[:, None]
    yield Variant('the angular rows are in degrees', _arranged(check, J * rows))


def millimetres(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield lengths in millimetres.

    """
    if check.quantity.kind == 'jacobian':
        J = check.world.jacobian.copy()
        J[:, :3] *= MILLI
        yield Variant('the linear rows are in mm', _arranged(check, J))
        for k, kind in enumerate(check.world.table.joint_types):
            if kind == 'prismatic':
                J[:, :3, k] /= MILLI
        yield Variant('lengths are in mm', _arranged(check, J))
    elif check.quantity.kind in ('tool', 'pose', 'row', 'general'):
        values = check.right.copy()
        values[:, :3, 3:] *= MILLI
        yield Variant('the position is in mm', values)
    else:
        yield Variant('lengths are in mm', check.right * MILLI)


def transposed(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield transposes and inverses of the matrix, or of its rotation.

    """
    right = check.right
    rows, columns = right.shape[1:]
    if rows == columns and rows > 1:
        kind = 'inverse (its transpose)' if check.quantity.kind == 'rotation' else 'transpose'
        yield Variant(f'it is the {kind} of the right matrix', np.swapaxes(right, 1, 2))
    if right.shape[1:] in ((4, 4), (3, 4)) and check.quantity.kind != 'numeric':
        turned = right.copy()
        turned[:, :3, :3] = np.swapaxes(right[:, :3, :3], 1, 2)
        yield Variant('its rotation is transposed', turned)
        inverse = turned.copy()
        inverse[:, :3, 3:] = -turned[:, :3, :3] @ right[:, :3, 3:]
        yield Variant('it is the inverse of the right matrix', inverse)


def base_and_tool(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield T without the base or the tool, and T_0n with them.

    """
    frames = check.world.frames
    versions = (
        (np.linalg.solve(frames[0], frames[-1]), 'the base is left out'),
        (frames[-2], 'the tool is left out'),
        (np.linalg.solve(frames[0], frames[-2]), 'base and tool are left out'),
        (frames[-1], 'base and tool are included'),
    )
    for whole, sentence in versions:
        whole = whole[:, :3, 3:] if check.quantity.kind == 'position' else whole
        yield Variant(sentence, check.cut(whole, check.quantity))


def bottom_row(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield a derivative that kept the 1 of a pose in its corner.

    """
    if check.quantity.kind == 'numeric':
        values = check.right.copy()
        values[:, 3, 3] = 1.0
        yield Variant('(4,4) is the derivative of the constant 1: it is 0, not 1', values)


def another_quantity(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield everything else of the arm that has the person's shape.

    """
    for quantity, name in _quantities(check):
        if quantity == check.quantity:
            continue
        values = numeric(quantity, check.world, check.reading)
        values = check.cut(values, quantity)
        if values.shape[1:] == check.shape:
            yield Variant(f'it is {name}', values)


def _quantities(check: QuantityCheck) -> Iterator[tuple[Quantity, str]]:
    rows, joints = len(check.world.table.rows), len(check.world.table.variables)
    first = check.reading.first
    same = {check.quantity.kind}
    for i in range(1, joints + 1):
        for part, name in (('v', 'J_v'), ('w', 'J_w'), ('all', 'J_')):
            yield Quantity('jacobian', i, part=part), f'{name}{i}'
    for part, name in (('v', 'J_v'), ('w', 'J_w')):
        yield Quantity('jacobian', part=part), name
    for i in range(1, rows + 1):
        yield Quantity('row', i), f'the matrix of row {i}'
        if same & {'pose', 'tool', 'row'}:
            for j in range(rows):
                yield Quantity('pose', j + first, i + first), f'T_{j + first}{i + first}'
    for i in range(rows + 1):
        for kind, name in (('rotation', 'R_'), ('axis', 'z_'), ('origin', 'o_')):
            quantity = Quantity(kind, i + first)
            if not why_out_of_range(quantity, rows, joints, check.reading):
                yield quantity, f'{name}{i + first}'


def sign(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield the right formula with the opposite sign.

    """
    yield Variant('the sign is wrong', -check.right)
