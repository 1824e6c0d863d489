"""
Named singular factors: functions of the joints whose zeros are singular poses, evaluated live.

A factor's expression becomes a tape, a list of elementary operations that the kernel runs forwards
for value and gradient at once. No symbols are needed for that.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import kernel
from ..errors import KinematicsError
from ..kernel import Chain, Floats, Integers
from .chain import FrozenArrays, poses_and_jacobians
from .file.parts.description import RobotDescription
from .file.parts.loop_groups import group_name, loop_groups, passive_of
from .file.text.expression_syntax import ARGUMENTS_OF, evaluated, syntax_tree
from .task import Task

# The product of the factors is the determinant where log|det| - sum(k log|f|) is the same at all
# seeded poses to this; round-off of a determinant away from its zeros is below 1e-12 of it.
SAME = 1e-9
# Poses with |det| below this share of the median are left out: round-off is large there.
TOO_SINGULAR = 1e-3
# At a zero of a factor the smallest singular value is below this share of the largest.
SINGULAR = 1e-6
# At one of an approximate factor, which is that of a table without corrections, it is below this;
# and there a singular pose is within this of its zero (rad).
NEARLY_SINGULAR, NEARLY = 0.03, 0.02
# Zeros looked for, and Newton steps to each.
ZEROS, STEPS = 30, 40


@dataclass(frozen=True, eq=False)
class Factors(FrozenArrays):
    """
    The singular factors of an arm; none for an arm without.

    Attributes
    ----------
    names, texts
        As in the robot file; behind them the closed loops, whose factors are the determinants of
        their residuals' slopes by their passive joints. The tape does not have those.
    approximate
        For each whether it is that of a table without corrections.
    complete
        Whether their product, with whole powers, is the determinant up to a constant: then every
        singular pose is a zero of one of them.
    operations : shape (steps, 3), constants : shape (steps,)
        Operation and operands of each step of the tape; its constant, or its scale.
    ends : shape (factors,)
        The step that holds each factor's value.
    """

    names: tuple[str, ...]
    texts: tuple[str, ...]
    approximate: tuple[bool, ...]
    complete: bool
    operations: Integers
    constants: Floats
    ends: Integers

    @cached_property
    def tape(self) -> kernel.Tape:
        """Return the tape as the kernel reads it."""
        return kernel.Tape(self.operations, self.constants, self.ends)

    def __bool__(self) -> bool:
        return bool(self.names)

    def may_name(self, k: int, away: float, distance: float) -> bool:
        """
        Return whether a factor whose zero is `away` names a singular pose at a distance, rad.

        An incomplete list may lack the factor of that pose. A loop is named where it is nearer to
        flat than the arm is to a singular pose.
        """
        if self.is_loop(k):
            return away <= distance
        nearly = NEARLY if self.approximate[k] else 0.0
        return self.complete or away <= 1.5 * distance + nearly

    def is_loop(self, k: int) -> bool:
        """Return whether a factor is the determinant of a closed loop."""
        return k >= len(self.ends)

    def called(self, k: int) -> str:
        """Return the name of a factor, with a word if it is approximate."""
        return f'{self.names[k]} (approximately)' if self.approximate[k] else self.names[k]

    def evaluate(self, q: Floats) -> Floats:
        """
        Return value and gradient of each factor of the file, (N, factors, 1 + n), of q (N, n).

        Gradients are by rad and m.
        """
        results = np.empty((len(q), len(self.ends), 1 + q.shape[1]))
        kernel.evaluate_factors(self.tape, q, results)
        return results


def motions_to_zeros(results: Floats, column_scales: Floats) -> Floats:
    """
    Return the joint motion to each factor's nearest zero by first order, (..., factors, n).

    In rad and m; zero where the factor does not change.

    Parameters
    ----------
    results : shape (..., factors, 1 + n)
        As `Factors.evaluate` returns them.
    column_scales : shape (n,)
        What a unit of each joint counts in rad: the characteristic length for prismatic ones.
    """
    scaled = results[..., 1:] * column_scales
    squares = np.sum(scaled**2, axis=-1)
    step = np.divide(results[..., 0], squares, out=np.zeros_like(squares), where=squares > 0.0)
    return np.asarray(-step[..., None] * scaled * column_scales)


class _TapeBuilder:
    """Collects the steps of several expressions."""

    def __init__(self, description: RobotDescription) -> None:
        self.steps: list[tuple[int, int, int]] = []
        self.numbers: list[float] = []
        angle, length = description.radians, description.metres
        self._angle = angle
        self._constants = {'pi': math.pi, **{one.name: one.value for one in description.constants}}
        # A variable counts in the file's unit: its number on the tape is file units per SI unit.
        self._variables = {
            joint.variable: (j, 1.0 / (length if joint.type == 'prismatic' else angle))
            for j, joint in enumerate(description.joints)
        }

    def add(self, text: str) -> int:
        """Add an expression that the reader has accepted; return the step of its value."""
        return evaluated(syntax_tree(text, lambda _: None), self._step)

    def _step(self, said: float | str, operands: list[int]) -> int:
        if isinstance(said, float):
            return self._append(kernel.CONSTANT, 0, 0, said)
        if operands:
            number = self._angle if said in ARGUMENTS_OF else 1.0
            return self._append(_OPERATIONS[said], operands[0], operands[-1], number)
        if said in self._variables:
            j, scale = self._variables[said]
            return self._append(kernel.JOINT, j, 0, scale)
        return self._append(kernel.CONSTANT, 0, 0, self._constants[said])

    def _append(self, operation: int, first: int, second: int, number: float) -> int:
        self.steps.append((operation, first, second))
        self.numbers.append(number)
        return len(self.steps) - 1


_OPERATIONS = {
    '+': kernel.SUM,
    '-': kernel.DIFFERENCE,
    '*': kernel.PRODUCT,
    '/': kernel.QUOTIENT,
    'neg': kernel.NEGATIVE,
    'sin': kernel.SINE,
    'cos': kernel.COSINE,
    'sqrt': kernel.SQUARE_ROOT,
    'atan2': kernel.ARC_TANGENT,
}


def read_factors(description: RobotDescription, chain: Chain, task: Task, q: Floats) -> Factors:
    """
    Return the factors of a robot file, checked against the arm.

    Parameters
    ----------
    description, chain, task
        The arm.
    q : shape (N, n), rad or m
        Poses to check at: the seeded ones.

    Raises
    ------
    KinematicsError
        A zero of a factor is no singular pose, or not nearly one if it is approximate; the message
        names it and the pose.
    """
    tape = _TapeBuilder(description)
    ends = [tape.add(factor.text) for factor in description.singularity.factors]
    factors = Factors(
        names=tuple(factor.name for factor in description.singularity.factors),
        texts=tuple(factor.text for factor in description.singularity.factors),
        approximate=tuple(factor.approximate for factor in description.singularity.factors),
        complete=False,
        operations=np.array(tape.steps, dtype=np.int64).reshape(-1, 3),
        constants=np.array(tape.numbers),
        ends=np.array(ends, dtype=np.int64),
    )
    if not factors:
        return factors
    if _product_is_the_determinant(factors, chain, task, q):
        return replace(factors, complete=True)
    for k, name in enumerate(factors.names):
        _check_zeros(factors, k, name, chain, task, q[:ZEROS])
    return factors


def with_loops(factors: Factors, description: RobotDescription, chain: Chain) -> Factors:
    """Return the factors with the determinants of an arm's closed loops behind them."""
    if chain.loops == 0:
        return factors
    groups = loop_groups(description.loops)
    names = tuple(map(group_name, groups))
    texts = tuple(
        f'det(d closure / d ({", ".join(joint.name for joint in passive_of(group))}))'
        for group in groups
    )
    return replace(
        factors,
        names=factors.names + names,
        texts=factors.texts + texts,
        approximate=factors.approximate + (False,) * len(names),
        complete=False,
    )


def _product_is_the_determinant(factors: Factors, chain: Chain, task: Task, q: Floats) -> bool:
    if not task.square or task.structurally_deficient:
        return False
    determinants = np.abs(np.linalg.det(_task_jacobians(chain, task, q)))
    values = np.abs(factors.evaluate(q)[..., 0])
    # Not np.median: it imports a package for the start of every node.
    usable = determinants > TOO_SINGULAR * np.sort(determinants)[len(determinants) // 2]
    usable &= np.all(values > 0.0, axis=1)
    if np.sum(usable) <= 2 * len(factors.names):
        return False
    logs = np.log(values[usable])
    target = np.log(determinants[usable])
    columns = np.column_stack([np.ones(len(logs)), logs])
    powers = np.round(np.linalg.lstsq(columns, target, rcond=None)[0][1:])
    if np.any(powers < 1.0):
        return False
    rest = target - logs @ powers
    return bool(np.ptp(rest) < SAME)


def _check_zeros(factors: Factors, k: int, name: str, chain: Chain, task: Task, q: Floats) -> None:
    scales = task.column_scales
    zero = np.array(q)
    for _ in range(STEPS):
        zero = zero + motions_to_zeros(factors.evaluate(zero), scales)[:, k]
    reached = np.abs(factors.evaluate(zero)[:, k, 0]) < 1e-12
    if not np.any(reached):
        return
    zero = zero[reached]
    sigma = np.linalg.svd(_task_jacobians(chain, task, zero), compute_uv=False)
    share = sigma[:, task.generic_rank - 1] / sigma[:, 0]
    worst = int(np.argmax(share))
    if share[worst] > (NEARLY_SINGULAR if factors.approximate[k] else SINGULAR):
        pose = ', '.join(f'{x:.4g}' for x in zero[worst])
        raise KinematicsError(
            f'factor {name!r} ({factors.texts[k]}) is zero at q = [{pose}], which is no singular '
            f'pose: the smallest singular value there is {share[worst]:.2g} of the largest'
        )


def _task_jacobians(chain: Chain, task: Task, q: Floats) -> Floats:
    # The scaled J_t at joint positions q (N, n), shape (N, m, n).
    _, J = poses_and_jacobians(chain, q)
    halves = task.rotation.T @ J.reshape(len(J), 2, 3, chain.dof)
    J_t = halves.reshape(J.shape)[:, task.axes]
    return np.asarray(J_t * task.row_scales[:, None] * task.column_scales)
