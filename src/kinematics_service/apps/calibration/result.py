"""The result of a calibration: corrections, errors, and what the rows identify."""

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
from .identified_table import KNOWN_RATIO, IdentifiedTable, ParameterCombination

# Blocks of rows that are held out in turn.
BLOCKS = 5


class FitErrors(NamedTuple):
    """
    Errors of rows.

    Attributes
    ----------
    as_given
        With the robot file as it is.
    before, after
        With base and tool fitted alone, and with the corrections.
    held_out_before, held_out
        The same of rows that nothing was fitted to: by cross-validation over blocks of rows.
    """

    as_given: Errors
    before: Errors
    after: Errors
    held_out_before: Errors
    held_out: Errors


@dataclass(frozen=True, eq=False)
class Calibration(IdentifiedTable):
    """
    A robot identified from measured poses, if it is `accepted`.

    Attributes
    ----------
    robot, calibrated
        The nominal robot; the same with the corrections of its table, its base and tool unchanged.
    parameters : P
        Those fitted.
    covariance : shape (P, P), rad and m
        The covariance of their corrections.
    noise
        Standard deviation of one number of a measured position (m), and rotation vector (rad).
    freedom
        Its degrees of freedom; infinite if it is that of the instrument.
    instrument
        The same of the instrument, where it was given.
    positions
        Whether the poses are positions alone.
    outliers
        Rows that were left out, the farthest first.
    distances : shape (N,)
        The error of each row, in standard deviations of the noise.
    left : shape (5, N, 2, 3), m and rad
        Residuals of each row in the order of `FitErrors`: of the position, and a rotation vector;
        in the frame of the poses.
    spare
        Numbers of the rows beside the largest held-out block, of different joint positions, beyond
        those that place base and tool.
    possible
        Number of directions of the parameters that any poses of this kind could tell.
    singular_values : shape (P,)
        How well these poses tell the directions, in units of the priors; descending.
    combinations
        Parameters that no pose tells apart, or not these.
    base_offsets, tool_offsets : shape (sets, 4, 4)
        X and Y of measured = X calibrated Y.
    base_starts, tool_starts : shape (sets, 4, 4)
        Base and tool that their corrections, along and about their own axes, begin at.
    q : shape (N, n), rad or m
        Joint positions of the rows.
    points
        Those that were touched, if the poses were measured by nothing else.
    frames
        The result of the frame check; None for positions.
    remarks
        Sentences on the data.
    refusals
        Reasons against the calibration, sentences; empty if it is accepted.
    explained
        Mistakes that would explain a refusal.
    camera
        The place of the camera that saw a board. On the tool `measured` is the camera in
        the frame of the board, and what remains is the board in the frame of the camera.
    views
        The board in the images that the poses are from, if there are any.
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
        """Return whether it is a calibration: its rows agree, and no more remains than may."""
        return not self.refusals

    @property
    def worse(self) -> str:
        """
        Return that held-out rows are worse with the corrections; empty if they are not.

        They are worse if the squares of their errors grow by more than that of the noise, or if
        the rows beside a held-out block only suffice to place base and tool.
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
        Return whether the corrections bring held-out rows no nearer than chance might.

        This is true if the mean decrease of their squared errors is below two of its standard
        deviations (paired test).
        """
        before, after = np.sum(self.left[3:, self.used, 0] ** 2, axis=2)
        gains = before - after
        return bool(np.mean(gains) < 2.0 * np.std(gains) / np.sqrt(len(gains)))

    @property
    def only_worse(self) -> bool:
        """Return whether the reason against it is `worse`: then more rows help."""
        return self.refusals == (self.worse,)

    @property
    def count(self) -> int:
        """Return the number of rows."""
        return len(self.q)

    @property
    def used(self) -> Flags:
        """Return which rows (N,) were used: all but the outliers."""
        return ~np.isin(np.arange(self.count), self.outliers)

    @property
    def rows(self) -> str:
        """Return what rows are, in a word."""
        return 'touches' if self.points else 'poses'

    @property
    def row(self) -> str:
        """Return what a row is, in a word."""
        return 'touch' if self.points else 'pose'

    @property
    def kind(self) -> str:
        """Return what was measured, in a word."""
        return 'positions' if self.positions and not self.points else self.rows

    @property
    def placed(self) -> str:
        """Return in words what is fitted before the table."""
        return 'tip and points' if self.points else 'base and tool'

    def rms_in_words(self, errors: Errors) -> str:
        """Return the RMS values of errors in words, without those that were not measured."""
        return in_words(*errors.rms, self.positions)

    @property
    def noise_told(self) -> bool:
        """Return whether the noise is known; otherwise so few numbers do not tell it."""
        return min(self.freedom) > UNKNOWN_NOISE_FREEDOM

    @property
    def known(self) -> int:
        """Return the number of directions that these poses tell better than the priors."""
        return int(np.sum(self.singular_values > KNOWN_RATIO))

    @cached_property
    def without(self) -> FitErrors:
        """Return the errors of the rows that were used."""
        return self._errors(self.used)

    @cached_property
    def with_outliers(self) -> FitErrors:
        """Return the errors of all rows."""
        return self._errors(np.ones_like(self.used))

    def _errors(self, rows: Flags) -> FitErrors:
        return FitErrors(*(errors_of(*np.swapaxes(one[rows], 0, 1)) for one in self.left))

    @property
    def held_out_before(self) -> Errors:
        """Return what remains with base and tool fitted alone, of rows left out of the fit."""
        return self.without.held_out_before

    @property
    def held_out(self) -> Errors:
        """Return what remains with the corrections, of rows left out of the fit."""
        return self.without.held_out

    @property
    def remainders(self) -> Floats:
        """Return what remains of each row with the corrections, (N, 2, 3), m and rad."""
        return np.asarray(self.left[2])

    @cached_property
    def corrections(self) -> dict[str, float]:
        """Return the corrections by name, rad and m."""
        return {one.name: one.correction for one in self.parameters}

    @property
    def not_identifiable(self) -> tuple[str, ...]:
        """Return the parameters of the table that mostly stay where their prior has them."""
        table = (one for one in self.parameters if one.group in TABLE_GROUPS)
        return tuple(one.name for one in table if not one.identifiable)
