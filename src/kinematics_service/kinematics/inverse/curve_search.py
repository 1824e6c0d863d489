# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the solution curves of an arm with one redundant joint, by continuation from many start
solutions.

The start solutions, called seeds, come from slices and from random starts. In a slice, one joint
is held at a fixed position, and all solutions of the other six joints are computed. Random starts
are refined by the method of Levenberg and Marquardt. A seed that is on no known curve is traced by
numerical continuation (Allgower and Georg). The search proves nothing: if no seed is on a curve,
the search misses this curve.
"""

import numpy as np

from ... import kernel
from ...kernel import Floats
from .problem.problem import IkProblem
from .search import refined, starts
from .self_motion.curve import SolutionCurve, point_of, traced
from .self_motion.sliced_arm import SlicedArm

# Number of slices. All slices hold the same joint of the arm, each slice at a different position,
# and solve the other joints. The positions are evenly spaced over a turn.
SLICES = 8
# A slice holds one joint of the arm at a fixed angle, and solves the other joints. This is the
# angle in the first slice, rad. It is not 0, because arms with right angles are singular at
# multiples of 90 degrees.
FIRST_SLICE = 0.05
# Number of random joint positions from which the curve search begins. Levenberg-Marquardt moves
# each of them to a solution, and a curve is traced from the solution.
STARTS = 96
# Step of the central differences that differentiate J by the joint positions, rad or m. The step
# is about the cube root of machine epsilon.
DIFFERENCE = 1e-5
# Solution curves may cross. Length of the step from the crossing to a solution on one of the
# curves, rad. The solution then is a start for tracing that curve. The length is half of the first
# step with which a curve is traced.
STEP_TO_SEED = 0.01
# Largest number of solution curves that are traced.
MAX_CURVES = 64


def curves_of(problem: IkProblem, arm: SlicedArm) -> tuple[SolutionCurve, ...]:
    """Search the solution curves of a target, and return each curve once."""
    point = point_of(problem)
    curves: list[SolutionCurve] = []
    seeds = _seeds(problem, arm)
    # Trace a curve from each start solution in `seeds`. A curve may end where it crosses other
    # curves, so add start solutions near its ends to the list.
    for q in seeds:
        if any(kernel.passes(point, curve.samples, q) for curve in curves):
            continue
        curve = traced(problem, point, q)
        if curve is not None:
            curves.append(curve)
            if not curve.closed:
                ends = [_near_crossing(point, q) for q in curve.q[[0, -1]]]
                seeds += _solutions(problem, np.vstack(ends))
        if len(curves) == MAX_CURVES:
            break
    return tuple(curves)


def _seeds(problem: IkProblem, arm: SlicedArm) -> list[Floats]:
    # Returns solutions of inverse kinematics (n,) found from `near`, from random starts and from
    # slices.
    robot, target, plan, near, *_ = problem
    q = starts(robot, plan, problem.random(), STARTS)
    q[0] = near
    positions = FIRST_SLICE + 2.0 * np.pi / SLICES * np.arange(SLICES)
    slices = [arm.solutions(target.pose, position) for position in positions.tolist()]
    return _solutions(problem, np.vstack([q, *slices]))


def _solutions(problem: IkProblem, q: Floats) -> list[Floats]:
    # Returns the solutions (n,) to which Levenberg-Marquardt converges from joint positions q (m,
    # n).
    arrived = refined(problem.target, problem.plan, q, far=True)
    reached = zip(arrived.q, arrived.errors)
    return [q for q, error in reached if problem.target.is_reached_at(q, error)]


def _near_crossing(point: kernel.CurvePoint, q: Floats) -> Floats:
    # Returns joint positions (m, n) near the curves that cross at a singular solution (n,), by
    # branch switching (Allgower and Georg, sections 8.1 and 8.3). J is the derivative of the
    # target's equations by the joint positions, and J' is the derivative of J. At a simple
    # bifurcation point J has two null vectors, the rows of the matrix N, and one left null vector
    # e. Each curve has the tangent t = a N, with a vector a of two numbers that solves the
    # equation a N (e . J') N^T a^T = 0.
    e_left, _, null = np.linalg.svd(_jacobian(point, q))
    e, N = e_left[:, -1], null[-2:]
    ahead = [_jacobian(point, q + DIFFERENCE * direction) for direction in N]
    behind = [_jacobian(point, q - DIFFERENCE * direction) for direction in N]
    form = np.array([e @ (a - b) @ N.T for a, b in zip(ahead, behind)])
    # Solve a F a^T = 0 for the vector a, where F is the matrix `form`. Let a_1 and a_2 be the
    # components of a along the eigenvectors of F. The equation then is a_1^2 low + a_2^2 high = 0,
    # with the eigenvalues low and high of F. It has real solutions if low < 0 < high.
    (low, high), axes = np.linalg.eigh(0.5 * (form + form.T))
    if not low < 0.0 < high:
        return np.empty((0, len(q)))
    root = np.sqrt([high, -low]) / np.sqrt(high - low)
    tangents = [(axes @ (root * signs)) @ N for signs in ((1.0, 1.0), (1.0, -1.0))]
    return q + STEP_TO_SEED * np.array([*tangents, *(-tangent for tangent in tangents)])


def _jacobian(point: kernel.CurvePoint, q: Floats) -> Floats:
    J = np.empty((len(q) - 1, len(q)))
    kernel.write_derivative(point, np.ascontiguousarray(q), J)
    return J
