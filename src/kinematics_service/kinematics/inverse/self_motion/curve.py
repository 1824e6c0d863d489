"""
A curve of solutions of an arm with one joint more than its target asks for, as it is traced.

Numerical continuation (Allgower and Georg; `kernel.trace`) gives samples; between them Newton's
method gives the solutions (`kernel.CurvePath`).
"""

import math

import numpy as np

from .... import kernel
from ....kernel import Floats
from ..problem.problem import IkProblem
from ..problem.target import TOOL_AXES

# Most samples of a curve, six times those of the longest seen: where lengths are far apart, or
# where all postures are singular, a curve has no end.
MOST = 1 << 12
# The period of a joint that has none, rad or m: farther than a joint moves.
NO_PERIOD = 1e12


class SolutionCurve:
    """
    A curve of solutions.

    A closed one goes on beyond its last sample: its places are counted on, lap after lap.

    Parameters
    ----------
    problem, point
        Whose arm, plan and target they are.
    samples : shape (m, 2 n), rad or m
        Joint positions, and the unit tangents there. The last sample of a closed curve is the
        first one, full turns added.
    closed
        Whether it closes; otherwise it ends at singular poses.

    Attributes
    ----------
    q : shape (m, n), rad or m
        The joint positions of the samples.
    last
        The place of the last sample.
    lap : shape (n,), rad or m
        How the joints of a closed curve have moved after a lap.
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
        """Return joint positions (m, n) at places (m,) of the curve."""
        laps = np.floor(places / self.last) * self.closed
        q = np.empty((len(places), self.point.n))
        kernel.write_places(self.path, places - laps * self.last, q)
        return np.asarray(q + laps[:, None] * self.lap)

    def nearest(self, begin: float, end: float, q: Floats) -> float:
        """Return the place nearest to joint positions (n,) between two next to each other."""
        laps = math.floor(0.5 * (begin + end) / self.last) * self.closed
        goal, before = np.array([q - laps * self.lap, self.plan.scales**-2]), laps * self.last
        return before + kernel.nearest_place(self.path, goal, begin - before, end - before)


def point_of(problem: IkProblem) -> kernel.CurvePoint:
    """Return room for the solutions of a target that asks for one joint less than the arm has."""
    robot, target, plan, *_ = problem
    residual = target.residual
    if target.axis:
        # In axes of the target the turn about the tool's axis is a row, which does not count.
        k = TOOL_AXES.index(target.axis)
        weights = np.array([1.0] * 3 + [robot.singularity.task.length] * 3)
        weights[3 + k] = 0.0
        axes = target.pose[:3, :3].copy()
        residual = kernel.Residual(robot.chain, target.pose, axes, weights, k, plan.reach.radius)
    periods = np.where(np.isfinite(plan.periods), plan.periods, NO_PERIOD)
    return kernel.CurvePoint(residual, periods)


def traced(problem: IkProblem, point: kernel.CurvePoint, start: Floats) -> SolutionCurve | None:
    """Return the curve through a solution (n,), or None if that is singular."""
    n, samples = len(start), np.empty((2, MOST, 2 * len(start)))
    samples[:, 0, :n] = start
    count = kernel.trace(point, 1.0, samples[0])
    if count < 0:
        return SolutionCurve(problem, point, samples[0, :-count].copy(), True)
    behind = kernel.trace(point, -1.0, samples[1])
    # Backwards: the tangents point the other way.
    rows = samples[1, : abs(behind)][::-1] * np.repeat([1.0, -1.0], n)
    if behind < 0:
        # Near a singular pose it may be followed all round in one direction alone.
        return SolutionCurve(problem, point, rows, True)
    both = np.vstack([rows[:-1], samples[0, :count]])
    return SolutionCurve(problem, point, both, False) if len(both) > 1 else None
