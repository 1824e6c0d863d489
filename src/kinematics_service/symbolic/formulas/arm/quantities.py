"""What the names of formulas mean: T_03, A_2, z_1, J_v2, det, and the value of each."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp  # type: ignore[import-untyped]

from .numbers import Floats
from .symbols import SymbolicArm
from .table import inverse_pose, row_matrix
from .world import World

ROWS = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')
TASK_ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')

ACCEPTED = (
    'T, T_03 (frame 0 to 3), T_2 or A_2 (row 2), A_i (any row), R, R_2, p, p_14, o_2, z_2, '
    's_o1 (o_0 - o_n), J, J_v, J_w, J_2, J_v2, J_w2, D_2 (dT/dq2 with the rotation taken out), '
    'det, a joint variable (inverse kinematics), an equation between known names; other names '
    "with a line such as 'meaning: R_C = o_3'"
)


@dataclass(frozen=True)
class Quantity:
    """
    Something of the arm a formula may be about.

    Parameters
    ----------
    kind
        tool, pose, row, general, rotation, axis, origin, vector, reach, jacobian, numeric, det.
    i, j
        Indices as the person counts them; column of the Jacobian from 1, 0 for all.
    part
        Rows of the Jacobian: `all`, `v` or `w`.
    """

    kind: str
    i: int = 0
    j: int = 0
    part: str = 'all'


@dataclass(frozen=True)
class Reading:
    """
    How a person writes: frame numbers, axes and row order.

    Parameters
    ----------
    first
        Number of the table's frame 0: 0, or 1 where the base is counted.
    axes
        `base` or `tool`: of the Jacobian's rows.
    angular_first
        Whether the Jacobian's angular rows come first.
    """

    first: int = 0
    axes: str = 'base'
    angular_first: bool = False


_PATTERNS: tuple[tuple[str, Callable[[re.Match[str]], Quantity]], ...] = (
    (r'(?:det|detJ|JacDet|detJv|detJacobian)', lambda m: Quantity('det')),
    (r'(?:T|TH|T0n|T0e|T0T)', lambda m: Quantity('tool')),
    (r'(?:A|T)i', lambda m: Quantity('general')),
    (r'T(\d)(\d)', lambda m: Quantity('pose', int(m[1]), int(m[2]))),
    (r'T0(\d\d)', lambda m: Quantity('pose', 0, int(m[1]))),
    (r'[TA](\d{1,2})', lambda m: Quantity('row', int(m[1]))),
    (r'R', lambda m: Quantity('rotation', -1)),
    (r'R0?(\d{1,2})', lambda m: Quantity('rotation', int(m[1]))),
    (r'[zZ](\d{1,2})', lambda m: Quantity('axis', int(m[1]))),
    (r'[oO](\d{1,2})', lambda m: Quantity('origin', int(m[1]))),
    (r'on', lambda m: Quantity('position')),
    (r'[pP]', lambda m: Quantity('position')),
    (r'[pP](\d)(\d)', lambda m: Quantity('vector', int(m[1]), int(m[2]))),
    (r'so(\d)', lambda m: Quantity('reach', int(m[1]))),
    (r'D(\d{1,2})', lambda m: Quantity('numeric', int(m[1]))),
    (r'J(?:acobian|indirect|direct)?', lambda m: Quantity('jacobian')),
    (r'J(\d{1,2})', lambda m: Quantity('jacobian', int(m[1]))),
    (r'J([vw])(\d{0,2})', lambda m: Quantity('jacobian', int(m[2] or 0), part=m[1])),
)


def quantity_of(key: str) -> Quantity | None:
    """Return what a name without underscores means, or None where it is none of these."""
    for pattern, make in _PATTERNS:
        if found := re.fullmatch(pattern, key):
            return make(found)
    return None


def why_out_of_range(quantity: Quantity, rows: int, joints: int, reading: Reading) -> str:
    """Return why an index is too large, or nothing."""
    low, high = 0, rows + reading.first
    if quantity.kind in ('row', 'jacobian', 'numeric'):
        low, high = (1, rows) if quantity.kind == 'row' else (0, joints)
        if not low <= quantity.i <= high:
            return f'there is no {quantity.kind} {quantity.i}: the robot has {high}'
    if quantity.kind == 'reach' and not 1 <= quantity.i <= rows:
        return f's_o{quantity.i}: the robot has {rows} rows'
    frames = {'pose': (quantity.i, quantity.j), 'vector': (quantity.i, quantity.j)}
    single = (quantity.i,) if quantity.kind in ('rotation', 'axis', 'origin') else ()
    for index in frames.get(quantity.kind, single):
        if index > high:
            return f'there is no frame {index}: the frames are {low} to {high}'
    return ''


class NumberedFrames:
    """The frames of an arm by the person's numbers: numbers at N poses, or symbols."""

    def __init__(self, frames: list[Any], identity: Any, first: int) -> None:
        self._frames = frames
        self._identity = identity
        self._first = first

    def __getitem__(self, index: int) -> Any:
        if index < 0:
            return self._frames[-1]
        at = index - self._first
        return self._identity if at < 0 else self._frames[at]

    @property
    def tool(self) -> Any:
        """Return the tool in the base frame."""
        return self._frames[-1]


def numeric(quantity: Quantity, world: World, reading: Reading) -> Floats:
    """Return the value of a quantity, shape (N, rows, columns); not for `det` and `general`."""
    identity = np.broadcast_to(np.eye(4), (world.poses, 4, 4))
    frames = NumberedFrames(world.frames, identity, reading.first)
    kind, i, j = quantity.kind, quantity.i, quantity.j
    result: Floats
    if kind == 'tool':
        result = world.pose
    elif kind == 'pose':
        result = np.linalg.solve(frames[i], frames[j])
    elif kind == 'row':
        result = world.rows[i - 1]
    elif kind == 'rotation':
        result = frames[i][:, :3, :3]
    elif kind == 'axis':
        result = frames[i][:, :3, 2:3]
    elif kind == 'origin':
        result = frames[i][:, :3, 3:4]
    elif kind == 'position':
        result = world.pose[:, :3, 3:4]
    elif kind == 'vector':
        result = frames[j][:, :3, 3:4] - frames[i][:, :3, 3:4]
    elif kind == 'reach':
        result = world.frames[i - 1][:, :3, 3:4] - world.pose[:, :3, 3:4]
    elif kind == 'numeric':
        result = _with_rotation_taken_out(world.jacobian[:, :, i - 1])
    else:
        result = arranged(world.jacobian, world.pose, quantity, reading)
    return result


def _with_rotation_taken_out(column: Floats) -> Floats:
    D = np.zeros((len(column), 4, 4))
    D[:, :3, 3] = column[:, :3]
    for k, (row, col) in enumerate(((2, 1), (0, 2), (1, 0))):
        D[:, row, col] = column[:, 3 + k]
        D[:, col, row] = -column[:, 3 + k]
    return D


def arranged(J: Floats, pose: Floats, quantity: Quantity, reading: Reading) -> Floats:
    """
    Return J (base axes, linear first) in the axes and order, and with the rows, a person asks for.
    """
    v, w = J[:, :3], J[:, 3:]
    if reading.axes == 'tool':
        to_tool = np.swapaxes(pose[:, :3, :3], 1, 2)
        v, w = to_tool @ v, to_tool @ w
    blocks = {'v': [v], 'w': [w]}.get(quantity.part, [w, v] if reading.angular_first else [v, w])
    result: Floats = np.concatenate(blocks, axis=1)
    return result[:, :, quantity.i - 1 : quantity.i] if quantity.i else result


def symbolic(quantity: Quantity, arm: SymbolicArm, reading: Reading) -> Any:
    """Return what a quantity is, as a matrix of expressions; None for those without one."""
    frames = NumberedFrames(arm.frames, sp.ImmutableDenseMatrix(sp.eye(4)), reading.first)
    kind, i, j = quantity.kind, quantity.i, quantity.j
    if kind == 'tool':
        return frames.tool
    if kind == 'pose':
        start = frames[i]
        return frames[j] if start == sp.eye(4) else _between(arm, i, j, reading.first)
    if kind == 'row':
        return row_matrix(arm.table.rows[i - 1])
    if kind == 'rotation':
        return frames[i][:3, :3]
    if kind == 'axis':
        return frames[i][:3, 2]
    if kind == 'origin':
        return frames[i][:3, 3]
    if kind == 'position':
        return frames.tool[:3, 3]
    if kind == 'vector':
        return frames[j][:3, 3] - frames[i][:3, 3]
    if kind == 'reach':
        return arm.frames[i - 1][:3, 3] - frames.tool[:3, 3]
    if kind == 'jacobian':
        return _symbolic_jacobian(arm, quantity, reading)
    return None


def _between(arm: SymbolicArm, i: int, j: int, first: int) -> Any:
    product = sp.eye(4)
    for row in arm.table.rows[max(i - first, 0) : j - first]:
        product = product * row_matrix(row)
    if i - first < 0 <= j - first:
        product = arm.table.base * product
    return inverse_pose(_between(arm, j, i, first)) if j < i else sp.ImmutableDenseMatrix(product)


def _symbolic_jacobian(arm: SymbolicArm, quantity: Quantity, reading: Reading) -> Any:
    J = arm.jacobian
    v, w = J[:3, :], J[3:, :]
    if reading.axes == 'tool':
        R = arm.frames[-1][:3, :3].T
        v, w = R * v, R * w
    order = [w, v] if reading.angular_first else [v, w]
    result = sp.Matrix.vstack(*{'v': [v], 'w': [w]}.get(quantity.part, order))
    return result[:, quantity.i - 1] if quantity.i else result
