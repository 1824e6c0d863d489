# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the best posture of an arm with one redundant joint.

The solutions through the present posture form an arc. The best posture is the point of the arc
that is farthest from the joint limits (criterion `margin`) or from singular poses (criterion
`clearance`).
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ....kernel import Floats, Integers
from ....robot.robot import Robot
from ...clearance import clearances
from ..problem.plan import InversePlan, plan_for
from ..problem.problem import IkProblem
from ..problem.target import IkTarget
from .arcs import IkArc, squares_of
from .curve import point_of, traced
from .cut import arcs_of
from .sliced_arm import sliced_arm_of

Cost = Callable[[Floats], Floats]

# Largest distance between samples of an arc, rad (prismatic motions divided by the characteristic
# length).
SAMPLE_DISTANCE = 0.2
# A posture is on an arc if its distance from the arc is less than this, rad.
ON_ARC = 1e-6
# The clearance is first computed at about this number of samples, spread evenly over the arc. Each
# computation takes 0.1 ms.
CLEARANCE_SAMPLES = 48
# Each rad of distance from the present posture reduces the margin or clearance of a posture by
# this, rad. Without this cost the result would jump between equally good postures.
COST_OF_DISTANCE = 1e-3
# Number of corrections of the length of a step along an arc. Without correction a step may be too
# long by 0.1 %. Each correction divides the error by 1000, so three corrections leave about 1e-12.
CORRECTIONS = 3


class BestPosture(NamedTuple):
    """
    The result of one step along an arc toward the best posture.

    Attributes
    ----------
    q : shape (n,), rad or m
        The posture at the end of the step; the best posture if `left` is 0.
    arc
        The arc. Full turns are added to its joint positions, so that it passes through the posture
        at which the step begins.
    left : rad
        Distance along the arc from `q` to the best posture.
    """

    q: Floats
    arc: IkArc
    left: float


def _of_largest_clearance(arc: IkArc, robot: Robot, away: Cost) -> float:
    # Returns the length along the arc at the sample with the largest clearance. Evaluates about
    # CLEARANCE_SAMPLES samples of the arc, and then all samples near the best of these samples.
    costs = COST_OF_DISTANCE * away(arc.q)

    def best(places: Integers) -> int:
        values = clearances(robot, np.array(arc.q[places])) - costs[places]
        return int(places[np.argmax(values)])

    step, last = 1 + len(arc.q) // CLEARANCE_SAMPLES, len(arc.q) - 1
    k = best(np.arange(0, last + 1, step))
    return float(arc.s[best(np.arange(max(k - step, 0), min(k + step, last) + 1))])


def _of_largest_margin(arc: IkArc, robot: Robot, away: Cost) -> float:
    return arc.place_of_least(lambda q: COST_OF_DISTANCE * away(q) - arc.margin(q))


# For each criterion of `best_posture`, the function that returns the best posture of an arc, as
# length (rad) along the arc.
CRITERIA = {'clearance': _of_largest_clearance, 'margin': _of_largest_margin}


def best_posture(
    robot: Robot, target: IkTarget, q: Floats, criterion: str, farthest: float
) -> BestPosture | None:
    """
    Return the best posture on the arc of solutions through q. If it is farther from q than
    `farthest`, return the posture on the way to it at the distance `farthest` from q.

    Returns None if q is singular or not a solution, or if the arm does not have exactly one
    redundant joint.

    Parameters
    ----------
    q : shape (n,), rad or m
        Joint positions inside the limits, with the tool at the target.
    criterion
        One of `CRITERIA`.
    farthest : rad
        Largest distance along the arc from `q`.
    """
    place = place_on_arc(robot, target, q)
    if place is None:
        return None
    arc, start = place
    distance = CRITERIA[criterion](arc, robot, _away_from(q, arc.scales)) - start
    if arc.closed:
        distance -= arc.length * round(distance / arc.length)
    step = min(max(distance, -farthest), farthest)
    if step != distance:
        # Shorten the step to at most `farthest` in several corrections, because lengths along an
        # arc have errors of 0.1 % between samples.
        for _ in range(CORRECTIONS):
            far = float(np.linalg.norm((arc.at(start + step) - q) / arc.scales))
            step *= min(1.0, farthest / far) if far > 0.0 else 1.0
    return BestPosture(arc.at(start + step), arc, abs(distance - step))


def has_arcs(robot: Robot, rows: tuple[str, ...], axis: str) -> bool:
    """
    Return whether an arm has exactly one redundant joint for targets that prescribe the pose
    components `rows` and the direction of the tool axis `axis`.
    """
    return sliced_arm_of(robot, rows, axis) is not None


class ArcPlace(NamedTuple):
    """An arc inside the limits, and a place on it: the length (rad) from the arc's beginning."""

    arc: IkArc
    s: float


def place_on_arc(robot: Robot, target: IkTarget, q: Floats) -> ArcPlace | None:
    """
    Return the arc through joint positions q (n,) and the place of q on the arc, or None.

    Returns None if q is singular or not a solution, or if the arm does not have exactly one
    redundant joint.
    """
    if not has_arcs(robot, target.rows, target.axis):
        return None
    plan = plan_for(robot, target.rows, target.axis)
    problem = IkProblem(robot, target, plan, q, 0)
    curve = traced(problem, point_of(problem), q)
    if curve is None:
        return None
    distance = _away_from(q, plan.scales)
    for arc in arcs_of(curve):
        for moved in shifted_past(arc, q, plan):
            s = moved.place_of_least(distance)
            if distance(moved.at(s)) < ON_ARC:
                return ArcPlace(moved, s)
    return None


def shifted_past(arc: IkArc, q: Floats, plan: InversePlan) -> Iterator[IkArc]:
    """
    Yield copies of an arc, shifted by full turns, that are inside the limits and pass near q (n,).

    If the arc ends at a limit of a joint, this joint is not shifted, because a shifted arc would
    end at another place.
    """
    turns = np.round((q - arc.q) / plan.periods)
    periods = np.where(np.isfinite(plan.periods), plan.periods, 0.0)
    near = squares_of((q - arc.q - turns * periods) / plan.scales) < SAMPLE_DISTANCE**2
    ending = [arc.curve.robot.joint_names.index(end.joint) for end in arc.ends if end.joint]
    for shift in sorted(set(map(tuple, turns[near].tolist()))):
        moved = arc.shifted_by(np.array(shift) * periods)
        if not any(shift[j] for j in ending) and moved.margins().min() > -ON_ARC:
            yield moved


def _away_from(q: Floats, scales: Floats) -> Cost:
    return lambda posture: np.linalg.norm((posture - q) / scales, axis=-1)
