# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the singularity measures of one row of results, or of LANES rows at once.

The order of the measures is defined in layout/places.py and in MeasurePlaces
(robot/measure_places.py). LANES rows are interleaved: first the first number of each row, then the
second number of each row, and so on. The measures of a pose are bit for bit equal, whether it is
measured alone or with others. If the rank of J_t at a pose is below the generic rank, its measures
need other formulas than at full rank, so the pose is measured alone.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers, Vector
from . import gradient, singular_values
from .task_rows import TaskRows

# Largest norm of a row of J_t, m or rad, for which a pose is measured together with others. If a
# row is longer, fourth powers of its numbers overflow, so the pose is measured alone.
LARGEST_NORM = 1e75
# Bit mask with one bit for each of LANES poses that are computed at once. All bits are set.
ALL_LANE_BITS = 0xFFFF


def _to_base_axes(task: TaskRows, vectors: Numbers, lanes: int) -> None:
    # Read the rotation first, because the compiler assumes that each write to `vectors` may change
    # the rotation.
    xx, xy, xz = task.rotation[0], task.rotation[1], task.rotation[2]
    yx, yy, yz = task.rotation[3], task.rotation[4], task.rotation[5]
    zx, zy, zz = task.rotation[6], task.rotation[7], task.rotation[8]
    for half in range(2):
        at = 3 * half * lanes
        for lane in range(at, at + lanes):
            x, y, z = vectors[lane], vectors[lanes + lane], vectors[2 * lanes + lane]
            vectors[lane] = xx * x + xy * y + xz * z
            vectors[lanes + lane] = yx * x + yy * y + yz * z
            vectors[2 * lanes + lane] = zx * x + zy * y + zz * z


def task_component(task: TaskRows, r: int, linear: Vector, angular: Vector) -> float:
    """
    Return the component of a velocity along the axis of row r of the task Jacobian J_t.

    The component is multiplied by the weight of the row. The velocity (linear, angular) is in base
    axes.
    """
    axis = task.axis[r]
    v = linear if axis < 3 else angular
    k = axis if axis < 3 else axis - 3
    along = task.rotation[k] * v[0] + task.rotation[3 + k] * v[1] + task.rotation[6 + k] * v[2]
    return along * task.row_scale[r]


def _fill_task_rows(n: int, task: TaskRows, J: Flat, W: Flat, width: int, lanes: int) -> None:
    # Fills the first columns of W with J_t in the axes of frame 0 (R0^T J), or with the transpose
    # of J_t if n <= m. W has `width` columns; the other columns get the identity matrix.
    m = task.count
    count, length = min(m, n), max(m, n)
    for i in range(m):
        axis = task.axis[i]
        # Compute axis % 3 without a division. A division would take more time than the other
        # operations for this row.
        component = axis if axis < 3 else axis - 3
        a = task.rotation[component]
        b = task.rotation[3 + component]
        c = task.rotation[6 + component]
        for j in range(n):
            x = arrays.after(J, ((axis - component) * n + j) * lanes)
            y, z = arrays.after(x, n * lanes), arrays.after(x, 2 * n * lanes)
            into = arrays.after(W, (i * width + j if n > m else j * width + i) * lanes)
            for lane in range(lanes):
                into[lane] = a * x[lane] + b * y[lane] + c * z[lane]
    for i in range(count):
        for j in range(length, width):
            into = arrays.after(W, (i * width + j) * lanes)
            for lane in range(lanes):
                into[lane] = 1.0 if j - length == i else 0.0


def _scale_task_rows(n: int, task: TaskRows, W: Flat, width: int, lanes: int) -> None:
    m = task.count
    for i in range(m):
        for j in range(n):
            into = arrays.after(W, (i * width + j if n > m else j * width + i) * lanes)
            scale = task.row_scale[i] * task.column_scale[j]
            for lane in range(lanes):
                # Add 0.0, which changes -0.0 to 0.0. Without the sum, `orthogonalise` could change
                # a -0.0 to 0.0 if it computes several poses at once, but not if it computes one
                # pose. The results of a pose would then not have equal bits in the two cases.
                into[lane] = into[lane] * scale + 0.0


def _decompose(W: Flat, sigma: Flat, count: int, length: int, width: int, lanes: int) -> int:
    # Computes the singular value decomposition of W and fills sigma. Sorts the rows first, because
    # this reduces the number of sweeps. Returns a bit mask with one bit for each lane (pose). The
    # bit is 1 if a row of W has at least the norm LARGEST_NORM, so that the pose must be measured
    # alone.
    singular_values.sort_by_norm(W, sigma, count, length, width, lanes)
    large = 0
    for lane in range(lanes):
        if not sigma[lane] < LARGEST_NORM:
            large |= 1 << lane
    singular_values.orthogonalise(W, count, length, width, lanes)
    singular_values.sort_by_norm(W, sigma, count, length, width, lanes)
    return large


def write_directions(n: int, task: TaskRows, row: Flat, W: Flat, sigma: Flat) -> None:
    """Fill sigma with the singular values of the scaled J_t, and W with the singular vectors."""
    m = task.count
    count, length = min(m, n), max(m, n)
    _fill_task_rows(n, task, arrays.after(row, places.JACOBIAN_AT), W, m + n, 1)
    _scale_task_rows(n, task, W, m + n, 1)
    _decompose(W, sigma, count, length, m + n, 1)
    singular_values.unit_rows(W, sigma, count, length, 1)


def _write_determinant(n: int, W: Flat, spare: Flat, measures: Flat, lanes: int) -> None:
    # Writes the determinant and the manipulability of the unscaled J_t, which is in W. W stays
    # unchanged.
    determinants = arrays.after(measures, places.DETERMINANT * lanes)
    for i in range(n):
        arrays.copy(
            arrays.after(spare, i * n * lanes), n * lanes, arrays.after(W, i * 2 * n * lanes)
        )
    singular_values.write_determinant(spare, n, determinants, lanes)
    for lane in range(lanes):
        measures[places.MANIPULABILITY * lanes + lane] = abs(determinants[lane])


def _write_volume(
    n: int, task: TaskRows, J: Flat, W: Flat, sigma: Flat, measures: Flat, lanes: int
) -> int:
    # Writes the manipulability if J_t is not square or its generic rank is not full. Returns the
    # bit mask of `_decompose`: a bit is 1 if the numbers of J_t are so large that the pose must be
    # measured alone.
    m = task.count
    count, length = min(m, n), max(m, n)
    volume = arrays.after(measures, places.MANIPULABILITY * lanes)
    _fill_task_rows(n, task, J, W, length, lanes)
    large = _decompose(W, sigma, count, length, length, lanes)
    for lane in range(lanes):
        measures[places.DETERMINANT * lanes + lane] = 0.0 if m == n else places.NAN
        volume[lane] = 1.0
    for i in range(task.generic_rank):
        for lane in range(lanes):
            volume[lane] *= sigma[i * lanes + lane]
    return large


def _write_values(task: TaskRows, sigma: Flat, count: int, measures: Flat, lanes: int) -> int:
    # Writes the rank, the condition number and the smallest singular value. Returns a bit mask
    # with one bit for each lane (pose): 1 if the rank at this pose is below the generic rank.
    rank = arrays.after(measures, places.RANK * lanes)
    smallest = arrays.after(sigma, (task.generic_rank - 1) * lanes)
    lost = 0
    for lane in range(lanes):
        rank[lane] = 0.0
    for i in range(count):
        for lane in range(lanes):
            least = max(places.RANK_TOLERANCE * sigma[lane], task.zero)
            counts = sigma[i * lanes + lane] > least
            rank[lane] += 1.0 if counts else 0.0
    for lane in range(lanes):
        is_lost = smallest[lane] == 0.0 or sigma[lane] <= task.zero
        condition = places.INFINITY if is_lost else sigma[lane] / smallest[lane]
        measures[places.CONDITION_NUMBER * lanes + lane] = condition
        measures[places.SMALLEST_SINGULAR_VALUE * lanes + lane] = smallest[lane]
        if rank[lane] < task.generic_rank:
            lost |= 1 << lane
    return lost


def _fill_slopes(
    n: int,
    first: int,
    last: int,
    lost: bool,
    task: TaskRows,
    W: Flat,
    sigma: Flat,
    Y: Flat,
    left: Numbers,
    lanes: int,
) -> None:
    # Adds up the logarithms of the singular values `first` to `last` of J_t, or the singular
    # values themselves if `lost` (J_t has lost rank) is set. Fills Y[j] with the derivatives of
    # this sum by the six entries of column j of J. `left` is a local array of the caller with six
    # numbers for each pose.
    m = task.count
    wide = n > m
    length, width = max(m, n), m + n
    weights, along = [0.0] * 16, [0.0] * 16  # one number for each of LANES poses
    arrays.fill(Y, 6 * n * lanes, 0.0)
    arrays.fill(left, 6 * lanes, 0.0)
    for r in range(first, last + 1):
        direction = arrays.after(W, r * width * lanes)
        for lane in range(lanes):
            weights[lane] = 1.0 if lost else 1.0 / sigma[r * lanes + lane]
        for i in range(m):
            component = arrays.after(direction, (length + i if wide else i) * lanes)
            scale = task.row_scale[i]
            for lane in range(lanes):
                left[task.axis[i] * lanes + lane] = component[lane] * weights[lane] * scale
        for j in range(n):
            right = arrays.after(direction, (j if wide else length + j) * lanes)
            scale = task.column_scale[j]
            y = arrays.after(Y, 6 * j * lanes)
            for lane in range(lanes):
                along[lane] = right[lane] * scale
            # If there is one pose, the loop covers all six components of Y[j], not only the rows
            # of the task. A loop of constant length is faster: this saves 2 % of the time of the
            # measures. The additional components of `left` are 0, so the result is the same.
            for i in range(6 if lanes == 1 else m):
                axis = i if lanes == 1 else task.axis[i]
                for lane in range(lanes):
                    y[axis * lanes + lane] += along[lane] * left[axis * lanes + lane]
    for j in range(n):
        _to_base_axes(task, arrays.after(Y, 6 * j * lanes), lanes)


def _write_way_out(n: int, task: TaskRows, way_out: Flat, distances: Flat, lanes: int) -> None:
    # `way_out` has a gradient: the gradient of the logarithm of the manipulability, or the
    # gradient of the smallest singular value if J_t has lost rank. Scales the gradient to a joint
    # motion of length 1. Writes to `distances` the first-order distance to a singular pose, rad:
    # the smaller of pi and 1 / |gradient|.
    norms = [0.0] * 16
    for lane in range(lanes):
        norms[lane] = 0.0
    for j in range(n):
        scale = task.column_scale[j]
        for lane in range(lanes):
            along = way_out[j * lanes + lane] * scale
            way_out[j * lanes + lane] = along
            norms[lane] += along * along
    for lane in range(lanes):
        norm = math.sqrt(norms[lane])
        norms[lane] = norm
        inverse = 1.0 / norm if norm > 0.0 else places.PI
        distances[lane] = places.PI if norm * places.PI <= 1.0 else inverse
    for j in range(n):
        scale = task.column_scale[j]
        for lane in range(lanes):
            norm = norms[lane]
            along = way_out[j * lanes + lane] / norm * scale
            way_out[j * lanes + lane] = along if norm > 0.0 else 0.0


def _write_direction(
    n: int, task: TaskRows, direction: Flat, lost: Flat, motion: Flat, lanes: int
) -> None:
    # Writes the two singular vectors of one singular value. `lost` gets the singular vector in the
    # space of tool motions (the lost direction), in base axes. `motion` gets the singular vector
    # in the space of joint motions.
    m = task.count
    wide, length = n > m, max(m, n)
    arrays.fill(lost, 6 * lanes, 0.0)
    for i in range(m):
        component = arrays.after(direction, (length + i if wide else i) * lanes)
        for lane in range(lanes):
            lost[task.axis[i] * lanes + lane] = component[lane]
    _to_base_axes(task, lost, lanes)
    for j in range(n):
        along = arrays.after(direction, (j if wide else length + j) * lanes)
        scale = task.column_scale[j]
        for lane in range(lanes):
            motion[j * lanes + lane] = along[lane] * scale


def _write_scalars(
    n: int,
    task: TaskRows,
    J: Flat,
    W: Flat,
    spare: Flat,
    sigma: Flat,
    measures: Flat,
    lanes: int,
) -> int:
    # Writes the scalar measures except the distance, and fills W and sigma with the singular value
    # decomposition of the scaled J_t. Returns a bit mask with two bits for each of the `lanes`
    # poses. For pose k, bit k is set if the rank of J_t is below the generic rank. Bit LANES + k
    # is set if the numbers of J_t are so large that the pose must be measured alone
    # (LARGEST_NORM).
    m = task.count
    count, length, large = min(m, n), max(m, n), 0
    by_determinant = m == n and task.generic_rank == n
    if not by_determinant:
        large = _write_volume(n, task, J, W, sigma, measures, lanes)
    _fill_task_rows(n, task, J, W, m + n, lanes)
    if by_determinant:
        _write_determinant(n, W, spare, measures, lanes)
    _scale_task_rows(n, task, W, m + n, lanes)
    large |= _decompose(W, sigma, count, length, m + n, lanes)
    return _write_values(task, sigma, count, measures, lanes) | large << places.LANES


def measure_row(chain: Chain, task: TaskRows, row: Flat, measures: Flat, work: Flat) -> None:
    """
    Fill a row of singularity measures, from the first measure to the last singular value.

    `row` has the results of `evaluate` at the pose. The caller computes the measures after the
    singular values: the singular factors, the level (OK, WARN or ERROR) and the nearest singular
    pose.
    """
    left = [0.0] * 6
    _measure(chain, task, row, measures, work, left, 1)


def measure_rows(chain: Chain, task: TaskRows, rows: Flat, measures: Flat, work: Flat) -> int:
    """
    Fill the singularity measures of LANES poses at once; the arm must be an open chain.

    `rows` and `measures` are interleaved: first the first number of each pose, then the second
    number of each pose, and so on. Each pose gets the numbers that `measure_row` writes. Return a
    bit mask of the poses that the caller must measure one by one, by `measure_row`. The generic
    rank of J_t must be full. `work` has LANES (min(m, n) (m + n) + 6 n) numbers.
    """
    # `left` has 6 * LANES numbers; C needs this number as a literal. `left` is a local array,
    # because the compiler then knows that it overlaps with no other array.
    left = [0.0] * 96
    return _measure(chain, task, rows, measures, work, left, places.LANES)


def _measure(
    chain: Chain,
    task: TaskRows,
    rows: Flat,
    measures: Flat,
    work: Flat,
    left: Numbers,
    lanes: int,
) -> int:
    n = chain.dof
    m = task.count
    count, length, last = min(m, n), max(m, n), task.generic_rank - 1
    W = work
    Y = arrays.after(work, count * (m + n) * lanes)
    J = arrays.after(rows, places.JACOBIAN_AT * lanes)
    direction = arrays.after(measures, places.LOST_AT * lanes)
    motion = arrays.after(direction, 6 * lanes)
    way_out = arrays.after(motion, n * lanes)
    sigma = arrays.after(way_out, n * lanes)
    masks = _write_scalars(n, task, J, W, Y, sigma, measures, lanes)
    none_left, alone = masks & ALL_LANE_BITS, masks >> places.LANES

    singular_values.unit_rows(W, sigma, count, length, lanes)
    lost = lanes == 1 and none_left != 0
    _fill_slopes(n, last if lost else 0, last, lost, task, W, sigma, Y, left, lanes)
    if lanes == 1:
        gradient.write_gradient(chain, rows, Y, way_out, arrays.after(Y, 6 * n))
    else:
        screws = arrays.after(rows, chain.screws_at * lanes)
        gradient.write_side_by_side(chain, screws, Y, way_out)
    distances = arrays.after(measures, places.DISTANCE * lanes)
    _write_way_out(n, task, way_out, distances, lanes)
    if lost:
        distances[0] = 0.0
    least = arrays.after(W, last * (m + n) * lanes)
    _write_direction(n, task, least, direction, motion, lanes)
    return alone | none_left
