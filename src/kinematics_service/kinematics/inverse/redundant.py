"""
Arms with more joints than the target has rows: a continuum for every target.

With one joint more it is curves, which are searched for; otherwise one pose of it is found.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .answer import family_of, not_exact, representatives, result_of
from .curve_search import curves_of, is_on_surface
from .families import SolutionFamily, nearer, tangent
from .problem.plan import InversePlan
from .problem.problem import IkProblem
from .result import IkFamily, IkResult
from .search import LeastError, errors_at, no_solutions, refined, starts
from .self_motion.arcs import IkArc, squares_of
from .self_motion.best_posture import ON_ARC, SAMPLE_DISTANCE, shifted_past
from .self_motion.curve import SolutionCurve
from .self_motion.cut import arcs_of
from .self_motion.sliced_arm import sliced_arm_of

# Number of starts inside the limits, at first and if those fail.
FEW, MANY = 24, 240


def redundant_result(problem: IkProblem, respect_limits: bool) -> IkResult:
    """Return the result of a redundant arm: the curves that were found, or one pose."""
    robot, target, *_ = problem
    arm = sliced_arm_of(robot, target.rows, target.axis) if problem.curves else None
    curves = () if arm is None else curves_of(problem, arm)
    if curves:
        return _of_curves(problem, curves, respect_limits)
    family, best = redundant_family(problem)
    alone = () if family is None else (family,)
    result = result_of(problem, no_solutions(robot), alone, 'search', best, respect_limits)
    return replace(result, complete='partial') if alone else result


def _near_alone(
    problem: IkProblem, curves: Sequence[SolutionCurve], families: list[IkFamily]
) -> list[IkFamily]:
    # `near`, if it is a solution inside the limits that is on no arc, or a singular one that is on
    # no curve, since none can be traced from it.
    robot, target, plan, near, *_ = problem
    error = float(errors_at(target, plan, near[None])[0])
    if not target.is_reached_at(near, error):
        return []
    motions = tangent(problem, near, plan.freedom)
    alone = family_of(problem, SolutionFamily(near, error, motions, False))
    if alone.feasible:
        inside = (one.q for one in families if one.feasible)
        on_arc = any(np.linalg.norm((q - near) / plan.scales) < ON_ARC for q in inside)
        return [] if on_arc else [alone]
    return [] if any(kernel.passes(one.point, one.samples, near) for one in curves) else [alone]


def _of_curves(
    problem: IkProblem,
    curves: Sequence[SolutionCurve],
    respect_limits: bool,
) -> IkResult:
    robot, plan = problem.robot, problem.plan
    with_arcs = [(curve, arcs_of(curve)) for curve in curves]
    if respect_limits and any(arcs for _, arcs in with_arcs):
        with_arcs = [(curve, arcs) for curve, arcs in with_arcs if arcs]
    families = [_family_of_curve(problem, curve, arcs) for curve, arcs in with_arcs]
    families += _near_alone(problem, curves, families)
    families.sort(key=lambda one: float(np.linalg.norm((one.q - problem.near) / plan.scales)))
    ordered = tuple(families)
    best = LeastError(ordered[0].q, ordered[0].residual)
    none = no_solutions(robot)
    result = result_of(problem, none, (), 'search', best, respect_limits, None, ordered)
    arcs = [arc for family in families for arc in family.intervals]
    surfaces = _surfaces(problem, curves[0].point, families)
    if result.status != 'family' or not arcs:
        return replace(result, reason=result.reason + surfaces)
    joints = ', '.join(dict.fromkeys(name for f in families for name in f.joints))
    reason = (
        f'the tool stays at the target along {len(arcs)} {"arc" if len(arcs) == 1 else "arcs"}'
    )
    if closed := sum(arc.closed for arc in arcs):
        reason += f', {closed} of them closed,'
    reason += f' inside the limits; these joints move: {joints}'
    reason += surfaces
    reason += not_exact(problem.target, max(family.residual for family in families))
    return replace(result, status='solved', reason=reason, nearest=None)


def _surfaces(problem: IkProblem, point: kernel.CurvePoint, families: list[IkFamily]) -> str:
    # What is said of families on surfaces. No curve on a surface closes, but by chance.
    count = sum(not one.closed and is_on_surface(problem, point, one.q) for one in families)
    if not count:
        return ''
    one = 'family' if count == 1 else 'families'
    return (
        f'; at {count} {one} the null space has two dimensions or more throughout: the postures '
        'form a surface there, and the search does not follow it'
    )


def _family_of_curve(
    problem: IkProblem, curve: SolutionCurve, arcs: tuple[IkArc, ...]
) -> IkFamily:
    robot, target, plan, near, *_ = problem
    if arcs:
        arcs = tuple(_on_turns_of(near, arc, plan) for arc in arcs)
        q = _nearest(problem, arcs)
    else:
        # The pose of it that is beyond the limits by least.
        known = representatives(robot, plan, curve.q, near)
        q = known.q[int(np.argmax(known.margin))]
    error = float(errors_at(target, plan, q[None])[0])
    motions = tangent(problem, q, plan.freedom)
    moved = np.ptp(curve.q, axis=0)[None]
    family = family_of(problem, SolutionFamily(q, error, motions, False), moved)
    return replace(family, intervals=arcs, closed=curve.closed)


def _on_turns_of(near: Floats, arc: IkArc, plan: InversePlan) -> IkArc:
    # The arc on those full turns inside the limits that lead it nearest past `near`.
    return min(shifted_past(arc, near, plan), key=lambda one: _away(near, one, plan), default=arc)


def _nearest(problem: IkProblem, arcs: Sequence[IkArc]) -> Floats:
    # The nearest posture is at most half a step from the nearest sample.
    near, plan = problem.near, problem.plan
    away = [_away(near, arc, plan) for arc in arcs]
    nearest = [
        arc.nearest_to(near) for arc, way in zip(arcs, away) if way <= min(away) + SAMPLE_DISTANCE
    ]
    return min(nearest, key=lambda q: float(np.linalg.norm((q - near) / plan.scales)))


def _away(near: Floats, arc: IkArc, plan: InversePlan) -> float:
    return math.sqrt(squares_of((arc.q - near) / plan.scales).min())


def redundant_family(problem: IkProblem) -> tuple[SolutionFamily | None, LeastError]:
    """Return the family of a target at a pose near `near`, inside the limits if any is."""
    robot, target, plan, near, *_ = problem
    random = problem.random()
    limits = np.array(robot.limits)
    best = LeastError(near, np.inf)
    for count, bounded in ((FEW, True), (MANY, True), (FEW, False)):
        q = starts(robot, plan, random, count)
        q[0] = near
        if bounded:
            q = into_limits(robot, q, random)
            q[0] = np.clip(near, *robot.limits.T)
        arrived = refined(target, plan, q, True, limits if bounded else None)
        k = int(np.argmin(arrived.errors))
        if bounded and arrived.errors[k] < best.error:
            best = LeastError(arrived.q[k], float(arrived.errors[k]))
        arrivals = enumerate(zip(arrived.q, arrived.errors))
        good = [k for k, (one, error) in arrivals if target.is_reached_at(one, error)]
        if not good:
            continue
        distance = np.linalg.norm((arrived.q[good] - near) / plan.scales, axis=1)
        one = good[int(np.argmin(distance))]
        q_one = arrived.q[one]
        motions = tangent(problem, q_one, plan.freedom)
        family = SolutionFamily(q_one, float(arrived.errors[one]), motions, False)
        slack = limits + [-kernel.AT_LIMIT / 2, kernel.AT_LIMIT / 2]
        open_limits = slack if bounded else np.full_like(slack, np.inf) * [-1.0, 1.0]
        return nearer(problem, family, open_limits), best
    return None, best


def into_limits(robot: Robot, q: Floats, random: np.random.Generator) -> Floats:
    """
    Return starts (m, n) on full turns, those outside narrower limits drawn again inside them.
    """
    low, high = robot.limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    inside = random.uniform(np.where(bounded, low, 0.0), np.where(bounded, high, 1.0), q.shape)
    outside = bounded & ((q < low) | (q > high))
    return np.asarray(np.clip(np.where(outside, inside, q), low, high))
