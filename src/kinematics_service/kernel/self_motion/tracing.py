"""
Trace a curve of solutions by numerical continuation: predictor and corrector, until it closes.

Allgower and Georg, Introduction to Numerical Continuation Methods, chapters 2 and 6: an Euler step
along the tangent, Newton's method across it, a step length by how far the tangent turns. A step
onto another curve that nearly crosses this one has the other orientation, and is repeated with
half its length.
"""

from ..layout import arrays
from ..layout.arrays import Flat, Floats
from .curve_point import CurvePoint

# Length of the first step, rad.
FIRST_STEP = 0.02
# Longest step, rad: samples are not farther apart than a tenth of a rad.
LONGEST_STEP = 0.1
# A shorter step ends the curve, rad: a singular pose is there.
SHORTEST_STEP = 1e-7
# Least cosine of the angle between two tangents (0.35 rad) for which a step is taken.
COSINE_HALVED = 0.94
# Least cosine of the angle between two tangents (0.1 rad) for which the next step is doubled.
COSINE_DOUBLED = 0.995
# Largest correction, as a share of the step: on a circle whose tangent turns by 0.35 rad, 0.18.
CORRECTION = 0.25
# Largest way of a joint between two samples, rad: LONGEST_STEP and its correction.
FARTHEST_STEP = 0.125
# Solutions are one if their joints differ by less, rad or m.
SAME_SOLUTION = 1e-6


def trace(point: CurvePoint, side: float, samples: Floats) -> int:
    """
    Follow the curve of solutions from one of them until it closes.

    Returns how many samples it has, the number negative if it closed: then the last one is the
    first one, full turns added. Otherwise it ends at a singular pose, or the room was used up. 0:
    Newton's method finds no solution at the start.

    Parameters
    ----------
    point
        The arm and its target.
    side
        1 or -1: the orientation of the curve in the direction in which it is followed.
    samples : shape (m, 2 n), rad or m
        Joint positions and the unit tangent. The first joint positions are given, near a solution.
    """
    n, most = point.n, arrays.extent(samples, 0)
    rows = arrays.results(samples, 2 * most * n)
    lock = arrays.let_go()
    arrays.copy(point.q, n, rows)
    point.look_along(side)
    count = _traced(point, side, rows, most) if point.improve() else 0
    arrays.take_back(lock)
    return count


def _traced(point: CurvePoint, side: float, rows: Flat, most: int) -> int:
    n = point.n
    step: float = FIRST_STEP
    _write(point, rows)
    for count in range(1, most):
        row = arrays.after(rows, 2 * n * count)
        before = arrays.after(rows, 2 * n * (count - 1))
        if _leads_to(point, side, before, rows, 0.0):
            arrays.copy(row, 2 * n, rows)
            for j in range(n):
                row[j] = before[j] + point.way(j, rows[j] - before[j])
            return -count - 1
        step = _advance(point, before, side, step)
        if step == 0.0:
            return count
        _write(point, row)
    return most


def _write(point: CurvePoint, row: Flat) -> None:
    arrays.copy(row, point.n, point.q)
    arrays.copy(arrays.after(row, point.n), point.n, point.tangent)


def _stepped(point: CurvePoint, sample: Flat, step: float, side: float) -> float:
    # Moves the point to the solution a step ahead of a sample. Returns the cosine of the angle
    # between the tangents; 0 if none is found, or if it may be beyond a bend or on another curve.
    n, border = point.n, point.border
    arrays.copy(border, n, arrays.after(sample, n))
    for j in range(n):
        point.q[j] = sample[j] + step * border[j]
    if not point.improve() or point.orientation != side:
        return 0.0
    missed: float = -step * step
    for j in range(n):
        way = point.q[j] - sample[j]
        missed += way * way
    cosine: float = arrays.dot(border, point.tangent, n)
    ahead: bool = cosine > COSINE_HALVED and missed < CORRECTION * CORRECTION * step * step
    return cosine if ahead else 0.0


def _advance(point: CurvePoint, before: Flat, side: float, step: float) -> float:
    # Moves the point to the next solution and returns the length of the step after it, or 0.
    h: float = step
    while h > SHORTEST_STEP:
        cosine: float = _stepped(point, before, h, side)
        if cosine > 0.0:
            return min(2.0 * h, LONGEST_STEP) if cosine > COSINE_DOUBLED else h
        h *= 0.5
    return 0.0


def _leads_to(point: CurvePoint, side: float, sample: Flat, goal: Flat, least: float) -> bool:
    # Whether a step from a sample leads to a goal on the curve. Its length along the tangent must
    # exceed the least one, which is negative if a step back is allowed.
    n = point.n
    step: float = 0.0
    for j in range(n):
        step += sample[n + j] * point.way(j, goal[j] - sample[j])
    same: bool = least < step < FARTHEST_STEP and _stepped(point, sample, step, side) > 0.0
    for j in range(n):
        same = same and abs(point.way(j, goal[j] - point.q[j])) < SAME_SOLUTION
    return same


def passes(point: CurvePoint, samples: Floats, q: Floats) -> bool:
    """
    Return whether a curve passes a solution (n,), full turns left out.

    Parameters
    ----------
    point
        The arm and its target.
    samples : shape (m, 2 n)
        Joint positions, and the unit tangent in the direction in which the orientation is 1.
    q : shape (n,), rad or m
        The solution.
    """
    n, most = point.n, arrays.extent(samples, 0)
    rows, goal = arrays.numbers(samples, 2 * most * n), arrays.numbers(q, n)
    lock = arrays.let_go()
    found, k = False, 0
    while k < most and not found:
        row = arrays.after(rows, 2 * n * k)
        far: float = 0.0
        for j in range(n):
            far = max(far, abs(point.way(j, goal[j] - row[j])))
        found = far < FARTHEST_STEP and _leads_to(point, 1.0, row, goal, -FARTHEST_STEP)
        # The next sample that can be near enough: samples are no farther apart than FARTHEST_STEP.
        k += 1 + int(max(far / FARTHEST_STEP - 1.0, 0.0))
    arrays.take_back(lock)
    return found
