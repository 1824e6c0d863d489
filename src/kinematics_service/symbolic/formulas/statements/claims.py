"""Claims about where an arm is singular: is each claimed pose singular, and is any left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import sympy as sp  # type: ignore[import-untyped]

from ....kinematics.forward import jacobian
from ....kinematics.task_jacobian import task_jacobian
from ....robot.robot import Robot
from ...algebra.numeric import bisected
from ..arm.numbers import Evaluation, Floats
from .names import FormulaNames
from .poses import SEED, poses_for
from .statements import Statement

DRAWS = 200
SEARCHES = 60
GRID = 181
# Smallest singular value, relative to the largest, of a pose found by bisection.
SINGULAR = 1e-7
NEAR = 1e-5  # rad or m, of a claimed value


@dataclass(frozen=True)
class Claim:
    """What is true of a `singular:` line."""

    name: str
    line: int
    holds: bool
    remarks: tuple[str, ...]


def judge_claims(robot: Robot, names: FormulaNames, claims: Sequence[Statement]) -> list[Claim]:
    """Return for each claimed family whether it is singular, and last whether all are claimed."""
    judged = [_sound(robot, names, claim) for claim in claims]
    if robot.task.structurally_deficient or len(robot.task.rows) != robot.dof:
        return judged
    missing = _missing(robot, names, claims)
    remark = 'every singular pose that was found is claimed'
    if missing is not None:
        pose = ', '.join(f'{s} = {v:.4f}' for s, v in zip(names.table.variables, missing))
        remark = f'not complete: {pose} is singular too, and is not claimed'
    whole = Claim('the singular set', claims[-1].line, missing is None, (remark,))
    return [*judged, whole]


def _task_jacobian(robot: Robot, q: Floats) -> Floats:
    return task_jacobian(robot.task, jacobian(robot, q))


def _determinant(robot: Robot, q: Floats, joint: int, value: float) -> float:
    q[joint] = value
    return float(np.linalg.det(_task_jacobian(robot, q)))


def _smallness(robot: Robot, q: Floats) -> Floats:
    values = np.linalg.svd(_task_jacobian(robot, q), compute_uv=False)
    return np.asarray(values[..., robot.task.generic_rank - 1] / values[..., 0])


def _draws(robot: Robot, names: FormulaNames, claim: Statement, count: int) -> Floats:
    poses = poses_for(robot, names, claim.settings, frozenset(), (), count)
    return np.stack([poses.values[s] for s in names.table.variables], axis=-1)


def _sound(robot: Robot, names: FormulaNames, claim: Statement) -> Claim:
    q = _draws(robot, names, claim, DRAWS)
    for joint, values in _claimed_values(names, claim, q):
        q[:, joint] = values
    q = q[np.isfinite(q).all(axis=1)]  # a family need not exist for all of the other joints
    if not len(q):
        remark = f'no pose of this family was found in {DRAWS} draws: it has no real values there'
        return Claim(claim.name, claim.line, False, (remark,))
    singular = _smallness(robot, q) < SINGULAR
    if singular.all():
        return Claim(claim.name, claim.line, True, ('every pose of this family is singular',))
    pose = q[int(np.argmin(singular))]
    text = ', '.join(f'{s} = {v:.4f}' for s, v in zip(names.table.variables, pose))
    return Claim(claim.name, claim.line, False, (f'not singular: {text} has full rank',))


def _claimed_values(names: FormulaNames, claim: Statement, q: Floats) -> list[tuple[int, Floats]]:
    rng = np.random.default_rng(SEED)
    values = {s: q[:, k] for k, s in enumerate(names.table.variables)}
    for symbol in names.table.constants:
        if symbol in names.table.derived:
            values[symbol] = Evaluation(values, len(q)).of(names.table.derived[symbol])
        else:
            values[symbol] = np.full(len(q), names.table.given[symbol])
    values[sp.Symbol('k')] = rng.integers(-2, 3, len(q)).astype(float)
    evaluation = Evaluation(values, len(q), claim.settings.degrees)
    scale = [
        np.pi / 180 if claim.settings.degrees and not slides else 1.0
        for slides in names.table.slides
    ]
    return [(joint, evaluation.of(value) * scale[joint]) for joint, value in claim.conditions]


def _is_claimed(names: FormulaNames, claims: Sequence[Statement], q: Floats) -> bool:
    for claim in claims:
        copies = np.repeat(q[None], 5, axis=0)
        holds = True
        for joint, values in _claimed_values(names, claim, copies):
            gap = q[joint] - values
            if not names.table.slides[joint]:
                gap = np.remainder(gap + np.pi, 2 * np.pi) - np.pi
            holds = holds and bool(np.min(np.abs(gap)) < NEAR)
        if holds:
            return True
    return False


def _missing(robot: Robot, names: FormulaNames, claims: Sequence[Statement]) -> Floats | None:
    # Along one joint at a time, where the determinant changes sign or touches zero.
    starts = _draws(robot, names, claims[0], SEARCHES)
    for index, start in enumerate(starts):
        joint = index % robot.dof
        line = np.repeat(start[None], GRID, axis=0)
        low, high = (-2.0, 2.0) if robot.prismatic[joint] else (-np.pi, np.pi)
        line[:, joint] = np.linspace(low, high, GRID)
        determinant = np.linalg.det(_task_jacobian(robot, line))
        at = partial(_determinant, robot, start.copy(), joint)
        for k in np.flatnonzero(determinant[:-1] * determinant[1:] < 0.0):
            q: Floats = start.copy()
            q[joint] = bisected(at, float(line[k, joint]), float(line[k + 1, joint]))
            if _smallness(robot, q[None])[0] < SINGULAR and not _is_claimed(names, claims, q):
                return q
    return None
