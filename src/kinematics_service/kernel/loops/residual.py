"""
How far the two chains of each loop are from meeting, and how that changes with their variables.

The components of loops that are solved together stand one after another. Both chains of a loop
begin in the same frame, and everything is in its axes. The slopes are those of the ends' screws:
exact for the position, and for the rotation where the ends are parallel.
"""

import math

from ..forward import chain_pass
from ..forward.chain import Chain, Loop, LoopGroup
from ..layout import arrays
from ..layout.arrays import Flat, Numbers


def _walk(chain: Chain, x: Numbers, T: Numbers, screws: Numbers, at: int) -> None:
    # The pose of a chain's end, and the screw of each entry, six numbers each: how it moves the
    # end's origin, and turns the end.
    chain_pass.start(T, chain.before)
    for k in range(chain.elements):
        theta = chain.theta_0[k]
        d = chain.d_0[k]
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            value = x[chain.joint[e]]
            theta += chain.by_theta[e] * value
            d += chain.by_d[e] * value
            for i in range(3):
                screws[at + 6 * e + i] = T[4 * i + 3]
                screws[at + 6 * e + 3 + i] = T[4 * i + 2]
        chain_pass.times_screw(T, theta, d)
        chain_pass.times(T, arrays.after(chain.before, 12 * (k + 1)))
    for e in range(chain.entries):
        k = at + 6 * e
        rx, ry, rz = T[3] - screws[k], T[7] - screws[k + 1], T[11] - screws[k + 2]
        zx, zy, zz = screws[k + 3], screws[k + 4], screws[k + 5]
        by_theta, by_d = chain.by_theta[e], chain.by_d[e]
        screws[k] = by_theta * (zy * rz - zz * ry) + by_d * zx
        screws[k + 1] = by_theta * (zz * rx - zx * rz) + by_d * zy
        screws[k + 2] = by_theta * (zx * ry - zy * rx) + by_d * zz
        screws[k + 3] = by_theta * zx
        screws[k + 4] = by_theta * zy
        screws[k + 5] = by_theta * zz


def _write_gap(there: Numbers, back: Numbers, gap: Numbers) -> None:
    # The end of `back` seen from that of `there`: the way, and the rotation vector.
    x, y, z, along = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        gap[i] = back[4 * i + 3] - there[4 * i + 3]
        ax, ay, az = there[i], there[4 + i], there[8 + i]
        bx, by, bz = back[i], back[4 + i], back[8 + i]
        x += ay * bz - az * by
        y += az * bx - ax * bz
        z += ax * by - ay * bx
        along += ax * bx + ay * by + az * bz
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, 0.5 * (along - 1.0))
    if sine > 0.0:
        share = 0.5 * angle / sine
        gap[3], gap[4], gap[5] = share * x, share * y, share * z
    else:  # parallel, or turned by half a turn about any axis
        gap[3], gap[4], gap[5] = angle, angle, angle


def write_residual(group: LoopGroup, x: Numbers, residual: Numbers, screws: Flat) -> float:
    """
    Fill the residual of a group of loops (p,) and the screws of its entries; return its largest
    component.

    Parameters
    ----------
    group
        The loops.
    x : shape (variables,), rad or m
        Joints and passive variables.
    residual : shape (p,), m or rad
        The components that are to vanish.
    screws : shape (entries, 6)
        Of each loop the entries of `there`, then those of `back`, each of its own end.
    """
    return _write_residuals(group.loop, group.loops, group.size, x, residual, screws, 0.0)


def _write_residuals(
    loop: Loop,
    left: int,
    size: float,
    x: Numbers,
    residual: Numbers,
    screws: Flat,
    largest: float,
) -> float:
    there, back, gap = [0.0] * 12, [0.0] * 12, [0.0] * 6
    _walk(loop.there, x, there, screws, 0)
    _walk(loop.back, x, back, screws, 6 * loop.there.entries)
    _write_gap(there, back, gap)
    for i in range(loop.count):
        component = gap[loop.axis[i]]
        residual[loop.row + i] = component
        amount: float = abs(component)
        if loop.axis[i] < 3:
            amount /= size
        if amount > largest or amount != amount:  # one that is not a number stays
            largest = amount
    if left == 1:
        return largest
    following = arrays.after(screws, 6 * loop.entries)
    return _write_residuals(loop.following, left - 1, size, x, residual, following, largest)


def write_slopes(group: LoopGroup, screws: Flat, slopes: Numbers) -> None:
    """
    Fill the slopes (p, p) of the residual by the group's own passive variables.
    """
    arrays.fill(slopes, group.count * group.count, 0.0)
    _write_slopes(group.loop, group.loops, group.first, group.count, screws, slopes)


def _write_slopes(
    loop: Loop, left: int, first: int, count: int, screws: Flat, slopes: Numbers
) -> None:
    for e in range(loop.there.entries):
        column = loop.there.joint[e] - first
        if 0 <= column < count:
            for i in range(loop.count):
                slopes[(loop.row + i) * count + column] -= screws[6 * e + loop.axis[i]]
    back = arrays.after(screws, 6 * loop.there.entries)
    for e in range(loop.back.entries):
        column = loop.back.joint[e] - first
        if 0 <= column < count:
            for i in range(loop.count):
                slopes[(loop.row + i) * count + column] += back[6 * e + loop.axis[i]]
    if left > 1:
        following = arrays.after(screws, 6 * loop.entries)
        _write_slopes(loop.following, left - 1, first, count, following, slopes)


def write_by_joint(
    group: LoopGroup, dof: int, joint: int, screws: Flat, section: Flat, slopes: Numbers
) -> None:
    """
    Fill the slope (p,) of the residual by a joint of the arm: its own motion, and that of the
    passive variables of the groups before, which follow it as `section` says.
    """
    _write_by_joint(group.loop, group.loops, group.first, dof, joint, screws, section, slopes)


def _write_by_joint(
    loop: Loop,
    left: int,
    first: int,
    dof: int,
    joint: int,
    screws: Flat,
    section: Flat,
    slopes: Numbers,
) -> None:
    for i in range(loop.count):
        slopes[loop.row + i] = 0.0
    for e in range(loop.there.entries):
        share = _share(loop, first, dof, joint, loop.there.joint[e], section)
        for i in range(loop.count):
            slopes[loop.row + i] -= share * screws[6 * e + loop.axis[i]]
    for e in range(loop.back.entries):
        share = _share(loop, first, dof, joint, loop.back.joint[e], section)
        k = 6 * (loop.there.entries + e)
        for i in range(loop.count):
            slopes[loop.row + i] += share * screws[k + loop.axis[i]]
    if left > 1:
        following = arrays.after(screws, 6 * loop.entries)
        _write_by_joint(loop.following, left - 1, first, dof, joint, following, section, slopes)


def _share(loop: Loop, first: int, dof: int, joint: int, variable: int, section: Flat) -> float:
    # How a variable follows a joint; none of the group's own does yet.
    if variable < dof:
        return 1.0 if variable == joint else 0.0
    if variable >= first:
        return 0.0
    return section[2 * loop.there.dof + (variable - dof) * dof + joint]
