"""
All solutions of an arm that has a closed form, or the nearest of them, in one call.

"""

from . import arrays, closed_forms, dependence, places, posture, refinement, solutions, vectors
from .arrays import Floats, Integers
from .chain import Chain

# What is added to the squared distance of a candidate outside the limits: not before the others.
LAST = 1e200


def _write_motion(
    way: int,
    aim: Floats,
    point: Floats,
    home_inverse: Floats,
    backwards: bool,
    T: Floats,
    B: Floats,
) -> None:
    # The motion (4, 4) from rest to the target, as the screws have to bring it about, in B.
    for k in range(16):
        T[k] = 1.0 if k % 5 == 0 else 0.0
    for i in range(3):
        for j in range(4):
            if way == places.POSITION_3:
                T[4 * i + j] = 1.0 if i == j else 0.0
                continue
            T[4 * i + j] = 0.0
            for k in range(4):
                T[4 * i + j] += aim[4 * i + k] * home_inverse[4 * k + j]
        if way == places.POSITION_3:
            T[4 * i + 3] = aim[4 * i + 3] - point[i]
    for k in range(16):
        B[k] = T[k]
    if not backwards:
        return
    for i in range(3):
        B[4 * i + 3] = 0.0
        for j in range(3):
            B[4 * i + j] = T[4 * j + i]
            B[4 * i + 3] -= T[4 * j + i] * T[4 * j + 3]


def _times(rows: int, columns: int, A: Floats, x: Floats, y: Floats) -> None:
    # y = A x.
    for i in range(rows):
        y[i] = 0.0
        for j in range(columns):
            y[i] += A[i * columns + j] * x[j]


def _keep_nearest(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    count: int,
    found: Floats,
    unlimited: Floats,
    away: Floats,
    q: Floats,
    facts: Floats,
    work: Floats,
) -> int:
    # The nearest of the solutions inside the limits, into q; how many there are, 0 or 1.
    n = chain.dof
    for i in range(count):
        one = arrays.after(found, i * n)
        away[i] = solutions.stand(n, limits, periods, scales, near, one, facts)
        if facts[places.MARGIN] < -places.AT_LIMIT:
            away[i] += LAST
    for _ in range(count):
        i = solutions.least(away, count)
        away[i] = places.INFINITY
        one = arrays.after(found, i * n)
        left = refinement.refine_one(
            chain, aim, scales, unlimited, 0.0, places.NEAR_STEPS, one, work
        )
        solutions.stand(n, limits, periods, scales, near, one, facts)
        if left < proved and facts[places.MARGIN] >= -places.AT_LIMIT:
            for j in range(n):
                q[j] = one[j]
            facts[places.MISSES] = left
            return 1
    return 0


def _keep_all(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    count: int,
    found: Floats,
    unlimited: Floats,
    away: Floats,
    q: Floats,
    facts: Floats,
    work: Floats,
) -> int:
    # All solutions, nearest first, into q; how many there are.
    n = chain.dof
    about = places.BEYOND_AT + n
    errors = arrays.after(away, places.MOST_CANDIDATES)
    whole = arrays.as_whole(arrays.after(errors, places.MOST_CANDIDATES))
    which = whole
    met = arrays.whole_after(whole, places.MOST_CANDIDATES)
    told = arrays.after(errors, 3 * places.MOST_CANDIDATES)
    for i in range(count):
        errors[i] = refinement.refine_one(
            chain,
            aim,
            scales,
            unlimited,
            0.0,
            places.NEAR_STEPS,
            arrays.after(found, i * n),
            work,
        )
    solutions.sort_by_error(n, count, found, errors)
    kept = solutions.distinct_rows(
        chain, aim, scales, periods, proved, count, found, errors, which, met, work
    )
    for i in range(kept):
        one, facts_i = arrays.after(found, which[i] * n), arrays.after(told, i * about)
        facts_i[places.MISSES] = errors[which[i]]
        away[i] = solutions.stand(n, limits, periods, scales, near, one, facts_i)
    for i in range(kept):
        best = solutions.least(away, kept)
        away[best] = places.INFINITY
        for j in range(n):
            q[i * n + j] = found[which[best] * n + j]
        for j in range(about):
            facts[i * about + j] = told[best * about + j]
    return kept


def closed_solutions(
    chain: Chain,
    aim: Floats,
    way: int,
    screws: Floats,
    point: Floats,
    home_inverse: Floats,
    backwards: bool,
    to_joints: Floats,
    to_screws: Floats,
    scales: Floats,
    periods: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    only_one: bool,
    q: Floats,
    facts: Floats,
    signs: Integers,
) -> int:
    """
    Fill the solutions of an arm that has a closed form, nearest to `near` first; return how many.

    Each is refined, and proved by forward kinematics. Where one is enough, it is the nearest of
    those inside the limits.

    Parameters
    ----------
    chain, aim, scales, periods, limits, near, proved
        As `refine`, `distinct` and `representatives` take them.
    way, screws, point, home_inverse, backwards, to_joints, to_screws
        As `plan.ClosedForm` has them.
    only_one
        Whether the nearest solution inside the limits is enough.
    q, facts, signs : shape (MOST_CANDIDATES, n), (..., BEYOND_AT + n), (..., 3)
        Joint positions, what is said of them, and their postures.

    """
    most = places.MOST_CANDIDATES
    arrays.given(chain)
    n, k = arrays.extent(to_joints, 0), arrays.extent(to_joints, 1)
    if n != chain.dof:
        raise TypeError('the arrays of an arm and its closed form do not go together')
    about = places.BEYOND_AT + n
    target = arrays.numbers(aim, places.AIM_SIZE)
    table, start = arrays.numbers(screws, 7 * k), arrays.numbers(point, 3)
    home = arrays.numbers(home_inverse, 16)
    from_screws, from_joints = arrays.numbers(to_joints, n * k), arrays.numbers(to_screws, k * n)
    counted, turns = arrays.numbers(scales, n), arrays.numbers(periods, n)
    bounds, middle = arrays.numbers(limits, 2 * n), arrays.numbers(near, n)
    positions, told = arrays.results(q, most * n), arrays.results(facts, most * about)
    shown = arrays.whole_results(signs, most * 3)

    work = arrays.scratch(
        32
        + k
        + most * (k + n)
        + 2 * n
        + 4 * most
        + most * about
        + solutions.room(n, chain.frames_at)
    )
    T = work
    free = arrays.after(T, 32)
    psi = arrays.after(free, k)
    found = arrays.after(psi, most * k)
    unlimited = arrays.after(found, most * n)
    away = arrays.after(unlimited, 2 * n)
    rest = arrays.after(away, 4 * most + most * about)
    for j in range(n):
        unlimited[2 * j], unlimited[2 * j + 1] = -places.INFINITY, places.INFINITY
    motion = arrays.after(T, 16)
    _write_motion(way, target, start, home, backwards, T, motion)
    _times(k, n, from_joints, middle, free)
    count = closed_forms.candidates(way, table, start, motion, free, psi)
    for i in range(count):
        _times(n, k, from_screws, arrays.after(psi, i * k), arrays.after(found, i * n))
    if only_one:
        kept = _keep_nearest(
            chain,
            target,
            counted,
            turns,
            bounds,
            middle,
            proved,
            count,
            found,
            unlimited,
            away,
            positions,
            told,
            rest,
        )
    else:
        kept = _keep_all(
            chain,
            target,
            counted,
            turns,
            bounds,
            middle,
            proved,
            count,
            found,
            unlimited,
            away,
            positions,
            told,
            rest,
        )
    first = vectors.three(start, 0)
    for i in range(kept):
        one = arrays.after(positions, i * n)
        told[i * about + places.SHARE] = dependence.share_of_last_pivot(
            chain, target, counted, one, rest
        )
        shown_i = arrays.whole_after(shown, 3 * i)
        shown_i[0], shown_i[1], shown_i[2] = 0, 0, 0
        if not backwards:
            _times(k, n, from_joints, one, psi)
            posture.write_posture(way, table, first, psi, shown_i)
    arrays.give_back(work)
    return kept
