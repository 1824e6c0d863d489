"""
One pass over the chain for LANES poses side by side, as `chain_pass` does it for one.

Number k of the motion in a lane stands at k * LANES + lane, so that each loop over the lanes does
the same to neighbours in memory, several at once. Every number comes from the same operations in
the same order as for one pose: it is the same to the last bit.
"""

import math

from . import arrays, chain_pass, places
from .arrays import Floats, Numbers
from .chain import Chain


def _start(T: Numbers, motion: Floats) -> None:
    for k in range(12):
        for lane in range(places.LANES):
            T[k * places.LANES + lane] = motion[k]


def _times(T: Numbers, motion: Floats) -> None:
    # T becomes T times a constant motion.
    xx, xy, xz, xp = motion[0], motion[1], motion[2], motion[3]
    yx, yy, yz, yp = motion[4], motion[5], motion[6], motion[7]
    zx, zy, zz, zp = motion[8], motion[9], motion[10], motion[11]
    for row in range(3):
        i = 4 * row * places.LANES
        for lane in range(i, i + places.LANES):
            x, y, z = T[lane], T[lane + places.LANES], T[lane + 2 * places.LANES]
            T[lane] = x * xx + y * yx + z * zx
            T[lane + places.LANES] = x * xy + y * yy + z * zy
            T[lane + 2 * places.LANES] = x * xz + y * yz + z * zz
            T[lane + 3 * places.LANES] = x * xp + y * yp + z * zp + T[lane + 3 * places.LANES]


def _times_twist(T: Numbers, motion: Floats) -> None:
    # As `_times`, where the constant motion is a turn about x and a step along it.
    a, c, s = motion[3], motion[5], motion[9]
    for row in range(3):
        i = 4 * row * places.LANES
        for lane in range(i, i + places.LANES):
            x, y, z = T[lane], T[lane + places.LANES], T[lane + 2 * places.LANES]
            T[lane + places.LANES] = y * c + z * s
            T[lane + 2 * places.LANES] = z * c - y * s
            T[lane + 3 * places.LANES] = T[lane + 3 * places.LANES] + x * a


def _times_screw(T: Numbers, sines: Numbers, cosines: Numbers, d: Numbers) -> None:
    # T becomes T Rz(theta) Tz(d).
    for row in range(3):
        i = 4 * row * places.LANES
        for lane in range(places.LANES):
            s, c = sines[lane], cosines[lane]
            x, y = T[i + lane], T[i + lane + places.LANES]
            T[i + lane] = x * c + y * s
            T[i + lane + places.LANES] = y * c - x * s
            T[i + lane + 3 * places.LANES] = (
                T[i + lane + 3 * places.LANES] + T[i + lane + 2 * places.LANES] * d[lane]
            )


def _write_points_and_axes(T: Numbers, entries: int, width: int, screws: Floats) -> None:
    # Of an element, for one entry; they become the screw, once the tool is known.
    for lane in range(places.LANES):
        screw = arrays.after(screws, lane * width)
        for i in range(3):
            screw[i * entries] = T[(4 * i + 3) * places.LANES + lane]
            screw[(3 + i) * entries] = T[(4 * i + 2) * places.LANES + lane]


def _finite(q: Floats, qdot: Floats, n: int, each: int) -> bool:
    nothing = 0.0
    for k in range(places.LANES * n):
        nothing += 0.0 * q[k]  # not a number where one is not finite
    for k in range(places.LANES * n if each > 0 else n):
        nothing += 0.0 * qdot[k]
    return nothing == 0.0


def _reducible(angles: Numbers) -> bool:
    beyond = 0
    for lane in range(places.LANES):
        beyond += 0 if abs(angles[lane]) <= places.LARGEST_REDUCED else 1
    return beyond == 0


def evaluate_rows(
    chain: Chain,
    q: Floats,
    qdot: Floats,
    each: int,
    depth: int,
    width: int,
    rows: Floats,
) -> bool:
    """
    Fill LANES rows, of depth POSE or JACOBIAN, as `chain_pass.evaluate_row` fills each.

    Returns False where they have to be filled one by one: a number is not finite or too large.

    """
    n, elements = chain.dof, chain.elements
    twisted = chain.form == places.TWISTED
    screws = arrays.after(rows, chain.screws_at)
    if not _finite(q, qdot, n, each):
        return False
    # LANES numbers each, written out because C arrays are made of them.
    T, pose = [0.0] * 192, [0.0] * 12
    theta, d = [0.0] * 16, [0.0] * 16
    sines, cosines = [0.0] * 16, [0.0] * 16
    _start(T, chain.before)
    for k in range(elements):
        for lane in range(places.LANES):
            theta[lane] = chain.theta_0[k]
            d[lane] = chain.d_0[k]
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            joint = chain.joint[e]
            by_theta, by_d = chain.by_theta[e], chain.by_d[e]
            for lane in range(places.LANES):
                theta[lane] += by_theta * q[lane * n + joint]
                d[lane] += by_d * q[lane * n + joint]
            if depth >= places.JACOBIAN:
                _write_points_and_axes(T, chain.entries, width, arrays.after(screws, e))
        if not _reducible(theta):
            return False
        chain_pass.sines_and_cosines(theta, sines, cosines)
        _times_screw(T, sines, cosines, d)
        if twisted and k < elements - 1:
            _times_twist(T, arrays.after(chain.before, 12 * (k + 1)))
        else:
            _times(T, arrays.after(chain.before, 12 * (k + 1)))
    total = 0.0
    for lane in range(places.LANES):
        for i in range(12):
            pose[i] = T[i * places.LANES + lane]
        total += chain_pass.finish_row(
            chain,
            pose,
            arrays.after(qdot, lane * each),
            depth,
            arrays.after(rows, lane * width),
        )
    return math.isfinite(total)
