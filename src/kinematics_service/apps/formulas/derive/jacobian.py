# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive the exact Jacobian by four methods, in base axes with the tool's origin as reference point.

The three linear rows come first, then the three angular rows. Columns are per rad, or per length
unit.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate

import numpy as np
import sympy

from .algebra.arithmetic import Arithmetic
from .algebra.matrices import Matrix, identity, inverse
from .frames import Frames

# Row and column indices at which the antisymmetric matrix [w] has the entries of the vector w.
VEE = ([2, 0, 1], [1, 2, 0])


@dataclass(frozen=True)
class Axis:
    """
    The axis about or along which a row of the table moves: a unit vector z and a point o on it.
    """

    row: int
    z: Matrix
    o: Matrix


def axes_seen_from(frames: Frames, frame: int) -> tuple[Axis, ...]:
    """
    Return the axis of every moving row of the table, in the coordinates of one frame.

    A row T = before Rz(theta) Tz(d) after moves about or along z of the frame with the pose (frame
    before the row) @ before. This gives the axis of a row in each convention. In a standard DH
    table, the axis is z of the frame before the row. In a modified DH table, the axis is z of the
    frame after the row. In a chain of elementary motions, it is the named axis. In a Sheth-Uicker
    table, it is z of the input shape.

    Parameters
    ----------
    frames
        The arm.
    frame
        0 for frame 0, i for the frame after row i, -1 for the base frame.
    """
    axes: list[Axis] = []
    for row, T in _row_starts(frames, frame):
        exact = frames.rows[row]
        if exact.moves:
            start = T @ exact.before
            axes.append(Axis(row, start[:3, 2], start[:3, 3]))
    return tuple(sorted(axes, key=lambda axis: axis.row))


def _row_starts(frames: Frames, frame: int) -> Iterable[tuple[int, Matrix]]:
    # Yield the index of each row of the table, and the pose of the frame before the row, in the
    # coordinates of frame number `frame`.
    if frame < 0:
        yield from enumerate(frames.in_base[:-1])
        return
    before, after = frames.row_transforms[:frame], frames.row_transforms[frame:]
    onwards = accumulate(after, np.matmul, initial=identity(frames.tool[0][0].ring))
    yield from zip(range(frame, len(frames.rows)), onwards)
    yield from zip(reversed(range(frame)), accumulate(map(inverse, reversed(before)), np.matmul))


def coupling(frames: Frames) -> sympy.Matrix:
    """
    Return the matrix C that maps joint positions q to theta and d of the moving rows: (theta, d) =
    C q + constants.

    C has a row for each theta or d that moves, in the order of the table, theta before d.
    """
    variables = frames.arithmetic.names.variables
    moved = (factors for row in frames.rows for _, factors in (row.theta, row.d) if factors)
    return sympy.ImmutableMatrix([[factors.get(v, 0) for v in variables] for factors in moved])


def jacobian_of(frames: Frames, axes: Sequence[Axis], linear: Sequence[Matrix]) -> Matrix:
    """
    Return the Jacobian J = J_open C in the frame in which `axes` are given, with C from
    `coupling`. J_open has a column for each theta or d that moves.

    Parameters
    ----------
    linear
        The velocity of the reference point for each axis, if the row of the axis turns at 1 rad/s.
    """
    nothing = np.full(3, frames.arithmetic.ring.number(0))
    open_: list[Matrix] = []
    for axis, velocity in zip(axes, linear):
        row = frames.rows[axis.row]
        open_ += [np.concatenate([velocity, axis.z])] if row.theta[1] else []
        open_ += [np.concatenate([axis.z, nothing])] if row.d[1] else []
    C = frames.arithmetic.constant_matrix(coupling(frames).tolist())
    return np.transpose(open_) @ C


def about(frames: Frames, axes: Sequence[Axis], point: Matrix) -> Matrix:
    """
    Return J with reference point p in the frame in which `axes` are given. Its columns are [z x (p
    - o); z].
    """
    linear = [np.cross(axis.z, point - axis.o) for axis in axes]
    return jacobian_of(frames, axes, linear)


def geometric(frames: Frames) -> Matrix:
    """Return J in base axes. Its columns are [z x (p - o); z], or [z; 0] for a prismatic joint."""
    axes = axes_seen_from(frames, -1)
    return about(frames, axes, frames.T_base_tool[:3, 3])


def screw_based(frames: Frames) -> Matrix:
    """
    Return J by screws [s; s_o x s] about the tool. Here s is the direction of an axis, and s_o is
    a point on the axis seen from the tool.

    The sum s_o(i) = s_o(i + 1) - R_i step_i runs from the tool backwards, link by link, as in the
    source document of the golden cases s000a to s000c. Here the linear rows come first.
    """
    seen = -(frames.in_base[-1][:3, :3] @ frames.tool[:3, 3])
    s_o: dict[int, Matrix] = {}
    for k, row in reversed([*enumerate(frames.rows)]):
        R = frames.in_base[k][:3, :3]
        seen = seen - R @ frames.row_transforms[k][:3, 3]
        s_o[k] = seen + R @ row.before[:3, 3]
    axes = axes_seen_from(frames, -1)
    linear = [np.cross(s_o[axis.row], axis.z) for axis in axes]
    return jacobian_of(frames, axes, linear)


def analytic(frames: Frames) -> Matrix:
    """
    Return J by dp/dq and vee(dR/dq R^T), without axes and cross products.

    R is split in the middle of the table, R = A B. Then dR R^T = dA A^T + A dB B^T A^T, which has
    far fewer terms to multiply.
    """
    arithmetic, middle = frames.arithmetic, (len(frames.rows) + 1) // 2
    p = frames.T_base_tool[:3, 3]
    A = frames.in_base[middle][:3, :3]
    B = reduce(np.matmul, (*frames.row_transforms[middle:], frames.tool))[:3, :3]
    columns = []
    for variable in arithmetic.names.variables:
        before = derivative(A, arithmetic, variable) @ A.T
        behind = A @ (derivative(B, arithmetic, variable) @ B.T) @ A.T
        columns.append([*derivative(p, arithmetic, variable), *(before + behind)[VEE]])
    return np.transpose(columns)


def rotation_taken_out(frames: Frames) -> Matrix:
    """
    Return J from the derivatives T'(q_k) T^-1 of the pose T, by the method of the source document
    of the golden case s002_rrp_ets.

    T = before screw(q) after, so that T' T^-1 = before screw' screw^-1 before^-1: each factor is
    differentiated alone and transformed to the base. The last column of T' T^-1 is the velocity
    v_0 of the point at the base's origin. The tool's velocity is v_0 + w x p.
    """
    arithmetic, p = frames.arithmetic, frames.T_base_tool[:3, 3]
    columns = []
    for variable in arithmetic.names.variables:
        spatial = np.full((4, 4), arithmetic.ring.number(0))
        for row, T in zip(frames.rows, frames.in_base):
            if variable in row.theta[1] or variable in row.d[1]:
                screw, start = arithmetic.screw_z(row.theta, row.d), T @ row.before
                rate = derivative(screw, arithmetic, variable) @ inverse(screw)
                spatial = spatial + start @ rate @ inverse(start)
        w = spatial[VEE]
        columns.append([*(spatial[:3, 3] + np.cross(w, p)), *w])
    return np.transpose(columns)


def derivative(matrix: Matrix, arithmetic: Arithmetic, variable: sympy.Symbol) -> Matrix:
    """Return the derivative of every entry of a matrix by a joint variable."""
    entries = [arithmetic.derivative(entry, variable) for entry in matrix.flat]
    return np.reshape(np.array(entries), matrix.shape)


METHODS: dict[str, Callable[[Frames], Matrix]] = {
    'geometric': geometric,
    'screw': screw_based,
    'analytic': analytic,
    'rotation taken out': rotation_taken_out,
}


def may_turn(rows: Collection[int]) -> bool:
    """
    Return whether a determinant of these rows of J does not depend on the axes.

    This holds if the rows include all three linear rows or none, and all three angular rows or
    none.
    """
    return all(len(set(part) & set(rows)) in (0, 3) for part in ((0, 1, 2), (3, 4, 5)))


def in_axes_of(J: Matrix, T: Matrix) -> Matrix:
    """
    Return J in the axes of a frame whose pose in the base frame is T; the reference point stays
    the tool.
    """
    R_t = T[:3, :3].T
    return np.concatenate([R_t @ J[:3], R_t @ J[3:]])
