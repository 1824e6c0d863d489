# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the uncertainty of a calibrated table, and find parameters whose effects the poses do not
distinguish.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.arm_errors import TableErrors, joint_screws, screws_in_frames
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, poses_of, small_motion
from ...kinematics.uncertainty.parameters import parameters_of, placement
from ...rigid_motion import apart, inverse
from ...robot.chain import FrozenArrays
from ...robot.file.parts.parameters import (
    ENDS,
    GEARS,
    SIX,
    TABLE_GROUPS,
    ArmParameter,
    end_parameters,
)
from ...robot.robot import Robot
from ...typography import listed
from ..checking.errors import angle_in_words, length_in_words, time_in_words
from .checking import COMPLIANCE, LAG, NAMES_IN_SENTENCE

# A combination of parameters is identified if the fit divides the standard deviation of the
# combination by this factor or more.
MIN_DEVIATION_RATIO = 3.0
# The null space of the Jacobian contains the combinations of parameters without effect on the
# poses. Entries of the projector onto the null space are taken as round-off if they are below this
# value.
PROJECTOR_TOLERANCE = 1e-6
# A singular value of the Jacobian is taken as round-off if its ratio to the largest singular value
# is below this.
SINGULAR_VALUE_RATIO = 1e-9
# A robot is taken for the calibrated robot if their poses differ by at most this value (m, rad).
# Small differences arise, because the robot file rounds numbers.
POSE_TOLERANCE = 1e-8


@dataclass(frozen=True)
class CalibratedParameter(ArmParameter):
    """
    A fitted parameter with its correction; angles are in rad, lengths in m, a lag in s.

    Attributes
    ----------
    correction
        The number that is added to the nominal number; for a gear ratio a relative change.
    deviation
        Standard deviation of the correction after the fit.
    prior
        Standard deviation of the correction before the fit.
    """

    correction: float = 0.0
    deviation: float = 0.0
    prior: float = 0.0

    @property
    def unit(self) -> str:
        """
        Return the SI unit of the correction and its standard deviations; empty for a relative
        change.
        """
        plain, yields = ('rad', 'rad/Nm') if self.angle else ('m', 'm/N')
        return {LAG.group: 's', GEARS: '', COMPLIANCE: yields}.get(self.group, plain)

    def in_words(self, value: float) -> str:
        """
        Return a correction, or its standard deviation, as text with the unit of the parameter.
        """
        of_unit = {'rad': angle_in_words, 'm': length_in_words, 's': time_in_words}
        if self.unit in of_unit:
            return of_unit[self.unit](value)
        return f'{value:.3g} {self.unit}' if self.unit else f'{100 * value:.3g} %'

    @property
    def may_be_zero(self) -> bool:
        """Return whether zero lies within two standard deviations of the correction."""
        return abs(self.correction) <= 2.0 * self.deviation

    @property
    def identifiable(self) -> bool:
        """
        Return whether the poses identify the parameter. If not, its prior keeps it near the
        nominal value.
        """
        # Compare the standard deviation of the correction after the fit with the prior one. The
        # priors of base and tool are wide. So for parameters outside the table, use `scale`
        # instead of the prior if `scale` is smaller. `scale` is the usual error of the parameter.
        before = self.prior if self.group in TABLE_GROUPS else min(self.prior, self.scale)
        return MIN_DEVIATION_RATIO * self.deviation < before


@dataclass(frozen=True, eq=False)
class IdentifiedTable(FrozenArrays):
    """
    Corrections of the numbers of a robot's table, with their covariance.

    Attributes
    ----------
    robot
        The nominal robot.
    parameters : P
        The parameters that were fitted.
    covariance : shape (P, P), rad and m
        The covariance of the corrections of `parameters`.
    """

    robot: Robot
    parameters: tuple[CalibratedParameter, ...]
    covariance: Floats

    def fitted_of(self, names: Sequence[str]) -> tuple[list[int], list[int]]:
        """
        Return two lists for those parameters in `names` that are fitted: their indices in `names`,
        and their indices in `parameters`.
        """
        at = {parameter.name: k for k, parameter in enumerate(self.parameters)}
        fitted = [k for k, name in enumerate(names) if name in at]
        return fitted, [at[names[k]] for k in fitted]

    def table_errors(self, robot: Robot, q: Floats) -> TableErrors:
        """
        Return the uncertainty of the calibrated table.

        `robot` must be the calibrated robot. This is tested at the joint positions q (..., n).

        Raises
        ------
        CalibrationError
            At q, the poses of `robot` differ from the poses of the calibrated robot.
        """
        errors, corrections = calibrated_errors(robot, self), table_corrections(robot, self)
        state = evaluate(robot, np.reshape(q, (-1, robot.dof)), depth=kernel.POSE)
        off = apart(poses_of(corrections.chain, corrections.values, state.q), state.pose)
        if np.max(off, initial=0.0) > POSE_TOLERANCE:
            raise CalibrationError(
                f'calibration: it belongs to a {self.robot.name} with other numbers; give the '
                'calibrated robot',
                code='mismatch',
            )
        return errors


class TableCorrections(NamedTuple):
    """
    The corrections of a calibrated arm.

    Attributes
    ----------
    chain, values : P
        The chain from base to tool, and all corrections of the chain, rad and m.
    columns, fitted
        Two indices of each fitted parameter: `columns` in the array `values`, `fitted` in the list
        `parameters` of the calibration.
    """

    chain: CorrectedChain
    values: Floats
    columns: list[int]
    fitted: list[int]


def table_corrections(
    robot: Robot, table: IdentifiedTable, ends: bool = False
) -> TableCorrections:
    """
    Return the corrections of a calibrated arm, with the kinematic chain of the arm.

    Parameters
    ----------
    robot
        The calibrated arm.
    table
        The corrections that the calibration identified.
    ends
        True: base and tool of `robot` were fitted by the calibration. If the calibration has
        several sets of poses, base and tool were fitted to the first set. False: base and tool of
        `robot` are those of the robot file.
    """
    if robot.dof != table.robot.dof:
        raise CalibrationError(
            f'calibration: it belongs to {table.robot.name}, not to {robot.name}; give the '
            'calibrated robot',
            code='mismatch',
        )
    gears = any(parameter.group == GEARS for parameter in table.parameters)
    arm = parameters_of(table.robot, gears)
    count = len(arm.table)
    names = [parameter.name for parameter in arm.table]
    if ends:
        names += [parameter.name for end in ENDS for parameter in end_parameters(end, 0)]
    columns, fitted = table.fitted_of(names)
    values = np.zeros(count + 2 * len(SIX))
    values[columns] = [table.parameters[k].correction for k in fitted]
    description = robot.description
    base = description.base.motion.matrix @ inverse(motion_of(values[count:][:6]))
    tool = inverse(motion_of(values[count + 6 :])) @ description.tool.motion.matrix
    chain = placement(arm.chain, base, tool, (count, count + len(SIX)))
    return TableCorrections(chain, values, columns, fitted)


def calibrated_errors(robot: Robot, table: IdentifiedTable, ends: bool = False) -> TableErrors:
    """
    Return the uncertainty of the table after a calibration, as a factor F of the covariance F F^T.

    Parameters
    ----------
    robot
        The calibrated arm, read from its written file or taken from `Calibration.calibrated`.
    ends
        True: base and tool of `robot` were fitted by the calibration, and their uncertainty is
        included. If the calibration has several sets of poses, base and tool were fitted to the
        first set. False: base and tool of `robot` are those of the robot file.

    Raises
    ------
    CalibrationError
        The number of joints shows that `robot` is not the calibrated arm.
    """
    corrections = table_corrections(robot, table, ends)
    frames, screws = screws_in_frames(robot, corrections.chain, corrections.values)
    # Compute a factor F of the covariance F F^T of the fitted corrections.
    covariance = table.covariance[np.ix_(corrections.fitted, corrections.fitted)]
    deviations = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(deviations, deviations))
    factor = np.asarray(deviations[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
    of_gear = {gear.column: gear.joint for gear in corrections.chain.gears}
    rows = [k for k, column in enumerate(corrections.columns) if column not in of_gear]
    columns = [corrections.columns[k] for k in rows]
    parts = [TableErrors(frames[columns], screws[columns], np.full(len(rows), -1), factor[rows])]
    # Each row of `factor` belongs to one parameter. The row of a gear ratio is for a change
    # relative to the nominal ratio. Convert this row to a change relative to the calibrated ratio.
    moving = joint_screws(robot)
    for k, column in enumerate(corrections.columns):
        if column in of_gear:
            at = np.flatnonzero(moving.joints == of_gear[column])
            row = factor[[k] * len(at)] / (1.0 + corrections.values[column])
            parts.append(TableErrors(moving.frames[at], moving.screws[at], moving.joints[at], row))
    return TableErrors(*(np.concatenate(arrays) for arrays in zip(*parts)))


class ParameterCombination(NamedTuple):
    """
    A set of parameters that the poses determine only in combinations.

    Attributes
    ----------
    names
        The names of the parameters.
    determined
        Number of combinations of these parameters that the poses determine.
    coefficients
        Coefficients (per rad and m) of the determined combination, if there is exactly one; else
        empty. The first coefficient is 1.
    sentence
        Names and combination as text.
    """

    names: tuple[str, ...]
    determined: int
    coefficients: tuple[float, ...]
    sentence: str


def structural_rank(J: Floats) -> int:
    """
    Return the rank of a scaled Jacobian of the poses by parameters; singular values below
    round-off are taken as zero.
    """
    values = np.linalg.svd(J, compute_uv=False)
    return int(np.sum(values > SINGULAR_VALUE_RATIO * values[0])) if len(values) else 0


def motion_of(six: Floats) -> Floats:
    """Convert corrections x y z rx ry rz of a base or tool to a transformation (4, 4)."""
    T = np.eye(4)
    for k, value in enumerate(six.tolist()):
        T = T @ small_motion(k > 2, k % 3, value)
    return T


def combinations_of(
    J: Floats, parameters: Sequence[ArmParameter]
) -> tuple[ParameterCombination, ...]:
    """
    Return the sets of parameters whose effects on the poses cannot be distinguished.

    Parameters
    ----------
    J : shape (rows, P)
        Jacobian: the motion of the poses for a usual error of each parameter.
    """
    # Rows of `null` span the null space of J (combinations of parameters that do not move the
    # poses), up to round-off.
    null = np.linalg.svd(J, full_matrices=len(J) < J.shape[1])[2][structural_rank(J) :]
    # If the parameters are sorted suitably, the projector onto the null space of J is block
    # diagonal. Each block belongs to a set of parameters that the poses do not determine
    # separately.
    projector = null.T @ null
    projector[np.abs(projector) < PROJECTOR_TOLERANCE] = 0.0
    sets: list[set[int]] = []
    for row in projector[np.any(projector, axis=1)]:
        members = set(np.flatnonzero(row).tolist())
        for other in [group for group in sets if group & members]:
            members |= other
            sets.remove(other)
        sets.append(members)
    sets.sort(key=min)
    return tuple(_combination(sorted(members), projector, parameters) for members in sets)


def _combination(
    columns: Sequence[int], projector: Floats, parameters: Sequence[ArmParameter]
) -> ParameterCombination:
    block = projector[np.ix_(columns, columns)]
    chosen = [parameters[k] for k in columns]
    names = tuple(parameter.name for parameter in chosen)
    determined, shown = len(columns) - round(np.trace(block)), listed(names, NAMES_IN_SENTENCE)
    if determined == 0:
        return ParameterCombination(names, 0, (), f'not identifiable: {shown}')
    if determined > 1:
        sentence = f'only {determined} combinations of {shown} are identifiable'
        return ParameterCombination(names, determined, (), sentence)
    # The poses determine one linear combination of the parameters. The coefficients of this
    # combination are orthogonal to the null space of the Jacobian.
    seen = np.linalg.svd(block)[2][-1] / np.array([parameter.scale for parameter in chosen])
    seen = seen / seen[0]
    others = ' '.join(map(_term, seen[1:].tolist(), names[1:]))
    sentence = f'only {names[0]} {others} is identifiable, not each of them'
    return ParameterCombination(names, 1, tuple(seen.tolist()), sentence)


def _term(coefficient: float, name: str) -> str:
    size = abs(coefficient)
    factor = '' if f'{size:.3g}' == '1' else f'{size:.3g} '
    return f'{"-" if coefficient < 0.0 else "+"} {factor}{name}'
