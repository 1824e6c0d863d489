# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Calibrate an arm: identify the numbers of its table from measured poses, touches or a board."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial
from typing import get_args

import numpy as np
import numpy.typing as npt

from ...errors import ArgumentError, CalibrationError
from ...kernel import Floats, Integers
from ...kinematics.arguments import numbers_of
from ...kinematics.uncertainty.parameters import parameters_of
from ...robot.file.parts.parameters import ENDS, GEARS, TABLE_GROUPS
from ...robot.robot import AnyRobot, as_robot
from ..checking.hypotheses import Hypothesis
from . import checking, fitting
from .acceptance import JudgedFit, joint_remarks, noise_remarks, refusals_of
from .camera import Camera, given_by_camera, wrong_size
from .chosen_parameters import ChosenParameters, asks_for_gears
from .conditions import ToolLoads, with_conditions
from .corrections import corrected_robot
from .explanations import RefusalCauses, TriedCalibration, explained, mistakes_of
from .identified_table import CalibratedParameter
from .placing import Free
from .result import BLOCKS, Calibration
from .same_point import SamePointParameters

# The corrections of the calibrated robot are rounded to this many decimals (m, rad), far below
# any noise.
DECIMALS = 13


def calibrate(
    robot: AnyRobot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike | None = None,
    *,
    same_point: Sequence[str | int] | None = None,
    apart: Mapping[tuple[str, str], float] | None = None,
    sets: npt.ArrayLike | None = None,
    qdot: npt.ArrayLike | None = None,
    approach: npt.ArrayLike | None = None,
    camera: Camera | None = None,
    sessions: Sequence[str | int] | None = None,
    loads: ToolLoads | None = None,
    whitening: Floats | None = None,
    own: Sequence[str] = ('base',),
    fit: Sequence[str] = (),
    fix: Sequence[str] = (),
    tolerances: Mapping[str, float] | None = None,
    noise: tuple[float, float] | None = None,
    check: bool = True,
    read: str = '',
    progress: Callable[[str], None] = lambda phase: None,
) -> Calibration:
    """
    Return the calibration of an arm: table numbers with which its poses are nearest to measured
    ones.

    If large errors remain, or poses contradict the arm, `accepted` of the returned calibration is
    False. Then `refusals` has the reasons, and `explained` has mistakes of the input that would
    explain the errors.

    Parameters
    ----------
    robot
        The nominal arm.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4), or (N, 3) in m
        Measured poses of the tool at the times of `q`, or positions of one point of the tool. The
        frame of the instrument must stand still. The tool frame, or the point, may differ from
        that of the robot file.
    same_point : N
        Given instead of `poses`, for a calibration without an instrument: the name of the point
        that the tip of the tool touched at each of the joint positions `q`. The positions of the
        points in the base frame, and of the tip in the tool frame, are fitted with the arm. If the
        robot file has the true position of the tip, write `tool` in `fix`.
    apart
        Known distances (m) between two touched points, by their names. Their standard deviation
        is 0.01 mm.
    sets : shape (N,)
        The set of each pose, from 0, if the poses were measured in several sets.
    qdot : shape (N, n), rad/s or m/s
        Joint velocities, if the arm moved. If they are given, a small delay `lag` (s) is fitted,
        too: the fit predicts each pose at the joint positions `q + lag * qdot`.
    approach : shape (N, n)
        The sign of the last velocity of each joint, if the arm stands still. If the signs are
        given, one backlash for all joints is fitted, too: each joint stops half of the backlash
        before its measured position.
    camera
        The place of the camera, if the poses are those of a board in the frame of the camera:
        `on-tool` (the board stands still) or `fixed` (the board is on the tool).
    sessions : N
        For each pose, the name of the session in which the pose was measured. The pose of the
        instrument and the zeros of the joints may drift between sessions. The differences from the
        first session are parameters of the groups `placement` and `zeros`.
    loads
        The load on the tool at each pose. Each joint yields to the load: the `compliance` of each
        joint is fitted.
    whitening : shape (N, 3, 3) or (N, 6, 6)
        Matrices by which the fit multiplies the residuals of positions, or of positions and
        rotations. The products have equal noise along all axes and at all poses. None: the
        residuals already have equal noise.
    own
        The ends of the arm that are fitted for each set separately: `base`, `tool`, or both.
    fit, fix
        Groups (offsets, lengths, angles, gears, base, tool, lag) or names of parameters to fit,
        and not to fit. Default: all but gear ratios; `all` includes gear ratios. Numbers that are
        not fitted stay as in the robot file.
    tolerances
        Standard deviations of nominal numbers, by group or name: of lengths (m), of angles (rad),
        and of the relative errors of gear ratios. Default: `tolerance` of the robot file, or else
        1 mm, 0.2 degrees and 0.001.
    noise
        Standard deviations of the instrument's noise: of each coordinate of a position (m), and of
        each coordinate of a rotation vector (rad). They are lower bounds of the noise that the fit
        estimates.
    check
        Whether to check the input for mistakes. If set, a frame check runs before the fit. The
        frame check raises an error for a mistake that a calibration cannot correct. If set, and if
        the calibration is refused, mistakes that would explain the refusal are searched.
    read
        How the orientations were read: a kind of `--pose-format`, such as `rpy`; empty if unknown.
    progress
        Called with the name of each phase of the work.

    Raises
    ------
    CalibrationError
        Shapes do not fit, there are too few poses, all poses are alike, or the frame check finds a
        mistake in the poses.

    Examples
    --------
    >>> import numpy as np
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('ur5e')
    >>> q = np.random.default_rng(0).uniform(-2, 2, (40, 6))
    >>> poses = ks.forward_kinematics(robot, q + [0, 1e-3, 0, 0, 0, 0])  # an encoder is off
    >>> result = ks.calibrate(robot, q, poses)
    >>> round(result.corrections['theta2'], 6), result.known, result.possible
    (0.001, 30, 30)
    """
    robot = as_robot(robot)
    if noise is not None and numbers_of('noise', noise).shape != (2,):
        raise ArgumentError.refused('noise', 'two numbers, m and rad', noise)
    known, priors = None if noise is None else fitting.Noise(*noise), tolerances or {}
    if camera is not None:
        checking.check_known('camera', camera, get_args(Camera))
    checking.refuse_loops(robot.description)
    names: ChosenParameters
    if same_point is not None:
        others = (poses, sets, qdot, approach, camera, sessions, loads, whitening)
        if any(other is not None for other in others):
            raise CalibrationError(
                'same_point: takes joint positions alone; leave out poses, sets, qdot, approach, '
                'camera, sessions and loads',
                code='conflict',
            )
        progress('points')
        gears = asks_for_gears(fit)
        names = touches = SamePointParameters(robot, q, same_point, apart or {}, gears)
        problem = touches.touch_problem(touches.fitted(fit, fix, priors), priors, check)
        frames = None
    else:
        if not (qdot is None or approach is None):
            message = 'qdot, approach: give qdot if the arm moved, or approach if it stood still'
            raise CalibrationError(message, code='conflict')
        if poses is None or apart:
            message = 'give poses, or same_point with its distances apart'
            raise CalibrationError(message, code='conflict')
        if approach is None:
            given = checking.measured(robot, q, poses, sets, qdot)
        else:
            half_behind = -0.5 * np.sign(numbers_of('approach', approach))
            given = checking.measured(robot, q, poses, sets, half_behind)._replace(
                moving=(checking.BACKLASH,)
            )
        if camera is not None:
            given = given_by_camera(robot, given, camera, check)
        for end in own:
            checking.check_known('own', end, ENDS)
        per_set = Free('base' in own, 'tool' in own)
        given = with_conditions(robot, given, per_set.base, sessions, loads)
        arm = parameters_of(robot, asks_for_gears(fit))
        given = given._replace(whitening=whitening)
        names = ChosenParameters(robot, given, tuple(own), arm.table)
        fitted = names.fitted(fit, fix, priors)
        groups = {names.every[k].group for k in fitted}
        free = Free('base' in groups, 'tool' in groups)
        progress('frame check')
        offsets, frames = checking.checked_offsets(robot, given, free, per_set, check, read)
        chains = names.chains(arm.chain, offsets)
        problem = names.problem(chains, given.poses, fitted, priors)
    result, identified = _fitted(names, problem, known, progress)
    result = replace(result, frames=frames, camera=camera)
    size = wrong_size(problem, identified) if camera is not None and check else None
    if size is not None and size.refused:
        return replace(result, refusals=(*result.refusals, size.sentence))
    if size is not None:
        result = replace(result, remarks=(*result.remarks, size.sentence))
    if result.accepted or result.only_worse or not check:
        return result
    progress('explanations')

    rerun = partial(calibrate, robot, apart=apart, camera=camera, whitening=whitening, own=own)
    rerun = partial(rerun, fit=fit, fix=fix, tolerances=tolerances, noise=noise, check=False)

    def outcome_of(change: Hypothesis) -> TriedCalibration:
        trial = rerun(**names.undone(change))
        errors = (trial.without if trial.accepted else trial.with_outliers).after
        return TriedCalibration(trial.accepted, errors, len(trial.outliers))

    if frames is not None and frames.cause is not None:
        # The frame check found a wrong joint zero, length or angle. The fit can correct such a
        # wrong number, but the fit is refused, probably because the number is wrong by much more
        # than its prior standard deviation. So report only this number as the cause.
        causes = RefusalCauses((frames.cause.sentence,), True, True)
    else:
        changes = mistakes_of(robot, names.given, read)
        misfits = names.misfits(result.used, [Hypothesis('', ''), *changes])
        errors = result.with_outliers.after
        causes = explained(changes, misfits, outcome_of, errors, result.positions)
    return replace(result, explained=causes)


def _fitted(
    names: ChosenParameters,
    problem: fitting.FitProblem,
    instrument: fitting.Noise | None,
    progress: Callable[[str], None],
) -> tuple[Calibration, fitting.Identified]:
    robot, given = names.robot, names.given
    fit = fitting.find_values(problem, instrument, lambda k: progress(f'round {k + 1}'))
    progress('cross-validation')
    used, blocks = fit.used, _blocks(problem)
    ends = problem.only(names.placed_groups)
    begin = fitting.refined(ends, np.zeros(len(ends.parameters)), fit.noise, used)
    # Count the different joint positions that remain if the largest cross-validation block is held
    # out. The largest block is the one with the most different joint positions.
    different = np.unique(checking.position_numbers(given.q), return_index=True)[1]
    beside = len(different) - np.max(np.bincount(blocks[different]))
    starts = (ends, begin), (problem, fit.values)
    remaining = [part.remainders(values) for part, values in starts]
    remaining += [fitting.held_out_remainders(*start, fit, blocks) for start in starts]
    weighted = fitting.weighted_jacobian(problem, fit.values, fit.noise, used)
    numbers = np.stack([fit.values, np.sqrt(np.diag(fit.covariance)), problem.prior]).tolist()
    parameters = tuple(
        CalibratedParameter(*astuple(parameter), *row)
        for parameter, *row in zip(problem.parameters, *numbers)
    )
    order = np.argsort(-fit.distances, kind='stable')
    calibration = Calibration(
        robot=robot,
        calibrated=corrected_robot(robot, problem.parameters, np.round(fit.values, DECIMALS)),
        parameters=parameters,
        covariance=fit.covariance,
        noise=fit.noise,
        freedom=fit.freedom,
        instrument=instrument,
        positions=given.positions,
        outliers=tuple(order[~used[order]].tolist()),
        distances=fit.distances,
        left=np.stack([names.as_given(), *remaining]),
        spare=int(3 * problem.kinds * beside - len(ends.parameters)),
        possible=names.possible(problem),
        singular_values=np.asarray(np.linalg.svd(weighted, compute_uv=False), np.float64),
        combinations=names.combinations(problem, fit.noise, used),
        **names.ends_of(problem, fit.values)._asdict(),
        q=given.q.copy(),
        points=names.points(problem, fit),
    )
    whole = {number for number in names.table if number.group != GEARS} <= {*problem.parameters}
    judged = JudgedFit(calibration, whole)
    remarks = [*_few_rows(given, fit), *_far_corrections(parameters), *noise_remarks(judged)]
    remarks += names.remarks(problem, fit)
    remarks += joint_remarks(robot, problem, fit) if whole else ()
    return replace(calibration, refusals=refusals_of(judged), remarks=tuple(remarks)), fit


def _blocks(problem: fitting.FitProblem) -> Integers:
    # Return the number of the cross-validation block of each measurement. Consecutive joint
    # positions of a set form a block. Measurements with equal joint positions are in one block,
    # because a fitted measurement would predict a held-out one with equal joint positions.
    numbers, begin = checking.position_numbers(problem.given.q), 0
    blocks = np.full(len(problem.given.q), -1)
    for k in range(len(problem.chains)):
        positions = np.unique(numbers[(problem.given.sets == k) & (blocks < 0)])
        parts = np.array_split(positions, min(BLOCKS, len(positions))) if len(positions) else []
        for number, part in enumerate(parts, begin):
            blocks[np.isin(numbers, part)] = number % BLOCKS
        begin += len(parts)
    return blocks


def _few_rows(given: checking.Measured, identified: fitting.Identified) -> Iterator[str]:
    used, count = int(np.sum(identified.used)), len(identified.values)
    different = len(np.unique(checking.position_numbers(given.q[identified.used])))
    rows = (3 if given.positions else 6) * different
    if rows < 2 * count:
        poses = f'{used} poses' if different == used else f'{different} different poses of {used}'
        yield (
            f'{poses} give {rows} numbers for {count} parameters: the priors decide much of '
            'the result; measure more poses'
        )


def _far_corrections(parameters: Sequence[CalibratedParameter]) -> Iterator[str]:
    for parameter in parameters:
        beyond = abs(parameter.correction) / parameter.prior
        if parameter.group in TABLE_GROUPS and beyond > checking.REMARKED_DEVIATIONS:
            yield (
                f'{parameter.name} is corrected by {parameter.in_words(parameter.correction)}, '
                f'{beyond:.2g} times its usual error of {parameter.in_words(parameter.prior)}: '
                'look at the table of the robot file, or give its tolerance'
            )
