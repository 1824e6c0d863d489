# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Decide whether a fit is accepted as a calibration, by its residuals, its outliers and its joints.

A score test detects errors that depend on the position of a joint. The test adds one parameter to
the fit, the gear ratio of the joint (Cook and Weisberg, Residuals and Influence in Regression,
1982, section 2.3.2).
"""

import math
from collections.abc import Iterator
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ...robot.file.parts.parameters import ANGLE, GEARS, LENGTH
from ...robot.robot import Robot
from ...typography import listed
from ..checking.diagnosis import MIN_POSES
from ..checking.errors import EXPLAINED, PoseLimit, angle_in_words, length_in_words
from ..checking.judgement import FrameLimits
from ..recordings.readers.block import Flags
from .checking import NAMES_IN_SENTENCE
from .fitting import FitProblem, Identified, normal_scores, one_more
from .identified_table import MIN_DEVIATION_RATIO
from .result import Calibration

# The calibration is refused if more than a tenth of the measurements contradict the arm. A
# measurement contradicts the arm if it is an outlier and its position error or rotation error is
# above `JudgedFit.limit`.
OUTLIER_SHARE = 0.1
# Significance level of two tests. Each tests all joints, and the level is the chance that a test
# blames any joint wrongly. Fisher's exact test detects that the outliers lie in one part of a
# joint's range. The score test detects residuals that depend on a joint position.
TEST_LEVEL = 1e-3
# If the noise of the instrument is given, RMS residuals of the fit up to this factor times the
# noise are accepted.
NOISE_RATIO = 2.0


class JudgedFit(NamedTuple):
    """
    A calibration whose fit is to be judged. `whole` is True if all numbers of the table except
    gear ratios were fitted.
    """

    result: Calibration
    whole: bool

    @property
    def limit(self) -> PoseLimit:
        """Return the largest accepted RMS errors of position (m) and rotation (rad)."""
        limit = FrameLimits().warn if self.whole else EXPLAINED
        bounds = (NOISE_RATIO * math.sqrt(3) * s for s in self.result.instrument or (0.0, 0.0))
        return PoseLimit(*map(max, zip(limit, bounds)))

    @property
    def contradicting(self) -> Flags:
        """
        Return flags (N,) of the N measurements: True for an outlier whose position error or
        rotation error is above `limit`.
        """
        far = np.linalg.norm(self.result.remainders, axis=2) > self.limit
        return np.asarray(~self.result.used & np.any(far, axis=1))

    @property
    def many_out(self) -> bool:
        """Return whether more than a tenth of the measurements were left out as outliers."""
        return len(self.result.outliers) > OUTLIER_SHARE * self.result.count


def refusals_of(fit: JudgedFit) -> tuple[str, ...]:
    """Return a sentence for each reason to refuse the calibration; empty if it is accepted."""
    result, out, reasons = fit.result, fit.contradicting, list[str]()
    if np.sum(out) > OUTLIER_SHARE * result.count:
        reasons.append(
            f'{np.sum(out)} of {result.count} {result.rows} contradict the arm: that is more than '
            'a tenth, too many for outliers'
        )
    if by_joint := _by_joint(result, out):
        reasons.append(by_joint)
    errors = (result.with_outliers if reasons or fit.many_out else result.without).after
    remaining = list(zip(errors.rms, fit.limit, (length_in_words, angle_in_words)))
    for rms, limit, words in remaining[: 1 if result.positions else 2]:
        if rms >= limit:
            least = words(limit)
            reasons.append(f'{words(rms)} remain (rms), where less than {least} is required')
    return tuple(reasons) or ((result.worse,) if result.worse else ())


def noise_remarks(fit: JudgedFit) -> Iterator[str]:
    """
    Yield a remark if a larger noise of the instrument may explain the outliers.

    The remark is given if more than a tenth of the measurements are outliers, but the errors of
    all outliers are within the accepted limit (`fit.limit`).
    """
    if fit.many_out and not np.any(fit.contradicting):
        position, angle = (rms / math.sqrt(3) for rms in fit.result.with_outliers.after.rms)
        turned = '' if fit.result.positions else f',{math.degrees(angle):.1g}deg'
        yield (
            f'{len(fit.result.outliers)} of {fit.result.count} {fit.result.rows} are left out, '
            f'though audit accepts each: --noise {1000 * position:.1g}mm{turned} takes them in'
        )


def _by_joint(result: Calibration, out: Flags) -> str:
    # Return a sentence if the outliers lie in one part of the range of a joint; else an empty
    # text. Let q be the positions of a joint in all measurements, m the median of q, and x the
    # position of the joint in one outlier. Test three parts of the range for each joint and each
    # outlier: q >= x, q <= x, and |q - m| >= |x - m|. Count the outliers in each part. Then
    # compute the probability of this count or a larger one if outliers are spread at random over
    # the measurements.
    outliers, count, rows = int(np.sum(out)), len(out), result.rows
    if outliers < MIN_POSES or outliers == count:
        return ''
    least_likely, tests = (TEST_LEVEL, ''), 3 * result.q.shape[1] * outliers
    for name, slides, q in zip(result.robot.joint_names, result.robot.prismatic, result.q.T):
        middle, words = float(np.median(q)), length_in_words if slides else angle_in_words
        for side, values in (('above', q), ('below', -q), ('away', np.abs(q - middle))):
            for value in np.unique(values[out]).tolist():
                beyond = values >= value
                drawn, both = int(np.sum(beyond)), int(np.sum(beyond & out))
                chance = tests * _by_chance(count, outliers, drawn, both)
                if chance < least_likely[0]:
                    where = f'{side} {words(value if side == "above" else -value)}'
                    if side == 'away':
                        where = f'{words(value)} or more from {words(middle)}'
                    least_likely = chance, f'where joint {name} is {where}: {both} of {drawn}'
    return (
        least_likely[1]
        and f'{rows} contradict the arm {least_likely[1]} {rows} there were left out'
    )


def _by_chance(count: int, outliers: int, drawn: int, both: int) -> float:
    # `outliers` of `count` measurements are outliers. Choose `drawn` of all measurements at
    # random. Return the probability that at least `both` of the chosen measurements are outliers
    # (hypergeometric distribution).
    ways = (
        math.comb(outliers, k) * math.comb(count - outliers, drawn - k)
        for k in range(both, min(outliers, drawn) + 1)
    )
    return sum(ways) / math.comb(count, drawn)


def joint_remarks(robot: Robot, problem: FitProblem, identified: Identified) -> Iterator[str]:
    """
    Yield remarks on joints: a sentence if joints move too little, and a sentence if the residuals
    depend on the position of a joint.
    """
    yield from _nearly_still(robot, problem, identified)
    if not any(parameter.group == GEARS for parameter in problem.parameters):
        yield from _by_gear(robot, problem, identified)


def _nearly_still(robot: Robot, problem: FitProblem, identified: Identified) -> Iterator[str]:
    # Yield a sentence that names the joints which move too little. If the axis of a revolute joint
    # has the position error e (m), a turn by d (rad) causes the position error e * d of the tool.
    # If the axis of a prismatic joint has the direction error e (rad), a slide by d (m) causes the
    # position error e * d, too. Let d be measured from the mean joint position, and let D be the
    # square root of the sum of d^2 over the used measurements. Then the fit estimates e with the
    # standard deviation s = noise / D, where the noise is that of a measured position. Let u be
    # the usual size of e. The joint is named if s > u / MIN_DEVIATION_RATIO.
    q = problem.given.q[identified.used]
    seen = np.linalg.norm(q - np.mean(q, axis=0), axis=0)
    usual = np.where(robot.prismatic, float(ANGLE), LENGTH)
    named = []
    for j in np.flatnonzero(usual * seen < MIN_DEVIATION_RATIO * identified.noise.position):
        words = length_in_words if robot.prismatic[j] else angle_in_words
        named.append(f'{robot.joint_names[j]} (by {words(float(np.ptp(q[:, j])))})')
    if named:
        yield (
            f'Joints that move too little for their axes to be seen beside the noise: '
            f'{listed(named, NAMES_IN_SENTENCE)}; numbers of these axes mostly keep their '
            'nominal values: let these joints move farther'
        )


def _by_gear(robot: Robot, problem: FitProblem, identified: Identified) -> Iterator[str]:
    # The derivative of a pose by a gear ratio equals the derivative of the pose by the joint
    # position, multiplied by the joint position.
    moves = problem.moves_with_joints(identified.values) * problem.given.q[:, None, None, :]
    shown = np.any(moves != 0.0, axis=(0, 1, 2))
    joints = np.flatnonzero(shown)
    shares, deviations = one_more(problem, identified, moves[..., joints])
    scores = normal_scores(np.abs(np.divide(shares, deviations)), identified.freedom)
    best = int(np.argmax(scores))
    # The score test is two-sided. Divide its significance level by the number of joints
    # (Bonferroni).
    if scores[best] > NormalDist().inv_cdf(1.0 - TEST_LEVEL / (2 * robot.dof)):
        yield (
            f'The errors depend on the position of joint {robot.joint_names[joints[best]]}, as '
            f'if its gear ratio were off by {100 * shares[best]:.2g} % (score test of an added '
            f'parameter, at {100 * TEST_LEVEL:g} %): --fit all fits gear ratios'
        )
