# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the residuals of closed loops, and the derivatives (slopes) of the residuals with respect
to joints and passive variables.

A loop has two chains, which begin in one frame. The residual of the loop is the pose of the second
chain's end relative to the first chain's end, in the axes of the frame in which the chains begin.
Loops that share passive variables form a group, and their residuals are stacked in one vector.

The derivative of a residual with respect to a joint or passive variable is a screw: the linear and
angular velocity of an end frame. The rotation part of the derivative is exact only if the two end
frames are parallel.
"""

import math

from ..forward import chain_pass
from ..forward.chain import Chain, Loop, LoopGroup
from ..layout import arrays
from ..layout.arrays import Flat, Numbers


def _write_end(chain: Chain, x: Numbers, T: Numbers, screws: Numbers, at: int) -> None:
    # Writes to T the pose of the end of a chain, and to `screws` the screw of each entry. An entry
    # is a pair: an element of the chain, and a joint or passive variable that moves the element. A
    # screw has six numbers: linear velocity of the origin of the end frame, and angular velocity
    # of the end frame.
    arrays.copy(T, 12, chain.before)
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
    # Writes to `gap` the pose `back` relative to the pose `there`, as translation and rotation
    # vector, six numbers. The two poses are the ends of the two chains of a loop.
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
        scale = 0.5 * angle / sine
        gap[3], gap[4], gap[5] = scale * x, scale * y, scale * z
    else:  # The frames are parallel, or rotated by pi about an unknown axis.
        gap[3], gap[4], gap[5] = angle, angle, angle


def write_residual(group: LoopGroup, x: Numbers, residual: Numbers, screws: Flat) -> float:
    """
    Fill the residual (p,) and the screws of a group of loops at the variables x.

    Returns the largest component of the residual, divided by the scale of the component.

    Parameters
    ----------
    group
        The loops.
    x : shape (variables,), rad or m
        Joints and passive variables.
    residual : shape (p,), m or rad
        The components of the residual; they are 0 if the loops are closed.
    screws : shape (entries, 6)
        For each loop, the screws of its first chain (`there`), then the screws of its second chain
        (`back`). A chain has one screw for each entry. An entry is a pair: an element of the
        chain, and a joint or passive variable that moves the element. The screw is the motion of
        the end of the chain at unit velocity of the joint or variable.
    """
    _write_residuals(group.loop, x, residual, screws)
    largest: float = 0.0
    for i in range(group.count):
        component: float = abs(residual[i]) / group.span[i]
        if component > largest or component != component:  # the second condition keeps NaN
            largest = component
    return largest


def _write_residuals(loop: Loop, x: Numbers, residual: Numbers, screws: Flat) -> None:
    there, back, gap = [0.0] * 12, [0.0] * 12, [0.0] * 6
    _write_end(loop.there, x, there, screws, 0)
    _write_end(loop.back, x, back, screws, 6 * loop.there.entries)
    _write_gap(there, back, gap)
    for i in range(loop.count):
        residual[loop.row + i] = gap[loop.axis[i]]
    if loop.following is not None:
        _write_residuals(loop.following, x, residual, arrays.after(screws, 6 * loop.entries))


def write_slopes(group: LoopGroup, screws: Flat, slopes: Numbers) -> None:
    """
    Fill the derivatives (p, p) of a group's residual with respect to the group's passive
    variables.
    """
    arrays.fill(slopes, group.count * group.count, 0.0)
    _add_slopes(group.loop, group.first, group.count, screws, slopes)


def _add_slopes(loop: Loop, first: int, count: int, screws: Flat, slopes: Numbers) -> None:
    back = arrays.after(screws, 6 * loop.there.entries)
    for e in range(loop.there.entries):
        column = loop.there.joint[e] - first
        if 0 <= column < count:
            for i in range(loop.count):
                slopes[(loop.row + i) * count + column] -= screws[6 * e + loop.axis[i]]
    for e in range(loop.back.entries):
        column = loop.back.joint[e] - first
        if 0 <= column < count:
            for i in range(loop.count):
                slopes[(loop.row + i) * count + column] += back[6 * e + loop.axis[i]]
    if loop.following is not None:
        following = arrays.after(screws, 6 * loop.entries)
        _add_slopes(loop.following, first, count, following, slopes)


def write_by_joint(
    loop: Loop, first: int, dof: int, joint: int, screws: Flat, section: Flat, slopes: Numbers
) -> None:
    """
    Fill the derivative (p,) of a loop group's residual with respect to the position of one joint.

    Only the components of `loop` and of the later loops of the group are filled. The joint also
    moves the passive variables with indices below `first`, which belong to earlier groups. The
    derivatives of the passive variables with respect to the joint are in `section`, the array that
    describes the loops at one pose (see `Closure`).
    """
    back = arrays.after(screws, 6 * loop.there.entries)
    for i in range(loop.count):
        slopes[loop.row + i] = 0.0
    for e in range(loop.there.entries):
        rate = _derivative(loop, first, dof, joint, loop.there.joint[e], section)
        for i in range(loop.count):
            slopes[loop.row + i] -= rate * screws[6 * e + loop.axis[i]]
    for e in range(loop.back.entries):
        rate = _derivative(loop, first, dof, joint, loop.back.joint[e], section)
        for i in range(loop.count):
            slopes[loop.row + i] += rate * back[6 * e + loop.axis[i]]
    if loop.following is not None:
        following = arrays.after(screws, 6 * loop.entries)
        write_by_joint(loop.following, first, dof, joint, following, section, slopes)


def _derivative(
    loop: Loop, first: int, dof: int, joint: int, variable: int, section: Flat
) -> float:
    # Returns the derivative of a joint or passive variable, number `variable`, with respect to
    # joint number `joint`. Passive variables from number `first` on are held constant, so their
    # derivatives are 0. The derivatives of the other passive variables are in `section`.
    if variable < dof:
        return 1.0 if variable == joint else 0.0
    if variable >= first:
        return 0.0
    return section[2 * loop.there.dof + (variable - dof) * dof + joint]
