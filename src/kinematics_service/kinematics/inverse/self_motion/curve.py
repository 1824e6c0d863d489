# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Trace a curve of inverse kinematics solutions of an arm with one redundant joint, by numerical
continuation.

Continuation (Allgower and Georg; `kernel.trace`) gives samples of the curve. Newton's method gives
the solutions between samples (`kernel.CurvePath`).
"""

import math

import numpy as np

from .... import kernel
from ....kernel import Floats
from ..problem.problem import IkProblem
from ..problem.target import TOOL_AXES

# Largest number of samples of a solution curve. The longest curve in experiments had a sixth of
# this number. Without a largest number, the tracing of a curve might not end if the lengths of an
# arm's links are very different, or if all its postures are singular.
MAX_SAMPLES = 1 << 12
# Number that replaces the period of a joint without a period, rad or m. The number is larger than
# any motion of a joint.
NO_PERIOD = 1e12


class SolutionCurve:
    """
    A curve of joint positions along which the tool stays at the target.

    A place on the curve is the index of a sample, or a fraction between two indices, such as 2.5.
    On a closed curve places continue beyond the last sample, lap after lap.

    Parameters
    ----------
    problem
        The arm, its target, and the plan (the method that solves its inverse kinematics).
    point
        The equations of the target, as an object of the kernel (see `point_of`).
    samples : shape (m, 2 n), rad or m
        Joint positions, and the unit tangents of the curve. The last sample of a closed curve is
        the first sample with full turns added.
    closed
        Whether the curve is closed; otherwise it ends at singular poses.

    Attributes
    ----------
    q : shape (m, n), rad or m
        The joint positions of the samples.
    last
        The place of the last sample.
    lap : shape (n,), rad or m
        Motion of the joints in one lap of a closed curve.
    """

    def __init__(
        self, problem: IkProblem, point: kernel.CurvePoint, samples: Floats, closed: bool
    ) -> None:
        self.robot, _, self.plan, *_ = problem
        self.point, self.samples, self.closed = point, samples, closed
        self.path = kernel.CurvePath(point, samples)
        self.q, self.last = samples[:, : point.n], len(samples) - 1
        self.lap = self.q[-1] - self.q[0]

    def at(self, places: Floats) -> Floats:
        """
        Return the joint positions (m, n) at `places` (m,). Place 2.5, for example, is between
        samples 2 and 3 of the curve.
        """
        laps = np.floor(places / self.last) * self.closed
        q = np.empty((len(places), self.point.n))
        kernel.write_places(self.path, places - laps * self.last, q)
        return np.asarray(q + laps[:, None] * self.lap)

    def nearest(self, begin: float, end: float, q: Floats) -> float:
        """
        Return the place of the curve, between `begin` and `end`, that is nearest to joint
        positions q (n,).
        """
        laps = math.floor(0.5 * (begin + end) / self.last) * self.closed
        goal, before = np.array([q - laps * self.lap, self.plan.scales**-2]), laps * self.last
        return before + kernel.nearest_place(self.path, goal, begin - before, end - before)


def point_of(problem: IkProblem) -> kernel.CurvePoint:
    """Return the kernel's `CurvePoint` for the target of an arm with one redundant joint."""
    robot, target, plan, *_ = problem
    residual = target.residual
    if target.axis:
        # Express the tool's error in the axes of the target, so that the turn about the tool's
        # axis is one row. The target does not fix this turn, so the weight of the row is 0.
        k = TOOL_AXES.index(target.axis)
        weights = np.array([1.0] * 3 + [robot.singularity.task.length] * 3)
        weights[3 + k] = 0.0
        axes = target.pose[:3, :3].copy()
        residual = kernel.Residual(robot.chain, target.pose, axes, weights, k, plan.reach.radius)
    periods = np.where(np.isfinite(plan.periods), plan.periods, NO_PERIOD)
    return kernel.CurvePoint(residual, periods)


def traced(problem: IkProblem, point: kernel.CurvePoint, start: Floats) -> SolutionCurve | None:
    """
    Return the solution curve through the solution `start` (n,), or None if `start` is singular.
    """
    n, samples = len(start), np.empty((2, MAX_SAMPLES, 2 * len(start)))
    samples[:, 0, :n] = start
    count = kernel.trace(point, 1.0, samples[0])
    if count < 0:
        return SolutionCurve(problem, point, samples[0, :-count].copy(), True)
    behind = kernel.trace(point, -1.0, samples[1])
    # The curve is traced from `start` in both directions. Reverse the order of the samples of the
    # second direction and the signs of their tangents, so that all samples follow the first
    # direction.
    rows = samples[1, : abs(behind)][::-1] * np.repeat([1.0, -1.0], n)
    if behind < 0:
        # The tracing in the second direction came back to `start`, so the curve is closed. The
        # tracing in the first direction stopped earlier, which may happen near a singular pose.
        return SolutionCurve(problem, point, rows, True)
    both = np.vstack([rows[:-1], samples[0, :count]])
    return SolutionCurve(problem, point, both, False) if len(both) > 1 else None
