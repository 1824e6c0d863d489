# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the passive variables of closed loops from the joint positions by Newton's method with
continuation.

At one set of joint positions, the start, the loops are known to close. The continuation goes from
the start to the wanted joint positions along a straight line in joint space. The loop equations
can have several solutions for the same joint positions. A branch is a set of solutions that are
connected by continuous motion. The steps are small, so that the continuation stays on the branch
that contains the start. Each step predicts the passive variables by their derivatives, and
corrects the prediction by Newton's method.

Loops that share passive variables form a group and are solved together. The loop determinant of a
group is the determinant of the derivatives of its residual by its passive variables. Branches meet
or end only if a loop determinant is 0. A step is accepted if the corrections are small and
decrease, and if each loop determinant keeps its sign and changes its size by a limited ratio. A
rejected step is halved. If the step becomes shorter than MIN_STEP_LENGTH, the branch ends.

Groups are solved in order, because variables of an earlier group may move a later group.

Allgower and Georg, "Introduction to Numerical Continuation Methods", chapter 2.
"""

from ..forward import linear_equations
from ..forward.chain import Chain, Closure, LoopGroup, groups_from, section_width
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers
from . import residual

# The loops are taken as closed if no component of the residual exceeds this. Position components
# are divided by the size of the loops; rotation components are in rad.
CLOSED_TOLERANCE = 1e-13
# Newton's method stops if the residual of the loops is at most this, because a smaller residual is
# round-off (two machine epsilons).
ROUND_OFF = 4e-16
MAX_NEWTON_STEPS = 12
# The continuation moves the joints in small steps, and corrects the passive variables after each
# step by Newton's method (see the module's docstring). This is the largest correction of a passive
# variable by one Newton step, rad. The correction of a prismatic variable is divided by the length
# that is taken as equal to 1 rad (`units` of `LoopGroup`).
MAX_CORRECTION = 0.1
# Largest correction of a passive variable by one Newton step, rad, if Newton's method starts from
# positions in a robot file. It is larger than MAX_CORRECTION, because positions in a robot file
# are only approximate.
MAX_FILE_CORRECTION = 0.35
# The continuation moves the joints from the start to the wanted positions in steps. In one step,
# each joint moves by at most MAX_STEP_LENGTH, rad.
MAX_STEP_LENGTH = 0.25
# The continuation halves a step that fails. If the joint that moves most would then move by at
# most MIN_STEP_LENGTH, rad, the continuation stops, because the branch of solutions ends.
MIN_STEP_LENGTH = 1e-8
MAX_STEPS = 1000
# Least ratio of a loop determinant after a step to the determinant before the step. If a ratio is
# smaller, the step is rejected.
MIN_DET_RATIO = 0.4
# Largest ratio of a loop determinant after a step to the determinant before the step; the inverse
# of MIN_DET_RATIO.
MAX_DET_RATIO = 2.5
# A dimensionless loop determinant is taken as round-off if it is below this number times the
# result of `_slope_product`. The result is a product with one factor for each passive variable.
# The factor is the largest component of the derivative of the residual by this variable.
DETERMINANT_TOLERANCE = 1e-9
# `_slope_product` returns a product of dimensionless factors, one for each passive variable. A
# factor below this number is replaced by this number.
MIN_SLOPE = 0.01
# The continuation follows the passive variables in small steps to the wanted joint positions. It
# begins at the last joint positions at which the loops closed, if each joint is at most
# MAX_MOTION, rad, from its wanted position. Otherwise it begins at the joint positions of the
# robot file.
MAX_MOTION = 1.0
# The continuation follows the passive variables along a straight line in joint space. If this
# fails, other lines are tried: a joint without limits can reach its position by a positive or a
# negative turn. This is the largest number of joints for which both directions are tried.
MAX_OTHER_WAYS = 4
# The continuation follows the passive variables along a straight line in joint space, from the
# start to the wanted joint positions. If the loop equations are singular at a point of the line,
# the continuation takes another way, through a point beside the middle of the line. At this point
# one joint is offset from the line by BEND, rad.
BEND = 0.3


def _solve(
    group: LoopGroup,
    x: Numbers,
    largest: float,
    screws: Flat,
    slopes: Numbers,
    status: Numbers,
    at: int,
) -> int:
    # Solves for the passive variables of one group of loops by Newton's method. Writes to `screws`
    # the screws, and to `status` the loop determinant of the group (see the module's docstring)
    # and the size of the residual. Returns the number of Newton steps. Returns -1 if the method
    # does not converge, or if the loop determinant is 0 at the solution.
    gap, order = [0.0] * 18, [0] * 18
    before = places.INFINITY
    for step in range(MAX_NEWTON_STEPS):
        size = residual.write_residual(group, x, gap, screws)
        residual.write_slopes(group, screws, slopes)
        closed = size <= ROUND_OFF or (size <= CLOSED_TOLERANCE and not size < 0.25 * before)
        least = DETERMINANT_TOLERANCE * _slope_product(group, slopes) if closed else 0.0
        status[at] = linear_equations.factorise(slopes, group.count, order)
        status[at + 1] = size
        if closed:
            return step if abs(status[at]) * group.scale > least else -1
        if status[at] == 0.0 or not size < 0.5 * before:
            return -1
        linear_equations.solve(slopes, group.count, order, gap)
        for i in range(group.count):
            if not abs(gap[i]) <= largest * group.unit[group.first + i]:
                return -1
            x[group.first + i] -= gap[i]
        before = size
    return -1


def _slope_product(group: LoopGroup, slopes: Numbers) -> float:
    # Returns the number to which the loop determinant is compared: the determinant is taken as 0
    # if it is below DETERMINANT_TOLERANCE times this number. The number is a product with one
    # factor for each passive variable of the group. The factor is the largest component of the
    # derivative of the residual by this variable, dimensionless.
    product: float = 1.0
    for k in range(group.count):
        longest: float = MIN_SLOPE
        for i in range(group.count):
            slope = abs(slopes[i * group.count + k]) * group.unit[group.first + k]
            longest = max(longest, slope / group.span[i])
        product *= longest
    return product


def _solve_all(
    group: LoopGroup,
    groups: int,
    x: Numbers,
    before: Numbers,
    known: bool,
    screws: Flat,
    slopes: Numbers,
    status: Numbers,
    at: int,
) -> int:
    # Solves this group of loops and then the `groups` - 1 groups after it. Returns 0 if all groups
    # are solved. If a group fails, the groups after it are not tried; returns the number of
    # unsolved groups, including the group that failed. If `known` is set, `before` has the status
    # of each group at the previous joint positions. The status is the determinant, the residual
    # and the number of Newton steps.
    largest = MAX_CORRECTION if known else MAX_FILE_CORRECTION
    steps = _solve(group, x, largest, screws, slopes, status, at)
    if steps < 0 or known and not MIN_DET_RATIO < status[at] / before[at] < MAX_DET_RATIO:
        return groups
    status[at + 2] = before[at + 2] + steps if known else 0.0
    if groups == 1:
        return 0
    behind = arrays.after(screws, 6 * group.entries)
    return _solve_all(
        group.following, groups - 1, x, before, known, behind, slopes, status, at + 3
    )


def _couple(
    group: LoopGroup, groups: int, n: int, section: Flat, screws: Flat, slopes: Numbers
) -> None:
    # Computes the derivatives of the passive variables with respect to the joint positions, from
    # the screws. Writes the derivatives to `section`, the array that describes the loops at one
    # pose (see `Closure`).
    count = group.count
    gap, order = [0.0] * 18, [0] * 18
    residual.write_slopes(group, screws, slopes)
    linear_equations.factorise(slopes, count, order)
    coupling = arrays.after(section, 2 * group.variables + (group.first - n) * n)
    for j in range(n):
        residual.write_by_joint(group.loop, group.first, n, j, screws, section, gap)
        linear_equations.solve(slopes, count, order, gap)
        for i in range(count):
            coupling[i * n + j] = -gap[i]
    if groups > 1:
        following = arrays.after(screws, 6 * group.entries)
        _couple(group.following, groups - 1, n, section, following, slopes)


def _farthest(group: LoopGroup, dof: int, q: Numbers, section: Flat) -> float:
    # Returns the largest motion of a joint from the joint positions in `section` to q, rad.
    farthest = 0.0
    for j in range(dof):
        moved = abs(q[j] - section[j]) / group.unit[j]
        if not moved <= farthest:
            farthest = moved
    return farthest


def _continue(closure: Closure, q: Numbers, section: Flat) -> int:
    # Follows the passive variables, step by step, from the joint positions in `section` to the
    # joint positions q. `section` describes the loops at one pose (see `Closure`) and is updated
    # after each step. Returns 0 if all loops close at q. Otherwise returns the number of groups of
    # loops that are not closed at q: the first group that fails, and all groups after it, which
    # are not tried. In this case `section` describes the last pose at which all loops closed.
    n, variables = closure.dof, closure.variables
    status_at = closure.status_at
    screws = arrays.after(section, closure.screws_at)
    x, status, slopes = [0.0] * 152, [0.0] * 72, [0.0] * 324
    for k in range(closure.groups):
        section[status_at + 3 * k + 2] = 0.0
    length, steps, arrived = MAX_STEP_LENGTH, 0, False
    while not arrived:
        away = _farthest(closure.first, n, q, section)
        arrived = length >= away
        fraction = 1.0 if arrived else length / away
        for j in range(n):
            x[j] = q[j] if arrived else section[j] + fraction * (q[j] - section[j])
        for i in range(variables - n):
            x[n + i] = section[n + i]
            for j in range(n):
                x[n + i] += section[closure.coupling_at + i * n + j] * (x[j] - section[j])
        before = arrays.after(section, status_at)
        failed = _solve_all(
            closure.first, closure.groups, x, before, True, screws, slopes, status, 0
        )
        if failed == 0:
            arrays.copy(section, variables, x)
            arrays.copy(arrays.after(section, status_at), 3 * closure.groups, status)
            _couple(closure.first, closure.groups, n, section, screws, slopes)
            length = min(MAX_STEP_LENGTH, 2.0 * length)
        else:
            arrived = False
            length = 0.5 * min(length, away)
        steps += 1
        if not length > MIN_STEP_LENGTH or steps > MAX_STEPS:
            return failed if failed > 0 else closure.groups
    return 0


def _begin(closure: Closure, numbers: Flat, q: Flat, other_ways: int, section: Flat) -> int:
    # Copies `numbers`, which describes the loops at one pose (see `Closure`), to `section`. Then
    # adds full turns, positive or negative, to the position of each joint without limits in
    # `section`. After this, the joint is at most half a turn from its position in q. So it turns
    # to q in the shorter direction.
    # `other_ways` is a bit mask with one bit for each joint without limits that is not already at
    # its position in q, at most MAX_OTHER_WAYS bits. If the bit of a joint is set, one more full
    # turn moves the joint to the other side of its position in q. So it turns to q in the longer
    # direction. Returns the number of bits.
    ways = 0
    arrays.copy(section, closure.width, numbers)
    for j in range(closure.dof):
        away = q[j] - section[j]
        if closure.turns[j] == 0 or away == 0.0 or not abs(away) < places.LARGEST:
            continue
        whole: int = int(away / places.TAU + (0.5 if away > 0.0 else -0.5))
        turns = float(whole)
        away -= turns * places.TAU
        if ways < MAX_OTHER_WAYS:
            if (other_ways >> ways) & 1:
                turns += 1.0 if away > 0.0 else -1.0
            ways += 1
        section[j] += turns * places.TAU
    return ways


def _continue_beside(closure: Closure, q: Flat, joint: int, bend: float, section: Flat) -> bool:
    # Follows the passive variables along two straight lines in joint space: from the start to a
    # point, and from this point to q. The point is the midpoint between the start and q, with one
    # joint offset by `bend` rad. Returns whether the loops close at q.
    unit = closure.first.unit[joint]
    if not unit < places.INFINITY:
        return False
    beside = [0.0] * 128
    _begin(closure, closure.start, q, 0, section)
    for j in range(closure.dof):
        beside[j] = 0.5 * (section[j] + q[j])
    beside[joint] += bend * unit
    return _continue(closure, beside, section) == 0 and _continue(closure, q, section) == 0


def close(closure: Closure, q: Flat, section: Flat) -> int:
    """
    Fill `section`, the array that describes the closed loops at one pose, for joint positions q.

    The start is a pose at which the loops are known to close. The passive variables are followed
    from the start to q (see the module's docstring). So the passive variables at q are on the
    branch of solutions that contains the start, and the result depends on q only.

    The path is a straight line in joint space. If this fails, other straight lines are tried: on
    each of them, some joints without limits turn to q in the opposite direction. If all lines
    fail, paths of two straight parts are tried: from the start to a point beside the middle of the
    first line, and from there to q. These paths go around isolated joint positions at which a loop
    determinant is 0.

    Returns 0 if all loops close. Otherwise returns the number of groups of loops that are not
    closed: the first group that fails, and all groups after it, which are not tried. In this case
    `section` describes a pose on the first straight line: the last pose on this line before the
    failure.
    """
    ways = _begin(closure, closure.start, q, 0, section)
    failed = _continue(closure, q, section)
    if failed == 0:
        return failed
    for other in range(1, 1 << ways):
        _begin(closure, closure.start, q, other, section)
        if _continue(closure, q, section) == 0:
            return 0
    for j in range(closure.dof):
        if _continue_beside(closure, q, j, BEND, section) or _continue_beside(
            closure, q, j, -BEND, section
        ):
            return 0
    _begin(closure, closure.start, q, 0, section)
    return _continue(closure, q, section)


def close_next(closure: Closure, last: Flat, q: Flat, section: Flat) -> int:
    """
    Fill `section`, the array that describes the closed loops at one pose, for joint positions q.

    The array `last` describes the loops at an earlier pose. If q is near the joint positions in
    `last`, the passive variables are followed from `last` to q. Otherwise `close` follows them
    from the joint positions of the robot file to q. Return the result code of `close`.
    """
    _begin(closure, last, q, 0, section)
    if _farthest(closure.first, closure.dof, q, section) <= MAX_MOTION:
        return _continue(closure, q, section)
    return close(closure, q, section)


def assemble(first: LoopGroup, groups: int, dof: int, section: Floats) -> int:
    """
    Correct approximate passive variables of closed loops by Newton's method, and fill `section`.

    Returns 0 if all loops close. Otherwise returns the number of groups of loops that are not
    closed: the first group that fails, and all groups after it, which are not tried. In this case
    `section` has the determinant and the residual of the group that failed.

    Parameters
    ----------
    first, groups
        The first group of loops, and the number of groups to close.
    dof
        Number of joints.
    section : shape (Closure.width,)
        The numbers that describe the closed loops at one pose (see `Closure`). The caller must
        fill in the joint positions and approximate passive variables; `assemble` fills the other
        numbers.
    """
    known = len(groups_from(first))
    status, slopes = [0.0] * 72, [0.0] * 324
    passive = first.variables - dof
    if not 0 < groups <= known or dof != first.first or passive > places.MAX_PASSIVE_VARIABLES:
        raise TypeError('the parts of a closure do not go together')
    status_at = 2 * first.variables + passive * dof
    numbers = arrays.results(section, section_width(dof, first))
    screws = arrays.after(numbers, status_at + 3 * known)
    failed = _solve_all(first, groups, numbers, status, False, screws, slopes, status, 0)
    arrays.copy(arrays.after(numbers, status_at), 3 * groups, status)
    if failed == 0:
        _couple(first, groups, dof, numbers, screws, slopes)
    return failed


def close_at(chain: Chain, q: Floats, sections: Floats, closed: Floats) -> None:
    """
    Compute the passive variables of a chain with loops at N joint positions.

    The start pose is a pose at which the loops are known to close. The passive variables are
    followed from the start pose to each row of q (see `close`).

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.
    sections : shape (N, width)
        Each row is filled with the numbers that describe the closed loops at the same row of q
        (see `Closure`). If a loop does not close at q, the row describes the last pose at which
        all loops closed, on the straight line from the start pose to q.
    closed : shape (N,)
        0 if all loops close. Otherwise the number of groups of loops that are not closed: the
        first group that fails, and all groups after it, which are not tried. A group is a set of
        loops that share passive variables.
    """
    arrays.given(chain.closure)
    count, n, width = arrays.extent(q, 0), chain.dof, chain.closure.width
    if arrays.extent(q, 1) != n or arrays.extent(sections, 1) != width:
        raise TypeError('the arrays of closed loops do not go together')
    positions, results = arrays.numbers(q, 0), arrays.results(sections, count * width)
    failed = arrays.results(closed, count)
    for k in range(count):
        failed[k] = close(
            chain.closure, arrays.after(positions, k * n), arrays.after(results, k * width)
        )
