"""
Solutions: told apart, turned into the limits, and sorted by how near they are.

"""

import math

from . import aims, arrays, places, refinement
from .arrays import Floats, Integers
from .chain import Chain

# Two solutions (rad, scaled) nearer than this may be one.
MAYBE_SAME = 1e-2
# As near to the target as a solution is to round-off, as a share of the length.
AS_GOOD = 1e-13


def _without_turns(away: float, period: float) -> float:
    if not math.isfinite(period):
        return away
    return away - period * math.floor(away / period + 0.5)


def _are_one(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    error: float,
    a: Floats,
    b: Floats,
    work: Floats,
) -> bool:
    # Whether a is the solution b: equal to round-off, or the point halfway is a solution too.
    n = chain.dof
    halfway = work
    free = arrays.after(halfway, n)
    distance = 0.0
    for j in range(n):
        away = _without_turns(a[j] - b[j], periods[j])
        halfway[j] = b[j] + 0.5 * away
        distance = max(distance, abs(away) / scales[j])
        free[2 * j], free[2 * j + 1] = -places.INFINITY, places.INFINITY
    if distance >= MAYBE_SAME:
        return False
    if distance < places.SAME_SOLUTION:
        return True
    left = refinement.refine_one(
        chain, aim, scales, free, 0.0, 0, halfway, arrays.after(free, 2 * n)
    )
    length = max(aims.length_of(aim), refinement.LEAST_LENGTH)
    return left < max(AS_GOOD * length, 4.0 * error)


def distinct_rows(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    proved: float,
    rows: int,
    q: Floats,
    errors: Floats,
    which: Integers,
    met: Integers,
    work: Floats,
) -> int:
    """
    Do what `distinct` does; `work` has room for `room` numbers.

    """
    n = chain.dof
    count = 0
    for k in range(rows):
        if not errors[k] < proved:
            break
        known = False
        for i in range(count):
            one = arrays.after(q, which[i] * n)
            known = _are_one(
                chain,
                aim,
                scales,
                periods,
                errors[k],
                arrays.after(q, k * n),
                one,
                work,
            )
            if known:
                met[i] += 1
                break
        if not known:
            which[count] = k
            met[count] = 1
            count += 1
    return count


def room(n: int, row: int) -> int:
    """
    Return how many numbers `distinct_rows` needs room for, a row being so long.

    """
    return 3 * n + refinement.room(n, row)


def distinct(
    chain: Chain,
    aim: Floats,
    scales: Floats,
    periods: Floats,
    proved: float,
    q: Floats,
    errors: Floats,
    which: Integers,
    met: Integers,
) -> int:
    """
    Fill `which` with the rows of q that are solutions, each solution once; return their number.

    Two rows are one solution where they are equal to round-off, full turns left out, or where
    they are near each other and the point halfway is a solution too: at the border of the
    workspace two solutions meet, and are told apart as long as the target can tell.

    Parameters
    ----------
    chain, aim, scales
        As `refine` takes them.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    proved
        Rows with less of an error are solutions, m.
    q, errors : shape (N, n), (N,)
        Joint positions and by how much they miss, the least first.
    which, met : shape (N,)
        Rows kept, and how many rows each stands for.

    """
    arrays.given(chain)
    n, rows = chain.dof, arrays.extent(q, 0)
    work = arrays.scratch(room(n, chain.frames_at))
    count = distinct_rows(
        chain,
        arrays.numbers(aim, places.AIM_SIZE),
        arrays.numbers(scales, n),
        arrays.numbers(periods, n),
        proved,
        rows,
        arrays.numbers(q, rows * n),
        arrays.numbers(errors, rows),
        arrays.whole_results(which, rows),
        arrays.whole_results(met, rows),
        work,
    )
    arrays.give_back(work)
    return count


def _represent(n: int, limits: Floats, periods: Floats, near: Floats, q: Floats) -> None:
    # Turns one row of `representatives`.
    for j in range(n):
        period = periods[j]
        if not math.isfinite(period):
            continue
        low, high = limits[2 * j] - places.AT_LIMIT, limits[2 * j + 1] + places.AT_LIMIT
        x = near[j] - _without_turns(near[j] - q[j], period)
        if x <= near[j] - 0.5 * period + 1e-15:
            x += period
        if x < low:
            x += period * math.ceil((low - x) / period)
        elif x > high:
            x -= period * math.ceil((x - high) / period)
        # Where no turn is inside, the one that is beyond by less.
        if x > high and low - (x - period) < x - high:
            x -= period
        elif x < low and x + period - high < low - x:
            x += period
        q[j] = x


def representatives(limits: Floats, periods: Floats, near: Floats, q: Floats) -> None:
    """
    Turn each row of q by full turns: into the limits if that can be, and there nearest to `near`.

    Parameters
    ----------
    limits : shape (n, 2), rad or m
        Infinite where there are none.
    periods : shape (n,)
        Turn after which a joint is back, or infinite.
    near : shape (n,), rad or m
        Half a turn from it, the upper one is taken.
    q : shape (N, n), rad or m
        Overwritten.

    """
    count, n = arrays.extent(q, 0), arrays.extent(q, 1)
    bounds, turns = arrays.numbers(limits, 2 * n), arrays.numbers(periods, n)
    middle, rows = arrays.numbers(near, n), arrays.results(q, 0)
    for k in range(count):
        _represent(n, bounds, turns, middle, arrays.after(rows, k * n))


def stand(
    n: int,
    limits: Floats,
    periods: Floats,
    scales: Floats,
    near: Floats,
    q: Floats,
    facts: Floats,
) -> float:
    """
    Turn q (n,) into its representative, and fill how it stands to the limits.

    Returns the square of its distance to `near`.

    """
    _represent(n, limits, periods, near, q)
    away, margin = 0.0, places.INFINITY
    for j in range(n):
        space = min(q[j] - limits[2 * j], limits[2 * j + 1] - q[j])
        margin = min(margin, space)
        facts[places.BEYOND_AT + j] = 1.0 if space < -places.AT_LIMIT else 0.0
        share = (q[j] - near[j]) / scales[j]
        away += share * share
    facts[places.MARGIN] = margin
    return away


def least(numbers: Floats, count: int) -> int:
    """
    Return where the least of so many numbers stands.

    """
    at = 0
    for i in range(1, count):
        if numbers[i] < numbers[at]:
            at = i
    return at


def sort_by_error(n: int, count: int, q: Floats, errors: Floats) -> None:
    """
    Sort rows of q by their errors; rows that miss by as much keep their order.

    """
    for i in range(1, count):
        k = i
        while k > 0 and errors[k] < errors[k - 1]:
            x = errors[k]
            errors[k] = errors[k - 1]
            errors[k - 1] = x
            for j in range(k * n, k * n + n):
                x = q[j]
                q[j] = q[j - n]
                q[j - n] = x
            k -= 1
