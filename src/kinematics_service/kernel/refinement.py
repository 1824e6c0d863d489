"""
Refinement: joint positions moved to where the tool misses its target least.

"""

import math

from . import aims, arrays, chain_pass, places
from .arrays import Floats
from .chain import Chain

# A smaller error is round-off of forward kinematics, as a share of the length.
ROUND_OFF = 1e-15
# Where nothing is gained any more: so many steps that shrink the error by less than this share.
SLOW, PATIENCE = 1e-3, 12
STIFFEST = 1e8
# A length below which lengths are not taken to shrink (m).
LEAST_LENGTH = 1e-3


def room(n: int, row: int) -> int:
    """
    Return how many numbers `refine_one` needs room for, a row being so long.

    """
    return 2 * n * n + 10 * n + 6 + row


def _damped_step(n: int, A: Floats, g: Floats, damping: float, L: Floats, step: Floats) -> bool:
    # Solves (A + damping) step = g by Cholesky; False where round-off makes that impossible.
    for i in range(n):
        for j in range(i + 1):
            value = A[i * n + j]
            if i == j:
                value += damping
            for k in range(j):
                value -= L[i * n + k] * L[j * n + k]
            if i == j:
                if not value > 0.0:
                    return False
                L[i * n + i] = math.sqrt(value)
            else:
                L[i * n + j] = value / L[j * n + j]
    for i in range(n):
        value = g[i]
        for k in range(i):
            value -= L[i * n + k] * step[k]
        step[i] = value / L[i * n + i]
    for i in range(n - 1, -1, -1):
        value = step[i]
        for k in range(i + 1, n):
            value -= L[k * n + i] * step[k]
        step[i] = value / L[i * n + i]
    return True


def _normal_equations(
    n: int, columns: Floats, error: Floats, q: Floats, limits: Floats, A: Floats, g: Floats
) -> float:
    # Fills A and g, and returns the largest square of a column.
    size = 0.0
    for i in range(n):
        g[i] = 0.0
        for k in range(6):
            g[i] += columns[6 * i + k] * error[k]
        for j in range(i + 1):
            A[i * n + j] = 0.0
            for k in range(6):
                A[i * n + j] += columns[6 * i + k] * columns[6 * j + k]
        size = max(size, A[i * n + i])
    # A joint at its bound that would go on is held; the others go where that is best.
    for i in range(n):
        upper = q[i] >= limits[2 * i + 1] and g[i] > 0.0
        if upper or (q[i] <= limits[2 * i] and g[i] < 0.0):
            g[i] = 0.0
            for j in range(n):
                A[i * n + j] = 0.0
                A[j * n + i] = 0.0
            A[i * n + i] = size
    return size


def _move_within(
    n: int, q: Floats, scales: Floats, step: Floats, limits: Floats, trial: Floats
) -> float:
    # Fills `trial` and returns the longest move of a joint.
    moved = 0.0
    for j in range(n):
        value = q[j] + scales[j] * step[j]
        value = min(max(value, limits[2 * j]), limits[2 * j + 1])
        moved = max(moved, abs(value - q[j]))
        trial[j] = value
    return moved


def refine_one(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    limits: Floats,
    damping: float,
    steps: int,
    q: Floats,
    work: Floats,
) -> float:
    """
    Refine one row of `refine`, and return what is left; `work` has room for `room` numbers.

    """
    n = chain.dof
    columns = work
    A = arrays.after(columns, 6 * n)
    L = arrays.after(A, n * n)
    g = arrays.after(L, n * n)
    step = arrays.after(g, n)
    trial = arrays.after(step, n)
    rest = arrays.after(trial, n)
    error = arrays.after(rest, n)
    row = arrays.after(error, 6)
    for j in range(n):
        rest[j] = 0.0
    chain_pass.evaluate_row(chain, q, rest, places.JACOBIAN, row)
    square = aims.miss(aim, row, error)
    length = max(aims.length_of(aim), LEAST_LENGTH)
    enough = (ROUND_OFF * length) * (ROUND_OFF * length)
    nearly = (1e-12 * length) * (1e-12 * length)
    slow, fresh, size = 0, True, 0.0
    for _ in range(steps):
        if square <= enough or slow >= PATIENCE:
            break
        if fresh:
            aims.write_columns(aim, n, row, scales, columns)
            size = _normal_equations(n, columns, error, q, limits, A, g)
            fresh = False
        if size == 0.0:
            break
        if not _damped_step(n, A, g, damping * size + 1e-18 * size, L, step):
            damping = max(10.0 * damping, 1e-15)
            continue
        moved = _move_within(n, q, scales, step, limits, trial)
        if moved == 0.0:
            break
        chain_pass.evaluate_row(chain, trial, rest, places.JACOBIAN, row)
        new = aims.miss(aim, row, error)
        if new < square:
            slow = slow + 1 if new > (1.0 - SLOW) * square else 0
            for j in range(n):
                q[j] = trial[j]
            square = new
            damping = min(0.1 * damping, square / (length * length))
            fresh = True
        else:
            # A refused step at the level of round-off is the end.
            if square <= nearly or damping > STIFFEST:
                break
            damping = max(8.0 * damping, 1e-12)
            # `error` is the refused one's now, but g and A are still those of q.
            slow += 1 if moved < 1e-13 else 0
    return math.sqrt(square)


def refine(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    limits: Floats,
    damping: float,
    steps: int,
    q: Floats,
    errors: Floats,
) -> None:
    """
    Move each row of q to where the tool misses its target least: Levenberg-Marquardt.

    Parameters
    ----------
    chain
        The arm.
    aim : shape (AIM_SIZE,)
        What is aimed at: see AIM_AXES.
    scales : shape (n,)
        What a unit of each joint counts, as `Task.column_scales`, inverted; 0 holds a joint.
    limits : shape (n, 2), rad or m
        No joint leaves these; infinite where it may.
    damping
        At first, as a share of the largest column of J squared: 1e-3 from afar, 0 at a solution.
    steps
        Steps at most.
    q : shape (N, n), rad or m
        Starts, overwritten.
    errors : shape (N,), m
        What is left: the norm of the weighted rows.

    """
    arrays.given(chain)
    n, count = chain.dof, arrays.extent(q, 0)
    target = arrays.numbers(aim, places.AIM_SIZE)
    counted, bounds = arrays.numbers(scales, n), arrays.numbers(limits, 2 * n)
    positions, left = arrays.results(q, count * n), arrays.results(errors, count)
    work = arrays.scratch(room(n, chain.frames_at))
    lock = arrays.let_go()
    for k in range(count):
        left[k] = refine_one(
            chain,
            target,
            counted,
            bounds,
            damping,
            steps,
            arrays.after(positions, k * n),
            work,
        )
    arrays.take_back(lock)
    arrays.give_back(work)
