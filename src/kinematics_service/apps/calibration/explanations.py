# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find mistakes of the input that would explain a refused calibration.

For each possible mistake, the data are corrected, and the misfit between the corrected data and
the robot file is computed. Then calibrations are run with the corrected data of least misfit.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import apart
from ...robot.robot import Robot
from ..checking.angle_orders import few_of, order_hypotheses_of
from ..checking.causes import undone
from ..checking.errors import ERROR_LIMIT, NOMINAL, Errors
from ..checking.hypotheses import ComparedData, Hypothesis, hypotheses_of, joint_hypotheses_of
from ..checking.offsets import fit_offsets
from ..recordings.readers.block import Flags
from .checking import NAMED_RATIO, RIVAL_RATIO, Measured, in_words
from .placing import Free, offsets_of

# Number of the likeliest mistakes for which a calibration is run with corrected data.
MISTAKE_TRIALS = 3


class TriedCalibration(NamedTuple):
    """
    The result of a calibration after a mistake of the input is corrected.

    Attributes
    ----------
    accepted
        Whether the calibration is accepted.
    errors
        Errors after the fit: without outliers if the calibration is accepted, else of all poses.
    out
        Number of poses left out as outliers.
    """

    accepted: bool
    errors: Errors
    out: int


class RefusalCauses(NamedTuple):
    """
    Mistakes that would explain a refused calibration.

    Attributes
    ----------
    sentences
        A sentence for each mistake, the likeliest first.
    decided
        Whether the first mistake explains the refusal, and no other mistake explains it nearly as
        well.
    tried
        Whether any mistakes were tried.
    """

    sentences: tuple[str, ...] = ()
    decided: bool = False
    tried: bool = False


def explained(
    changes: Sequence[Hypothesis],
    misfits: Floats,
    outcome_of: Callable[[Hypothesis], TriedCalibration],
    errors: Errors,
    positions: bool,
) -> RefusalCauses:
    """
    Calibrate with mistakes of the input corrected; return the mistakes that explain a refusal.

    Parameters
    ----------
    changes
        The possible mistakes of the input. Each object can correct its mistake in the data.
    misfits : shape (1 + H,)
        The misfit between measured poses and nominal robot file: first with the data as given,
        then after each of the H mistakes in `changes` is corrected.
    outcome_of
        A function that takes a mistake, corrects the mistake in the data, calibrates, and returns
        the result.
    errors
        Errors of the measured poses after the refused calibration.
    positions
        Whether only positions were measured.
    """
    begin, scores, trials = misfits[0], misfits[1:], []
    likeliest = np.argsort(scores, kind='stable')[:MISTAKE_TRIALS]
    for k in likeliest[scores[likeliest] < begin].tolist():
        try:
            trials.append((changes[k].sentence, outcome_of(changes[k])))
        except CalibrationError:
            continue  # calibration fails after this correction, so it explains nothing
    trials.sort(key=lambda trial: (not trial[1].accepted, trial[1].errors.position_rms))
    good = [trial for trial in trials if trial[1].accepted]
    rms = [outcome.errors.position_rms for _, outcome in good]
    decided = bool(good) and all(other > RIVAL_RATIO * rms[0] for other in rms[1:])
    far, turned = errors.position_rms / NAMED_RATIO, max(errors.rotation_rms, NOMINAL.angle)
    better = [trial for trial in trials if trial[1].errors.position_rms < far]
    better = [trial for trial in better if trial[1].errors.rotation_rms <= turned]
    sentences = (
        f'{mistake}: with that undone {in_words(*outcome.errors.rms, positions)} remain (rms), '
        f'and {outcome.out or "none"} left out'
        for mistake, outcome in (good[:1] if decided else good or better)
    )
    return RefusalCauses(tuple(sentences), decided, True)


def mistakes_of(robot: Robot, given: Measured, read: str) -> list[Hypothesis]:
    """
    Return the mistakes that the measurements may have, as hypotheses. `read` is the kind of
    `--pose-format` with which the orientations were read, such as `rpy`, or empty.
    """
    if given.positions:
        return list(joint_hypotheses_of(robot, given.q))
    A = forward_kinematics(robot, given.q)
    whole = hypotheses_of(ComparedData(robot, given.q, given.poses, read=read))
    # A hypothesis that contains a robot assumes another convention of the DH table. Leave out such
    # hypotheses, because a calibration keeps the convention of the robot file. Only the frame
    # check tries other conventions.
    kept = [hypothesis for hypothesis in whole if hypothesis.robot is None]
    return kept + list(order_hypotheses_of(given.poses, A, read))


def misfits_of_poses(
    robot: Robot, given: Measured, used: Flags, changes: Sequence[Hypothesis]
) -> Floats:
    """
    Return the misfit (H,) between measured poses and robot file for each of H possible mistakes,
    after the mistake is corrected in the data.

    If the poses were measured in several sets, only the set with the most outliers is used. Base
    and tool are fitted to the poses of this set that are not outliers. Let d be the position error
    and a the rotation error of a pose after this fit. The misfit is the mean over the poses,
    outliers included, of

        min((d / 20 mm)^2 + (a / 2 deg)^2, 1).

    If only positions were measured, the term with a is left out.
    """
    set_ = given.sets == int(np.argmax(np.bincount(given.sets, weights=~used)))
    both = [np.flatnonzero(set_ & flags) for flags in (used, ~used)]
    some = [few_of(len(group)) for group in both]
    rows = np.concatenate([group[at] for group, at in zip(both, some) if len(group)])
    near = used[rows]
    A, B = undone(ComparedData(robot, given.q, given.poses), changes, rows)
    a, b = A[:, near], B[:, near]
    X, Y, *_ = offsets_of(a, b, True, Free()) if given.positions else fit_offsets(a, b)
    lengths, angles = apart(B, X[:, None] @ A @ Y[:, None])
    units = np.array([change.unit for change in changes])
    squares = (units[:, None] * lengths / ERROR_LIMIT.position) ** 2
    if not given.positions:
        squares = squares + (angles / ERROR_LIMIT.angle) ** 2
    return truncated(squares)


def truncated(squares: Floats) -> Floats:
    """
    Limit each squared error (..., N), in units of the largest acceptable error, to 1, and return
    the means (...,) over the N rows.
    """
    return np.asarray(np.mean(np.minimum(squares, 1.0), axis=-1))
