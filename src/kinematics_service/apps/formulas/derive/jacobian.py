"""
The exact Jacobian by four methods, all in the base frame about the tool's origin.

Rows are the linear three, then the angular three; columns are per rad, or per length unit.
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

# Entries of an antisymmetric matrix that are its vector.
VEE = ([2, 0, 1], [1, 2, 0])


@dataclass(frozen=True)
class Axis:
    """The axis one row of the table moves along: its direction z and a point o on it."""

    row: int
    z: Matrix
    o: Matrix


def axes_seen_from(frames: Frames, frame: int) -> tuple[Axis, ...]:
    """
    Return the axis of every moving row, in the axes and about the origin of one frame.

    The rule of each convention comes out of where its row turns: z of the frame before the row in
    the standard table, of the frame after it in the modified one, the named axis in a chain of
    elementary motions, z of the input shape in Sheth and Uicker's.

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
    # The frame before each row, in the frame asked for, multiplied outwards from there.
    if frame < 0:
        yield from enumerate(frames.in_base[:-1])
        return
    before, after = frames.row_transforms[:frame], frames.row_transforms[frame:]
    onwards = accumulate(after, np.matmul, initial=identity(frames.tool[0][0].ring))
    yield from zip(range(frame, len(frames.rows)), onwards)
    yield from zip(reversed(range(frame)), accumulate(map(inverse, reversed(before)), np.matmul))


def coupling(frames: Frames, arithmetic: Arithmetic) -> sympy.Matrix:
    """
    Return C with (theta, d of each moving row) = C q + constants, a sympy matrix.

    Rows are theta of each moving row, then d where that moves too.
    """
    variables = arithmetic.names.variables
    moved = (factors for row in frames.rows for _, factors in (row.theta, row.d) if factors)
    return sympy.ImmutableMatrix([[factors.get(v, 0) for v in variables] for factors in moved])


def jacobian_of(
    frames: Frames, arithmetic: Arithmetic, axes: Sequence[Axis], linear: Sequence[Matrix]
) -> Matrix:
    """
    Return J of axes, in the frame they are seen from: J = J_open C, with the `coupling` C.

    Parameters
    ----------
    linear
        Velocity of the point while the row of each axis turns, per rad.
    """
    nothing = np.full(3, arithmetic.ring.number(0))
    open_: list[Matrix] = []
    for axis, velocity in zip(axes, linear):
        row = frames.rows[axis.row]
        open_ += [np.concatenate([velocity, axis.z])] if row.theta[1] else []
        open_ += [np.concatenate([axis.z, nothing])] if row.d[1] else []
    C = arithmetic.constant_matrix(coupling(frames, arithmetic).tolist())
    return np.transpose(open_) @ C


def about(frames: Frames, arithmetic: Arithmetic, axes: Sequence[Axis], point: Matrix) -> Matrix:
    """Return J of axes about a point by z x (p - o) and z, in the frame both are seen from."""
    linear = [np.cross(axis.z, point - axis.o) for axis in axes]
    return jacobian_of(frames, arithmetic, axes, linear)


def geometric(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """Return J by z x (p - o) and z; of a prismatic joint [z; 0]."""
    axes = axes_seen_from(frames, -1)
    return about(frames, arithmetic, axes, frames.T_base_tool[:3, 3])


def screw_based(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by screws about the end effector: [s; s_o x s], s_o the axis seen from the tool.

    s_o is added up link by link from the tool backwards, s_o(i) = s_o(i + 1) - R_i step_i, as in
    "000_823ec4230178d515.txt", lines 40-58; the rows are put linear first here.
    """
    seen = -(frames.in_base[-1][:3, :3] @ frames.tool[:3, 3])
    s_o: dict[int, Matrix] = {}
    for k, row in reversed([*enumerate(frames.rows)]):
        R = frames.in_base[k][:3, :3]
        seen = seen - R @ frames.row_transforms[k][:3, 3]
        s_o[k] = seen + R @ row.before[:3, 3]
    axes = axes_seen_from(frames, -1)
    linear = [np.cross(s_o[axis.row], axis.z) for axis in axes]
    return jacobian_of(frames, arithmetic, axes, linear)


def analytic(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by dp/dq and vee(dR/dq R^T), with no axis and no vector product.

    R = A B, cut where it is half as long: dR R^T = dA A^T + A dB B^T A^T has far fewer terms to
    multiply.
    """
    middle = (len(frames.rows) + 1) // 2
    p = frames.T_base_tool[:3, 3]
    A = frames.in_base[middle][:3, :3]
    B = reduce(np.matmul, (*frames.row_transforms[middle:], frames.tool))[:3, :3]
    columns = []
    for variable in arithmetic.names.variables:
        before = derivative(A, arithmetic, variable) @ A.T
        behind = A @ (derivative(B, arithmetic, variable) @ B.T) @ A.T
        columns.append([*derivative(p, arithmetic, variable), *(before + behind)[VEE]])
    return np.transpose(columns)


def rotation_taken_out(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by T'(q_k) T^-1 of each factor, the way of "002_bccf79781668e053.txt", line 71.

    T = before screw(q) after, so that T' T^-1 = before screw' screw^-1 before^-1: each factor is
    differentiated alone and carried to the base. The rest is the velocity of the base's own
    origin; the tool's is it plus w x p, because T' diag(R^-1, 1) keeps the tool's position.
    """
    p = frames.T_base_tool[:3, 3]
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
    """Return the derivative of every entry by a joint variable."""
    entries = [arithmetic.derivative(entry, variable) for entry in matrix.flat]
    return np.reshape(np.array(entries), matrix.shape)


METHODS: dict[str, Callable[[Frames, Arithmetic], Matrix]] = {
    'geometric': geometric,
    'screw': screw_based,
    'analytic': analytic,
    'rotation taken out': rotation_taken_out,
}


def differences(one: Matrix, other: Matrix) -> int:
    """Return the number of terms of the difference of two matrices: 0 if they are equal."""
    return sum(map(len, (one - other).flat))


def may_turn(rows: Collection[int]) -> bool:
    """
    Return whether a determinant of these rows is the same in any axes.

    It is if all three linear rows are among them, or none, and likewise the angular rows.
    """
    return all(len(set(part) & set(rows)) in (0, 3) for part in ((0, 1, 2), (3, 4, 5)))


def in_axes_of(J: Matrix, T: Matrix) -> Matrix:
    """
    Return J in the axes of a frame whose pose in the base frame is T; the point stays the tool.
    """
    R_t = T[:3, :3].T
    return np.concatenate([R_t @ J[:3], R_t @ J[3:]])
