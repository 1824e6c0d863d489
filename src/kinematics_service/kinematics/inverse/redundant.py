# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve the inverse kinematics of arms with more joints than the target has equations. The solutions
of such arms form continua.

If one joint is redundant, the solutions form curves, and the result has these curves. If several
joints are redundant, the result has one posture of the continuum of solutions.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from ...typography import counted
from .answer import family_of, not_exact, representatives, result_of
from .curve_search import curves_of
from .families import SolutionFamily, nearer, tangent
from .problem.plan import InversePlan
from .problem.problem import IkProblem
from .result import IkFamily, IkResult
from .search import errors_at, no_solutions, reached, refined, starts
from .self_motion.arcs import IkArc, squares_of
from .self_motion.best_posture import ON_ARC, SAMPLE_DISTANCE, shifted_past
from .self_motion.curve import SolutionCurve
from .self_motion.cut import arcs_of
from .self_motion.sliced_arm import sliced_arm_of

# The search for a solution of a redundant arm has up to three rounds. Number of random starts in
# the first round (inside the limits), and in the third round (without limits).
START_COUNT = 24
# Number of random starts in the second round of the search for a solution of a redundant arm
# (inside the limits).
REPEATED_START_COUNT = 240


def redundant_result(problem: IkProblem) -> IkResult:
    """
    Return the inverse kinematics result of an arm with redundant joints.

    If the arm has one redundant joint, the result has the curves of solutions. If it has several,
    or if no curve is found, the result has one posture of the continuum of solutions.
    """
    robot, target, *_ = problem
    arm = sliced_arm_of(robot, target.rows, target.axis) if problem.curves else None
    curves = () if arm is None else curves_of(problem, arm)
    if curves:
        return _of_curves(problem, curves)
    family, best = redundant_family(problem)
    alone = () if family is None else (family,)
    result = result_of(problem, no_solutions(robot), alone, 'search', best=best)
    return replace(result, complete='partial') if alone else result


def _near_alone(
    problem: IkProblem, curves: Sequence[SolutionCurve], families: list[IkFamily]
) -> list[IkFamily]:
    # If `problem.near` is a solution, but no arc or curve found passes through it, returns `near`
    # as a separate family. Such a solution is singular: the search also tried to trace a curve
    # from `near`, and this fails only at singular solutions.
    robot, target, plan, near, *_ = problem
    error = float(errors_at(target, plan, near[None])[0])
    if not target.is_reached_at(near, error):
        return []
    motions = tangent(problem, near, plan.freedom)
    alone = family_of(problem, SolutionFamily(near, error, motions, False))
    if alone.feasible:
        inside = (family.q for family in families if family.feasible)
        on_arc = any(np.linalg.norm((q - near) / plan.scales) < ON_ARC for q in inside)
        return [] if on_arc else [alone]
    on_curve = any(kernel.passes(curve.point, curve.samples, near) for curve in curves)
    return [] if on_curve else [alone]


def _of_curves(problem: IkProblem, curves: Sequence[SolutionCurve]) -> IkResult:
    robot, plan = problem.robot, problem.plan
    with_arcs = [(curve, arcs_of(curve)) for curve in curves]
    if problem.respect_limits and any(arcs for _, arcs in with_arcs):
        with_arcs = [(curve, arcs) for curve, arcs in with_arcs if arcs]
    families = [_family_of_curve(problem, curve, arcs) for curve, arcs in with_arcs]
    families += _near_alone(problem, curves, families)
    families.sort(key=lambda f: float(np.linalg.norm((f.q - problem.near) / plan.scales)))
    none, best = no_solutions(robot), families[0].q
    result = result_of(problem, none, (), 'search', None, best, tuple(families))
    arcs = [arc for family in families for arc in family.intervals]
    if result.status != 'family' or not arcs:
        return result
    joints = ', '.join(dict.fromkeys(name for f in families for name in f.joints))
    reason = f'the tool stays at the target along {counted(len(arcs), "arc")}'
    if closed := sum(arc.closed for arc in arcs):
        reason += f', {closed} of them closed,'
    reason += f' inside the limits; these joints move: {joints}'
    reason += not_exact(problem.target, max(family.residual for family in families))
    return replace(result, status='solved', reason=reason, nearest=None)


def _family_of_curve(
    problem: IkProblem, curve: SolutionCurve, arcs: tuple[IkArc, ...]
) -> IkFamily:
    robot, target, plan, near, *_ = problem
    if arcs:
        arcs = tuple(_on_turns_of(near, arc, plan) for arc in arcs)
        q = _nearest(problem, arcs)
    else:
        # No posture of the curve is inside the limits, so take the posture that exceeds the limits
        # least.
        known = representatives(plan, curve.q, near)
        q = known.q[int(np.argmax(known.margin))]
    error = float(errors_at(target, plan, q[None])[0])
    motions = tangent(problem, q, plan.freedom)
    moved = np.ptp(curve.q, axis=0)[None]
    family = family_of(problem, SolutionFamily(q, error, motions, False), moved)
    return replace(family, intervals=arcs, closed=curve.closed)


def _on_turns_of(near: Floats, arc: IkArc, plan: InversePlan) -> IkArc:
    # Full turns, added to the joint positions of an arc, give shifted copies of the arc. Returns
    # the copy that passes nearest to `near` among those inside the limits.
    return min(shifted_past(arc, near, plan), key=lambda arc: _away(near, arc, plan), default=arc)


def _nearest(problem: IkProblem, arcs: Sequence[IkArc]) -> Floats:
    # Returns the posture nearest to `near` on any of the arcs. Let d be the distance from `near`
    # to the nearest sample of an arc, and b the least d of all arcs. Every posture of an arc is
    # within SAMPLE_DISTANCE / 2 of a sample, so its distance from `near` is at least d -
    # SAMPLE_DISTANCE / 2. An arc with d > b + SAMPLE_DISTANCE is skipped, because all its postures
    # are farther from `near` than b.
    near, plan = problem.near, problem.plan
    away = [_away(near, arc, plan) for arc in arcs]
    nearest = [
        arc.nearest_to(near) for arc, d in zip(arcs, away) if d <= min(away) + SAMPLE_DISTANCE
    ]
    return min(nearest, key=lambda q: float(np.linalg.norm((q - near) / plan.scales)))


def _away(near: Floats, arc: IkArc, plan: InversePlan) -> float:
    return math.sqrt(squares_of((arc.q - near) / plan.scales).min())


def redundant_family(problem: IkProblem) -> tuple[SolutionFamily | None, Floats]:
    """
    Return the family of solutions through a posture near `problem.near`, and the joint positions
    that come closest to the target.

    The posture of the family is inside the limits if possible. The family is None if the search
    finds no solution. The joint positions that come closest, shape (n,), have the least residual
    that was found inside the limits.
    """
    robot, target, plan, near, *_ = problem
    random, best, least = problem.random(), near, np.inf
    for count, bounded in (
        (START_COUNT, True),
        (REPEATED_START_COUNT, True),
        (START_COUNT, False),
    ):
        q = starts(robot, plan, random, count)
        q[0] = near
        if bounded:
            q = into_limits(robot, q, random)
            q[0] = np.clip(near, *robot.limits.T)
        arrived = refined(target, plan, q, True, plan.limits if bounded else None)
        k = int(np.argmin(arrived.errors))
        if bounded and arrived.errors[k] < least:
            best, least = arrived.q[k], arrived.errors[k]
        good = reached(target, arrived)
        if not len(good.q):
            continue
        k = int(np.argmin(np.linalg.norm((good.q - near) / plan.scales, axis=1)))
        motions = tangent(problem, good.q[k], plan.freedom)
        family = SolutionFamily(good.q[k], float(good.errors[k]), motions, False)
        slack = plan.limits + [-kernel.AT_LIMIT / 2, kernel.AT_LIMIT / 2]
        return nearer(problem, family, slack if bounded else plan.unlimited), best
    return None, best


def into_limits(robot: Robot, q: Floats, random: np.random.Generator) -> Floats:
    """
    Return joint positions (m, n), in which joints outside their limits have new random positions
    inside the limits.
    """
    low, high = robot.limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    inside = random.uniform(np.where(bounded, low, 0.0), np.where(bounded, high, 1.0), q.shape)
    outside = bounded & ((q < low) | (q > high))
    return np.asarray(np.clip(np.where(outside, inside, q), low, high))
