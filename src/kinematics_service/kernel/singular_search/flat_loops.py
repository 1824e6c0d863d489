# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the nearest joint positions at which the equations of a group of closed loops are singular.

In this file, a set of joint positions at which the equations are singular is called a flat
position. There the loop equations do not determine the passive variables. The determinant D of the
derivatives of the equations by the passive variables is zero, and a branch of solutions ends or
meets another branch.

The joint positions at which the search starts are called the origin. The method is damped Newton
on D^2 = 0 (Nocedal and Wright, section 11.1). It uses D^2, because where a branch ends, the
derivative of D is infinite, but the derivative of D^2 is finite. A Newton step is the sum of two
motions. The first motion leads onto the plane on which the linearised D^2 is zero. The second
motion leads along this plane towards the point of the plane nearest to the origin. Each step is
multiplied by 0.5, so that it ends before the flat position, because the loops do not close beyond
it.

One flat position may be in the direction in which D grows, and another in the opposite direction.
So the search has two starts: a step along the gradient of D, and a step against the gradient.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import gradient
from . import projection, rank_equations
from .rank_equations import RankEquations

# Factor by which a Newton step is multiplied at first. If the loops do not close after the step,
# the factor is halved. The factor does not fall below `projection.MIN_STEP_RATIO`, because a
# failed attempt to close the loops takes the time of 50 steps.
DAMPING = 0.5
# Newton's method searches joint positions at which the loop equations are singular. It has
# converged if the length of the next step is at most this, rad.
FLAT_TOLERANCE = 1e-4
# `look` searches a flat position: joint positions at which the loop equations are singular. At
# these joint positions, the attempt to close the loops can fail. So the motion that `look` returns
# ends at this distance before the flat position, rad. If the attempt also fails at the end of the
# motion, the distance is multiplied by ten.
END_BEFORE = 1e-7
# Largest number of Newton steps toward joint positions at which the loop equations are singular.
# Newton's method solves D^2 = 0, where D is the determinant of the derivatives of the loop
# equations by the passive variables. A simple zero of D is a double zero of D^2, so a full Newton
# step goes only half of the distance to the zero. DAMPING halves this step again. So 0.75 of the
# distance remains after a step, and 2e-4 of the distance after 30 steps.
FLAT_STEPS = 30


def room(chain: Chain) -> int:
    """Return how many numbers of scratch memory `look` needs."""
    return 4 * chain.dof + chain.groups * (1 + chain.dof) + gradient.room(chain)


def look(
    equations: RankEquations, origin: Flat, group: int, limit: float, d: Flat, work: Flat
) -> float:
    """
    Fill d (n,), rad, with the shortest motion to joint positions at which the equations of a group
    of loops are singular.

    Returns the length of d, rad; infinite if the search found no such joint positions.

    Parameters
    ----------
    equations
        The rank equations of the arm, decomposed at `origin`.
    origin : shape (n,)
        Joint positions at which the search starts, rad or m.
    group
        Index of the group.
    limit
        Length beyond which the search ends, rad.
    work
        Work array of `room` numbers.
    """
    n, nearest = equations.n, places.INFINITY
    best, tail = work, arrays.after(work, equations.n)
    for side in range(2):
        step = min(projection.TRUST_RADIUS, limit, nearest)
        if not _move_along(equations, origin, group, step if side == 0 else -step, d, tail):
            return places.INFINITY
        length = _descend(equations, origin, group, min(limit, nearest), d, tail)
        if length < nearest:
            nearest = length
            arrays.copy(best, n, d)
    arrays.copy(d, n, best)
    return nearest


def _move_along(
    equations: RankEquations, origin: Flat, group: int, step: float, d: Flat, work: Flat
) -> bool:
    # Sets d to a joint motion of the length `step` along the gradient of the loop determinant D
    # (against the gradient if `step` is negative). Shortens the motion until the loops close after
    # it. If they do not close after the shortest motion either, d is 0. Returns False if the loops
    # do not close at `origin` or the gradient is 0.
    n = equations.n
    slope, goal = work, arrays.after(work, n)
    arrays.fill(d, n, 0.0)
    equations.restart()
    if not equations.move_to(origin, d):
        return False
    _write_half(equations, group, slope, arrays.after(work, 3 * n))
    length = rank_equations.length_of(slope, n)
    if not length > 0.0:
        return False
    ratio: float = 1.0
    while ratio >= projection.MIN_STEP_RATIO:
        for j in range(n):
            goal[j] = ratio * step / length * slope[j]
        if equations.move_to(origin, goal):
            arrays.copy(d, n, goal)
            return True
        ratio *= DAMPING
    return True


def _descend(
    equations: RankEquations, origin: Flat, group: int, limit: float, d: Flat, work: Flat
) -> float:
    # Moves d to joint positions at which the loop equations are singular. Returns the length of d,
    # rad; infinite if the iteration finds no such joint positions.
    n, ratio = equations.n, DAMPING
    slope, goal, step = work, arrays.after(work, n), arrays.after(work, 2 * n)
    for _ in range(FLAT_STEPS):
        half = _write_half(equations, group, slope, arrays.after(work, 3 * n))
        squares = arrays.dot(slope, slope, n)
        if not squares > 0.0:
            return places.INFINITY
        onto = abs(half) / math.sqrt(squares)
        slide = _write_step(n, half / squares, arrays.dot(slope, d, n) / squares, slope, d, step)
        for j in range(n):
            goal[j] = d[j] + step[j]
        length = rank_equations.length_of(goal, n)
        if max(onto, slide - FLAT_TOLERANCE * length) <= FLAT_TOLERANCE:
            _move_before(equations, origin, length, goal, d)
            return rank_equations.length_of(d, n)
        while True:
            for j in range(n):
                goal[j] = d[j] + ratio * step[j]
            if equations.move_to(origin, goal):
                break
            ratio *= DAMPING
            if ratio < projection.MIN_STEP_RATIO:
                return places.INFINITY
        arrays.copy(d, n, goal)
        if length > limit:
            return places.INFINITY
    return places.INFINITY


def _move_before(
    equations: RankEquations, origin: Flat, length: float, goal: Flat, d: Flat
) -> None:
    # `goal` and d are joint motions from the joint positions `origin`; `length` is the length of
    # `goal`, rad. Makes `goal` shorter until the loops close after this motion, and copies it to
    # d. If `goal` would become shorter by more than FLAT_TOLERANCE, d does not change.
    n, before = equations.n, END_BEFORE
    while before < length and before <= FLAT_TOLERANCE:
        for j in range(n):
            goal[j] *= 1.0 - before / length
        if equations.move_to(origin, goal):
            arrays.copy(d, n, goal)
            return
        before *= 10.0


def _write_step(n: int, onto: float, back: float, slope: Flat, d: Flat, step: Flat) -> float:
    # Let D be the loop determinant. Writes to `step` the sum of two joint motions. The first
    # motion leads onto the plane on which the linearised D^2 is zero. The second motion leads
    # along this plane. If the second motion is longer than the first, the second is shortened to
    # the length of the first. Returns the length of the second motion before it is shortened, rad.
    for j in range(n):
        step[j] = back * slope[j] - d[j]
    slide = rank_equations.length_of(step, n)
    longest = abs(onto) * rank_equations.length_of(slope, n)
    ratio = longest / slide if slide > longest else 1.0
    for j in range(n):
        step[j] = ratio * step[j] - onto * slope[j]
    return slide


def _write_half(equations: RankEquations, group: int, slope: Flat, work: Flat) -> float:
    # Let D be the loop determinant. Fills `slope` (n,) with the gradient of D, and returns D / 2.
    # A Newton step onto D^2 = 0 is computed from these two results, because its length is
    # `D^2 / |gradient of D^2|`, which is equal to `|D / 2| / |gradient of D|`.
    n, groups = equations.n, equations.chain.groups
    free = arrays.after(work, groups * (1 + n))
    gradient.write_determinants(equations.chain, equations.row, work, free)
    for j in range(n):
        slope[j] = work[group * (1 + n) + 1 + j] * equations.task.column_scale[j]
    return 0.5 * work[group * (1 + n)]
