"""The measures of evaluated rows with the factors there, and the level they come to."""

import math

from . import evaluation
from .layout import arrays, blocks, places
from .layout.arrays import Flat, Floats
from .measures import factors, gradient, singularity
from .singular_search.arm import Arm
from .singular_search.nearest_search import NearestSearch


def _judge_loops(arm: Arm, row: Flat, measures: Flat, work: Flat) -> None:
    # The same of the loops' determinants, behind the factors. Where a branch ends, its determinant
    # falls as a root, and it is half as far as the first order says. J grows towards there: the
    # way out of the manipulability would lead to the end of a branch that is nearer than the arm
    # is to a singular pose.
    n, count = arm.chain.dof, _factors(arm)
    distances = arrays.after(measures, _judged_at(arm) + places.JUDGED)
    nearest, first = measures[places.DISTANCE], -1
    results = arrays.after(distances, count + arm.tape.factors * (1 + n))
    gradient.write_determinants(arm.chain, row, results, work)
    for k in range(arm.chain.groups):
        squares = 0.0
        for j in range(n):
            slope = results[k * (1 + n) + 1 + j] * arm.task.column_scale[j]
            squares += slope * slope
        determinant, norm = results[k * (1 + n)], math.sqrt(squares)
        away = 0.5 * factors.distance_to_zero(determinant, norm)
        distances[arm.tape.factors + k] = away
        if away < nearest:
            nearest, first = away, k
    if first >= 0:
        _write_way_out(arm, arrays.after(results, first * (1 + n)), measures)


def _write_way_out(arm: Arm, determinant: Flat, measures: Flat) -> None:
    # Away from the flat position of a group of loops, by its determinant and gradient.
    n, squares = arm.chain.dof, 0.0
    way_out = arrays.after(measures, places.LOST_AT + 6 + n)
    sign = 1.0 if determinant[0] > 0.0 else -1.0
    for j in range(n):
        slope = determinant[1 + j] * arm.task.column_scale[j]
        squares += slope * slope
    for j in range(n):
        slope = determinant[1 + j] * arm.task.column_scale[j]
        way_out[j] = sign * slope / math.sqrt(squares) * arm.task.column_scale[j]


def _judge(arm: Arm, measures: Flat) -> None:
    # Nearest factor and level, of all that has been measured and found.
    judged = arrays.after(measures, _judged_at(arm))
    distances = arrays.after(judged, places.JUDGED)
    nearest = 0
    for f in range(_factors(arm)):
        if distances[f] < distances[nearest]:
            nearest = f
    watched = abs(measures[arm.watched])
    judged[places.WATCHED] = watched
    sign = 1.0 if arm.stop < arm.warn else -1.0
    level = 0.0
    if arm.watched == places.DISTANCE and not watched < places.FARTHEST:
        level = 0.0  # none was found: no threshold is farther
    elif not sign * watched > sign * arm.stop:
        level = 2.0
    elif not sign * watched > sign * arm.warn:
        level = 1.0
    if arm.watched == places.DISTANCE and level == 0.0:
        nearly = measures[places.CONDITION_NUMBER] > places.NEARLY_SINGULAR
        level = 1.0 if nearly else 0.0
    judged[places.LEVEL] = level
    judged[places.NEAREST] = nearest


def _first_order(arm: Arm, measures: Flat) -> float:
    # Factors do not suffer between two singular sets; where their product is the determinant
    # nothing else is needed.
    estimate = measures[places.DISTANCE]
    distances = arrays.after(measures, _judged_at(arm) + places.JUDGED)
    nearest = places.PI
    for f in range(_factors(arm)):
        nearest = min(nearest, distances[f])
    if _factors(arm) == 0 or estimate == 0.0:
        return estimate
    return nearest if arm.factors_complete else min(estimate, nearest)


def _judge_first_order(arm: Arm, measures: Flat) -> None:
    # The distance by first order: no singular pose has been looked for.
    judged = arrays.after(measures, _judged_at(arm))
    pose = arrays.after(measures, width(arm) - arm.chain.dof)
    estimate = _first_order(arm, measures)
    judged[places.FIRST_ORDER] = estimate
    for j in range(arm.chain.dof):
        pose[j] = places.NAN
    measures[places.DISTANCE] = min(estimate, places.FARTHEST)
    _judge(arm, measures)


def _take_over(arm: Arm, row: Flat, measures: Flat, work: Flat, search: NearestSearch) -> None:
    # What was found, into measures of first order.
    measures[places.DISTANCE] = places.FARTHEST
    if search.distance <= places.FARTHEST:
        search.write_pose(arrays.after(measures, width(arm) - arm.chain.dof))
        measures[places.DISTANCE] = search.distance
        if arm.chain.loops > 0:
            _take_loops_over(arm, row, measures, work, search)
    _judge(arm, measures)


def _take_loops_over(
    arm: Arm, row: Flat, measures: Flat, work: Flat, search: NearestSearch
) -> None:
    # The flat positions that were found; the way out is that of what is nearest now.
    n, first = arm.chain.dof, -1
    judged = arrays.after(measures, _judged_at(arm))
    distances = arrays.after(judged, places.JUDGED + arm.tape.factors)
    nearest: float = search.distance
    for k in range(arm.chain.groups):
        if search.flat_lengths[k] < places.INFINITY:
            distances[k] = search.flat_lengths[k]
        if distances[k] <= nearest:
            nearest, first = distances[k], k
    if first >= 0:
        gradient.write_determinants(
            arm.chain, row, work, arrays.after(work, arm.chain.groups * (1 + n))
        )
        _write_way_out(arm, arrays.after(work, first * (1 + n)), measures)
    else:
        singularity.measure_row(arm.chain, arm.task, row, measures, work)
        measures[places.DISTANCE] = search.distance


def judge_row(
    arm: Arm, row: Flat, q: Flat, measures: Flat, work: Flat, search: NearestSearch
) -> None:
    """
    Fill the measures of a row, the factors there, and the level without hysteresis.

    `work` has room for `room` numbers; the search is that of the pose before, or a new one.
    """
    _judge_one(arm, row, q, measures, work)
    search.follow(q, row)
    _take_over(arm, row, measures, work, search)


def _judge_one(arm: Arm, row: Flat, q: Flat, measures: Flat, work: Flat) -> None:
    # As `judge_row`, by first order; leaves the directions in `work`.
    singularity.measure_row(arm.chain, arm.task, row, measures, work)
    if arm.tape.factors > 0:
        steps = arrays.after(work, _directions(arm))
        distances = arrays.after(measures, _judged_at(arm) + places.JUDGED)
        factors.judge_factors(arm.tape, arm.task, _factors(arm), q, distances, steps, 1)
    if arm.chain.loops > 0:
        _judge_loops(arm, row, measures, arrays.after(work, _directions(arm)))
    _judge_first_order(arm, measures)


def _judge_rows(
    arm: Arm,
    rows: Flat,
    row_width: int,
    q: Flat,
    measures: Flat,
    work: Flat,
) -> int:
    # As `_judge_one` fills each of LANES rows; returns a bit for each that is left to it.
    n, columns, length = arm.chain.dof, width(arm), arm.chain.frames_at
    measured = work
    evaluated = arrays.after(measured, columns * places.LANES)
    free = arrays.after(evaluated, length * places.LANES)
    blocks.put_side_by_side(rows, row_width, length, evaluated)
    left = singularity.measure_rows(arm.chain, arm.task, evaluated, measured, free)
    if arm.tape.factors > 0:
        positions = arrays.after(free, arm.tape.steps * (n + 1) * places.LANES)
        blocks.put_side_by_side(q, n, n, positions)
        distances = arrays.after(measured, (_judged_at(arm) + places.JUDGED) * places.LANES)
        if not factors.judge_factors(
            arm.tape, arm.task, _factors(arm), positions, distances, free, places.LANES
        ):
            return singularity.ALL_LANES
    blocks.put_one_by_one(measured, columns, measures, columns)
    for lane in range(places.LANES):
        if (left >> lane) & 1:
            continue
        _judge_first_order(arm, arrays.after(measures, lane * columns))
    return left


def _judge_all(
    arm: Arm,
    count: int,
    rows: Flat,
    row_width: int,
    q: Flat,
    measures: Flat,
    work: Flat,
) -> None:
    n, columns = arm.chain.dof, width(arm)
    regular = _is_regular(arm)
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
                _judge_one(
                    arm,
                    arrays.after(rows, one * row_width),
                    arrays.after(q, one * n),
                    arrays.after(measures, one * columns),
                    work,
                )
            left >>= 1
        k += together


def _find_all(
    arm: Arm,
    count: int,
    rows: Flat,
    row_width: int,
    q: Flat,
    measures: Flat,
    work: Flat,
    search: NearestSearch,
    in_order: bool,
) -> None:
    n, columns = arm.chain.dof, width(arm)
    for k in range(count):
        position, row = arrays.after(q, k * n), arrays.after(rows, k * row_width)
        if in_order:
            search.follow(position, row)
        else:
            search.look(position, row)
        _take_over(arm, row, arrays.after(measures, k * columns), work, search)


def _is_regular(arm: Arm) -> bool:
    # Whether LANES poses can be taken at once.
    return arm.task.generic_rank == min(arm.chain.dof, arm.task.count) and arm.chain.loops == 0


def _judged_at(arm: Arm) -> int:
    return places.LOST_AT + 6 + 2 * arm.chain.dof + min(arm.chain.dof, arm.task.count)


def _factors(arm: Arm) -> int:
    # Of the robot file, and the determinants of loops.
    return arm.tape.factors + arm.chain.groups


def _directions(arm: Arm) -> int:
    # How many numbers the directions that `measure_row` leaves take.
    n, m = arm.chain.dof, arm.task.count
    return min(m, n) * (m + n)


def room(arm: Arm) -> int:
    """Return how many numbers `judge_row` needs room for."""
    n = arm.chain.dof
    spare = max(n * n, gradient.room(arm.chain))
    own = _directions(arm) + max(6 * n + spare, arm.tape.steps * (n + 1))
    return max(own, arm.chain.groups * (1 + n) + gradient.room(arm.chain))


def width(arm: Arm) -> int:
    """Return the length of a row of measures."""
    n = arm.chain.dof
    return _judged_at(arm) + places.JUDGED + _factors(arm) * (2 + n) + n


def _room_side_by_side(arm: Arm) -> int:
    n, m = arm.chain.dof, arm.task.count
    free = max(min(m, n) * (m + n) + 6 * n, arm.tape.steps * (n + 1) + n)
    return max(room(arm), places.LANES * (width(arm) + arm.chain.frames_at + free))


def _check_rows(arm: Arm, rows: Floats, measures: Floats) -> None:
    if (
        arrays.extent(rows, 1) < arm.chain.frames_at
        or arrays.extent(measures, 0) != arrays.extent(rows, 0)
        or arrays.extent(measures, 1) != width(arm)
    ):
        raise TypeError('the arrays of measures do not go together')


def measure(arm: Arm, rows: Floats, q: Floats, measures: Floats) -> None:
    """
    Fill `measures` with the singularity measures of each evaluated row (depth JACOBIAN or more).

    The distance is of first order: `find_nearest` looks for the singular poses.

    Parameters
    ----------
    arm
        The arm.
    rows : shape (N, width)
        As `evaluate` filled them.
    q : shape (N, n), rad or m
        Where the rows were evaluated.
    measures : shape (N, 6 + 6 + 2 n + min(m, n) + 4 + F (2 + n) + n)
        Scalars DETERMINANT (NaN where J_t is not square) to RANK, the lost direction (6,) in base
        axes, the joint motion (n,) and the way out (n,) in rad or m, the singular values; WATCHED
        to FIRST_ORDER; the distances to the zeros of the F factors, those of loops behind those of
        the robot file; value and gradient of each; the singular pose that was found nearest (n,).
    """
    _check_rows(arm, rows, measures)
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * arm.chain.dof)
    results = arrays.results(measures, count * width(arm))
    work = arrays.scratch(_room_side_by_side(arm))
    lock = arrays.let_go()
    _judge_all(arm, count, table, row_width, positions, results, work)
    arrays.take_back(lock)
    arrays.give_back(work)


def find_nearest(
    search: NearestSearch, rows: Floats, q: Floats, measures: Floats, in_order: bool
) -> None:
    """
    Look for the singular pose nearest to each pose, and bring what `measure` filled up to it.

    Parameters
    ----------
    search
        Of the arm.
    rows, q, measures
        As in `measure`.
    in_order
        Whether they are poses of a motion, of which the search has seen those before.
    """
    arm = search.arm
    _check_rows(arm, rows, measures)
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * arm.chain.dof)
    results = arrays.results(measures, count * width(arm))
    work = arrays.scratch(room(arm))
    lock = arrays.let_go()
    _find_all(arm, count, table, row_width, positions, results, work, search, in_order)
    arrays.take_back(lock)
    arrays.give_back(work)


def measure_one(search: NearestSearch, row: Floats, measures: Floats) -> None:
    """
    Do `measure` and `find_nearest` for one row, after which its q stands, as `evaluate_one` has
    it.
    """
    arm = search.arm
    tail = 2 * arm.chain.dof + places.ROW_TAIL
    evaluated = arrays.numbers(row, arm.chain.frames_at + tail)
    results = arrays.results(measures, width(arm))
    q = arrays.after(evaluated, arrays.size(row) - tail)
    work = arrays.scratch(room(arm))
    judge_row(arm, evaluated, q, results, work, search)
    arrays.give_back(work)


def evaluate_and_measure_one(
    arm: Arm, q: Floats, qdot: Floats, row: Floats, measures: Floats
) -> int:
    """`evaluate_one`, then `measure_one` with a new search; returns what the first returns."""
    bad = evaluation.evaluate_one(arm.chain, q, qdot, row)
    if bad == -1:
        measure_one(NearestSearch(arm), row, measures)
    return bad
