"""
The gradient of the measures of LANES evaluated rows side by side, as `singularity` has it of one.
"""

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers


def _add_turned(Y: Flat, screw: Flat, step: int, total: Numbers) -> None:
    # Of an entry: Yv x w, `step` numbers between the components of its screw.
    w = arrays.after(screw, 3 * step)
    for lane in range(places.LANES):
        x, y, z = Y[lane], Y[places.LANES + lane], Y[2 * places.LANES + lane]
        wx, wy, wz = w[lane], w[step + lane], w[2 * step + lane]
        total[lane] += y * wz - z * wy
        total[places.LANES + lane] += z * wx - x * wz
        total[2 * places.LANES + lane] += x * wy - y * wx


def _add_carried(Y: Flat, screw: Flat, step: int, total: Numbers) -> None:
    # Of an entry: v x Yv + w x Yw.
    w = arrays.after(screw, 3 * step)
    for lane in range(places.LANES):
        x, y, z = Y[lane], Y[places.LANES + lane], Y[2 * places.LANES + lane]
        a, b, c = (
            Y[3 * places.LANES + lane],
            Y[4 * places.LANES + lane],
            Y[5 * places.LANES + lane],
        )
        vx, vy, vz = screw[lane], screw[step + lane], screw[2 * step + lane]
        wx, wy, wz = w[lane], w[step + lane], w[2 * step + lane]
        total[lane] += vy * z - vz * y + wy * c - wz * b
        total[places.LANES + lane] += vz * x - vx * z + wz * a - wx * c
        total[2 * places.LANES + lane] += vx * y - vy * x + wx * b - wy * a


def _add_along(screw: Flat, step: int, total: Numbers, gradient: Flat) -> None:
    # Of half a screw: its product with a sum.
    for lane in range(places.LANES):
        x, y, z = total[lane], total[places.LANES + lane], total[2 * places.LANES + lane]
        gradient[lane] += screw[lane] * x + screw[step + lane] * y + screw[2 * step + lane] * z


def fill_gradient(chain: Chain, screws: Flat, Y: Flat, gradient: Flat) -> None:
    """Fill the sums of Y[j] . dJ[:, j]/dq_k for each joint k of LANES poses."""
    step = chain.entries * places.LANES
    before, behind = [0.0] * 48, [0.0] * 48  # three numbers of LANES poses
    for k in range(3 * places.LANES):
        before[k] = behind[k] = 0.0
    for k in range(chain.dof * places.LANES):
        gradient[k] = 0.0
    for k in range(chain.elements):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * places.LANES)
            _add_along(arrays.after(screws, e * places.LANES), step, before, into)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * places.LANES)
            _add_turned(y, arrays.after(screws, e * places.LANES), step, before)
    for k in range(chain.elements - 1, -1, -1):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * places.LANES)
            _add_carried(y, arrays.after(screws, e * places.LANES), step, behind)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * places.LANES)
            _add_along(arrays.after(screws, e * places.LANES + 3 * step), step, behind, into)
