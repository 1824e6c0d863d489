"""Families: whether a solution is isolated, or one of a continuum, and how the continuum runs."""

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

# Below this share of the largest singular value a motion may be free (then it is tried out).
MAYBE_FREE = 1e-5
# A last pivot above this share cannot belong to such a singular value.
SUSPECT = 1e-3
# Step of the trial (rad), and the share of it that must be left after the correction to the
# target: at the border of the workspace, where J is singular, too, the correction leads back.
TRIED, LEFT = 0.05, 0.01
# On a family the correction ends as near to the target as the solution itself, or round-off (a
# share of the length): so two solutions next to a singular pose are two, and no family.
AS_GOOD = 1e-13
# Distance, in rad, at which a straight family is checked.
FAR_OUT = (-2.0, 0.7, 3.0)
TIMES = 6


class SolutionFamily(NamedTuple):
    """
    A solution that is not isolated, and the motions along its family.

    Attributes
    ----------
    q : shape (n,), rad or m
        The solution.
    error
        Its residual, m.
    motions : shape (k, n)
        Orthonormal, scaled.
    straight
        Whether every multiple of the motions is in the family.
    """

    q: Floats
    error: float
    motions: Floats
    straight: bool


class Sorted(NamedTuple):
    """
    Proved solutions, told apart from families.

    Attributes
    ----------
    isolated
        Those that are.
    singular : shape (m,)
        At which of them J has lost a motion.
    families
        Of the others.
    """

    isolated: DistinctSolutions
    singular: npt.NDArray[np.bool_]
    families: tuple[SolutionFamily, ...]


def isolated_or_not(problem: IkProblem, found: DistinctSolutions) -> Sorted:
    """Return the isolated ones of proved solutions, and the families of the others."""
    robot, target, plan, *_ = problem
    n = robot.dof
    none = np.zeros(len(found.q), dtype=np.bool_)
    shares = np.empty(len(found.q))
    kernel.pivots(target.residual, plan.scales, found.q, shares)
    # Joints that never move the rows leave a family at every solution.
    if not len(plan.idle) and not np.any(shares < SUSPECT):
        return Sorted(found, none, ())
    m = len(found.q)
    sigma, motions = np.zeros((m, n)), np.zeros((m, n, n))
    kernel.free_motions(target.residual, plan.scales, found.q, sigma, motions)
    free = sigma <= np.maximum(MAYBE_FREE * sigma[:, :1], least_motion(robot.chain))
    singular = free[:, -1]
    if not singular.any():
        return Sorted(found, none, ())
    families: list[SolutionFamily] = []
    isolated = np.ones(m, dtype=bool)
    for k in np.flatnonzero(singular):
        null = motions[k][free[k]]
        along = _along(problem, found.q[k], null, float(found.errors[k]))
        if len(along):
            isolated[k] = False
            straight = _straight(problem, found.q[k], along)
            families.append(SolutionFamily(found.q[k], float(found.errors[k]), along, straight))
    alone = DistinctSolutions(found.q[isolated], found.errors[isolated])
    return Sorted(alone, singular[isolated], tuple(_merged(plan, families)))


def _along(problem: IkProblem, q: Floats, null: Floats, error: float) -> Floats:
    # Returns the part of the null space along which the pose stays.
    robot, target, plan, *_ = problem
    trials = np.concatenate([null, -null]) * TRIED
    gone = refined(target, plan, q + trials * plan.scales, far=True)
    ways = apart(plan, q, gone.q) / plan.scales
    size = np.linalg.norm(ways, axis=1)
    as_good = max(AS_GOOD * robot.singularity.task.length, 4.0 * error)
    kept = (gone.errors < as_good) & (size > LEFT) & (size < 4 * TRIED)
    if not np.any(kept):
        return np.empty((0, len(q)))
    # The ways bend a little; their projection onto the null space is the tangent.
    tangents = ways[kept] @ null.T @ null
    _, strength, right = np.linalg.svd(tangents, full_matrices=False)
    along = right[strength > 0.2 * TRIED]
    return signed(along)


def _straight(problem: IkProblem, q: Floats, along: Floats) -> bool:
    robot, target, plan, *_ = problem
    out = np.concatenate([q + t * along * plan.scales for t in FAR_OUT])
    # A direction known to some ten digits.
    return bool(np.all(errors_at(target, plan, out) < 1e-6 * robot.singularity.task.length))


def _merged(plan: InversePlan, families: list[SolutionFamily]) -> list[SolutionFamily]:
    # Merges straight families that are the same line, and curved ones that are near each other.
    kept: list[SolutionFamily] = []
    for family in families:
        for one in kept:
            away = apart(plan, one.q, family.q) / plan.scales
            if one.straight and family.straight and len(one.motions) == len(family.motions):
                away = apart(
                    plan, np.zeros_like(away), off_motions(away, one.motions) * plan.scales
                )
                away = away / plan.scales
            if np.max(np.abs(away)) < 1e-4:
                break
        else:
            kept.append(family)
    return kept


def nearer(problem: IkProblem, family: SolutionFamily, limits: Floats) -> SolutionFamily:
    """Return the family at the pose nearest to `near` that some steps along it lead to."""
    _, target, plan, near, *_ = problem
    q, error, motions, _ = family
    for _ in range(TIMES):
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
    """Return the joint motions (k, n), scaled and orthonormal, that J maps to least."""
    n, residual = len(q), problem.target.residual
    sigma, motions = np.zeros((1, n)), np.zeros((1, n, n))
    kernel.free_motions(residual, problem.plan.scales, q[None].copy(), sigma, motions)
    return np.array(motions[0, n - dimension :])
