"""Slips in any formula: sign, units, inverses, something else of the arm in its place."""

from collections.abc import Iterator

import numpy as np

from .....rigid_motion import inverses
from ..arm.quantities import Quantity, value_of, why_out_of_range
from ..statements.checks import QuantityCheck
from .jacobian_slips import mistaken
from .variant import Variant

MILLI = 1000.0


def own_axes(check: QuantityCheck) -> Iterator[Variant]:
    """Yield an axis that was not turned into base axes."""
    values = np.zeros_like(check.right)
    values.reshape(len(values), 3)[:, 2] = 1.0
    sentence = 'z in the axes of its own frame: it must be turned into base axes, R [0; 0; 1]'
    yield Variant(sentence, values)


def millimetres(check: QuantityCheck) -> Iterator[Variant]:
    """Yield lengths in millimetres."""
    if check.quantity.kind == 'jacobian':
        J = check.world.jacobian.copy()
        J[:, :3] *= MILLI
        yield mistaken(check, 'the linear rows are in mm', J)
        J[:, :3, list(check.world.table.slides)] /= MILLI
        yield mistaken(check, 'lengths are in mm', J)
    elif check.quantity.kind in ('tool', 'pose', 'row', 'general'):
        values = check.right.copy()
        values[:, :3, 3:] *= MILLI
        yield Variant('the position is in mm', values)
    else:
        yield Variant('lengths are in mm', check.right * MILLI)


def transposed(check: QuantityCheck) -> Iterator[Variant]:
    """Yield transposes and inverses of the matrix, or of its rotation."""
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
    """Yield T without the base or the tool, and T_0n with them."""
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
    """Yield a derivative that kept the 1 of a pose in its corner."""
    values = check.right.copy()
    values[:, 3, 3] = 1.0
    yield Variant('(4,4) is the derivative of the constant 1: it is 0, not 1', values)


def another_quantity(check: QuantityCheck) -> Iterator[Variant]:
    """Yield everything else of the arm that has the person's shape."""
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
            if not why_out_of_range(quantity, table, check.reading):
                yield quantity, f'{name}{i + first}'
    for i in range(1, rows + 1):
        yield Quantity('row', i), f'the matrix of row {i}'
        for j in range(rows) if check.quantity.kind in ('pose', 'tool', 'row') else ():
            if j != i:
                yield Quantity('pose', j + first, i + first), f'T_{j + first}{i + first}'


def sign(check: QuantityCheck) -> Iterator[Variant]:
    """Yield the right formula with the opposite sign."""
    yield Variant('the sign is wrong', -check.right)
