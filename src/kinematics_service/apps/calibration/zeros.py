# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Identify joint zeros of an arm with encoders mounted by hand, from touches of known points.

The tip touches points whose positions on a sheet are known. The pose of the sheet and the position
of the tip are fitted with the zeros. The zero of a joint is not identifiable if another pose of
the sheet, or another tip, has the effect of a wrong zero. The result names such joints.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.uncertainty.parameters import parameters_of
from ...robot.file.parts.parameters import ENDS
from ...robot.robot import Robot
from ..checking.errors import angle_in_words, length_in_words
from ..checking.hypotheses import DEGREES, from_degrees
from .calibration import calibrate
from .checking import BACKLASH, OPTIONS, ROUND_OFF
from .result import Calibration

# The zero of a joint is identified if its standard deviation is below this value: first for
# revolute joints (rad), then for prismatic joints (m).
TOLERANCES = (float(np.radians(1.0)), 0.003)
# If the touches are too few to estimate their noise, this standard deviation (m) is assumed for
# each coordinate of a touched position.
TOUCH_NOISE = 1e-3


class JointZero(NamedTuple):
    """
    The correction of the position that a joint reports, and the standard deviation of this
    correction.

    `correction` and `deviation` are in m if `prismatic` is set, else in rad. `known` is set if
    `deviation` is below 1 degree (revolute joint) or 3 mm (prismatic joint).
    """

    joint: str
    correction: float
    deviation: float
    known: bool
    prismatic: bool

    @property
    def sentence(self) -> str:
        """Return the correction and its standard deviation as a sentence."""
        if not self.correction:
            return f'{self.joint}: the zero is not known from these touches; it stays as it was'
        words = length_in_words if self.prismatic else angle_in_words
        limit, sign = words(TOLERANCES[self.prismatic]), '+' if self.correction > 0.0 else ''
        begin = 'to be added is' if self.known else f'the zero is not known to {limit}:'
        deviation = f'with a standard deviation of {words(self.deviation)}'
        return f'{self.joint}: {begin} {sign}{words(self.correction)}, {deviation}'


def calibrate_zeros(
    robot: Robot,
    q: Floats,
    points: Floats,
    *,
    approach: npt.ArrayLike | None = None,
    noise: tuple[float, float] | None = None,
    fix: tuple[str, ...] = (),
    check: bool = True,
    progress: Callable[[str], None] = lambda phase: None,
) -> Calibration:
    """
    Return a calibration that fits only the offsets of the joints, with base and tool.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Joint positions that the joints report while the tip touches a point.
    points : shape (N, 3), m
        Positions of the touched points on a printed sheet, in the frame of the sheet. The pose of
        the sheet need not be known.
    approach, noise, fix, progress
        Arguments that are passed to `calibrate`, with the same meaning there.
    check
        If the calibration is refused: whether to look for a mistake of the input that explains the
        refusal, such as wrong units.

    Raises
    ------
    CalibrationError
        As in `calibrate`.
    """
    offsets = [offset for offset in parameters_of(robot).table if offset.group == 'offsets']
    # Prior standard deviations of the joint zeros: ten times the standard deviation below which a
    # zero is identified.
    before = {offset.name: 10.0 * TOLERANCES[not offset.angle] for offset in offsets}
    fit = ('offsets', *ENDS, *([] if approach is None else [BACKLASH.group]))
    # Skip the frame check (`check=False`). The zeros may be far off, and then the frame check
    # would report that another robot was measured.
    measured = partial(calibrate, robot, poses=points, approach=approach, progress=progress)
    fitted = partial(measured, fit=fit, tolerances=before, check=False)
    result = fitted(q, fix=fix, noise=noise)
    if noise is None and not result.noise_told:
        noise = (TOUCH_NOISE, 0.0)
    fitted = partial(fitted, fix=(*fix, *_hidden(result)), noise=noise)
    result = fitted(q)
    if result.accepted or not check:
        return result
    if fitted(from_degrees(robot, q)).accepted:
        raise CalibrationError(f'{DEGREES}{OPTIONS[DEGREES]}', code='wrong-unit')
    return fitted(q, check=True)


def _hidden(result: Calibration) -> tuple[str, ...]:
    # Return the names of joint offsets that move the touching tip like corrections of base and
    # tool do. If these offsets are not fitted, the fit is equally good.
    offsets = {entry.name for entry in result.parameters if entry.group == 'offsets'}
    hidden = list[str]()
    for combination in result.combinations:
        names = [name for name in combination.names if name in offsets]
        hidden += names if len(names) <= len(combination.names) - combination.determined else []
    return tuple(hidden)


def zeros_of(result: Calibration) -> tuple[JointZero, ...]:
    """
    Return the zero of each joint: the correction x of its position, computed from the fit.

    The fit corrects the offsets in the table (for example theta of a row) by y. Several joints may
    move one row, so y = M x. The pseudoinverse of M gives x.
    """
    arm = parameters_of(result.robot)
    offsets = [offset for offset in arm.table if offset.group == 'offsets']
    _, _, by_theta, by_d = arm.chain.screws
    moved = np.where(np.array([offset.angle for offset in offsets])[:, None], by_theta, by_d)
    rows, columns = result.fitted_of([offset.name for offset in offsets])
    # If the offset of a table row is not fitted, the zeros of the joints that move the row cannot
    # be computed. `stays` marks these joints.
    by_rows = np.linalg.pinv(moved)
    stays = np.abs(np.delete(by_rows, rows, axis=1)).max(axis=1, initial=0.0) > ROUND_OFF
    by_rows = by_rows[:, rows]
    values = by_rows @ [result.parameters[k].correction for k in columns]
    covariance = by_rows @ result.covariance[np.ix_(columns, columns)] @ by_rows.T
    deviations = np.sqrt(np.diag(covariance))
    limits = np.array(TOLERANCES)[np.array(result.robot.prismatic, dtype=np.int64)]
    known = ~stays & (deviations < limits)
    numbers = values.tolist(), deviations.tolist(), known.tolist(), result.robot.prismatic.tolist()
    return tuple(JointZero(*row) for row in zip(result.robot.joint_names, *numbers))


def zero_sentences(result: Calibration) -> list[str]:
    """
    Return sentences for the report: on the zero of each joint, on the noise of the touches if it
    was assumed and not estimated, and on the backlash if it was fitted.
    """
    sentences = [zero.sentence for zero in zeros_of(result)]
    if result.instrument == (TOUCH_NOISE, 0.0):
        sentences.append(
            f'Touches are taken to be off by no less than {length_in_words(TOUCH_NOISE)} (--noise)'
        )
    for parameter in result.parameters:
        if parameter.name == BACKLASH.name:
            size, off = angle_in_words(parameter.correction), angle_in_words(parameter.deviation)
            text = f'The backlash of the joints is {size}, with a standard deviation of {off}'
            if parameter.may_be_zero:
                text = 'A backlash of the joints is not told by these touches '
                text += f'({size}, with a standard deviation of {off})'
            sentences.append(text)
    return sentences
