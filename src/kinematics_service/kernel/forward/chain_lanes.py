"""
One pass over the chain for LANES poses side by side, as `chain_pass` does it for one.

The arrays side by side have the columns of a row. Every number comes from the same operations
in the same order as for one pose: it is the same to the last bit.
"""

from ..layout import arrays, lanes, places
from ..layout.arrays import Flat, Numbers
from . import chain_pass, tool_lanes
from .chain import Chain


def _start(T: Numbers, motion: Flat) -> None:
    for k in range(12):
        for lane in range(places.LANES):
            T[k * places.LANES + lane] = motion[k]


def _times(T: Numbers, motion: Flat) -> None:
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


def _times_twist(T: Numbers, motion: Flat) -> None:
    # Like `_times`, for a constant motion that is a turn about x and a step along it.
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


def _write_point_and_axis(T: Numbers, step: int, screw: Flat) -> None:
    # Of an element, for one entry; they become the screw, once the tool is known.
    for i in range(3):
        for lane in range(places.LANES):
            screw[i * step + lane] = T[(4 * i + 3) * places.LANES + lane]
        for lane in range(places.LANES):
            screw[(3 + i) * step + lane] = T[(4 * i + 2) * places.LANES + lane]


def _put_motion(T: Numbers, row: Flat) -> None:
    for k in range(12 * places.LANES):
        row[k] = T[k]
    for k in range(12 * places.LANES, 15 * places.LANES):
        row[k] = 0.0
    for k in range(15 * places.LANES, 16 * places.LANES):
        row[k] = 1.0


def room(chain: Chain) -> int:
    """Return the number of scratch numbers of `evaluate_rows`."""
    return places.LANES * (chain.frames_at + 2 * chain.dof)


def evaluate_rows(
    chain: Chain,
    q: Flat,
    qdot: Flat,
    each: int,
    depth: int,
    rows: Flat,
    width: int,
    work: Flat,
) -> bool:
    """
    Fill LANES rows, of depth POSE or JACOBIAN, as `chain_pass.evaluate_row` fills each.

    Returns False if they have to be filled one by one: a number is not finite or too large.
    """
    n, elements, step = chain.dof, chain.elements, chain.entries * places.LANES
    twisted = chain.form == places.TWISTED
    positions = arrays.after(work, chain.frames_at * places.LANES)
    rates = arrays.after(positions, n * places.LANES)
    screws = arrays.after(work, chain.screws_at * places.LANES)
    lanes.put_side_by_side(q, n, n, positions)
    lanes.put_side_by_side(qdot, each, n, rates)
    if not lanes.all_within(positions, 2 * n, places.LARGEST):  # of the rates, too
        return False
    # LANES numbers each, as literals because C arrays are made of them. The compiler knows that
    # arrays of this module alone overlap with no others.
    T, turn, d = [0.0] * 192, [0.0] * 16, [0.0] * 16
    theta, sines, cosines = [0.0] * 16, [0.0] * 16, [0.0] * 16
    _start(T, chain.before)
    for k in range(elements):
        for lane in range(places.LANES):
            turn[lane] = chain.theta_0[k]
            d[lane] = chain.d_0[k]
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            value = arrays.after(positions, chain.joint[e] * places.LANES)
            by_theta, by_d = chain.by_theta[e], chain.by_d[e]
            for lane in range(places.LANES):
                turn[lane] += by_theta * value[lane]
                d[lane] += by_d * value[lane]
            if depth >= places.JACOBIAN:
                _write_point_and_axis(T, step, arrays.after(screws, e * places.LANES))
        for lane in range(places.LANES):
            theta[lane] = turn[lane]
        if not lanes.all_within(theta, 1, places.LARGEST_REDUCED):
            return False
        chain_pass.sines_and_cosines(theta, sines, cosines)
        _times_screw(T, sines, cosines, d)
        if twisted and k < elements - 1:
            _times_twist(T, arrays.after(chain.before, 12 * (k + 1)))
        else:
            _times(T, arrays.after(chain.before, 12 * (k + 1)))
    _put_motion(T, work)
    if not tool_lanes.finish_rows(chain, rates, depth, work):
        return False
    count = chain.frames_at if depth >= places.JACOBIAN else places.JACOBIAN_AT
    lanes.put_one_by_one(work, count, rows, width)
    return True
