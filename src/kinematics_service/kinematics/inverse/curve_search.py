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
from .self_motion.curve import SolutionCurve, traced
from .self_motion.sliced_arm import SlicedArm

# Number of slices, evenly spaced over a turn.
SLICES = 8
# Angle of the first slice, rad: not one of those at which arms of right angles are singular.
FIRST_SLICE = 0.05
# Number of random starts.
STARTS = 96
# A solution of a slice is real if its imaginary parts are smaller, rad or m.
REAL = 1e-7
# Largest number of curves that are traced.
MOST_CURVES = 64


def curves_of(problem: IkProblem, arm: SlicedArm) -> tuple[SolutionCurve, ...]:
    """Return the curves of solutions of a target that are found, each once."""
    point = arm.point(problem.target)
    curves: list[SolutionCurve] = []
    for psi in _seeds(problem, arm):
        if any(kernel.passes(point, curve.samples, psi) for curve in curves):
            continue
        curve = traced(point, psi, arm.turning)
        if curve is not None:
            curves.append(curve)
        if len(curves) == MOST_CURVES:
            break
    return tuple(curves)


def _seeds(problem: IkProblem, arm: SlicedArm) -> list[Floats]:
    # Solutions in positions of the screws (n,): of `near`, of slices, of random starts.
    robot, target, plan, near, *_ = problem
    q = starts(robot, plan, problem.random(), STARTS)
    q[0] = near
    arrived = refined(target, plan, q, far=True)
    reached = zip(arrived.q, arrived.errors)
    seeds = [
        arm.posture(robot, target, q) for q, error in reached if target.is_reached_at(q, error)
    ]
    if arm.slices is not None:
        for position in FIRST_SLICE + 2.0 * np.pi / SLICES * np.arange(SLICES):
            found = arm.solutions(arm.slices, target, position)
            real = np.max(np.abs(found[:, :, 1]), axis=1) < REAL
            seeds += list(np.ascontiguousarray(found[real, :, 0]))
    return seeds
