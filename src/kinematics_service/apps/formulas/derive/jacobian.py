"""
The exact Jacobian of the tool four ways, all in the base frame about the tool's origin.

Rows are the linear three, then the angular three; columns are per rad, or per length unit.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import reduce

import sympy

from .algebra.arithmetic import Arithmetic, inverse
from .algebra.laurent import Laurent, total
from .algebra.matrices import Matrix, Vector, cross, product
from .frames import ExactRow, Frames


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
            z = tuple(start[i][2] for i in range(3))
            axes.append(Axis(row, z, tuple(start[i][3] for i in range(3))))
    return tuple(sorted(axes, key=lambda axis: axis.row))


def _row_starts(frames: Frames, frame: int) -> Iterable[tuple[int, Matrix]]:
    # The frame before each row, in the frame asked for, multiplied outwards from there.
    if frame < 0:
        yield from enumerate(frames.in_base[:-1])
        return
    zero, *_, one = frames.tool[3]
    identity = tuple(tuple(one if i == j else zero for j in range(4)) for i in range(4))
    T: Matrix = identity
    for row in range(frame, len(frames.rows)):
        yield row, T
        T = product(T, frames.row_transforms[row])
    T = identity
    for row in reversed(range(frame)):
        T = product(T, inverse(frames.row_transforms[row]))
        yield row, T


def coupling(frames: Frames, arithmetic: Arithmetic) -> sympy.Matrix:
    """
    Return C with (theta, d of each moving row) = C q + constants, a sympy matrix.

    Rows are theta of each moving row, then d where that moves too.
    """
    rows = []
    for row in frames.rows:
        for _, factors in (row.theta, row.d):
            if factors:
                rows.append([factors.get(v, 0) for v in arithmetic.names.variables])
    return sympy.ImmutableMatrix(rows)


def _columns(
    frames: Frames,
    arithmetic: Arithmetic,
    moving: Callable[[Axis], tuple[Vector, Vector]],
    axes: tuple[Axis, ...],
) -> Matrix:
    # J = J_open C: a joint that moves several rows has the sum of their columns.
    ring = arithmetic.ring
    parts = [(frames.rows[axis.row], *moving(axis), axis.z) for axis in axes]
    columns = []
    for variable in arithmetic.names.variables:
        summands: list[list[Laurent]] = [[] for _ in range(6)]
        for row, linear, angular, z in parts:
            _add_scaled(summands, arithmetic, row.theta[1].get(variable, 0), (*linear, *angular))
            _add_scaled(summands, arithmetic, row.d[1].get(variable, 0), z)
        columns.append(tuple(total(ring, entries) for entries in summands))
    return tuple(zip(*columns))


def _add_scaled(
    summands: list[list[Laurent]], arithmetic: Arithmetic, factor: sympy.Expr, column: Vector
) -> None:
    if factor == 0:
        return
    scale = arithmetic.ring.length(sympy.sympify(factor))
    for entries, value in zip(summands, column):
        if value:
            entries.append(scale * value)


def geometric(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """Return J by z x (p - o) and z; of a prismatic joint [z; 0]."""
    p = tuple(frames.T_base_tool[i][3] for i in range(3))

    def column(axis: Axis) -> tuple[Vector, Vector]:
        arm = tuple(a - b for a, b in zip(p, axis.o))
        return cross(axis.z, arm), axis.z

    return _columns(frames, arithmetic, column, axes_seen_from(frames, -1))


def screw_based(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by screws about the end effector: [s; s_o x s], s_o the axis seen from the tool.

    s_o is added up link by link from the tool backwards, s_o(i) = s_o(i + 1) - R_i step_i, as in
    "000_823ec4230178d515.txt", lines 40-58; the rows are put linear first here.
    """
    ring = arithmetic.ring
    steps: dict[int, Vector] = {}
    tool = tuple((frames.tool[i][3],) for i in range(3))
    last = _rotated(frames.in_base[-1], tool)
    seen: Vector = tuple(ring.number(0) - e for e in last)
    for row in reversed(range(len(frames.rows))):
        step = tuple((frames.row_transforms[row][i][3],) for i in range(3))
        seen = tuple(a - b for a, b in zip(seen, _rotated(frames.in_base[row], step)))
        inner = tuple((frames.rows[row].before[i][3],) for i in range(3))
        offset = _rotated(frames.in_base[row], inner)
        steps[row] = tuple(a + b for a, b in zip(seen, offset))

    def column(axis: Axis) -> tuple[Vector, Vector]:
        return cross(steps[axis.row], axis.z), axis.z

    return _columns(frames, arithmetic, column, axes_seen_from(frames, -1))


def _rotated(T: Matrix, column: Matrix) -> Vector:
    return tuple(row[0] for row in product(_rotation(T), column))


def analytic(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by dp/dq and vee(dR/dq R^T), with no axis and no vector product.

    R = A B, cut where it is half as long: dR R^T = dA A^T + A dB B^T A^T has far fewer terms to
    multiply.
    """
    middle = (len(frames.rows) + 1) // 2
    p = tuple(frames.T_base_tool[i][3:] for i in range(3))
    A = _rotation(frames.in_base[middle])
    B = _rotation(reduce(product, (*frames.row_transforms[middle:], frames.tool)))
    A_t, B_t = tuple(zip(*A)), tuple(zip(*B))
    columns = []
    for variable in arithmetic.names.variables:
        before = product(derivative(A, arithmetic, variable), A_t)
        behind = product(derivative(B, arithmetic, variable), B_t)
        behind = product(product(A, behind), A_t)
        # vee of an antisymmetric matrix: entries (2, 1), (0, 2), (1, 0).
        turning = (before[i][j] + behind[i][j] for i, j in ((2, 1), (0, 2), (1, 0)))
        linear = (row[0] for row in derivative(p, arithmetic, variable))
        columns.append((*linear, *turning))
    return tuple(zip(*columns))


def _rotation(T: Matrix) -> Matrix:
    return tuple(row[:3] for row in T[:3])


def rotation_taken_out(frames: Frames, arithmetic: Arithmetic) -> Matrix:
    """
    Return J by T'(q_k) T^-1 of each factor, the way of "002_bccf79781668e053.txt", line 71.

    T = before screw(q) after, so that T' T^-1 = before screw' screw^-1 before^-1: each factor is
    differentiated alone and carried to the base. What is left is the velocity of the base's own
    origin; the tool's is that plus w x p, because T' diag(R^-1, 1) keeps the tool's position.
    """
    ring = arithmetic.ring
    p = tuple(frames.T_base_tool[i][3] for i in range(3))
    columns = []
    for variable in arithmetic.names.variables:
        spatial: list[Matrix] = []
        for k, row in enumerate(frames.rows):
            if variable in row.theta[1] or variable in row.d[1]:
                spatial.append(_carried(frames, arithmetic, k, row, variable))
        twist = [
            total(ring, (S[i][j] for S in spatial))
            for i, j in ((0, 3), (1, 3), (2, 3), (2, 1), (0, 2), (1, 0))
        ]
        turned = cross(twist[3:], p)
        columns.append((*(a + b for a, b in zip(twist[:3], turned)), *twist[3:]))
    return tuple(zip(*columns))


def _carried(
    frames: Frames, arithmetic: Arithmetic, k: int, row: ExactRow, variable: sympy.Symbol
) -> Matrix:
    screw = arithmetic.screw_z(row.theta, row.d)
    rate = product(derivative(screw, arithmetic, variable), inverse(screw))
    start = product(frames.in_base[k], row.before)
    return product(product(start, rate), inverse(start))


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
    """Return how many terms are left of the difference of two matrices: 0 where they are equal."""
    return sum(len(a - b) for row, row_2 in zip(one, other) for a, b in zip(row, row_2))


def in_axes_of(J: Matrix, T: Matrix) -> Matrix:
    """
    Return J in the axes of a frame whose pose in the base frame is T; the point stays the tool.
    """
    R_t = tuple(tuple(T[j][i] for j in range(3)) for i in range(3))
    return (*product(R_t, J[:3]), *product(R_t, J[3:]))
