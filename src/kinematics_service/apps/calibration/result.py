# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The result of a calibration: corrections, residuals, and identifiable parameters."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...robot.file.parts.parameters import TABLE_GROUPS
from ...robot.robot import Robot
from ..checking.diagnosis import FrameDiagnosis
from ..checking.errors import Errors, errors_of, length_in_words
from ..recordings.readers.block import Flags
from .board_views import BoardViews
from .camera import Camera
from .checking import in_words
from .chosen_parameters import TouchedPoint
from .explanations import RefusalCauses
from .fitting import UNKNOWN_NOISE_FREEDOM, Noise
from .identified_table import MIN_DEVIATION_RATIO, IdentifiedTable, ParameterCombination

# Number of blocks into which the measurements are divided for cross-validation. Each block is once
# left out of the fit and then predicted (held out).
BLOCKS = 5


class FitErrors(NamedTuple):
    """
    Errors of the measured poses, with different groups of parameters fitted.

    Attributes
    ----------
    as_given
        Errors with the unchanged robot file.
    before
        Errors with only base and tool fitted.
    after
        Errors with all corrections.
    held_out_before, held_out
        Like `before` and `after`, but by cross-validation: the measurements are divided into
        blocks, and the errors of each block are those of a fit to the other blocks.
    """

    as_given: Errors
    before: Errors
    after: Errors
    held_out_before: Errors
    held_out: Errors


@dataclass(frozen=True, eq=False)
class Calibration(IdentifiedTable):
    """
    The result of a calibration: the identified robot, its errors, and the reasons if the
    calibration is refused.

    The calibration was computed from N measurements: poses, positions or touches.

    Attributes
    ----------
    robot, calibrated
        The nominal robot, and this robot with a corrected table; base and tool are unchanged.
    parameters : P
        The fitted parameters.
    covariance : shape (P, P), rad and m
        The covariance of the corrections of `parameters`.
    noise
        Standard deviations of each coordinate of a measured position (m), and of each coordinate
        of a measured rotation vector (rad).
    freedom
        Degrees of freedom of `noise`. Infinite if `noise` is the given noise of the instrument,
        which is not estimated.
    instrument
        The noise of the instrument, as in `noise`, if it was given; else None.
    positions
        Whether only positions were measured.
    outliers
        Indices of the measurements that were left out, the largest error first.
    distances : shape (N,)
        The error of each measurement, in standard deviations of the noise.
    left : shape (5, N, 2, 3), m and rad
        Residuals of position, and of rotation as a rotation vector, in the frame of the poses. The
        first index selects one of the five cases in `FitErrors`, in the order of its fields.
    spare
        Count of measured numbers that remain if the largest block of the cross-validation is left
        out, minus the number of parameters of base and tool. Measurements with equal joint
        positions count as one.
    possible
        How many independent combinations of the parameters can be determined from poses, if enough
        different poses are measured.
    singular_values : shape (P,)
        Singular values of the scaled Jacobian of the poses, descending. Rows of the Jacobian are
        divided by the noise, columns are multiplied by the parameters' prior standard deviations.
    combinations
        Sets of parameters that the measurements do not determine separately.
    base_offsets, tool_offsets : shape (sets, 4, 4)
        Base offset X and tool offset Y of each set. Poses A of the calibrated robot and measured
        poses B satisfy B = X A Y, up to the residuals.
    base_starts, tool_starts : shape (sets, 4, 4)
        Poses of base and tool at which the fit started. The corrections of base and tool are along
        and about the axes of these poses.
    q : shape (N, n), rad or m
        Joint positions of the measurements.
    points
        The touched points, if the calibration is from touches without an instrument; else empty.
    frames
        The result of the frame check; None without one, for example if only positions were
        measured.
    remarks
        Remarks on the measurements and on the fit, as sentences.
    refusals
        Sentences with the reasons against the calibration; empty if it is accepted.
    explained
        Mistakes that would explain a refusal.
    camera
        The place of the camera that saw a board; None without a camera. If it is on the tool,
        measured poses are those of the camera in the frame of the board, and residuals are those
        of the board in the frame of the camera.
    views
        The board in the images, if the poses were found in images.
    """

    calibrated: Robot
    noise: Noise
    freedom: Noise
    instrument: Noise | None
    positions: bool
    outliers: tuple[int, ...]
    distances: Floats
    left: Floats
    spare: int
    possible: int
    singular_values: Floats
    combinations: tuple[ParameterCombination, ...]
    base_offsets: Floats
    tool_offsets: Floats
    base_starts: Floats
    tool_starts: Floats
    q: Floats
    points: tuple[TouchedPoint, ...]
    frames: FrameDiagnosis | None = None
    remarks: tuple[str, ...] = ()
    refusals: tuple[str, ...] = ()
    explained: RefusalCauses = RefusalCauses()
    camera: Camera | None = None
    views: BoardViews | None = None

    @property
    def accepted(self) -> bool:
        """Return whether the calibration is accepted, that is, whether `refusals` is empty."""
        return not self.refusals

    @property
    def worse(self) -> str:
        """
        Return a sentence if cross-validation does not support the calibration; else an empty text.

        Cross-validation divides the measurements into blocks, and predicts each block by a fit to
        the other blocks. There are two sentences:

        1. The predictions are worse with all corrections than with base and tool alone. Condition:
        the corrections increase the mean squared position error of the predictions by more than
        the mean squared noise of a position.

        2. The measurements are too few for cross-validation. Condition (`spare <= 0`): if the
        largest block is left out, the measured numbers suffice at most to fit base and tool.
        """
        kind, more = self.kind, f'measure more {self.kind}, far apart (calibrate-propose)'
        before, after = self.held_out_before.position_rms, self.held_out.position_rms
        if after**2 > before**2 + 3 * self.noise.position**2:
            return (
                f'the calibration makes other {kind} worse: held-out errors are '
                f'{length_in_words(before)} with {self.placed} fitted alone, and '
                f'{length_in_words(after)} with the calibrated table; {more}, or fit less (--fit)'
            )
        if self.spare <= 0:
            return (
                f'held-out {kind} do not judge the calibration: the different {kind} beside them '
                f'do no more than place {self.placed}; {more}'
            )
        return ''

    @property
    def no_better(self) -> bool:
        """
        Return whether the corrections of the table bring no significant gain in cross-validation.

        Two fits predict each measurement: a fit of base and tool alone, and a fit of all
        parameters. The gain is the squared position error of the first prediction minus that of
        the second. The gain is significant if its mean is at least twice the standard deviation of
        the mean (a paired test).
        """
        before, after = np.sum(self.left[3:, self.used, 0] ** 2, axis=2)
        gains = before - after
        return bool(np.mean(gains) < 2.0 * np.std(gains) / np.sqrt(len(gains)))

    @property
    def only_worse(self) -> bool:
        """
        Return whether cross-validation (see `worse`) is the only reason to refuse the calibration.
        Then more measurements help.
        """
        return self.refusals == (self.worse,)

    @property
    def count(self) -> int:
        """Return the number N of measurements (poses, positions or touches)."""
        return len(self.q)

    @property
    def used(self) -> Flags:
        """Return flags (N,): True for the measurements that are not outliers."""
        return ~np.isin(np.arange(self.count), self.outliers)

    @property
    def rows(self) -> str:
        """Return `touches` or `poses`: the word for the measurements in sentences."""
        return 'touches' if self.points else 'poses'

    @property
    def row(self) -> str:
        """Return `touch` or `pose`: the word for one measurement in sentences."""
        return 'touch' if self.points else 'pose'

    @property
    def kind(self) -> str:
        """Return `positions`, `touches` or `poses`: the word for the measured quantity."""
        return 'positions' if self.positions and not self.points else self.rows

    @property
    def placed(self) -> str:
        """
        Return the words for the things that are fitted besides the table: tip and points, or base
        and tool.
        """
        return 'tip and points' if self.points else 'base and tool'

    def rms_in_words(self, errors: Errors) -> str:
        """
        Return RMS errors as text. If only positions were measured, the text has no rotations.
        """
        return in_words(*errors.rms, self.positions)

    @property
    def noise_told(self) -> bool:
        """Return whether enough numbers were measured to estimate the noise."""
        return min(self.freedom) > UNKNOWN_NOISE_FREEDOM

    @property
    def known(self) -> int:
        """
        Return the number of identified combinations of parameters: the fit reduces their standard
        deviation to a third of the prior standard deviation or less.
        """
        return int(np.sum(self.singular_values > MIN_DEVIATION_RATIO))

    @cached_property
    def without(self) -> FitErrors:
        """Return the errors of the measurements that are not outliers."""
        return self._errors(self.used)

    @cached_property
    def with_outliers(self) -> FitErrors:
        """Return the errors of all measurements, outliers included."""
        return self._errors(np.ones_like(self.used))

    def _errors(self, rows: Flags) -> FitErrors:
        return FitErrors(*(errors_of(*np.swapaxes(fit[rows], 0, 1)) for fit in self.left))

    @property
    def held_out_before(self) -> Errors:
        """
        Return the errors of held-out measurements. Base and tool are fitted to the other
        measurements, with the nominal table.
        """
        return self.without.held_out_before

    @property
    def held_out(self) -> Errors:
        """
        Return the errors of held-out measurements. All parameters are fitted to the other
        measurements.
        """
        return self.without.held_out

    @property
    def remainders(self) -> Floats:
        """
        Return the residuals of all measurements with all corrections applied, (N, 2, 3), m and
        rad.
        """
        return np.asarray(self.left[2])

    @cached_property
    def corrections(self) -> dict[str, float]:
        """Return the correction of each parameter by the name of the parameter, rad and m."""
        return {parameter.name: parameter.correction for parameter in self.parameters}

    @property
    def not_identifiable(self) -> tuple[str, ...]:
        """
        Return the names of those fitted parameters that the measurements do not identify.

        Only parameters of the arm's table are listed, not those of base and tool.
        """
        table = (parameter for parameter in self.parameters if parameter.group in TABLE_GROUPS)
        return tuple(parameter.name for parameter in table if not parameter.identifiable)
