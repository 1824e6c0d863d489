"""
Trace a curve of solutions by numerical continuation: predictor and corrector, until it closes.

Allgower and Georg, Introduction to Numerical Continuation Methods, chapters 2 and 6: an Euler step
along the tangent, Newton's method with the joint held that moves most, a step length by how far
the tangent turns. Tangents are oriented by a determinant: a step onto another curve that nearly
crosses this one turns the tangent back, and is repeated with half its length.
"""

import math

from ..layout import arrays
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers
from .curve_point import ANY, CurvePoint

# Length of the first step, rad.
FIRST_STEP = 0.02
# Longest step, rad: samples are not farther apart than a tenth of a rad.
LONGEST_STEP = 0.1
# A shorter step ends the curve, rad: a singular pose is there.
SHORTEST_STEP = 1e-7
# Least cosine of the angle between two tangents (0.35 rad): beyond it a step is halved.
COSINE_HALVED = 0.94
# Cosine of the angle between two tangents (0.1 rad) below which a step is doubled.
COSINE_DOUBLED = 0.995
# Largest correction, as a share of the step; 0.18 if the tangent turns by 0.35 rad.
CORRECTION = 0.25
# Largest way of a joint between two samples, rad: LONGEST_STEP and its correction.
FARTHEST_STEP = 0.125
# A solution is compared with samples that are nearer, rad: one and a half steps.
COMPARED = 0.15
# Solutions are one if their joints differ by less, rad or m.
SAME_SOLUTION = 1e-6
TURN = 2.0 * math.pi


def trace(point: CurvePoint, start: Floats, side: float, samples: Floats, closed: Integers) -> int:
    """
    Follow the curve of solutions from one of them until it closes; return how many samples.

    Parameters
    ----------
    point
        The arm and its target.
    start : shape (n,), rad or m
        Near a solution: positions of the screws.
    side
        1 or -1: in which direction.
    samples : shape (m, 2 n)
        Positions of the screws, and the unit tangent.
    closed : shape (1,)
        1 if the curve closed; 0 if it ends at a singular pose, or the room was used up.
    """
    n, most = point.n, arrays.extent(samples, 0)
    rows, how = arrays.results(samples, 2 * most * n), arrays.whole_results(closed, 1)
    arrays.copy(point.psi, n, arrays.numbers(start, n))
    how[0] = 0
    lock = arrays.let_go()
    count = 0
    if point.improve(ANY) and point.write_tangent(ANY):
        count = _traced(point, side, rows, most, how)
    arrays.take_back(lock)
    return count


def _traced(point: CurvePoint, side: float, rows: Flat, most: int, how: FlatIntegers) -> int:
    n = point.n
    step: float = FIRST_STEP
    _orient(point, side)
    _write(point, rows)
    for count in range(1, most):
        before = arrays.after(rows, 2 * n * (count - 1))
        step = _advance(point, before, side, step)
        if step == 0.0:
            return count
        row = arrays.after(rows, 2 * n * count)
        _write(point, row)
        if count > 1 and _passes_start(point, rows, before, row):
            how[0] = 1
            return count
        # The test has moved the point.
        arrays.copy(point.psi, n, row)
        arrays.copy(point.tangent, n, arrays.after(row, n))
    return most


def _orient(point: CurvePoint, side: float) -> None:
    for j in range(point.n):
        point.tangent[j] *= side * point.orientation


def _write(point: CurvePoint, row: Flat) -> None:
    arrays.copy(row, point.n, point.psi)
    arrays.copy(arrays.after(row, point.n), point.n, point.tangent)


def _advance(point: CurvePoint, before: Flat, side: float, step: float) -> float:
    # Moves the point to the next solution and returns the length of the step after it, or 0.
    n, tangent = point.n, arrays.after(before, point.n)
    h: float = step
    parameter = _largest(tangent, n)
    while h > SHORTEST_STEP:
        for j in range(n):
            point.psi[j] = before[j] + h * tangent[j]
        if point.improve(parameter):
            _orient(point, side)
            missed: float = 0.0
            for j in range(n):
                way = point.psi[j] - before[j] - h * tangent[j]
                missed += way * way
            cosine: float = arrays.dot(tangent, point.tangent, n)
            if cosine > COSINE_HALVED and missed < CORRECTION * CORRECTION * h * h:
                return min(2.0 * h, LONGEST_STEP) if cosine > COSINE_DOUBLED else h
        h *= 0.5
    return 0.0


def _largest(tangent: Flat, n: int) -> int:
    best = 0
    for j in range(1, n):
        if abs(tangent[j]) > abs(tangent[best]):
            best = j
    return best


def _away(point: CurvePoint, j: int, way: float) -> float:
    # A way of a screw without full turns.
    if point.screws[7 * j + 6] > 0.5:
        return way
    return way - TURN * math.floor(way / TURN + 0.5)


def _passes_start(point: CurvePoint, start: Flat, before: Flat, after: Flat) -> bool:
    # Whether the start is between two samples.
    n, tangent = point.n, arrays.after(start, point.n)
    ahead: float = 0.0
    passed: float = 0.0
    for j in range(n):
        ahead += tangent[j] * _away(point, j, start[j] - before[j])
        passed += tangent[j] * _away(point, j, start[j] - after[j])
    return ahead > 0.0 and passed <= 0.0 and _leads_to(point, before, start)


def _leads_to(point: CurvePoint, sample: Flat, goal: Flat) -> bool:
    # Whether a goal, near a sample, is on the curve through the sample: the corrector holds the
    # joint that moves most at the goal's position.
    n, tangent = point.n, arrays.after(sample, point.n)
    parameter: int = _largest(tangent, n)
    far: float = 0.0
    for j in range(n):
        way = _away(point, j, goal[j] - sample[j])
        far += way * way
        if far > COMPARED * COMPARED:
            return False
    step: float = _away(point, parameter, goal[parameter] - sample[parameter])
    step /= tangent[parameter]
    arrays.copy(point.psi, n, sample)
    if not point.write_tangent(ANY):
        return False
    side: float = point.orientation * arrays.dot(tangent, point.tangent, n)
    for j in range(n):
        point.psi[j] = sample[j] + step * tangent[j]
    same: bool = point.improve(parameter)
    same = same and side * point.orientation * arrays.dot(tangent, point.tangent, n) > 0.0
    for j in range(n):
        same = same and abs(_away(point, j, goal[j] - point.psi[j])) < SAME_SOLUTION
    return same


def _farthest(point: CurvePoint, sample: Flat, goal: Flat) -> float:
    # The largest way of a joint from a sample to a goal without full turns.
    most: float = 0.0
    for j in range(point.n):
        most = max(most, abs(_away(point, j, goal[j] - sample[j])))
    return most


def passes(point: CurvePoint, samples: Floats, psi: Floats) -> bool:
    """
    Return whether a curve passes a solution (n,), full turns left out.

    Parameters
    ----------
    point
        The arm and its target.
    samples : shape (m, 2 n)
        Positions of the screws, and the unit tangent.
    psi : shape (n,), rad or m
        The solution: positions of the screws.
    """
    n, most = point.n, arrays.extent(samples, 0)
    rows, goal = arrays.numbers(samples, 2 * most * n), arrays.numbers(psi, n)
    lock = arrays.let_go()
    found, k = False, 0
    while k < most and not found:
        row = arrays.after(rows, 2 * n * k)
        found = _leads_to(point, row, goal)
        # The samples after it that are farther away, too.
        k += 1 + int(max(_farthest(point, row, goal) - COMPARED, 0.0) / FARTHEST_STEP)
    arrays.take_back(lock)
    return found
