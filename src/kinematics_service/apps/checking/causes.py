# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the mistake that explains the residuals between two sources of poses.

Each possible mistake is corrected, and the residuals after a new fit are compared.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import LoopError
from ...kernel import Floats, Integers
from ...kinematics.tool_state import evaluate
from ...robot.closed_poses import closes_at
from .angle_orders import few_of, likely_orders
from .errors import (
    ERROR_LIMIT,
    EXPLAINED,
    NOMINAL,
    Errors,
    PoseLimit,
    angle_in_words,
    errors_of,
    length_in_words,
    time_in_words,
)
from .hypotheses import (
    MIN_RANGE,
    ComparedData,
    Hypothesis,
    NumberHypothesis,
    hypotheses_of,
    joint_range,
    joint_ways,
    moved_joints,
    number_hypotheses_of,
    scale_hypotheses_of,
)
from .lag import lagged
from .offsets import (
    WEAK_RATIO,
    Fit,
    equations_of,
    fit_numbers,
    fit_offsets,
    least_angles,
    lifted,
    number_columns,
    scale_of,
    span_of,
)

# A cause is named if its correction divides the RMS residual by 3 or more.
NAMED_RATIO = 3.0
# A cause is called likely if its correction divides the RMS residual by 2 or more.
LIKELY_RATIO = 2.0
# Let r be the number by which the correction of the best cause divides the RMS residual. For
# r >= NAMED_RATIO, another cause explains nearly as much (it is a rival of the best cause) if its
# correction divides the RMS residual by at least r / RIVAL_RATIO.
RIVAL_RATIO = 2.0
# Let r be the number by which the correction of the best cause divides the RMS residual. For
# r < NAMED_RATIO, another cause explains nearly as much (it is a rival of the best cause) if its
# correction divides the RMS residual by at least r / LIKELY_RIVAL_RATIO.
LIKELY_RIVAL_RATIO = 1.25
# Number of Levenberg-Marquardt steps in each fit that preselects hypotheses. Such a fit uses at
# most 40 poses.
SIFT_STEPS = 4
# Number of hypotheses in one batch when hypotheses are preselected by fits to at most 40 poses.
# The likeliest hypotheses are fitted first.
BATCH_SIZE = 16
# Number of preselected hypotheses that are fitted to all poses.
FITTED_IN_FULL = 4
# The score (RMS residual) of a hypothesis is first computed with at most 40 poses. The score with
# all poses may differ from the first score by this factor.
SIFT_MARGIN = 2.0
# A number of the robot file (a joint zero, a joint scale, a length or an angle of the table) is
# fitted only if it explains more than this fraction of the sum of squared residuals, to first
# order.
FIRST_ORDER_SHARE = 0.4
# Largest number of Levenberg-Marquardt steps that fit one number of the robot file together with
# the offsets of base and tool.
ROUNDS = 12
# Angles (rad) that give start values for the fit of a revolute joint's scale. For each angle, one
# fit starts with scale = angle / reach. Here reach is the largest measured |q| of the joint. The
# angles cover nearly a turn to each side. Steps of 1 rad suffice, because Newton's method
# converges if scale * reach is at most 0.5 rad off at the start.
TURNING_REACHES = (*np.arange(-5.5, 6.0),)
# Length (m) that gives the start value for the fit of a prismatic joint's scale. The fit starts
# with scale = length / reach. Here reach is the largest measured |q| of the joint. One start
# suffices, because Newton's method converges from any start.
SLIDING_REACHES = (0.0,)
# Common mistakes that multiply the positions of one joint by a factor. Each entry has the unit of
# the joint, the factor, and the statement of the mistake.
FACTORS = (
    ('rad', math.pi / 180.0, 'is in degrees, not radians'),
    ('rad', 180.0 / math.pi, 'was turned from degrees into radians twice'),
    ('m', 1e-3, 'is in millimetres, not metres'),
    ('m', 0.0254, 'is in inches, not metres'),
    ('m', 0.18 / math.pi, 'is in millimetres, turned from degrees into radians'),
    *((unit, -1.0, 'counts the other way round') for unit in ('rad', 'm')),
)
# An estimated factor of a joint is taken as a factor in FACTORS if |estimated / listed - 1| is
# below this value.
FACTOR_TOLERANCE = 5e-3
# Smaller scores (RMS residuals, rad) after a correction are replaced by this value, because they
# are round-off.
ROUND_OFF = 1e-15
# Measurement noise of the poses is taken as at least this value (RMS, rad), because the last digit
# of a printed pose is rounded.
POSE_DIGIT = 1e-6
# The model resolution of a fitted number is 1 if the poses distinguish this number from all other
# numbers of the robot file, and 0 if they do not. A wrong number is a decisive cause only if its
# model resolution is above this. The value was tested with 54 recordings of arms with a
# nominal table and two moving joints. With 0.55 instead of 0.75, the check named a correct angle
# as the cause in one recording.
MIN_RESOLUTION = 0.75


class TestedCause(NamedTuple):
    """
    A mistake that was tested as the cause of the residuals.

    Attributes
    ----------
    key
        joint_sign, joint_signs, joint_order, joint_coupling, degrees, millimetres, convention,
        tool_axes, quaternion_order, angle_order, joint_offset, joint_scale, link_length,
        link_twist or time_lag.
    sentence
        The mistake, as a statement.
    value
        The fitted number, in rad, m, s or samples, or the factor of a joint; None if the mistake
        has no fitted number.
    ratio
        RMS residual before the correction, divided by the RMS residual after the correction.
    errors
        The residuals after the correction.
    base_offset, tool_offset : shape (4, 4)
        The offsets of base and tool fitted after the correction; see `FrameDiagnosis`.
    name
        Name of the joint whose zero or scale is wrong, or of the wrong table entry, for example
        `a of links[2]`. Empty for all other mistakes.
    resolution
        Model resolution of the fitted number: 1 if the compared poses distinguish this number
        from all other numbers of the robot file, 0 or less if they do not. The default 1 is for a
        mistake without a fitted number.
    """

    key: str
    sentence: str
    value: float | None
    ratio: float
    errors: Errors
    base_offset: Floats
    tool_offset: Floats
    name: str = ''
    resolution: float = 1.0


class Causes(NamedTuple):
    """
    The best cause of the residuals, and causes that explain nearly as much; the likeliest first.

    Attributes
    ----------
    named
        Causes whose correction divides the RMS residual by 3 or more.
    likely
        If `named` is empty: causes whose correction divides the RMS residual by 2 or more.
    decisive
        Whether only one cause is named, and its correction leaves small residuals. Residuals are
        small if measurement errors and a nominal (uncalibrated) table can cause them.
    """

    named: tuple[TestedCause, ...] = ()
    likely: tuple[TestedCause, ...] = ()
    decisive: bool = False


def causes_of(given: ComparedData, A: Floats, fit: Fit, limit: PoseLimit = EXPLAINED) -> Causes:
    """
    Return the causes that best explain the residuals between a robot file and a second source.

    Parameters
    ----------
    given
        The robot, its joint positions, and the poses of the second source.
    A : shape (N, 4, 4)
        Poses that the robot file gives at the joint positions.
    fit
        The offsets of base and tool between A and the poses of the second source, with the
        residuals after the fit of the offsets.
    limit
        Largest residuals (RMS) that measurement errors and a nominal table can cause.
    """
    tried = [*_whole(given, fit), *_numbers(given, A, fit), *_lag(given, A, fit)]
    tried += _orders(given, A, fit, tried)
    tried = _simplest(tried)
    best = max((cause.ratio for cause in tried), default=0.0)

    def about(factor: float) -> tuple[TestedCause, ...]:
        # Return the tried causes whose ratio is at least best / factor. Put discrete mistakes
        # first, because they are likelier than a number that fits by chance.
        kept = [cause for cause in tried if cause.ratio * factor >= best]
        return tuple(sorted(kept, key=lambda cause: (cause.value is not None, -cause.ratio)))

    if best >= NAMED_RATIO:
        named = tuple(cause for cause in about(RIVAL_RATIO) if cause.ratio >= NAMED_RATIO)
        return Causes(named, decisive=len(named) == 1 and _decisive(named[0], fit, limit))
    if best >= LIKELY_RATIO:
        likely = (cause for cause in about(LIKELY_RIVAL_RATIO) if cause.ratio >= LIKELY_RATIO)
        return Causes(likely=tuple(likely))
    return Causes()


def _decisive(cause: TestedCause, before: Fit, limit: PoseLimit) -> bool:
    # Return whether a cause is decisive. If the residuals before any correction are within
    # NOMINAL, a nominal table explains them, so do not name a gross mistake. For a lag, allow
    # residuals up to ERROR_LIMIT after the correction, because a moving arm has few samples and
    # inexact stamps.
    gross = cause.value is None or cause.key in ('joint_scale', 'time_lag')
    if gross and errors_of(before.position, before.rotation).within(NOMINAL):
        return False
    bound = ERROR_LIMIT if cause.key == 'time_lag' else limit
    within = cause.errors.within(PoseLimit(*map(max, zip(bound, limit))))
    return within and cause.resolution > MIN_RESOLUTION


def _simplest(tried: Sequence[TestedCause]) -> list[TestedCause]:
    # Leave out the cause "wrong scale of one joint" if a simpler cause was tried. There are two
    # kinds of simpler cause. (1) A wrong unit of all joints or of all poses. Its correction must
    # leave at most RIVAL_RATIO times the residuals that a corrected scale leaves. (2) A discrete
    # mistake that has the same `sentence` as the wrong scale, such as "joint 2 counts the other
    # way round".
    sentences = {cause.sentence for cause in tried if cause.value is None}
    units = [cause.ratio for cause in tried if cause.key in ('degrees', 'millimetres')]
    least = RIVAL_RATIO * max(units, default=0.0)
    return [
        cause
        for cause in tried
        if cause.key != 'joint_scale' or (cause.ratio > least and cause.sentence not in sentences)
    ]


def _whole(given: ComparedData, fit: Fit) -> list[TestedCause]:
    # Test all discrete mistakes, such as a wrong sign or unit. For each mistake, fit the offsets
    # of base and tool to at most 40 poses. For the mistakes with the smallest residuals, fit the
    # offsets again to all poses.
    changes = possible(given)
    sifted = _sifted(*undone(given, changes, few_of(len(given.q))), _score_limit(fit))
    return _undoing(given, [changes[k] for k in sifted], fit, sifted)


def _orders(
    given: ComparedData, A: Floats, fit: Fit, tried: Sequence[TestedCause]
) -> list[TestedCause]:
    if errors_of(fit.position, fit.rotation).rotation_rms < NOMINAL.angle:
        return []  # the order of small angles hardly changes the rotation
    likely = likely_orders(given.poses, A, given.read)
    few = few_of(len(A))
    # `others` has the poses of the second source once for each likely order of angles, with the
    # orientations that this order gives. All orders have the same positions, and the same poses A
    # of the robot file.
    others = np.tile(given.poses[few], (len(likely), 1, 1, 1))
    others[..., :3, :3] = np.reshape([order.chosen for order in likely], (len(likely), -1, 3, 3))
    sifted = _sifted(np.broadcast_to(A[few], others.shape), others, _score_limit(fit, tried))
    return _undoing(given, [likely[k].undone(given.poses, A) for k in sifted], fit, sifted)


def _score_limit(fit: Fit, tried: Sequence[TestedCause] = ()) -> float:
    # Return the threshold of the preselection. Each hypothesis is first fitted to at most 40
    # poses. If the score (RMS residual) of this fit is below the threshold, the hypothesis is
    # fitted to all poses. If the score is above the threshold, the hypothesis is not even a likely
    # cause, or is clearly worse than a cause in `tried`.
    ratio = max([LIKELY_RATIO, *(cause.ratio / RIVAL_RATIO for cause in tried)])
    return SIFT_MARGIN * float(fit.score) / ratio


def _sifted(A: Floats, B: Floats, limit: float) -> dict[int, Fit]:
    # Fit the offsets between A and B (H, N, 4, 4) for each of H hypotheses. Drop fits whose score
    # (RMS residual) is not below `limit`. Return at most FITTED_IN_FULL fits: the fits with the
    # smallest scores. Their keys are the indices of the hypotheses. A hypothesis is not fitted if
    # a lower bound of its score is far above the best score.
    bounds, fits = least_angles(A, B), dict[int, Fit]()
    order = np.argsort(bounds, kind='stable')
    for some in np.split(order, range(BATCH_SIZE, len(order), BATCH_SIZE)):
        best = min((float(fit.score) for fit in fits.values()), default=np.inf)
        near = some[bounds[some] < min(limit, SIFT_MARGIN * RIVAL_RATIO * best)].tolist()
        if near:
            batch = fit_offsets(A[near], B[near], steps=SIFT_STEPS)
            fits |= {k: fit for i, k in enumerate(near) if (fit := batch.one(i)).score < limit}
    return {k: fits[k] for k in sorted(sorted(fits, key=lambda k: fits[k].score)[:FITTED_IN_FULL])}


def _undoing(
    given: ComparedData, changes: list[Hypothesis], before: Fit, sifted: dict[int, Fit]
) -> list[TestedCause]:
    if not changes:
        return []
    begin = Fit(*map(np.stack, zip(*sifted.values())))
    fits = fit_offsets(*undone(given, changes), begin=begin)
    return [
        _cause(change.key, change.sentence, None, before, fits.one(k), change.unit)
        for k, change in enumerate(changes)
    ]


def possible(given: ComparedData) -> list[Hypothesis]:
    """
    Return the discrete mistakes that are possible, such as a wrong sign or a wrong unit.

    The correction of a discrete mistake has no number to fit. A mistake is possible only if all
    loops of the arm close at the corrected joint positions.
    """
    chain, trials = given.robot.chain, hypotheses_of(given)
    return [trial for trial in trials if trial.q is None or np.all(closes_at(chain, trial.q))]


def undone(
    given: ComparedData, changes: Sequence[Hypothesis], rows: Integers | slice = slice(None)
) -> tuple[Floats, Floats]:
    """
    Return the poses of the robot file and of the second source with one of H mistakes corrected.

    Each mistake is corrected alone, so both results have the shape (H, N, 4, 4). `rows` selects
    the N poses.
    """
    q = np.stack([change.joints(given.q)[rows] for change in changes])
    A = evaluate(given.robot, q, depth=kernel.POSE).pose
    for k, change in enumerate(changes):
        if change.robot is not None:
            A[k] = evaluate(change.robot, q[k], depth=kernel.POSE).pose
    return A, np.stack([change.seen(given.poses)[rows] for change in changes])


def _numbers(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    # Rank joint zeros, joint scales and numbers of the table by the squared residuals that each
    # one explains to first order, and fit the best ones.
    scales = list(scale_hypotheses_of(given))
    numbers = [*number_hypotheses_of(given), *scales]
    columns = np.concatenate([number.columns for number in numbers], axis=2)
    moved, residuals = _beyond(given, A, fit, columns)
    squares = np.maximum(np.sum(moved**2, axis=0), WEAK_RATIO**2 * len(residuals))
    firsts = np.cumsum([0, *(number.columns.shape[2] for number in numbers)])[:-1]
    taken = np.add.reduceat((residuals @ moved) ** 2 / squares, firsts)
    total = float(fit.score) ** 2 * len(A)
    starts = [
        (numbers[k], np.zeros(numbers[k].columns.shape[2]), fit)
        for k in np.argsort(-taken, kind='stable')[:FITTED_IN_FULL].tolist()
        if taken[k] > total * FIRST_ORDER_SHARE
    ]
    if not errors_of(fit.position, fit.rotation).within(EXPLAINED):
        starts += _scale_starts(given, scales, fit)
    causes = [cause for start in starts if (cause := _fitted(given, fit, *start))]
    # Keep one cause for each joint. Prefer a wrong zero to a wrong scale. Prefer a positive scale
    # to a negative scale, because a turned base and tool have the effect of a negative scale.
    causes.sort(key=_preference)
    return list({cause.name: cause for cause in causes}.values())


def _preference(cause: TestedCause) -> float:
    if cause.key != 'joint_scale':
        return cause.ratio * RIVAL_RATIO**2
    return cause.ratio * RIVAL_RATIO ** ((cause.value or 0.0) > 0.0)


def _beyond(given: ComparedData, A: Floats, fit: Fit, columns: Floats) -> tuple[Floats, Floats]:
    # Return two arrays: the derivatives (6 N, c) of the poses by c numbers of the robot file, and
    # the residuals (6 N,) of `fit`. Remove from each array the part that a change of the base and
    # tool offsets can explain. J (6 N, 12) has the derivatives of the poses by the offsets, so
    # project each array onto the orthogonal complement of the columns of J.
    scale = np.reshape(scale_of(given.poses), (1, 1, 1))
    J, r = equations_of(A, fit, scale)
    basis = span_of(J)
    rows = np.column_stack([number_columns(A[None], lifted(fit), columns[None], scale)[0], r])
    rows -= basis @ (basis.T @ rows)
    return rows[:, :-1], rows[:, -1]


def _scale_starts(
    given: ComparedData, scales: Sequence[NumberHypothesis], before: Fit
) -> list[tuple[NumberHypothesis, Floats, Fit]]:
    # Fit the scale of each joint to at most 40 poses, once for each start value in a grid. Return
    # the best results. They are the start values of the fits to all poses.
    few, farthest = few_of(len(given.q)), np.max(np.abs(given.q), axis=0)
    grid = [
        (scale, reach / farthest[scale.joint] - 1.0)
        for scale in scales
        for reach in (SLIDING_REACHES if scale.unit == 'm' else TURNING_REACHES)
    ]
    if given.robot.chain.loops or not grid:
        return []  # scaled joint positions would not satisfy the closed loops
    joints, more = [scale.joint for scale, _ in grid], np.array([change for _, change in grid])
    ways = joint_ways(given.q)[joints][:, few]
    moved = partial(moved_joints, given.robot, given.q[few], joints, ways)
    means, ranges = given.q.mean(axis=0)[joints], joint_range(given.q)[joints]
    values, B = np.stack([more * means, more * ranges], axis=1), given.poses[few]
    B = np.tile(B, (len(grid), 1, 1, 1))
    result = fit_numbers(moved, values, B, fit_offsets(moved(values).pose, B, steps=0), SIFT_STEPS)
    return [
        (grid[k][0], result.values[k], result.fit.one(k))
        for k in np.argsort(result.fit.score, kind='stable')[:FITTED_IN_FULL].tolist()
        if result.fit.score[k] < _score_limit(before)
    ]


def _fitted(
    given: ComparedData, before: Fit, number: NumberHypothesis, values: Floats, begin: Fit
) -> TestedCause | None:
    # Fit the offsets of base and tool together with one number of the robot file. Return the cause
    # 'this number is wrong', or None if a closed loop does not close.
    try:
        result = fit_numbers(number.at, values[None], given.poses[None], lifted(begin), ROUNDS)
    except LoopError:
        return None
    fit, value, size, q = result.fit.one(0), float(result.values[0, -1]), number.usual, given.q
    if number.joint >= 0 and joint_range(q)[number.joint] > MIN_RANGE:
        # the zero or scale of a moving joint may be wrong by any amount
        size = max(size, abs(value))
    if number.key == 'joint_scale':
        q = q + np.eye(q.shape[1])[number.joint] * (
            joint_ways(q)[number.joint] @ result.values[0][:, None]
        )
        value = 1.0 + value / float(joint_range(given.q)[number.joint])
    cause = _cause(number.key, number_in_words(number, value), value, before, fit)
    if cause.ratio < NAMED_RATIO:
        return cause._replace(name=number.name)
    # Test whether other numbers of the robot file explain the residuals as well as this number.
    # The fit above gave the correction v of this number. Now fit all numbers together: one step of
    # linear least squares, in which each number is scaled by its usual error. The step changes v
    # by d. Let r be the diagonal entry of this number in the model resolution matrix (Menke,
    # Geophysical Data Analysis, chapter 4). r is 1 if the poses distinguish this number from all
    # other numbers, else less. Then `resolution` is r - |d / v|. A large d lowers `resolution`,
    # because it means that other numbers explain the residuals better.
    corrected, change = given._replace(q=q), number.at(result.values)
    others = [
        hypothesis.usual * hypothesis.columns[:, :, -1:]
        for hypothesis in (*number_hypotheses_of(corrected), *scale_hypotheses_of(corrected))
        if (hypothesis.key, hypothesis.name) != (number.key, number.name)
    ]
    columns = np.concatenate([*others, size * change.jacobian[0, :, :, -1:]], axis=2)
    moved, residuals = _beyond(given, change.pose[0], fit, columns)
    noise = max(float(fit.score), POSE_DIGIT) ** 2 / 6.0
    inverse = np.linalg.inv(moved.T @ moved + noise * np.eye(moved.shape[1]))
    taken = size * abs(inverse[-1] @ (moved.T @ residuals) / result.values[0, -1])
    resolution = 1.0 - noise * float(inverse[-1, -1]) - float(taken)
    return cause._replace(name=number.name, resolution=resolution)


def number_in_words(number: NumberHypothesis, value: float) -> str:
    """
    Return a sentence that states by how much one number of the robot file is wrong.

    `value` is the fitted correction of the number, rad or m. If the number is the scale of a
    joint, `value` is the fitted factor of the joint positions.
    """
    if number.key == 'joint_scale':
        for unit, factor, words in FACTORS:
            if unit == number.unit and abs(value / factor - 1.0) < FACTOR_TOLERANCE:
                return f'joint {number.name} {words}'
        return f'joint {number.name} counts {1.0 / value:.3g} times its motion'
    shown = length_in_words(value) if number.unit == 'm' else angle_in_words(value)
    shown = shown if value < 0.0 else f'+{shown}'
    if number.key == 'joint_offset':
        return f'the zero of joint {number.name} is off: its positions need {shown}'
    kind = 'a length' if number.unit == 'm' else 'an angle'
    return f'{kind} of the table is off: {number.name} needs {shown}'


def _lag(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    if given.later is None:
        return []
    try:
        lag = lagged(given.robot, given.later, given.poses, A, fit)
    except LoopError:
        return []  # a loop does not close at joint positions that are interpolated for a trial lag
    if lag is None:
        return []
    size, unit = abs(lag.value), given.later.unit
    shown = time_in_words(size) if unit == 's' else f'{size:.3g} {unit}'
    side = 'behind' if lag.value < 0.0 else 'ahead of'
    sentence = f'the poses are {shown} {side} the joint states'
    return [_cause('time_lag', sentence, lag.value, lag.before, lag.fit)]


def _cause(
    key: str, sentence: str, value: float | None, before: Fit, fit: Fit, unit: float = 1.0
) -> TestedCause:
    ratio = float(before.score) / max(float(fit.score), ROUND_OFF)
    errors = errors_of(unit * fit.position, fit.rotation)
    return TestedCause(key, sentence, value, ratio, errors, fit.X, fit.Y)
