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
Bytes = npt.NDArray[np.uint8]
Function = TypeVar('Function', bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """
    Return `function` compiled by numba, cached on disk where a place for it can be written.

    """
    return _compiled_with(function, _OPTIONS)


def compiled_for_one(function: Function) -> Function:
    """
    Return `function` compiled for calls of a microsecond: it keeps the interpreter's lock.

    Letting go of it costs time, and another thread may then keep it for milliseconds.

    """
    return _compiled_with(function, {**_OPTIONS, 'nogil': False})


def compiled_to_the_letter(function: Function) -> Function:
    """
    Return `function` compiled so that its numbers are those of plain Python to the last bit.

    """
    return _compiled_with(function, _TO_THE_LETTER)


def _compiled_with(function: Function, options: dict[str, Any]) -> Function:
    try:
        return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:  # numba's "no locator available": nowhere to write
        if not _uncached:
            logging.getLogger(__name__).warning(
                'no writable place for the compiled kernel (%s): compiling it at each start; '
                'set NUMBA_CACHE_DIR to a writable directory to avoid that',
                error,
            )
        _uncached.append(function.__name__)
        return numba.njit(**options)(function)  # type: ignore[no-any-return]


def is_being_compiled() -> bool:
    """
    Return whether the kernel was not in the cache of this machine, so that it is or was compiled.

    """
    stats = getattr(evaluate, 'stats', None)  # with NUMBA_DISABLE_JIT=1 it is a plain function
    return stats is not None and bool(stats.cache_misses)


# 'contract' lets a product and a sum be one rounded operation; nothing else is given up.
# Divisors are looked at before, so numba need not look.
_OPTIONS: dict[str, Any] = {
    'nogil': True,
    'fastmath': {'contract'},
    'error_model': 'numpy',
}
_TO_THE_LETTER: dict[str, Any] = {'nogil': True, 'error_model': 'numpy'}
_uncached: list[str] = []

# Where things stand in Chain.integers and in a row of results.
JOINTS, ELEMENTS, ENTRIES, FRAMES, ONE_TO_ONE, SCREWS_AT, FRAMES_AT, WIDTH = range(8)
CHAIN_HEADER = 8
# integers[ONE_TO_ONE]: entries and joints differ; entry k is joint k; and each has an element of
# its own, with no more than a turn about x and a step along it up to the next one.
MIXED, PLAIN, TWISTED = range(3)
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
# After the singular values, where thresholds and factors are known: the watched measure, its level
# without hysteresis, the factor nearest to its zero; the distances of the factors in rad; value
# and gradient of each.
WATCHED, LEVEL, NEAREST = range(3)
JUDGED = 3

# An arm in one array (packed.py): these integers and numbers, then its parts.
(
    CHAIN_INTEGERS_AT,
    CHAIN_NUMBERS_AT,
    TASK_INTEGERS_AT,
    TASK_NUMBERS_AT,
    TAPE_STEPS,
    TAPE_AT,
    TAPE_NUMBERS_AT,
    FACTORS,
    FACTOR_ENDS_AT,
    FACTORS_COMPLETE,
    WATCHED_COLUMN,
    WARN,
    STOP,
) = range(13)
ARM_HEADER = 13

# The estimator's memory (joint_table.py): a header, then rows of n numbers or integers.
(
    TIMEOUT,
    VELOCITY_SOURCE,
    NEW_TOOL,
    LAST_QUATERNION,
) = range(4)
MEMORY_HEADER = 7
(
    POSITION,
    BEFORE,
    VELOCITY,
    DIFFERENCED,
    KNOWN,
    STAMP,
    STAMPED,
    ARRIVAL,
    WRAPS,
    JUMP_COUNT,
    JUMPS,
) = range(11)
JUMPS_KEPT = 16
MEMORY_ROWS = JUMPS + JUMPS_KEPT
# Where velocities come from: the message or else differences, the message only, differences only.
AUTO, FROM_MESSAGE, FROM_DIFFERENCE = range(3)
# What `observe` says of a message.
(
    SAID_WITHOUT_VELOCITIES,
    SAID_WITH_VELOCITIES,
    SAID_WITH_DIFFERENCES,
    BAD_POSITION,
    NOT_NEWER,
    INCOMPLETE,
    NOT_COMPUTABLE,
) = range(7)
# Added to it where the message was a new start.
STARTED_ANEW = 16
# After the q (n) and qdot (n) of a row of one pose: its quaternion once more, with any sign.
ROW_TAIL = 4

# At 1e15 rad neighbouring doubles are an eighth of a turn apart: such a number says nothing.
LARGEST = 1e15
# Evidence that two publishers disagree about a joint: it jumps by more than MOVED_APART (rad or m)
# and back to within a fifth of that, again and again within the window.
MOVED_APART = 1e-3
RETURNED = 0.2

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
# The largest squared cosine of a sweep after which none is needed any more: in the next one they
# are its squares, and where singular values are equal at most as large.
SETTLED = 1e-26


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
def _write_point_and_axis(T: Any, entries: int, rows: Floats, k_row: int, at: int) -> None:
    # Of an element, for one entry; they become the screw, once the tool is known.
    rows[k_row, at] = T[3]
    rows[k_row, at + entries] = T[7]
    rows[k_row, at + 2 * entries] = T[11]
    rows[k_row, at + 3 * entries] = T[2]
    rows[k_row, at + 4 * entries] = T[6]
    rows[k_row, at + 5 * entries] = T[10]


@compiled
def _times_screw(T: Any, theta: float, d: float) -> Any:
    xx, xy, xz, px, yx, yy, yz, py, zx, zy, zz, pz = T
    s, c = _sincos(theta)
    return (
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


@compiled
def _times_twist(T: Any, numbers: Floats, at: int) -> Any:
    # As `_times`, where the constant motion is a turn about x and a step along it.
    xx, xy, xz, px, yx, yy, yz, py, zx, zy, zz, pz = T
    a, c, s = numbers[at + 3], numbers[at + 5], numbers[at + 9]
    return (
        xx,
        xy * c + xz * s,
        xz * c - xy * s,
        px + xx * a,
        yx,
        yy * c + yz * s,
        yz * c - yy * s,
        py + yx * a,
        zx,
        zy * c + zz * s,
        zz * c - zy * s,
        pz + zx * a,
    )


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
    q_at: int,
    rate_at: int,
) -> float:
    # Fills a row; what it returns is finite if all of the row is. q and qdot begin in column q_at
    # and rate_at of their rows.
    n = integers[JOINTS]
    elements = integers[ELEMENTS]
    entries = integers[ENTRIES]
    screws = integers[SCREWS_AT]
    twisted = integers[ONE_TO_ONE] == TWISTED
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
        if twisted:
            q_k = q[k_row, q_at + k]
            theta += numbers[c_theta + k] * q_k
            d += numbers[c_d + k] * q_k
            if depth >= JACOBIAN:
                _write_point_and_axis(T, entries, rows, k_row, screws + k)
        else:
            begin, end = integers[first_entry + k], integers[first_entry + k + 1]
            for e in range(begin, end):
                q_j = q[k_row, q_at + integers[entry_joint + e]]
                theta += numbers[c_theta + e] * q_j
                d += numbers[c_d + e] * q_j
                if depth >= JACOBIAN:
                    _write_point_and_axis(T, entries, rows, k_row, screws + e)
        T = _times_screw(T, theta, d)
        while frame < frames and integers[frame_parent + frame] == k:
            offset = frame_offset + 12 * frame
            _write_motion(_times(T, numbers, offset), rows, k_row, frames_at + 16 * frame)
            frame += 1
        if twisted and k < elements - 1:
            T = _times_twist(T, numbers, 12 * (k + 1))
        else:
            T = _times(T, numbers, 12 * (k + 1))

    _write_motion(T, rows, k_row, POSE_AT)
    _write_quaternion(T, rows, k_row, QUATERNION_AT)
    tool_x, tool_y, tool_z = T[3], T[7], T[11]
    if depth < JACOBIAN:
        return float(tool_x + tool_y + tool_z)

    twist_x, twist_y, twist_z = 0.0, 0.0, 0.0
    turn_x, turn_y, turn_z = 0.0, 0.0, 0.0
    total = 0.0
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
        vx = by_theta * (zy * z - zz * y) + by_d * zx
        vy = by_theta * (zz * x - zx * z) + by_d * zy
        vz = by_theta * (zx * y - zy * x) + by_d * zz
        wx, wy, wz = by_theta * zx, by_theta * zy, by_theta * zz
        rows[k_row, screws + e] = vx
        rows[k_row, screws + entries + e] = vy
        rows[k_row, screws + 2 * entries + e] = vz
        rows[k_row, screws + 3 * entries + e] = wx
        rows[k_row, screws + 4 * entries + e] = wy
        rows[k_row, screws + 5 * entries + e] = wz
        rate = qdot[k_rate, rate_at + (e if twisted else integers[entry_joint + e])]
        twist_x += vx * rate
        twist_y += vy * rate
        twist_z += vz * rate
        turn_x += wx * rate
        turn_y += wy * rate
        turn_z += wz * rate
        total += (vx + vy) + (vz + wx) + (wy + wz)
    if integers[ONE_TO_ONE] == MIXED:
        for k in range(JACOBIAN_AT, JACOBIAN_AT + 6 * n):
            rows[k_row, k] = 0.0
        for e in range(entries):
            j = JACOBIAN_AT + integers[entry_joint + e]
            for i in range(6):
                rows[k_row, j + i * n] += rows[k_row, screws + i * entries + e]
    twist = JACOBIAN_AT + 6 * n
    rows[k_row, twist] = twist_x
    rows[k_row, twist + 1] = twist_y
    rows[k_row, twist + 2] = twist_z
    rows[k_row, twist + 3] = turn_x
    rows[k_row, twist + 4] = turn_y
    rows[k_row, twist + 5] = turn_z
    total += (twist_x + twist_y) + (twist_z + turn_x) + (turn_y + turn_z)
    return float(total + tool_x + tool_y + tool_z)


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
        if not math.isfinite(
            _evaluate_one(integers, numbers, q, qdot, depth, rows, k, k * step, 0, 0)
        ):
            return k
    return -1


@compiled_for_one
def evaluate_one(arm: Floats, q: Floats, qdot: Floats, row: Floats) -> int:
    """
    Fill one row as `evaluate` does, and after it q, qdot and, once more, the quaternion.

    Returns -1; 0 where a number is not finite or too large; -2 where q or qdot is not n long.

    Parameters
    ----------
    arm
        As packed.pack returns it.
    q, qdot : shape (n,) each
        Joint positions and velocities.
    row : shape (width + 2 n + ROW_TAIL,)
        Its length says how much of it is filled: a depth of `evaluate`. Few arguments, because a
        call spends as much on each of them as on a joint.

    """
    integers, numbers = _chain_of(arm)
    n = integers[JOINTS]
    if q.size != n or qdot.size != n:
        return -2
    at = row.size - 2 * n - ROW_TAIL
    for j in range(n):
        row[at + j] = q[j]
        row[at + n + j] = qdot[j]
    bad = _evaluate_tail(integers, numbers, row, at)
    for i in range(ROW_TAIL):
        row[at + 2 * n + i] = row[QUATERNION_AT + i]
    return bad


@compiled
def _chain_of(arm: Floats) -> Any:
    header = arm.view(np.int64)
    return (
        header[header[CHAIN_INTEGERS_AT] : header[CHAIN_NUMBERS_AT]],
        arm[header[CHAIN_NUMBERS_AT] : header[TASK_INTEGERS_AT]],
    )


@compiled
def _evaluate_tail(integers: Integers, numbers: Floats, row: Floats, at: int) -> int:
    # Evaluates a row at the q and qdot that stand in it from `at` on, which is its width.
    n = integers[JOINTS]
    nothing = 0.0
    for j in range(at, at + 2 * n):
        nothing += 0.0 * row[j]  # not a number where one of them is not finite
    depth = POSE
    if at == integers[WIDTH]:
        depth = ALL_FRAMES
    elif at == integers[FRAMES_AT]:
        depth = JACOBIAN
    rows = row.reshape(1, -1)
    total = _evaluate_one(integers, numbers, rows, rows, depth, rows, 0, 0, at, at + n)
    return -1 if math.isfinite(total + nothing) else 0


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
def _turn_pair(W: Floats, i: int, j: int, length: int, width: int) -> float:
    # Makes the first `length` numbers of rows i and j orthogonal by turning the rows, `width`
    # numbers each; returns the squared cosine of their angle before, 0 where they were orthogonal.
    aa, bb, ab = 0.0, 0.0, 0.0
    for k in range(length):
        x, y = W[i, k], W[j, k]
        aa += x * x
        bb += y * y
        ab += x * y
    square = ab * ab
    if square <= (ORTHOGONAL * ORTHOGONAL) * aa * bb or ab == 0.0:
        return 0.0
    # tan, cos and sin of the smaller of the two angles that do it.
    away = bb - aa
    root = math.sqrt(away * away + 4.0 * square)
    both = abs(away) + root
    t = 2.0 * abs(ab) / both
    if (away < 0.0) != (ab < 0.0):
        t = -t
    c = math.sqrt(0.5 * both / root)
    s = c * t
    for k in range(width):
        x, y = W[i, k], W[j, k]
        W[i, k] = c * x - s * y
        W[j, k] = s * x + c * y
    return square / (aa * bb)


@compiled
def _orthogonalise(W: Floats, count: int, length: int) -> None:
    # One-sided Jacobi (Hestenes, 1958): turns the `count` rows of A, the first `length` numbers of
    # the rows of W, until they are orthogonal, and the rows of V, the next `count` numbers and the
    # identity at first, along with them: side by side, so that one loop without a rest turns both.
    # Small singular values keep all their digits, which eigenvalues of A A^T do not.
    # The pairs of a sweep in the order of a tournament (Brent and Luk, 1985): neighbours in it
    # share no row, so that the processor works on several at once.
    last = count - 1 if count % 2 == 0 else count
    for _ in range(MAX_SWEEPS):
        worst = 0.0
        for turn in range(last):
            i, j = turn, last
            for _ in range((last + 1) // 2):
                if j < count:
                    turned = _turn_pair(W, min(i, j), max(i, j), length, length + count)
                    worst = max(worst, turned)
                i = i + 1 if i + 1 < last else 0
                j = turn if j == last else j
                j = j - 1 if j > 0 else last - 1
        # Convergence is quadratic at the end: the next sweep would find nothing to turn.
        if worst <= SETTLED:
            return


@compiled
def _sort_by_norm(W: Floats, sigma: Floats, count: int, length: int) -> None:
    # Singular values, descending, with the rows of A and V, side by side in W, in that order.
    for i in range(count):
        squares = 0.0
        for k in range(length):
            squares += W[i, k] * W[i, k]
        sigma[i] = math.sqrt(squares)
    for i in range(count - 1):
        best = i
        for j in range(i + 1, count):
            if sigma[j] > sigma[best]:
                best = j
        if best != i:
            sigma[i], sigma[best] = sigma[best], sigma[i]
            for k in range(length + count):
                W[i, k], W[best, k] = W[best, k], W[i, k]


@compiled
def _unit_rows(A: Floats, sigma: Floats, count: int, length: int) -> None:
    # Makes the rows of A unit vectors. A row that is round-off has lost its direction: it is
    # replaced by one orthogonal to the rows above it, made from the axis they use least.
    for i in range(count):
        if sigma[i] > RANK_TOLERANCE * sigma[0] and sigma[i] > 0.0:
            scale = 1.0 / sigma[i]
            for k in range(length):
                A[i, k] *= scale
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
def _to_base_axes(task_numbers: Floats, vectors: Floats, k: int) -> None:
    # Turns both halves of a (6,) vector from the axes of frame 0 into those of the base frame.
    for half in range(0, 6, 3):
        x, y, z = vectors[k, half], vectors[k, half + 1], vectors[k, half + 2]
        for i in range(3):
            vectors[k, half + i] = (
                task_numbers[3 * i] * x + task_numbers[3 * i + 1] * y + task_numbers[3 * i + 2] * z
            )


@compiled
def _fill_task_rows(
    integers: Integers,
    task_integers: Integers,
    task_numbers: Floats,
    row: Floats,
    W: Floats,
) -> None:
    # A becomes J_t in the axes of frame 0 (R0^T J), its columns as rows, or its rows where there
    # are fewer of them, and V the identity: side by side in W.
    n = integers[JOINTS]
    m = task_integers[ROWS]
    wide = n > m
    for i in range(m):
        axis = task_integers[TASK_HEADER + i]
        # No division: it would cost more than the rest of the row.
        component = axis if axis < 3 else axis - 3
        at = JACOBIAN_AT + (axis - component) * n
        a = task_numbers[component]
        b = task_numbers[3 + component]
        c = task_numbers[6 + component]
        for j in range(n):
            value = a * row[at + j] + b * row[at + n + j] + c * row[at + 2 * n + j]
            if wide:
                W[i, j] = value
            else:
                W[j, i] = value
    count, length = min(m, n), max(m, n)
    for i in range(count):
        for j in range(count):
            W[i, length + j] = 0.0
        W[i, length + i] = 1.0


@compiled
def _scale_task_rows(task_numbers: Floats, m: int, n: int, A: Floats) -> None:
    for i in range(m):
        for j in range(n):
            if n > m:
                A[i, j] *= task_numbers[9 + i] * task_numbers[9 + m + j]
            else:
                A[j, i] *= task_numbers[9 + i] * task_numbers[9 + m + j]


@compiled
def _measure_one(
    integers: Integers,
    task_integers: Integers,
    task_numbers: Floats,
    row: Floats,
    measures: Floats,
    work: Floats,
) -> None:
    n = integers[JOINTS]
    m = task_integers[ROWS]
    generic_rank = task_integers[GENERIC_RANK]
    column_scale = 9 + m
    count = min(m, n)
    length = max(m, n)
    wide = n > m
    motion_at = LOST_AT + 6
    way_at = motion_at + n
    sigma_at = way_at + n
    A = work[:count]  # and V beside it, from column `length` on
    Y = work[count : count + n]
    spare = count + n
    sigma = measures[sigma_at : sigma_at + count]

    structural = generic_rank < count
    measures[DETERMINANT] = math.nan
    # First unscaled, where the product of singular values is wanted and no determinant says it;
    # then scaled: J_t = sum_i sigma_i left_i right_i^T. One place for both: less to compile.
    for scaled in range(0 if structural or m != n else 1, 2):
        _fill_task_rows(integers, task_integers, task_numbers, row, A)
        if scaled == 1:
            if m == n and not structural:
                for i in range(m):
                    for j in range(n):
                        Y[i, j] = A[i, j]
                measures[DETERMINANT] = _determinant(Y, m)
            _scale_task_rows(task_numbers, m, n, A)
        # The largest first: fewer sweeps.
        _sort_by_norm(A, sigma, count, length)
        _orthogonalise(A, count, length)
        _sort_by_norm(A, sigma, count, length)
        if scaled == 0:
            # With fewer joints than rows the Gram determinant of the joints' columns.
            measures[MANIPULABILITY] = 1.0
            for i in range(generic_rank):
                measures[MANIPULABILITY] *= sigma[i]
    if m == n:
        if structural:
            measures[DETERMINANT] = 0.0
        else:
            measures[MANIPULABILITY] = abs(measures[DETERMINANT])

    rank = 0
    for i in range(count):
        if sigma[i] > RANK_TOLERANCE * sigma[0]:
            rank += 1
    last = generic_rank - 1
    smallest = sigma[last]
    measures[RANK] = rank
    measures[SMALLEST_SINGULAR_VALUE] = smallest
    measures[CONDITION_NUMBER] = sigma[0] / smallest if smallest > 0.0 else math.inf

    _unit_rows(A, sigma, count, length)
    lost = rank <= last  # of the directions that other poses have
    for j in range(n):
        for i in range(6):
            Y[j, i] = 0.0
    for i in range(6):
        work[spare, i] = 0.0
    for r in range(last if lost else 0, generic_rank):
        weight = 1.0 if lost else 1.0 / sigma[r]
        for i in range(m):
            left = A[r, length + i] if wide else A[r, i]
            work[spare, task_integers[TASK_HEADER + i]] = left * weight * task_numbers[9 + i]
        for j in range(n):
            right = (A[r, j] if wide else A[r, length + j]) * task_numbers[column_scale + j]
            for i in range(6):
                Y[j, i] += right * work[spare, i]
    for j in range(n):
        _to_base_axes(task_numbers, Y, j)
    gradient = measures[way_at : way_at + n]
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
        Y[0, i] = 0.0
    for i in range(m):
        axis = task_integers[TASK_HEADER + i]
        Y[0, axis] = A[last, length + i] if wide else A[last, i]
    _to_base_axes(task_numbers, Y, 0)
    for i in range(6):
        measures[LOST_AT + i] = Y[0, i]
    for j in range(n):
        scale = task_numbers[column_scale + j]
        measures[motion_at + j] = (A[last, j] if wide else A[last, length + j]) * scale
        measures[way_at + j] = gradient[j] / norm * scale if norm > 0.0 else 0.0


@compiled
def _judge_one(
    arm: Floats, row: Floats, q: Floats, measures: Floats, work: Floats, steps: Floats
) -> None:
    # The measures of a row, then the factors there, and the level without hysteresis.
    header = arm.view(np.int64)
    integers = header[header[CHAIN_INTEGERS_AT] : header[CHAIN_NUMBERS_AT]]
    task_integers = header[header[TASK_INTEGERS_AT] : header[TASK_NUMBERS_AT]]
    task_numbers = arm[header[TASK_NUMBERS_AT] : header[TAPE_AT]]
    _measure_one(integers, task_integers, task_numbers, row, measures, work)

    n = integers[JOINTS]
    factors = header[FACTORS]
    judged = LOST_AT + 6 + 2 * n + min(n, task_integers[ROWS])
    distances = judged + JUDGED
    nearest = 0
    if factors > 0:
        column_scale = 9 + task_integers[ROWS]
        results = distances + factors
        _run_tape(
            header[header[TAPE_AT] : header[TAPE_NUMBERS_AT]],
            arm[header[TAPE_NUMBERS_AT] : header[FACTOR_ENDS_AT]],
            q,
            steps,
        )
        for f in range(factors):
            end = header[header[FACTOR_ENDS_AT] + f]
            value, squares = steps[end, n], 0.0
            at = results + f * (1 + n)
            measures[at] = value
            for j in range(n):
                slope = steps[end, j]
                measures[at + 1 + j] = slope
                slope *= task_numbers[column_scale + j]
                squares += slope * slope
            measures[distances + f] = _distance_to_zero(value, math.sqrt(squares))
            if measures[distances + f] < measures[distances + nearest]:
                nearest = f
        # Factors do not suffer between two singular sets; where their product is the determinant
        # nothing else is needed.
        distance = measures[distances + nearest]
        estimate = measures[DISTANCE]
        if estimate != 0.0 and (header[FACTORS_COMPLETE] != 0 or not estimate < distance):
            measures[DISTANCE] = distance

    watched = abs(measures[header[WATCHED_COLUMN]])
    warn, stop = arm[WARN], arm[STOP]
    sign = 1.0 if stop < warn else -1.0
    level = 0
    if not sign * watched > sign * stop:
        level = 2
    elif not sign * watched > sign * warn:
        level = 1
    measures[judged + WATCHED] = watched
    measures[judged + LEVEL] = level
    measures[judged + NEAREST] = nearest


@compiled
def _distance_to_zero(value: float, slope: float) -> float:
    if value == 0.0:
        return 0.0
    return abs(value) / slope if abs(value) < math.pi * slope else math.pi


@compiled
def measure(arm: Floats, rows: Floats, q: Floats, measures: Floats) -> None:
    """
    Fill `measures` with the singularity measures of each evaluated row (depth JACOBIAN or more).

    Parameters
    ----------
    arm
        As packed.pack returns it.
    rows : shape (N, width)
        As `evaluate` filled them.
    q : shape (N, n), rad or m
        Where the rows were evaluated; read only where the arm has factors.
    measures : shape (N, 6 + 6 + 2 n + min(m, n) + 3 + F (2 + n))
        Scalars DETERMINANT (NaN where J_t is not square) to RANK, the lost direction (6,) in base
        axes, the joint motion (n,) and the way out (n,) in rad or m, the singular values; WATCHED
        to NEAREST, the distances to the zeros of the F factors, value and gradient of each.

    """
    header = arm.view(np.int64)
    n = header[header[CHAIN_INTEGERS_AT] + JOINTS]
    m = header[header[TASK_INTEGERS_AT] + ROWS]
    work = np.empty((min(m, n) + n + 1, max(m + n, 6)))
    steps = np.empty((header[TAPE_STEPS], n + 1))
    for k in range(rows.shape[0]):
        _judge_one(arm, rows[k], q[k], measures[k], work, steps)


@compiled_for_one
def measure_one(arm: Floats, row: Floats, measures: Floats) -> None:
    """
    Fill `measures` for one row, after which its q stands: as `evaluate_one` filled it.

    """
    header = arm.view(np.int64)
    n = header[header[CHAIN_INTEGERS_AT] + JOINTS]
    m = header[header[TASK_INTEGERS_AT] + ROWS]
    work = np.empty((min(m, n) + n + 1, max(m + n, 6)))
    steps = np.empty((header[TAPE_STEPS], n + 1))
    at = row.size - 2 * n - ROW_TAIL
    _judge_one(arm, row, row[at : at + n], measures, work, steps)


@compiled_for_one
def evaluate_and_measure_one(
    arm: Floats, q: Floats, qdot: Floats, row: Floats, measures: Floats
) -> int:
    """
    `evaluate_one`, then `measure_one`, in one call; returns what the first returns.

    """
    bad = evaluate_one(arm, q, qdot, row)
    if bad == -1:
        measure_one(arm, row, measures)
    return bad


@compiled
def _run_tape(integers: Integers, numbers: Floats, q: Floats, steps: Floats) -> None:
    # Gradient and, last, value of each step of a tape at q (n,): one row of `steps` each.
    n = q.size
    for i in range(numbers.size):
        operation, first, second = integers[3 * i], integers[3 * i + 1], integers[3 * i + 2]
        number = numbers[i]
        if operation <= JOINT:
            for j in range(n):
                steps[i, j] = 0.0
            steps[i, n] = number
            if operation == JOINT:
                steps[i, n] = number * q[first]
                steps[i, first] = number
            continue
        a, b = steps[first, n], steps[second, n]
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
        for j in range(n):
            steps[i, j] = da * steps[first, j] + db * steps[second, j]
        steps[i, n] = value


@compiled
def evaluate_factors(
    integers: Integers, numbers: Floats, ends: Integers, q: Floats, results: Floats
) -> None:
    """
    Fill `results` (N, factors, 1 + n) with value and gradient of each factor at q (N, n).

    Parameters
    ----------
    integers : shape (3 steps,), numbers : shape (steps,), ends : shape (factors,)
        The tape: operation and operands of each step, its constant or scale, the factors' steps.

    """
    n = q.shape[1]
    steps = np.empty((numbers.size, n + 1))
    for k in range(q.shape[0]):
        _run_tape(integers, numbers, q[k], steps)
        for f in range(ends.size):
            results[k, f, 0] = steps[ends[f], n]
            for j in range(n):
                results[k, f, 1 + j] = steps[ends[f], j]


@compiled_to_the_letter
def _shortest_angle(step: float) -> float:
    # math.remainder(step, 2 pi), exact as in C and Python; numba does not have it.
    size = abs(step)
    if not math.isfinite(size):
        return math.nan
    m = size if size < math.tau else size % math.tau
    c = math.tau - m
    if m < c:
        r = m
    elif m > c:
        r = -c
    else:
        r = m - 2.0 * ((0.5 * (size - m)) % math.tau)
    return math.copysign(1.0, step) * r


@compiled_to_the_letter
def _note_jump(memory: Floats, whole: Integers, n: int, j: int, arrival: int) -> None:
    count = whole[MEMORY_HEADER + JUMP_COUNT * n + j]
    whole[MEMORY_HEADER + (JUMPS + count % JUMPS_KEPT) * n + j] = arrival
    whole[MEMORY_HEADER + JUMP_COUNT * n + j] = count + 1


@compiled_to_the_letter
def _forget(memory: Floats, whole: Integers, n: int) -> None:
    for j in range(n):
        memory[MEMORY_HEADER + POSITION * n + j] = math.nan
        memory[MEMORY_HEADER + BEFORE * n + j] = math.nan
        memory[MEMORY_HEADER + VELOCITY * n + j] = math.nan
        whole[MEMORY_HEADER + DIFFERENCED * n + j] = 0
        whole[MEMORY_HEADER + KNOWN * n + j] = 0
        whole[MEMORY_HEADER + STAMPED * n + j] = 0
        whole[MEMORY_HEADER + JUMP_COUNT * n + j] = 0


@compiled_to_the_letter
def forget(memory: Floats) -> None:
    """
    Know nothing of any joint any more.

    """
    whole = memory.view(np.int64)
    _forget(memory, whole, (memory.size - MEMORY_HEADER) // MEMORY_ROWS)


@compiled_to_the_letter
def _note_late(
    memory: Floats,
    whole: Integers,
    layout: Integers,
    positions: Floats,
    stamp: int,
    arrival: int,
) -> None:
    # A publisher whose clock is behind another's is never accepted, but it may still disagree:
    # joints that an older message has where they cannot have been.
    n = (memory.size - MEMORY_HEADER) // MEMORY_ROWS
    ours = layout.size // 2
    for k in range(ours):
        j = layout[k]
        if whole[MEMORY_HEADER + KNOWN * n + j] == 0:
            continue
        velocity = memory[MEMORY_HEADER + VELOCITY * n + j]
        speed = 0.0 if math.isnan(velocity) else abs(velocity)
        moved = 2.0 * speed * abs(whole[MEMORY_HEADER + STAMP * n + j] - stamp) * 1e-9
        away = abs(positions[layout[ours + k]] - memory[MEMORY_HEADER + POSITION * n + j])
        if away > MOVED_APART + moved:
            _note_jump(memory, whole, n, j, arrival)


@compiled_to_the_letter
def _store(
    memory: Floats,
    whole: Integers,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    heard: bool,
    at: int,
    stamped: bool,
    arrival: int,
) -> None:
    # What a message says of our joints; `heard`: its velocities count. `at` is its time, ns.
    n = (memory.size - MEMORY_HEADER) // MEMORY_ROWS
    ours = layout.size // 2
    for k in range(ours):
        j, place = layout[k], layout[ours + k]
        position = positions[place]
        known = memory[MEMORY_HEADER + POSITION * n + j]
        jump = abs(position - known)
        back = abs(position - memory[MEMORY_HEADER + BEFORE * n + j])
        if jump > MOVED_APART and back < RETURNED * jump:
            _note_jump(memory, whole, n, j, arrival)
        velocity, differenced = math.nan, 0
        if heard:
            velocity = velocities[place]
        elif whole[VELOCITY_SOURCE] != FROM_MESSAGE:
            differenced = 1
            since = at - whole[MEMORY_HEADER + STAMP * n + j]
            if whole[MEMORY_HEADER + KNOWN * n + j] != 0 and 0 < since <= whole[TIMEOUT]:
                step = position - known
                if whole[MEMORY_HEADER + WRAPS * n + j] != 0:
                    step = _shortest_angle(step)
                velocity = step / (since * 1e-9)
                if not math.isfinite(velocity):
                    velocity = math.nan
        memory[MEMORY_HEADER + BEFORE * n + j] = known
        memory[MEMORY_HEADER + POSITION * n + j] = position
        memory[MEMORY_HEADER + VELOCITY * n + j] = velocity
        whole[MEMORY_HEADER + DIFFERENCED * n + j] = differenced
        whole[MEMORY_HEADER + KNOWN * n + j] = 1
        whole[MEMORY_HEADER + STAMP * n + j] = at
        whole[MEMORY_HEADER + STAMPED * n + j] = 1 if stamped else 0
        whole[MEMORY_HEADER + ARRIVAL * n + j] = arrival


@compiled_to_the_letter
def _merge(
    memory: Floats,
    whole: Integers,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    stamp: int,
    received: int,
    arrival: int,
) -> int:
    # What becomes of a message, as `observe` says it, but before any evaluation.
    n = (memory.size - MEMORY_HEADER) // MEMORY_ROWS
    ours = layout.size // 2
    for k in range(ours):
        if not abs(positions[layout[ours + k]]) <= LARGEST:
            return BAD_POSITION

    # Stamps of our joints must grow; a large step back is a new start, not an old message.
    anew = 0
    if stamp != 0:
        any_stamped, latest = False, 0
        for k in range(ours):
            j = layout[k]
            if whole[MEMORY_HEADER + STAMPED * n + j] != 0:
                at = whole[MEMORY_HEADER + STAMP * n + j]
                latest = max(latest, at) if any_stamped else at
                any_stamped = True
        if any_stamped and stamp <= latest:
            if latest - stamp <= whole[TIMEOUT]:
                _note_late(memory, whole, layout, positions, stamp, arrival)
                return NOT_NEWER
            _forget(memory, whole, n)
            whole[NEW_TOOL] = 1
            anew = STARTED_ANEW

    heard = whole[VELOCITY_SOURCE] != FROM_DIFFERENCE and velocities.size == positions.size
    if heard:
        for k in range(ours):
            if not abs(velocities[layout[ours + k]]) <= LARGEST:
                heard = False
    at = stamp if stamp != 0 else received
    _store(memory, whole, layout, positions, velocities, heard, at, stamp != 0, arrival)

    said = SAID_WITH_VELOCITIES
    for j in range(n):
        if (
            whole[MEMORY_HEADER + KNOWN * n + j] == 0
            or arrival - whole[MEMORY_HEADER + ARRIVAL * n + j] > whole[TIMEOUT]
        ):
            return INCOMPLETE + anew
        if math.isnan(memory[MEMORY_HEADER + VELOCITY * n + j]):
            said = SAID_WITHOUT_VELOCITIES
        elif whole[MEMORY_HEADER + DIFFERENCED * n + j] != 0 and said == SAID_WITH_VELOCITIES:
            said = SAID_WITH_DIFFERENCES
    return said + anew


@compiled_to_the_letter
def _continuous_quaternion(memory: Floats, whole: Integers, row: Floats, at: int) -> None:
    # Turned to the side of the last one, so that its sign is continuous from answer to answer.
    along = 0.0
    for i in range(4):
        along += row[QUATERNION_AT + i] * memory[LAST_QUATERNION + i]
    sign = -1.0 if whole[NEW_TOOL] == 0 and along < 0.0 else 1.0
    for i in range(4):
        row[at + i] = sign * row[QUATERNION_AT + i]
        memory[LAST_QUATERNION + i] = row[at + i]
    whole[NEW_TOOL] = 0


@compiled_for_one
def observe(
    arm: Floats,
    memory: Floats,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    stamp: int,
    received: int,
    arrival: int,
    row: Floats,
) -> int:
    """
    Take a message into the memory, and fill a row with the state it makes: all in one call.

    Returns SAID_WITHOUT_VELOCITIES to NOT_COMPUTABLE, plus STARTED_ANEW where its stamp stepped
    back so far that everything before was forgotten.

    Parameters
    ----------
    arm
        As packed.pack returns it.
    memory
        As joint_table.JointTable packs it.
    layout : shape (2 k,)
        Which k joints of ours the message names, then their places in it.
    positions, velocities : rad or m, rad/s or m/s
        Of the message; its velocities count where they are as many as its positions.
    stamp, received, arrival : ns
        As joint_sample.JointSample has them.
    row : shape (width + 2 n + ROW_TAIL,)
        As `evaluate_one` fills it, but the quaternion at its end with its sign continuous over
        time. Where the width is 0, q and qdot only.

    """
    whole = memory.view(np.int64)
    said = _merge(memory, whole, layout, positions, velocities, stamp, received, arrival)
    if said % STARTED_ANEW > SAID_WITH_DIFFERENCES:
        return said
    n = (memory.size - MEMORY_HEADER) // MEMORY_ROWS
    moving = said % STARTED_ANEW != SAID_WITHOUT_VELOCITIES
    at = row.size - 2 * n - ROW_TAIL
    for j in range(n):
        row[at + j] = memory[MEMORY_HEADER + POSITION * n + j]
        row[at + n + j] = memory[MEMORY_HEADER + VELOCITY * n + j] if moving else 0.0
    if at == 0:
        return said
    integers, numbers = _chain_of(arm)
    if _evaluate_tail(integers, numbers, row, at) >= 0:
        return NOT_COMPUTABLE + said // STARTED_ANEW * STARTED_ANEW
    _continuous_quaternion(memory, whole, row, at + 2 * n)
    return said


# What `observe_bytes` says of bytes it does not know: nothing was done.
NOT_THIS_FORM = -1
# A form (wire_form.py): where the stamp, positions and velocities stand in the bytes, how many of
# each there are, how many bytes there are, where the pattern begins, and, written by the call, the
# stamp in ns; then a layout; then the pattern: the bytes that select what must not change, and
# what stands there.
(
    FORM_STAMP,
    FORM_POSITIONS,
    FORM_VELOCITIES,
    FORM_COUNT,
    FORM_VELOCITY_COUNT,
    FORM_BYTES,
    FORM_PATTERN,
    FORM_NOW,
) = range(8)
FORM_HEADER = 8


@compiled_for_one
def observe_bytes(
    arm: Floats,
    memory: Floats,
    form: Integers,
    data: Bytes,
    arrival: int,
    row: Floats,
    measures: Floats,
    sheet: Floats,
) -> int:
    """
    Take a serialized message of a known form: `observe`, `measure_one`, `fill_sheet` in one call.

    Returns what `observe` returns, or NOT_THIS_FORM for bytes of another form and for a message
    without a stamp.

    Parameters
    ----------
    arm, memory, arrival, row
        As in `observe`.
    form
        See FORM_STAMP; FORM_NOW is written.
    data : shape (FORM_BYTES,)
        The message.
    measures
        As in `measure_one`.
    sheet
        As in `fill_sheet`.

    """
    size = data.size
    if form[FORM_BYTES] != size:
        return NOT_THIS_FORM
    pattern = form[form[FORM_PATTERN] :].view(np.uint8)
    other = np.uint8(0)
    for k in range(size):
        other |= (data[k] & pattern[k]) ^ pattern[size + k]
    if other != 0:
        return NOT_THIS_FORM
    at = form[FORM_STAMP]
    seconds = int(data[at : at + 4].view(np.int32)[0])
    stamp = seconds * 1_000_000_000 + int(data[at + 4 : at + 8].view(np.uint32)[0])
    if stamp == 0:
        return NOT_THIS_FORM
    form[FORM_NOW] = stamp
    positions = np.empty(form[FORM_COUNT])
    velocities = np.empty(form[FORM_VELOCITY_COUNT])
    _copy_doubles(data, form[FORM_POSITIONS], positions)
    _copy_doubles(data, form[FORM_VELOCITIES], velocities)
    layout = form[FORM_HEADER : form[FORM_PATTERN]]
    said = observe(arm, memory, layout, positions, velocities, stamp, 0, arrival, row)
    if said % STARTED_ANEW <= SAID_WITH_DIFFERENCES:
        measure_one(arm, row, measures)
        fill_sheet(sheet, stamp, row, measures)
    return said


# What a stamp's seconds can hold in a message: int32.
LARGEST_SECOND = 2**31 - 1


@compiled_for_one
def fill_sheet(sheet: Floats, stamp: int, row: Floats, measures: Floats) -> None:
    """
    Copy a stamp and numbers of a state to where serialized messages have them.

    Parameters
    ----------
    sheet
        Empty for nothing. Otherwise whole numbers, bit for bit: how many stamps, how many
        numbers, where in the sheet the stamps go (in units of four bytes), where the numbers come
        from (a place in `row`, or beyond its end in `measures`), and where in the sheet they go;
        then the messages.
    stamp : ns
        Beyond what a message can hold, the nearest it can.
    row, measures
        As `observe_bytes` fills them.

    """
    if sheet.size == 0:
        return
    places = sheet.view(np.int64)
    stamps, count = places[0], places[1]
    seconds = stamp // 1_000_000_000
    nanoseconds = stamp - seconds * 1_000_000_000
    seconds = max(-LARGEST_SECOND - 1, min(LARGEST_SECOND, seconds))
    words = sheet.view(np.int32)
    for k in range(2, 2 + stamps):
        words[places[k]] = seconds
        words[places[k] + 1] = nanoseconds
    sources = places[2 + stamps : 2 + stamps + count]
    targets = places[2 + stamps + count :]
    for k in range(count):
        source = sources[k]
        beyond = source - row.size
        sheet[targets[k]] = row[source] if beyond < 0 else measures[beyond]


@compiled_for_one
def _copy_doubles(data: Bytes, at: int, numbers: Floats) -> None:
    if numbers.size > 0:
        there = data[at : at + 8 * numbers.size].view(np.float64)
        for k in range(numbers.size):
            numbers[k] = there[k]


# Where the border of what a joint can reach is: a cosine beyond 1 by less is taken as 1, since the
# target may be that border in all but its last digits; what is not reached fails the proof after.
BORDER = 1e-6
# Two roots nearer than the square root of this are one to round-off.
APART = 1e-16
# Roots of a polynomial that should lie on the unit circle (or the real line): a double one is
# known to the square root of round-off, one of multiplicity four to its fourth root.
OFF_CIRCLE = 1e-3
# Coefficients, and squared lengths against those of the arm, below this share are zero.
NOTHING = 1e-12
ROOT_SWEEPS = 60

# Ways to the candidates (inverse/plan.py): what is asked of `inverse_candidates`.
POSITION_3, SPHERICAL_WRIST, PARALLEL_AXES = range(3)
# Most candidates there can be: 2 x 4 of three joints, doubled by a wrist.
MOST_CANDIDATES = 32


@compiled
def _dot(a: Any, b: Any) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _cross(a: Any, b: Any) -> Any:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@compiled
def _plus(a: Any, factor: float, b: Any) -> Any:
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


@compiled
def _three(table: Floats, k: int, at: int) -> Any:
    return (table[k, at], table[k, at + 1], table[k, at + 2])


@compiled
def _turned(axis: Any, angle: float, v: Any) -> Any:
    # Rodrigues.
    s, c = _sincos(angle)
    along = _dot(axis, v) * (1.0 - c)
    w = _cross(axis, v)
    return (
        c * v[0] + s * w[0] + along * axis[0],
        c * v[1] + s * w[1] + along * axis[1],
        c * v[2] + s * w[2] + along * axis[2],
    )


@compiled
def _moved(screws: Floats, k: int, value: float, point: Any) -> Any:
    # A point carried along by screw k: row k is its axis, a point on it, 1 where it slides.
    axis = _three(screws, k, 0)
    if screws[k, 6] > 0.5:
        return _plus(point, value, axis)
    origin = _three(screws, k, 3)
    return _plus(origin, 1.0, _turned(axis, value, _plus(point, -1.0, origin)))


@compiled
def _angle(axis: Any, a: Any, b: Any, otherwise: float) -> float:
    # By how much to turn a about the axis until it points where b does; `otherwise` if it is on
    # the axis, and any angle does.
    # First what is across the axis: near it, differences of products would be round-off alone.
    size = _dot(a, a)
    a = _plus(a, -_dot(axis, a), axis)
    b = _plus(b, -_dot(axis, b), axis)
    sine, cosine = _dot(axis, _cross(a, b)), _dot(a, b)
    if _dot(a, a) <= 1e-30 * size or (sine == 0.0 and cosine == 0.0):
        return otherwise
    return math.atan2(sine, cosine)


@compiled
def _circle_roots(A: float, B: float, C: float, roots: Floats) -> int:
    # Angles with A cos + B sin = C: their number, up to 2; -1 where every angle does.
    radius = math.hypot(A, B)
    if radius == 0.0 or radius <= 1e-14 * abs(C):
        return -1 if C == 0.0 else 0
    share = C / radius
    if abs(share) > 1.0 + BORDER:
        return 0
    middle = math.atan2(B, A)
    # Always two: where they meet, round-off would hide that other joints tell them apart.
    half = math.atan2(math.sqrt(max((1.0 - share) * (1.0 + share), APART)), share)
    roots[0] = middle + half
    roots[1] = middle - half
    return 2


@compiled
def _polynomial_roots(c: Any, degree: int, z: Any) -> None:
    # All roots of c[0] + ... + c[degree] z^degree, c[degree] not 0 (Aberth 1973, Ehrlich 1967).
    radius = 0.0
    for k in range(degree):
        radius = max(radius, (abs(c[k]) / abs(c[degree])) ** (1.0 / (degree - k)))
    for k in range(degree):
        turn = 2.0 * math.pi * k / degree + 0.4
        z[k] = radius * complex(math.cos(turn), math.sin(turn))
    if radius == 0.0:
        return
    for _ in range(ROOT_SWEEPS):
        largest = 0.0
        for k in range(degree):
            value, slope = c[degree], 0j
            for i in range(degree - 1, -1, -1):
                slope = slope * z[k] + value
                value = value * z[k] + c[i]
            if abs(value) == 0.0:
                continue
            others = 0j
            for i in range(degree):
                if i != k and z[i] != z[k]:
                    others += 1.0 / (z[k] - z[i])
            below = slope - value * others
            if abs(below) == 0.0:
                continue
            step = value / below
            z[k] -= step
            largest = max(largest, abs(step))
        if largest <= 4e-16 * radius:
            return


@compiled
def _constraints(screws: Floats, p: Any, F: Floats) -> None:
    # What joint 1 leaves of u, the point before it moves it to p: two conditions
    # F[k, 0] |u|^2 + F[k, 1:4] . u + F[k, 4] = 0, the origin being the point of axis 1.
    z1, z2 = _three(screws, 0, 0), _three(screws, 1, 0)
    if screws[0, 6] > 0.5:
        a = _cross(z1, z2)
        if _dot(a, a) < NOTHING:
            a = _cross(z1, (1.0, 0.0, 0.0) if abs(z1[0]) < 0.6 else (0.0, 1.0, 0.0))
        length = math.sqrt(_dot(a, a))
        a = (a[0] / length, a[1] / length, a[2] / length)
        b = _cross(z1, a)
        F[0, 0], F[1, 0] = 0.0, 0.0
        F[0, 4], F[1, 4] = -_dot(a, p), -_dot(b, p)
    else:
        a, b = z1, (0.0, 0.0, 0.0)
        F[0, 0], F[1, 0] = 0.0, 1.0
        F[0, 4], F[1, 4] = -_dot(z1, p), -_dot(p, p)
    for i in range(3):
        F[0, 1 + i], F[1, 1 + i] = a[i], b[i]


@compiled
def _left_over(F: Floats, k: int, u: Any) -> float:
    return float(F[k, 0] * _dot(u, u) + _dot(_three(F, k, 1), u) + F[k, 4])


@compiled
def _guide(F: Floats, k: int, z2: Any, o2: Any) -> Any:
    # Condition k turned by joint 2 is guide . v = `_wanted`, v the part of u across axis 2.
    guide = _plus(_three(F, k, 1), 2.0 * F[k, 0], o2)
    return _plus(guide, -_dot(guide, z2), z2)


@compiled
def _wanted(F: Floats, k: int, b: Any, across: float) -> float:
    return -float(_left_over(F, k, b) + F[k, 0] * across)


@compiled
def _eliminated(
    F: Floats, z2: Any, o2: Any, slides: bool, guides: Any, squares: Any, w: Any
) -> Any:
    # A number that is zero where joints 1 and 2 can bring w to the target, and the size of its
    # terms. It is of second degree in w, whose square is linear in the cosine and sine of joint 3.
    if slides:
        along = _dot(_three(F, 0, 1), z2)
        rest = _left_over(F, 0, w)
        if F[1, 0] == 0.0 or abs(along) <= 1e-9:
            return rest, abs(_dot(_three(F, 0, 1), w)) + abs(F[0, 4])
        u = _plus(w, -rest / along, z2)
        return along * along * _left_over(F, 1, u), along * along * (_dot(u, u) + abs(F[1, 4]))
    height = _dot(z2, _plus(w, -1.0, o2))
    b = _plus(o2, height, z2)
    v = _plus(w, -1.0, b)
    across = _dot(v, v)
    first, second = _wanted(F, 0, b, across), _wanted(F, 1, b, across)
    size_0 = abs(_dot(_three(F, 0, 1), b)) + abs(F[0, 4])
    size_1 = F[1, 0] * (_dot(b, b) + across) + abs(_dot(_three(F, 1, 1), b)) + abs(F[1, 4])
    if squares[0] == 0.0:
        return first, size_0
    if squares[1] == 0.0:
        return second, size_1
    value = first * first * squares[1] + second * second * squares[0]
    size = size_0 * size_0 * squares[1] + size_1 * size_1 * squares[0]
    product = across * squares[0] * squares[1]
    return value - product, size + product


@compiled
def _third_joint(
    screws: Floats, point: Any, F: Floats, guides: Any, squares: Any, scale: float, roots: Floats
) -> int:
    # Positions of joint 3 at which joints 1 and 2 can do the rest; -1 where any does.
    z2, o2 = _three(screws, 1, 0), _three(screws, 1, 3)
    slides_2, slides_3 = screws[1, 6] > 0.5, screws[2, 6] > 0.5
    g = np.empty(5)
    size = 0.0
    for j in range(5):
        x = scale * (j - 2.0) if slides_3 else 2.0 * math.pi * j / 5.0
        w = _moved(screws, 2, x, point)
        g[j], terms = _eliminated(F, z2, o2, slides_2, guides, squares, w)
        size = max(size, terms)
    c = np.zeros(5, dtype=np.complex128)
    if slides_3:
        c[0] = g[2]
        c[1] = (g[0] - 8.0 * g[1] + 8.0 * g[3] - g[4]) / 12.0
        c[2] = (-g[0] + 16.0 * g[1] - 30.0 * g[2] + 16.0 * g[3] - g[4]) / 24.0
        c[3] = (-g[0] + 2.0 * g[1] - 2.0 * g[3] + g[4]) / 12.0
        c[4] = (g[0] - 4.0 * g[1] + 6.0 * g[2] - 4.0 * g[3] + g[4]) / 24.0
    else:
        # g = c0 + Re(c1 e^ix + c2 e^2ix), times 2 e^2ix: a quartic in e^ix.
        for k in range(3):
            for j in range(5):
                turn = -2.0 * math.pi * k * j / 5.0
                c[2 + k] += 0.4 * g[j] * complex(math.cos(turn), math.sin(turn))
        c[1], c[0] = c[3].conjugate(), c[4].conjugate()
    largest = 0.0
    for k in range(5):
        largest = max(largest, abs(c[k]))
    if largest <= NOTHING * size:
        return -1
    if not slides_3 and abs(c[4]) <= NOTHING * largest:
        return _circle_roots(2.0 * c[3].real, -2.0 * c[3].imag, -c[2].real, roots)
    degree = 4
    while degree > 0 and abs(c[degree]) <= NOTHING * largest:
        degree -= 1
    z = np.zeros(4, dtype=np.complex128)
    _polynomial_roots(c, degree, z)
    # Two roots that round-off has merged stand beside the line, or the circle, as far as they were
    # apart on it: they are put back by as much to either side.
    count = 0
    for k in range(degree):
        if slides_3:
            if abs(z[k].imag) <= OFF_CIRCLE * (1.0 + abs(z[k])):
                roots[count] = scale * (z[k].real + z[k].imag)
                count += 1
        elif abs(abs(z[k]) - 1.0) <= OFF_CIRCLE:
            roots[count] = math.atan2(z[k].imag, z[k].real) + math.log(abs(z[k]))
            count += 1
    return count


@compiled
def _second_joint(
    screws: Floats, F: Floats, guides: Any, squares: Any, w: Any, free: float, roots: Floats
) -> int:
    # Positions of joint 2 that bring w to where joint 1 can take over.
    z2, o2 = _three(screws, 1, 0), _three(screws, 1, 3)
    if screws[1, 6] > 0.5:
        k = 1 if F[1, 0] == 0.0 else 0
        along = _dot(_three(F, k, 1), z2)
        if abs(along) > 1e-9:
            roots[0] = -_left_over(F, k, w) / along
            return 1
        if F[1, 0] == 0.0:
            roots[0] = free
            return 1
        # |w + d z2|^2 is given.
        middle = -_dot(w, z2)
        square = middle * middle - _left_over(F, 1, w)
        if square < -BORDER * (middle * middle + abs(F[1, 4])):
            return 0
        half = math.sqrt(max(square, APART * (middle * middle + abs(F[1, 4]))))
        roots[0], roots[1] = middle + half, middle - half
        return 2
    height = _dot(z2, _plus(w, -1.0, o2))
    b = _plus(o2, height, z2)
    from_axis = _plus(w, -1.0, b)
    across = _dot(from_axis, from_axis)
    if squares[0] > 0.0 and squares[1] > 0.0:
        v = _plus((0.0, 0.0, 0.0), _wanted(F, 0, b, across) / squares[0], guides[0])
        v = _plus(v, _wanted(F, 1, b, across) / squares[1], guides[1])
        roots[0] = _angle(z2, from_axis, v, free)
        return 1
    k = 0 if squares[0] > 0.0 else 1
    if squares[k] == 0.0:
        roots[0] = free
        return 1
    guide = guides[k]
    count = _circle_roots(
        _dot(guide, from_axis),
        _dot(guide, _cross(z2, from_axis)),
        _wanted(F, k, b, across),
        roots,
    )
    if count < 0:
        roots[0] = free
        return 1
    return count


@compiled
def _first_three(screws: Floats, point: Any, p: Any, free: Floats, found: Floats) -> int:
    # Positions of three joints that bring a point to p: fills `found` (m, 3). The points of axes
    # 1 and 2 are the feet of their common perpendicular, so the two guides are orthogonal.
    o1 = _three(screws, 0, 3)
    here = screws[:3].copy()
    for k in range(3):
        for i in range(3):
            here[k, 3 + i] -= o1[i]
    point, p = _plus(point, -1.0, o1), _plus(p, -1.0, o1)
    F = np.empty((2, 5))
    _constraints(here, p, F)
    z1, z2, o2 = _three(here, 0, 0), _three(here, 1, 0), _three(here, 1, 3)
    guides = (_guide(F, 0, z2, o2), _guide(F, 1, z2, o2))
    scale = math.sqrt(_dot(p, p)) + math.sqrt(_dot(point, point)) + math.sqrt(_dot(o2, o2))
    first, second = _dot(guides[0], guides[0]), _dot(guides[1], guides[1])
    squares = (
        first if first > 1e-18 else 0.0,
        second if second > 1e-18 * (scale * scale if F[1, 0] > 0.0 else 1.0) else 0.0,
    )
    thirds, seconds = np.empty(4), np.empty(2)
    count_3 = _third_joint(here, point, F, guides, squares, max(scale, 1e-300), thirds)
    if count_3 < 0:
        thirds[0] = free[2]
        count_3 = 1
    count = 0
    for i in range(count_3):
        w = _moved(here, 2, thirds[i], point)
        count_2 = _second_joint(here, F, guides, squares, w, free[1], seconds)
        for j in range(count_2):
            u = _moved(here, 1, seconds[j], w)
            if here[0, 6] > 0.5:
                found[count, 0] = _dot(z1, _plus(p, -1.0, u))
            else:
                found[count, 0] = _angle(z1, u, p, free[0])
            found[count, 1] = seconds[j]
            found[count, 2] = thirds[i]
            count += 1
    return count


@compiled
def _across(axis: Any) -> Any:
    v = _cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.6 else (0.0, 1.0, 0.0))
    length = math.sqrt(_dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length)


@compiled
def _times_vector(T: Floats, v: Any) -> Any:
    return (
        T[0, 0] * v[0] + T[0, 1] * v[1] + T[0, 2] * v[2],
        T[1, 0] * v[0] + T[1, 1] * v[1] + T[1, 2] * v[2],
        T[2, 0] * v[0] + T[2, 1] * v[1] + T[2, 2] * v[2],
    )


@compiled
def _times_point(T: Floats, v: Any) -> Any:
    return _plus(_times_vector(T, v), 1.0, (T[0, 3], T[1, 3], T[2, 3]))


@compiled
def _back(screws: Floats, values: Floats, count: int, v: Any) -> Any:
    # A direction as it was before the first `count` joints turned it.
    for k in range(count):
        if screws[k, 6] < 0.5:
            v = _turned(_three(screws, k, 0), -values[k], v)
    return v


@compiled
def _wrist(screws: Floats, T: Floats, arm: Floats, free: Floats, found: Floats) -> int:
    # The last three joints turn what the first three (positions `arm`) leave of the rotation.
    a, b, c = _three(screws, 3, 0), _three(screws, 4, 0), _three(screws, 5, 0)
    goal = _back(screws, arm, 3, _times_vector(T, c))
    ab, bc = _dot(a, b), _dot(b, c)
    roots = np.empty(2)
    count = _circle_roots(
        _dot(a, c) - ab * bc, _dot(a, _cross(b, c)), _dot(a, goal) - ab * bc, roots
    )
    if count < 0:
        roots[0] = free[4]
        count = 1
    side = _across(c)
    goal_side = _back(screws, arm, 3, _times_vector(T, side))
    for i in range(count):
        angle = _angle(a, _turned(b, roots[i], c), goal, free[3])
        found[i, 3] = angle
        found[i, 4] = roots[i]
        rest = _turned(b, -roots[i], _turned(a, -angle, goal_side))
        found[i, 5] = _angle(c, side, rest, free[5])
    return count


@compiled
def _with_wrist(screws: Floats, T: Floats, point: Any, free: Floats, found: Floats) -> int:
    # Axes 4 to 6 meet in `point`, so joints 1 to 3 alone bring it to its place.
    arms, wrists = np.empty((8, 3)), np.empty((2, 6))
    count = 0
    for i in range(_first_three(screws, point, _times_point(T, point), free, arms)):
        for j in range(_wrist(screws, T, arms[i], free, wrists)):
            for k in range(3):
                found[count, k] = arms[i, k]
                found[count, 3 + k] = wrists[j, 3 + k]
            count += 1
    return count


@compiled
def _with_parallel_axes(screws: Floats, T: Floats, point: Any, free: Floats, found: Floats) -> int:
    # Axes 2, 3, 4 are parallel, 5 and 6 meet in `point`: joints 2 to 4 leave the height of that
    # point along axis 2 as it is, which gives joint 1; then the direction of axis 2 gives joints
    # 5 and 6; what is left is an arm in a plane.
    z1, z, z5, z6 = (
        _three(screws, 0, 0),
        _three(screws, 1, 0),
        _three(screws, 4, 0),
        _three(screws, 5, 0),
    )
    o1, o2, o4 = _three(screws, 0, 3), _three(screws, 1, 3), _three(screws, 3, 3)
    firsts, fifths, thirds = np.empty(2), np.empty(2), np.empty(2)
    # z . (turned(z1, x, ...)) of the goal taken back by joint 1 is the height at rest.
    goal = _plus(_times_point(T, point), -1.0, o1)
    still = _dot(z, z1) * _dot(z1, goal)
    count_1 = _circle_roots(
        _dot(z, goal) - still,
        -_dot(z, _cross(z1, goal)),
        _dot(z, _plus(point, -1.0, o1)) - still,
        firsts,
    )
    if count_1 < 0:
        firsts[0] = free[0]
        count_1 = 1
    count = 0
    for i in range(count_1):
        # R^T (z as joint 1 turns it), which joints 6 and 5 must turn into z.
        z_now = _turned(z1, firsts[i], z)
        seen = (
            T[0, 0] * z_now[0] + T[1, 0] * z_now[1] + T[2, 0] * z_now[2],
            T[0, 1] * z_now[0] + T[1, 1] * z_now[1] + T[2, 1] * z_now[2],
            T[0, 2] * z_now[0] + T[1, 2] * z_now[1] + T[2, 2] * z_now[2],
        )
        still = _dot(z6, z5) * _dot(z5, z)
        count_5 = _circle_roots(
            _dot(z6, z) - still,
            -_dot(z6, _cross(z5, z)),
            _dot(z6, seen) - still,
            fifths,
        )
        if count_5 < 0:
            fifths[0] = free[4]
            count_5 = 1
        for j in range(count_5):
            sixth = _angle(z6, seen, _turned(z5, -fifths[j], z), free[5])
            # G = E1^-1 T E6^-1 E5^-1 moves within the plane across z: its turn, and where it
            # brings the point of axis 4.
            start = _moved(screws, 5, -sixth, _moved(screws, 4, -fifths[j], o4))
            goal_4 = _moved(screws, 0, -firsts[i], _times_point(T, start))
            side = _across(z)
            side_now = _turned(z6, -sixth, _turned(z5, -fifths[j], side))
            side_now = _turned(z1, -firsts[i], _times_vector(T, side_now))
            total = _angle(z, side, side_now, 0.0)
            to_goal = _plus(goal_4, -1.0, o2)
            o3 = _three(screws, 2, 3)
            upper, lower = _plus(o3, -1.0, o2), _plus(o4, -1.0, o3)
            upper = _plus(upper, -_dot(upper, z), z)
            lower = _plus(lower, -_dot(lower, z), z)
            reach = _dot(to_goal, to_goal) - _dot(to_goal, z) ** 2
            count_3 = _circle_roots(
                2.0 * _dot(upper, lower),
                2.0 * _dot(upper, _cross(z, lower)),
                reach - _dot(upper, upper) - _dot(lower, lower),
                thirds,
            )
            if count_3 < 0:
                thirds[0] = free[2]
                count_3 = 1
            for k in range(count_3):
                bent = _plus(upper, 1.0, _turned(z, thirds[k], lower))
                second = _angle(z, bent, to_goal, free[1])
                found[count, 0] = firsts[i]
                found[count, 1] = second
                found[count, 2] = thirds[k]
                found[count, 3] = total - second - thirds[k]
                found[count, 4] = fifths[j]
                found[count, 5] = sixth
                count += 1
    return count


@compiled
def inverse_candidates(
    way: int, screws: Floats, point: Floats, T: Floats, free: Floats, found: Floats
) -> int:
    """
    Fill `found` with joint positions that may bring the tool to its target; return their number.

    Candidates, not solutions: `refine` sharpens them and says how far off each is.

    Parameters
    ----------
    way
        POSITION_3, SPHERICAL_WRIST or PARALLEL_AXES.
    screws : shape (k, 7)
        Each joint at rest: its axis, a point on it, 1 where it slides.
    point : shape (3,), m
        The point that is brought to its place first, at rest.
    T : shape (4, 4)
        The motion from rest to the target.
    free : shape (k,), rad or m
        Positions of joints that may have any.
    found : shape (MOST_CANDIDATES, k), rad or m
        The candidates.

    """
    start = (point[0], point[1], point[2])
    if way == POSITION_3:
        return int(_first_three(screws, start, _times_point(T, start), free, found))
    if way == SPHERICAL_WRIST:
        return int(_with_wrist(screws, T, start, free, found))
    return int(_with_parallel_axes(screws, T, start, free, found))


# Aim (inverse/aim.py), 44 numbers: the target 4 x 4; the rotation of the axes the rows are in
# (3 x 3); six weights of the rows (1, the length for angular rows, 0 for rows not asked for).
AIM_AXES, AIM_WEIGHTS, AIM_SIZE = 16, 25, 31
# A smaller error is round-off of forward kinematics, as a share of the length.
ROUND_OFF = 1e-15
# Where nothing is gained any more: so many steps that shrink the error by less than this share.
SLOW, PATIENCE = 1e-3, 12
STIFFEST = 1e8
# Of a refinement that starts anywhere: damping at first, steps at most.
FAR_DAMPING, FAR_STEPS = 1e-3, 80
# Solutions nearer than this (rad, scaled) are one; nearer than the second, they may be.
SAME_SOLUTION, MAYBE_SAME = 1e-8, 1e-2
# As near to the target as a solution is to round-off, as a share of the length.
AS_GOOD = 1e-13
# Beyond a limit by less is at the limit: what the last digits of a solution do (rad, m).
AT_LIMIT = 1e-9


@compiled
def _rotation_vector(R: Any) -> Any:
    # Axis times angle of the nine numbers of a rotation matrix.
    x, y, z = R[7] - R[5], R[2] - R[6], R[3] - R[1]
    sine = math.sqrt(x * x + y * y + z * z)
    cosine = R[0] + R[4] + R[8] - 1.0
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        share = angle / sine
        return (x * share, y * share, z * share)
    if cosine > 0.0:
        return (0.5 * x, 0.5 * y, 0.5 * z)
    # Half a turn: any column of R + I shows the axis, the longest is the safest.
    if R[0] >= R[4] and R[0] >= R[8]:
        a, b, c = R[0] + 1.0, R[3], R[6]
    elif R[4] >= R[8]:
        a, b, c = R[1], R[4] + 1.0, R[7]
    else:
        a, b, c = R[2], R[5], R[8] + 1.0
    share = angle / math.sqrt(a * a + b * b + c * c)
    return (a * share, b * share, c * share)


@compiled
def _turned_back(aim: Floats, v: Any) -> Any:
    at = AIM_AXES
    return (
        aim[at] * v[0] + aim[at + 3] * v[1] + aim[at + 6] * v[2],
        aim[at + 1] * v[0] + aim[at + 4] * v[1] + aim[at + 7] * v[2],
        aim[at + 2] * v[0] + aim[at + 5] * v[1] + aim[at + 8] * v[2],
    )


@compiled
def _miss(aim: Floats, row: Floats, error: Floats) -> float:
    # Fills `error` (6,) with what the pose of a row lacks, weighted, and returns its square.
    linear = _turned_back(aim, (aim[3] - row[3], aim[7] - row[7], aim[11] - row[11]))
    at = AIM_WEIGHTS
    angular = (0.0, 0.0, 0.0)
    if aim[at + 3] + aim[at + 4] + aim[at + 5] > 0.0:
        R = (
            aim[0] * row[0] + aim[1] * row[1] + aim[2] * row[2],
            aim[0] * row[4] + aim[1] * row[5] + aim[2] * row[6],
            aim[0] * row[8] + aim[1] * row[9] + aim[2] * row[10],
            aim[4] * row[0] + aim[5] * row[1] + aim[6] * row[2],
            aim[4] * row[4] + aim[5] * row[5] + aim[6] * row[6],
            aim[4] * row[8] + aim[5] * row[9] + aim[6] * row[10],
            aim[8] * row[0] + aim[9] * row[1] + aim[10] * row[2],
            aim[8] * row[4] + aim[9] * row[5] + aim[10] * row[6],
            aim[8] * row[8] + aim[9] * row[9] + aim[10] * row[10],
        )
        angular = _turned_back(aim, _rotation_vector(R))
    square = 0.0
    for i in range(3):
        error[i] = aim[at + i] * linear[i]
        error[3 + i] = aim[at + 3 + i] * angular[i]
        square += error[i] ** 2 + error[3 + i] ** 2
    return square


@compiled
def _weighted_columns(aim: Floats, row: Floats, scales: Floats, columns: Floats) -> None:
    # Columns of J in the axes of the rows, as rows of `columns` (n, 6), weighted like the error;
    # a unit of each joint counts scales[j] (0: the joint is held).
    n = scales.shape[0]
    at, J = AIM_WEIGHTS, JACOBIAN_AT
    for j in range(n):
        linear = _turned_back(aim, (row[J + j], row[J + n + j], row[J + 2 * n + j]))
        angular = _turned_back(aim, (row[J + 3 * n + j], row[J + 4 * n + j], row[J + 5 * n + j]))
        for i in range(3):
            columns[j, i] = scales[j] * aim[at + i] * linear[i]
            columns[j, 3 + i] = scales[j] * aim[at + 3 + i] * angular[i]


@compiled
def _damped_step(A: Floats, g: Floats, damping: float, L: Floats, step: Floats) -> bool:
    # Solves (A + damping) step = g by Cholesky; False where round-off makes that impossible.
    n = g.shape[0]
    for i in range(n):
        for j in range(i + 1):
            value = A[i, j]
            if i == j:
                value += damping
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                if not value > 0.0:
                    return False
                L[i, i] = math.sqrt(value)
            else:
                L[i, j] = value / L[j, j]
    for i in range(n):
        value = g[i]
        for k in range(i):
            value -= L[i, k] * step[k]
        step[i] = value / L[i, i]
    for i in range(n - 1, -1, -1):
        value = step[i]
        for k in range(i + 1, n):
            value -= L[k, i] * step[k]
        step[i] = value / L[i, i]
    return True


@compiled
def _refine_one(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    scales: Floats,
    limits: Floats,
    damping: float,
    steps: int,
    q: Floats,
    rest: Floats,
    rows: Floats,
    work: Floats,
) -> float:
    n = q.shape[0]
    columns, A, L = work[:n, :6], work[:n, 6 : 6 + n], work[:n, 6 + n : 6 + 2 * n]
    g, step, trial = work[n, :n], work[n + 1, :n], work[n + 2 : n + 3, :n]
    error = work[n + 3, :6]
    trial[0] = q
    _evaluate_one(integers, numbers, trial, rest, JACOBIAN, rows, 0, 0, 0, 0)
    square = _miss(aim, rows[0], error)
    length = max(aim[AIM_WEIGHTS + 3], aim[AIM_WEIGHTS + 4], aim[AIM_WEIGHTS + 5], 1e-3)
    enough = (ROUND_OFF * length) ** 2
    slow = 0
    fresh = True
    size = 0.0
    for _ in range(steps):
        if square <= enough or slow >= PATIENCE:
            break
        if fresh:
            _weighted_columns(aim, rows[0], scales, columns)
            size = 0.0
            for i in range(n):
                g[i] = 0.0
                for k in range(6):
                    g[i] += columns[i, k] * error[k]
                for j in range(i + 1):
                    A[i, j] = 0.0
                    for k in range(6):
                        A[i, j] += columns[i, k] * columns[j, k]
                size = max(size, A[i, i])
            # A joint at its bound that would go on is held; the others go where that is best.
            for i in range(n):
                upper = q[i] >= limits[i, 1] and g[i] > 0.0
                if upper or (q[i] <= limits[i, 0] and g[i] < 0.0):
                    g[i] = 0.0
                    for j in range(n):
                        A[i, j] = 0.0
                        A[j, i] = 0.0
                    A[i, i] = size
            fresh = False
        if size == 0.0:
            break
        if not _damped_step(A, g, damping * size + 1e-18 * size, L, step):
            damping = max(10.0 * damping, 1e-15)
            continue
        moved = 0.0
        for j in range(n):
            value = q[j] + scales[j] * step[j]
            value = min(max(value, limits[j, 0]), limits[j, 1])
            moved = max(moved, abs(value - q[j]))
            trial[0, j] = value
        if moved == 0.0:
            break
        _evaluate_one(integers, numbers, trial, rest, JACOBIAN, rows, 0, 0, 0, 0)
        new = _miss(aim, rows[0], error)
        if new < square:
            slow = slow + 1 if new > (1.0 - SLOW) * square else 0
            for j in range(n):
                q[j] = trial[0, j]
            square = new
            damping = min(0.1 * damping, square / (length * length))
            fresh = True
        else:
            # A refused step at the level of round-off is the end.
            if square <= (1e-12 * length) ** 2 or damping > STIFFEST:
                break
            damping = max(8.0 * damping, 1e-12)
            # `error` is the refused one's now, but g and A are still those of q.
            slow += 1 if moved < 1e-13 else 0
    return math.sqrt(square)


@compiled
def refine(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    scales: Floats,
    limits: Floats,
    damping: float,
    steps: int,
    q: Floats,
    errors: Floats,
) -> None:
    """
    Move each row of q to where the tool misses its target least: Levenberg-Marquardt.

    Parameters
    ----------
    integers, numbers
        `Chain.integers` and `Chain.numbers`.
    aim : shape (AIM_SIZE,)
        What is aimed at: see AIM_AXES.
    scales : shape (n,)
        What a unit of each joint counts, as `Task.column_scales`, inverted; 0 holds a joint.
    limits : shape (n, 2), rad or m
        No joint leaves these; infinite where it may.
    damping
        At first, as a share of the largest column of J squared: 1e-3 from afar, 0 at a solution.
    steps
        Steps at most.
    q : shape (N, n), rad or m
        Starts, overwritten.
    errors : shape (N,), m
        What is left: the norm of the weighted rows.

    """
    n = q.shape[1]
    rest = np.zeros((1, n))
    rows = np.empty((1, integers[FRAMES_AT]))
    work = np.empty((n + 4, max(6 + 2 * n, n)))
    for k in range(q.shape[0]):
        errors[k] = _refine_one(
            integers, numbers, aim, scales, limits, damping, steps, q[k], rest, rows, work
        )


@compiled
def free_motions(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    scales: Floats,
    q: Floats,
    sigma: Floats,
    motions: Floats,
) -> None:
    """
    Fill the singular values of the aim's rows of J, and the joint motions that belong to them.

    Parameters
    ----------
    integers, numbers, aim, scales
        As `refine` takes them.
    q : shape (N, n), rad or m
        Joint positions.
    sigma : shape (N, n), m
        Singular values, descending; those beyond the rows asked for are 0.
    motions : shape (N, n, n)
        Unit joint motions, scaled ones, a row a singular value.

    """
    n = q.shape[1]
    rest = np.zeros((1, n))
    rows = np.empty((1, integers[FRAMES_AT]))
    columns = np.empty((n, 6 + n))  # and the turns beside them
    for k in range(q.shape[0]):
        _evaluate_one(integers, numbers, q[k : k + 1], rest, JACOBIAN, rows, 0, 0, 0, 0)
        _weighted_columns(aim, rows[0], scales, columns)
        for i in range(n):
            for j in range(n):
                columns[i, 6 + j] = 1.0 if i == j else 0.0
        _orthogonalise(columns, n, 6)
        _sort_by_norm(columns, sigma[k], n, 6)
        motions[k] = columns[:, 6:]


@compiled
def parts_of_error(integers: Integers, numbers: Floats, aim: Floats, q: Floats) -> Any:
    """
    Return by how much q (1, n) misses its target in the rows that count: m, rad.

    """
    error = np.empty(6)
    rows = np.empty((1, integers[FRAMES_AT]))
    _evaluate_one(integers, numbers, q, np.zeros(q.shape), POSE, rows, 0, 0, 0, 0)
    _miss(aim, rows[0], error)
    length = max(aim[AIM_WEIGHTS + 3], aim[AIM_WEIGHTS + 4], aim[AIM_WEIGHTS + 5])
    angular = math.sqrt(error[3] ** 2 + error[4] ** 2 + error[5] ** 2)
    linear = math.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    return linear, angular / length if length > 0.0 else 0.0


@compiled
def _sign(value: float, size: float) -> int:
    if abs(value) <= 1e-9 * size:
        return 0
    return 1 if value > 0.0 else -1


@compiled
def postures(way: int, screws: Floats, point: Floats, psi: Floats, signs: Integers) -> None:
    """
    Fill `signs` (N, 3) with 1, -1 or 0 (none): shoulder right, elbow up, wrist not flipped.

    Parameters
    ----------
    way, screws, point
        As `inverse_candidates` takes them.
    psi : shape (N, k), rad or m
        Positions of the screws.
    signs : shape (N, 3)
        The postures.

    """
    z1, z2 = _three(screws, 0, 0), _three(screws, 1, 0)
    o1, o2 = _three(screws, 0, 3), _three(screws, 1, 3)
    side = _cross(z2, z1)
    has_shoulder = screws[0, 6] < 0.5 and screws[1, 6] < 0.5 and _dot(side, side) > 1e-9
    elbow = _cross(z2, _three(screws, 2, 0))
    has_elbow = screws[1, 6] < 0.5 and screws[2, 6] < 0.5 and _dot(elbow, elbow) < 1e-12
    has_elbow = has_elbow and has_shoulder
    for i in range(psi.shape[0]):
        signs[i, 0] = signs[i, 1] = signs[i, 2] = 0
        # The tool of joints 1 to 3, in the frame joint 1 carries along.
        end = (point[0], point[1], point[2])
        if way == PARALLEL_AXES:
            end = _moved(screws, 3, psi[i, 3], end)
        end = _moved(screws, 1, psi[i, 1], _moved(screws, 2, psi[i, 2], end))
        if has_shoulder:
            reach = _plus(end, -1.0, o1)
            signs[i, 0] = _sign(_dot(side, reach), math.sqrt(_dot(reach, reach)))
        if has_elbow:
            if way == PARALLEL_AXES:
                tip = _moved(screws, 2, psi[i, 2], _three(screws, 3, 3))
                tip = _moved(screws, 1, psi[i, 1], tip)
            else:
                tip = end
            chord = _plus(tip, -1.0, o2)
            chord = _plus(chord, -_dot(chord, z2), z2)
            upper = _plus(_moved(screws, 1, psi[i, 1], _three(screws, 2, 3)), -1.0, o2)
            upper = _plus(upper, -_dot(upper, z2), z2)
            square = _dot(chord, chord)
            if square > 0.0:
                off = _plus(upper, -_dot(upper, chord) / square, chord)
                signs[i, 1] = _sign(_dot(off, z1), math.sqrt(_dot(upper, upper)))
        if way != POSITION_3:
            a = _three(screws, 4, 0)
            first = _turned(a, -psi[i, 4], _three(screws, 3, 0))
            signs[i, 2] = _sign(_dot(_cross(first, a), _three(screws, 5, 0)), 1.0)


@compiled
def off_rotation(T: Floats) -> float:
    """
    Return by how much the rotation of a pose (4, 4) is not orthogonal; infinite for a mirror.

    """
    off = 0.0
    for i in range(3):
        for j in range(i + 1):
            product = T[i, 0] * T[j, 0] + T[i, 1] * T[j, 1] + T[i, 2] * T[j, 2]
            off = max(off, abs(product - (1.0 if i == j else 0.0)))
    a = (T[0, 0], T[0, 1], T[0, 2])
    b = (T[1, 0], T[1, 1], T[1, 2])
    if _dot(_cross(a, b), (T[2, 0], T[2, 1], T[2, 2])) < 0.0:
        return math.inf
    return off


@compiled
def _without_turns(away: float, period: float) -> float:
    return away - period * math.floor(away / period + 0.5) if math.isfinite(period) else away


@compiled
def distinct(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    proved: float,
    q: Floats,
    errors: Floats,
    which: Integers,
    met: Integers,
) -> int:
    """
    Fill `which` with the rows of q that are solutions, each solution once; return their number.

    Two rows are one solution where they are equal to round-off, full turns left out, or where
    they are near each other and the point halfway is a solution too: at the border of the
    workspace two solutions meet, and are told apart as long as the target can tell.

    Parameters
    ----------
    integers, numbers, aim, scales
        As `refine` takes them.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    proved
        Rows with less of an error are solutions, m.
    q, errors : shape (N, n), (N,)
        Joint positions and by how much they miss, the least first.
    which, met : shape (N,)
        Rows kept, and how many rows each stands for.

    """
    n = q.shape[1]
    free = np.empty((n, 2))
    free[:, 0], free[:, 1] = -math.inf, math.inf
    rest = np.zeros((1, n))
    rows = np.empty((1, integers[FRAMES_AT]))
    work = np.empty((n + 4, max(6 + 2 * n, n)))
    halfway = np.empty(n)
    length = max(aim[AIM_WEIGHTS + 3], aim[AIM_WEIGHTS + 4], aim[AIM_WEIGHTS + 5], 1e-3)
    count = 0
    for k in range(q.shape[0]):
        if not errors[k] < proved:
            break
        known = False
        for i in range(count):
            one = which[i]
            distance = 0.0
            for j in range(n):
                away = _without_turns(q[k, j] - q[one, j], periods[j])
                halfway[j] = q[one, j] + 0.5 * away
                distance = max(distance, abs(away) / scales[j])
            if distance < SAME_SOLUTION:
                known = True
            elif distance < MAYBE_SAME:
                error = _refine_one(
                    integers, numbers, aim, scales, free, 0.0, 0, halfway, rest, rows, work
                )
                known = error < max(AS_GOOD * length, 4.0 * errors[k])
            if known:
                met[i] += 1
                break
        if not known:
            which[count] = k
            met[count] = 1
            count += 1
    return count


@compiled
def representatives(limits: Floats, periods: Floats, near: Floats, q: Floats) -> None:
    """
    Turn each row of q by full turns: into the limits if that can be, and there nearest to `near`.

    Parameters
    ----------
    limits : shape (n, 2), rad or m
        Infinite where there are none.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    near : shape (n,), rad or m
        Half a turn from it, the upper one is taken.
    q : shape (N, n), rad or m
        Overwritten.

    """
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            period = periods[j]
            if not math.isfinite(period):
                continue
            low, high = limits[j, 0] - AT_LIMIT, limits[j, 1] + AT_LIMIT
            x = near[j] - _without_turns(near[j] - q[k, j], period)
            if x <= near[j] - 0.5 * period + 1e-15:
                x += period
            if x < low:
                x += period * math.ceil((low - x) / period)
            elif x > high:
                x -= period * math.ceil((x - high) / period)
            # Where no turn is inside, the one that is beyond by less.
            if x > high and low - (x - period) < x - high:
                x -= period
            elif x < low and x + period - high < low - x:
                x += period
            q[k, j] = x


@compiled
def _least_pivot(A: Floats, count: int, length: int) -> float:
    # The last pivot of `count` rows by elimination with complete pivoting, as a share of the
    # first; A is overwritten.
    first, last = 0.0, 0.0
    for k in range(min(count, length)):
        pivot, row, column = -1.0, k, k
        for i in range(k, count):
            for j in range(k, length):
                if abs(A[i, j]) > pivot:
                    pivot, row, column = abs(A[i, j]), i, j
        if k == 0:
            first = pivot
        last = pivot
        if pivot <= 0.0:
            return 0.0
        if row != k:
            for j in range(k, length):
                A[k, j], A[row, j] = A[row, j], A[k, j]
        if column != k:
            for i in range(count):
                A[i, k], A[i, column] = A[i, column], A[i, k]
        for i in range(k + 1, count):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, length):
                A[i, j] -= factor * A[k, j]
    return last / first


@compiled
def pivots(
    integers: Integers, numbers: Floats, aim: Floats, scales: Floats, q: Floats, shares: Floats
) -> None:
    """
    Fill `shares` (N,) with how near to dependent the columns of the aim's rows of J are: 0 if so.

    The last pivot as a share of the first, by complete pivoting: much faster than the singular
    values, and hardly ever more than some ten times the smallest of them, as a share as well.

    Parameters
    ----------
    integers, numbers, aim, scales, q
        As `free_motions` takes them; 0 too where there are more joints than rows.

    """
    n = q.shape[1]
    rest = np.zeros((1, n))
    rows = np.empty((1, integers[FRAMES_AT]))
    columns = np.empty((n, 6))
    for k in range(q.shape[0]):
        _evaluate_one(integers, numbers, q[k : k + 1], rest, JACOBIAN, rows, 0, 0, 0, 0)
        _weighted_columns(aim, rows[0], scales, columns)
        shares[k] = _least_pivot(columns, n, 6) if n <= 6 else 0.0


# What `take_aim` says of a target.
FINE, NOT_FINE, NOT_RIGID, ROUGH = range(4)
# A rotation matrix written with four digits is still meant as one; a better one is taken as it is.
NEARLY_ROTATION, ROTATION = 1e-3, 1e-13
# What is said of a solution: what it misses by (m), the distance to the nearest limit, its last
# pivot (`pivots`), and from here on a joint each: 1 where it is beyond its limits.
MISSES, MARGIN, SHARE, BEYOND_AT = range(4)


@compiled
def take_aim(target: Floats, aim: Floats) -> int:
    """
    Write a target into an aim and return FINE, or what is wrong with it; ROUGH: almost a rotation.

    Parameters
    ----------
    target : shape (16,) or (3,)
        Pose, row by row, or position (m).
    aim : shape (AIM_SIZE,)
        Whose axes and weights are there already, and the identity.

    """
    for k in range(target.size):
        if not math.isfinite(target[k]):
            return NOT_FINE
    if target.size == 3:
        for i in range(3):
            aim[4 * i + 3] = target[i]
        return FINE
    for k in range(16):
        aim[k] = target[k]
    off = off_rotation(target.reshape(4, 4))
    if off > NEARLY_ROTATION or target[15] != 1.0:
        return NOT_RIGID
    if target[12] != 0.0 or target[13] != 0.0 or target[14] != 0.0:
        return NOT_RIGID
    return FINE if off <= ROTATION else ROUGH


@compiled
def _away(
    limits: Floats, periods: Floats, scales: Floats, near: Floats, q: Floats, facts: Floats
) -> float:
    # Turns q (1, n) into its representative, fills how it stands to the limits, and returns the
    # square of its distance to `near`.
    representatives(limits, periods, near, q)
    away, margin = 0.0, math.inf
    for j in range(near.size):
        room = min(q[0, j] - limits[j, 0], limits[j, 1] - q[0, j])
        margin = min(margin, room)
        facts[BEYOND_AT + j] = 1.0 if room < -AT_LIMIT else 0.0
        away += ((q[0, j] - near[j]) / scales[j]) ** 2
    facts[MARGIN] = margin
    return away


@compiled
def _motion(way: int, aim: Floats, point: Floats, home_inverse: Floats, backwards: bool) -> Any:
    # The motion (4, 4) from rest to the target, as the screws have to bring it about.
    T = np.zeros((4, 4))
    T[3, 3] = 1.0
    for i in range(3):
        if way == POSITION_3:
            T[i, i] = 1.0
            T[i, 3] = aim[4 * i + 3] - point[i]
            continue
        for j in range(4):
            for k in range(4):
                T[i, j] += aim[4 * i + k] * home_inverse[k, j]
    if not backwards:
        return T
    B = np.zeros((4, 4))
    B[3, 3] = 1.0
    for i in range(3):
        for j in range(3):
            B[i, j] = T[j, i]
            B[i, 3] -= T[j, i] * T[j, 3]
    return B


@compiled
def closed_solutions(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    way: int,
    screws: Floats,
    point: Floats,
    home_inverse: Floats,
    backwards: bool,
    to_joints: Floats,
    to_screws: Floats,
    scales: Floats,
    periods: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    only_one: bool,
    q: Floats,
    facts: Floats,
    signs: Integers,
) -> int:
    """
    Fill the solutions of an arm that has a closed form, nearest to `near` first; return how many.

    Each is refined, and proved by forward kinematics. Where one is enough, it is the nearest of
    those inside the limits.

    Parameters
    ----------
    integers, numbers, aim, scales, periods, limits, near, proved
        As `refine`, `distinct` and `representatives` take them.
    way, screws, point, home_inverse, backwards, to_joints, to_screws
        As `plan.ClosedForm` has them.
    only_one
        Whether the nearest solution inside the limits is enough.
    q, facts, signs : shape (MOST_CANDIDATES, n), (..., BEYOND_AT + n), (..., 3)
        Joint positions, what is said of them, and their postures.

    """
    n, k = to_joints.shape
    psi, free = np.empty((MOST_CANDIDATES, k)), np.zeros(k)
    for i in range(k):
        for j in range(n):
            free[i] += to_screws[i, j] * near[j]
    T = _motion(way, aim, point, home_inverse, backwards)
    count = inverse_candidates(way, screws, point, T, free, psi)
    found, errors = np.zeros((count, n)), np.empty(count)
    for i in range(count):
        for j in range(n):
            for p in range(k):
                found[i, j] += to_joints[j, p] * psi[i, p]
    unlimited = np.empty((n, 2))
    unlimited[:, 0], unlimited[:, 1] = -math.inf, math.inf
    away, order = np.empty(count), np.arange(count)
    kept = 0
    if only_one:
        for i in range(count):
            away[i] = _away(limits, periods, scales, near, found[i : i + 1], facts[0])
            if facts[0, MARGIN] < -AT_LIMIT:  # not before the others
                away[i] += 1e200
        for _ in range(count):
            i = int(np.argmin(away))
            away[i] = math.inf
            one = found[i : i + 1]
            refine(integers, numbers, aim, scales, unlimited, 0.0, 40, one, errors[:1])
            _away(limits, periods, scales, near, one, facts[0])
            if errors[0] < proved and facts[0, MARGIN] >= -AT_LIMIT:
                q[0] = one[0]
                facts[0, MISSES] = errors[0]
                kept = 1
                break
    else:
        refine(integers, numbers, aim, scales, unlimited, 0.0, 40, found, errors)
        order = np.argsort(errors)
        found, errors = found[order], errors[order]
        which, met = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
        kept = distinct(integers, numbers, aim, scales, periods, proved, found, errors, which, met)
        about = np.empty((kept, facts.shape[1]))
        for i in range(kept):
            w = which[i]
            about[i, MISSES] = errors[w]
            away[i] = _away(limits, periods, scales, near, found[w : w + 1], about[i])
        for i in range(kept):
            best = int(np.argmin(away[:kept]))
            away[best] = math.inf
            q[i], facts[i] = found[which[best]], about[best]
    pivots(integers, numbers, aim, scales, q[:kept], away)
    for i in range(kept):
        facts[i, SHARE] = away[i]
        for p in range(k):
            psi[i, p] = 0.0
            for j in range(n):
                psi[i, p] += to_screws[p, j] * q[i, j]
        for p in range(3):
            signs[i, p] = 0
    if not backwards:
        postures(way, screws, point, psi[:kept], signs[:kept])
    return kept


@compiled
def first_solution(
    integers: Integers,
    numbers: Floats,
    aim: Floats,
    held: Floats,
    scales: Floats,
    periods: Floats,
    bounds: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    starts: Floats,
    q: Floats,
    facts: Floats,
) -> int:
    """
    Fill the first solution inside the limits that refinement meets; return the starts it took.

    From `near`, then from the starts in their order; -1 where none of them led there.

    Parameters
    ----------
    integers, numbers, aim, scales, periods, limits, near, proved
        As `refine`, `distinct` and `representatives` take them.
    held : shape (n,)
        The scales, 0 for joints that stay where `near` has them.
    bounds : shape (n, 2), rad or m
        What no joint leaves on its way.
    starts : shape (N, n), rad or m
        Where to start from.
    q, facts : shape (1, n), (1, BEYOND_AT + n)
        The solution, and what is said of it.

    """
    n = near.size
    rest = np.zeros((1, n))
    rows = np.empty((1, integers[FRAMES_AT]))
    work = np.empty((n + 4, max(6 + 2 * n, n)))
    for k in range(starts.shape[0] + 1):
        for j in range(n):
            value = near[j] if k == 0 or held[j] == 0.0 else starts[k - 1, j]
            q[0, j] = min(max(value, bounds[j, 0]), bounds[j, 1])
        error = _refine_one(
            integers, numbers, aim, held, bounds, FAR_DAMPING, FAR_STEPS, q[0], rest, rows, work
        )
        if not error < proved:
            continue
        _away(limits, periods, scales, near, q, facts[0])
        if facts[0, MARGIN] >= -AT_LIMIT:
            facts[0, MISSES] = error
            pivots(integers, numbers, aim, scales, q, rest[0])
            facts[0, SHARE] = rest[0, 0]
            return k + 1
    return -1


# Servo settings (inverse/servo.py) in an array, and what a step reports.
LARGEST_DAMPING, DAMPED_BELOW, LENGTH, HORIZON = range(4)
DAMPING, LEAST_SINGULAR_VALUE, SHORTENED, SLOWEST = range(4)
# A faster twist (m/s, rad/s) asks for nothing that a slower one of its direction does not.
FASTEST = 1e9


@compiled
def _damped_motion(
    J: Floats,
    free: Integers,
    count: int,
    v: Floats,
    rank: int,
    damping: float,
    below: float,
    u: Floats,
    report: Floats,
) -> None:
    # Least squares of J u = v over the free columns, each singular value s below `below` with a
    # damping of its own, damping^2 (1 - (s / below)^2) (Nakamura and Hanafusa 1986; Maciejewski
    # and Klein 1988: directions that are not lost are not damped).
    m = J.shape[0]
    rows, length = (m, count) if count > m else (count, m)
    W, sigma = np.zeros((rows, length + rows)), np.empty(rows)  # A, and V beside it
    for i in range(m):
        for j in range(count):
            if count > m:
                W[i, j] = J[i, free[j]]
            else:
                W[j, i] = J[i, free[j]]
    for i in range(rows):
        W[i, length + i] = 1.0
    _orthogonalise(W, rows, length)
    _sort_by_norm(W, sigma, rows, length)
    for j in range(count):
        u[free[j]] = 0.0
    for i in range(rows):
        square = 0.0
        if sigma[i] < below:
            square = damping * damping * (1.0 - (sigma[i] / below) ** 2)
            if i < rank:
                report[DAMPING] = max(report[DAMPING], math.sqrt(square) / damping)
        along = 0.0
        for k in range(m):
            along += (W[i, length + k] if count > m else W[i, k]) * v[k]
        along /= sigma[i] * sigma[i] + square
        for j in range(count):
            u[free[j]] += along * (W[i, j] if count > m else W[i, length + j])
    last = min(rank, rows) - 1
    if report[LEAST_SINGULAR_VALUE] < 0.0:
        report[LEAST_SINGULAR_VALUE] = sigma[last]


@compiled
def servo(
    task_integers: Integers,
    task_numbers: Floats,
    settings: Floats,
    limits: Floats,
    fastest: Floats,
    q: Floats,
    row: Floats,
    twist: Floats,
    qdot: Floats,
    held: Integers,
    report: Floats,
) -> None:
    """
    Fill `qdot` (n,) with joint velocities that bring a twist about as far as the arm allows.

    Parameters
    ----------
    task_integers, task_numbers
        `Task.integers` and `Task.numbers`: the rows that count.
    settings : shape (4,)
        LARGEST_DAMPING and DAMPED_BELOW as shares of LENGTH (m); HORIZON, s.
    limits, fastest : shape (n, 2), (n,), rad or m, rad/s or m/s
        Of positions, infinite where there are none; of velocities, finite.
    q, row : shape (n,), (width,)
        Joint positions, and the row `evaluate` filled of them.
    twist : shape (6,), m/s and rad/s
        In base axes, at the tool's origin.
    held : shape (n,)
        1 or -1 where the upper or lower limit of a joint's position decides, else 0.
    report : shape (4,)
        DAMPING as a share of the largest, LEAST_SINGULAR_VALUE as a share of the length,
        SHORTENED (to which share all velocities were, for their limits), SLOWEST joint or -1.

    """
    m, n, rank = task_integers[ROWS], q.shape[0], task_integers[GENERIC_RANK]
    length = settings[LENGTH]
    report[DAMPING], report[LEAST_SINGULAR_VALUE] = 0.0, -1.0
    report[SHORTENED], report[SLOWEST] = 1.0, -1.0
    # Everything is divided by its largest entry, so that no square overflows.
    size = 0.0
    for i in range(6):
        size = max(size, abs(twist[i]))
    J, v = np.empty((m, n)), np.zeros(m)
    largest = 0.0
    for i in range(m):
        axis = task_integers[TASK_HEADER + i]
        half, component = axis // 3, axis % 3
        at = JACOBIAN_AT + 3 * half * n
        x, y, z = task_numbers[component], task_numbers[3 + component], task_numbers[6 + component]
        weight = task_numbers[9 + i]
        if size > 0.0:
            a, b, c = twist[3 * half], twist[3 * half + 1], twist[3 * half + 2]
            v[i] = weight * (x * (a / size) + y * (b / size) + z * (c / size))
        for j in range(n):
            value = x * row[at + j] + y * row[at + n + j] + z * row[at + 2 * n + j]
            J[i, j] = weight * task_numbers[9 + m + j] * value
            largest = max(largest, abs(J[i, j]))
    free, count = np.arange(n), n
    u = np.zeros(n)
    for j in range(n):
        qdot[j], held[j] = 0.0, 0
    if not largest > 0.0:
        report[DAMPING], report[LEAST_SINGULAR_VALUE] = 1.0, 0.0
        return
    for i in range(m):
        for j in range(n):
            J[i, j] /= largest
    damping = settings[LARGEST_DAMPING] * length / largest
    below = settings[DAMPED_BELOW] * length / largest
    _damped_motion(J, free, count, v, rank, damping, below, u, report)
    report[LEAST_SINGULAR_VALUE] *= largest / length
    # First all velocities are shortened alike, so that the tool keeps its direction.
    rate = min(size, FASTEST)
    for j in range(n):
        u[j] *= task_numbers[9 + m + j] / largest
        if abs(u[j]) * rate > fastest[j]:
            rate = fastest[j] / abs(u[j])
            report[SLOWEST] = j
    if size > 0.0:
        report[SHORTENED] = rate / size
    for j in range(n):
        qdot[j] = rate * u[j]
    for i in range(m):
        v[i] *= rate
    # Then joints that would run into their limits are held back, and the others make up for it.
    for _ in range(n):
        worst, over = -1, 1e-12  # of a joint at rest at its limit, round-off is no motion
        for k in range(count):
            j = free[k]
            upper = max((limits[j, 1] - q[j]) / settings[HORIZON], 0.0)
            lower = min((limits[j, 0] - q[j]) / settings[HORIZON], 0.0)
            beyond = max(qdot[j] - upper, lower - qdot[j]) / task_numbers[9 + m + j]
            if beyond > over:
                worst, over = k, beyond
        if worst < 0:
            break
        j = free[worst]
        if qdot[j] > 0.0:
            held[j] = 1
            qdot[j] = max((limits[j, 1] - q[j]) / settings[HORIZON], 0.0)
        else:
            held[j] = -1
            qdot[j] = min((limits[j, 0] - q[j]) / settings[HORIZON], 0.0)
        count -= 1
        for k in range(worst, count):
            free[k] = free[k + 1]
        if count == 0:
            break
        for i in range(m):
            v[i] -= J[i, j] * (qdot[j] / task_numbers[9 + m + j] * largest)
        _damped_motion(J, free, count, v, rank, damping, below, u, report)
        for k in range(count):
            u[free[k]] *= task_numbers[9 + m + free[k]] / largest
            qdot[free[k]] = u[free[k]]
    share = 1.0
    for j in range(n):
        if abs(qdot[j]) * share > fastest[j]:
            share = fastest[j] / abs(qdot[j])
            report[SLOWEST] = j
    report[SHORTENED] *= share
    for j in range(n):
        upper = max((limits[j, 1] - q[j]) / settings[HORIZON], 0.0)
        lower = min((limits[j, 0] - q[j]) / settings[HORIZON], 0.0)
        qdot[j] = min(max(qdot[j] * share, lower), upper)
