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
    The axis of rotation or translation of a moving table row: a unit vector z and a point o on it.
    """

    row: int
    z: Matrix
    o: Matrix


def axes_seen_from(frames: Frames, frame: int) -> tuple[Axis, ...]:
    """
    Return the axis of every moving row of the table, in the coordinates of one frame.

    Let P be the pose of the frame in which a row of the table starts, and T = B Rz(theta) Tz(d) A
    the transform of the row, with constant B (`before`) and A (`after`). The row moves about or
    along the z axis of the pose P B. In a standard DH table, row i moves about z of frame i - 1.
    In a modified DH table, it moves about z of frame i. In a chain of elementary motions, it moves
    about the named axis. In a Sheth-Uicker table, it moves about z of the first shape matrix of
    the row.

    Parameters
    ----------
    frames
        The arm.
    frame
        Number of the frame: 0 for frame 0, i for the frame at the end of row i, -1 for the base
        frame.
    """
    axes: list[Axis] = []
    for row, T in _row_starts(frames, frame):
        exact = frames.rows[row]
        if exact.moves:
            start = T @ exact.before
            axes.append(Axis(row, start[:3, 2], start[:3, 3]))
    return tuple(sorted(axes, key=lambda axis: axis.row))


def _row_starts(frames: Frames, frame: int) -> Iterable[tuple[int, Matrix]]:
    # Yield the index of each row of the table, and the pose of the frame in which the row starts,
    # in the coordinates of frame number `frame`.
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

    C has a row for each theta or d that joints change, in the order of the table, theta before d.
    """
    variables = frames.arithmetic.names.variables
    moved = (factors for row in frames.rows for _, factors in (row.theta, row.d) if factors)
    return sympy.ImmutableMatrix([[factors.get(v, 0) for v in variables] for factors in moved])


def jacobian_of(frames: Frames, axes: Sequence[Axis], linear: Sequence[Matrix]) -> Matrix:
    """
    Return the Jacobian J = J_open C, in the frame in which `axes` are given.

    Joints change some of the entries theta and d of the table. J_open has a column for each theta
    or d that changes. The matrix C = `coupling(frames)` maps joint velocities to the rates of
    theta and d.

    Parameters
    ----------
    linear
        A velocity for each axis, in the same frame as `axes`. The reference point of the Jacobian
        has this velocity if the arm turns about the axis at 1 rad/s.
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
    Return J with the reference point `point`, in the frame in which `axes` are given.

    Let z be the direction of a joint axis, o a point on the axis, and p = `point`. The column of a
    revolute joint is [z x (p - o); z].
    """
    linear = [np.cross(axis.z, point - axis.o) for axis in axes]
    return jacobian_of(frames, axes, linear)


def geometric(frames: Frames) -> Matrix:
    """
    Return J in base axes, from the directions and points of the joint axes.

    Let z be the direction of a joint axis, o a point on the axis, and p the tool's origin. The
    column of a revolute joint is [z x (p - o); z]. The column of a prismatic joint is [z; 0].
    """
    axes = axes_seen_from(frames, -1)
    return about(frames, axes, frames.T_base_tool[:3, 3])


def screw_based(frames: Frames) -> Matrix:
    """
    Return J in base axes, from the screws of the joint axes.

    Let s be the direction of a joint axis, and s_o the vector from the tool's origin to a point on
    the axis. The column of a revolute joint is the screw [s_o x s; s].

    The vectors s_o are computed from the last frame backwards. Let s_o(k) be the vector from the
    tool's origin to the origin of frame k. Let R_k be the rotation of frame k in the base frame,
    and p_k the position of frame k + 1 in frame k. Then s_o(k) = s_o(k + 1) - R_k p_k.

    The golden cases s000a to s000c (test/golden) come from a document with this method. The
    document writes the angular rows of J first.
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

    The rotation R of the tool is split in the middle of the table, R = A B. Then dR R^T = dA A^T +
    A dB B^T A^T. The factors A and B have far fewer terms than R.
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
    Return J from the products T' T^-1, where T' = dT/dq_k is a derivative of the tool's pose T.
    The golden case s002_rrp_ets (test/golden) comes from a document with this method.

    Suppose that joint k moves one row of the table. Let S be the screw motion of the row, A the
    product of all transforms before S, and B the product of all transforms after S. So
    T = A S(q_k) B, and T' T^-1 = A S' S^-1 A^-1: only the screw motion is differentiated, and A
    transforms the result to the base frame. If joint k moves several rows, T' T^-1 is the sum of
    A S' S^-1 A^-1 over these rows.

    The 3 x 3 block of T' T^-1 at the upper left is the cross product matrix of the angular
    velocity w. The last column is v_0, the velocity of a point that is fixed to the tool and just
    passes the base's origin. So the velocity of the tool's origin p is v_0 + w x p.
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
    Return whether minors of J in the rows `rows` stay equal if J is expressed in other axes.

    The result is true if `rows` contain all three linear rows or none of them, and all three
    angular rows or none of them.
    """
    return all(len(set(part) & set(rows)) in (0, 3) for part in ((0, 1, 2), (3, 4, 5)))


def in_axes_of(J: Matrix, T: Matrix) -> Matrix:
    """
    Return J in the axes of a frame whose pose in the base frame is T; the reference point stays
    the tool.
    """
    R_t = T[:3, :3].T
    return np.concatenate([R_t @ J[:3], R_t @ J[3:]])
