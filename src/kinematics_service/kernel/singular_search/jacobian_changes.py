"""
Evaluate how the tool's velocity along a motion changes with the joints.

Entries have screws (v, w), in the order of the chain. The tool's velocity by an entry behind e, or
by e itself, changes by w_e x v and w_e x w; by an entry before e it changes by w x v_e. Entries of
one element have one axis: their order does not matter.
"""

from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Flat, Numbers


def write_changes(chain: Chain, row: Flat, x: Flat, changes: Flat) -> None:
    """
    Fill the changes (entries, 6) of J x with what each entry of the chain moves.

    J is geometric, in base axes, and x (n,) are held.
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
    # (x, y, z) x b, of three numbers from an index on.
    into[at] = y * b[begin + 2] - z * b[begin + 1]
    into[at + 1] = z * b[begin] - x * b[begin + 2]
    into[at + 2] = x * b[begin + 1] - y * b[begin]


def _add_turn(w: Flat, e: int, entries: int, rate: float, total: Numbers) -> None:
    # Add the turn of an entry at a rate.
    for k in range(3):
        total[k] += rate * w[e + k * entries]


def write_slope(chain: Chain, changes: Flat, y: Flat, slope: Flat) -> None:
    """Fill the gradient (n,) of y' J x of its changes, y (6,) held too."""
    arrays.fill(slope, chain.dof, 0.0)
    for e in range(chain.entries):
        slope[chain.joint[e]] += arrays.dot(y, arrays.after(changes, 6 * e), 6)
