"""
A step of the servo: joint velocities for a wanted twist of the tool.

"""

import math

from . import arrays, places, singular_values
from .arrays import Floats, Integers
from .task_rows import TaskRows

# A faster twist (m/s, rad/s) asks for nothing that a slower one of its direction does not.
FASTEST = 1e9
# Of a joint at rest at its limit, round-off is no motion.
AT_REST = 1e-12


def _write_damped_motion(
    m: int,
    n: int,
    J: Floats,
    free: Integers,
    count: int,
    v: Floats,
    rank: int,
    damping: float,
    below: float,
    W: Floats,
    sigma: Floats,
    u: Floats,
    report: Floats,
) -> None:
    # Least squares of J u = v over the free columns, each singular value s below `below` with a
    # damping of its own, damping^2 (1 - (s / below)^2) (Nakamura and Hanafusa 1986; Maciejewski
    # and Klein 1988: directions that are not lost are not damped).
    wide = count > m
    rows, length = (m if wide else count), (count if wide else m)
    width = rows + length
    for i in range(m):
        for j in range(count):
            W[i * width + j if wide else j * width + i] = J[i * n + free[j]]
    for i in range(rows):
        for j in range(length, width):
            W[i * width + j] = 0.0
        W[i * width + length + i] = 1.0
    singular_values.orthogonalise(W, rows, length, length + rows)
    singular_values.sort_by_norm(W, sigma, rows, length, length + rows)
    for j in range(count):
        u[free[j]] = 0.0
    for i in range(rows):
        row = arrays.after(W, i * width)
        turns = arrays.after(row, length)
        square = 0.0
        if sigma[i] < below:
            share = sigma[i] / below
            square = damping * damping * (1.0 - share * share)
            if i < rank:
                used = math.sqrt(square) / damping
                report[places.DAMPING] = max(report[places.DAMPING], used)
        along = 0.0
        for k in range(m):
            along += (turns[k] if wide else row[k]) * v[k]
        along /= sigma[i] * sigma[i] + square
        for j in range(count):
            u[free[j]] += along * (row[j] if wide else turns[j])
    if report[places.LEAST_SINGULAR_VALUE] < 0.0:
        report[places.LEAST_SINGULAR_VALUE] = sigma[min(rank, rows) - 1]


def _write_task(
    n: int,
    task: TaskRows,
    row: Floats,
    twist: Floats,
    size: float,
    J: Floats,
    v: Floats,
) -> float:
    # The rows of J that count, and the twist by them, as a share of `size`; returns the largest
    # entry of J. Everything is divided by its largest entry, so that no square overflows.
    m = task.count
    largest = 0.0
    for i in range(m):
        axis = task.axis[i]
        first = 3 if axis >= 3 else 0
        component = axis - first
        jacobian = arrays.after(row, places.JACOBIAN_AT + first * n)
        x, y = task.rotation[component], task.rotation[3 + component]
        z = task.rotation[6 + component]
        weight = task.row_scale[i]
        v[i] = 0.0
        if size > 0.0:
            a, b, c = twist[first] / size, twist[first + 1] / size, twist[first + 2] / size
            v[i] = weight * (x * a + y * b + z * c)
        for j in range(n):
            value = x * jacobian[j] + y * jacobian[n + j] + z * jacobian[2 * n + j]
            J[i * n + j] = weight * task.column_scale[j] * value
            largest = max(largest, abs(J[i * n + j]))
    return largest


def _upper(limits: Floats, q: Floats, j: int, horizon: float) -> float:
    # The fastest a joint may near its upper limit.
    return max((limits[2 * j + 1] - q[j]) / horizon, 0.0)


def _lower(limits: Floats, q: Floats, j: int, horizon: float) -> float:
    return min((limits[2 * j] - q[j]) / horizon, 0.0)


def _worst(
    free: Integers,
    count: int,
    limits: Floats,
    q: Floats,
    horizon: float,
    qdot: Floats,
    scales: Floats,
) -> int:
    # Which of the free joints would run into a limit most, -1 where none does.
    worst, over = -1, AT_REST
    for k in range(count):
        j = free[k]
        upper, lower = _upper(limits, q, j, horizon), _lower(limits, q, j, horizon)
        beyond = max(qdot[j] - upper, lower - qdot[j]) / scales[j]
        if beyond > over:
            worst, over = k, beyond
    return worst


def _servo(
    n: int,
    task: TaskRows,
    settings: Floats,
    limits: Floats,
    fastest: Floats,
    q: Floats,
    row: Floats,
    twist: Floats,
    qdot: Floats,
    held: Integers,
    report: Floats,
    work: Floats,
) -> None:
    m, rank, scales = task.count, task.generic_rank, task.column_scale
    length, horizon = settings[places.LENGTH], settings[places.HORIZON]
    J = work
    v = arrays.after(J, m * n)
    u = arrays.after(v, m)
    sigma = arrays.after(u, n)
    free = arrays.as_whole(arrays.after(sigma, min(m, n)))
    W = arrays.after(sigma, min(m, n) + n)
    report[places.DAMPING], report[places.LEAST_SINGULAR_VALUE] = 0.0, -1.0
    report[places.SHORTENED], report[places.SLOWEST] = 1.0, -1.0
    size = 0.0
    for i in range(6):
        size = max(size, abs(twist[i]))
    for j in range(n):
        qdot[j], held[j], u[j], free[j] = 0.0, 0, 0.0, j
    largest = _write_task(n, task, row, twist, size, J, v)
    if not largest > 0.0:
        report[places.DAMPING], report[places.LEAST_SINGULAR_VALUE] = 1.0, 0.0
        return
    for i in range(m * n):
        J[i] /= largest
    damping = settings[places.LARGEST_DAMPING] * length / largest
    below = settings[places.DAMPED_BELOW] * length / largest
    count = n
    _write_damped_motion(m, n, J, free, count, v, rank, damping, below, W, sigma, u, report)
    report[places.LEAST_SINGULAR_VALUE] *= largest / length
    # First all velocities are shortened alike, so that the tool keeps its direction.
    rate = min(size, FASTEST)
    for j in range(n):
        u[j] *= scales[j] / largest
        if abs(u[j]) * rate > fastest[j]:
            rate = fastest[j] / abs(u[j])
            report[places.SLOWEST] = j
    if size > 0.0:
        report[places.SHORTENED] = rate / size
    for j in range(n):
        qdot[j] = rate * u[j]
    for i in range(m):
        v[i] *= rate
    # Then joints that would run into their limits are held back, and the others make up for it.
    for _ in range(n):
        worst = _worst(free, count, limits, q, horizon, qdot, scales)
        if worst < 0:
            break
        j = free[worst]
        if qdot[j] > 0.0:
            held[j] = 1
            qdot[j] = _upper(limits, q, j, horizon)
        else:
            held[j] = -1
            qdot[j] = _lower(limits, q, j, horizon)
        count -= 1
        for k in range(worst, count):
            free[k] = free[k + 1]
        if count == 0:
            break
        for i in range(m):
            v[i] -= J[i * n + j] * (qdot[j] / scales[j] * largest)
        _write_damped_motion(m, n, J, free, count, v, rank, damping, below, W, sigma, u, report)
        for k in range(count):
            u[free[k]] *= scales[free[k]] / largest
            qdot[free[k]] = u[free[k]]
    share = 1.0
    for j in range(n):
        if abs(qdot[j]) * share > fastest[j]:
            share = fastest[j] / abs(qdot[j])
            report[places.SLOWEST] = j
    report[places.SHORTENED] *= share
    for j in range(n):
        upper, lower = _upper(limits, q, j, horizon), _lower(limits, q, j, horizon)
        qdot[j] = min(max(qdot[j] * share, lower), upper)


def servo(
    task: TaskRows,
    settings: Floats,
    limits: Floats,
    fastest: Floats,
    q: Floats,
    row: Floats,
    twist: Floats,
    qdot: Floats,
    held: Integers,
    report: Floats,
) -> None:
    """
    Fill `qdot` (n,) with joint velocities that bring a twist about as far as the arm allows.

    Parameters
    ----------
    task
        The rows that count.
    settings : shape (4,)
        LARGEST_DAMPING and DAMPED_BELOW as shares of LENGTH (m); HORIZON, s.
    limits, fastest : shape (n, 2), (n,), rad or m, rad/s or m/s
        Of positions, infinite where there are none; of velocities, finite.
    q, row : shape (n,), (width,)
        Joint positions, and the row `evaluate` filled of them.
    twist : shape (6,), m/s and rad/s
        In base axes, at the tool's origin.
    held : shape (n,)
        1 or -1 where the upper or lower limit of a joint's position decides, else 0.
    report : shape (4,)
        DAMPING as a share of the largest, LEAST_SINGULAR_VALUE as a share of the length,
        SHORTENED (to which share all velocities were, for their limits), SLOWEST joint or -1.

    """
    arrays.given(task)
    n, m = task.joints, task.count
    asked = arrays.numbers(settings, 4)
    bounds, velocities = arrays.numbers(limits, 2 * n), arrays.numbers(fastest, n)
    positions, evaluated = arrays.numbers(q, n), arrays.numbers(row, places.JACOBIAN_AT + 6 * n)
    wanted, rates = arrays.numbers(twist, 6), arrays.results(qdot, n)
    sides, said = arrays.whole_results(held, n), arrays.results(report, 4)
    work = arrays.scratch(m * n + m + 3 * n + min(m, n) * (m + n + 1))
    _servo(
        n,
        task,
        asked,
        bounds,
        velocities,
        positions,
        evaluated,
        wanted,
        rates,
        sides,
        said,
        work,
    )
    arrays.give_back(work)
