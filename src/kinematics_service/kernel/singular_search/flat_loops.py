"""
Find the nearest flat position of a group of closed loops: Newton's method on its determinant.

At a flat position the loops' equations no longer fix the passive variables: the determinant D of
their slopes by these variables is zero, and a branch of the loops ends or meets another one. D^2
has a finite slope there, D itself has none where a branch ends. A step leads towards D^2 = 0 by
its slope, and along that plane towards the point nearest to the origin. Steps are halved (damped
Newton, Nocedal and Wright, section 11.1): beyond the flat position the loops do not close. There
is a flat position where D grows and one where it falls, so there are two starts: one step along
the slope of D, and one against it.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import gradient
from . import projection, rank_equations
from .rank_equations import RankEquations

# Share of a step that is taken; it is halved each time that the loops do not close, down to the
# least share of a projection: to find that no loop closes takes the time of 50 steps.
DAMPING = 0.5
# Converged: rest of the way to the flat position, rad.
FLAT_TOLERANCE = 1e-4
# The motion stops short of the flat position by this distance, rad. It grows tenfold until the
# loops close, because a branch may end there.
END_BEFORE = 1e-7
# Steps: the rest of the way shrinks to 0.75 at worst, where D falls evenly.
FLAT_STEPS = 30


def room(chain: Chain) -> int:
    """Return how many numbers `look` needs room for."""
    return 4 * chain.dof + chain.groups * (1 + chain.dof) + gradient.room(chain)


def look(
    equations: RankEquations, origin: Flat, group: int, limit: float, d: Flat, work: Flat
) -> float:
    """
    Fill the motion d (n,) in rad to the nearest flat position of a group, and return its length.

    It is infinite if none was found.

    Parameters
    ----------
    equations
        Decomposed at the origin.
    origin : shape (n,)
        Positions, rad or m.
    group
        Index of the group.
    limit
        Length beyond which the search ends, rad.
    work
        Room.
    """
    n, nearest = equations.n, places.INFINITY
    best, rest = work, arrays.after(work, equations.n)
    for side in range(2):
        step = min(projection.TRUST_RADIUS, limit, nearest)
        if not _move_along(equations, origin, group, step if side == 0 else -step, d, rest):
            return places.INFINITY
        length = _descend(equations, origin, group, min(limit, nearest), d, rest)
        if length < nearest:
            nearest = length
            arrays.copy(best, n, d)
    arrays.copy(d, n, best)
    return nearest


def _move_along(
    equations: RankEquations, origin: Flat, group: int, step: float, d: Flat, work: Flat
) -> bool:
    # Move from the origin along the slope of D, or stay there if the loops close nowhere on it.
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
    share: float = 1.0
    while share >= projection.MIN_STEP_RATIO:
        for j in range(n):
            goal[j] = share * step / length * slope[j]
        if equations.move_to(origin, goal):
            arrays.copy(d, n, goal)
            return True
        share *= DAMPING
    return True


def _descend(
    equations: RankEquations, origin: Flat, group: int, limit: float, d: Flat, work: Flat
) -> float:
    # Bring d to the flat position, and return its length; infinite if there is none.
    n, share = equations.n, DAMPING
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
                goal[j] = d[j] + share * step[j]
            if equations.move_to(origin, goal):
                break
            share *= DAMPING
            if share < projection.MIN_STEP_RATIO:
                return places.INFINITY
        arrays.copy(d, n, goal)
        if length > limit:
            return places.INFINITY
    return places.INFINITY


def _move_before(
    equations: RankEquations, origin: Flat, length: float, goal: Flat, d: Flat
) -> None:
    # Move along a motion, `goal` with its length, to the last point at which the loops close. If
    # they close nowhere before it, d does not change.
    n, before = equations.n, END_BEFORE
    while before < length and before <= FLAT_TOLERANCE:
        for j in range(n):
            goal[j] *= 1.0 - before / length
        if equations.move_to(origin, goal):
            arrays.copy(d, n, goal)
            return
        before *= 10.0


def _write_step(n: int, onto: float, back: float, slope: Flat, d: Flat, step: Flat) -> float:
    # Step onto the plane, and along it by at longest the same length; returns the way along it.
    for j in range(n):
        step[j] = back * slope[j] - d[j]
    slide = rank_equations.length_of(step, n)
    longest = abs(onto) * rank_equations.length_of(slope, n)
    share = longest / slide if slide > longest else 1.0
    for j in range(n):
        step[j] = share * step[j] - onto * slope[j]
    return slide


def _write_half(equations: RankEquations, group: int, slope: Flat, work: Flat) -> float:
    # Fill the slope (n,) of D, and return half of D: their ratio is that of D^2 and its slope.
    n, groups = equations.n, equations.chain.groups
    free = arrays.after(work, groups * (1 + n))
    gradient.write_determinants(equations.chain, equations.row, work, free)
    for j in range(n):
        slope[j] = work[group * (1 + n) + 1 + j] * equations.task.column_scale[j]
    return 0.5 * work[group * (1 + n)]
