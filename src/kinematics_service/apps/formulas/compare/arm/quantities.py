# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the quantity that a name in a formula means, such as T_03, A_2, z_1, J_v2 or det, and compute
its value.
"""

import re
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from ...arm.numbers import Floats
from ...arm.table import Table
from ...arm.world import World
from ..text.file import Settings
from .symbols import SymbolicArm

ACCEPTED = (
    'T, T_03 or A_03 (frame 0 to 3), T_2 or A_2 (row 2), A_i (any row), R, R_2, R_36, p, p_14, '
    'o_2, z_2, z^1_2 (axes of frame 1), s_o1 (o_0 - o_n), J, J_v, J_w, J_2, J_v2, J_w2, J_s, J_b, '
    'J_A (space, body, analytic), D_2 (dT/dq2 with the rotation taken out), '
    'det, a joint variable (inverse kinematics), an equation between known names; other names '
    "with a line such as 'meaning: R_C = o_3'"
)


@dataclass(frozen=True)
class Quantity:
    """
    A quantity of the arm that a formula may define.

    Parameters
    ----------
    kind
        `tool` (T), `position` (p), `pose` (T_03), `row` (A_2), `general` (A_i, the matrix of any
        row i), `rotation` (R_2), `axis` (z_2), `origin` (o_2), `vector` (p_14, from o_1 to o_4),
        `reach` (s_oi, the vector from the tool to the origin of frame i - 1), `jacobian`,
        `numeric` (D_1, the 4 x 4 matrix [S v; 0 0], where (v, w) is column 1 of J, and S is the
        cross product matrix of w), `det`.
    i, j
        Frame or row numbers as the user counts them, -1 for the tool. For a Jacobian `i` is the
        column, counted from 1; 0 means all columns.
    part
        Rows of the Jacobian: `all`, `v` or `w`.
    start
        Number of the frame in whose axes the quantity is written, -1 for the tool frame. None: the
        base frame, or for a Jacobian the frame in the settings.
    form
        Kind of Jacobian: `space`, `body`, `analytic`, or an analytic Jacobian with the rates of
        the angles `zyz`, `rpy` or `ypr`.
    rows
        Indices of the rows of J that the formula contains. Empty: they follow from the number of
        rows that the user wrote.
    either
        Whether two digits, as in H_12, may mean number 12 instead of the frames 1 and 2.
    """

    kind: str
    i: int = 0
    j: int = 0
    part: str = 'all'
    start: int | None = None
    form: str = ''
    rows: tuple[int, ...] = ()
    either: bool = False


# Patterns of names (without underscores), and the quantity that a matching name means. A group
# (?P<i>...) or (?P<i_>...) of a pattern sets the field `i` of the `Quantity`.
_PATTERNS = {
    r'det(?:J|Jv|Jacobian)?|JacDet': Quantity('det'),
    r'[TH]|TH|[TAH]0[ne]|T0T|T(?:tool|total|0?ee|basetool)': Quantity('tool'),
    r'[TA]i': Quantity('general'),
    r'T(?P<i>\d)(?P<j>[\dne])': Quantity('pose'),
    r'[AH](?P<i>\d)(?P<j>\d)': Quantity('pose', either=True),
    r'[TAH](?P<i>\d\d)(?P<j>\d\d)|[TAH]0(?P<j_>\d\d)': Quantity('pose'),
    r'[TAH](?P<i>\d)': Quantity('row'),
    r'R(?:0?[ne])?': Quantity('rotation', -1),
    r'R(?P<start>\d)(?P<i>\d)': Quantity('rotation', either=True),
    r'R0?(?P<i>\d{1,2})|(?P<start>\d)R(?P<i_>\d{1,2}|[ne])': Quantity('rotation'),
    r'(?P<start>\d)?[zZ](?P<i>\d{1,2}|n)': Quantity('axis'),
    r'(?P<start>\d)?[oO](?P<i>\d{1,2}|n)|(?P<start_>\d)[pP](?P<i_>\d{1,2}|[ne])': Quantity(
        'origin'
    ),
    r'[pP]e?': Quantity('position'),
    r'[pP](?P<i>\d)(?P<j>\d)': Quantity('vector'),
    r'so(?P<i>\d)': Quantity('reach'),
    r'D(?P<i>\d{1,2})': Quantity('numeric'),
    r'(?P<start>\d|n)?J(?:acobian|indirect|direct)?|J(?P<i>\d{1,2})': Quantity('jacobian'),
    r'(?P<start>\d|n)?J(?:v|P)(?P<i>\d{0,2})': Quantity('jacobian', part='v'),
    r'(?P<start>\d|n)?J(?:w|O|omega)(?P<i>\d{0,2})': Quantity('jacobian', part='w'),
    r'Js(?P<i>\d{0,2})': Quantity('jacobian', form='space'),
    r'Jb(?P<i>\d{0,2})': Quantity('jacobian', form='body'),
    r'J[aA](?P<i>\d{0,2})': Quantity('jacobian', form='analytic'),
}


def quantity_of(key: str) -> Quantity | None:
    """Return the quantity that a name (without underscores) means, or None if it means none."""
    for pattern, quantity in _PATTERNS.items():
        if match := re.fullmatch(pattern, key):
            groups = {name: text for name, text in match.groupdict().items() if text}
            numbers: dict[str, Any] = {
                name.rstrip('_'): int(text) if text.isdigit() else -1
                for name, text in groups.items()
            }
            return replace(quantity, **numbers)
    return None


class Refusal(NamedTuple):
    """The error about a quantity that has no value: its message and its code."""

    message: str
    code: str


def refusal_of(quantity: Quantity, table: Table, reading: Settings) -> Refusal | None:
    """Return an error if an index of a quantity is out of range or ambiguous, otherwise None."""
    rows, joints = len(table.rows), table.joints
    low, high = 0, rows + reading.first_frame
    if quantity.kind in ('row', 'jacobian', 'numeric'):
        low, high = (1, rows) if quantity.kind == 'row' else (0, joints)
        if not low <= quantity.i <= high:
            if quantity.kind == 'row':
                noun, advice = 'row', '; write T_02 for frame 2 in frame 0'
            else:
                noun, advice = 'joint', ''
            message = f'there is no {noun} {quantity.i}: the robot has {high}{advice}'
            return Refusal(message, 'out-of-range')
    if quantity.kind == 'reach' and not 1 <= quantity.i <= rows:
        message = f's_o{quantity.i}: there is no row {quantity.i}: the robot has {rows}'
        return Refusal(message, 'out-of-range')
    i, j = quantity.start or 0, quantity.i
    if quantity.kind in ('pose', 'vector'):
        i, j = quantity.i, quantity.j
    elif quantity.kind not in PARTS:
        return None
    if quantity.either and i and 10 * i + j <= rows:
        return Refusal(
            f'{i}{j} is frame {j} in frame {i}, or frame {i}{j}; write T_{i}{j} '
            f'for the frames (its rotation alone is accepted), R_0{i}{j} for the rotation of '
            f'frame {i}{j}, T_0{i}{j} for its pose',
            'ambiguous',
        )
    for index in (i, j):
        if index > high:
            message = f'there is no frame {index}: the frames are {low} to {high}'
            return Refusal(message, 'out-of-range')
    return None


# Numpy indices of the rotation, the z axis and the origin in 4 x 4 poses.
PARTS = {'rotation': np.s_[..., :3, :3], 'axis': np.s_[..., :3, 2:3], 'origin': np.s_[..., :3, 3:]}


def value_of(quantity: Quantity, arm: World | SymbolicArm, reading: Settings) -> Floats:
    """
    Return the value of a quantity as an array; the kinds `det` and `general` are not accepted.

    Parameters
    ----------
    quantity
        The quantity to compute.
    arm
        A `World` gives N matrices, shape (N, rows, columns); a `SymbolicArm` gives one matrix of
        expressions.
    reading
        Settings of the formula: how frames are numbered and Jacobian rows ordered.
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
    first, last = reading.first_frame, len(arm.frames) - 1
    if kind in PARTS:
        at = last if i < 0 else i - first
        start = quantity.start
        seen = arm.frame(at) if start is None else arm.between(start - first, at)
        return np.asarray(seen)[PARTS[kind]]
    if kind == 'pose':
        return np.asarray(arm.between(i - first, last if j < 0 else j - first))
    if kind == 'vector':
        T_i, T_j = np.asarray(arm.frame(i - first)), np.asarray(arm.frame(j - first))
        return np.asarray(T_j[origin] - T_i[origin])
    if kind == 'reach':
        return np.asarray(np.asarray(arm.frame(i - 1))[origin] - pose[origin])
    J = np.asarray(arm.jacobian)
    if kind == 'numeric':
        # Let (v, w) be column i of J, and S the cross product matrix of w. D is the 4 x 4 matrix
        # [S v; 0 0].
        D = np.zeros((*J.shape[:-2], 4, 4), dtype=J.dtype)
        D[..., :3, 3] = J[..., :3, i - 1]
        for row, (k, l) in enumerate(((2, 1), (0, 2), (1, 0)), 3):
            D[..., k, l], D[..., l, k] = J[..., row, i - 1], -J[..., row, i - 1]
        return D
    return arranged(J, arm, quantity, reading)


def expression_of(quantity: Quantity, arm: SymbolicArm, reading: Settings) -> sp.Matrix | None:
    """
    Return a quantity as a matrix of expressions. Return None for a determinant, for the matrix A_i
    of a general row i, and for a Jacobian whose angular rows are rates of Euler angles or of roll,
    pitch and yaw.
    """
    if quantity.kind in ('det', 'general') or quantity.form in ANGLES:
        return None
    return sp.ImmutableDenseMatrix(value_of(quantity, arm, reading))


def arranged(J: Floats, arm: World | SymbolicArm, quantity: Quantity, reading: Settings) -> Floats:
    """
    Return J in the axes and the row order of a formula, with only the rows that the formula has.

    The input J has base axes and linear rows first.

    Space and body Jacobian are those of Lynch and Park, Modern Robotics, section 5.1.
    """
    v, w = J[..., :3, :], J[..., 3:, :]
    pose, form = np.asarray(arm.frames[-1]), quantity.form
    seen = 'body' if form == 'body' or (not form and reading.axes == 'tool') else ''
    start = -1 if seen and quantity.start is None else quantity.start
    if start is not None:
        frame = pose if start < 0 else np.asarray(arm.frame(start - reading.first_frame))
        to_frame = np.swapaxes(frame[..., :3, :3], -1, -2)
        v, w = to_frame @ v, to_frame @ w
    if form == 'space':
        v = v + np.cross(pose[..., :3, 3:], w, axis=-2)
    if form in ANGLES:
        w = _rates(pose[..., :3, :3], form) @ w
    result = np.concatenate([v, w], axis=-2)[..., row_order(quantity, reading), :]
    result = result[..., quantity.rows, :] if quantity.rows else result
    return result[..., quantity.i - 1 : quantity.i] if quantity.i else result


def row_order(quantity: Quantity, reading: Settings) -> list[int]:
    """Return for each row of J, J_v or J_w its index in (vx vy vz wx wy wz)."""
    if quantity.part != 'all':
        return [0, 1, 2] if quantity.part == 'v' else [3, 4, 5]
    angular_first = reading.angular_first
    if angular_first is None:
        angular_first = quantity.form in ('space', 'body')
    return [3, 4, 5, 0, 1, 2] if angular_first else list(range(6))


# Texts for reports. Each text names the angle rates in the angular rows of an analytic Jacobian.
ANGLES = {
    'rpy': 'rates of roll, pitch, yaw',
    'ypr': 'rates of yaw, pitch, roll',
    'zyz': 'rates of the Euler angles about z, y, z',
}


def _rates(R: Floats, form: str) -> Floats:
    # Return the pseudoinverse of the matrix E in w = E * (rates of the angles). The columns of E
    # are the axes of the three rotations (Siciliano, section 3.6).
    last = 2 if form == 'zyz' else 0
    angle = np.arctan2(R[..., 1, last], R[..., 0, last])
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    second = np.stack([-np.sin(angle), np.cos(angle), zero], axis=-1)
    E = np.stack([np.stack([zero, zero, one], axis=-1), second, R[..., last]], axis=-1)
    rates = np.linalg.pinv(E)
    return rates[..., ::-1, :] if form == 'rpy' else rates
