"""
All compiled functions: one pass over the chain, and the measures of its Jacobian.

Everything here works on two packed arrays of a chain (`chain.Chain.integers`, `.numbers`), two of
a task (`task.Task.integers`, `.numbers`), and rows of numbers. It stays in one file because
numba's on-disk cache does not notice an edit in another one. With `NUMBA_DISABLE_JIT=1` the same
source runs as plain Python.

Notation: an element k is one moving screw of the chain, its axis the z axis (unit vector z)
through the point o, its motion Rz(theta) Tz(d) with theta = theta_0 + sum(c_theta q_j) and
d = d_0 + sum(c_d q_j). Each pair (c_theta, c_d) of one joint in one element is an entry.
"""

import logging
import math
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Function = TypeVar('Function', bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """
    Return `function` compiled by numba, cached on disk where a place for it can be written.

    """
    try:
        return numba.njit(cache=True, **_OPTIONS)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:  # numba's "no locator available": nowhere to write
        if not _uncached:
            logging.getLogger(__name__).warning(
                'no writable place for the compiled kernel (%s): compiling it at each start; '
                'set NUMBA_CACHE_DIR to a writable directory to avoid that',
                error,
            )
        _uncached.append(function.__name__)
        return numba.njit(**_OPTIONS)(function)  # type: ignore[no-any-return]


def is_being_compiled() -> bool:
    """
    Return whether the kernel was not in the cache of this machine, so that it is or was compiled.

    """
    stats = getattr(evaluate, 'stats', None)  # with NUMBA_DISABLE_JIT=1 it is a plain function
    return stats is not None and bool(stats.cache_misses)


# 'contract' lets a product and a sum be one rounded operation; nothing else is given up.
_OPTIONS: dict[str, Any] = {'nogil': True, 'fastmath': {'contract'}}
_uncached: list[str] = []

# Where things stand in Chain.integers and in a row of results.
JOINTS, ELEMENTS, ENTRIES, FRAMES, ONE_TO_ONE, SCREWS_AT, FRAMES_AT, WIDTH = range(8)
CHAIN_HEADER = 8
POSE_AT, QUATERNION_AT, JACOBIAN_AT = 0, 16, 20

# How much of a row `evaluate` fills: each step includes the ones before it.
POSE, JACOBIAN, ALL_FRAMES = range(3)

# Task.integers
ROWS, GENERIC_RANK, SQUARE = range(3)
TASK_HEADER = 3

# A row of measures: these scalars, then lost_direction (6), joint_motion (n), way_out (n), sigma.
(
    DETERMINANT,
    MANIPULABILITY,
    CONDITION_NUMBER,
    SMALLEST_SINGULAR_VALUE,
    DISTANCE,
    RANK,
) = range(6)
LOST_AT = 6

# Operations of a factor's tape (factors.py): operands are earlier steps, or a joint.
(
    CONSTANT,
    JOINT,
    SUM,
    DIFFERENCE,
    PRODUCT,
    QUOTIENT,
    NEGATIVE,
    SINE,
    COSINE,
    SQUARE_ROOT,
    ARC_TANGENT,
) = range(11)

# A singular value below this share of the largest counts as zero (rank, distance).
# Round-off of J is some 1e-15; the golden data uses the same share.
RANK_TOLERANCE = 1e-10

# Sweeps of one-sided Jacobi; six rows of 6 to 96 numbers were seen to need at most eight.
MAX_SWEEPS = 60
# Two columns are orthogonal when |a.b| <= this times |a||b|: half a digit above round-off.
ORTHOGONAL = 1e-15


# Sine and cosine together in two fifths of the time of two calls of the C library. Coefficients
# and parts of pi/2 from fdlibm (Sun Microsystems 1993: k_sin.c, k_cos.c, e_rem_pio2.c).
SIN_3, SIN_5, SIN_7 = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
)
SIN_9, SIN_11, SIN_13 = (
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
COS_4, COS_6, COS_8 = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
)
COS_10, COS_12, COS_14 = (
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
TWO_BY_PI = 6.36619772367581382433e-01
HALF_PI_1 = 1.57079632673412561417e00
HALF_PI_2 = 6.07710050630396597660e-11
HALF_PI_3 = 2.02226624879595063154e-21
# Up to here the number of quarter turns has 17 bits, and its product with a part is exact.
LARGEST_REDUCED = 1e5


@compiled
def _sincos(x: float) -> Any:
    if not abs(x) <= LARGEST_REDUCED:
        if not math.isfinite(x):  # a sum of huge angles; plain Python would raise here
            return math.nan, math.nan
        return math.sin(x), math.cos(x)
    turns = math.floor(x * TWO_BY_PI + 0.5)
    first = x - turns * HALF_PI_1
    second = turns * HALF_PI_2
    r = first - second
    rest = turns * HALF_PI_3 - ((first - r) - second)
    y = r - rest
    tail = (r - y) - rest
    z = y * y
    p = SIN_5 + z * (SIN_7 + z * (SIN_9 + z * (SIN_11 + z * SIN_13)))
    sine = y - ((z * (0.5 * tail - z * y * p) - tail) - z * y * SIN_3)
    p = z * (COS_4 + z * (COS_6 + z * (COS_8 + z * (COS_10 + z * (COS_12 + z * COS_14)))))
    half = 0.5 * z
    w = 1.0 - half
    cosine = w + (((1.0 - w) - half) + (z * p - y * tail))
    # Selections, not branches: which quarter it is cannot be predicted.
    quarter = int(turns)
    if quarter & 1:
        sine, cosine = cosine, sine
    sign = 1.0 - (quarter & 2)
    other = 1.0 - ((quarter + 1) & 2)
    return sign * sine, other * cosine


@compiled
def _times(T: Any, numbers: Floats, at: int) -> Any:
    # The product of a rigid motion T (twelve numbers, row by row) and the constant one at `at`.
    a, b, c, p, d, e, f, q, g, h, i, r = T
    A, B, C, P = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3]
    D, E, F, Q = numbers[at + 4], numbers[at + 5], numbers[at + 6], numbers[at + 7]
    G, H, I, R = numbers[at + 8], numbers[at + 9], numbers[at + 10], numbers[at + 11]
    return (
        a * A + b * D + c * G,
        a * B + b * E + c * H,
        a * C + b * F + c * I,
        a * P + b * Q + c * R + p,
        d * A + e * D + f * G,
        d * B + e * E + f * H,
        d * C + e * F + f * I,
        d * P + e * Q + f * R + q,
        g * A + h * D + i * G,
        g * B + h * E + i * H,
        g * C + h * F + i * I,
        g * P + h * Q + i * R + r,
    )


@compiled
def _constant(numbers: Floats, at: int) -> Any:
    return (
        numbers[at],
        numbers[at + 1],
        numbers[at + 2],
        numbers[at + 3],
        numbers[at + 4],
        numbers[at + 5],
        numbers[at + 6],
        numbers[at + 7],
        numbers[at + 8],
        numbers[at + 9],
        numbers[at + 10],
        numbers[at + 11],
    )


@compiled
def _write_motion(T: Any, rows: Floats, k_row: int, at: int) -> None:
    for k in range(12):
        rows[k_row, at + k] = T[k]
    rows[k_row, at + 12] = 0.0
    rows[k_row, at + 13] = 0.0
    rows[k_row, at + 14] = 0.0
    rows[k_row, at + 15] = 1.0


@compiled
def _write_quaternion(T: Any, rows: Floats, k_row: int, at: int) -> None:
    # Unit quaternion x y z w of the rotation in T, from its largest component (Shepperd, 1978:
    # no cancellation anywhere), normalised, w >= 0.
    xx, xy, xz, _, yx, yy, yz, _, zx, zy, zz, _ = T
    if xx + yy + zz > 0.0:
        x, y, z, w = zy - yz, xz - zx, yx - xy, 1.0 + xx + yy + zz
    elif xx >= yy and xx >= zz:
        x, y, z, w = 1.0 + xx - yy - zz, xy + yx, xz + zx, zy - yz
    elif yy >= zz:
        x, y, z, w = xy + yx, 1.0 - xx + yy - zz, yz + zy, xz - zx
    else:
        x, y, z, w = xz + zx, yz + zy, 1.0 - xx - yy + zz, yx - xy
    scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
    if w < 0.0:
        scale = -scale
    rows[k_row, at] = x * scale
    rows[k_row, at + 1] = y * scale
    rows[k_row, at + 2] = z * scale
    rows[k_row, at + 3] = w * scale


@compiled
def _evaluate_one(
    integers: Integers,
    numbers: Floats,
    q: Floats,
    qdot: Floats,
    depth: int,
    rows: Floats,
    k_row: int,
    k_rate: int,
) -> None:
    n = integers[JOINTS]
    elements = integers[ELEMENTS]
    entries = integers[ENTRIES]
    screws = integers[SCREWS_AT]
    first_entry = CHAIN_HEADER  # of each element, and one past the last
    entry_joint = first_entry + elements + 1
    frame_parent = entry_joint + entries
    theta_0 = 12 * (elements + 1)
    d_0 = theta_0 + elements
    c_theta = d_0 + elements
    c_d = c_theta + entries
    frame_offset = c_d + entries

    frames = integers[FRAMES] if depth >= ALL_FRAMES else 0
    frames_at = integers[FRAMES_AT]
    frame = 0
    while frame < frames and integers[frame_parent + frame] < 0:
        _write_motion(
            _constant(numbers, frame_offset + 12 * frame), rows, k_row, frames_at + 16 * frame
        )
        frame += 1

    T = _constant(numbers, 0)
    for k in range(elements):
        theta = numbers[theta_0 + k]
        d = numbers[d_0 + k]
        begin, end = integers[first_entry + k], integers[first_entry + k + 1]
        for e in range(begin, end):
            q_j = q[k_row, integers[entry_joint + e]]
            theta += numbers[c_theta + e] * q_j
            d += numbers[c_d + e] * q_j
        s, c = _sincos(theta)
        xx, xy, xz, px, yx, yy, yz, py, zx, zy, zz, pz = T
        if depth >= JACOBIAN:
            # The axis and its point; they become the screw below, once the tool is known.
            for e in range(begin, end):
                rows[k_row, screws + e] = px
                rows[k_row, screws + entries + e] = py
                rows[k_row, screws + 2 * entries + e] = pz
                rows[k_row, screws + 3 * entries + e] = xz
                rows[k_row, screws + 4 * entries + e] = yz
                rows[k_row, screws + 5 * entries + e] = zz
        T = (
            xx * c + xy * s,
            xy * c - xx * s,
            xz,
            px + xz * d,
            yx * c + yy * s,
            yy * c - yx * s,
            yz,
            py + yz * d,
            zx * c + zy * s,
            zy * c - zx * s,
            zz,
            pz + zz * d,
        )
        while frame < frames and integers[frame_parent + frame] == k:
            offset = frame_offset + 12 * frame
            _write_motion(_times(T, numbers, offset), rows, k_row, frames_at + 16 * frame)
            frame += 1
        T = _times(T, numbers, 12 * (k + 1))

    _write_motion(T, rows, k_row, POSE_AT)
    _write_quaternion(T, rows, k_row, QUATERNION_AT)
    if depth < JACOBIAN:
        return

    tool_x, tool_y, tool_z = T[3], T[7], T[11]
    for e in range(entries):
        zx, zy, zz = (
            rows[k_row, screws + 3 * entries + e],
            rows[k_row, screws + 4 * entries + e],
            rows[k_row, screws + 5 * entries + e],
        )
        x = tool_x - rows[k_row, screws + e]
        y = tool_y - rows[k_row, screws + entries + e]
        z = tool_z - rows[k_row, screws + 2 * entries + e]
        by_theta, by_d = numbers[c_theta + e], numbers[c_d + e]
        rows[k_row, screws + e] = by_theta * (zy * z - zz * y) + by_d * zx
        rows[k_row, screws + entries + e] = by_theta * (zz * x - zx * z) + by_d * zy
        rows[k_row, screws + 2 * entries + e] = by_theta * (zx * y - zy * x) + by_d * zz
        rows[k_row, screws + 3 * entries + e] = by_theta * zx
        rows[k_row, screws + 4 * entries + e] = by_theta * zy
        rows[k_row, screws + 5 * entries + e] = by_theta * zz
    if integers[ONE_TO_ONE] == 0:
        for k in range(JACOBIAN_AT, JACOBIAN_AT + 6 * n):
            rows[k_row, k] = 0.0
        for e in range(entries):
            j = JACOBIAN_AT + integers[entry_joint + e]
            for i in range(6):
                rows[k_row, j + i * n] += rows[k_row, screws + i * entries + e]
    twist = JACOBIAN_AT + 6 * n
    for i in range(6):
        rate = 0.0
        for j in range(n):
            rate += rows[k_row, JACOBIAN_AT + i * n + j] * qdot[k_rate, j]
        rows[k_row, twist + i] = rate


@compiled
def evaluate(
    integers: Integers, numbers: Floats, q: Floats, qdot: Floats, depth: int, rows: Floats
) -> int:
    """
    Fill `rows` with pose, quaternion, Jacobian, twist and frames of each q: one pass a row.

    Returns -1, or the index where it stopped: of the first q or qdot that is not finite, or too
    large for finite results.

    Parameters
    ----------
    integers, numbers
        `Chain.integers` and `Chain.numbers`.
    q, qdot : shape (N, n) and (N, n) or (1, n), rad or m, rad/s or m/s
        One row of `qdot` serves every row of `q`.
    depth
        POSE, JACOBIAN (with the twist and the screws) or ALL_FRAMES.
    rows : shape (N, width)
        Results, in the base frame: pose 4 x 4 at POSE_AT, quaternion x y z w at QUATERNION_AT, J
        (6, n) at JACOBIAN_AT, twist (6,) after it, the screws of the entries (6, entries) at
        integers[SCREWS_AT], frames 4 x 4 each at integers[FRAMES_AT]. Rows of J and the twist:
        vx vy vz wx wy wz of the tool's origin.

    """
    step = 0 if qdot.shape[0] == 1 else 1
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            if not (math.isfinite(q[k, j]) and math.isfinite(qdot[k * step, j])):
                return k
        # Arrays and indices rather than slices: a slice costs reference counting.
        _evaluate_one(integers, numbers, q, qdot, depth, rows, k, k * step)
        total = rows[k, 3] + rows[k, 7] + rows[k, 11]
        if depth >= JACOBIAN:
            for i in range(JACOBIAN_AT, JACOBIAN_AT + 6 * integers[JOINTS] + 6):
                total += rows[k, i]
        if not math.isfinite(total):
            return k
    return -1


@compiled
def evaluate_one(
    integers: Integers, numbers: Floats, q: Floats, qdot: Floats, depth: int, row: Floats
) -> int:
    """
    Fill one row: `evaluate` for q (n,), qdot (n,) and row (width,), without reshaping in Python.

    """
    return evaluate(
        integers, numbers, q.reshape(1, -1), qdot.reshape(1, -1), depth, row.reshape(1, -1)
    )


@compiled
def quaternions(poses: Floats, quaternions_xyzw: Floats) -> None:
    """
    Fill `quaternions_xyzw` (N, 4) with the unit quaternions, w >= 0, of poses (N, 4, 4).

    """
    for k in range(poses.shape[0]):
        P = poses[k]
        T = (
            P[0, 0],
            P[0, 1],
            P[0, 2],
            P[0, 3],
            P[1, 0],
            P[1, 1],
            P[1, 2],
            P[1, 3],
            P[2, 0],
            P[2, 1],
            P[2, 2],
            P[2, 3],
        )
        _write_quaternion(T, quaternions_xyzw, k, 0)


@compiled
def _orthogonalise(A: Floats, V: Floats, count: int, length: int) -> None:
    # One-sided Jacobi (Hestenes, 1958): turns the `count` rows of A, `length` numbers each, until
    # they are orthogonal, and turns V (count x count, the identity at first) along with them.
    # Small singular values keep all their digits, which eigenvalues of A A^T do not.
    for _ in range(MAX_SWEEPS):
        turned = False
        for i in range(count - 1):
            for j in range(i + 1, count):
                aa, bb, ab = 0.0, 0.0, 0.0
                for k in range(length):
                    aa += A[i, k] * A[i, k]
                    bb += A[j, k] * A[j, k]
                    ab += A[i, k] * A[j, k]
                if ab * ab <= (ORTHOGONAL * ORTHOGONAL) * aa * bb or ab == 0.0:
                    continue
                turned = True
                zeta = (bb - aa) / (2.0 * ab)
                t = 1.0 / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                if zeta < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for k in range(length):
                    x, y = A[i, k], A[j, k]
                    A[i, k] = c * x - s * y
                    A[j, k] = s * x + c * y
                for k in range(count):
                    x, y = V[i, k], V[j, k]
                    V[i, k] = c * x - s * y
                    V[j, k] = s * x + c * y
        if not turned:
            return


@compiled
def _sort_by_norm(A: Floats, V: Floats, sigma: Floats, count: int, length: int) -> None:
    # Singular values, descending, with the rows of A and V in the same order.
    for i in range(count):
        squares = 0.0
        for k in range(length):
            squares += A[i, k] * A[i, k]
        sigma[i] = math.sqrt(squares)
    for i in range(count - 1):
        best = i
        for j in range(i + 1, count):
            if sigma[j] > sigma[best]:
                best = j
        if best != i:
            sigma[i], sigma[best] = sigma[best], sigma[i]
            for k in range(length):
                A[i, k], A[best, k] = A[best, k], A[i, k]
            for k in range(count):
                V[i, k], V[best, k] = V[best, k], V[i, k]


@compiled
def _unit_rows(A: Floats, sigma: Floats, count: int, length: int) -> None:
    # Makes the rows of A unit vectors. A row that is round-off has lost its direction: it is
    # replaced by one orthogonal to the rows above it, made from the axis they use least.
    for i in range(count):
        if sigma[i] > RANK_TOLERANCE * sigma[0] and sigma[i] > 0.0:
            for k in range(length):
                A[i, k] /= sigma[i]
            continue
        axis, least = 0, 2.0
        for k in range(length):
            used = 0.0
            for j in range(i):
                used += A[j, k] * A[j, k]
            if used < least - 1e-9:
                axis, least = k, used
        for k in range(length):
            A[i, k] = 0.0
        A[i, axis] = 1.0
        for _ in range(2):  # twice is enough (Kahan)
            for j in range(i):
                along = 0.0
                for k in range(length):
                    along += A[i, k] * A[j, k]
                for k in range(length):
                    A[i, k] -= along * A[j, k]
        norm = 0.0
        for k in range(length):
            norm += A[i, k] * A[i, k]
        norm = math.sqrt(norm)
        for k in range(length):
            A[i, k] /= norm


@compiled
def _determinant(A: Floats, size: int) -> float:
    # By elimination with partial pivoting; A is overwritten.
    determinant = 1.0
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(A[j, i]) > abs(A[pivot, i]):
                pivot = j
        if A[pivot, i] == 0.0:
            return 0.0
        if pivot != i:
            determinant = -determinant
            for k in range(i, size):
                A[i, k], A[pivot, k] = A[pivot, k], A[i, k]
        determinant *= A[i, i]
        for j in range(i + 1, size):
            factor = A[j, i] / A[i, i]
            for k in range(i + 1, size):
                A[j, k] -= factor * A[i, k]
    return determinant


@compiled
def _gradient(integers: Integers, row: Floats, Y: Floats, gradient: Floats) -> None:
    # gradient[k] = sum_j Y[j] . dJ[:, j]/dq_k for the geometric Jacobian (Y in base axes).
    # A joint f turns everything behind it by its screw (v_f, w_f) and moves the tool under
    # everything before it: for an entry e behind f (or f itself) dv_e = w_f x v_e and
    # dw_e = w_f x w_e; for one before it dv_e = w_e x v_f. So
    # g_f = w_f . sum_behind(v_e x Yv + w_e x Yw) + v_f . sum_before(Yv x w_e): two running sums.
    n = integers[JOINTS]
    elements = integers[ELEMENTS]
    entries = integers[ENTRIES]
    screws = integers[SCREWS_AT]
    first_entry = CHAIN_HEADER
    entry_joint = first_entry + elements + 1
    for j in range(n):
        gradient[j] = 0.0
    bx, by, bz = 0.0, 0.0, 0.0
    for k in range(elements):
        begin, end = integers[first_entry + k], integers[first_entry + k + 1]
        for e in range(begin, end):
            gradient[integers[entry_joint + e]] += (
                row[screws + e] * bx
                + row[screws + entries + e] * by
                + row[screws + 2 * entries + e] * bz
            )
        for e in range(begin, end):
            j = integers[entry_joint + e]
            wx = row[screws + 3 * entries + e]
            wy = row[screws + 4 * entries + e]
            wz = row[screws + 5 * entries + e]
            bx += Y[j, 1] * wz - Y[j, 2] * wy
            by += Y[j, 2] * wx - Y[j, 0] * wz
            bz += Y[j, 0] * wy - Y[j, 1] * wx
    ax, ay, az = 0.0, 0.0, 0.0
    for k in range(elements - 1, -1, -1):
        begin, end = integers[first_entry + k], integers[first_entry + k + 1]
        for e in range(begin, end):
            j = integers[entry_joint + e]
            vx = row[screws + e]
            vy = row[screws + entries + e]
            vz = row[screws + 2 * entries + e]
            wx = row[screws + 3 * entries + e]
            wy = row[screws + 4 * entries + e]
            wz = row[screws + 5 * entries + e]
            ax += vy * Y[j, 2] - vz * Y[j, 1] + wy * Y[j, 5] - wz * Y[j, 4]
            ay += vz * Y[j, 0] - vx * Y[j, 2] + wz * Y[j, 3] - wx * Y[j, 5]
            az += vx * Y[j, 1] - vy * Y[j, 0] + wx * Y[j, 4] - wy * Y[j, 3]
        for e in range(begin, end):
            gradient[integers[entry_joint + e]] += (
                row[screws + 3 * entries + e] * ax
                + row[screws + 4 * entries + e] * ay
                + row[screws + 5 * entries + e] * az
            )


@compiled
def _to_base_axes(task_numbers: Floats, vector: Floats) -> None:
    # Turns both halves of a (6,) vector from the axes of frame 0 into those of the base frame.
    for half in range(2):
        x, y, z = vector[3 * half], vector[3 * half + 1], vector[3 * half + 2]
        for i in range(3):
            vector[3 * half + i] = (
                task_numbers[3 * i] * x + task_numbers[3 * i + 1] * y + task_numbers[3 * i + 2] * z
            )


@compiled
def _measure_one(
    integers: Integers,
    task_integers: Integers,
    task_numbers: Floats,
    row: Floats,
    measures: Floats,
) -> None:
    n = integers[JOINTS]
    m = task_integers[ROWS]
    generic_rank = task_integers[GENERIC_RANK]
    row_scale = 9
    column_scale = row_scale + m
    count = min(m, n)
    length = max(m, n)
    wide = n > m
    motion_at = LOST_AT + 6
    way_at = motion_at + n
    sigma_at = way_at + n

    # J_t: the task's rows of J in the axes of frame 0 (R0^T J), unscaled.
    J = np.empty((m, n))
    for i in range(m):
        axis = task_integers[TASK_HEADER + i]
        half, component = axis // 3, axis % 3
        at = JACOBIAN_AT + 3 * half * n
        for j in range(n):
            J[i, j] = (
                task_numbers[component] * row[at + j]
                + task_numbers[3 + component] * row[at + n + j]
                + task_numbers[6 + component] * row[at + 2 * n + j]
            )

    # A holds, row by row, what Jacobi makes orthogonal: columns of the scaled J_t, or its rows
    # where there are fewer of them. Then J_t scaled = sum_i sigma_i left_i right_i^T.
    A = np.empty((count, length))
    V = np.zeros((count, count))
    for i in range(m):
        for j in range(n):
            scaled = J[i, j] * task_numbers[row_scale + i] * task_numbers[column_scale + j]
            if wide:
                A[i, j] = scaled
            else:
                A[j, i] = scaled
    for i in range(count):
        V[i, i] = 1.0
    sigma = np.empty(count)
    _orthogonalise(A, V, count, length)
    _sort_by_norm(A, V, sigma, count, length)

    rank = 0
    for i in range(count):
        measures[sigma_at + i] = sigma[i]
        if sigma[i] > RANK_TOLERANCE * sigma[0]:
            rank += 1
    last = generic_rank - 1
    smallest = sigma[last]
    measures[RANK] = rank
    measures[SMALLEST_SINGULAR_VALUE] = smallest
    measures[CONDITION_NUMBER] = sigma[0] / smallest if smallest > 0.0 else math.inf

    # Before the elimination below overwrites J: the product of unscaled singular values.
    structural = generic_rank < count
    if structural or m != n:
        B = np.empty((count, length))
        turn = np.zeros((count, count))
        for i in range(m):
            for j in range(n):
                if wide:
                    B[i, j] = J[i, j]
                else:
                    B[j, i] = J[i, j]
        unscaled = np.empty(count)
        _orthogonalise(B, turn, count, length)
        _sort_by_norm(B, turn, unscaled, count, length)
        product = 1.0
        for i in range(generic_rank):
            product *= unscaled[i]
        # With fewer joints than rows the Gram determinant of the joints' columns.
        measures[MANIPULABILITY] = product
    measures[DETERMINANT] = math.nan
    if task_integers[SQUARE] == 1:
        measures[DETERMINANT] = 0.0 if structural else _determinant(J, m)
        if not structural:
            measures[MANIPULABILITY] = abs(measures[DETERMINANT])

    _unit_rows(A, sigma, count, length)
    lost = rank <= last  # of the directions that other poses have
    Y = np.zeros((n, 6))
    for j in range(n):
        for r in range(last if lost else 0, generic_rank):
            weight = 1.0 if lost else 1.0 / sigma[r]
            right = A[r, j] if wide else V[r, j]
            right *= weight * task_numbers[column_scale + j]
            for i in range(m):
                left = V[r, i] if wide else A[r, i]
                axis = task_integers[TASK_HEADER + i]
                Y[j, axis] += right * left * task_numbers[row_scale + i]
        _to_base_axes(task_numbers, Y[j])
    gradient = np.empty(n)
    _gradient(integers, row, Y, gradient)
    squares = 0.0
    for j in range(n):
        gradient[j] *= task_numbers[column_scale + j]
        squares += gradient[j] * gradient[j]
    norm = math.sqrt(squares)
    if lost:
        measures[DISTANCE] = 0.0
    else:
        measures[DISTANCE] = math.pi if norm * math.pi <= 1.0 else 1.0 / norm

    for i in range(6):
        measures[LOST_AT + i] = 0.0
    for i in range(m):
        axis = task_integers[TASK_HEADER + i]
        measures[LOST_AT + axis] = V[last, i] if wide else A[last, i]
    _to_base_axes(task_numbers, measures[LOST_AT : LOST_AT + 6])
    for j in range(n):
        scale = task_numbers[column_scale + j]
        measures[motion_at + j] = (A[last, j] if wide else V[last, j]) * scale
        measures[way_at + j] = gradient[j] / norm * scale if norm > 0.0 else 0.0


@compiled
def measure(
    integers: Integers,
    task_integers: Integers,
    task_numbers: Floats,
    rows: Floats,
    measures: Floats,
) -> None:
    """
    Fill `measures` with the singularity measures of each evaluated row (depth JACOBIAN or more).

    Parameters
    ----------
    integers
        `Chain.integers`.
    task_integers, task_numbers
        `Task.integers` and `Task.numbers`.
    rows : shape (N, width)
        As `evaluate` filled them.
    measures : shape (N, 6 + 6 + 2 n + min(m, n))
        Scalars DETERMINANT (NaN where J_t is not square) to RANK, the lost direction (6,) in base
        axes, the joint motion (n,) and the way out (n,) in rad or m, the singular values.

    """
    for k in range(rows.shape[0]):
        _measure_one(integers, task_integers, task_numbers, rows[k], measures[k])


@compiled
def _factor_step(
    operation: int, a: float, b: float, x: Floats, y: Floats, number: float, gradient: Floats
) -> float:
    # Value of one operation; its gradient is da * x + db * y.
    da, db, value = 0.0, 0.0, 0.0
    if operation == SUM:
        value, da, db = a + b, 1.0, 1.0
    elif operation == DIFFERENCE:
        value, da, db = a - b, 1.0, -1.0
    elif operation == PRODUCT:
        value, da, db = a * b, b, a
    elif operation == QUOTIENT:
        if b == 0.0:
            value, da, db = math.nan, math.nan, math.nan
        else:
            value, da, db = a / b, 1.0 / b, -a / (b * b)
    elif operation == NEGATIVE:
        value, da = -a, -1.0
    elif operation == SINE:
        s, c = _sincos(number * a)
        value, da = s, number * c
    elif operation == COSINE:
        s, c = _sincos(number * a)
        value, da = c, -number * s
    elif operation == SQUARE_ROOT:
        if a > 0.0:
            value = math.sqrt(a)
            da = 0.5 / value
        elif a < 0.0:
            value, da = math.nan, math.nan
    elif operation == ARC_TANGENT:
        squares = a * a + b * b
        value = math.atan2(a, b) / number
        if squares > 0.0:
            da, db = b / squares / number, -a / squares / number
    for j in range(gradient.size):
        gradient[j] = da * x[j] + db * y[j]
    return value


@compiled
def evaluate_factors(
    integers: Integers, numbers: Floats, ends: Integers, q: Floats, results: Floats
) -> None:
    """
    Fill `results` (N, factors, 1 + n) with value and gradient of each factor at q (N, n).

    Parameters
    ----------
    integers, numbers, ends
        The tape: operation and operands of each step, its constant or scale, the factors' steps.

    """
    steps, n = integers.shape[0], q.shape[1]
    values = np.empty(steps)
    gradients = np.empty((steps, n))
    for k in range(q.shape[0]):
        for i in range(steps):
            operation, first, second = integers[i, 0], integers[i, 1], integers[i, 2]
            if operation <= JOINT:
                for j in range(n):
                    gradients[i, j] = 0.0
                values[i] = numbers[i]
                if operation == JOINT:
                    values[i] = numbers[i] * q[k, first]
                    gradients[i, first] = numbers[i]
            else:
                values[i] = _factor_step(
                    operation,
                    values[first],
                    values[second],
                    gradients[first],
                    gradients[second],
                    numbers[i],
                    gradients[i],
                )
        for f in range(ends.size):
            results[k, f, 0] = values[ends[f]]
            for j in range(n):
                results[k, f, 1 + j] = gradients[ends[f], j]
