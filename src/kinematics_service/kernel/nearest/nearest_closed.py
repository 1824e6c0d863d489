"""
The singular pose nearest to a pose of an arm with closed loops, and the nearest flat positions.

Newton's method on the least singular value of J_t, and on the square of each group's determinant,
whose slope stays finite where a branch ends. One step goes onto the set and along it to its
nearest point at once. Loops are closed from each pose to the next, so that the branch stays.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat
from ..loops import closed_pass, closing
from ..measures import gradient, singularity
from . import singular_equations
from .arm import Arm

# Beyond so many rad (a prismatic joint's divided by the length) nothing is looked for, and of what
# is found beyond the second it is not decided that none is nearer.
HORIZON, NEAR = 1.0, 0.2
# A pose is singular where the singular value is below this share of the reach, and the next step
# below this share of the way or of a rad.
SINGULAR, NEXT_STEP, NO_STEP = 1e-7, 1e-3, 1e-9
# A least singular value that falls by less than this share of what its slope says for more steps
# than so many is not on its way to zero.
LESS, IDLE = 0.2, 2
# Nearer than this, rad, the first order says where a loop is flat, to about its square: at the
# flat position itself no pose closes.
FLAT = 1e-4
# What was found is farther than the first order says of the arm by this factor at most.
TRUSTED = 2.0
# Longest step, rad; steps of a run, and those at its end that go onto the set only.
LONGEST, STEPS, LAST_STEPS = 0.1, 30, 6
# Of the way to a flat position one step goes so far: beyond it nothing closes, and much nearer to
# it loops are closed in many steps. Farther than the last number, rad, the first order may be
# wrong by much, and to find that nothing closes costs more than all steps.
SHARE, THIRD, STRAIGHT = 0.8, 0.35, 0.02
# Where a determinant falls as a root, its square gets nearer to its zero by as much as a step
# goes; where it falls evenly, by half. Less than this share of the step is taken for half.
EVEN = 0.75


def room(arm: Arm) -> int:
    """Return how many numbers `look` needs room for."""
    if arm.chain.loops == 0:
        return 0
    n, m, groups = arm.chain.dof, arm.task.count, arm.chain.groups
    own = arm.chain.frames_at + arm.chain.closure.width + 14 * n + groups
    return own + min(m, n) * (m + n + 1) + groups * (1 + n) + gradient.room(arm.chain)


def look(arm: Arm, q: Flat, row: Flat, judged: Flat, pose: Flat, work: Flat) -> float:
    """
    Look for the nearest singular pose of the arm, and flat position of each group of loops.

    Returns the least distance, rad, and fills the pose (n,) it is to; endless where none was
    found.

    Parameters
    ----------
    arm
        The arm.
    q, row
        The pose (n,), and what evaluates it.
    judged
        As `judging.measure` fills it by first order. The distances to the flat positions are
        brought to what was found near; it is decided where that is near, and nothing that the
        first order sees is nearer.
    """
    n, groups = arm.chain.dof, arm.chain.groups
    estimate = judged[places.FIRST_ORDER]
    distances = arrays.after(judged, places.JUDGED + arm.tape.factors)
    least = arrays.after(work, 2 * n)
    found = arrays.after(work, 3 * n)
    free = arrays.after(found, groups)
    free = arrays.after(free, n)
    best, seen = places.INFINITY, places.INFINITY
    first = 0
    for k in range(groups):
        found[k] = places.INFINITY
        if distances[k] < distances[first]:
            first = k
    # The group that is nearest by first order, the arm, and the other groups that may be nearer.
    for turn in range(groups + 1):
        k = first
        if turn > 0:
            k = turn - 2 if turn <= first + 1 else turn - 1
        away, expected = places.INFINITY, 0.0 if k < 0 else distances[k]
        if expected <= HORIZON and expected < best:
            if k < 0:
                away = _run_to_arm(arm, q, row, min(best, HORIZON), work, free)
            else:
                away = _run_to_flat(arm, q, row, k, work, free)
        if k < 0:
            expected = work[n]  # of the arm, by its least singular value
        else:
            found[k] = away
        if not away < places.INFINITY:
            seen = min(seen, expected)
        elif away < best:
            best = away
            arrays.copy(least, n, work)
    if not best <= HORIZON:
        return places.INFINITY
    # Where two singular values are small their product may see what the least one does not.
    missed = estimate < distances[first] and best > TRUSTED * estimate
    judged[places.DECIDED] = 0.0 if seen < best or missed or best > NEAR else 1.0
    for j in range(n):
        pose[j] = q[j] + arm.task.column_scale[j] * least[j]
    for k in range(groups):
        if found[k] < places.INFINITY:
            distances[k] = found[k]
    return best


def _start(arm: Arm, begin: Flat, d: Flat, row: Flat) -> None:
    arrays.copy(row, arm.chain.frames_at, begin)
    arrays.fill(d, arm.chain.dof, 0.0)


def _write_step(
    n: int, value: float, slope: Flat, d: Flat, slides: bool, most: float, step: Flat
) -> float:
    # The step from d to where the value is zero by its slope, and along there towards the place
    # nearest to the beginning, so many times as far as to the zero at most; returns its length,
    # endless where there is no slope.
    squares, along = arrays.dot(slope, slope, n), arrays.dot(slope, d, n)
    if not squares > 0.0:
        return places.INFINITY
    for j in range(n):
        step[j] = slope[j] * along / squares - d[j] if slides else 0.0
    slide, onto = singular_equations.length_of(step, n), abs(value) / math.sqrt(squares)
    share = most * onto / slide if slide > most * onto else 1.0
    for j in range(n):
        step[j] = share * step[j] - slope[j] * value / squares
    return singular_equations.length_of(step, n)


def _run_to_arm(arm: Arm, q: Flat, begin: Flat, best: float, d: Flat, work: Flat) -> float:
    # From q to where the arm is singular: fills the motion d in rad and returns its length,
    # endless where nothing was found. Behind d stands what the first order says of it, which is
    # not followed where it is twice the best.
    n = arm.chain.dof
    slope = work
    step = arrays.after(slope, n)
    row = arrays.after(step, 2 * n)
    last = arrays.after(row, arm.chain.frames_at)
    free = arrays.after(last, arm.chain.closure.width)
    _start(arm, begin, d, row)
    before, idle, share = places.INFINITY, 0, 1.0
    for turn in range(STEPS):
        value = _write_least(arm, row, slope, free)
        arrived = value <= SINGULAR * arm.reach
        length = singular_equations.length_of(d, n)
        moved = _write_step(n, value, slope, d, turn < STEPS - LAST_STEPS, places.INFINITY, step)
        if turn == 0:
            d[n] = moved
        if arrived and (moved <= NEXT_STEP * length + NO_STEP or not moved < places.INFINITY):
            return length
        idle = idle + 1 if value > (1.0 - LESS * share) * before else 0
        before = value
        lost: bool = moved > 2.0 * best if turn == 0 else idle > IDLE
        if lost or not moved < places.INFINITY or length > 1.5 * HORIZON:
            return places.INFINITY
        share = min(1.0, LONGEST / moved)
        if not _move(arm, q, d, share, row, last, step):
            return places.INFINITY
    return places.INFINITY


def _run_to_flat(arm: Arm, q: Flat, begin: Flat, k: int, d: Flat, work: Flat) -> float:
    # The same to where group k of the loops is flat.
    n = arm.chain.dof
    slope = work
    step = arrays.after(slope, n)
    row = arrays.after(step, 2 * n)
    last = arrays.after(row, arm.chain.frames_at)
    free = arrays.after(last, arm.chain.closure.width)
    _start(arm, begin, d, row)
    before, gone, reach = places.INFINITY, 0.0, 1.0
    for turn in range(STEPS):
        value = _write_half(arm, row, k, slope, free)
        length = singular_equations.length_of(d, n)
        moved = _write_step(n, value, slope, d, turn < STEPS - LAST_STEPS, 1.0, step)
        if not moved < places.INFINITY or length > 1.5 * HORIZON:
            return places.INFINITY
        onto = abs(value) / singular_equations.length_of(slope, n)
        if onto <= FLAT and (moved <= NEXT_STEP * length + 2.0 * onto or turn == STEPS - 1):
            for j in range(n):
                d[j] += step[j]
            return singular_equations.length_of(d, n)
        if turn > 0:
            reach = 2.0 if before - onto < EVEN * gone else 1.0
        share = reach * (SHARE if reach * onto <= STRAIGHT else THIRD)
        share = min(share, LONGEST / moved)
        before, gone = onto, share * onto
        if not _move(arm, q, d, share, row, last, step):
            return places.INFINITY
    return places.INFINITY


def _move(arm: Arm, q: Flat, d: Flat, share: float, row: Flat, last: Flat, step: Flat) -> bool:
    # Goes a share of a step, and evaluates the arm there; whether the loops close.
    n = arm.chain.dof
    section = arrays.after(row, arm.chain.closure_at)
    there = arrays.after(step, n)
    arrays.copy(last, arm.chain.closure.width, section)
    for j in range(n):
        d[j] += share * step[j]
        there[j] = q[j] + arm.task.column_scale[j] * d[j]
    if closing.close_next(arm.chain.closure, last, there, section) != 0:
        return False
    arrays.fill(there, n, 0.0)
    total = closed_pass.evaluate_closed(arm.chain, there, places.JACOBIAN, row)
    return total < places.INFINITY


def _write_half(arm: Arm, row: Flat, k: int, slope: Flat, work: Flat) -> float:
    # Half the determinant of a group of loops, which by its slope, by the joints in rad, is as far
    # from zero as its square is by that of its own.
    n = arm.chain.dof
    results = work
    gradient.write_determinants(
        arm.chain, row, results, arrays.after(work, arm.chain.groups * (1 + n))
    )
    for j in range(n):
        slope[j] = results[k * (1 + n) + 1 + j] * arm.task.column_scale[j]
    return 0.5 * results[k * (1 + n)]


def _write_least(arm: Arm, row: Flat, slope: Flat, work: Flat) -> float:
    # The least singular value of J_t, and its slope by the joints in rad.
    n, m = arm.chain.dof, arm.task.count
    W = work
    sigma = arrays.after(W, min(m, n) * (m + n))
    Y = arrays.after(sigma, min(m, n))
    singularity.write_directions(n, arm.task, row, W, sigma)
    singularity.write_slopes_of_least(n, arm.task, W, sigma, Y)
    gradient.write_gradient(arm.chain, row, Y, slope, arrays.after(Y, 6 * n))
    for j in range(n):
        slope[j] *= arm.task.column_scale[j]
    return sigma[arm.task.generic_rank - 1]
