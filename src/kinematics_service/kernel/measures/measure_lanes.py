"""
The singularity measures of LANES evaluated rows side by side, as `singularity` has them of one.

Number k of the row in a lane stands at k * LANES + lane, in the rows and in the measures. Every
number comes from the same operations in the same order as for one row: it is the same to the last
bit. Poses with singular values that count as zero have other rules, and are left to it.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat
from . import gradient_lanes, jacobi_lanes
from .task_rows import TaskRows

# Fourth powers of longer rows of J_t would overflow.
LARGEST_NORM = 1e75
# A bit for each lane.
ALL_LANES = 0xFFFF


def _to_base_axes(task: TaskRows, vectors: Flat) -> None:
    # Constants first: to the compiler what is written might change them.
    xx, xy, xz = task.rotation[0], task.rotation[1], task.rotation[2]
    yx, yy, yz = task.rotation[3], task.rotation[4], task.rotation[5]
    zx, zy, zz = task.rotation[6], task.rotation[7], task.rotation[8]
    for half in range(2):
        v = arrays.after(vectors, 3 * half * places.LANES)
        for lane in range(places.LANES):
            x, y, z = v[lane], v[places.LANES + lane], v[2 * places.LANES + lane]
            v[lane] = xx * x + xy * y + xz * z
            v[places.LANES + lane] = yx * x + yy * y + yz * z
            v[2 * places.LANES + lane] = zx * x + zy * y + zz * z


def _fill_task_rows(n: int, task: TaskRows, J: Flat, W: Flat, width: int) -> None:
    m = task.count
    count, length = min(m, n), max(m, n)
    for i in range(m):
        axis = task.axis[i]
        component = axis if axis < 3 else axis - 3
        a = task.rotation[component]
        b = task.rotation[3 + component]
        c = task.rotation[6 + component]
        for j in range(n):
            x = arrays.after(J, ((axis - component) * n + j) * places.LANES)
            y, z = arrays.after(x, n * places.LANES), arrays.after(x, 2 * n * places.LANES)
            place = i * width + j if n > m else j * width + i
            into = arrays.after(W, place * places.LANES)
            for lane in range(places.LANES):
                into[lane] = a * x[lane] + b * y[lane] + c * z[lane]
    for i in range(count):
        for j in range(length, width):
            into = arrays.after(W, (i * width + j) * places.LANES)
            for lane in range(places.LANES):
                into[lane] = 1.0 if j - length == i else 0.0


def _scale_task_rows(n: int, task: TaskRows, W: Flat) -> None:
    m = task.count
    width = m + n
    for i in range(m):
        for j in range(n):
            place = i * width + j if n > m else j * width + i
            into = arrays.after(W, place * places.LANES)
            scale = task.row_scale[i] * task.column_scale[j]
            for lane in range(places.LANES):
                into[lane] = into[lane] * scale + 0.0


def _decompose(W: Flat, sigma: Flat, count: int, length: int, width: int) -> bool:
    # Returns False if a number is so large that powers of it are not finite.
    jacobi_lanes.sort_by_norm(W, sigma, count, length, width)
    small = 0
    for lane in range(places.LANES):
        small += 1 if sigma[lane] < LARGEST_NORM else 0
    if small < places.LANES:
        return False
    jacobi_lanes.orthogonalise(W, count, length, width)
    jacobi_lanes.sort_by_norm(W, sigma, count, length, width)
    return True


def _write_determinant(n: int, W: Flat, spare: Flat, measures: Flat) -> None:
    determinants = arrays.after(measures, places.DETERMINANT * places.LANES)
    for i in range(n):
        for k in range(n * places.LANES):
            spare[i * n * places.LANES + k] = W[i * 2 * n * places.LANES + k]
    jacobi_lanes.determinants(spare, n, determinants)
    for lane in range(places.LANES):
        measures[places.MANIPULABILITY * places.LANES + lane] = abs(determinants[lane])


def _write_volume(
    n: int,
    task: TaskRows,
    J: Flat,
    W: Flat,
    sigma: Flat,
    measures: Flat,
) -> bool:
    m = task.count
    count, length = min(m, n), max(m, n)
    volume = arrays.after(measures, places.MANIPULABILITY * places.LANES)
    _fill_task_rows(n, task, J, W, length)
    if not _decompose(W, sigma, count, length, length):
        return False
    for lane in range(places.LANES):
        measures[places.DETERMINANT * places.LANES + lane] = places.NAN
        volume[lane] = 1.0
    for column in range(count):
        k = column * places.LANES
        for lane in range(places.LANES):
            volume[lane] *= sigma[k + lane]
    return True


def _irregular(sigma: Flat, count: int) -> int:
    # Returns a bit for each lane with a singular value that counts as zero.
    lanes = 0
    smallest = arrays.after(sigma, (count - 1) * places.LANES)
    for lane in range(places.LANES):
        if not smallest[lane] > places.RANK_TOLERANCE * sigma[lane]:
            lanes |= 1 << lane
    return lanes


def _write_values(sigma: Flat, count: int, measures: Flat) -> None:
    smallest = arrays.after(sigma, (count - 1) * places.LANES)
    for lane in range(places.LANES):
        measures[places.RANK * places.LANES + lane] = count
        measures[places.SMALLEST_SINGULAR_VALUE * places.LANES + lane] = smallest[lane]
        measures[places.CONDITION_NUMBER * places.LANES + lane] = sigma[lane] / smallest[lane]


def _fill_slopes(n: int, task: TaskRows, W: Flat, sigma: Flat, Y: Flat) -> None:
    m = task.count
    wide = n > m
    count, length, width = min(m, n), max(m, n), m + n
    weights, left = [0.0] * 16, [0.0] * 96  # one number, and six, of LANES poses
    for k in range(6 * n * places.LANES):
        Y[k] = 0.0
    for r in range(count):
        direction = arrays.after(W, r * width * places.LANES)
        for lane in range(places.LANES):
            weights[lane] = 1.0 / sigma[r * places.LANES + lane]
        for i in range(m):
            component = arrays.after(direction, (length + i if wide else i) * places.LANES)
            scale = task.row_scale[i]
            for lane in range(places.LANES):
                left[i * places.LANES + lane] = component[lane] * weights[lane] * scale
        for j in range(n):
            right = arrays.after(direction, (j if wide else length + j) * places.LANES)
            scale = task.column_scale[j]
            for i in range(m):
                axis = task.axis[i]
                y = arrays.after(Y, (6 * j + axis) * places.LANES)
                for lane in range(places.LANES):
                    y[lane] += right[lane] * scale * left[i * places.LANES + lane]
    for j in range(n):
        _to_base_axes(task, arrays.after(Y, 6 * j * places.LANES))


def _write_way_out(n: int, column_scales: Flat, way_out: Flat, distances: Flat) -> None:
    norms = [0.0] * 16
    for lane in range(places.LANES):
        norms[lane] = 0.0
    for j in range(n):
        scale = column_scales[j]
        for lane in range(places.LANES):
            along = way_out[j * places.LANES + lane] * scale
            way_out[j * places.LANES + lane] = along
            norms[lane] += along * along
    for lane in range(places.LANES):
        norm = math.sqrt(norms[lane])
        norms[lane] = norm
        inverse = 1.0 / norm if norm > 0.0 else places.PI
        distances[lane] = places.PI if norm * places.PI <= 1.0 else inverse
    for j in range(n):
        scale = column_scales[j]
        for lane in range(places.LANES):
            norm = norms[lane]
            along = way_out[j * places.LANES + lane] / norm * scale
            way_out[j * places.LANES + lane] = along if norm > 0.0 else 0.0


def _write_direction(
    n: int,
    task: TaskRows,
    direction: Flat,
    lost: Flat,
    motion: Flat,
) -> None:
    m = task.count
    wide, length = n > m, max(m, n)
    for k in range(6 * places.LANES):
        lost[k] = 0.0
    for i in range(m):
        axis = task.axis[i]
        component = arrays.after(direction, (length + i if wide else i) * places.LANES)
        for lane in range(places.LANES):
            lost[axis * places.LANES + lane] = component[lane]
    _to_base_axes(task, lost)
    for j in range(n):
        along = arrays.after(direction, (j if wide else length + j) * places.LANES)
        scale = task.column_scale[j]
        for lane in range(places.LANES):
            motion[j * places.LANES + lane] = along[lane] * scale


def measure_rows(
    chain: Chain,
    task: TaskRows,
    rows: Flat,
    measures: Flat,
    work: Flat,
) -> int:
    """
    Fill the measures of LANES rows as `singularity.measure_row` does of each.

    Returns a bit for each lane that has to be measured by itself. The arm's generic rank is full;
    `work` has room for LANES (min(m, n) (m + n) + 6 n) numbers.
    """
    n = chain.dof
    m = task.count
    count, length = min(m, n), max(m, n)
    W = work
    Y = arrays.after(work, count * (m + n) * places.LANES)
    J = arrays.after(rows, places.JACOBIAN_AT * places.LANES)
    lost = arrays.after(measures, places.LOST_AT * places.LANES)
    motion = arrays.after(lost, 6 * places.LANES)
    way_out = arrays.after(motion, n * places.LANES)
    sigma = arrays.after(way_out, n * places.LANES)

    if m != n and not _write_volume(n, task, J, W, sigma, measures):
        return ALL_LANES
    _fill_task_rows(n, task, J, W, m + n)
    if m == n:
        _write_determinant(n, W, Y, measures)
    _scale_task_rows(n, task, W)
    if not _decompose(W, sigma, count, length, m + n):
        return ALL_LANES
    irregular = _irregular(sigma, count)
    _write_values(sigma, count, measures)
    jacobi_lanes.unit_rows(W, sigma, count, length, m + n)
    _fill_slopes(n, task, W, sigma, Y)
    screws = arrays.after(rows, chain.screws_at * places.LANES)
    gradient_lanes.fill_gradient(chain, screws, Y, way_out)
    distances = arrays.after(measures, places.DISTANCE * places.LANES)
    _write_way_out(n, task.column_scale, way_out, distances)
    direction = arrays.after(W, (count - 1) * (m + n) * places.LANES)
    _write_direction(n, task, direction, lost, motion)
    return irregular
