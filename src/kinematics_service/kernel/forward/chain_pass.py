# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute pose, quaternion, Jacobian, twist and frames from joint positions in one pass over the
chain.

The pass evaluates one pose, or LANES poses at once. An array for several poses is interleaved: the
k-th number of each pose is stored at the indices k * lanes to k * lanes + lanes - 1. Each pose
needs the same operations in the same order, whether one pose or LANES poses are evaluated. So a
pose has bit for bit the same results in both cases.

An element is one moving screw of the chain. Its axis is the unit vector z through the point o. The
element moves by Rz(theta) Tz(d), where theta = theta_0 + sum(c_theta q_j) and
d = d_0 + sum(c_d q_j). The sums run over the joints j that move the element, and q_j is the
position of joint j. An entry is a pair: an element, and a joint that moves the element. Each entry
has its own constants c_theta and c_d. A motion is a 3 x 4 matrix, twelve numbers row by row.
"""

import math

from ..layout import arrays, blocks, places
from ..layout.arrays import Flat, Int32, Numbers
from .chain import Chain

# Coefficients of the polynomials for sine and cosine. The kernel computes both together, in 0.4 of
# the time of two calls of the C library. The coefficients and the parts of pi/2 are from fdlibm
# (Sun Microsystems 1993: k_sin.c, k_cos.c, e_rem_pio2.c). The comment at each constant has its
# name in fdlibm.
SIN_3 = -1.66666666666666324348e-01  # S1 of fdlibm
SIN_5 = 8.33333333332248946124e-03  # S2 of fdlibm
SIN_7 = -1.98412698298579493134e-04  # S3 of fdlibm
SIN_9 = 2.75573137070700676789e-06  # S4 of fdlibm
SIN_11 = -2.50507602534068634195e-08  # S5 of fdlibm
SIN_13 = 1.58969099521155010221e-10  # S6 of fdlibm
COS_4 = 4.16666666666666019037e-02  # C1 of fdlibm
COS_6 = -1.38888888888741095749e-03  # C2 of fdlibm
COS_8 = 2.48015872894767294178e-05  # C3 of fdlibm
COS_10 = -2.75573143513906633035e-07  # C4 of fdlibm
COS_12 = 2.08757232129817482790e-09  # C5 of fdlibm
COS_14 = -1.13596475577881948265e-11  # C6 of fdlibm
# Adding and then subtracting this number rounds a double to an integer, because doubles above 2^52
# are integers.
ROUNDER = 1.5 * 2.0**52
# 2 / pi, and pi / 2 as the sum of three numbers; the first two have 33 bits.
TWO_BY_PI = 6.36619772367581382433e-01
HALF_PI_1 = 1.57079632673412561417e00  # pio2_1 of fdlibm
HALF_PI_2 = 6.07710050630396597660e-11  # pio2_2 of fdlibm
HALF_PI_3 = 2.02226624879595063154e-21  # pio2_2t of fdlibm


def _sincos_reduced(x: float) -> tuple[float, float]:
    # Returns the sine and cosine of an angle x, rad, with |x| up to LARGEST_REDUCED. The function
    # has no branch and no call, so that the compiler can compute the angles of several lanes
    # (poses) at once.
    turns = (x * TWO_BY_PI + ROUNDER) - ROUNDER
    first = x - turns * HALF_PI_1
    second = turns * HALF_PI_2
    r = first - second
    correction = turns * HALF_PI_3 - ((first - r) - second)
    y = r - correction
    tail = (r - y) - correction
    z = y * y
    p = SIN_5 + z * (SIN_7 + z * (SIN_9 + z * (SIN_11 + z * SIN_13)))
    sine = y - ((z * (0.5 * tail - z * y * p) - tail) - z * y * SIN_3)
    p = z * (COS_4 + z * (COS_6 + z * (COS_8 + z * (COS_10 + z * (COS_12 + z * COS_14)))))
    half = 0.5 * z
    w = 1.0 - half
    cosine = w + (((1.0 - w) - half) + (z * p - y * tail))
    # Use conditional expressions, so that the compiler makes selections instead of branches. The
    # processor would predict branches wrongly.
    quarter: Int32 = int(turns)
    sine_of_x = cosine if quarter & 1 else sine
    cosine_of_x = sine if quarter & 1 else cosine
    sign = 1.0 - (quarter & 2)
    other = 1.0 - ((quarter + 1) & 2)
    return sign * sine_of_x, other * cosine_of_x


def sincos(x: float) -> tuple[float, float]:
    """Return the sine and cosine of x, rad, with errors of at most two units in the last place."""
    if abs(x) <= places.LARGEST_REDUCED:
        return _sincos_reduced(x)
    if not math.isfinite(x):  # math.sin raises an error if x is infinite
        return places.NAN, places.NAN
    return math.sin(x), math.cos(x)


def sines_and_cosines(angles: Numbers, sines: Numbers, cosines: Numbers) -> None:
    """
    Write the sines and cosines of LANES angles, rad, each of a size up to LARGEST_REDUCED. The
    results equal those of `sincos`.
    """
    # Use local arrays. The compiler then knows that these arrays overlap with no others, and
    # computes several lanes at once.
    s, c = [0.0] * 16, [0.0] * 16
    for lane in range(places.LANES):
        pair = _sincos_reduced(angles[lane])
        s[lane], c[lane] = pair[0], pair[1]
    for lane in range(places.LANES):
        sines[lane], cosines[lane] = s[lane], c[lane]


def _start(T: Numbers, motion: Flat, lanes: int) -> None:
    for k in range(12):
        for lane in range(lanes):
            T[k * lanes + lane] = motion[k]


def times(T: Numbers, motion: Flat) -> None:
    """
    Multiply the motion T by `motion` from the right, in place; both are 3 x 4 matrices, twelve
    numbers.
    """
    _times(T, motion, 1)


def _times(T: Numbers, motion: Flat, lanes: int) -> None:
    # Read the numbers of `motion` first, because the compiler assumes that each write to T may
    # change `motion`.
    xx, xy, xz, xp = motion[0], motion[1], motion[2], motion[3]
    yx, yy, yz, yp = motion[4], motion[5], motion[6], motion[7]
    zx, zy, zz, zp = motion[8], motion[9], motion[10], motion[11]
    for row in range(3):
        i = 4 * row * lanes
        for lane in range(i, i + lanes):
            x, y, z = T[lane], T[lane + lanes], T[lane + 2 * lanes]
            T[lane] = x * xx + y * yx + z * zx
            T[lane + lanes] = x * xy + y * yy + z * zy
            T[lane + 2 * lanes] = x * xz + y * yz + z * zz
            T[lane + 3 * lanes] = x * xp + y * yp + z * zp + T[lane + 3 * lanes]


def _times_twist(T: Numbers, motion: Flat, lanes: int) -> None:
    # Multiplies the motion T by Rx(alpha) Tx(a) from the right, in place. A product with a general
    # motion would take more operations.
    a, c, s = motion[3], motion[5], motion[9]
    for row in range(3):
        i = 4 * row * lanes
        for lane in range(i, i + lanes):
            x, y, z = T[lane], T[lane + lanes], T[lane + 2 * lanes]
            T[lane + lanes] = y * c + z * s
            T[lane + 2 * lanes] = z * c - y * s
            T[lane + 3 * lanes] = T[lane + 3 * lanes] + x * a


def times_screw(T: Numbers, theta: float, d: float) -> None:
    """
    Multiply the motion T (3, 4) by Rz(theta) Tz(d) from the right, in place; theta in rad, d in m.
    """
    sine, cosine, along = [0.0], [0.0], [0.0]
    pair = sincos(theta)
    sine[0], cosine[0], along[0] = pair[0], pair[1], d
    _times_screw(T, sine, cosine, along, 1)


def _times_screw(T: Numbers, sines: Numbers, cosines: Numbers, d: Numbers, lanes: int) -> None:
    for row in range(3):
        i = 4 * row * lanes
        for lane in range(lanes):
            s, c = sines[lane], cosines[lane]
            x, y = T[i + lane], T[i + lane + lanes]
            T[i + lane] = x * c + y * s
            T[i + lane + lanes] = y * c - x * s
            T[i + lane + 3 * lanes] = T[i + lane + 3 * lanes] + T[i + lane + 2 * lanes] * d[lane]


def _write_motion(T: Numbers, row: Flat, lanes: int) -> None:
    arrays.copy(row, 12 * lanes, T)
    arrays.fill(arrays.after(row, 12 * lanes), 3 * lanes, 0.0)
    arrays.fill(arrays.after(row, 15 * lanes), lanes, 1.0)


def write_quaternion(T: Numbers, row: Flat, at: int) -> None:
    """
    Write the unit quaternion x y z w, w >= 0, of the rotation in T to `row` from index `at`.

    The computation starts from the largest component (Shepperd, 1978), which avoids cancellation.
    """
    _write_quaternion(T, arrays.after(row, at), 1)


def _write_quaternion(T: Numbers, quaternion: Flat, lanes: int) -> None:
    for lane in range(lanes):
        xx, xy, xz = T[lane], T[lane + lanes], T[lane + 2 * lanes]
        yx, yy, yz = T[lane + 4 * lanes], T[lane + 5 * lanes], T[lane + 6 * lanes]
        zx, zy, zz = T[lane + 8 * lanes], T[lane + 9 * lanes], T[lane + 10 * lanes]
        if xx + yy + zz > 0.0:
            x, y, z, w = zy - yz, xz - zx, yx - xy, 1.0 + xx + yy + zz
        elif xx >= yy and xx >= zz:
            x, y, z, w = 1.0 + xx - yy - zz, xy + yx, xz + zx, zy - yz
        elif yy >= zz:
            x, y, z, w = xy + yx, 1.0 - xx + yy - zz, yz + zy, xz - zx
        else:
            x, y, z, w = xz + zx, yz + zy, 1.0 - xx - yy + zz, yx - xy
        scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
        scale = -scale if w < 0.0 else scale
        quaternion[lane] = x * scale
        quaternion[lane + lanes] = y * scale
        quaternion[lane + 2 * lanes] = z * scale
        quaternion[lane + 3 * lanes] = w * scale


def _write_point_and_axis(T: Numbers, step: int, screw: Flat, lanes: int) -> None:
    # `screw` is the place in a row of results where the screw of an element will be stored. Writes
    # to this place a point on the z axis of the element and the direction of the axis. When the
    # tool pose is known, `_finish` computes the screw from the point and the direction, and
    # overwrites both.
    for i in range(3):
        for lane in range(lanes):
            screw[i * step + lane] = T[(4 * i + 3) * lanes + lane]
        for lane in range(lanes):
            screw[(3 + i) * step + lane] = T[(4 * i + 2) * lanes + lane]


def _write_frames(chain: Chain, element: int, frame: int, T: Numbers, row: Flat) -> int:
    # Writes the poses of the frames whose parent is `element` (-1: fixed frames), from index
    # `frame` on. Returns the index of the next frame, which has another parent.
    pose = [0.0] * 12
    while frame < chain.frames and chain.frame_parent[frame] == element:
        offset = arrays.after(chain.frame_offset, 12 * frame)
        if element < 0:
            arrays.copy(pose, 12, offset)
        else:
            arrays.copy(pose, 12, T)
            _times(pose, offset, 1)
        _write_motion(pose, arrays.after(row, chain.frames_at + 16 * frame), 1)
        frame += 1
    return frame


def evaluate_row(chain: Chain, q: Flat, qdot: Flat, depth: int, row: Flat) -> float:
    """
    Fill `row` with the results of `evaluation.evaluate` at one q; return a number that is finite
    if all results are finite.
    """
    T, twist = [0.0] * 12, [0.0] * 12
    return _evaluate(chain, q, qdot, depth, True, row, T, twist, 1)


def write_jacobian(chain: Chain, q: Flat, row: Flat) -> None:
    """
    Fill only the Jacobian and the screws in a row of results at q.

    The search for singular poses needs only these numbers, and takes 5 % less time with this
    function than with `evaluate_row`.
    """
    T, twist = [0.0] * 12, [0.0] * 12
    _evaluate(chain, q, q, places.JACOBIAN, False, row, T, twist, 1)


def room(chain: Chain) -> int:
    """Return how many numbers of scratch memory `evaluate_rows` needs."""
    return places.LANES * (chain.frames_at + 2 * chain.dof)


def evaluate_rows(
    chain: Chain,
    q: Flat,
    qdot: Flat,
    stride: int,
    depth: int,
    rows: Flat,
    width: int,
    work: Flat,
) -> bool:
    """
    Fill the rows of results of LANES poses at once, with depth POSE or JACOBIAN.

    Each row gets the numbers that `evaluate_row` writes. Return False if a number is too large or
    not finite; the caller must then fill the rows one by one.
    """
    n = chain.dof
    positions = arrays.after(work, chain.frames_at * places.LANES)
    rates = arrays.after(positions, n * places.LANES)
    blocks.put_side_by_side(q, n, n, positions)
    blocks.put_side_by_side(qdot, stride, n, rates)
    if not blocks.all_within(positions, 2 * n, places.LARGEST):  # joint positions and velocities
        return False
    # T and `twist` have 12 * LANES numbers each; C needs this number as a literal. They are local
    # arrays, because the compiler then knows that they do not overlap.
    T, twist = [0.0] * 192, [0.0] * 192
    size = _evaluate(chain, positions, rates, depth, True, work, T, twist, places.LANES)
    if not size <= places.LARGEST:
        return False
    count = chain.frames_at if depth >= places.JACOBIAN else places.JACOBIAN_AT
    blocks.put_one_by_one(work, count, rows, width)
    return True


def _evaluate(
    chain: Chain,
    q: Flat,
    qdot: Flat,
    depth: int,
    whole: bool,
    rows: Flat,
    T: Numbers,
    twist: Numbers,
    lanes: int,
) -> float:
    # Fills the rows of results of `lanes` poses. Returns an upper bound of the absolute values of
    # the numbers in the rows. The bound is not finite if a number in the rows is not finite. T and
    # `twist` are local arrays of the caller, twelve numbers for each pose. If `whole` is False, no
    # pose and no twist are written.
    elements, step = chain.elements, chain.entries * lanes
    twisted = chain.form == places.TWISTED
    framed = lanes == 1 and depth >= places.ALL_FRAMES
    screws = arrays.after(rows, chain.screws_at * lanes)
    turn, d, theta = [0.0] * 16, [0.0] * 16, [0.0] * 16  # one number for each of LANES poses
    sines, cosines = [0.0] * 16, [0.0] * 16
    frame = _write_frames(chain, -1, 0, T, rows) if framed else 0
    _start(T, chain.before, lanes)
    for k in range(elements):
        for lane in range(lanes):
            turn[lane] = chain.theta_0[k]
            d[lane] = chain.d_0[k]
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            value = arrays.after(q, chain.joint[e] * lanes)
            by_theta, by_d = chain.by_theta[e], chain.by_d[e]
            for lane in range(lanes):
                turn[lane] += by_theta * value[lane]
                d[lane] += by_d * value[lane]
            if depth >= places.JACOBIAN:
                _write_point_and_axis(T, step, arrays.after(screws, e * lanes), lanes)
        if lanes == 1:
            pair = sincos(turn[0])
            sines[0], cosines[0] = pair[0], pair[1]
        else:
            for lane in range(lanes):
                theta[lane] = turn[lane]
            if not blocks.all_within(theta, 1, places.LARGEST_REDUCED):
                return places.NAN
            sines_and_cosines(theta, sines, cosines)
        _times_screw(T, sines, cosines, d, lanes)
        if framed:
            frame = _write_frames(chain, k, frame, T, rows)
        following = arrays.after(chain.before, 12 * (k + 1))
        if twisted and k < elements - 1:
            _times_twist(T, following, lanes)
        else:
            _times(T, following, lanes)
    if whole:
        _write_motion(T, rows, lanes)
        _write_quaternion(T, arrays.after(rows, places.QUATERNION_AT * lanes), lanes)
    return _finish(chain, qdot, depth, whole, rows, T, twist, lanes)


def _finish(
    chain: Chain,
    qdot: Flat,
    depth: int,
    whole: bool,
    rows: Flat,
    T: Numbers,
    twist: Numbers,
    lanes: int,
) -> float:
    # Completes the rows of results of `lanes` poses after the tool poses T are known. Each row
    # already has, for each entry, a point on the axis of the entry's element and the direction of
    # the axis. An entry is a pair: an element of the chain, and a joint that moves the element.
    # Replaces point and direction by the screw of the entry: linear velocity of the tool's origin
    # and angular velocity of the tool, if the joint has unit velocity. The second half of `twist`
    # is scratch memory for one screw of each pose.
    step = chain.entries * lanes
    screws = arrays.after(rows, chain.screws_at * lanes)
    twists = arrays.after(rows, (places.JACOBIAN_AT + 6 * chain.dof) * lanes)
    sizes = [0.0] * 16
    for lane in range(lanes):
        x, y, z = T[3 * lanes + lane], T[7 * lanes + lane], T[11 * lanes + lane]
        sizes[lane] = abs(x) + abs(y) + abs(z)
    arrays.fill(twist, 6 * lanes, 0.0)
    for e in range(chain.entries if depth >= places.JACOBIAN else 0):
        by_theta, by_d = chain.by_theta[e], chain.by_d[e]
        at = arrays.after(screws, e * lanes)
        rate = arrays.after(qdot, chain.joint[e] * lanes)
        for lane in range(lanes):
            x = T[3 * lanes + lane] - at[lane]
            y = T[7 * lanes + lane] - at[step + lane]
            z = T[11 * lanes + lane] - at[2 * step + lane]
            zx, zy, zz = at[3 * step + lane], at[4 * step + lane], at[5 * step + lane]
            vx = by_theta * (zy * z - zz * y) + by_d * zx
            vy = by_theta * (zz * x - zx * z) + by_d * zy
            vz = by_theta * (zx * y - zy * x) + by_d * zz
            wx, wy, wz = by_theta * zx, by_theta * zy, by_theta * zz
            twist[6 * lanes + lane] = vx
            twist[7 * lanes + lane] = vy
            twist[8 * lanes + lane] = vz
            twist[9 * lanes + lane] = wx
            twist[10 * lanes + lane] = wy
            twist[11 * lanes + lane] = wz
            if not whole:
                continue
            sizes[lane] += abs(vx) + abs(vy) + abs(vz) + abs(wx) + abs(wy) + abs(wz)
            along = rate[lane]
            twist[lane] += vx * along
            twist[lanes + lane] += vy * along
            twist[2 * lanes + lane] += vz * along
            twist[3 * lanes + lane] += wx * along
            twist[4 * lanes + lane] += wy * along
            twist[5 * lanes + lane] += wz * along
        for i in range(6):
            for lane in range(lanes):
                at[i * step + lane] = twist[(6 + i) * lanes + lane]
    if depth >= places.JACOBIAN and chain.form == places.MIXED:
        _add_up_screws(chain, screws, rows, lanes)
    total = 0.0
    for lane in range(lanes):
        for i in range(6 if depth >= places.JACOBIAN and whole else 0):
            twists[i * lanes + lane] = twist[i * lanes + lane]
            sizes[lane] += abs(twist[i * lanes + lane])
        total += sizes[lane]
    return total


def add_up_screws(chain: Chain, screws: Flat, row: Flat) -> None:
    """
    Fill the Jacobian in a row of results: column j is the sum of the screws of joint j.

    A joint may move several elements of the chain. The joint has one screw for each of these
    elements.
    """
    _add_up_screws(chain, screws, row, 1)


def _add_up_screws(chain: Chain, screws: Flat, rows: Flat, lanes: int) -> None:
    n = chain.dof
    J = arrays.after(rows, places.JACOBIAN_AT * lanes)
    arrays.fill(J, 6 * n * lanes, 0.0)
    for e in range(chain.entries):
        for i in range(6):
            column = arrays.after(J, (i * n + chain.joint[e]) * lanes)
            screw = arrays.after(screws, (i * chain.entries + e) * lanes)
            for lane in range(lanes):
                column[lane] += screw[lane]
