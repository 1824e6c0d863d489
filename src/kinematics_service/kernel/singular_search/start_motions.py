# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute joint motions that make a singular value of the task Jacobian J_t zero to first order.

The motions are starts of the projection onto singular poses. The derivative of a singular value
with the singular vectors u and v is u^T dJ_t v (Golub and Van Loan, Matrix Computations, section
8.6). If two singular values are nearly zero, the direction lost at the nearest singular pose may
be any combination of their singular vectors.
"""

import math

from ..forward import chain_pass
from ..layout import arrays, places
from ..layout.arrays import Flat
from . import jacobian_changes, projection, rank_equations
from .rank_equations import RankEquations


def write_zero_of(equations: RankEquations, r: int, d: Flat) -> float:
    """
    Fill d (n,), rad, with the least-norm joint motion that makes singular value number r zero to
    first order.

    The singular value is that of J_t at the pose given to `decompose`. Returns the length of d,
    rad.
    """
    n, m = equations.n, equations.m
    equations.restart()
    first = arrays.after(equations.W, r * (m + n))
    second = arrays.after(first, max(m, n))
    joints, tool = (first, second) if n > m else (second, first)
    arrays.fill(equations.Y, 6, 0.0)
    for j in range(n):
        equations.X[j] = joints[j] * equations.task.column_scale[j]
    for i in range(m):
        equations.add_tool_motion(i, tool[i], equations.Y)
    if equations.chain.loops == 0:
        jacobian_changes.write_changes(
            equations.chain, equations.row, equations.X, equations.changes
        )
    equations.write_slope(equations.X, equations.Y, d)
    length = rank_equations.length_of(d, n)
    if not length > 0.0:
        return places.INFINITY
    for j in range(n):
        d[j] *= -equations.sigma[r] / (length * length)
    return equations.sigma[r] / length


def write_zero_between(
    equations: RankEquations, origin: Flat, turn: float, limit: float, d: Flat
) -> float:
    """
    Fill d (n,), rad, with the joint motion to the nearest pose with a given lost direction w.

    A lost direction is a direction in which the tool cannot move. The direction w is a combination
    of two tool directions, with the weights cos(turn) and sin(turn). The two tool directions
    belong to the two least singular values of the task Jacobian J_t.

    Returns the length of d, rad; infinite if it exceeds `limit`, or if the generic rank is 1.

    Gaussian elimination of J_t (rank_equations.py) stops one pivot earlier than usual. So the
    Schur complement S of J_t has two rows S1 and S2 (or two columns, if J_t has more rows than
    columns). The tool has lost w if cos(turn) S1 + sin(turn) S2 = 0. Newton's method solves this
    equation. It never divides by the last pivot, which is small if two singular values are nearly
    zero.
    """
    n, rank, length = equations.n, equations.task.generic_rank, places.INFINITY
    if rank < 2 or rank < min(equations.m, n):
        return length
    arrays.fill(d, n, 0.0)
    equations.restart()
    for _ in range(projection.NEWTON_STEPS):
        length = places.INFINITY
        equations.stop_after(rank - 2)
        if not equations.move_to(origin, d):
            break
        equations.write_slopes()
        _mix(equations, turn)
        if not equations.write_steps(d, equations.onto, equations.along):
            break
        step = 0.0
        for j in range(n):
            change = equations.onto[j] + equations.along[j]
            step += change * change
            d[j] += change
        length = rank_equations.length_of(d, n)
        if not length < limit:
            length = places.INFINITY
        if not length < limit or math.sqrt(step) <= projection.SLIDE_TOLERANCE * length:
            break
    equations.stop_after(rank - 1)
    return length


def _mix(equations: RankEquations, turn: float) -> None:
    # The Schur complement S of J_t has two rows (or two columns) S1 and S2. Replaces S by one row
    # (or column), the sum cos(turn) S1 + sin(turn) S2. The first n columns of G are the
    # derivatives of the entries of S by the joints. Replaces these columns by the derivatives of
    # the entries of the sum, and makes the rows of G orthogonal.
    n = equations.n
    lines, width, other = equations.count // 2, n + equations.count, n + equations.count // 2
    by_rows = equations.lost == 2
    pair = chain_pass.sincos(turn)
    for i in range(lines):
        first = i if by_rows else 2 * i
        second = first + (lines if by_rows else 1)
        for j in range(n):
            value = (
                pair[1] * equations.G[first * width + j]
                + pair[0] * equations.G[second * width + j]
            )
            equations.mixed[i * other + j] = value
        equations.mixed[lines * other + i] = (
            pair[1] * equations.S[first] + pair[0] * equations.S[second]
        )
    arrays.copy(equations.G, lines * other, equations.mixed)
    arrays.copy(equations.S, lines, arrays.after(equations.mixed, lines * other))
    equations.count = lines
    equations.orthogonalise()
