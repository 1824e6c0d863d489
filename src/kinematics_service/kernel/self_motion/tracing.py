# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Trace a curve of inverse kinematics solutions by numerical continuation (predictor and corrector)
until it closes.

Allgower and Georg, Introduction to Numerical Continuation Methods, chapters 2 and 6: an Euler step
goes along the tangent, and Newton's method corrects the result perpendicular to the tangent. The
step length depends on the angle by which the tangent turns. A sign, `CurvePoint.orientation`, is
constant along a curve. If the sign changes in a step, the step ends on another curve that nearly
crosses this curve. Then the step is repeated with half its length.
"""

from ..layout import arrays
from ..layout.arrays import Flat, Floats
from .curve_point import CurvePoint

# Length of the first step along the curve, rad.
FIRST_STEP = 0.02
# Length of the longest step along the curve, rad. The distance between two samples exceeds this
# length only by the correction of the step.
MAX_STEP = 0.1
# Length of the shortest step along the curve, rad. If a step of this length fails, the curve ends
# at a singular pose.
MIN_STEP = 1e-7
# A step is accepted if the cosine of the angle between the tangents before and after the step
# exceeds this. The angle is then below 0.35 rad.
MIN_COSINE = 0.94
# The next step is twice as long if the cosine of the angle between the tangents before and after
# this step exceeds this number. The angle is then below 0.1 rad.
DOUBLING_COSINE = 0.995
# After each step along the tangent, Newton's method moves the joints back to the curve. A step is
# accepted if the correction is shorter than MAX_CORRECTION times the step. For comparison: if the
# curve is a circle, and the tangent turns by 0.35 rad in a step, the correction is 0.18 times the
# step.
MAX_CORRECTION = 0.25
# Largest motion of a joint between two samples, rad: the longest step, MAX_STEP, plus the largest
# correction of this step by Newton's method, MAX_CORRECTION * MAX_STEP.
MAX_GAP = 0.125
# Two sets of joint positions are taken as one solution if no joint differs by more than this, rad
# or m. The tolerance is ten times the last step of Newton's method.
SOLUTION_TOLERANCE = 1e-6


def trace(point: CurvePoint, side: float, samples: Floats) -> int:
    """
    Follow the curve of solutions from a first solution until the curve closes, and fill `samples`
    with points of the curve.

    Returns the number of samples. The returned number is negative if the curve is closed; then the
    last sample is the first sample plus full turns. If the number is positive, the curve ends at a
    singular pose, or the array is full. Returns 0 if Newton's method finds no solution at the
    start.

    Parameters
    ----------
    point
        The arm and its target.
    side
        1 or -1: selects one of the two directions along the curve. `CurvePoint.orientation` is
        equal to `side` at each sample.
    samples : shape (m, 2 n), rad or m
        Filled with joint positions and unit tangents. On input, the first joint positions must be
        near a solution.
    """
    n, max_count = point.n, arrays.extent(samples, 0)
    rows = arrays.results(samples, 2 * max_count * n)
    with arrays.without_lock():
        arrays.copy(point.q, n, rows)
        point.look_along(side)
        return _trace_from(point, side, rows, max_count) if point.improve() else 0


def _trace_from(point: CurvePoint, side: float, rows: Flat, max_count: int) -> int:
    n = point.n
    step: float = FIRST_STEP
    _write(point, rows)
    for count in range(1, max_count):
        row = arrays.after(rows, 2 * n * count)
        before = arrays.after(rows, 2 * n * (count - 1))
        if _reaches(point, side, before, rows, 0.0):
            arrays.copy(row, 2 * n, rows)
            for j in range(n):
                row[j] = before[j] + point.way(j, rows[j] - before[j])
            return -count - 1
        step = _advance(point, before, side, step)
        if step == 0.0:
            return count
        _write(point, row)
    return max_count


def _write(point: CurvePoint, row: Flat) -> None:
    arrays.copy(row, point.n, point.q)
    arrays.copy(arrays.after(row, point.n), point.n, point.tangent)


def _step_from(point: CurvePoint, sample: Flat, step: float, side: float) -> float:
    # Moves `point` to the solution one step ahead of a sample. Returns the cosine of the angle
    # between the tangents at the sample and at this solution. Returns 0 if Newton's method fails,
    # if the curve turns too much between the sample and the solution, or if the solution may be on
    # another curve.
    n, border = point.n, point.border
    arrays.copy(border, n, arrays.after(sample, n))
    for j in range(n):
        point.q[j] = sample[j] + step * border[j]
    if not point.improve() or point.orientation != side:
        return 0.0
    missed: float = -step * step
    for j in range(n):
        motion = point.q[j] - sample[j]
        missed += motion * motion
    cosine: float = arrays.dot(border, point.tangent, n)
    ahead: bool = cosine > MIN_COSINE and missed < MAX_CORRECTION * MAX_CORRECTION * step * step
    return cosine if ahead else 0.0


def _advance(point: CurvePoint, before: Flat, side: float, step: float) -> float:
    # Moves `point` to the next solution along the curve, with shorter steps until one is accepted.
    # Returns the length to try for the next step, rad; 0 if no step is accepted.
    h: float = step
    while h > MIN_STEP:
        cosine: float = _step_from(point, before, h, side)
        if cosine > 0.0:
            return min(2.0 * h, MAX_STEP) if cosine > DOUBLING_COSINE else h
        h *= 0.5
    return 0.0


def _reaches(point: CurvePoint, side: float, sample: Flat, goal: Flat, least: float) -> bool:
    # Returns whether one step from a sample along the curve reaches the joint positions `goal`.
    # The step must be longer than `least`. If `least` is negative, the step may go against the
    # direction of the curve.
    n = point.n
    step: float = 0.0
    for j in range(n):
        step += sample[n + j] * point.way(j, goal[j] - sample[j])
    is_reached: bool = least < step < MAX_GAP and _step_from(point, sample, step, side) > 0.0
    for j in range(n):
        is_reached = is_reached and abs(point.way(j, goal[j] - point.q[j])) < SOLUTION_TOLERANCE
    return is_reached


def passes(point: CurvePoint, samples: Floats, q: Floats) -> bool:
    """
    Return whether a curve of solutions contains the solution q (n,), up to full turns.

    Parameters
    ----------
    point
        The arm and its target.
    samples : shape (m, 2 n)
        Joint positions and unit tangents at points of the curve. `CurvePoint.orientation` is 1 for
        each tangent.
    q : shape (n,), rad or m
        The solution.
    """
    n, count = point.n, arrays.extent(samples, 0)
    rows, goal = arrays.numbers(samples, 2 * count * n), arrays.numbers(q, n)
    # Without these type annotations `k` would be an object of Python, which needs the
    # interpreter's lock.
    k: int = 0
    is_passed: bool = False
    with arrays.without_lock():
        while k < count and not is_passed:
            row = arrays.after(rows, 2 * n * k)
            distance: float = 0.0
            for j in range(n):
                distance = max(distance, abs(point.way(j, goal[j] - row[j])))
            is_passed = distance < MAX_GAP and _reaches(point, 1.0, row, goal, -MAX_GAP)
            # Skip samples that are too far from q. A joint moves by at most MAX_GAP between
            # neighboring samples.
            skipped: int = int(max(distance / MAX_GAP - 1.0, 0.0))
            k += 1 + skipped
    return is_passed
