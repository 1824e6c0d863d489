# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate the singular factors of an arm: named functions of q that are zero at singular poses.

The expressions of the factors become a tape, which is a list of elementary operations. The kernel
computes all values and gradients in one pass over the tape (forward-mode automatic
differentiation).
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

# Largest variation, over sampled joint positions, of log|det J_t| - sum(k log|f|), where k is the
# power of factor f. If the variation is smaller, det J_t counts as a constant times the product of
# the f^k. The tolerance is above the round-off of log|det J_t|, because det J_t has a relative
# error below 1e-12 away from its zeros.
LOG_DIFFERENCE_TOLERANCE = 1e-9
# Compare the product of the factors with det J_t only at poses where |det J_t| is at least this
# fraction of its median over the sampled poses. Closer to 0, the relative round-off of the
# determinant is large.
MIN_DETERMINANT_RATIO = 1e-3
# A zero of a factor counts as a singular pose if the smallest singular value of J_t is at most
# this fraction of the largest singular value.
SINGULAR_VALUE_RATIO = 1e-6
# Largest ratio of the smallest to the largest singular value of J_t that is accepted at a zero of
# an approximate factor. An approximate factor was derived from the table before the table was
# calibrated.
APPROXIMATE_SINGULAR_VALUE_RATIO = 0.03
# Largest accepted distance from a zero of an approximate factor to the nearest singular pose, rad.
APPROXIMATE_ZERO_DISTANCE = 0.02
CHECKED_ZEROS = 30  # number of starts of the search for zeros of a factor
NEWTON_STEPS = 40  # Newton iterations from each start


@dataclass(frozen=True, eq=False)
class Factors(FrozenArrays):
    """
    The singular factors of an arm; empty if the arm has none.

    Attributes
    ----------
    names, texts
        Names and expressions of the factors in the robot file, then of the factors of closed
        loops. The factor of a loop is the determinant of the derivatives of the loop equations by
        the passive joints.
    approximate
        For each factor, whether it was derived from the table before the table was calibrated.
    complete
        Whether a product of powers of the factors is the determinant of J_t up to a constant. If
        so, every singular pose is a zero of a factor.
    operations : shape (steps, 3), constants : shape (steps,)
        The tape: a list of elementary operations (steps) that computes the factors of the robot
        file, but not the factors of loops. For each step, `operations` has the code of the
        operation and the indices of two steps: their values are the operands. `constants` has a
        number c for each step, and the operation decides what c means. A step for a constant
        number has the value c. A step that reads a joint position multiplies the position (rad or
        m) by c, which converts it to the file's unit. For sin, cos and atan2, c is the file's unit
        of angles in rad.
    ends : shape (factors,)
        For each factor on the tape, the index of the step that computes its value.
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
        """Return the tape (elementary operations) of the factors as an object of the kernel."""
        return kernel.Tape(self.operations, self.constants, self.ends)

    def __bool__(self) -> bool:
        return bool(self.names)

    def may_name(self, k: int, away: float, distance: float) -> bool:
        """
        Return whether a message may name factor k as the cause of the nearest singular pose.

        The factor of a closed loop may be named if `away` <= `distance`. A factor of the robot
        file may always be named if the attribute `complete` is true. If `complete` is false, the
        cause may be none of the factors. Then a factor of the robot file may be named only if
        `away` is at most about 1.5 `distance`.

        Parameters
        ----------
        k
            The index of the factor.
        away
            The distance from the present pose to the nearest zero of factor k, rad.
        distance
            The distance from the present pose to the nearest singular pose, rad.
        """
        if self.is_loop(k):
            return away <= distance
        tolerance = APPROXIMATE_ZERO_DISTANCE if self.approximate[k] else 0.0
        return self.complete or away <= 1.5 * distance + tolerance

    def is_loop(self, k: int) -> bool:
        """Return whether factor k is the determinant of a closed loop's equations."""
        return k >= len(self.ends)

    def called(self, k: int) -> str:
        """Return the name of factor k, followed by `(approximately)` if it is approximate."""
        return f'{self.names[k]} (approximately)' if self.approximate[k] else self.names[k]

    def evaluate(self, q: Floats) -> Floats:
        """
        Return value and gradient of each factor of the robot file at q, (N, factors, 1 + n).

        `q` has shape (N, n), rad or m. Gradients are per rad or m of the joint position.
        """
        results = np.empty((len(q), len(self.ends), 1 + q.shape[1]))
        kernel.evaluate_factors(self.tape, q, results)
        return results


def motions_to_zeros(results: Floats, column_scales: Floats) -> Floats:
    """
    Return one Newton step towards a zero of each factor, (..., factors, n), rad or m.

    The step of a factor is zero if its gradient is zero.

    Parameters
    ----------
    results : shape (..., factors, 1 + n)
        Values and gradients of the factors, as `Factors.evaluate` returns them.
    column_scales : shape (n,)
        1 for a joint that turns, the characteristic length for a prismatic joint.
    """
    scaled = results[..., 1:] * column_scales
    squares = np.sum(scaled**2, axis=-1)
    step = np.divide(results[..., 0], squares, out=np.zeros_like(squares), where=squares > 0.0)
    return np.asarray(-step[..., None] * scaled * column_scales)


def _taped(description: RobotDescription) -> Factors:
    # Return the factors of a robot file. Convert the expressions of all factors into one tape, a
    # list of elementary operations.
    factors = description.singularity.factors
    steps: list[tuple[int, int, int]] = []
    numbers: list[float] = []
    angle, length = description.radians, description.metres
    constants = {'pi': math.pi}
    constants |= {constant.name: constant.value for constant in description.constants}
    # Map each joint variable to the index of its joint, and to the factor from rad or m to the
    # file's unit.
    variables = {
        joint.variable: (j, 1.0 / (length if joint.type == 'prismatic' else angle))
        for j, joint in enumerate(description.joints)
    }

    def add_step(symbol: float | str, operands: list[int]) -> int:
        if isinstance(symbol, float):
            step, number = (kernel.CONSTANT, 0, 0), symbol
        elif operands:
            step = (_OPERATIONS[symbol], operands[0], operands[-1])
            number = angle if symbol in ARGUMENTS_OF else 1.0
        elif symbol in variables:
            j, number = variables[symbol]
            step = (kernel.JOINT, j, 0)
        else:
            step, number = (kernel.CONSTANT, 0, 0), constants[symbol]
        steps.append(step)
        numbers.append(number)
        return len(steps) - 1

    ends = [evaluated(syntax_tree(factor.text, lambda _: None), add_step) for factor in factors]
    return Factors(
        names=tuple(factor.name for factor in factors),
        texts=tuple(factor.text for factor in factors),
        approximate=tuple(factor.approximate for factor in factors),
        complete=False,
        operations=np.array(steps, dtype=np.int64).reshape(-1, 3),
        constants=np.array(numbers),
        ends=np.array(ends, dtype=np.int64),
    )


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
    Return the factors of a robot file; check that their zeros are singular poses of the arm.

    Parameters
    ----------
    description, chain, task
        The arm.
    q : shape (N, n), rad or m
        Joint positions at which the factors are compared with the determinant of J_t, and at which
        the search for zeros of the factors starts.

    Raises
    ------
    KinematicsError
        A zero of a factor is not a singular pose, or a zero of an approximate factor is not close
        to a singular pose. The message names the factor and the pose.
    """
    factors = _taped(description)
    if not factors:
        return factors
    if _product_is_the_determinant(factors, chain, task, q):
        return replace(factors, complete=True)
    for k, name in enumerate(factors.names):
        _check_zeros(factors, k, name, chain, task, q[:CHECKED_ZEROS])
    return factors


def with_loops(factors: Factors, description: RobotDescription, chain: Chain) -> Factors:
    """
    Return the factors of an arm with one more factor for each group of closed loops.

    The factor of a group is the determinant of the derivatives of the group's loop equations by
    the group's passive joints.
    """
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
    # Sort the determinants to find the median. np.median would import another package and delay
    # the start of a node.
    usable = determinants > MIN_DETERMINANT_RATIO * np.sort(determinants)[len(determinants) // 2]
    usable &= np.all(values > 0.0, axis=1)
    if np.sum(usable) <= 2 * len(factors.names):
        return False
    logs = np.log(values[usable])
    target = np.log(determinants[usable])
    columns = np.column_stack([np.ones(len(logs)), logs])
    powers = np.round(np.linalg.lstsq(columns, target, rcond=None)[0][1:])
    if np.any(powers < 1.0):
        return False
    residual = target - logs @ powers
    return bool(np.ptp(residual) < LOG_DIFFERENCE_TOLERANCE)


def _check_zeros(factors: Factors, k: int, name: str, chain: Chain, task: Task, q: Floats) -> None:
    scales = task.column_scales
    zero = np.array(q)
    for _ in range(NEWTON_STEPS):
        zero = zero + motions_to_zeros(factors.evaluate(zero), scales)[:, k]
    zero = zero[np.abs(factors.evaluate(zero)[:, k, 0]) < 1e-12]
    if not len(zero):
        return
    sigma = np.linalg.svd(_task_jacobians(chain, task, zero), compute_uv=False)
    ratios = sigma[:, task.generic_rank - 1] / sigma[:, 0]
    worst, approximate = int(np.argmax(ratios)), factors.approximate[k]
    limit = APPROXIMATE_SINGULAR_VALUE_RATIO if approximate else SINGULAR_VALUE_RATIO
    if ratios[worst] > limit:
        pose = ', '.join(f'{x:.4g}' for x in zero[worst])
        raise KinematicsError(
            f'factor {name!r} ({factors.texts[k]}) is zero at q = [{pose}], which is not a '
            f'singular pose: the smallest singular value is {ratios[worst]:.2g} of the largest; '
            'delete or correct the factor',
            code='wrong-factor',
        )


def _task_jacobians(chain: Chain, task: Task, q: Floats) -> Floats:
    # Return the scaled Jacobian of the task rows, J_t (N, m, n), at joint positions q (N, n).
    _, J = poses_and_jacobians(chain, q)
    halves = task.rotation.T @ J.reshape(len(J), 2, 3, chain.dof)
    J_t = halves.reshape(J.shape)[:, task.axes]
    return np.asarray(J_t * task.row_scales[:, None] * task.column_scales)
