"""Solutions of general arms of six joints: by elimination, with a count of all as the proof."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...rigid_motion import exponential, inverse
from .closed_forms import room_for
from .problem.plan import NOT_REAL
from .problem.problem import IkProblem
from .problem.screws import Screws, screws_of
from .problem.target import residual_of
from .search import BATCH, DistinctSolutions, distinct, refined, refinement, starts

# So far targets are moved beside a degenerate one, as shares of the length and in rad.
BESIDE = (1e-6, 1e-4)


class Eliminated(NamedTuple):
    """
    What elimination found.

    Attributes
    ----------
    solutions
        The real solutions, nearest first.
    roots
        How many complex solutions were found, and how many there can be.
    real
        How many of them are real: as many as there are solutions, where none is double.
    proved
        Whether no real one is missing: all were found that there can be, or every root of a
        determinant that is real, or may be, has its solution.
    """

    solutions: kernel.Solutions
    roots: tuple[int, int]
    real: int
    proved: bool

    @property
    def all_found(self) -> bool:
        """Return whether the solutions are all there are."""
        return self.proved and self.real == self.solutions.count


def eliminated_solutions(problem: IkProblem, arm: kernel.SixJoints) -> Eliminated:
    """Return the solutions of an arm of six joints by elimination."""
    solutions = room_for(kernel.MOST_CANDIDATES, problem)
    counts = np.zeros(3, dtype=np.int64)
    refining = refinement(problem.target, problem.plan)
    kernel.eliminated_solutions(arm, refining, solutions, counts)
    found, real, proved = counts.tolist()
    return Eliminated(solutions, (found, arm.bound), real, bool(proved))


def completed_solutions(problem: IkProblem, arm: kernel.SixJoints) -> DistinctSolutions | None:
    """
    Return all solutions where starts lead to real ones that elimination left out.

    They are all where with the complex ones as many are certified as there can be; None where that
    is not so.
    """
    robot, target, plan = problem.robot, problem.target, problem.plan
    screws = screws_of(robot.chain)
    arrived = refined(target, plan, starts(robot, plan, problem.random(), BATCH), far=True)
    found, _ = distinct(target, plan, arrived)
    psi, accuracy = np.zeros((kernel.MOST_CANDIDATES, 6, 2)), np.empty(3)
    motion = np.ascontiguousarray(target.pose @ inverse(screws.home))
    complex_ones = kernel.complex_solutions(arm, motion, psi, accuracy)
    count = complex_ones + len(found.q)
    if count > len(psi):
        return None
    psi[complex_ones:count] = 0.0
    psi[complex_ones:count, :, 0] = found.q @ screws.coupling.T
    count = kernel.followed_solutions(arm, motion, count, psi)
    real = psi[:count][np.max(np.abs(psi[:count, :, 1]), axis=1) < NOT_REAL, :, 0]
    every, _ = distinct(target, plan, refined(target, plan, _positions(screws, real)))
    return every if count == arm.bound and len(every.q) == len(real) else None


class Beside(NamedTuple):
    """
    What targets beside a degenerate one show of it.

    Attributes
    ----------
    found
        Its real solutions, refined.
    simple
        How many complex solutions it has that are certified, and so simple, and how many of these
        are real.
    """

    found: DistinctSolutions
    simple: tuple[int, int]


def solutions_beside(problem: IkProblem, arm: kernel.SixJoints) -> Beside:
    """
    Return the solutions that those of targets beside a degenerate one lead to.

    Solutions that have become one are apart there, on one side of it real; and not every
    determinant vanishes.
    """
    robot, target, plan = problem.robot, problem.target, problem.plan
    random, screws = problem.random(), screws_of(robot.chain)
    home = inverse(screws.home)
    candidates: list[Floats] = [np.empty((0, 6))]
    simple = (0, 0)
    psi, accuracy = np.empty((kernel.MOST_CANDIDATES, 6, 2)), np.empty(3)
    for size in BESIDE:
        way, turn = (
            size * robot.singularity.task.length * random.normal(size=3),
            size * random.normal(size=3),
        )
        for side in (1.0, -1.0):
            pose = target.pose.copy()
            pose[:3, 3] += side * way
            pose[:3, :3] = exponential(side * turn) @ pose[:3, :3]
            moved = target._replace(pose=pose, residual=residual_of(robot, pose, target.rows))
            solutions = eliminated_solutions(problem._replace(target=moved), arm).solutions
            candidates.append(solutions.q[: solutions.count].copy())
            count = kernel.complex_solutions(arm, pose @ home, psi, accuracy)
            count = kernel.followed_solutions(arm, target.pose @ home, count, psi)
            real = _real_ones(psi[:count])
            candidates.append(_positions(screws, real))
            simple = max(simple, (count, len(real)))
    return Beside(refined(target, plan, np.vstack(candidates), far=True), simple)


def _positions(screws: Screws, psi: Floats) -> Floats:
    # Of the angles (m, 6) that the screws turn by.
    return np.asarray(np.linalg.solve(screws.coupling, psi.T).T, np.float64)


def _real_ones(psi: Floats) -> Floats:
    # Of complex solutions (m, 6, 2), which have their conjugate ones beside them, those that have
    # none, (k, 6).
    conjugate = psi * (1.0, -1.0)
    paired = [any(np.array_equal(one, other) for other in conjugate) for one in psi]
    return np.asarray(psi[np.logical_not(paired), :, 0])
