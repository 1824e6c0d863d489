# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Solve inverse kinematics in closed form; the kernel finds, proves and sorts the solutions."""

from __future__ import annotations

import numpy as np

from ... import kernel
from ...kernel import Floats, Integers
from .problem.problem import IkProblem
from .result import IkSolution, Posture
from .search import refinement

# The kernel returns a posture as three signs, of shoulder, elbow and wrist. Each sign is -1, 0
# (not defined) or 1. POSTURES has the words for the 27 triples of signs, from -1 -1 -1 to 1 1 1.
POSTURES = tuple(
    Posture(shoulder, elbow, wrist)
    for shoulder in ('left', '', 'right')
    for elbow in ('down', '', 'up')
    for wrist in ('flip', '', 'no_flip')
)
NO_POSTURE = Posture()


def room_for(count: int, problem: IkProblem) -> kernel.Solutions:
    """Return an empty `kernel.Solutions` with room for `count` solutions of the problem."""
    q = np.empty((count, problem.robot.chain.dof))
    return kernel.Solutions(problem.plan.joints, problem.near, problem.target.proved, q)


def closed_solutions(
    problem: IkProblem, form: kernel.ClosedForm, only_one: bool, only_inside: bool
) -> kernel.Solutions:
    """
    Return all solutions of an arm with a closed form, nearest to `problem.near` first.

    If `only_one`, return only the nearest solution inside the limits. If `only_inside`, leave out
    solutions that exceed a limit by more than the error bound of the closed form.
    """
    solutions = room_for(1 if only_one else kernel.MAX_CANDIDATES, problem)
    refining = refinement(problem.target, problem.plan)
    kernel.closed_solutions(form, refining, only_one, only_inside, solutions)
    return solutions


def closed_solutions_of_each(
    problem: IkProblem, form: kernel.ClosedForm, poses: Floats
) -> tuple[kernel.Solutions, Integers]:
    """
    Return all solutions of N target poses (N, 4, 4), pose by pose, and an array with the number of
    solutions of each pose.

    The array (N, 2) has two numbers for each pose: the number of its solutions, and 1 if they are
    proved to be all, else 0.
    """
    solutions = room_for(kernel.MAX_CANDIDATES * len(poses), problem)
    counts = np.zeros((len(poses), 2), dtype=np.int64)
    refining = refinement(problem.target, problem.plan)
    only_inside = problem.respect_limits
    kernel.closed_solutions_of_each(form, refining, only_inside, poses, solutions, counts)
    return solutions, counts


def solutions_of(
    problem: IkProblem, proved: kernel.Solutions, only_feasible: bool, indices: range
) -> tuple[IkSolution, ...]:
    """
    Return the solutions with the given `indices` as `IkSolution`, in the order of the indices. If
    `only_feasible`, leave out solutions outside the limits.
    """
    # Make the array of solutions read-only, because each `IkSolution` gets a view of it.
    proved.q.setflags(write=False)
    names, exact = problem.robot.joint_names, problem.target.exact
    solutions = proved.records(
        IkSolution, names, POSTURES, exact, indices.start, indices.stop, only_feasible
    )
    return tuple(solutions)
