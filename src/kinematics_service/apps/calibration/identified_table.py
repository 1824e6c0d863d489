"""The corrections of a table, and what they leave open of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.arm_errors import TableErrors, joint_screws, screws_in_frames
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, motion_of, poses_of
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
from .checking import unit_of, value_in_words
from .knowledge import KNOWN

# A robot is the calibrated one if its poses are (m, rad): its file has printed digits.
SAME = 1e-8


@dataclass(frozen=True)
class CalibratedParameter(ArmParameter):
    """
    A parameter after the calibration; angles are in rad, lengths in m, a lag in s.

    Attributes
    ----------
    correction
        What is added to the nominal number; of a gear ratio a share of it.
    deviation
        Standard deviation of the correction.
    prior
        Standard deviation before.
    """

    correction: float = 0.0
    deviation: float = 0.0
    prior: float = 0.0

    @property
    def unit(self) -> str:
        """Return the SI unit of its numbers, empty of a share."""
        return unit_of(self)

    def in_words(self, value: float) -> str:
        """Return a correction or a deviation of it in words, with the unit of its kind."""
        return value_in_words(value, self.unit)

    @property
    def may_be_zero(self) -> bool:
        """Return whether zero lies within two deviations of the correction."""
        return abs(self.correction) <= 2.0 * self.deviation

    @property
    def identifiable(self) -> bool:
        """Return whether the poses identify it; else it mostly stays where its prior has it."""
        # Of base and tool nothing was known before: they are measured by usual errors.
        before = self.prior if self.group in TABLE_GROUPS else min(self.prior, self.scale)
        return KNOWN * self.deviation < before


@dataclass(frozen=True, eq=False)
class IdentifiedTable(FrozenArrays):
    """
    Corrections of a table, and how well they are known.

    Attributes
    ----------
    robot
        The nominal robot.
    parameters : P
        Those that were fitted.
    covariance : shape (P, P), rad and m
        Of their corrections.
    """

    robot: Robot
    parameters: tuple[CalibratedParameter, ...]
    covariance: Floats

    def fitted_of(self, names: Sequence[str]) -> tuple[list[int], list[int]]:
        """Return which of some names were fitted, and where these stand among the parameters."""
        at = {one.name: k for k, one in enumerate(self.parameters)}
        own = [k for k, name in enumerate(names) if name in at]
        return own, [at[names[k]] for k in own]

    def table_errors(self, robot: Robot, q: Floats) -> TableErrors:
        """
        Return what is open of the table; `robot` is the calibrated one.

        Raises
        ------
        CalibrationError
            It has other poses at q (..., n) than were found.
        """
        errors = calibrated_errors(robot, self)
        check_arm(robot, self, q)
        return errors


class TableCorrections(NamedTuple):
    """
    The corrections of a calibrated arm.

    Attributes
    ----------
    chain, values : P
        From base to tool, and all its corrections, rad and m.
    columns, fitted
        Of those that were fitted, where they stand in `values`, and in the calibration.
    """

    chain: CorrectedChain
    values: Floats
    columns: list[int]
    fitted: list[int]


def table_corrections(
    robot: Robot, found: IdentifiedTable, ends: bool = False
) -> TableCorrections:
    """Return the corrections of an arm as `calibrated_errors` takes it."""
    if robot.dof != found.robot.dof:
        raise CalibrationError(f'the calibration is one of {found.robot.name}')
    gears = any(one.group == GEARS for one in found.parameters)
    arm = parameters_of(found.robot, gears)
    count = len(arm.table)
    names = [one.name for one in arm.table]
    if ends:
        names += [one.name for end in ENDS for one in end_parameters(end, 0)]
    columns, fitted = found.fitted_of(names)
    values = np.zeros(count + 2 * len(SIX))
    values[columns] = [found.parameters[k].correction for k in fitted]
    description = robot.description
    base = description.base.motion.matrix @ inverse(motion_of(values[count:][:6]))
    tool = inverse(motion_of(values[count + 6 :])) @ description.tool.motion.matrix
    chain = placement(arm.chain, base, tool, (count, count + len(SIX)))
    return TableCorrections(chain, values, columns, fitted)


def calibrated_errors(robot: Robot, found: IdentifiedTable, ends: bool = False) -> TableErrors:
    """
    Return what a calibration left open of its table.

    Parameters
    ----------
    robot
        The calibrated arm, as written or as `calibrated`.
    ends
        Whether base and tool, of the first set, are those of the measured poses: then what is
        open of them counts, too.

    Raises
    ------
    CalibrationError
        The calibration is one of another arm.
    """
    own = table_corrections(robot, found, ends)
    frames, screws = screws_in_frames(robot, own.chain, own.values)
    factor = factor_of(found.covariance[np.ix_(own.fitted, own.fitted)])
    of_gear = {gear.column: gear.joint for gear in own.chain.gears}
    rows = [k for k, column in enumerate(own.columns) if column not in of_gear]
    columns = [own.columns[k] for k in rows]
    parts = [TableErrors(frames[columns], screws[columns], np.full(len(rows), -1), factor[rows])]
    # A share of the nominal gear ratio, as one of the calibrated one.
    moving = joint_screws(robot)
    for k, column in enumerate(own.columns):
        if column in of_gear:
            at = np.flatnonzero(moving.joints == of_gear[column])
            share = factor[[k] * len(at)] / (1.0 + own.values[column])
            parts.append(
                TableErrors(moving.frames[at], moving.screws[at], moving.joints[at], share)
            )
    return TableErrors(*(np.concatenate(arrays) for arrays in zip(*parts)))


def factor_of(covariance: Floats) -> Floats:
    """Return F of a covariance F F^T (P, P)."""
    deviations = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(deviations, deviations))
    return np.asarray(deviations[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def check_arm(robot: Robot, found: IdentifiedTable, q: Floats) -> None:
    """
    Refuse a robot that does not have the calibrated poses at joint positions (..., n).

    Raises
    ------
    CalibrationError
        The calibration is one of another arm.
    """
    own = table_corrections(robot, found)
    state = evaluate(robot, np.reshape(q, (-1, robot.dof)), depth=kernel.POSE)
    lengths, angles = apart(poses_of(own.chain, own.values, state.q), state.pose)
    if max(np.max(lengths, initial=0.0), np.max(angles, initial=0.0)) > SAME:
        raise CalibrationError(
            f'the calibration of {found.robot.name} is one of another arm: '
            'give the calibrated robot'
        )
