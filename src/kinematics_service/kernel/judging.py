"""The measures of evaluated rows with the factors there, and the level they come to."""

import math

from . import evaluation
from .arm import Arm
from .layout import arrays, lanes, places
from .layout.arrays import Floats
from .measures import factor_lanes, factors, measure_lanes, singularity


def _judge_factors(arm: Arm, q: Floats, judged: Floats, steps: Floats) -> None:
    # Fills distances, values and gradients of the factors.
    n, count = arm.chain.dof, arm.tape.factors
    distances = arrays.after(judged, places.JUDGED)
    factors.run_tape(arm.tape, n, q, steps)
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


def _judge(arm: Arm, measures: Floats) -> None:
    # Distance, nearest factor and level, of all that has been measured.
    judged = arrays.after(measures, _judged_at(arm))
    distances = arrays.after(judged, places.JUDGED)
    nearest = 0
    for f in range(arm.tape.factors):
        if distances[f] < distances[nearest]:
            nearest = f
    if arm.tape.factors > 0:
        # Factors do not suffer between two singular sets; where their product is the determinant
        # nothing else is needed.
        estimate = measures[places.DISTANCE]
        if estimate != 0.0 and (arm.factors_complete or not estimate < distances[nearest]):
            measures[places.DISTANCE] = distances[nearest]

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


def judge_row(arm: Arm, row: Floats, q: Floats, measures: Floats, work: Floats) -> None:
    """
    Fill the measures of a row, the factors there, and the level without hysteresis.

    `work` has room for `room` numbers.
    """
    singularity.measure_row(arm.chain, arm.task, row, measures, work)
    if arm.tape.factors > 0:
        _judge_factors(arm, q, arrays.after(measures, _judged_at(arm)), work)
    _judge(arm, measures)


def _judge_rows(
    arm: Arm, rows: Floats, row_width: int, q: Floats, measures: Floats, work: Floats
) -> int:
    # As `judge_row` fills each of LANES rows; returns a bit for each that is left to it.
    n, columns, length = arm.chain.dof, width(arm), arm.chain.frames_at
    measured = work
    evaluated = arrays.after(measured, columns * places.LANES)
    free = arrays.after(evaluated, length * places.LANES)
    lanes.put_side_by_side(rows, row_width, length, evaluated)
    left = measure_lanes.measure_rows(arm.chain, arm.task, evaluated, measured, free)
    if arm.tape.factors > 0:
        positions = arrays.after(free, arm.tape.steps * (n + 1) * places.LANES)
        lanes.put_side_by_side(q, n, n, positions)
        judged = arrays.after(measured, (_judged_at(arm) + places.JUDGED) * places.LANES)
        if not factor_lanes.judge_factors(arm.tape, arm.task, positions, judged, free):
            return measure_lanes.ALL_LANES
    lanes.put_one_by_one(measured, columns, measures, columns)
    for lane in range(places.LANES):
        _judge(arm, arrays.after(measures, lane * columns))
    return left


def _judge_all(
    arm: Arm, count: int, rows: Floats, row_width: int, q: Floats, measures: Floats, work: Floats
) -> None:
    n, columns = arm.chain.dof, width(arm)
    regular = arm.task.generic_rank == min(n, arm.task.count)
    k = 0
    while k < count:
        together, left = 1, 1
        if regular and count - k >= places.LANES:
            together = places.LANES
            left = _judge_rows(
                arm,
                arrays.after(rows, k * row_width),
                row_width,
                arrays.after(q, k * n),
                arrays.after(measures, k * columns),
                work,
            )
        for one in range(k, k + together):
            if left & 1:
                judge_row(
                    arm,
                    arrays.after(rows, one * row_width),
                    arrays.after(q, one * n),
                    arrays.after(measures, one * columns),
                    work,
                )
            left >>= 1
        k += together


def _judged_at(arm: Arm) -> int:
    return places.LOST_AT + 6 + 2 * arm.chain.dof + min(arm.chain.dof, arm.task.count)


def room(arm: Arm) -> int:
    """Return how many numbers `judge_row` needs room for."""
    n, m = arm.chain.dof, arm.task.count
    return max(min(m, n) * (m + n) + 6 * n + n * n, arm.tape.steps * (n + 1))


def width(arm: Arm) -> int:
    """Return the length of a row of measures."""
    return _judged_at(arm) + places.JUDGED + arm.tape.factors * (2 + arm.chain.dof)


def _room_side_by_side(arm: Arm) -> int:
    n, m = arm.chain.dof, arm.task.count
    free = max(min(m, n) * (m + n) + 6 * n, arm.tape.steps * (n + 1) + n)
    return max(room(arm), places.LANES * (width(arm) + arm.chain.frames_at + free))


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
    work = arrays.scratch(_room_side_by_side(arm))
    lock = arrays.let_go()
    _judge_all(arm, count, table, row_width, positions, results, work)
    arrays.take_back(lock)
    arrays.give_back(work)


def measure_one(arm: Arm, row: Floats, measures: Floats) -> None:
    """Fill `measures` for one row, after which its q stands: as `evaluate_one` filled it."""
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
    """`evaluate_one`, then `measure_one`, in one call; returns what the first returns."""
    bad = evaluation.evaluate_one(arm, q, qdot, row)
    if bad == -1:
        measure_one(arm, row, measures)
    return bad
