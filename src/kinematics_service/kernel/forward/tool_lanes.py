"""
The results that follow from the pose of the tool, for LANES rows side by side, as in `chain_pass`
for one.
"""

import math

from ..layout import arrays, lanes, places
from ..layout.arrays import Flat
from .chain import Chain


def _write_quaternions(T: Flat, quaternions: Flat) -> None:
    for lane in range(places.LANES):
        xx, xy, xz = T[lane], T[lane + places.LANES], T[lane + 2 * places.LANES]
        yx, yy, yz = (
            T[lane + 4 * places.LANES],
            T[lane + 5 * places.LANES],
            T[lane + 6 * places.LANES],
        )
        zx, zy, zz = (
            T[lane + 8 * places.LANES],
            T[lane + 9 * places.LANES],
            T[lane + 10 * places.LANES],
        )
        # Selections, not branches, for several lanes at once: z largest, or y, or x, or w.
        x, y, z, w = xz + zx, yz + zy, 1.0 - xx - yy + zz, yx - xy
        larger = yy >= zz
        x = xy + yx if larger else x
        y = 1.0 - xx + yy - zz if larger else y
        z = yz + zy if larger else z
        w = xz - zx if larger else w
        larger = xx >= (yy if yy > zz else zz)
        x = 1.0 + xx - yy - zz if larger else x
        y = xy + yx if larger else y
        z = xz + zx if larger else z
        w = zy - yz if larger else w
        larger = xx + yy + zz > 0.0
        x = zy - yz if larger else x
        y = xz - zx if larger else y
        z = yx - xy if larger else z
        w = 1.0 + xx + yy + zz if larger else w
        scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
        scale = -scale if w < 0.0 else scale
        quaternions[lane] = x * scale
        quaternions[lane + places.LANES] = y * scale
        quaternions[lane + 2 * places.LANES] = z * scale
        quaternions[lane + 3 * places.LANES] = w * scale


def _write_screws(chain: Chain, rates: Flat, row: Flat) -> bool:
    # From points and axes: how each entry moves the tool's origin, and turns the tool; and the
    # twist. Returns False if a number is too large.
    step = chain.entries * places.LANES
    screws = arrays.after(row, chain.screws_at * places.LANES)
    twists = arrays.after(row, (places.JACOBIAN_AT + 6 * chain.dof) * places.LANES)
    # Six numbers of LANES poses: the compiler knows that no other array overlaps with them.
    screw, twist, sizes = [0.0] * 96, [0.0] * 96, [0.0] * 16
    tool = [0.0] * 48
    for lane in range(places.LANES):
        sizes[lane] = 0.0
        tool[lane] = row[3 * places.LANES + lane]
        tool[places.LANES + lane] = row[7 * places.LANES + lane]
        tool[2 * places.LANES + lane] = row[11 * places.LANES + lane]
    for k in range(6 * places.LANES):
        twist[k] = 0.0
    for e in range(chain.entries):
        by_theta, by_d = chain.by_theta[e], chain.by_d[e]
        at = arrays.after(screws, e * places.LANES)
        rate = arrays.after(rates, chain.joint[e] * places.LANES)
        for lane in range(places.LANES):
            x = tool[lane] - at[lane]
            y = tool[places.LANES + lane] - at[step + lane]
            z = tool[2 * places.LANES + lane] - at[2 * step + lane]
            zx, zy, zz = at[3 * step + lane], at[4 * step + lane], at[5 * step + lane]
            vx = by_theta * (zy * z - zz * y) + by_d * zx
            vy = by_theta * (zz * x - zx * z) + by_d * zy
            vz = by_theta * (zx * y - zy * x) + by_d * zz
            wx, wy, wz = by_theta * zx, by_theta * zy, by_theta * zz
            screw[lane] = vx
            screw[places.LANES + lane] = vy
            screw[2 * places.LANES + lane] = vz
            screw[3 * places.LANES + lane] = wx
            screw[4 * places.LANES + lane] = wy
            screw[5 * places.LANES + lane] = wz
            sizes[lane] += abs(vx) + abs(vy) + abs(vz) + abs(wx) + abs(wy) + abs(wz)
            along = rate[lane]
            twist[lane] += vx * along
            twist[places.LANES + lane] += vy * along
            twist[2 * places.LANES + lane] += vz * along
            twist[3 * places.LANES + lane] += wx * along
            twist[4 * places.LANES + lane] += wy * along
            twist[5 * places.LANES + lane] += wz * along
        for i in range(6):
            for lane in range(places.LANES):
                at[i * step + lane] = screw[i * places.LANES + lane]
    for k in range(6 * places.LANES):
        twists[k] = twist[k]
    return lanes.all_within(sizes, 1, places.LARGEST) and lanes.all_within(
        twists, 6, places.LARGEST
    )


def _add_up_screws(chain: Chain, row: Flat) -> None:
    # The Jacobian, if entries and joints differ.
    n = chain.dof
    J = arrays.after(row, places.JACOBIAN_AT * places.LANES)
    screws = arrays.after(row, chain.screws_at * places.LANES)
    for k in range(6 * n * places.LANES):
        J[k] = 0.0
    for e in range(chain.entries):
        for i in range(6):
            column = arrays.after(J, (i * n + chain.joint[e]) * places.LANES)
            screw = arrays.after(screws, (i * chain.entries + e) * places.LANES)
            for lane in range(places.LANES):
                column[lane] += screw[lane]


def finish_rows(chain: Chain, rates: Flat, depth: int, row: Flat) -> bool:
    """
    Complete LANES rows with known poses, and with points and axes in place of the screws. Returns
    False if a number is not finite or too large.
    """
    _write_quaternions(row, arrays.after(row, places.QUATERNION_AT * places.LANES))
    for i in range(3):
        point = arrays.after(row, (places.POSE_AT + 4 * i + 3) * places.LANES)
        if not lanes.all_within(point, 1, places.LARGEST):
            return False
    if depth < places.JACOBIAN:
        return True
    if not _write_screws(chain, rates, row):
        return False
    if chain.form == places.MIXED:
        _add_up_screws(chain, row)
    return True
