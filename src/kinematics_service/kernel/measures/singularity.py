"""
The singularity measures of an evaluated row.

A row of measures has its columns in the order of measure_places.MeasurePlaces.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers, Vector
from . import gradient, singular_values
from .task_rows import TaskRows


def to_base_axes(task: TaskRows, vector: Numbers) -> None:
    """Turn both halves of a (6,) vector from the axes of frame 0 into those of the base frame."""
    for half in range(0, 6, 3):
        x, y, z = vector[half], vector[half + 1], vector[half + 2]
        for i in range(3):
            vector[half + i] = (
                task.rotation[3 * i] * x
                + task.rotation[3 * i + 1] * y
                + task.rotation[3 * i + 2] * z
            )


def task_component(task: TaskRows, r: int, linear: Vector, angular: Vector) -> float:
    """Return what the scaled task row r has of a velocity in base axes."""
    axis = task.axis[r]
    v = linear if axis < 3 else angular
    k = axis if axis < 3 else axis - 3
    along = task.rotation[k] * v[0] + task.rotation[3 + k] * v[1] + task.rotation[6 + k] * v[2]
    return along * task.row_scale[r]


def _fill_task_rows(n: int, task: TaskRows, row: Flat, W: Flat, width: int) -> None:
    # J_t in the axes of frame 0 (R0^T J): its columns as rows, or its rows where there are fewer
    # of them, as `singular_values` has them; and the identity beside it where there is room.
    m = task.count
    count, length = min(m, n), max(m, n)
    for i in range(m):
        axis = task.axis[i]
        # No division: it would cost more than the rest of the row.
        component = axis if axis < 3 else axis - 3
        J = arrays.after(row, places.JACOBIAN_AT + (axis - component) * n)
        a = task.rotation[component]
        b = task.rotation[3 + component]
        c = task.rotation[6 + component]
        for j in range(n):
            value = a * J[j] + b * J[n + j] + c * J[2 * n + j]
            W[i * width + j if n > m else j * width + i] = value
    for i in range(count):
        for j in range(length, width):
            W[i * width + j] = 1.0 if j - length == i else 0.0


def _scale_task_rows(n: int, task: TaskRows, W: Flat, width: int) -> None:
    m = task.count
    for i in range(m):
        for j in range(n):
            place = i * width + j if n > m else j * width + i
            # No -0.0, which the lanes could not keep.
            W[place] = W[place] * (task.row_scale[i] * task.column_scale[j]) + 0.0


def write_scaled_rows(n: int, task: TaskRows, row: Flat, W: Flat, width: int) -> None:
    """
    Fill W with the scaled J_t, its columns as rows where there are fewer of them, each `width`.
    """
    _fill_task_rows(n, task, row, W, width)
    _scale_task_rows(n, task, W, width)


def _decompose(W: Flat, sigma: Flat, count: int, length: int, width: int) -> None:
    # The largest first: fewer sweeps.
    singular_values.sort_by_norm(W, sigma, count, length, width)
    singular_values.orthogonalise(W, count, length, width)
    singular_values.sort_by_norm(W, sigma, count, length, width)


def write_directions(n: int, task: TaskRows, row: Flat, W: Flat, sigma: Flat) -> None:
    """
    Fill the singular values of the scaled J_t, and its directions as `unit_rows` leaves them.
    """
    m = task.count
    count, length = min(m, n), max(m, n)
    write_scaled_rows(n, task, row, W, m + n)
    _decompose(W, sigma, count, length, m + n)
    singular_values.unit_rows(W, sigma, count, length)


def _write_determinant(n: int, W: Flat, spare: Flat, measures: Flat) -> None:
    # Of the unscaled J_t in W, which is left as it is.
    for i in range(n):
        for j in range(n):
            spare[i * n + j] = W[i * 2 * n + j]
    measures[places.DETERMINANT] = singular_values.determinant(spare, n)
    measures[places.MANIPULABILITY] = abs(measures[places.DETERMINANT])


def _write_volume(n: int, task: TaskRows, row: Flat, W: Flat, sigma: Flat, measures: Flat) -> None:
    # Manipulability where the determinant does not say it: with fewer joints than rows the Gram
    # determinant of the joints' columns.
    m = task.count
    count, length = min(m, n), max(m, n)
    _fill_task_rows(n, task, row, W, length)
    _decompose(W, sigma, count, length, length)
    measures[places.DETERMINANT] = 0.0 if m == n else places.NAN
    measures[places.MANIPULABILITY] = 1.0
    for i in range(task.generic_rank):
        measures[places.MANIPULABILITY] *= sigma[i]


def _rank(sigma: Flat, count: int) -> int:
    rank = 0
    for i in range(count):
        if sigma[i] > places.RANK_TOLERANCE * sigma[0]:
            rank += 1
    return rank


def _fill_slopes(
    n: int,
    first: int,
    last: int,
    lost: bool,
    task: TaskRows,
    W: Flat,
    sigma: Flat,
    Y: Flat,
) -> None:
    # Y[j] becomes what a change of column j of J does to the singular values `first` to `last`:
    # to the sum of their logarithms, or, where they are lost, to their sum.
    m = task.count
    wide = n > m
    length, width = max(m, n), m + n
    left = [0.0] * 6
    for j in range(6 * n):
        Y[j] = 0.0
    for r in range(first, last + 1):
        direction = arrays.after(W, r * width)
        weight = 1.0 if lost else 1.0 / sigma[r]
        for i in range(m):
            component = direction[length + i] if wide else direction[i]
            left[task.axis[i]] = component * weight * task.row_scale[i]
        for j in range(n):
            right = direction[j] if wide else direction[length + j]
            right *= task.column_scale[j]
            for i in range(6):
                Y[6 * j + i] += right * left[i]
    for j in range(n):
        to_base_axes(task, arrays.after(Y, 6 * j))


def write_slopes_of_least(n: int, task: TaskRows, W: Flat, sigma: Flat, Y: Flat) -> None:
    """
    Fill Y (n, 6) with what a change of each column of J does to the least singular value, of
    directions as `write_directions` leaves them.
    """
    last = task.generic_rank - 1
    _fill_slopes(n, last, last, True, task, W, sigma, Y)


def _write_direction(
    n: int,
    task: TaskRows,
    direction: Flat,
    lost: Flat,
    motion: Flat,
) -> None:
    # Which direction of the tool is lost first, in base axes, and by which joint motion.
    m = task.count
    wide, length = n > m, max(m, n)
    for i in range(6):
        lost[i] = 0.0
    for i in range(m):
        axis = task.axis[i]
        lost[axis] = direction[length + i] if wide else direction[i]
    to_base_axes(task, lost)
    for j in range(n):
        along = direction[j] if wide else direction[length + j]
        motion[j] = along * task.column_scale[j]


def measure_row(
    chain: Chain,
    task: TaskRows,
    row: Flat,
    measures: Flat,
    work: Flat,
) -> None:
    """Fill the measures of a row, the factors and the level excepted."""
    n = chain.dof
    m = task.count
    generic_rank = task.generic_rank
    count, length = min(m, n), max(m, n)
    W = work
    Y = arrays.after(work, count * (m + n))
    motion = arrays.after(measures, places.LOST_AT + 6)
    way_out = arrays.after(motion, n)
    sigma = arrays.after(way_out, n)

    by_determinant = m == n and generic_rank == n
    if not by_determinant:
        _write_volume(n, task, row, W, sigma, measures)
    _fill_task_rows(n, task, row, W, m + n)
    if by_determinant:
        _write_determinant(n, W, Y, measures)
    _scale_task_rows(n, task, W, m + n)
    _decompose(W, sigma, count, length, m + n)

    rank, last = _rank(sigma, count), generic_rank - 1
    measures[places.RANK] = rank
    measures[places.SMALLEST_SINGULAR_VALUE] = sigma[last]
    measures[places.CONDITION_NUMBER] = (
        sigma[0] / sigma[last] if sigma[last] > 0.0 else places.INFINITY
    )

    singular_values.unit_rows(W, sigma, count, length)
    lost = rank <= last  # of the directions that other poses have
    first = last if lost else 0
    _fill_slopes(n, first, last, lost, task, W, sigma, Y)
    gradient.write_gradient(chain, row, Y, way_out, arrays.after(Y, 6 * n))
    squares = 0.0
    for j in range(n):
        way_out[j] *= task.column_scale[j]
        squares += way_out[j] * way_out[j]
    norm = math.sqrt(squares)
    measures[places.DISTANCE] = 0.0
    if not lost:
        measures[places.DISTANCE] = places.PI if norm * places.PI <= 1.0 else 1.0 / norm
    for j in range(n):
        way_out[j] = way_out[j] / norm * task.column_scale[j] if norm > 0.0 else 0.0
    _write_direction(
        n,
        task,
        arrays.after(W, last * (m + n)),
        arrays.after(measures, places.LOST_AT),
        motion,
    )
