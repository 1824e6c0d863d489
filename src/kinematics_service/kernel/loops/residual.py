"""
How far the two chains of a loop are from meeting, and how that changes with their variables.

Both begin in the same frame, and everything is in its axes. The slopes are those of the ends'
screws: exact for the position, and for the rotation where the ends are parallel.
"""

import math

from ..forward import chain_pass
from ..forward.chain import Chain, Loop
from ..layout import arrays
from ..layout.arrays import Floats, Numbers


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


def write_residual(loop: Loop, x: Numbers, residual: Numbers, screws: Numbers) -> float:
    """
    Fill the residual of a loop (p,) and the screws of its entries; return its largest component.

    Parameters
    ----------
    loop
        The loop.
    x : shape (variables,), rad or m
        Joints and passive variables.
    residual : shape (p,), m or rad
        The components that are to vanish.
    screws : shape (2 MOST_LOOP_ENTRIES, 6)
        Of the entries of `there`, then of those of `back`, each of its own end.
    """
    there, back, gap = [0.0] * 12, [0.0] * 12, [0.0] * 6
    _walk(loop.there, x, there, screws, 0)
    _walk(loop.back, x, back, screws, 6 * loop.there.entries)
    _write_gap(there, back, gap)
    largest = 0.0
    for i in range(loop.count):
        residual[i] = gap[loop.axis[i]]
        amount = abs(residual[i])
        if loop.axis[i] < 3:
            amount /= loop.size
        if not amount <= largest:  # also where it is not a number
            largest = amount
    return largest


def write_slopes(loop: Loop, screws: Numbers, slopes: Numbers) -> None:
    """
    Fill the slopes (p, p) of the residual by the loop's own passive variables.
    """
    for i in range(loop.count * loop.count):
        slopes[i] = 0.0
    for e in range(loop.there.entries):
        _add_slope(loop, loop.there.joint[e], screws, 6 * e, -1.0, slopes)
    for e in range(loop.back.entries):
        k = 6 * (loop.there.entries + e)
        _add_slope(loop, loop.back.joint[e], screws, k, 1.0, slopes)


def _add_slope(
    loop: Loop, variable: int, screws: Numbers, at: int, sign: float, slopes: Numbers
) -> None:
    column = variable - loop.first
    if 0 <= column < loop.count:
        for i in range(loop.count):
            slopes[i * loop.count + column] += sign * screws[at + loop.axis[i]]


def write_by_joint(
    loop: Loop, dof: int, joint: int, screws: Numbers, section: Floats, slopes: Numbers
) -> None:
    """
    Fill the slope (p,) of the residual by a joint of the arm: its own motion, and that of the
    passive variables of the loops before, which follow it as `section` says.
    """
    for i in range(loop.count):
        slopes[i] = 0.0
    for e in range(loop.there.entries):
        share = _share(loop, dof, joint, loop.there.joint[e], section)
        for i in range(loop.count):
            slopes[i] -= share * screws[6 * e + loop.axis[i]]
    for e in range(loop.back.entries):
        share = _share(loop, dof, joint, loop.back.joint[e], section)
        k = 6 * (loop.there.entries + e)
        for i in range(loop.count):
            slopes[i] += share * screws[k + loop.axis[i]]


def _share(loop: Loop, dof: int, joint: int, variable: int, section: Floats) -> float:
    # How a variable follows a joint; none of the loop's own does yet.
    if variable < dof:
        return 1.0 if variable == joint else 0.0
    if variable >= loop.first:
        return 0.0
    return section[2 * loop.there.dof + (variable - dof) * dof + joint]
