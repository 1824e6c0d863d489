"""
The curves of solutions of an arm with one joint more than its target asks for, from many seeds.

Seeds are the solutions of slices (one joint held, the complete solver for six joints) and of
random starts (Levenberg and Marquardt). Each is traced by numerical continuation (Allgower and
Georg) if no known curve passes it. A search proves nothing: a curve that no seed is on is missed.
"""

import numpy as np

from ... import kernel
from ...kernel import Floats
from .problem.problem import IkProblem
from .search import refined, starts
from .self_motion.branches import STEP_TO_SEED, near_crossing, null_vectors
from .self_motion.curve import SolutionCurve, point_of, traced
from .self_motion.sliced_arm import SlicedArm

# Number of slices, evenly spaced over a turn.
SLICES = 8
# Angle of the first slice, rad: not one of those at which arms of right angles are singular.
FIRST_SLICE = 0.05
# Number of random starts.
STARTS = 96
# Largest number of curves that are traced.
MOST_CURVES = 64


def curves_of(problem: IkProblem, arm: SlicedArm) -> tuple[SolutionCurve, ...]:
    """Return the curves of solutions of a target that are found, each once."""
    point = point_of(problem)
    curves: list[SolutionCurve] = []
    seeds = _seeds(problem, arm)
    # It grows: where a curve ends, others cross it.
    for q in seeds:
        if any(kernel.passes(point, curve.samples, q) for curve in curves):
            continue
        curve = traced(problem, point, q)
        if curve is not None:
            curves.append(curve)
            if not curve.closed:
                ends = [near_crossing(point, q) for q in curve.q[[0, -1]]]
                seeds += _solutions(problem, np.vstack(ends))
        if len(curves) == MOST_CURVES:
            break
    return tuple(curves)


def _seeds(problem: IkProblem, arm: SlicedArm) -> list[Floats]:
    # Solutions (n,): from `near`, random starts and slices.
    robot, target, plan, near, *_ = problem
    q = starts(robot, plan, problem.random(), STARTS)
    q[0] = near
    positions = FIRST_SLICE + 2.0 * np.pi / SLICES * np.arange(SLICES)
    slices = [arm.solutions(target.pose, position) for position in positions.tolist()]
    return _solutions(problem, np.vstack([q, *slices]))


def _solutions(problem: IkProblem, q: Floats) -> list[Floats]:
    # Solutions (n,) that joint positions (m, n) lead to.
    arrived = refined(problem.target, problem.plan, q, far=True)
    reached = zip(arrived.q, arrived.errors)
    return [q for q, error in reached if problem.target.is_reached_at(q, error)]


def is_on_surface(problem: IkProblem, point: kernel.CurvePoint, q: Floats) -> bool:
    """
    Return whether the solutions near one of them (n,) form a surface, or more.

    There the Jacobian has two null vectors or more, and steps along them lead to other such
    solutions in as many directions. If two curves cross, one of these is regular; if one curve is
    singular all along, all are on that curve.
    """
    null = null_vectors(point, q)
    if len(null) < 2:
        return False
    beside = _solutions(problem, q + STEP_TO_SEED * null)
    if len(beside) < len(null) or any(len(null_vectors(point, one)) < 2 for one in beside):
        return False
    sigma = np.linalg.svd(np.array(beside) - q, compute_uv=False)
    return bool(sigma[-1] > 0.5 * STEP_TO_SEED)
