"""
The measures of evaluated rows with the factors there, and the level they come to.

"""

import math

from . import arrays, evaluation, factors, places, singularity
from .arm import Arm
from .arrays import Floats


def _judge_factors(arm: Arm, q: Floats, judged: Floats, steps: Floats) -> int:
    # Fills distances, values and gradients of the factors; returns the one nearest to its zero.
    n, count = arm.chain.dof, arm.tape.factors
    distances = arrays.after(judged, places.JUDGED)
    factors.run_tape(arm.tape, n, q, steps)
    nearest = 0
    for f in range(count):
        step = arrays.after(steps, arm.tape.ends[f] * (n + 1))
        result = arrays.after(distances, count + f * (1 + n))
        result[0] = step[n]
        squares = 0.0
        for j in range(n):
            result[1 + j] = step[j]
            slope = step[j] * arm.task.column_scale[j]
            squares += slope * slope
        distances[f] = factors.distance_to_zero(step[n], math.sqrt(squares))
        if distances[f] < distances[nearest]:
            nearest = f
    return nearest


def judge_row(arm: Arm, row: Floats, q: Floats, measures: Floats, work: Floats) -> None:
    """
    Fill the measures of a row, the factors there, and the level without hysteresis.

    `work` has room for `room` numbers.

    """
    n = arm.chain.dof
    singularity.measure_row(arm.chain, arm.task, row, measures, work)

    count = min(n, arm.task.count)
    judged = arrays.after(measures, places.LOST_AT + 6 + 2 * n + count)
    nearest = 0
    if arm.tape.factors > 0:
        nearest = _judge_factors(arm, q, judged, work)
        # Factors do not suffer between two singular sets; where their product is the determinant
        # nothing else is needed.
        distance = judged[places.JUDGED + nearest]
        estimate = measures[places.DISTANCE]
        if estimate != 0.0 and (arm.factors_complete or not estimate < distance):
            measures[places.DISTANCE] = distance

    watched = abs(measures[arm.watched])
    sign = 1.0 if arm.stop < arm.warn else -1.0
    level = 0.0
    if not sign * watched > sign * arm.stop:
        level = 2.0
    elif not sign * watched > sign * arm.warn:
        level = 1.0
    judged[places.WATCHED] = watched
    judged[places.LEVEL] = level
    judged[places.NEAREST] = nearest


def room(arm: Arm) -> int:
    """
    Return how many numbers `judge_row` needs room for.

    """
    n, m = arm.chain.dof, arm.task.count
    return max(min(m, n) * (m + n) + 6 * n + n * n, arm.tape.steps * (n + 1))


def width(arm: Arm) -> int:
    """
    Return the length of a row of measures.

    """
    n, m = arm.chain.dof, arm.task.count
    judged = places.LOST_AT + 6 + 2 * n + min(m, n) + places.JUDGED
    return judged + arm.tape.factors * (2 + n)


def measure(arm: Arm, rows: Floats, q: Floats, measures: Floats) -> None:
    """
    Fill `measures` with the singularity measures of each evaluated row (depth JACOBIAN or more).

    Parameters
    ----------
    arm
        The arm.
    rows : shape (N, width)
        As `evaluate` filled them.
    q : shape (N, n), rad or m
        Where the rows were evaluated; read only where the arm has factors.
    measures : shape (N, 6 + 6 + 2 n + min(m, n) + 3 + F (2 + n))
        Scalars DETERMINANT (NaN where J_t is not square) to RANK, the lost direction (6,) in base
        axes, the joint motion (n,) and the way out (n,) in rad or m, the singular values; WATCHED
        to NEAREST, the distances to the zeros of the F factors, value and gradient of each.

    """
    arrays.given(arm)
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    n, columns = arm.chain.dof, width(arm)
    if row_width < arm.chain.frames_at or arrays.extent(measures, 1) != columns:
        raise TypeError('the arrays of measures do not go together')
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    results = arrays.results(measures, count * columns)
    work = arrays.scratch(room(arm))
    lock = arrays.let_go()
    for k in range(count):
        judge_row(
            arm,
            arrays.after(table, k * row_width),
            arrays.after(positions, k * n),
            arrays.after(results, k * columns),
            work,
        )
    arrays.take_back(lock)
    arrays.give_back(work)


def measure_one(arm: Arm, row: Floats, measures: Floats) -> None:
    """
    Fill `measures` for one row, after which its q stands: as `evaluate_one` filled it.

    """
    arrays.given(arm)
    tail = 2 * arm.chain.dof + places.ROW_TAIL
    evaluated = arrays.numbers(row, arm.chain.frames_at + tail)
    results = arrays.results(measures, width(arm))
    q = arrays.after(evaluated, arrays.size(row) - tail)
    work = arrays.scratch(room(arm))
    judge_row(arm, evaluated, q, results, work)
    arrays.give_back(work)


def evaluate_and_measure_one(
    arm: Arm, q: Floats, qdot: Floats, row: Floats, measures: Floats
) -> int:
    """
    `evaluate_one`, then `measure_one`, in one call; returns what the first returns.

    """
    bad = evaluation.evaluate_one(arm, q, qdot, row)
    if bad == -1:
        measure_one(arm, row, measures)
    return bad
