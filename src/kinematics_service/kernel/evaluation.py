"""Evaluation of joint positions, of one or of many, and quaternions of poses."""

import math

from .forward import chain_pass
from .forward.chain import Chain
from .layout import arrays, places
from .layout.arrays import Flat, Floats
from .loops import closed_pass


def evaluate(chain: Chain, q: Floats, qdot: Floats, depth: int, rows: Floats) -> int:
    """
    Fill `rows` with pose, quaternion, Jacobian, twist and frames of each q: one pass a row.

    Returns -1, or the index of the first q or qdot that is not finite, or too large for finite
    results.

    Parameters
    ----------
    chain
        The arm.
    q, qdot : shape (N, n) and (N, n) or (1, n), rad or m, rad/s or m/s
        One row of `qdot` serves every row of `q`.
    depth
        POSE, JACOBIAN (with the twist and the screws) or ALL_FRAMES.
    rows : shape (N, width)
        Results, in the base frame: pose 4 x 4 at POSE_AT, quaternion x y z w at QUATERNION_AT, J
        (6, n) at JACOBIAN_AT, twist (6,) after it, the screws of the entries (6, entries) at
        chain.screws_at, frames 4 x 4 each at chain.frames_at. Rows of J and the twist:
        vx vy vz wx wy wz of the tool's origin.
    """
    count, n = arrays.extent(q, 0), chain.dof
    if (
        arrays.extent(q, 1) != n
        or arrays.extent(qdot, 1) != n
        or arrays.extent(rows, 0) != count
        or arrays.extent(rows, 1) < chain.widths[depth]
    ):
        raise TypeError('the arrays of an evaluation do not go together')
    each = 0 if arrays.extent(qdot, 0) == 1 else n
    positions, rates = arrays.numbers(q, 0), arrays.numbers(qdot, count * each)
    results, width = arrays.results(rows, 0), arrays.extent(rows, 1)
    work = arrays.scratch(chain_pass.room(chain))
    lock = arrays.let_go()
    stopped = _evaluate_rows(chain, count, positions, rates, each, depth, results, width, work)
    arrays.take_back(lock)
    arrays.give_back(work)
    return stopped


def _evaluate_rows(
    chain: Chain,
    count: int,
    q: Flat,
    qdot: Flat,
    each: int,
    depth: int,
    rows: Flat,
    width: int,
    work: Flat,
) -> int:
    n = chain.dof
    k = 0
    while k < count:
        q_k, qdot_k = arrays.after(q, k * n), arrays.after(qdot, k * each)
        row = arrays.after(rows, k * width)
        side_by_side = depth < places.ALL_FRAMES and count - k >= places.LANES
        side_by_side = side_by_side and chain.loops == 0
        if side_by_side and chain_pass.evaluate_rows(
            chain, q_k, qdot_k, each, depth, row, width, work
        ):
            k += places.LANES
            continue
        nothing = 0.0
        for j in range(n):
            nothing += 0.0 * q_k[j] + 0.0 * qdot_k[j]  # not a number if one is not finite
        if nothing != 0.0 or not math.isfinite(
            closed_pass.evaluate_row(chain, q_k, qdot_k, depth, row)
        ):
            return k
        k += 1
    return -1


def evaluate_one(chain: Chain, q: Floats, qdot: Floats, row: Floats) -> int:
    """
    Fill one row as `evaluate` does, and after it q, qdot and, once more, the quaternion.

    Returns -1; 0 if a number is not finite or too large; -2 if q or qdot does not have n numbers.

    Parameters
    ----------
    chain
        The arm.
    q, qdot : shape (n,) each
        Joint positions and velocities.
    row : shape (width + 2 n + ROW_TAIL,)
        Its length tells how much of it is filled: a depth of `evaluate`. The arguments are few,
        because a call spends as much time on each of them as on a joint.
    """
    n = chain.dof
    if arrays.size(q) != n or arrays.size(qdot) != n:
        return -2
    positions, rates = arrays.numbers(q, n), arrays.numbers(qdot, n)
    tail = 2 * n + places.ROW_TAIL
    result = arrays.results(row, chain.pose_width + tail)
    at = arrays.size(row) - tail
    for j in range(n):
        result[at + j] = positions[j]
        result[at + n + j] = rates[j]
    bad = evaluate_tail(chain, result, at, False)
    arrays.copy(
        arrays.after(result, at + 2 * n),
        places.ROW_TAIL,
        arrays.after(result, places.QUATERNION_AT),
    )
    return bad


def evaluate_tail(chain: Chain, row: Flat, at: int, closed: bool) -> int:
    """
    Evaluate a row at the q and qdot in it from `at` on, which is its width. Returns -1, or 0 if a
    number is not finite or too large, or a loop does not close. Where they have been closed in the
    row, `closed` says so.
    """
    n = chain.dof
    nothing = 0.0
    for j in range(at, at + 2 * n):
        nothing += 0.0 * row[j]  # not a number if one of them is not finite
    depth = places.POSE
    if at >= chain.width:
        depth = places.ALL_FRAMES
    elif at >= chain.frames_at:
        depth = places.JACOBIAN
    if closed:
        total = closed_pass.evaluate_closed(chain, arrays.after(row, at + n), depth, row)
    else:
        total = closed_pass.evaluate_row(
            chain, arrays.after(row, at), arrays.after(row, at + n), depth, row
        )
    return -1 if math.isfinite(total + nothing) else 0


def quaternions(poses: Floats, quaternions_xyzw: Floats) -> None:
    """Fill `quaternions_xyzw` (N, 4) with the unit quaternions, w >= 0, of poses (N, 4, 4)."""
    count = arrays.extent(poses, 0)
    motions = arrays.numbers(poses, 16 * count)
    results = arrays.results(quaternions_xyzw, 4 * count)
    for k in range(count):
        chain_pass.write_quaternion(arrays.after(motions, 16 * k), results, 4 * k)
