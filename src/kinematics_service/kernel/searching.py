"""
The first solution that refinement meets, in one call.

"""

from . import arrays, dependence, places, refinement, solutions
from .arrays import Floats
from .chain import Chain


def first_solution(
    chain: Chain,
    aim: Floats,
    held: Floats,
    scales: Floats,
    periods: Floats,
    bounds: Floats,
    limits: Floats,
    near: Floats,
    proved: float,
    starts: Floats,
    q: Floats,
    facts: Floats,
) -> int:
    """
    Fill the first solution inside the limits that refinement meets; return the starts it took.

    From `near`, then from the starts in their order; -1 where none of them led there.

    Parameters
    ----------
    chain, aim, scales, periods, limits, near, proved
        As `refine`, `distinct` and `representatives` take them.
    held : shape (n,)
        The scales, 0 for joints that stay where `near` has them.
    bounds : shape (n, 2), rad or m
        What no joint leaves on its way.
    starts : shape (N, n), rad or m
        Where to start from.
    q, facts : shape (1, n), (1, BEYOND_AT + n)
        The solution, and what is said of it.

    """
    arrays.given(chain)
    n, count = chain.dof, arrays.extent(starts, 0)
    target = arrays.numbers(aim, places.AIM_SIZE)
    counted, turns = arrays.numbers(scales, n), arrays.numbers(periods, n)
    moving, inside = arrays.numbers(held, n), arrays.numbers(bounds, 2 * n)
    edges, middle = arrays.numbers(limits, 2 * n), arrays.numbers(near, n)
    tries, one = arrays.numbers(starts, count * n), arrays.results(q, n)
    told = arrays.results(facts, places.BEYOND_AT + n)
    work = arrays.scratch(refinement.room(n, chain.frames_at))
    taken = -1
    lock = arrays.let_go()
    for k in range(count + 1):
        for j in range(n):
            value = middle[j]
            if k > 0 and moving[j] != 0.0:
                value = tries[(k - 1) * n + j]
            one[j] = min(max(value, inside[2 * j]), inside[2 * j + 1])
        left = refinement.refine_one(
            chain,
            target,
            moving,
            inside,
            places.FAR_DAMPING,
            places.FAR_STEPS,
            one,
            work,
        )
        if not left < proved:
            continue
        solutions.stand(n, edges, turns, counted, middle, one, told)
        if told[places.MARGIN] >= -places.AT_LIMIT:
            told[places.MISSES] = left
            told[places.SHARE] = dependence.share_of_last_pivot(chain, target, counted, one, work)
            taken = k + 1
            break
    arrays.take_back(lock)
    arrays.give_back(work)
    return taken
