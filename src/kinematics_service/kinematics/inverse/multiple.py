"""
Solutions that several have become: where exactly they are, and how many.

At such a solution J has lost one motion v, and w is the direction it has lost. The other equations
are solved along q + s v, and what is left of the target along w is a function g(s), the reduced
equation of Lyapunov and Schmidt: its roots are the solutions near by, a root of order m stands for
m of them. Refinement of q itself ends as far from it as the m-th root of round-off; a polynomial
through g does not.
"""

import itertools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from .problem.problem import IkProblem
from .search import DistinctSolutions, apart, errors_at

# g is sampled so far on both sides (rad), at so many places, by a polynomial of a lower degree.
SPAN, SAMPLES, DEGREE = 0.02, 13, 9
# Simple roots so near to 0, as a share of the span, stand beside each other.
NEXT = 0.05
# Largest order looked for.
MOST = 6
# What of g and its derivatives is round-off, as a share of the length.
ROUND_OFF = 1e-15
STEPS = 12
# Joint positions that end as near to each other are the same solution (rad, scaled).
SAME = 1e-7


class Multiple(NamedTuple):
    """
    A solution that several have become.

    Attributes
    ----------
    q : shape (n,), rad or m
        Where it is.
    error
        What is left of the target, m.
    multiplicity
        How many it stands for; 0 where that is not known, as where J has lost two motions.
    """

    q: Floats
    error: float
    multiplicity: int


def with_multiplicities(
    problem: IkProblem, found: DistinctSolutions, singular: npt.NDArray[np.bool_]
) -> DistinctSolutions:
    """
    Return isolated solutions, those that are one made one, with the multiplicity of each.

    `singular` says of which J has lost a motion; the others are simple.
    """
    if not np.any(singular):
        return found
    plan, kept = problem.plan, list[Multiple]()
    for one, error in zip(found.q[singular], found.errors[singular]):
        for multiple in _multiples(problem, one, float(error)):
            ways = (apart(plan, other.q, multiple.q) / plan.scales for other in kept)
            if all(np.max(np.abs(way)) >= SAME for way in ways):
                kept.append(multiple)
    simple = map(Multiple, found.q[~singular], found.errors[~singular], itertools.repeat(1))
    q, errors, multiplicities = zip(*simple, *kept)
    return DistinctSolutions(np.array(q), np.array(errors), multiplicities)


def _multiples(problem: IkProblem, q: Floats, error: float) -> list[Multiple]:
    # What a singular solution really is: one of a multiplicity, or several next to each other.
    robot, target, plan, *_ = problem
    unknown, n = [Multiple(q, error, 0)], robot.dof
    if n > target.equations:
        return unknown
    left, sizes, right = np.linalg.svd(_linearised(problem, q)[1])
    if n > 1 and sizes[n - 2] < 1e-3 * sizes[0]:
        return unknown
    along, across = right[n - 1], right[: n - 1]
    kept, lost = left[:, : n - 1], left[:, n - 1 :]
    at = SPAN * np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    ways = []
    for s in at:
        way = _way(problem, q, s, (along, across, kept))
        if way is None:
            return unknown
        ways.append(way)
    rests = np.array([_linearised(problem, q + w * plan.scales)[0] @ lost for w in ways])
    direction = np.linalg.svd(rests)[2][0]
    g = np.polynomial.Polynomial.fit(at, rests @ direction, DEGREE, domain=[-SPAN, SPAN])
    nothing = ROUND_OFF * max(robot.singularity.task.length, robot.singularity.task.reach)
    found = []
    for order, s in _roots(np.array(g.coef), nothing):
        way = _way(problem, q, SPAN * s, (along, across, kept))
        if way is None:
            return unknown
        place = q + way * plan.scales
        left_over = float(errors_at(target, plan, place[None])[0])
        if left_over >= target.proved:
            return unknown
        found.append(Multiple(place, left_over, order))
    return found or unknown


def _roots(coefficients: Floats, nothing: float) -> list[tuple[int, float]]:
    # Orders and places of the roots next to 0: the one of the highest order, or all simple ones.
    order, at = _root(coefficients, nothing)
    if order != 1:
        return [(order, at)] if order else []
    roots = np.polynomial.polynomial.polyroots(coefficients)
    near = roots[(np.abs(roots) < NEXT) & (np.abs(roots.imag) < 1e-9)].real
    return [(1, float(root)) for root in near]


def _root(coefficients: Floats, nothing: float) -> tuple[int, float]:
    # The highest order of a root next to 0, and where it is: that of a derivative that is simple.
    for order in range(MOST, 0, -1):
        derivative = coefficients
        for _ in range(order - 1):
            derivative = np.asarray(np.polynomial.polynomial.polyder(derivative), np.float64)
        roots = np.polynomial.polynomial.polyroots(derivative)
        if not len(roots):
            continue
        root = roots[int(np.argmin(np.abs(roots)))]
        if abs(root) > 0.5 or abs(root.imag) > 1e-3:
            continue
        # Taylor's coefficients at it: all below the order are round-off.
        terms, factor = coefficients, 1.0
        sizes = []
        for k in range(order + 1):
            sizes.append(abs(float(np.polynomial.polynomial.polyval(root.real, terms))) / factor)
            terms = np.asarray(np.polynomial.polynomial.polyder(terms), np.float64)
            factor *= k + 1
        if max(sizes[:order]) <= nothing < sizes[order]:
            return order, float(root.real)
    return 0, 0.0


def _way(
    problem: IkProblem, q: Floats, s: float, parts: tuple[Floats, Floats, Floats]
) -> Floats | None:
    # The scaled way from q with s along the lost motion that solves the equations not lost.
    along, across, kept = parts
    y = np.zeros(len(across))
    for _ in range(STEPS):
        error, J = _linearised(problem, q + (s * along + y @ across) * problem.plan.scales)
        if not np.isfinite(error).all():  # a loop does not close there
            return None
        step = np.asarray(np.linalg.lstsq(kept.T @ J @ across.T, kept.T @ error, rcond=None)[0])
        y = np.asarray(y + step)
        if np.max(np.abs(step), initial=0.0) < 1e-13:
            return np.asarray(s * along + y @ across)
        if np.max(np.abs(y), initial=0.0) > 0.5:
            return None
    return np.asarray(s * along + y @ across)


def _linearised(problem: IkProblem, q: Floats) -> tuple[Floats, Floats]:
    # The weighted error (6,) at q, and its Jacobian (6, n); rows that do not count are 0.
    error, columns = np.empty(6), np.empty((len(q), 6))
    kernel.linearise(problem.target.residual, problem.plan.scales, q, error, columns)
    return error, columns.T
