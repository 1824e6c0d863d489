"""
Passive variables from the joints: Newton's method along a line from where the loops are closed.

A branch is kept by small steps. Each predicts the variables by their slopes, corrects them by
Newton's method, and counts only where the correction is small and contracts, and where no
determinant changes its sign or much of its size: between two such poses it is not zero, and only
where it is zero do branches meet or end. Other steps are halved, down to where the branch ends.

Loops that need each other's variables are a group with one determinant, and are solved together;
one group after another, for the later ones may move with the earlier ones' variables.
"""

from ..forward import linear_equations
from ..forward.chain import Chain, Closure, LoopGroup, groups_from, section_width
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers
from . import residual

# A loop is closed where the largest component of its residual, as a share of its size or in rad,
# is at most CLOSED; FINE is what round-off leaves.
CLOSED, FINE = 1e-13, 4e-16
NEWTON_STEPS = 12
# A correction may be so large (rad, or as a share of the loop's size): of a step, and of the
# positions in a robot file.
CORRECTION, ROUGH = 0.1, 0.35
# Longest and shortest step along the line, rad; their number at most; and how much of its size a
# determinant may lose or gain within one.
LONGEST, SHORTEST, MOST_STEPS = 0.25, 1e-8, 1000
SHRUNK, GROWN = 0.4, 2.5
# A determinant without unit has no digits left where it is smaller than this share of the product
# of the largest slopes by each variable, each at least a LEVER.
FLAT, LEVER = 1e-9, 0.01
# Up to here, rad, the last answer is nearer than the known one.
TRUSTED = 1.0
# Joints at most whose turns are tried both ways.
BOTH_WAYS = 4
# How far beside a line, rad, a bent one passes.
BEND = 0.3


def _solve(
    group: LoopGroup,
    x: Numbers,
    largest: float,
    screws: Flat,
    slopes: Numbers,
    told: Numbers,
    at: int,
) -> int:
    # Newton's method for the passive variables of a group. Returns the number of steps, -1 where
    # it does not come to an end or is flat there; tells the screws, the determinant and what is
    # left of the residual.
    gap, order = [0.0] * 18, [0] * 18
    before = places.INFINITY
    for step in range(NEWTON_STEPS):
        size = residual.write_residual(group, x, gap, screws)
        residual.write_slopes(group, screws, slopes)
        closed = size <= FINE or (size <= CLOSED and not size < 0.25 * before)
        least = FLAT * _levers(group, slopes) if closed else 0.0
        told[at] = linear_equations.factorise(slopes, group.count, order)
        told[at + 1] = size
        if closed:
            return step if abs(told[at]) * group.scale > least else -1
        if told[at] == 0.0 or not size < 0.5 * before:
            return -1
        linear_equations.solve(slopes, group.count, order, gap)
        for i in range(group.count):
            if not abs(gap[i]) <= largest * group.unit[group.first + i]:
                return -1
            x[group.first + i] -= gap[i]
        before = size
    return -1


def _levers(group: LoopGroup, slopes: Numbers) -> float:
    # The product of the largest slopes by each variable, without unit.
    product: float = 1.0
    for k in range(group.count):
        longest: float = LEVER
        for i in range(group.count):
            slope = abs(slopes[i * group.count + k]) * group.unit[group.first + k]
            longest = max(longest, slope / group.span[i])
        product *= longest
    return product


def _solve_all(
    group: LoopGroup,
    left: int,
    x: Numbers,
    before: Numbers,
    known: bool,
    screws: Flat,
    slopes: Numbers,
    told: Numbers,
    at: int,
) -> int:
    # This group and those after it. Returns 0, or their number where it failed, counted from the
    # last; `before` tells of the pose before, if it is known. Told of each: determinant, residual,
    # steps.
    steps = _solve(group, x, CORRECTION if known else ROUGH, screws, slopes, told, at)
    if steps < 0 or known and not SHRUNK < told[at] / before[at] < GROWN:
        return left
    told[at + 2] = before[at + 2] + steps if known else 0.0
    if left == 1:
        return 0
    behind = arrays.after(screws, 6 * group.entries)
    return _solve_all(group.following, left - 1, x, before, known, behind, slopes, told, at + 3)


def _couple(
    group: LoopGroup, left: int, n: int, section: Flat, screws: Flat, slopes: Numbers
) -> None:
    # Fills how the passive variables of closed loops follow the joints, of the screws there.
    count = group.count
    gap, order = [0.0] * 18, [0] * 18
    residual.write_slopes(group, screws, slopes)
    linear_equations.factorise(slopes, count, order)
    coupling = arrays.after(section, 2 * group.variables + (group.first - n) * n)
    for j in range(n):
        residual.write_by_joint(group, n, j, screws, section, gap)
        linear_equations.solve(slopes, count, order, gap)
        for i in range(count):
            coupling[i * n + j] = -gap[i]
    if left > 1:
        following = arrays.after(screws, 6 * group.entries)
        _couple(group.following, left - 1, n, section, following, slopes)


def _farthest(group: LoopGroup, dof: int, q: Numbers, section: Flat) -> float:
    # The largest motion of a joint from a section to q, rad.
    farthest = 0.0
    for j in range(dof):
        moved = abs(q[j] - section[j]) / group.unit[j]
        if not moved <= farthest:
            farthest = moved
    return farthest


def _go(closure: Closure, q: Numbers, section: Flat) -> int:
    # Brings a section to q. Returns 0, or the number of the group that does not come along,
    # counted from the last, with the section where it last was closed.
    n, variables = closure.dof, closure.variables
    told_at = closure.told_at
    screws = arrays.after(section, closure.screws_at)
    x, told, slopes = [0.0] * 152, [0.0] * 72, [0.0] * 324
    for k in range(closure.groups):
        section[told_at + 3 * k + 2] = 0.0
    length, steps, arrived = LONGEST, 0, False
    while not arrived:
        away = _farthest(closure.first, n, q, section)
        arrived = length >= away
        share = 1.0 if arrived else length / away
        for j in range(n):
            x[j] = q[j] if arrived else section[j] + share * (q[j] - section[j])
        for i in range(variables - n):
            x[n + i] = section[n + i]
            for j in range(n):
                x[n + i] += section[closure.coupling_at + i * n + j] * (x[j] - section[j])
        before = arrays.after(section, told_at)
        failed = _solve_all(
            closure.first, closure.groups, x, before, True, screws, slopes, told, 0
        )
        if failed == 0:
            arrays.copy(section, variables, x)
            arrays.copy(arrays.after(section, told_at), 3 * closure.groups, told)
            _couple(closure.first, closure.groups, n, section, screws, slopes)
            length = min(LONGEST, 2.0 * length)
        else:
            arrived = False
            length = 0.5 * min(length, away)
        steps += 1
        if not length > SHORTEST or steps > MOST_STEPS:
            return failed if failed > 0 else closure.groups
    return 0


def _begin(closure: Closure, numbers: Flat, q: Flat, other_ways: int, section: Flat) -> int:
    # A copy of a section, its joints that turn without end turned by whole turns to where q is
    # nearest; a bit of `other_ways` for each of the first of them that are to come from the other
    # side. Returns how many there are.
    ways = 0
    arrays.copy(section, closure.width, numbers)
    for j in range(closure.dof):
        away = q[j] - section[j]
        if closure.turns[j] == 0 or away == 0.0 or not abs(away) < places.LARGEST:
            continue
        whole: int = int(away / places.TAU + (0.5 if away > 0.0 else -0.5))
        turns = float(whole)
        away -= turns * places.TAU
        if ways < BOTH_WAYS:
            if (other_ways >> ways) & 1:
                turns += 1.0 if away > 0.0 else -1.0
            ways += 1
        section[j] += turns * places.TAU
    return ways


def _go_beside(closure: Closure, q: Flat, joint: int, bend: float, section: Flat) -> bool:
    # From the known positions to q over a place beside the middle, by a joint of a loop.
    unit = closure.first.unit[joint]
    if not unit < places.INFINITY:
        return False
    beside = [0.0] * 128
    _begin(closure, closure.start, q, 0, section)
    for j in range(closure.dof):
        beside[j] = 0.5 * (section[j] + q[j])
    beside[joint] += bend * unit
    return _go(closure, beside, section) == 0 and _go(closure, q, section) == 0


def close(closure: Closure, q: Flat, section: Flat) -> int:
    """
    Fill a section with the passive variables at q, on the branch of the known positions.

    A function of q alone: from the known positions along a straight line; where that ends, the
    joints that turn without end are turned the other way, and then the line is bent: one that
    meets a single flat position passes beside it.

    Returns 0, or the number of the group that does not close there, counted from the last, with
    the section where the straight line ended.
    """
    ways = _begin(closure, closure.start, q, 0, section)
    failed = _go(closure, q, section)
    if failed == 0:
        return failed
    for other in range(1, 1 << ways):
        _begin(closure, closure.start, q, other, section)
        if _go(closure, q, section) == 0:
            return 0
    for j in range(closure.dof):
        if _go_beside(closure, q, j, BEND, section) or _go_beside(closure, q, j, -BEND, section):
            return 0
    _begin(closure, closure.start, q, 0, section)
    return _go(closure, q, section)


def close_next(closure: Closure, last: Flat, q: Flat, section: Flat) -> int:
    """Do as `close`, from a last section where q is near it."""
    _begin(closure, last, q, 0, section)
    if _farthest(closure.first, closure.dof, q, section) <= TRUSTED:
        return _go(closure, q, section)
    return close(closure, q, section)


def assemble(first: LoopGroup, groups: int, dof: int, section: Floats) -> int:
    """
    Complete a section whose variables are nearly those of closed loops.

    Returns 0, or the number of the group that does not close there, counted from the last; what
    its determinant and residual came to is told in its place.

    Parameters
    ----------
    first, groups
        The first group of loops, and how many of them and those that follow it are to close.
    dof
        Number of joints.
    section : shape (Closure.width,)
        As `Closure` says.
    """
    known = len(groups_from(first))
    told, slopes = [0.0] * 72, [0.0] * 324
    passive = first.variables - dof
    if not 0 < groups <= known or dof != first.first or passive > places.MOST_PASSIVE:
        raise TypeError('the parts of a closure do not go together')
    told_at = 2 * first.variables + passive * dof
    numbers = arrays.results(section, section_width(dof, first))
    screws = arrays.after(numbers, told_at + 3 * known)
    failed = _solve_all(first, groups, numbers, told, False, screws, slopes, told, 0)
    arrays.copy(arrays.after(numbers, told_at), 3 * groups, told)
    if failed == 0:
        _couple(first, groups, dof, numbers, screws, slopes)
    return failed


def close_at(chain: Chain, q: Floats, sections: Floats, closed: Floats) -> None:
    """
    Close the loops of a chain at many poses, each on its own.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.
    sections : shape (N, width)
        As `Closure` says; where a loop does not close, where the straight line to it ended.
    closed : shape (N,)
        0 where the loops close, or the number of the group that does not, counted from the last.
    """
    arrays.given(chain.closure)
    count, n, width = arrays.extent(q, 0), chain.dof, chain.closure.width
    if arrays.extent(q, 1) != n or arrays.extent(sections, 1) != width:
        raise TypeError('the arrays of closed loops do not go together')
    positions, results = arrays.numbers(q, 0), arrays.results(sections, count * width)
    said = arrays.results(closed, count)
    for k in range(count):
        said[k] = close(
            chain.closure, arrays.after(positions, k * n), arrays.after(results, k * width)
        )
