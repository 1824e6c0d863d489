"""The second derivative of the Jacobian, along directions of its rows and columns."""

from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Flat


def _third_change(
    row: Flat, screws_at: int, entries: int, a: int, b: int, c: int, x: float, y: float, z: float
) -> float:
    # (x, y, z) . (w_a x (w_b x t_c)), t_c the three numbers from `c` on, each `entries` apart.
    w = arrays.after(row, screws_at + 3 * entries)
    t = arrays.after(row, screws_at)
    tx, ty, tz = t[c], t[c + entries], t[c + 2 * entries]
    bx, by, bz = w[b], w[b + entries], w[b + 2 * entries]
    ax, ay, az = w[a], w[a + entries], w[a + 2 * entries]
    # (y x w_a) . (w_b x t_c)
    return (
        (y * az - z * ay) * (by * tz - bz * ty)
        + (z * ax - x * az) * (bz * tx - bx * tz)
        + (x * ay - y * ax) * (bx * ty - by * tx)
    )


def write_curvature(chain: Chain, row: Flat, Y: Flat, H: Flat) -> None:
    """
    Fill H[a, b] = sum_j Y[j] . d2J[:, j]/dq_a dq_b for the geometric Jacobian (Y in base axes).

    What `gradient.write_of_screws` says once more: of three entries in the order of the chain,
    a, b, c, the tool's velocity changes by w_a x (w_b x v_c), whichever of them is the column; the
    axis of a column by w_a x (w_b x w_i), where a and b are before it.
    """
    n, entries, at = chain.dof, chain.entries, chain.screws_at
    for j in range(n * n):
        H[j] = 0.0
    for j in range(entries):
        for k in range(j, entries):
            change = 0.0
            for i in range(entries):
                first, last = min(i, j), max(i, k)
                y = arrays.after(Y, 6 * chain.joint[i])
                change += _third_change(
                    row, at, entries, first, i + j + k - first - last, last, y[0], y[1], y[2]
                )
                if k < i:
                    change += _third_change(
                        row, at, entries, j, k, i + 3 * entries, y[3], y[4], y[5]
                    )
            a, b = chain.joint[j], chain.joint[k]
            H[a * n + b] += change
            if j != k:
                H[b * n + a] += change
