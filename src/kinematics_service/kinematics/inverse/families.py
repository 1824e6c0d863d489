# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Separate isolated solutions from families of solutions (continua), by the null space of J and by
trial steps.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Floats
from ...robot.task import least_motion
from .problem.plan import InversePlan, signed
from .problem.problem import IkProblem
from .result import off_motions
from .search import DistinctSolutions, apart, errors_at, refined

# A joint motion that hardly moves the tool may be a tangent of a family of solutions. Such motions
# are right singular vectors of J with small singular values. Trial steps test a vector if its
# singular value, divided by the largest singular value, is below this.
FREE_SINGULAR_VALUE_RATIO = 1e-5
# A cheap test avoids the computation of the singular values of J: Gaussian elimination of J with
# complete pivoting. If the last pivot, divided by the largest pivot, is above this number, then
# each singular value, divided by the largest one, is above FREE_SINGULAR_VALUE_RATIO.
SUSPECT_PIVOT_RATIO = 1e-3
# Trial step along a joint motion that hardly moves the tool, rad.
TRIAL_STEP = 0.05
# After a trial step, a correction brings the tool back to the target. If the joints are then
# further than this (rad) from the solution, the solution belongs to a family (a continuum). The
# test is necessary, because J is also singular at the border of the workspace. There, the
# correction leads back to the solution.
MIN_TRIAL_MOTION = 0.01
# Largest residual after a trial step on a family, divided by the characteristic length. It is as
# small as the round-off of a residual. With a larger number, two separate solutions close to a
# singular pose would be taken as a family.
RESIDUAL_ROUND_OFF = 1e-13
# Lengths of steps along the tangent of a family of solutions, rad. If the tool is at the target
# after each of the steps, the family is taken as straight.
CHECKED_STEPS = (-2.0, 0.7, 3.0)
# Largest number of steps along a family of solutions toward the preferred joint positions `near`.
MAX_STEPS = 6


class SolutionFamily(NamedTuple):
    """
    A solution that is not isolated, and the joint motions along its family of solutions.

    Attributes
    ----------
    q : shape (n,), rad or m
        The solution.
    error
        Residual of the solution, m.
    motions : shape (k, n)
        Joint motions that keep the tool at the target, orthonormal; prismatic motions are divided
        by the characteristic length.
    straight
        Whether the tool stays at the target after a joint motion of any length along `motions`.
    """

    q: Floats
    error: float
    motions: Floats
    straight: bool


class Sorted(NamedTuple):
    """
    Solutions of inverse kinematics, sorted into isolated solutions and families of solutions.

    Attributes
    ----------
    isolated
        The isolated solutions.
    singular : shape (m,)
        Whether J is singular at each isolated solution.
    families
        The families to which the other solutions belong.
    """

    isolated: DistinctSolutions
    singular: npt.NDArray[np.bool_]
    families: tuple[SolutionFamily, ...]


def isolated_or_not(problem: IkProblem, known: DistinctSolutions) -> Sorted:
    """Sort proved solutions into isolated solutions and families of solutions."""
    robot, target, plan, *_ = problem
    n = robot.dof
    none = np.zeros(len(known.q), dtype=np.bool_)
    ratios = np.empty(len(known.q))
    kernel.pivots(target.residual, plan.scales, known.q, ratios)
    # If J has full rank at all solutions and the arm has no idle motions, all solutions are
    # isolated. An idle motion (`plan.idle`) never moves the tool away from any target, so with an
    # idle motion every solution is in a family.
    if not len(plan.idle) and not np.any(ratios < SUSPECT_PIVOT_RATIO):
        return Sorted(known, none, ())
    m = len(known.q)
    sigma, motions = np.zeros((m, n)), np.zeros((m, n, n))
    kernel.free_motions(target.residual, plan.scales, known.q, sigma, motions)
    free = sigma <= np.maximum(FREE_SINGULAR_VALUE_RATIO * sigma[:, :1], least_motion(robot.chain))
    singular = free[:, -1]
    if not singular.any():
        return Sorted(known, none, ())
    families: list[SolutionFamily] = []
    isolated = np.ones(m, dtype=bool)
    for k in np.flatnonzero(singular):
        null = motions[k][free[k]]
        along = _along(problem, known.q[k], null, float(known.errors[k]))
        if len(along):
            isolated[k] = False
            straight = _straight(problem, known.q[k], along)
            families.append(SolutionFamily(known.q[k], float(known.errors[k]), along, straight))
    alone = DistinctSolutions(known.q[isolated], known.errors[isolated])
    return Sorted(alone, singular[isolated], tuple(_merged(plan, families)))


def _along(problem: IkProblem, q: Floats, null: Floats, error: float) -> Floats:
    # Returns the tangents (k, n) of the family of solutions through q; none if q is isolated. The
    # tangents are combinations of the null vectors `null` of J. A trial step goes along each null
    # vector, and a correction then brings the tool back to the target. If q is isolated, the
    # correction leads back to q, or the tool does not reach the target.
    robot, target, plan, *_ = problem
    trials = np.concatenate([null, -null]) * TRIAL_STEP
    gone = refined(target, plan, q + trials * plan.scales, far=True)
    steps = apart(plan, q, gone.q) / plan.scales
    size = np.linalg.norm(steps, axis=1)
    as_good = max(RESIDUAL_ROUND_OFF * robot.singularity.task.length, 4.0 * error)
    kept = (gone.errors < as_good) & (size > MIN_TRIAL_MOTION) & (size < 4 * TRIAL_STEP)
    if not np.any(kept):
        return np.empty((0, len(q)))
    # The solutions near q may lie on a curve. Then the joint motions of the trial steps are chords
    # of the curve. Project them onto the null space of J to get tangents.
    tangents = steps[kept] @ null.T @ null
    _, strength, right = np.linalg.svd(tangents, full_matrices=False)
    along = right[strength > 0.2 * TRIAL_STEP]
    return signed(along)


def _straight(problem: IkProblem, q: Floats, along: Floats) -> bool:
    robot, target, plan, *_ = problem
    out = np.concatenate([q + t * along * plan.scales for t in CHECKED_STEPS])
    # Allow residuals above round-off, because the joint motions in `along` are known to about ten
    # digits only.
    return bool(np.all(errors_at(target, plan, out) < 1e-6 * robot.singularity.task.length))


def _merged(plan: InversePlan, families: list[SolutionFamily]) -> list[SolutionFamily]:
    # Removes families that were found twice: straight families on one line, and curved families at
    # equal joint positions.
    kept: list[SolutionFamily] = []
    for family in families:
        for other in kept:
            away = apart(plan, other.q, family.q) / plan.scales
            if other.straight and family.straight and len(other.motions) == len(family.motions):
                off = off_motions(away, other.motions) * plan.scales
                away = apart(plan, np.zeros_like(away), off) / plan.scales
            if np.max(np.abs(away)) < 1e-4:
                break
        else:
            kept.append(family)
    return kept


def nearer(problem: IkProblem, family: SolutionFamily, limits: Floats) -> SolutionFamily:
    """
    Replace the stored solution `q` of a family by a solution nearer to `problem.near`.

    Returns the changed family. The new solution is inside `limits` (n, 2). At most `MAX_STEPS`
    steps along the family lead to it.
    """
    _, target, plan, near, *_ = problem
    q, error, motions, _ = family
    for _ in range(MAX_STEPS):
        away = (near - q) / plan.scales
        step = motions.T @ (motions @ away)
        largest = float(np.max(np.abs(step)))
        if largest < 1e-4:
            break
        trial = q + step * plan.scales * min(1.0, 0.5 / largest)
        gone = refined(target, plan, np.clip(trial, *limits.T)[None], True, limits)
        closer = np.linalg.norm((near - gone.q[0]) / plan.scales) < np.linalg.norm(away)
        if not target.is_reached_at(gone.q[0], gone.errors[0]) or not closer:
            break
        q, error = gone.q[0], float(gone.errors[0])
        if not family.straight:
            motions = tangent(problem, q, len(motions))
    return SolutionFamily(q, error, motions, family.straight)


def tangent(problem: IkProblem, q: Floats, dimension: int) -> Floats:
    """
    Return the tangents of a family of solutions at q: orthonormal joint motions, shape
    (`dimension`, n).

    They are right singular vectors of J, those with the smallest singular values. Motions of
    prismatic joints are divided by the characteristic length, in J and in the result.
    """
    n, residual = len(q), problem.target.residual
    sigma, motions = np.zeros((1, n)), np.zeros((1, n, n))
    kernel.free_motions(residual, problem.plan.scales, q[None].copy(), sigma, motions)
    return np.array(motions[0, n - dimension :])
