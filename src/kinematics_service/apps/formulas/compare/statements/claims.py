# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the `singular:` lines of a file of formulas: whether each claimed pose is singular, and
whether the claims are complete.

A line such as `singular: q3 = k*pi` claims that a family of configurations is singular: here all
with q3 = 0, pi, -pi, and so on. To check completeness, Newton's method with least-norm steps
projects random configurations onto the zeros of each factor of the exact determinant. If the arm
is singular at a zero that the method finds, the zero must lie in one of the claimed families.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import sympy as sp

from .....errors import DerivationError
from .....kinematics.forward import jacobian
from .....kinematics.task_jacobian import task_jacobian
from .....robot.robot import Robot
from ...arm.numbers import DEGREE, Evaluation, Floats
from ...arm.world import with_constants
from ...derive.algebra.laurent import Laurent
from ...derive.algebra.numeric import Numbers, poses_on
from ...derive.derivation import determinant_factors, exact_of
from ...derive.sampled_poses import PoseSampler
from ...derive.singular_set import numbers_in_words
from .names import FormulaNames
from .poses import SEED, poses_for
from .statements import Statement

# Number of random configurations that are drawn for each claim, and for each factor of the
# determinant.
DRAWS = 200
# A singular value of the task rows of J counts as 0 if its ratio to the largest singular value at
# the same configuration is below this. Newton's method finds a zero with an error of 1e-9 (rad or
# m), which changes the ratio by about 1e-9, so the threshold is above 1e-9.
SINGULAR_VALUE_RATIO = 1e-7
# A configuration belongs to the family that a claim such as `q3 = k*pi` names if its distance (rad
# or m) from the family is at most this. The tolerance exceeds 1e-6, the error of Newton's method
# at a double zero.
CLAIM_TOLERANCE = 1e-5
# Step of central differences (rad or m). With this step, a difference has a round-off error below
# 1e-9 and a truncation error (third derivative) below 1e-9.
DIFFERENCE_STEP = 1e-6
# Values tried for the integer k in a claim such as `q3 = k*pi`. With these values, even k*pi/6
# covers a whole turn.
INTEGERS = np.arange(-6.0, 7.0)


@dataclass(frozen=True)
class Claim:
    """The verdict on a `singular:` line."""

    name: str
    line: int
    holds: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _ZeroCondition:
    # A function of N configurations, shape (N, n). Its values are 0 if an equation of a claim
    # holds.
    function: Callable[[Floats], Floats]

    def __call__(self, q: Floats) -> Floats:
        return self.function(q)

    def gradient(self, q: Floats) -> Floats:
        steps = DIFFERENCE_STEP * np.eye(q.shape[-1])
        differences = [self.function(q + h) - self.function(q - h) for h in steps]
        return np.stack(differences, axis=-1) / (2.0 * DIFFERENCE_STEP)


@dataclass(frozen=True)
class _ArmOfLetters:
    # The arm with one value for each named constant. `sampler` is None if derivation of the
    # determinant failed.
    robot: Robot
    names: FormulaNames
    sampler: PoseSampler | None

    def smallness(self, q: Floats) -> Floats:
        # Return the ratio of the smallest singular value of the task rows to the largest, shape
        # (N,). The input q has shape (N, n), rad and m.
        sampler, task = self.sampler, self.robot.singularity.task
        J_t, rank = task_jacobian(task, jacobian(self.robot, q)), task.generic_rank
        if sampler is not None and len(q):
            J_t = sampler.arm(q[:, list(sampler.moving)] / sampler.to_si).J_t
            rank = sampler.generic_rank
        values = np.linalg.svd(J_t, compute_uv=False)
        return np.asarray(values[..., rank - 1] / values[..., 0])


def judge_claims(robot: Robot, names: FormulaNames, claims: Sequence[Statement]) -> list[Claim]:
    """
    Return a verdict on each claimed family of singular poses, then a verdict on whether the claims
    are complete. The second kind of verdict is missing if the determinant was not derived.

    A claim holds if it is right with two random values of each named constant. If a claim is right
    only with the constants of the robot file, a remark says so.
    """
    task = robot.singularity.task
    square = not task.structurally_deficient and len(task.rows) == robot.dof
    try:
        exact = exact_of(robot)
        factors = determinant_factors(exact) if square else None
    except DerivationError as error:
        judged = [_sound(_ArmOfLetters(robot, names, None), claim) for claim in claims]
        undecided = f'it is not decided whether other poses are singular: {error}'
        remarks = (*judged[-1].remarks, undecided) if square else judged[-1].remarks
        return [*judged[:-1], replace(judged[-1], remarks=remarks)]
    by_file = exact.sampler
    arms = [
        _ArmOfLetters(robot, FormulaNames(sampler.table), sampler)
        for sampler in (*by_file.in_random_letters, by_file)
    ]

    def judge(claim: Statement | None) -> Claim:
        if claim is not None:
            verdicts = [_sound(arm, claim) for arm in arms]
        else:
            verdicts = [_whole(arm, factors, claims) for arm in arms if factors]
        worst = next((verdict for verdict in verdicts if not verdict.holds), verdicts[-1])
        if worst.holds or not verdicts[-1].holds:
            # The last verdict is for the constants of the robot file, the verdicts before it are
            # for random constants. Return the last verdict if all verdicts say that the claim is
            # right. Return the last verdict also if the claim is wrong with the constants of the
            # robot file, because the remark of the last verdict names a configuration of the arm
            # in the file.
            return verdicts[-1]
        numbers = numbers_in_words(exact.arithmetic.names)
        special = f'with {numbers} of this file it agrees, with other values not'
        return replace(worst, remarks=(*worst.remarks, special))

    return [judge(claim) for claim in (*claims, None) if claim or factors]


def _in_words(names: FormulaNames, pose: Floats) -> str:
    return ', '.join(f'{s} = {v:.4f}' for s, v in zip(names.table.variables, pose))


# Soundness: check that the configurations of each claimed family are singular


def _sound(arm: _ArmOfLetters, claim: Statement) -> Claim:
    names = arm.names
    poses = poses_for(arm.robot, names, claim.settings, frozenset(), (), DRAWS)
    q = np.stack([poses.values[s] for s in names.table.variables], axis=-1)
    integers = np.random.default_rng(SEED).integers(-2, 3, len(q)).astype(float)
    free = np.ones(arm.robot.dof)
    for joint, value in claim.conditions:
        if joint >= 0:
            q[:, joint] = _value(names, claim, value, integers)(q) * _unit(names, claim, joint)
            free[joint] = 0.0
    equations = [
        _ZeroCondition(_value(names, claim, value, integers))
        for joint, value in claim.conditions
        if joint < 0
    ]
    if equations:
        q = poses_on(equations, q, free)
    # A claim such as q3 = acos(2 cos(q2)) gives no real q3 at some values of q2. Drop the
    # configurations without a real joint position.
    q = q[np.isfinite(q).all(axis=1)]
    q = q[_in_family(names, claim, q)] if equations else q
    if not len(q):
        remark = f'no pose of this family was found in {DRAWS} draws: it has no real values there'
        return Claim(claim.name, claim.line, False, (remark,))
    singular = arm.smallness(q) < SINGULAR_VALUE_RATIO
    if singular.all():
        return Claim(claim.name, claim.line, True, ('every pose of this family is singular',))
    pose = _in_words(names, q[int(np.argmin(singular))])
    return Claim(claim.name, claim.line, False, (f'not singular: {pose} has full rank',))


def _value(
    names: FormulaNames, claim: Statement, value: sp.Expr, integers: Floats | float
) -> Callable[[Floats], Floats]:
    # Return a function of N configurations that evaluates the expression `value` of a claim.
    # `integers` gives the integer k of the claim at each configuration.
    table = names.table

    def function(q: Floats) -> Floats:
        values = with_constants(table, dict(zip(table.variables, q.T)), len(q))
        values[sp.Symbol('k')] = np.broadcast_to(integers, len(q))
        return Evaluation(values, len(q), claim.settings.degrees).of(value)

    return function


def _unit(names: FormulaNames, claim: Statement, joint: int) -> float:
    turns = not names.table.slides[joint]
    return DEGREE if turns and claim.settings.degrees else 1.0


# Completeness: check that the claims contain the zeros of each factor of the determinant


def _in_family(names: FormulaNames, claim: Statement, q: Floats) -> npt.NDArray[np.bool_]:
    # Return which of N configurations belong to the family that the claim names, shape (N,).
    holds = np.ones(len(q), dtype=bool)
    for joint, value in claim.conditions:
        # Compute the distance (rad or m) of each configuration from the condition. If the
        # condition is q3 = k*pi, the distance is |q3 - k*pi|, for each integer k in `INTEGERS`. If
        # the condition is an equation, the distance is a first-order estimate.
        gaps = []
        for k in INTEGERS.tolist():
            condition = _ZeroCondition(_value(names, claim, value, k))
            if joint < 0:
                slope = np.linalg.norm(condition.gradient(q), axis=-1)
                gap = np.abs(condition(q)) / np.maximum(slope, np.finfo(float).tiny)
            else:
                gap = np.abs(q[:, joint] - condition(q) * _unit(names, claim, joint))
                if not names.table.slides[joint]:
                    gap = np.abs(np.remainder(gap + np.pi, 2 * np.pi) - np.pi)
            gaps.append(np.where(np.isfinite(gap), gap, np.inf))
        holds &= np.min(gaps, axis=0) <= CLAIM_TOLERANCE
    return holds


def _whole(
    arm: _ArmOfLetters, factors: Mapping[sp.Expr, Laurent], claims: Sequence[Statement]
) -> Claim:
    name, line, names, sampler = 'the singular set', claims[-1].line, arm.names, arm.sampler
    assert sampler is not None  # callers pass only arms whose determinant was derived
    starts = sampler.random(DRAWS)
    for expression, value in factors.items():
        function = Numbers(value, sampler.arithmetic).scaled_to(sampler.random())
        zeros = sampler.whole(poses_on([function], starts, np.ones(starts.shape[1])))
        claimed = [_in_family(names, claim, zeros) for claim in claims]
        left_out = zeros[~np.any(claimed, axis=0)]
        left_out = left_out[arm.smallness(left_out) < SINGULAR_VALUE_RATIO]
        if len(left_out):
            remark = (
                f'not complete: {expression} = 0 at {_in_words(names, left_out[0])}, which is '
                'singular too, and is not claimed'
            )
            return Claim(name, line, False, (remark,))
    remark = f'all zeros of all factors that {DRAWS} random poses lead to are claimed'
    return Claim(name, line, True, (remark,))
