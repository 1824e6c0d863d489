# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute positions and multiplicities of multiple solutions by the Lyapunov-Schmidt reduction.

At a multiple solution q the Jacobian J is singular. It has a null vector v: a joint motion that
does not move the tool. It has a left null vector w: a direction in which the tool cannot move. For
each number s, Newton's method corrects the joint positions q + s v until the tool meets the target
in all directions except w. The remaining error along w is a function g(s). The equation g(s) = 0
is called the reduced equation. Each root of g is a solution near q. A root of multiplicity m
stands for m solutions that coincide.

Refinement of q (Levenberg-Marquardt) cannot reach a multiple solution exactly. It stops at a
distance of about the m-th root of the machine epsilon. So a polynomial is fitted to g, and the
root of this polynomial is exact to round-off.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from .problem.problem import IkProblem
from .search import DistinctSolutions, apart, errors_at

# Near a solution where J is singular, the Lyapunov-Schmidt reduction replaces the equations of the
# target by one equation, the reduced equation g(s) = 0. The unknown s is the joint motion (rad)
# along the null vector of J. g is sampled at Chebyshev nodes with |s| up to this, rad.
SAMPLED_SPAN = 0.02
# Number of samples of the reduced equation g(s).
SAMPLE_COUNT = 13
# Degree of the polynomial that is fitted to the samples of the reduced equation g(s).
POLYNOMIAL_DEGREE = 9
# Near a singular pose, solutions of inverse kinematics are the roots s (rad) of the reduced
# equation g(s) = 0. If the root nearest to 0 is simple, all roots with |s| < SIMPLE_ROOT_RANGE *
# SAMPLED_SPAN are taken as solutions.
SIMPLE_ROOT_RANGE = 0.05
# Largest multiplicity that is tried for a solution (a root of the reduced equation g(s) = 0).
MAX_ORDER = 6
# The reduced equation g(s) = 0 replaces the equations of the target near a singular solution. The
# round-off in g and in its Taylor coefficients is at most REDUCED_ROUND_OFF * max(characteristic
# length, reach of the arm). The number is about 5 machine epsilons.
REDUCED_ROUND_OFF = 1e-15
# Largest number of Newton steps to compute one value g(s) of the reduced equation g(s) = 0. First
# the joints move by s (rad) along the null vector of J. The Newton steps then bring the tool back
# to the target in all directions except w, the direction in which the tool cannot move (left null
# vector of J). The error that is left along w is g(s).
MAX_NEWTON_STEPS = 12
# Two solutions are taken as one if the distance between their joint positions is below this, rad
# (prismatic motions divided by the characteristic length).
SAME_SOLUTION_DISTANCE = 1e-7


class Multiple(NamedTuple):
    """
    A solution of inverse kinematics with its multiplicity.

    Attributes
    ----------
    q : shape (n,), rad or m
        Joint positions.
    error
        Residual, m.
    multiplicity
        Number of solutions that coincide at `q`; 0 if unknown, for example if J has two null
        vectors.
    """

    q: Floats
    error: float
    multiplicity: int


def with_multiplicities(
    problem: IkProblem, isolated: DistinctSolutions, singular: npt.NDArray[np.bool_]
) -> DistinctSolutions:
    """
    Return isolated solutions with their multiplicities. Solutions that coincide are merged.

    `singular` is true for solutions at which J is singular; all other solutions are simple.
    """
    if not np.any(singular):
        return isolated
    plan, kept = problem.plan, list[Multiple]()
    for posture, error in zip(isolated.q[singular], isolated.errors[singular]):
        for multiple in _multiples(problem, posture, float(error)):
            gaps = (apart(plan, other.q, multiple.q) / plan.scales for other in kept)
            if all(np.max(np.abs(gap)) >= SAME_SOLUTION_DISTANCE for gap in gaps):
                kept.append(multiple)
    simple = map(Multiple, isolated.q[~singular], isolated.errors[~singular], itertools.repeat(1))
    q, errors, multiplicities = zip(*simple, *kept)
    return DistinctSolutions(np.array(q), np.array(errors), multiplicities)


def _multiples(problem: IkProblem, q: Floats, error: float) -> list[Multiple]:
    # Returns the solutions near a search result q at a singular pose: one multiple solution, or
    # several simple solutions.
    robot, target, plan, *_ = problem
    unknown, n = [Multiple(q, error, 0)], robot.dof
    if n > target.equations:
        return unknown
    left, sizes, right = np.linalg.svd(_linearised(problem, q)[1])
    if n > 1 and sizes[n - 2] < 1e-3 * sizes[0]:
        return unknown
    along, across = right[n - 1], right[: n - 1]
    kept, lost = left[:, : n - 1], left[:, n - 1 :]
    at = SAMPLED_SPAN * np.cos(np.pi * (np.arange(SAMPLE_COUNT) + 0.5) / SAMPLE_COUNT)
    steps = []
    for s in at:
        step = _joint_step(problem, q, s, (along, across, kept))
        if step is None:
            return unknown
        steps.append(step)
    errors = np.array([_linearised(problem, q + step * plan.scales)[0] @ lost for step in steps])
    direction = np.linalg.svd(errors)[2][0]
    g = np.polynomial.Polynomial.fit(
        at, errors @ direction, POLYNOMIAL_DEGREE, domain=[-SAMPLED_SPAN, SAMPLED_SPAN]
    )
    rounding = REDUCED_ROUND_OFF * max(robot.singularity.task.length, robot.singularity.task.reach)
    multiples = []
    for order, s in _roots(np.array(g.coef), rounding):
        step = _joint_step(problem, q, SAMPLED_SPAN * s, (along, across, kept))
        if step is None:
            return unknown
        place = q + step * plan.scales
        residual = float(errors_at(target, plan, place[None])[0])
        if residual >= target.proved:
            return unknown
        multiples.append(Multiple(place, residual, order))
    return multiples or unknown


def _roots(coefficients: Floats, rounding: float) -> list[tuple[int, float]]:
    # Returns the real roots of the reduced equation g(s) = 0 near s = 0: one multiple root, or one
    # or more simple roots. Each root is returned as a pair (multiplicity, s / SAMPLED_SPAN).
    # `coefficients` are the coefficients of g, a polynomial in s / SAMPLED_SPAN.
    order, at = _root(coefficients, rounding)
    if order != 1:
        return [(order, at)] if order else []
    roots = np.polynomial.polynomial.polyroots(coefficients)
    near = roots[(np.abs(roots) < SIMPLE_ROOT_RANGE) & (np.abs(roots.imag) < 1e-9)].real
    return [(1, float(root)) for root in near]


def _root(coefficients: Floats, rounding: float) -> tuple[int, float]:
    # The reduced equation g(s) = 0 may have a multiple root near s = 0. Returns the highest
    # multiplicity m and the position s / SAMPLED_SPAN of this root. Method: at a root of
    # multiplicity m, derivative m - 1 of g has a simple root.
    derivatives = [np.polynomial.Polynomial(coefficients)]
    for _ in range(MAX_ORDER):
        derivatives.append(derivatives[-1].deriv())
    for order in range(MAX_ORDER, 0, -1):
        root: complex = min(derivatives[order - 1].roots().tolist(), key=abs, default=math.inf)
        if abs(root) > 0.5 or abs(root.imag) > 1e-3:
            continue
        # Accept the root if the Taylor coefficients of g at the root with orders 0 to `order` - 1
        # are only round-off.
        at_root = (abs(derivative(root.real)) for derivative in derivatives[: order + 1])
        sizes = [size / math.factorial(k) for k, size in enumerate(at_root)]
        if max(sizes[:order]) <= rounding < sizes[order]:
            return order, root.real
    return 0, 0.0


def _joint_step(
    problem: IkProblem, q: Floats, s: float, parts: tuple[Floats, Floats, Floats]
) -> Floats | None:
    # Returns a joint step from q, divided by `plan.scales`. The component of the step along the
    # null vector of J is s. Newton's method finds the other components: after the step the tool
    # meets the target in all directions but one, the direction in which the tool cannot move at
    # the singular solution. Returns None if Newton's method diverges.
    along, across, kept = parts
    y = np.zeros(len(across))
    for _ in range(MAX_NEWTON_STEPS):
        error, J = _linearised(problem, q + (s * along + y @ across) * problem.plan.scales)
        if not np.isfinite(error).all():  # a closed loop of the arm does not close
            return None
        step = np.asarray(np.linalg.lstsq(kept.T @ J @ across.T, kept.T @ error, rcond=None)[0])
        y = np.asarray(y + step)
        if np.max(np.abs(step), initial=0.0) < 1e-13:
            return np.asarray(s * along + y @ across)
        if np.max(np.abs(y), initial=0.0) > 0.5:
            return None
    return np.asarray(s * along + y @ across)


def _linearised(problem: IkProblem, q: Floats) -> tuple[Floats, Floats]:
    # Returns the weighted error (6,) at q, and its Jacobian (6, n). Rows that the target does not
    # use are 0.
    error, columns = np.empty(6), np.empty((len(q), 6))
    kernel.linearise(problem.target.residual, problem.plan.scales, q, error, columns)
    return error, columns.T
