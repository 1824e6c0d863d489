"""
The exact Jacobian by four methods, all in the base frame about the tool's origin.

Rows are the linear three, then the angular three; columns are per rad, or per length unit.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate

import sympy

from .algebra.arithmetic import Arithmetic
from .algebra.laurent import total
from .algebra.matrices import (
    Matrix,
    Vector,
    cross,
    identity,
    inverse,
    minus,
    position_of,
    product,
    rotation_of,
    times,
    transposed,
)
from .frames import Frames

# Entries of an antisymmetric matrix that are its vector.
VEE = ((2, 1), (0, 2), (1, 0))


@dataclass(frozen=True)
class Axis:
    """The axis one row of the table moves along: its direction z and a point o on it."""

    row: int
    z: Vector
    o: Vector


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
            start = product(T, exact.before)
            axes.append(Axis(row, transposed(start)[2][:3], position_of(start)))
    return tuple(sorted(axes, key=lambda axis: axis.row))


def _row_starts(frames: Frames, frame: int) -> Iterable[tuple[int, Matrix]]:
    # The frame before each row, in the frame asked for, multiplied outwards from there.
    if frame < 0:
        yield from enumerate(frames.in_base[:-1])
        return
    before, after = frames.row_transforms[:frame], frames.row_transforms[frame:]
    onwards = accumulate(after, product, initial=identity(frames.tool[0][0].ring))
    yield from zip(range(frame, len(frames.rows)), onwards)
    yield from zip(reversed(range(frame)), accumulate(map(inverse, reversed(before)), product))


def coupling(frames: Frames, arithmetic: Arithmetic) -> sympy.Matrix:
    """
    Return C with (theta, d of each moving row) = C q + constants, a sympy matrix.

    Rows are theta of each moving row, then d where that moves too.
    """
    variables = arithmetic.names.variables
    moved = (factors for row in frames.rows for _, factors in (row.theta, row.d) if factors)
    return sympy.ImmutableMatrix([[factors.get(v, 0) for v in variables] for factors in moved])


def jacobian_of(
    frames: Frames, arithmetic: Arithmetic, axes: Sequence[Axis], linear: Sequence[Vector]
) -> Matrix:
    """
    Return J of axes, in the frame they are seen from: J = J_open C, with the `coupling` C.

    Parameters
    ----------
    linear
        Velocity of the point while the row of each axis turns, per rad.
    """
    nothing = (arithmetic.ring.number(0),) * 3
    open_: list[Vector] = []
    for axis, velocity in zip(axes, linear):
        row = frames.rows[axis.row]
        open_ += [(*velocity, *axis.z)] if row.theta[1] else []
        open_ += [(*axis.z, *nothing)] if row.d[1] else []
    C = arithmetic.constant_matrix(coupling(frames, arithmetic).tolist())
    return product(transposed(tuple(open_)), C)


def about(frames: Frames, arithmetic: Arithmetic, axes: Sequence[Axis], point: Vector) -> Matrix:
    """Return J of axes about a point by z x (p - o) and z, in the frame both are seen from."""
    linear = [cross(axis.z, minus(point, axis.o)) for axis in axes]
    return jacobian_of(frames, arithmetic, axes, linear)


def geometric(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """Return J by z x (p - o) and z; of a prismatic joint [z; 0]."""
    axes = axes_seen_from(frames, -1)
    return about(frames, arithmetic, axes, position_of(frames.T_base_tool))


def screw_based(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by screws about the end effector: [s; s_o x s], s_o the axis seen from the tool.

    s_o is added up link by link from the tool backwards, s_o(i) = s_o(i + 1) - R_i step_i, as in
    "000_823ec4230178d515.txt", lines 40-58; the rows are put linear first here.
    """
    tool = times(rotation_of(frames.in_base[-1]), position_of(frames.tool))
    seen: Vector = tuple(-e for e in tool)
    s_o: dict[int, Vector] = {}
    for k, row in reversed([*enumerate(frames.rows)]):
        R = rotation_of(frames.in_base[k])
        seen = minus(seen, times(R, position_of(frames.row_transforms[k])))
        s_o[k] = tuple(a + b for a, b in zip(seen, times(R, position_of(row.before))))
    axes = axes_seen_from(frames, -1)
    linear = [cross(s_o[axis.row], axis.z) for axis in axes]
    return jacobian_of(frames, arithmetic, axes, linear)


def analytic(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by dp/dq and vee(dR/dq R^T), with no axis and no vector product.

    R = A B, cut where it is half as long: dR R^T = dA A^T + A dB B^T A^T has far fewer terms to
    multiply.
    """
    middle = (len(frames.rows) + 1) // 2
    p = position_of(frames.T_base_tool)
    A = rotation_of(frames.in_base[middle])
    B = rotation_of(reduce(product, (*frames.row_transforms[middle:], frames.tool)))
    columns = []
    for variable in arithmetic.names.variables:
        before = product(derivative(A, arithmetic, variable), transposed(A))
        behind = product(derivative(B, arithmetic, variable), transposed(B))
        behind = product(product(A, behind), transposed(A))
        turning = (before[i][j] + behind[i][j] for i, j in VEE)
        columns.append((*derivative((p,), arithmetic, variable)[0], *turning))
    return transposed(tuple(columns))


def rotation_taken_out(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by T'(q_k) T^-1 of each factor, the way of "002_bccf79781668e053.txt", line 71.

    T = before screw(q) after, so that T' T^-1 = before screw' screw^-1 before^-1: each factor is
    differentiated alone and carried to the base. The rest is the velocity of the base's own
    origin; the tool's is it plus w x p, because T' diag(R^-1, 1) keeps the tool's position.
    """
    p = position_of(frames.T_base_tool)
    columns = []
    for variable in arithmetic.names.variables:
        spatial: list[Matrix] = []
        for row, T in zip(frames.rows, frames.in_base):
            if variable in row.theta[1] or variable in row.d[1]:
                screw, start = arithmetic.screw_z(row.theta, row.d), product(T, row.before)
                rate = product(derivative(screw, arithmetic, variable), inverse(screw))
                spatial.append(product(product(start, rate), inverse(start)))
        v, w = (
            tuple(total(arithmetic.ring, (S[i][j] for S in spatial)) for i, j in entries)
            for entries in (((0, 3), (1, 3), (2, 3)), VEE)
        )
        columns.append((*(a + b for a, b in zip(v, cross(w, p))), *w))
    return transposed(tuple(columns))


def derivative(matrix: Matrix, arithmetic: Arithmetic, variable: sympy.Symbol) -> Matrix:
    """Return the derivative of every entry by a joint variable."""
    return tuple(tuple(arithmetic.derivative(entry, variable) for entry in row) for row in matrix)


METHODS: dict[str, Callable[[Frames, Arithmetic], Matrix]] = {
    'geometric': geometric,
    'screw': screw_based,
    'analytic': analytic,
    'rotation taken out': rotation_taken_out,
}


def differences(one: Matrix, other: Matrix) -> int:
    """Return the number of terms of the difference of two matrices: 0 if they are equal."""
    return sum(len(a - b) for row, row_2 in zip(one, other) for a, b in zip(row, row_2))


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
    R_t = transposed(rotation_of(T))
    return (*product(R_t, J[:3]), *product(R_t, J[3:]))
