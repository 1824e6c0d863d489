"""What the names of formulas mean: T_03, A_2, z_1, J_v2, det, and the value of each."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp  # type: ignore[import-untyped]

from ..text.file import Settings
from .symbols import SymbolicArm
from .world import World

ROWS = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')

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


def why_out_of_range(quantity: Quantity, rows: int, joints: int, reading: Settings) -> str:
    """Return why an index is too large, or nothing."""
    low, high = 0, rows + reading.first_frame
    if quantity.kind in ('row', 'jacobian', 'numeric'):
        low, high = (1, rows) if quantity.kind == 'row' else (0, joints)
        if not low <= quantity.i <= high:
            between = '; frame 2 in frame 0 is T_02' if quantity.kind == 'row' else ''
            return f'there is no {quantity.kind} {quantity.i}: the robot has {high}{between}'
    if quantity.kind == 'reach' and not 1 <= quantity.i <= rows:
        return f's_o{quantity.i}: the robot has {rows} rows'
    frames = {'pose': (quantity.i, quantity.j), 'vector': (quantity.i, quantity.j)}
    single = (quantity.i,) if quantity.kind in ('rotation', 'axis', 'origin') else ()
    for index in frames.get(quantity.kind, single):
        if index > high:
            return f'there is no frame {index}: the frames are {low} to {high}'
    return ''


# Parts of a pose.
PARTS = {
    'rotation': np.s_[..., :3, :3],
    'axis': np.s_[..., :3, 2:3],
    'origin': np.s_[..., :3, 3:],
}


def value_of(quantity: Quantity, arm: World | SymbolicArm, reading: Settings) -> Any:
    """
    Return a quantity of an arm, an array; not for `det` and `general`.

    Parameters
    ----------
    quantity
        What is asked for.
    arm
        Numbers at N poses give N matrices, shape (N, rows, columns), expressions give one.
    reading
        How frames are counted, and rows ordered.
    """
    kind, i, j = quantity.kind, quantity.i, quantity.j
    pose = np.asarray(arm.frames[-1])
    origin = PARTS['origin']
    if kind == 'tool':
        return pose
    if kind == 'position':
        return pose[origin]
    if kind == 'row':
        return np.asarray(arm.rows[i - 1])
    if kind in PARTS:
        return (pose if i < 0 else _frame(arm, i - reading.first_frame))[PARTS[kind]]
    if kind == 'pose':
        return _between(arm, i - reading.first_frame, j - reading.first_frame)
    if kind == 'vector':
        start, end = (_frame(arm, index - reading.first_frame) for index in (i, j))
        return end[origin] - start[origin]
    if kind == 'reach':
        return _frame(arm, i - 1)[origin] - pose[origin]
    J = np.asarray(arm.jacobian)
    if kind == 'numeric':
        return _with_rotation_taken_out(J[..., i - 1])
    return arranged(J, pose, quantity, reading)


def expression_of(quantity: Quantity, arm: SymbolicArm, reading: Settings) -> Any:
    """Return what a quantity is, as a matrix of expressions; None for those without one."""
    if quantity.kind in ('det', 'general'):
        return None
    return sp.ImmutableDenseMatrix(value_of(quantity, arm, reading))


def _frame(arm: World | SymbolicArm, at: int) -> Any:
    # What is before frame 0 is the base frame.
    if at < 0:
        return np.broadcast_to(np.eye(4, dtype=int), np.shape(arm.frames[0]))
    return np.asarray(arm.frames[at])


def _between(arm: World | SymbolicArm, i: int, j: int) -> Any:
    if i < 0:
        return _frame(arm, j)
    if i <= j:
        return np.asarray(arm.between(i, j))
    T = _between(arm, j, i)
    inverse = np.array(np.broadcast_to(np.eye(4, dtype=int), T.shape), dtype=T.dtype)
    inverse[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, 3:] = -inverse[..., :3, :3] @ T[..., :3, 3:]
    return inverse


def _with_rotation_taken_out(column: Any) -> Any:
    D = np.zeros((*column.shape[:-1], 4, 4), dtype=column.dtype)
    D[..., :3, 3] = column[..., :3]
    for k, (row, col) in enumerate(((2, 1), (0, 2), (1, 0))):
        D[..., row, col] = column[..., 3 + k]
        D[..., col, row] = -column[..., 3 + k]
    return D


def arranged(J: Any, pose: Any, quantity: Quantity, reading: Settings) -> Any:
    """
    Return J (base axes, linear first) in the axes and order, and with the rows, a person asks for.
    """
    v, w = J[..., :3, :], J[..., 3:, :]
    if reading.axes == 'tool':
        to_tool = np.swapaxes(pose[..., :3, :3], -1, -2)
        v, w = to_tool @ v, to_tool @ w
    blocks = {'v': [v], 'w': [w]}.get(quantity.part, [w, v] if reading.angular_first else [v, w])
    result = np.concatenate(blocks, axis=-2)
    return result[..., quantity.i - 1 : quantity.i] if quantity.i else result
