"""Curves of solutions, from chart to chart: real ones until they close, others by slices."""

import math

from ..layout import arrays
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers, Numbers
from ..six_joints import complex_numbers, pairs
from . import charts
from .charts import CurveChart

# Pieces are no longer, in units of the parameter: a curve has to be seen between them.
LONGEST = 0.1
# The radius of a tube about a cubic, as a share of its length.
NARROW = 0.03
# A complex solution that needs more to go round is too far from the real ones.
MOST_PIECES = 10000
# Discs about a fold that are tried, each smaller than the last.
SHARES = 60


def trace(chart: CurveChart, start: Floats, side: float, samples: Floats, closed: Integers) -> int:
    """
    Follow the curve of real solutions from one of them until it closes; return how many samples.

    Parameters
    ----------
    chart
        Of the arm and its target.
    start : shape (n,), rad or m
        Near a solution: positions of the screws.
    side
        1 or -1: in which direction.
    samples : shape (m, 2 n)
        Positions of the screws, and the unit tangent.
    closed : shape (1,)
        1 where the curve closed, 0 where it could not be followed or the room was used up.
    """
    n = chart.n
    most = arrays.extent(samples, 0)
    rows, how = arrays.results(samples, 2 * most * n), arrays.whole_results(closed, 1)
    first = [0.0] * 14
    _put_real(arrays.numbers(start, n), n, chart.t)
    count = 0
    how[0] = 0
    lock = arrays.let_go()
    if chart.improve(charts.ANY):
        count = _traced(chart, side, first, rows, most, how)
    arrays.take_back(lock)
    return count


def _traced(
    chart: CurveChart, side: float, first: Numbers, rows: Flat, most: int, how: FlatIntegers
) -> int:
    n, sign, before = chart.n, side, -1
    chart.write_place(first)
    for count in range(most):
        if not chart.open(charts.ANY, charts.RADIUS):
            return count
        # The curve was a graph over the parameter before, which goes on as it did.
        if before >= 0 and chart.w[2 * before] < 0.0:
            sign = -sign
        size = 0.0
        for j in range(n):
            way = chart.w[2 * j] / chart.sizes[j]
            size += way * way
        row = arrays.after(rows, 2 * count * n)
        for j in range(n):
            row[j] = chart.t[2 * j]
            row[n + j] = sign * chart.w[2 * j] / chart.sizes[j] / math.sqrt(size)
        if count > 0 and sign * chart.along_parameter(first) > 0.0 and chart.holds(first, 1.0):
            how[0] = 1
            return count + 1
        before = chart.parameter
        if not chart.follow((sign * min(chart.h, LONGEST), 0.0)):
            return count + 1
    return most


def follow(chart: CurveChart, t: Floats, joint: int, end: float, shortest: float) -> bool:
    """
    Follow a complex solution while one joint, real, moves to an end; return whether it is there.

    Parameters
    ----------
    chart
        Of the arm and its target.
    t : shape (n, 2), rad or m
        Positions of the screws, real and imaginary parts; overwritten with the last ones.
    joint
        Which of them moves.
    end : rad or m
        Where to.
    shortest : rad or m
        Pieces that are shorter stop it.
    """
    n = chart.n
    at = arrays.results(t, 2 * n)
    chart.require(joint)
    chart.stand_at(at)
    lock = arrays.let_go()
    arrived = _followed(chart, joint, end, shortest)
    arrays.take_back(lock)
    chart.write_place(at)
    return arrived


def _followed(chart: CurveChart, joint: int, end: float, shortest: float) -> bool:
    if not chart.improve(joint):
        return False
    for _ in range(MOST_PIECES):
        if chart.t[2 * joint] == end:
            return True
        # Complex solutions bend much: along a cubic their pieces are longer.
        if not chart.open(joint, charts.RADIUS) or not chart.bend_further(NARROW):
            return False
        left = end - chart.t[2 * joint]
        h = chart.h / chart.sizes[joint]
        if h < shortest and h < abs(left):
            return False
        if h >= abs(left):
            if not chart.follow((left * chart.sizes[joint], 0.0)):
                return False
            chart.t[2 * joint] = end
        elif not chart.follow((chart.h if left > 0.0 else -chart.h, 0.0)):
            return False
    return False


def spread(chart: CurveChart, begin: Floats, end: Floats, widths: Floats) -> bool:
    """
    Fill in how far the curve of real solutions leaves the chord of two of them at most, by proof.

    Return False where a chart at the first does not reach the second.

    Parameters
    ----------
    chart
        Of the arm and its target.
    begin, end : shape (n,), rad or m
        Positions of the screws; full turns of joints that turn do not count.
    widths : shape (n,), rad or m
        Of each screw.
    """
    n, other = chart.n, [0.0] * 14
    written = arrays.results(widths, n)
    found = _holds_both(chart, begin, end, True, other)
    if found:
        # The path is w s + b s^2 / 2 + c s^3 / 6 + R(s), |R| <= r (s / h)^4 by Schwarz. From their
        # chords the square is S^2 / 8 away at most, the cube S^3 / (9 sqrt(3)), R twice itself.
        S = abs(chart.along_parameter(other))
        x = S / chart.h
        rest = 2.0 * chart.r * x * x * x * x + 4.0 * chart.left
        for j in range(n):
            bend = math.sqrt(pairs.square_of(pairs.pair(chart.b, j)))
            cube = math.sqrt(pairs.square_of(pairs.pair(chart.c, j)))
            way = S * S * (bend / 8.0 + S * cube / 15.5) + rest
            written[j] = way / chart.sizes[j]
    return found


def passes(chart: CurveChart, begin: Floats, end: Floats) -> bool:
    """
    Return whether the curve through a real solution passes another one, by a chart at the first.

    Parameters
    ----------
    chart
        Of the arm and its target.
    begin, end : shape (n,), rad or m
        Positions of the screws; full turns of joints that turn do not count.
    """
    other = [0.0] * 14
    return _holds_both(chart, begin, end, False, other)


def _holds_both(chart: CurveChart, begin: Floats, end: Floats, bent: bool, other: Numbers) -> bool:
    # Whether a chart at a solution holds another one, which is written as pairs.
    _put_real(arrays.numbers(begin, chart.n), chart.n, chart.t)
    _put_real(arrays.numbers(end, chart.n), chart.n, other)
    if not chart.open(charts.ANY, charts.RADIUS) or bent and not chart.bend_further(charts.RADIUS):
        return False
    return chart.holds(other, 1.0)


def _put_real(positions: Flat, n: int, t: Numbers) -> None:
    for j in range(n):
        t[2 * j], t[2 * j + 1] = positions[j], 0.0


def fold_near(chart: CurveChart, t: Floats, joint: int) -> bool:
    """
    Move positions to where a joint is at an end of its range, real or not: the next fold.

    Parameters
    ----------
    chart
        Of the arm and its target.
    t : shape (n, 2), rad or m
        A solution; overwritten.
    joint
        Which of the screws.
    """
    n = chart.n
    at = arrays.results(t, 2 * n)
    chart.require(joint)
    chart.stand_at(at)
    arrived = chart.move_to_fold(joint)
    chart.write_place(at)
    return arrived


def fold_at(chart: CurveChart, t: Floats, joint: int, radius: float, fold: Floats) -> bool:
    """
    Chart the solutions next to a fold of a joint; return False where that is singular.

    Parameters
    ----------
    chart
        Of the arm and its target; it stays at the fold, for `holds` and `write_beside_fold`.
    t : shape (n, 2), rad or m
        The fold: the joint is at an end of its range.
    joint
        Which joint.
    radius
        Of the tube, as a share of its length.
    fold : shape (4,)
        Whether two more real solutions are above a real fold (1) or below (-1); how far from it
        (rad or m) the joint may be and have exactly two solutions in the chart; up to which share
        of it these are; and how far any of them is from it, in units of u.
    """
    n = chart.n
    at, written = arrays.numbers(t, 2 * n), arrays.results(fold, 4)
    chart.require(joint)
    chart.stand_at(at)
    if not chart.open(charts.ANY, charts.RADIUS) or chart.parameter == joint:
        return False
    if not chart.bend_further(radius):
        return False
    # The joint is w s + b s^2 / 2 + c s^3 / 6 + R(s), |R| <= r (|s| / h)^4 by Schwarz; by Rouche
    # it has two solutions where the square is larger than the others and its way from the fold.
    slope = math.sqrt(pairs.square_of(pairs.pair(chart.w, joint))) * chart.h
    square = 0.5 * math.sqrt(pairs.square_of(pairs.pair(chart.b, joint))) * chart.h * chart.h
    cube = math.sqrt(pairs.square_of(pairs.pair(chart.c, joint))) * chart.h * chart.h * chart.h
    room, share, x = 0.0, 0.0, 1.0
    for _ in range(SHARES):
        left = x * (x * (square - x * (cube / 6.0 + x * chart.r)) - slope)
        if left > room:
            room, share = left, x
        x *= 0.9
    # The fold is where it is up to round-off.
    room -= 4.0 * chart.left
    reach = share * chart.h
    written[0] = 1.0 if chart.b[2 * joint] > 0.0 else -1.0
    written[1] = room / chart.sizes[joint]
    written[2] = share
    written[3] = reach * chart.along + 0.5 * reach * reach * chart.bending + chart.r
    written[3] += reach * reach * reach * chart.cubic / 6.0
    return room > 0.0


def write_beside_fold(chart: CurveChart, joint: int, away: float, side: float, t: Floats) -> None:
    """
    Write about where one of the two solutions next to a fold is: positions (n, 2).

    Parameters
    ----------
    chart
        At the fold.
    joint
        Whose range ends there.
    away : rad or m
        How far it is from the end.
    side
        1 or -1: which of the two.
    t : shape (n, 2), rad or m
        Positions of the screws.
    """
    at = arrays.results(t, 2 * chart.n)
    chart.require(joint)
    # The joint moves by b s^2 / 2.
    square = pairs.over((2.0 * away * chart.sizes[joint], 0.0), pairs.pair(chart.b, joint))
    s = complex_numbers.root(square)
    for j in range(chart.n):
        w = pairs.times(s, pairs.pair(chart.w, j))
        b = pairs.times(square, pairs.pair(chart.b, j))
        for e in range(2):
            at[2 * j + e] = chart.t[2 * j + e] + (side * w[e] + 0.5 * b[e]) / chart.sizes[j]


def holds(chart: CurveChart, t: Floats, share: float) -> bool:
    """Return whether a solution (n, 2) is on a chart's curve, up to a share of its reach."""
    return chart.holds(arrays.numbers(t, 2 * chart.n), share)
