# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Prove or refute the claim that a plan keeps at least a given distance from singular poses.

The clearance of joint positions q is a lower bound of the distance, in joint space, from q to the
nearest singular pose. If the joints move by d, this distance changes by at most d. So in an
interval of time, `distance >= clearance - d`. Here `clearance` is the clearance at the middle of
the interval, and d is the largest joint motion from the middle. Bisection makes the intervals
shorter. If `clearance - d` is at least the given distance in all intervals, the claim is proved.
If the distance from a pose of the plan to a singular pose is found to be less, the claim is
refuted. Otherwise the claim is not decided.
"""

import math

import numpy as np

from ....kernel import Floats
from ....kinematics.clearance import clearances
from ....kinematics.singularity import singularity
from ....robot.clearance_bounds import moving_joints
from ....robot.robot import Robot
from .bisection import Bounded, Extreme, bracketed, verdict_of
from .polynomials import Pieces, PolynomialMotion, moment_at
from .verdicts import PlanSingularity

# Bisection does not halve a time interval if the clearance at the interval's middle is at most
# `threshold`, and the joints move from the middle by less than MIN_SPAN_RATIO * threshold. Here
# the clearance is a proved lower bound of the distance to singular poses, and `threshold` is the
# least allowed distance.
MIN_SPAN_RATIO = 0.05
# The round-off (rad) of joint positions along the plan is at most ROUND_OFF + RELATIVE_ROUND_OFF *
# total. Here `total` is the largest sum of the absolute coefficients of a joint's polynomial.
ROUND_OFF = 1e-9
# 45 machine epsilons, see ROUND_OFF.
RELATIVE_ROUND_OFF = 1e-14
# Bisection begins with the S segments of a plan as intervals of time. It makes at most
# MAX_CLEARANCES + MAX_CLEARANCES_OF_SEGMENT * S intervals by halving. For each interval it
# computes one clearance: a proved lower bound of the distance to singular poses.
MAX_CLEARANCES = 5_000
# For a plan of S segments, bisection makes at most MAX_CLEARANCES + MAX_CLEARANCES_OF_SEGMENT * S
# intervals of time by halving.
MAX_CLEARANCES_OF_SEGMENT = 20
# Bisection raises the proved lower bound of the distance from the plan to singular poses. The
# lower bound cannot exceed `least_clearance`, the least clearance of all poses at which the
# clearance was computed. Bisection stops when
# `lower_bound >= max(threshold, BOUND_RATIO * least_clearance)`.
BOUND_RATIO = 0.95
# Number of sampled moments in each search for the moment of least distance to singular poses. The
# searches follow after the bisection.
REFINEMENT_SAMPLES = 17
# Number of searches for the moment of least distance. Each covers a shorter time, around the best
# moment of the search before.
REFINEMENTS = 4


def singularity_of_plan(
    robot: Robot, motion: PolynomialMotion, threshold: float
) -> PlanSingularity:
    """Return whether a motion comes within a threshold (rad) of a singular pose."""
    distance = _Distance(robot, motion, threshold)
    budget = MAX_CLEARANCES + MAX_CLEARANCES_OF_SEGMENT * len(motion.begins)
    bracket = bracketed(motion, distance.negative, distance.enough, budget)
    verdict = verdict_of(bracket.seen.value, bracket.bound.value, -threshold)
    refuted = verdict == 'refuted'
    least = bracket.seen if refuted else bracket.bound._replace(value=bracket.seen.value)
    least = distance.least_around(least)
    at = least if refuted else bracket.bound
    moment = moment_at(motion, at.segment, at.s)
    return PlanSingularity(
        verdict,
        threshold,
        0.0 if refuted else max(-bracket.bound.value, 0.0),
        -least.value,
        moment,
        singularity(robot, moment.q).nearest_singular,
        () if refuted else _times(motion, bracket.pieces.chosen(bracket.upper > -threshold)),
        distance.evaluations,
    )


class _Distance:
    """
    The distance to singular poses along a motion, with bounds from above and below.

    Attributes
    ----------
    evaluations
        Number of clearances computed so far. A clearance is a radius around a pose within which it
        is proved that no pose is singular.
    """

    def __init__(self, robot: Robot, motion: PolynomialMotion, threshold: float) -> None:
        self._robot, self._motion, self._threshold = robot, motion, threshold
        # Joints that can change the rank of the Jacobian. The motion of all other joints does not
        # change the distance to singular poses.
        self._moving = moving_joints(robot.chain, robot.singularity.task)
        size = np.max(np.sum(np.abs(motion.coefficients), axis=1))
        self._round_off = ROUND_OFF + RELATIVE_ROUND_OFF * float(size)
        self._least_clearance = math.inf
        self.evaluations = 0

    def negative(self, pieces: Pieces) -> Bounded:
        """
        Return -distance at the middle of each piece, and an upper bound of -distance in each
        piece. A piece is an interval of time, and `distance` is the distance to the nearest
        singular pose. The sign is negative because `bracketed` searches for a largest value.

        The search for the nearest singular pose is slow. If the clearance, a lower bound of
        `distance`, exceeds the threshold, no search is done, and -inf is returned as -distance. At
        the begin of each segment the search is always done.
        """
        q = self._motion.positions(pieces.segment, pieces.middle)
        # Pieces of length 0 are ends of segments. They need no clearance, because the longer
        # pieces cover the whole plan.
        inside, clearance = pieces.half > 0.0, np.full(len(q), np.inf)
        clearance[inside] = np.maximum(clearances(self._robot, q[inside]) - self._round_off, 0.0)
        self.evaluations += int(np.sum(inside))
        self._least_clearance = min(self._least_clearance, float(np.min(clearance)))
        near = clearance <= self._threshold
        value, searched = np.full(len(q), -np.inf), near | (pieces.middle == 0.0)
        value[searched] = -self.to_nearest(q[searched])
        scaled = self._motion.taylor(pieces) / self._robot.singularity.task.column_scales
        span = _span(scaled[:, :, self._moving], pieces.half)
        return Bounded(value, span - clearance, near & (span < MIN_SPAN_RATIO * self._threshold))

    def enough(self, seen: float) -> float:
        """
        Return the limit of -distance: bisection halves an interval of time only if the upper bound
        of -distance in the interval exceeds this limit.

        Here `distance` is the distance to the nearest singular pose. `seen` is the largest value
        of -distance found so far. If `-seen` is less than the threshold, the plan is refuted. Then
        the limit is infinite, so that no interval is halved.
        """
        if -seen < self._threshold:
            return math.inf
        return -max(self._threshold, BOUND_RATIO * self._least_clearance)

    def to_nearest(self, q: Floats) -> Floats:
        """
        Return the distances (N,), rad, from joint positions (N, n) to the nearest singular pose
        that the search finds; inf if it finds none.
        """
        away = (singularity(self._robot, q).nearest_singular - q) / (
            self._robot.singularity.task.column_scales
        )
        return np.where(np.isnan(away[:, 0]), np.inf, np.linalg.norm(away, axis=1))

    def least_around(self, seen: Extreme) -> Extreme:
        """
        Return the moment of least distance to singular poses near the moment `seen`, by sampling
        in shorter and shorter intervals of time.
        """
        count, width = len(self._motion.begins), 1.0
        for _ in range(REFINEMENTS):
            x = seen.segment + seen.s
            places = np.clip(np.linspace(x - width, x + width, REFINEMENT_SAMPLES), 0.0, count)
            segment, s = self._motion.place(places)
            away = self.to_nearest(self._motion.positions(segment, s))
            k = int(np.argmin(away))
            if -away[k] > seen.value:
                seen = Extreme(-float(away[k]), int(segment[k]), float(s[k]))
            width *= 2.0 / (REFINEMENT_SAMPLES - 1)
        return seen


def _span(taylor: Floats, reach: Floats) -> Floats:
    # Returns bounds (N,) of the joint motion (norm) in N intervals of time: from the middle of the
    # interval to any other moment in the interval. `taylor` has the Taylor coefficients of the
    # joint positions about the middles. `reach` (N,) is half the length of each interval, divided
    # by the duration of the segment in which the interval lies.
    powers = reach[:, None] ** np.arange(1, taylor.shape[1])
    bounds = np.sum(np.abs(taylor[:, 1:]) * powers[:, :, None], axis=1)
    return np.asarray(np.linalg.norm(bounds, axis=1))


def _times(motion: PolynomialMotion, pieces: Pieces) -> tuple[tuple[float, float], ...]:
    # Returns the times (begin, end) that pieces cover, s; adjacent pieces are merged.
    begins = motion.times(pieces.segment, pieces.middle - pieces.half)
    ends = motion.times(pieces.segment, pieces.middle + pieces.half)
    merged: list[tuple[float, float]] = []
    for k in np.argsort(begins, kind='stable').tolist():
        begin, end = float(begins[k]), float(ends[k])
        if merged and begin <= merged[-1][1] + 1e-9 * max(1.0, abs(begin)):
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return tuple(merged)
