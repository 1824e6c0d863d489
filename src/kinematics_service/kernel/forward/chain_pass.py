"""
One pass over the chain: pose, quaternion, Jacobian, twist and frames of joint positions.

An element k is one moving screw of the chain, its axis the z axis (unit vector z) through the
point o, its motion Rz(theta) Tz(d) with theta = theta_0 + sum(c_theta q_j) and
d = d_0 + sum(c_d q_j). Each pair (c_theta, c_d) of one joint in one element is an entry. Motions
are twelve numbers, row by row.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Int32, Numbers
from .chain import Chain

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
# Added and taken away, it rounds to a whole number: above it the last place of a double is 1.
ROUNDER = 1.5 * 2.0**52
TWO_BY_PI = 6.36619772367581382433e-01
HALF_PI_1 = 1.57079632673412561417e00
HALF_PI_2 = 6.07710050630396597660e-11
HALF_PI_3 = 2.02226624879595063154e-21


def _sincos_reduced(x: float) -> tuple[float, float]:
    # Of an angle up to LARGEST_REDUCED, without a branch or a call: a loop does several at once.
    turns = (x * TWO_BY_PI + ROUNDER) - ROUNDER
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
    quarter: Int32 = int(turns)
    if quarter & 1:
        sine, cosine = cosine, sine
    sign = 1.0 - (quarter & 2)
    other = 1.0 - ((quarter + 1) & 2)
    return sign * sine, other * cosine


def sincos(x: float) -> tuple[float, float]:
    """Return sine and cosine, to two units in the last place."""
    if abs(x) <= places.LARGEST_REDUCED:
        return _sincos_reduced(x)
    if not math.isfinite(x):  # a sum of huge angles; plain Python would raise here
        return places.NAN, places.NAN
    return math.sin(x), math.cos(x)


def sines_and_cosines(angles: Numbers, sines: Numbers, cosines: Numbers) -> None:
    """Write the results of `sincos` for LANES angles up to LARGEST_REDUCED."""
    # Arrays of its own (LANES numbers): the compiler knows that they do not overlap with the
    # constants, and computes several lanes at once.
    s, c = [0.0] * 16, [0.0] * 16
    for lane in range(places.LANES):
        pair = _sincos_reduced(angles[lane])
        s[lane], c[lane] = pair[0], pair[1]
    for lane in range(places.LANES):
        sines[lane], cosines[lane] = s[lane], c[lane]


def start(T: Numbers, motion: Flat) -> None:
    """T becomes a constant motion."""
    for k in range(12):
        T[k] = motion[k]


def times(T: Numbers, motion: Flat) -> None:
    """T becomes T times a constant motion."""
    for i in range(0, 12, 4):
        x, y, z = T[i], T[i + 1], T[i + 2]
        T[i] = x * motion[0] + y * motion[4] + z * motion[8]
        T[i + 1] = x * motion[1] + y * motion[5] + z * motion[9]
        T[i + 2] = x * motion[2] + y * motion[6] + z * motion[10]
        T[i + 3] = x * motion[3] + y * motion[7] + z * motion[11] + T[i + 3]


def _times_twist(T: Numbers, motion: Flat) -> None:
    # Like `times`, for a constant motion that is a turn about x and a step along it.
    a, c, s = motion[3], motion[5], motion[9]
    for i in range(0, 12, 4):
        x, y, z = T[i], T[i + 1], T[i + 2]
        T[i + 1] = y * c + z * s
        T[i + 2] = z * c - y * s
        T[i + 3] = T[i + 3] + x * a


def times_screw(T: Numbers, theta: float, d: float) -> None:
    """T becomes T Rz(theta) Tz(d)."""
    s, c = sincos(theta)
    for i in range(0, 12, 4):
        x, y = T[i], T[i + 1]
        T[i] = x * c + y * s
        T[i + 1] = y * c - x * s
        T[i + 3] = T[i + 3] + T[i + 2] * d


def _write_motion(T: Numbers, row: Flat, at: int) -> None:
    for k in range(12):
        row[at + k] = T[k]
    row[at + 12] = 0.0
    row[at + 13] = 0.0
    row[at + 14] = 0.0
    row[at + 15] = 1.0


def write_quaternion(T: Numbers, row: Flat, at: int) -> None:
    """
    Write the unit quaternion x y z w of the rotation in T, w >= 0.

    From its largest component (Shepperd, 1978): no cancellation anywhere.
    """
    xx, xy, xz = T[0], T[1], T[2]
    yx, yy, yz = T[4], T[5], T[6]
    zx, zy, zz = T[8], T[9], T[10]
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
    row[at] = x * scale
    row[at + 1] = y * scale
    row[at + 2] = z * scale
    row[at + 3] = w * scale


def _write_point_and_axis(T: Numbers, entries: int, screw: Flat) -> None:
    # Of an element, for one entry; they become the screw, once the tool is known.
    for i in range(3):
        screw[i * entries] = T[4 * i + 3]
        screw[(3 + i) * entries] = T[4 * i + 2]


def _write_screw(by_theta: float, by_d: float, entries: int, row: Flat, screw: Flat) -> None:
    # Of one entry, from its point and axis: how it moves the tool's origin, and turns the tool.
    x = row[3] - screw[0]
    y = row[7] - screw[entries]
    z = row[11] - screw[2 * entries]
    zx, zy, zz = screw[3 * entries], screw[4 * entries], screw[5 * entries]
    screw[0] = by_theta * (zy * z - zz * y) + by_d * zx
    screw[entries] = by_theta * (zz * x - zx * z) + by_d * zy
    screw[2 * entries] = by_theta * (zx * y - zy * x) + by_d * zz
    screw[3 * entries] = by_theta * zx
    screw[4 * entries] = by_theta * zy
    screw[5 * entries] = by_theta * zz


def _write_fixed_frames(chain: Chain, row: Flat) -> int:
    # Writes the frames before every element; returns their number.
    frame = 0
    while frame < chain.frames and chain.frame_parent[frame] < 0:
        _write_motion(
            arrays.after(chain.frame_offset, 12 * frame), row, chain.frames_at + 16 * frame
        )
        frame += 1
    return frame


def _write_frames(chain: Chain, element: int, frame: int, T: Numbers, row: Flat) -> int:
    # Writes the frames that an element carries, from `frame` on; returns the first of the next
    # element.
    pose = [0.0] * 12
    while frame < chain.frames and chain.frame_parent[frame] == element:
        for i in range(12):
            pose[i] = T[i]
        times(pose, arrays.after(chain.frame_offset, 12 * frame))
        _write_motion(pose, row, chain.frames_at + 16 * frame)
        frame += 1
    return frame


def evaluate_row(chain: Chain, q: Flat, qdot: Flat, depth: int, row: Flat) -> float:
    """Fill a row as `evaluation.evaluate` does; the result is finite if all of the row is."""
    elements, entries = chain.elements, chain.entries
    twisted = chain.form == places.TWISTED
    screws = arrays.after(row, chain.screws_at)
    T = [0.0] * 12
    frame = _write_fixed_frames(chain, row) if depth >= places.ALL_FRAMES else 0
    start(T, chain.before)
    for k in range(elements):
        theta = chain.theta_0[k]
        d = chain.d_0[k]
        if twisted:  # the loop of the others, written out: 6 % of a row with its frames
            q_k = q[k]
            theta += chain.by_theta[k] * q_k
            d += chain.by_d[k] * q_k
            if depth >= places.JACOBIAN:
                _write_point_and_axis(T, entries, arrays.after(screws, k))
        else:
            for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
                q_k = q[chain.joint[e]]
                theta += chain.by_theta[e] * q_k
                d += chain.by_d[e] * q_k
                if depth >= places.JACOBIAN:
                    _write_point_and_axis(T, entries, arrays.after(screws, e))
        times_screw(T, theta, d)
        if depth >= places.ALL_FRAMES:
            frame = _write_frames(chain, k, frame, T, row)
        if twisted and k < elements - 1:
            _times_twist(T, arrays.after(chain.before, 12 * (k + 1)))
        else:
            times(T, arrays.after(chain.before, 12 * (k + 1)))
    return _finish_row(chain, T, qdot, depth, row)


def _finish_row(chain: Chain, T: Numbers, qdot: Flat, depth: int, row: Flat) -> float:
    # Completes a row whose tool pose T is known, with points and axes in place of the screws.
    _write_motion(T, row, places.POSE_AT)
    write_quaternion(T, row, places.QUATERNION_AT)
    total = T[3] + T[7] + T[11]
    if depth < places.JACOBIAN:
        return total
    screws = arrays.after(row, chain.screws_at)
    for e in range(chain.entries):
        _write_screw(chain.by_theta[e], chain.by_d[e], chain.entries, row, arrays.after(screws, e))
    if chain.form == places.MIXED:
        add_up_screws(chain, screws, row)
    return total + _write_twist(chain, screws, qdot, row)


def add_up_screws(chain: Chain, screws: Flat, row: Flat) -> None:
    """Fill the Jacobian, if entries and joints differ."""
    n = chain.dof
    for k in range(places.JACOBIAN_AT, places.JACOBIAN_AT + 6 * n):
        row[k] = 0.0
    for e in range(chain.entries):
        j = places.JACOBIAN_AT + chain.joint[e]
        for i in range(6):
            row[j + i * n] += screws[i * chain.entries + e]


def _write_twist(chain: Chain, screws: Flat, qdot: Flat, row: Flat) -> float:
    # The result is finite if the screws and the twist are.
    entries = chain.entries
    twist = places.JACOBIAN_AT + 6 * chain.dof
    total = 0.0
    for i in range(6):
        along, screw = 0.0, i * entries
        for e in range(entries):
            along += screws[screw + e] * qdot[chain.joint[e]]
            total += screws[screw + e]
        row[twist + i] = along
        total += along
    return total
