# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the pose, Jacobian, twist and frames of an arm at joint positions, and quaternions of
poses.
"""

import math

from .forward import chain_pass
from .forward.chain import Chain
from .layout import arrays, places
from .layout.arrays import Flat, Floats
from .loops import closed_pass


def evaluate(chain: Chain, q: Floats, qdot: Floats, depth: int, rows: Floats) -> int:
    """
    Fill `rows` with the pose, quaternion, Jacobian, twist and frames at each of N joint positions
    q.

    Return -1 if all rows were computed, else the index of the first row that cannot be computed. A
    row cannot be computed if q or qdot is not finite or too large for finite results, or if a loop
    does not close.

    Parameters
    ----------
    chain
        The chain of the arm.
    q, qdot : shape (N, n) and (N, n) or (1, n), rad or m, rad/s or m/s
        Joint positions and velocities. A single row of `qdot` is used for all rows of `q`.
    depth
        POSE, JACOBIAN (with the twist and the screws) or ALL_FRAMES.
    rows : shape (N, width)
        Results in the base frame: pose (4, 4) at POSE_AT, quaternion x y z w at QUATERNION_AT, J
        (6, n) at JACOBIAN_AT, then the twist (6,), the screws of the chain's entries (6, entries)
        at chain.screws_at, and the frames (4, 4) at chain.frames_at. The rows of J and of the
        twist are vx vy vz wx wy wz of the tool's origin.
    """
    count, n = arrays.extent(q, 0), chain.dof
    if (
        arrays.extent(q, 1) != n
        or arrays.extent(qdot, 1) != n
        or arrays.extent(rows, 0) != count
        or arrays.extent(rows, 1) < chain.widths[depth]
    ):
        raise TypeError('the arrays of an evaluation do not go together')
    stride = 0 if arrays.extent(qdot, 0) == 1 else n
    positions, rates = arrays.numbers(q, 0), arrays.numbers(qdot, count * stride)
    results, width = arrays.results(rows, 0), arrays.extent(rows, 1)
    side_by_side = depth < places.ALL_FRAMES and chain.loops == 0
    together = places.LANES if side_by_side else count + 1
    work = arrays.scratch(chain_pass.room(chain))
    with arrays.without_lock():
        stopped, k = -1, 0
        while stopped < 0 and k < count:
            q_k, qdot_k = arrays.after(positions, k * n), arrays.after(rates, k * stride)
            row = arrays.after(results, k * width)
            if count - k >= together and chain_pass.evaluate_rows(
                chain, q_k, qdot_k, stride, depth, row, width, work
            ):
                k += places.LANES
                continue
            nothing = 0.0  # becomes NaN if a number is not finite
            for j in range(n):
                nothing += 0.0 * q_k[j] + 0.0 * qdot_k[j]
            if nothing != 0.0 or not math.isfinite(
                closed_pass.evaluate_row(chain, q_k, qdot_k, depth, row)
            ):
                stopped = k
            k += 1
    arrays.give_back(work)
    return stopped


def evaluate_one(chain: Chain, q: Floats, qdot: Floats, row: Floats) -> int:
    """
    Fill `row` with the results of `evaluate` at one q, followed by q, qdot and a copy of the
    quaternion.

    Return -1 if the row was computed. Return 0 if q or qdot has a number that is NaN or infinite,
    if they are so large that a result is not finite, or if a loop does not close. Return -2 if q
    or qdot does not have n numbers.

    Parameters
    ----------
    chain
        The chain of the arm.
    q, qdot : shape (n,) each, rad or m, rad/s or m/s
        Joint positions and velocities.
    row : shape (width + 2 n + ROW_TAIL,)
        The results of `evaluate`, then q, qdot and the copy of the quaternion. `width` is
        chain.widths[depth], so the length of `row` selects the depth: POSE, JACOBIAN or
        ALL_FRAMES. The function has no argument for the depth, because reading one more argument
        takes as much time as the computation for one joint.
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
    Read q and qdot from `row`, where they begin at index `at`. Fill the numbers of `row` before
    this index with the results of `evaluate`.

    `closed` says whether the row already has the passive variables of the loops. Return -1 if the
    row was computed. Return 0 if q or qdot has a number that is NaN or infinite, if they are so
    large that a result is not finite, or if a loop does not close.
    """
    n = chain.dof
    nothing = 0.0
    for j in range(at, at + 2 * n):
        nothing += 0.0 * row[j]  # `nothing` becomes NaN if row[j] is not finite
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
