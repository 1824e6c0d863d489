# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve the inverse kinematics of general arms of six joints by elimination (Raghavan and Roth 1993).

The largest possible number of complex solutions is known. If this number of solutions is found,
the real solutions are proved complete.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...rigid_motion import exponential, inverse
from .closed_forms import room_for
from .problem.plan import IMAGINARY_TOLERANCE
from .problem.problem import IkProblem
from .problem.screws import Screws, screws_of
from .problem.target import residual_of
from .search import BATCH, DistinctSolutions, distinct, refined, refinement, starts

# A target is degenerate if several of its solutions coincide, or if all determinants of the
# elimination vanish. Then targets beside it are solved instead. Each number of BESIDE is the size
# of the displacement from the degenerate target: a translation, relative to the characteristic
# length, and a rotation by the same number of rad.
BESIDE = (1e-6, 1e-4)


class Eliminated(NamedTuple):
    """
    The inverse kinematics solutions that elimination found, and whether they are complete.

    Attributes
    ----------
    solutions
        The real solutions, nearest first.
    roots
        Number of complex solutions found, and the largest possible number.
    real
        Number of real roots. A root is a position of one joint at which the determinant of the
        elimination is 0. The number equals the number of solutions unless some roots are double.
    proved
        Whether it is proved that every real root was found. The proof is complete if the largest
        possible number of roots was found, or if every root that may be real has led to a
        solution.
    """

    solutions: kernel.Solutions
    roots: tuple[int, int]
    real: int
    proved: bool

    @property
    def all_found(self) -> bool:
        """Return whether `solutions` is proved to contain all real solutions."""
        return self.proved and self.real == self.solutions.count


def eliminated_solutions(problem: IkProblem, arm: kernel.SixJoints) -> Eliminated:
    """
    Return the solutions of an inverse kinematics problem of six joints, found by elimination.
    """
    solutions = room_for(kernel.MAX_CANDIDATES, problem)
    counts = np.zeros(3, dtype=np.int64)
    refining = refinement(problem.target, problem.plan)
    kernel.eliminated_solutions(arm, refining, solutions, counts)
    count, real, proved = counts.tolist()
    return Eliminated(solutions, (count, arm.bound), real, bool(proved))


def completed_solutions(problem: IkProblem, arm: kernel.SixJoints) -> DistinctSolutions | None:
    """
    Return all solutions of an arm of six joints, found by elimination and from random starts.

    The random starts add solutions that elimination has missed.

    Returns None unless the number of certified complex solutions is the largest possible number.
    """
    robot, target, plan = problem.robot, problem.target, problem.plan
    screws = screws_of(robot.chain)
    arrived = refined(target, plan, starts(robot, plan, problem.random(), BATCH), far=True)
    known, _ = distinct(target, plan, arrived)
    psi, accuracy = np.zeros((kernel.MAX_CANDIDATES, 6, 2)), np.empty(3)
    motion = np.ascontiguousarray(target.pose @ inverse(screws.home))
    complex_ones = kernel.complex_solutions(arm, motion, psi, accuracy)
    count = complex_ones + len(known.q)
    if count > len(psi):
        return None
    psi[complex_ones:count] = 0.0
    psi[complex_ones:count, :, 0] = known.q @ screws.coupling.T
    count = kernel.followed_solutions(arm, motion, count, psi)
    real = psi[:count][np.max(np.abs(psi[:count, :, 1]), axis=1) < IMAGINARY_TOLERANCE, :, 0]
    solutions, _ = distinct(target, plan, refined(target, plan, _positions(screws, real)))
    return solutions if count == arm.bound and len(solutions.q) == len(real) else None


class Beside(NamedTuple):
    """
    Solutions of a degenerate target, found by solving displaced targets.

    Attributes
    ----------
    solutions
        The real solutions, refined to the degenerate target.
    simple
        Number of certified complex solutions, and number of real solutions among them. All
        certified solutions are simple.
    """

    solutions: DistinctSolutions
    simple: tuple[int, int]


def solutions_beside(problem: IkProblem, arm: kernel.SixJoints) -> Beside:
    """
    Return the solutions of a degenerate target, refined from the solutions of displaced targets.

    At a degenerate target all determinants of the elimination are 0, or several solutions
    coincide. At a displaced target not all determinants are 0, and the solutions are distinct. The
    distinct solutions may be real for only one sign of the displacement, so both signs are tried.
    """
    robot, target, plan = problem.robot, problem.target, problem.plan
    random, screws = problem.random(), screws_of(robot.chain)
    home = inverse(screws.home)
    candidates: list[Floats] = [np.empty((0, 6))]
    simple = (0, 0)
    psi, accuracy = np.empty((kernel.MAX_CANDIDATES, 6, 2)), np.empty(3)
    for size in BESIDE:
        shift = size * robot.singularity.task.length * random.normal(size=3)
        turn = size * random.normal(size=3)
        for side in (1.0, -1.0):
            pose = target.pose.copy()
            pose[:3, 3] += side * shift
            pose[:3, :3] = exponential(side * turn) @ pose[:3, :3]
            moved = target._replace(pose=pose, residual=residual_of(robot, pose, target.rows))
            solutions = eliminated_solutions(problem._replace(target=moved), arm).solutions
            candidates.append(solutions.q[: solutions.count].copy())
            count = kernel.complex_solutions(arm, pose @ home, psi, accuracy)
            count = kernel.followed_solutions(arm, target.pose @ home, count, psi)
            real = _real_solutions(psi[:count])
            candidates.append(_positions(screws, real))
            simple = max(simple, (count, len(real)))
    return Beside(refined(target, plan, np.vstack(candidates), far=True), simple)


def _positions(screws: Screws, psi: Floats) -> Floats:
    # Returns the joint positions q (m, 6) from the angles (or displacements) psi (m, 6) of the
    # joint screws. The matrix `coupling` gives psi = coupling q.
    return np.asarray(np.linalg.solve(screws.coupling, psi.T).T, np.float64)


def _real_solutions(psi: Floats) -> Floats:
    # Returns the real solutions (k, 6) among the complex solutions `psi` (m, 6, 2), where the last
    # index is 0 for real parts and 1 for imaginary parts. If a solution is not real, `psi` also
    # has its exact conjugate. Two kinds of solutions are real: those whose imaginary parts are all
    # 0, and those whose conjugate is not in `psi`. In the second kind the imaginary parts are
    # round-off.
    conjugate = psi * (1.0, -1.0)
    paired = [any(np.array_equal(row, other) for other in conjugate) for row in psi]
    exact = ~psi[:, :, 1].any(axis=1)
    return np.asarray(psi[exact | np.logical_not(paired), :, 0])
