# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the derivatives of the tool velocity J x by the joint positions. The joint velocities x are
constant.

A chain consists of elements, which are screw motions about z. If two joints move one element, the
chain has two entries for this element: an entry is a pair of an element and a joint that moves it.
Each entry has a screw (v, w): the linear and angular velocity of the tool if the joint moves only
this element, at unit velocity. Entries are numbered from the base to the tool.

If the joint of entry e moves the element of entry e, the screws change. The derivatives of a screw
(v, w) by the joint position are (`cross` is the vector product):

- If the screw belongs to e or a later entry: cross(w_e, v) for v, and cross(w_e, w) for w.
- If the screw belongs to an earlier entry: cross(w, v_e) for v, and 0 for w.

Entries of one element have the same axis, so their order does not matter.
"""

from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Flat, Numbers


def write_changes(chain: Chain, row: Flat, x: Flat, changes: Flat) -> None:
    """
    Fill `changes` (entries, 6) with derivatives of the tool velocity J x by joint positions.

    An entry of the chain is a pair of a joint and an element (a screw) that the joint moves. If a
    joint moves two elements, it has two entries. Row e of `changes` belongs to entry e. It has the
    derivative by the position of the joint, as if the joint moved only this element.

    J is the geometric Jacobian in base axes. The joint velocities x (n,) are constant.
    """
    entries = chain.entries
    v = arrays.after(row, chain.screws_at)
    w = arrays.after(v, 3 * entries)
    behind, before = [0.0] * 6, [0.0] * 3
    arrays.fill(behind, 6, 0.0)
    arrays.fill(before, 3, 0.0)
    for e in range(entries - 1, -1, -1):
        rate = x[chain.joint[e]]
        for k in range(6):
            behind[k] += rate * v[e + k * entries]
        change = arrays.after(changes, 6 * e)
        for half in range(2):
            wx, wy, wz = w[e], w[e + entries], w[e + 2 * entries]
            _write_cross(wx, wy, wz, behind, 3 * half, change, 3 * half)
    for e in range(entries):
        change = arrays.after(changes, 6 * e)
        vx, vy, vz = v[e], v[e + entries], v[e + 2 * entries]
        change[0] += before[1] * vz - before[2] * vy
        change[1] += before[2] * vx - before[0] * vz
        change[2] += before[0] * vy - before[1] * vx
        _add_turn(w, e, entries, x[chain.joint[e]], before)


def _write_cross(
    x: float, y: float, z: float, b: Numbers, begin: int, into: Numbers, at: int
) -> None:
    # Writes the vector product of (x, y, z) and (b[begin], b[begin + 1], b[begin + 2]) to `into`
    # from index `at`.
    into[at] = y * b[begin + 2] - z * b[begin + 1]
    into[at + 1] = z * b[begin] - x * b[begin + 2]
    into[at + 2] = x * b[begin + 1] - y * b[begin]


def _add_turn(w: Flat, e: int, entries: int, rate: float, total: Numbers) -> None:
    # An entry is a pair of an element of the chain and a joint that moves the element. Column e of
    # w (3, entries) is the angular velocity of the tool if entry e moves at unit velocity. Adds
    # `rate` times this column to `total`.
    for k in range(3):
        total[k] += rate * w[e + k * entries]


def write_slope(chain: Chain, changes: Flat, y: Flat, slope: Flat) -> None:
    """
    Fill `slope` (n,) with the gradient of y^T J x by the joints, where x is a constant joint
    velocity and y a constant vector (6,). `changes` comes from `write_changes` with x.
    """
    arrays.fill(slope, chain.dof, 0.0)
    for e in range(chain.entries):
        slope[chain.joint[e]] += arrays.dot(y, arrays.after(changes, 6 * e), 6)
