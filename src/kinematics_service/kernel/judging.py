# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the singularity measures of poses from the results of `evaluate`. The measures include the
singular factors, the level (OK, WARN or ERROR) and the nearest singular pose.
"""

import math

from . import evaluation
from .layout import arrays, blocks, places
from .layout.arrays import Flat, Floats
from .measures import factors, gradient, singularity
from .singular_search.arm import Arm
from .singular_search.nearest_search import NearestSearch


def _judge_loops(arm: Arm, row: Flat, measures: Flat, work: Flat) -> None:
    # Writes the distances to the zeros of the loop determinants. In the row of measures they
    # follow the distances to the zeros of the factors of the robot file.
    # At a zero of a loop determinant, a branch of solutions of the loop equations ends. Let s be
    # the distance to the end. Near the end, the determinant is c sqrt(s) with a constant c. Its
    # slope is c / (2 sqrt(s)), so the determinant divided by its slope is 2 s. Therefore half of
    # this quotient is written.
    # J grows toward the end of a branch, so the gradient of the manipulability leads to this end,
    # not away from it. Therefore, if the end of a branch is the nearest singular pose, the measure
    # `way_out` is computed from the loop determinant.
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
    # Writes to the measure `way_out` the joint motion that leads away from the zero of a
    # determinant. The array `determinant` has the value of the determinant, then its gradient.
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
    # Writes the absolute value of the watched measure, which the robot file selects, and its
    # level: 0 for OK, 1 for WARN, 2 for ERROR. Writes the index of the singular factor whose zero
    # is nearest.
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
    by_distance = arm.watched == places.DISTANCE
    if by_distance and not watched < places.FARTHEST:
        level = 0.0  # OK: no singular pose was found within FARTHEST
    elif not sign * watched > sign * arm.stop:
        level = 2.0
    elif not sign * watched > sign * arm.warn:
        level = 1.0
    if by_distance and measures[places.CONDITION_NUMBER] > places.NEARLY_SINGULAR:
        level = max(level, 1.0)
    judged[places.LEVEL] = level
    judged[places.NEAREST_FACTOR] = nearest


def _first_order(arm: Arm, measures: Flat) -> float:
    # Returns the first-order distance to a singular pose, rad. Between two surfaces of singular
    # poses, the distance computed from the manipulability is wrong, but the distances to the zeros
    # of the singular factors are right. If the product of the factors is the determinant of J_t,
    # only the factors are used.
    estimate = measures[places.DISTANCE]
    distances = arrays.after(measures, _judged_at(arm) + places.JUDGED)
    nearest = places.PI
    for f in range(_factors(arm)):
        nearest = min(nearest, distances[f])
    if _factors(arm) == 0 or estimate == 0.0:
        return estimate
    return nearest if arm.factors_complete else min(estimate, nearest)


def _judge_first_order(arm: Arm, measures: Flat) -> None:
    # Writes preliminary values, which a search for the nearest singular pose later replaces. The
    # distance to a singular pose is the first-order distance. The nearest singular pose is NaN.
    judged = arrays.after(measures, _judged_at(arm))
    pose = arrays.after(measures, width(arm) - arm.chain.dof)
    estimate = _first_order(arm, measures)
    judged[places.FIRST_ORDER] = estimate
    for j in range(arm.chain.dof):
        pose[j] = places.NAN
    measures[places.DISTANCE] = min(estimate, places.FARTHEST)
    _judge(arm, measures)


def _write_search_result(
    arm: Arm, row: Flat, measures: Flat, work: Flat, search: NearestSearch
) -> None:
    # Replaces the first-order distance by the distance that `search` found, and writes the nearest
    # singular pose.
    measures[places.DISTANCE] = places.FARTHEST
    if search.distance <= places.FARTHEST:
        search.write_pose(arrays.after(measures, width(arm) - arm.chain.dof))
        measures[places.DISTANCE] = search.distance
        if arm.chain.loops > 0:
            _write_loop_results(arm, row, measures, work, search)
    _judge(arm, measures)


def _write_loop_results(
    arm: Arm, row: Flat, measures: Flat, work: Flat, search: NearestSearch
) -> None:
    # The search has found distances to joint positions at which the loop equations are singular.
    # Writes these distances. Then writes `way_out`, the joint motion that leads away from the
    # nearest singular pose.
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
    Fill `measures` with the singularity measures at q, including the nearest singular pose.

    The measures include the factors of the determinant and the level (without hysteresis). A
    search finds the nearest singular pose. `row` has the results of `evaluate` at q. `work` is
    scratch memory; the function `room` returns its size. `search` is a new `NearestSearch`, or the
    one that was used for the previous pose of the same motion.
    """
    _judge_one(arm, row, q, measures, work)
    search.follow(q, row)
    _write_search_result(arm, row, measures, work, search)


def _judge_one(arm: Arm, row: Flat, q: Flat, measures: Flat, work: Flat) -> None:
    # Fills the measures of one pose. No search runs, so the distance to a singular pose is only
    # the first-order estimate. The singular vectors stay in `work`.
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
    # Fills the measures of LANES poses, with first-order distances to singular poses. Returns a
    # bit mask of the poses that could not be computed together; the caller must compute each of
    # these poses by `_judge_one`.
    n, columns, length = arm.chain.dof, width(arm), arm.chain.frames_at
    measured = work
    evaluated = arrays.after(measured, columns * places.LANES)
    free = arrays.after(evaluated, length * places.LANES)
    blocks.put_side_by_side(rows, row_width, length, evaluated)
    alone = singularity.measure_rows(arm.chain, arm.task, evaluated, measured, free)
    if arm.tape.factors > 0:
        positions = arrays.after(free, arm.tape.steps * (n + 1) * places.LANES)
        blocks.put_side_by_side(q, n, n, positions)
        distances = arrays.after(measured, (_judged_at(arm) + places.JUDGED) * places.LANES)
        if not factors.judge_factors(
            arm.tape, arm.task, _factors(arm), positions, distances, free, places.LANES
        ):
            return singularity.ALL_LANE_BITS
    blocks.put_one_by_one(measured, columns, measures, columns)
    for lane in range(places.LANES):
        if not (alone >> lane) & 1:
            _judge_first_order(arm, arrays.after(measures, lane * columns))
    return alone


def _is_regular(arm: Arm) -> bool:
    # Returns whether `measure_rows` can measure LANES poses of this arm at once.
    return arm.task.generic_rank == min(arm.chain.dof, arm.task.count) and arm.chain.loops == 0


def _judged_at(arm: Arm) -> int:
    return places.LOST_AT + 6 + 2 * arm.chain.dof + min(arm.chain.dof, arm.task.count)


def _factors(arm: Arm) -> int:
    # Returns the number of singular factors: those of the robot file, and one determinant for each
    # group of loops.
    return arm.tape.factors + arm.chain.groups


def _directions(arm: Arm) -> int:
    # Returns how many numbers at the beginning of `work` store the singular vectors that
    # `measure_row` writes.
    n, m = arm.chain.dof, arm.task.count
    return min(m, n) * (m + n)


def room(arm: Arm) -> int:
    """Return how many numbers of scratch memory `judge_row` needs."""
    n = arm.chain.dof
    spare = max(n * n, gradient.room(arm.chain))
    size = _directions(arm) + max(6 * n + spare, arm.tape.steps * (n + 1))
    return max(size, arm.chain.groups * (1 + n) + gradient.room(arm.chain))


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
    Fill `measures` with the singularity measures of N poses.

    The distance to a singular pose is a first-order estimate. `find_nearest` later replaces it by
    the result of a search.

    Parameters
    ----------
    arm
        The arm.
    rows : shape (N, width)
        The results of `evaluate` at the poses, with depth JACOBIAN or ALL_FRAMES.
    q : shape (N, n), rad or m
        Joint positions of the rows.
    measures : shape (N, width(arm))
        One row for each pose. The task Jacobian J_t has m rows, and the arm has F singular
        factors: first the factors of the robot file, then the loop determinants. A row has, in
        this order:

        - six scalars: DETERMINANT (NaN if J_t is not square) to RANK;
        - the lost direction (6,): the tool motion that is hardest to produce, in base axes;
        - two joint motions (n,), rad or m: the motion that moves the tool least, and the motion
          that leads away from singular poses fastest;
        - the singular values of J_t (min(m, n),);
        - four numbers: WATCHED, LEVEL, NEAREST_FACTOR and FIRST_ORDER;
        - the distances to the zeros of the factors (F,), rad;
        - the value and gradient of each factor (F, 1 + n);
        - the nearest singular pose (n,).
    """
    _check_rows(arm, rows, measures)
    n, columns, regular = arm.chain.dof, width(arm), _is_regular(arm)
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    results = arrays.results(measures, count * columns)
    work = arrays.scratch(_room_side_by_side(arm))
    with arrays.without_lock():
        k = 0
        while k < count:
            row, q_k = arrays.after(table, k * row_width), arrays.after(positions, k * n)
            result = arrays.after(results, k * columns)
            block, alone = 1, 1
            if regular and count - k >= places.LANES:
                block = places.LANES
                alone = _judge_rows(arm, row, row_width, q_k, result, work)
            for lane in range(block):
                if (alone >> lane) & 1:
                    _judge_one(
                        arm,
                        arrays.after(row, lane * row_width),
                        arrays.after(q_k, lane * n),
                        arrays.after(result, lane * columns),
                        work,
                    )
            k += block
    arrays.give_back(work)


def find_nearest(
    search: NearestSearch, rows: Floats, q: Floats, measures: Floats, in_order: bool
) -> None:
    """
    Search the singular pose nearest to each of N poses, and write the results into `measures`.

    Parameters
    ----------
    search
        The search for singular poses, which knows the arm.
    rows : shape (N, width)
        The results of `evaluate` at the poses, with depth JACOBIAN or ALL_FRAMES.
    q : shape (N, n), rad or m
        Joint positions of the rows.
    measures
        The rows that `measure` has filled for the poses. The results of the search replace the
        first-order distances to singular poses.
    in_order
        Whether the poses are successive poses of a motion. If so, each search continues from the
        search of the previous pose.
    """
    arm = search.arm
    _check_rows(arm, rows, measures)
    n, columns = arm.chain.dof, width(arm)
    count, row_width = arrays.extent(rows, 0), arrays.extent(rows, 1)
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    results = arrays.results(measures, count * columns)
    work = arrays.scratch(room(arm))
    with arrays.without_lock():
        for k in range(count):
            position, row = arrays.after(positions, k * n), arrays.after(table, k * row_width)
            if in_order:
                search.follow(position, row)
            else:
                search.look(position, row)
            _write_search_result(arm, row, arrays.after(results, k * columns), work, search)
    arrays.give_back(work)


def measure_one(search: NearestSearch, row: Floats, measures: Floats) -> None:
    """
    Fill the singularity measures of one pose, including the result of a search for the nearest
    singular pose.

    `evaluate_one` must have filled the row, because q and qdot are read from the end of the row.
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
    """
    Call `evaluate_one` at q, then `measure_one`; return the result code of `evaluate_one`.

    The search for the nearest singular pose starts anew; it uses no result of an earlier pose.
    """
    stopped = evaluation.evaluate_one(arm.chain, q, qdot, row)
    if stopped == -1:
        measure_one(NearestSearch(arm), row, measures)
    return stopped
