"""
The measures of evaluated rows with the factors there, and the level they come to.

"""

import math

from . import arrays, evaluation, factors, places, singularity
from .arrays import Floats


def _judge_factors(arm: Floats, n: int, q: Floats, judged: Floats, steps: Floats) -> int:
    # Fills distances, values and gradients of the factors; returns the one nearest to its zero.
    header = arrays.as_whole(arm)
    count = header[places.FACTORS]
    distances = arrays.after(judged, places.JUDGED)
    ends = arrays.whole_after(header, header[places.FACTOR_ENDS_AT])
    task_rows = header[header[places.TASK_INTEGERS_AT] + places.ROWS]
    column_scales = arrays.after(arm, header[places.TASK_NUMBERS_AT] + 9 + task_rows)
    factors.run_tape(
        arrays.whole_after(header, header[places.TAPE_AT]),
        arrays.after(arm, header[places.TAPE_NUMBERS_AT]),
        header[places.TAPE_STEPS],
        n,
        q,
        steps,
    )
    nearest = 0
    for f in range(count):
        step = arrays.after(steps, ends[f] * (n + 1))
        result = arrays.after(distances, count + f * (1 + n))
        result[0] = step[n]
        squares = 0.0
        for j in range(n):
            result[1 + j] = step[j]
            slope = step[j] * column_scales[j]
            squares += slope * slope
        distances[f] = factors.distance_to_zero(step[n], math.sqrt(squares))
        if distances[f] < distances[nearest]:
            nearest = f
    return nearest


def judge_row(arm: Floats, row: Floats, q: Floats, measures: Floats, work: Floats) -> None:
    """
    Fill the measures of a row, the factors there, and the level without hysteresis.

    `work` has room for `room` numbers.

    """
    header = arrays.as_whole(arm)
    integers = evaluation.chain_of(arm)
    n = integers[places.JOINTS]
    task_integers = arrays.whole_after(header, header[places.TASK_INTEGERS_AT])
    task_numbers = arrays.after(arm, header[places.TASK_NUMBERS_AT])
    singularity.measure_row(integers, task_integers, task_numbers, row, measures, work)

    count = min(n, task_integers[places.ROWS])
    judged = arrays.after(measures, places.LOST_AT + 6 + 2 * n + count)
    nearest = 0
    if header[places.FACTORS] > 0:
        nearest = _judge_factors(arm, n, q, judged, work)
        # Factors do not suffer between two singular sets; where their product is the determinant
        # nothing else is needed.
        distance = judged[places.JUDGED + nearest]
        estimate = measures[places.DISTANCE]
        complete = header[places.FACTORS_COMPLETE] != 0
        if estimate != 0.0 and (complete or not estimate < distance):
            measures[places.DISTANCE] = distance

    watched = abs(measures[header[places.WATCHED_COLUMN]])
    warn, stop = arm[places.WARN], arm[places.STOP]
    sign = 1.0 if stop < warn else -1.0
    level = 0.0
    if not sign * watched > sign * stop:
        level = 2.0
    elif not sign * watched > sign * warn:
        level = 1.0
    judged[places.WATCHED] = watched
    judged[places.LEVEL] = level
    judged[places.NEAREST] = nearest


def room(arm: Floats) -> int:
    """
    Return how many numbers `judge_row` needs room for.

    """
    header = arrays.as_whole(arm)
    n = header[header[places.CHAIN_INTEGERS_AT] + places.JOINTS]
    m = header[header[places.TASK_INTEGERS_AT] + places.ROWS]
    return max(min(m, n) * (m + n) + 6 * n + n * n, header[places.TAPE_STEPS] * (n + 1))


def width(arm: Floats) -> int:
    """
    Return the length of a row of measures.

    """
    header = arrays.as_whole(arm)
    n = header[header[places.CHAIN_INTEGERS_AT] + places.JOINTS]
    m = header[header[places.TASK_INTEGERS_AT] + places.ROWS]
    judged = places.LOST_AT + 6 + 2 * n + min(m, n) + places.JUDGED
    return judged + header[places.FACTORS] * (2 + n)


def measure(arm: Floats, rows: Floats, q: Floats, measures: Floats) -> None:
    """
    Fill `measures` with the singularity measures of each evaluated row (depth JACOBIAN or more).

    Parameters
    ----------
    arm
        As packed.pack returns it.
    rows : shape (N, width)
        As `evaluate` filled them.
    q : shape (N, n), rad or m
        Where the rows were evaluated; read only where the arm has factors.
    measures : shape (N, 6 + 6 + 2 n + min(m, n) + 3 + F (2 + n))
        Scalars DETERMINANT (NaN where J_t is not square) to RANK, the lost direction (6,) in base
        axes, the joint motion (n,) and the way out (n,) in rad or m, the singular values; WATCHED
        to NEAREST, the distances to the zeros of the F factors, value and gradient of each.

    """
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    numbers = arrays.numbers(arm, places.ARM_HEADER)
    integers = evaluation.chain_of(numbers)
    n, columns = integers[places.JOINTS], width(numbers)
    if row_width < integers[places.FRAMES_AT] or arrays.extent(measures, 1) != columns:
        raise TypeError('the arrays of measures do not go together')
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    results = arrays.results(measures, count * columns)
    work = arrays.scratch(room(numbers))
    lock = arrays.let_go()
    for k in range(count):
        judge_row(
            numbers,
            arrays.after(table, k * row_width),
            arrays.after(positions, k * n),
            arrays.after(results, k * columns),
            work,
        )
    arrays.take_back(lock)
    arrays.give_back(work)


def measure_one(arm: Floats, row: Floats, measures: Floats) -> None:
    """
    Fill `measures` for one row, after which its q stands: as `evaluate_one` filled it.

    """
    numbers = arrays.numbers(arm, places.ARM_HEADER)
    integers = evaluation.chain_of(numbers)
    tail = 2 * integers[places.JOINTS] + places.ROW_TAIL
    evaluated = arrays.numbers(row, integers[places.FRAMES_AT] + tail)
    results = arrays.results(measures, width(numbers))
    q = arrays.after(evaluated, arrays.size(row) - tail)
    work = arrays.scratch(room(numbers))
    judge_row(numbers, evaluated, q, results, work)
    arrays.give_back(work)


def evaluate_and_measure_one(
    arm: Floats, q: Floats, qdot: Floats, row: Floats, measures: Floats
) -> int:
    """
    `evaluate_one`, then `measure_one`, in one call; returns what the first returns.

    """
    bad = evaluation.evaluate_one(arm, q, qdot, row)
    if bad == -1:
        measure_one(arm, row, measures)
    return bad
