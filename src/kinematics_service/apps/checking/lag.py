# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the lag between the joint positions of a robot and the poses of a second source.

For each trial lag, the offsets of base and tool are fitted with the joint positions at the time of
the pose plus the lag. The best trial lags are refined by Levenberg-Marquardt.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats, Integers
from ...kinematics.tool_state import evaluate
from ...robot.robot import Robot
from .joint_motion import JointsAtTimes, SampledMotion
from .offsets import Fit, fit_numbers, fit_offsets, lifted

# Largest lag (s) between poses and joint states that is tried, in both directions.
REACH = 0.5
# Largest lag (samples) that is tried if the times of the poses are unknown.
MAX_LAG_SAMPLES = 10.0
# Number of trial lags, evenly spaced from the most negative to the most positive lag.
TRIALS = 51
# The largest lag tried is at most this fraction of the duration of the recorded motion.
MOTION_SHARE = 0.25
# Number of poses with which each trial lag is tested.
SAMPLES = 40
# Number of Levenberg-Marquardt steps that fit the offsets of base and tool for each trial lag.
TRIAL_STEPS = 4
# Number of trial lags that are refined, and number of Levenberg-Marquardt steps of each
# refinement.
MINIMA = 2
REFINE_STEPS = 6
# A lag is sought only if the joint positions of at least this many poses are known at all trial
# lags.
MIN_POSES = 8


class Later(NamedTuple):
    """
    The joint positions at the times of the poses plus a lag, as a function of the lag.

    Attributes
    ----------
    at
        Returns the joint positions at the times of the poses plus the given lag.
    reach
        The largest lag tried.
    unit
        The unit of lags: s or samples.
    """

    at: Callable[[float], JointsAtTimes]
    reach: float
    unit: str = 's'


def looked_up(motion: SampledMotion, stamps: Floats, unit: str = 's') -> Later:
    """
    Return the joint positions of a motion as a function of a lag: at the times `stamps` + lag.

    `stamps` (N,) are the times of N measured poses. `unit` is the unit of the stamps and of the
    lag: s or samples.
    """
    reach = REACH if unit == 's' else MAX_LAG_SAMPLES
    reach = min(reach, MOTION_SHARE * motion.duration)
    return Later(lambda lag: motion.at(stamps + lag), reach, unit)


class Lagged(NamedTuple):
    """
    A fitted lag. A pose with the stamp t belongs to the joint positions at the time t + `value`.

    `before` is the fit of the base and tool offsets with the lag 0. `fit` is the fit of the base
    and tool offsets with the lag `value`.
    """

    value: float
    before: Fit
    fit: Fit


def lagged(robot: Robot, later: Later, poses: Floats, A: Floats, fit: Fit) -> Lagged | None:
    """
    Return the lag with the smallest residuals; None if joint positions around the poses are
    unknown, or if no joint moves.

    Parameters
    ----------
    poses, A : shape (N, 4, 4)
        Poses of the second source and of the robot file.
    fit
        The base and tool offsets between `A` and `poses`, fitted with the lag 0.
    """
    lags = np.linspace(-later.reach, later.reach, TRIALS)
    tried = [later.at(lag) for lag in lags.tolist()]
    known = np.flatnonzero(np.all([lookup.known for lookup in tried], axis=0))
    moving = any(bool(np.any(lookup.rates[known])) for lookup in tried)
    if len(known) < MIN_POSES or later.reach <= 0.0 or not moving:
        return None
    few = known[np.unique(np.linspace(0, len(known) - 1, SAMPLES).astype(int))]
    q = np.stack([lookup.q[few] for lookup in tried])
    B = np.broadcast_to(poses[few], (TRIALS, len(few), 4, 4))
    sifted = fit_offsets(evaluate(robot, q, depth=kernel.POSE).pose, B, steps=TRIAL_STEPS)
    before = fit_offsets(A[known][None], poses[known][None], begin=lifted(fit), steps=2).one(0)
    results = [
        _refined(robot, later, poses, known, before, sifted.one(k), float(lags[k]))
        for k in _valleys(sifted.score)
    ]
    return min(results, key=lambda result: float(result.fit.score))


def _valleys(scores: Floats) -> list[int]:
    # Return the indices of the trial lags at which the score (RMS residual) has its lowest local
    # minima, at most two.
    around = np.pad(scores, 1, constant_values=np.inf)
    lowest = np.flatnonzero((scores <= around[:-2]) & (scores <= around[2:]))
    order = np.argsort(scores[lowest], kind='stable')[:MINIMA]
    return [int(k) for k in lowest[order]]


def _refined(
    robot: Robot, later: Later, poses: Floats, rows: Integers, before: Fit, begin: Fit, lag: float
) -> Lagged:
    # Fit the lag together with the offsets of base and tool. Start from the trial value `lag`, and
    # from the offsets `begin` that were fitted with it.
    def moved(values: Floats) -> tuple[Floats, Floats]:
        lookup = later.at(float(values[0, 0]))
        state = evaluate(robot, lookup.q[rows], np.ascontiguousarray(lookup.rates[rows]))
        return state.pose[None], state.twist[None, :, :, None]

    result = fit_numbers(moved, np.array([[lag]]), poses[rows][None], lifted(begin), REFINE_STEPS)
    return Lagged(float(result.values[0, 0]), before, result.fit.one(0))
