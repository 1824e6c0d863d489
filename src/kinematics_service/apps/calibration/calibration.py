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

    If large errors remain, or rows contradict the arm, `accepted` of the returned calibration is
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
        that the tip of the tool touched at each row. The positions of the points in the base
        frame, and of the tip in the tool frame, are fitted with the arm. If the robot file has the
        true position of the tip, write `tool` in `fix`.
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
        For each row, the name of the session in which the row was measured. The pose of the
        instrument and the zeros of the joints may drift between sessions. The differences from the
        first session are parameters of the groups `placement` and `zeros`.
    loads
        The load on the tool at each row. Each joint yields to the load: the `compliance` of each
        joint is fitted.
    whitening : shape (N, 3, 3) or (N, 6, 6)
        Matrices by which the fit multiplies the residuals of positions, or of positions and
        rotations. The products have equal noise along all axes and in all rows. None: the
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
    >>> found = ks.calibrate(robot, q, poses)
    >>> round(found.corrections['theta2'], 6), found.known, found.possible
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
        if any(one is not None for one in others):
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
        each = Free('base' in own, 'tool' in own)
        given = with_conditions(robot, given, each.base, sessions, loads)
        arm = parameters_of(robot, asks_for_gears(fit))
        given = given._replace(whitening=whitening)
        names = ChosenParameters(robot, given, tuple(own), arm.table)
        fitted = names.fitted(fit, fix, priors)
        groups = {names.every[k].group for k in fitted}
        free = Free('base' in groups, 'tool' in groups)
        progress('frame check')
        offsets, frames = checking.checked_offsets(robot, given, free, each, check, read)
        chains = names.chains(arm.chain, offsets)
        problem = names.problem(chains, given.poses, fitted, priors)
    found, identified = _fitted(names, problem, known, progress)
    found = replace(found, frames=frames, camera=camera)
    size = wrong_size(problem, identified) if camera is not None and check else None
    if size is not None and size.refused:
        return replace(found, refusals=(*found.refusals, size.sentence))
    if size is not None:
        found = replace(found, remarks=(*found.remarks, size.sentence))
    if found.accepted or found.only_worse or not check:
        return found
    progress('explanations')

    again = partial(calibrate, robot, apart=apart, camera=camera, whitening=whitening, own=own)
    again = partial(again, fit=fit, fix=fix, tolerances=tolerances, noise=noise, check=False)

    def outcome_of(change: Hypothesis) -> TriedCalibration:
        one = again(**names.undone(change))
        left = (one.without if one.accepted else one.with_outliers).after
        return TriedCalibration(one.accepted, left, len(one.outliers))

    if frames is not None and frames.cause is not None:
        # The frame check found a wrong joint zero, length or angle. The fit can correct such a
        # wrong number, but the fit is refused, probably because the number is wrong by much more
        # than its prior standard deviation. So report only this number as the cause.
        causes = RefusalCauses((frames.cause.sentence,), True, True)
    else:
        changes = mistakes_of(robot, names.given, read)
        misfits = names.misfits(found.used, [Hypothesis('', ''), *changes])
        left = found.with_outliers.after
        causes = explained(changes, misfits, outcome_of, left, found.positions)
    return replace(found, explained=causes)


def _fitted(
    names: ChosenParameters,
    problem: fitting.FitProblem,
    instrument: fitting.Noise | None,
    progress: Callable[[str], None],
) -> tuple[Calibration, fitting.Identified]:
    robot, given = names.robot, names.given
    found = fitting.find_values(problem, instrument, lambda k: progress(f'round {k + 1}'))
    progress('cross-validation')
    used, blocks = found.used, _blocks(problem)
    ends = problem.only(names.placed_groups)
    begin = fitting.refined(ends, np.zeros(len(ends.parameters)), found.noise, used)
    # Count the different joint positions that remain if the largest cross-validation block is held
    # out. The largest block is the one with the most different joint positions.
    different = np.unique(checking.position_numbers(given.q), return_index=True)[1]
    beside = len(different) - np.max(np.bincount(blocks[different]))
    fits = (ends, begin), (problem, found.values)
    remaining = [one.remainders(values) for one, values in fits]
    remaining += [fitting.held_out_remainders(*fit, found, blocks) for fit in fits]
    weighted = fitting.weighted_jacobian(problem, found.values, found.noise, used)
    numbers = np.stack([found.values, np.sqrt(np.diag(found.covariance)), problem.prior]).tolist()
    parameters = tuple(
        CalibratedParameter(*astuple(one), *own) for one, *own in zip(problem.parameters, *numbers)
    )
    order = np.argsort(-found.distances, kind='stable')
    calibration = Calibration(
        robot=robot,
        calibrated=corrected_robot(robot, problem.parameters, np.round(found.values, DECIMALS)),
        parameters=parameters,
        covariance=found.covariance,
        noise=found.noise,
        freedom=found.freedom,
        instrument=instrument,
        positions=given.positions,
        outliers=tuple(order[~used[order]].tolist()),
        distances=found.distances,
        left=np.stack([names.as_given(), *remaining]),
        spare=int(3 * problem.kinds * beside - len(ends.parameters)),
        possible=names.possible(problem),
        singular_values=np.asarray(np.linalg.svd(weighted, compute_uv=False), np.float64),
        combinations=names.combinations(problem, found.noise, used),
        **names.ends_of(problem, found.values)._asdict(),
        q=given.q.copy(),
        points=names.points(problem, found),
    )
    whole = {one for one in names.table if one.group != GEARS} <= {*problem.parameters}
    judged = JudgedFit(calibration, whole)
    remarks = [*_few_rows(given, found), *_far_corrections(parameters), *noise_remarks(judged)]
    remarks += names.remarks(problem, found)
    remarks += joint_remarks(robot, problem, found) if whole else ()
    return replace(calibration, refusals=refusals_of(judged), remarks=tuple(remarks)), found


def _blocks(problem: fitting.FitProblem) -> Integers:
    # Return the number of the cross-validation block of each measured row. Consecutive joint
    # positions of a set form a block. Rows with equal joint positions are in one block, because a
    # fitted row would predict a held-out row with equal joint positions.
    numbers, begin = checking.position_numbers(problem.given.q), 0
    blocks = np.full(len(problem.given.q), -1)
    for k in range(len(problem.chains)):
        own = np.unique(numbers[(problem.given.sets == k) & (blocks < 0)])
        parts = np.array_split(own, min(BLOCKS, len(own))) if len(own) else []
        for number, part in enumerate(parts, begin):
            blocks[np.isin(numbers, part)] = number % BLOCKS
        begin += len(parts)
    return blocks


def _few_rows(given: checking.Measured, found: fitting.Identified) -> Iterator[str]:
    used, count = int(np.sum(found.used)), len(found.values)
    different = len(np.unique(checking.position_numbers(given.q[found.used])))
    rows = (3 if given.positions else 6) * different
    if rows < 2 * count:
        poses = f'{used} poses' if different == used else f'{different} different poses of {used}'
        yield (
            f'{poses} give {rows} numbers for {count} parameters: the priors decide much of '
            'the result; measure more poses'
        )


def _far_corrections(parameters: Sequence[CalibratedParameter]) -> Iterator[str]:
    for one in parameters:
        beyond = abs(one.correction) / one.prior
        if one.group in TABLE_GROUPS and beyond > checking.REMARKED_DEVIATIONS:
            yield (
                f'{one.name} is corrected by {one.in_words(one.correction)}, {beyond:.2g} times '
                f'its usual error of {one.in_words(one.prior)}: look at the table of the robot '
                'file, or give its tolerance'
            )
