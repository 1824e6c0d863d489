"""
One pass over the chain for LANES poses side by side, as `chain_pass` does it for one.

Number k of the motion in a lane stands at k * LANES + lane, so that each loop over the lanes does
the same to neighbours in memory, several at once. Every number comes from the same operations in
the same order as for one pose: it is the same to the last bit.
"""

import math

from . import arrays, chain_pass, places
from .arrays import Floats, Integers, Numbers


def _start(T: Numbers, numbers: Floats) -> None:
    for k in range(12):
        for lane in range(places.LANES):
            T[k * places.LANES + lane] = numbers[k]


def _times(T: Numbers, numbers: Floats, at: int) -> None:
    # T becomes T times the constant motion at `at`.
    xx, xy, xz, xp = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3]
    yx, yy, yz, yp = numbers[at + 4], numbers[at + 5], numbers[at + 6], numbers[at + 7]
    zx, zy, zz, zp = numbers[at + 8], numbers[at + 9], numbers[at + 10], numbers[at + 11]
    for row in range(3):
        i = 4 * row * places.LANES
        for lane in range(i, i + places.LANES):
            x, y, z = T[lane], T[lane + places.LANES], T[lane + 2 * places.LANES]
            T[lane] = x * xx + y * yx + z * zx
            T[lane + places.LANES] = x * xy + y * yy + z * zy
            T[lane + 2 * places.LANES] = x * xz + y * yz + z * zz
            T[lane + 3 * places.LANES] = x * xp + y * yp + z * zp + T[lane + 3 * places.LANES]


def _times_twist(T: Numbers, numbers: Floats, at: int) -> None:
    # As `_times`, where the constant motion is a turn about x and a step along it.
    a, c, s = numbers[at + 3], numbers[at + 5], numbers[at + 9]
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
    integers: Integers,
    numbers: Floats,
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
    n = integers[places.JOINTS]
    elements = integers[places.ELEMENTS]
    entries = integers[places.ENTRIES]
    screws = integers[places.SCREWS_AT]
    twisted = integers[places.ONE_TO_ONE] == places.TWISTED
    first_entry = places.CHAIN_HEADER
    entry_joint = first_entry + elements + 1
    theta_0 = 12 * (elements + 1)
    d_0 = theta_0 + elements
    c_theta = d_0 + elements
    c_d = c_theta + entries
    if not _finite(q, qdot, n, each):
        return False
    # LANES numbers each, written out because C arrays are made of them.
    T, pose = [0.0] * 192, [0.0] * 12
    theta, d = [0.0] * 16, [0.0] * 16
    sines, cosines = [0.0] * 16, [0.0] * 16
    _start(T, numbers)
    for k in range(elements):
        for lane in range(places.LANES):
            theta[lane] = numbers[theta_0 + k]
            d[lane] = numbers[d_0 + k]
        for e in range(integers[first_entry + k], integers[first_entry + k + 1]):
            joint = integers[entry_joint + e]
            by_theta, by_d = numbers[c_theta + e], numbers[c_d + e]
            for lane in range(places.LANES):
                theta[lane] += by_theta * q[lane * n + joint]
                d[lane] += by_d * q[lane * n + joint]
            if depth >= places.JACOBIAN:
                _write_points_and_axes(T, entries, width, arrays.after(rows, screws + e))
        if not _reducible(theta):
            return False
        chain_pass.sines_and_cosines(theta, sines, cosines)
        _times_screw(T, sines, cosines, d)
        if twisted and k < elements - 1:
            _times_twist(T, numbers, 12 * (k + 1))
        else:
            _times(T, numbers, 12 * (k + 1))
    total = 0.0
    for lane in range(places.LANES):
        for i in range(12):
            pose[i] = T[i * places.LANES + lane]
        total += chain_pass.finish_row(
            integers,
            numbers,
            pose,
            arrays.after(qdot, lane * each),
            depth,
            arrays.after(rows, lane * width),
        )
    return math.isfinite(total)
