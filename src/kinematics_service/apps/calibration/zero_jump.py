# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Detect a jump of a joint zero by the generalized likelihood ratio (GLR) test of Willsky and Jones.

Sources: Willsky and Jones 1976; Basseville and Nikiforov 1993, chapter 7. Let x be the unknown
base, tool, lag and errors of the table, with Gaussian priors. Let delta be the jump: a change of
one parameter (a joint zero, base, tool or lag). Let H and A be the derivatives of a pose by x and
by delta. The residual e of a pose is e = H x + noise before the jump, and e = H x + A delta +
noise after the jump. The newest poses are the window. The jump happens at one pose of the window.
The test maximizes the likelihood ratio over the parameter that jumps, the first pose after the
jump, and delta.

x is estimated from the window and from the baseline. The baseline has the poses without a jump
that came before the window. Errors of the table are part of x. So they raise no alarm when the arm
moves to a region where it has not worked before.

If the errors of successive poses are correlated, the threshold is higher: it is multiplied by the
number of poses that contain as much information as one pose with an independent error. This number
is estimated. The estimate can be too small, so correlated errors may still raise an alarm, mostly
within the first 70 poses.
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats, Integers
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.arm_errors import TableErrors, table_errors_of
from ...kinematics.uncertainty.parameters import parameters_of
from ...robot.file.parts.description import Uncertainty
from ...robot.robot import Robot
from ..checking.errors import angle_in_words, length_in_words, time_in_words
from ..checking.offsets import fit_at, fit_offsets, jacobian, moved_offsets, residual
from ..recordings.readers.block import Flags
from .collecting import CollectedPoses

# Thresholds of the likelihood ratio of a jump: quantiles of chi-square with 1 degree of freedom
# (joint zero, lag) and 6 (base, tool), exceeded with probability 1e-10. With some 1000 tests for
# each pose, a healthy arm raises one false alarm in 1e7 poses.
THRESHOLDS = {1: 41.8, 6: 58.4}
# Each possible jump has a likelihood ratio, and a threshold from THRESHOLDS. A jump is suspected
# if its likelihood ratio exceeds `threshold - FREEZE_RATIO * THRESHOLDS[1]`. While a jump is
# suspected, no poses enter the baseline, because poses after a jump must not enter it.
FREEZE_RATIO = 0.5
# The window has the newest poses and is tested for a jump. It keeps at least WINDOW poses, and at
# most WINDOW + BATCH - 1. WINDOW is above 100, because a slip of a joint must be detected from 100
# poses that a camera measures.
WINDOW = 128
# A jump is not reported if only this number of poses, or fewer, suggest the jump. The instrument
# may have measured these poses wrong.
MAX_FAILED = 5
# A jump is proven only if at least this number of poses came after the jump and fit better with
# the jump.
MIN_POSES = MAX_FAILED + 1
# New poses are added to the window and tested in groups of this number. The oldest poses of the
# window also leave the window in groups, of this number or more.
BATCH = 16
# Lower bounds of the noise: the standard deviation of each coordinate of a position (m) and of a
# rotation vector (rad). A good tracker has this noise.
MIN_NOISE = 1e-4, np.radians(0.02)
# Prior standard deviation (m and rad) of the offsets of base and tool from their fitted values. It
# is so wide that it hardly affects the estimate.
OFFSET = 0.3
# Prior standard deviation (s) of the delay between joint states and poses of the second source:
# two periods of joint states at 200 Hz.
LAG = 0.01
# Largest number of poses in the baseline. The baseline keeps only the newest poses without a jump,
# so that the estimate follows an arm that warms up.
MEMORY = 2 * WINDOW
# The residuals are linearized again if the offsets of base and tool moved by this value or more
# (m, rad). If they moved less, the error of the linearization, the square of the motion, is
# negligible.
STEP = 2e-3
# The squared residual of a pose has a chi-square distribution with 6 degrees of freedom. This is
# the median of the distribution.
MEDIAN = 5.35
# Largest number of successive linearizations, each at the newly estimated offsets of base and
# tool.
ROUNDS = 8
# A joint that moved less than this (rad) is never named as the joint that jumped. For a prismatic
# joint, the value is multiplied by the characteristic length.
MIN_RANGE = 0.02
# The information matrix (inverse covariance) of a jump's size may be singular, because base, tool,
# lag and table are estimated together with the size. Let w be the largest diagonal entry that the
# matrix would have if base, tool, lag and table were known. MIN_RATIO * (1 + w) is added to the
# diagonal, so that the matrix can be inverted.
MIN_RATIO = 1e-9
# Two joints are rivals if their jumps explain the poses nearly equally well: the ratio of the two
# likelihoods is at most 100. The gain of a jump is twice the increase of the log likelihood, so
# the gains of rivals differ by at most 2 log(100).
RIVAL_GAIN = 2.0 * math.log(100)
# A jump of a joint zero is detected if the estimated size is above sqrt(THRESHOLDS[1]) standard
# deviations. If the true size is sqrt(THRESHOLDS[1]) + POWER_Z standard deviations, the jump is
# detected with probability 0.9.
POWER_Z = NormalDist().inv_cdf(0.9)
# Number of the newest poses that are given to a diagnosis: half of the window.
RECENT = WINDOW // 2
# The second source is the instrument that measures the tool poses. It is reported to fail if more
# than an eighth of the poses in the window are outliers.
MAX_OUTLIERS = WINDOW // 8
# The status names the smallest jump that the test would detect once this number of poses has come
# after the jump.
FORECAST = 50

BASE, TOOL, LAGS = slice(0, 6), slice(6, 12), slice(12, 13)
KEYS = {BASE.start: 'base', TOOL.start: 'tool', LAGS.start: 'time_lag'}
# Argument of `fit_offsets`: the length (m) whose error weighs as much as an error of 1 rad in the
# fit of base and tool. The length is 1, so positions are not scaled.
ONE = np.ones((1, 1, 1))


@dataclass(frozen=True)
class ZeroJump:
    """
    A detected jump.

    Attributes
    ----------
    key
        joint_offset, base, tool or time_lag.
    names
        The joints that may have jumped, the likeliest first; or the key if no joint jumped.
    sizes
        Size of the jump for each name in `names`, rad, m or s; for base and tool the rotation
        (rad).
    position, angle
        RMS motion of the tool poses by the jump, m and rad.
    stamp, count
        The stamp (ns) of the first pose after the jump; the number of poses since the jump.
    sentence
        The jump as a sentence.
    """

    key: str
    names: tuple[str, ...]
    sizes: tuple[float, ...]
    position: float
    angle: float
    stamp: int
    count: int
    sentence: str


class Watched(NamedTuple):
    """
    The result of the jump tests of all poses so far.

    Attributes
    ----------
    jump
        The jump that was detected, or None.
    tested
        Number of poses tested so far.
    outliers
        Number of poses that fit neither the baseline nor a jump, among the newest poses (the
        window).
    recent
        The newest poses, at most 64. After a jump, only poses since the jump. Outliers are left
        out, except if more than an eighth of the poses in the window are outliers.
    noise
        Standard deviations of the noise: of each coordinate of a position (m), and of each
        coordinate of a rotation vector (rad).
    smallest
        For each joint that moved: its name, the smallest jump that the test detects in nine of ten
        cases, and the unit of the jump.
    """

    jump: ZeroJump | None
    tested: int
    outliers: int
    recent: CollectedPoses
    noise: tuple[float, float]
    smallest: tuple[tuple[str, float, str], ...]

    @property
    def fails(self) -> bool:
        """
        Return whether the instrument that measures the poses fails: more than an eighth of the
        poses in the window are outliers.
        """
        return self.outliers > MAX_OUTLIERS

    def sentence(self) -> str:
        """
        Return a sentence for the status of the second source, if no jump is detected.

        The sentence names the smallest jump that would be detected. If too many poses are
        outliers, the sentence instead asks the user to look at the second source.
        """
        if self.fails:
            return (
                f'{self.outliers} of the last {WINDOW} poses fit neither the others nor a jump: '
                'look at the second source'
            )
        position, rotation = self.noise
        noise = f'noise {length_in_words(position)}, {angle_in_words(rotation)}'
        text = f'no jump in {self.tested} poses since ({noise})'
        if not self.smallest:
            return text
        low, high = (bound(self.smallest, key=lambda jump: jump[1]) for bound in (min, max))
        return f'{text}; {FORECAST} such poses would show {_in_words(*low)} to {_in_words(*high)}'

    def values(self) -> list[tuple[str, str]]:
        """
        Return the keys and values that the diagnostics message of the second source contains.
        """
        jump = self.jump
        return [
            ('poses tested', str(self.tested)),
            ('outliers', str(self.outliers)),
            ('noise, position (m)', f'{self.noise[0]:.3g}'),
            ('noise, rotation (rad)', f'{self.noise[1]:.3g}'),
            ('smallest jumps found', ', '.join(_in_words(*entry) for entry in self.smallest)),
            ('jump', ', '.join(jump.names) if jump else ''),
            ('jump (rad, m or s)', ', '.join(f'{x:.6g}' for x in jump.sizes) if jump else ''),
            ('jump, poses ago', str(jump.count) if jump else ''),
        ]


class _Baseline:
    # Estimates the unknown x (base, tool, lag, table) from poses without a jump. `mean` and
    # `information` are the mean and the information matrix of x, in units of the prior of x.
    # `noise` is estimated from the residuals. `freedom` has the degrees of freedom of this
    # estimate: the count of measured numbers minus the number of unknowns in x that the poses
    # determine (MacKay 1992).
    def __init__(self, rows: Floats, unknown: Integers, floor: Floats) -> None:
        e, H = rows[:, :, 0], rows[:, :, 1:][:, :, unknown]
        r = np.moveaxis(e.reshape(len(e), 2, 3), 1, 0).reshape(2, -1, 1)
        K = np.moveaxis(H.reshape(len(e), 2, 3, -1), 1, 0).reshape(2, r.shape[1], -1)
        gram, right = np.swapaxes(K, 1, 2) @ K, (np.swapaxes(K, 1, 2) @ r)[:, :, 0]
        self.noise = floor
        for _ in range(3):
            weights = self.noise**-2
            self.information = np.tensordot(weights, gram, 1) + np.eye(len(unknown))
            covariance = np.asarray(np.linalg.inv(self.information), dtype=np.float64)
            self.mean = covariance @ (weights @ right)
            determined = weights * np.einsum('ij,kji->k', covariance, gram)
            self.freedom = np.maximum(3.0 * len(e) - determined, 1.0)
            residuals = (e - H @ self.mean).reshape(-1, 2, 3)
            variance = np.sum(residuals**2, axis=(0, 2)) / self.freedom
            self.noise = np.maximum(np.sqrt(variance * poses_of_one_error(residuals)), floor)


def poses_of_one_error(residuals: Floats) -> Floats:
    """
    Return a measure (2,) of the correlation of successive residuals, for position and rotation.

    A measure m >= 1 means: m successive poses contain as much information as one pose whose error
    is independent of all others. Errors are correlated, for example, because the arm is elastic or
    the image is distorted. m is estimated by the ratio of von Neumann (1941).

    Parameters
    ----------
    residuals : shape (N, 2, 3)
        Residuals of position and rotation in the order of time.
    """
    sums, differences = residuals[1:] + residuals[:-1], residuals[1:] - residuals[:-1]
    squares = np.sum(sums**2, axis=(0, 2)), np.sum(differences**2, axis=(0, 2))
    # If all residuals are zero, set the ratio of von Neumann to 1.
    ratio = np.divide(*squares, out=np.ones(2), where=squares[1] > 0.0)
    return np.asarray(np.maximum(ratio, 1.0))


class _JumpCandidate(NamedTuple):
    # A possible jump of one parameter. `columns` selects the derivatives by the parameter. `begin`
    # is the index of the first pose after the jump, `size` the size of the jump. `gain` is twice
    # the increase of the log likelihood by the jump. `excess` is the test statistic minus its
    # threshold. `scale` is max(1, v / v0). Here v is the variance of the residuals with the jump
    # removed, and v0 is the variance of the residuals in the baseline.
    columns: slice
    begin: int
    size: Floats
    gain: float
    excess: float
    scale: float


class _LikelihoodRatios:
    # Computes the likelihood ratios of possible jumps in a window of poses. The unknown x (base,
    # tool, lag, table) is estimated from the baseline and from the window. Residuals are in units
    # of the noise.
    def __init__(
        self, rows: Floats, used: Flags, unknown: Integers, jumping: int, baseline: _Baseline
    ) -> None:
        Z = rows * (used[:, None] * np.repeat(1.0 / baseline.noise, 3))[:, :, None]
        e, A, H = Z[:, :, 0], Z[:, :, 1 : jumping + 1], Z[:, :, 1:][:, :, unknown]
        r, K, prior = e.reshape(-1), H.reshape(e.size, -1), baseline.information @ baseline.mean
        G = baseline.information + K.T @ K
        G += np.finfo(np.float64).eps * np.trace(G) * np.eye(len(G))
        whitening = np.linalg.inv(np.linalg.cholesky(G))
        # Transform the unknown x (base, tool, lag, table) to uncorrelated components, each with
        # variance 1. The columns of B are the derivatives of the residuals by the components.
        B, y = K @ whitening.T, whitening @ (prior + K.T @ r)
        self.A, self.B, self.residuals = A, B.reshape(H.shape), (r - B @ y).reshape(e.shape)
        products = np.concatenate([A, self.B, self.residuals[:, :, None]], axis=2)
        # A has the derivatives of the residuals by the sizes of possible jumps, and B those by the
        # components of the unknown x. Row k of `sums` belongs to a jump at pose k. It has the
        # products A^T A, A^T B and A^T r with the residuals r, summed from pose k to the last
        # pose.
        self.sums = np.cumsum((np.swapaxes(A, 1, 2) @ products)[::-1], axis=0)[::-1]
        freedom = float(np.sum(baseline.freedom))
        self.misfit = freedom + float(r @ r + baseline.mean @ prior - y @ y)
        self.freedom = freedom + 6.0 * float(np.sum(used))

    def information(self, sums: Floats, columns: slice) -> Floats:
        # Return the information matrices (inverse covariances), shape (K, c, c), of K possible
        # jumps. A jump is described by c numbers: 1 for a joint zero or the lag, 6 for base or
        # tool. The unknown x (base, tool, lag, table) is estimated together with the jump.
        D, whole = sums[:, columns, self.A.shape[2] : -1], sums[:, columns, columns]
        least = MIN_RATIO * (1.0 + np.max(np.einsum('kii->ki', whole), axis=1))
        unit = least[:, None, None] * np.eye(whole.shape[1])
        return np.asarray(whole - D @ np.swapaxes(D, 1, 2) + unit)

    def likeliest(self, columns: slice, sums: Floats, first: int) -> _JumpCandidate:
        # Return the likeliest jump of the parameter with the derivatives `columns`. Row i of
        # `sums` belongs to a jump that begins at pose `first` + i.
        u = sums[:, columns, -1]
        sizes = np.linalg.solve(self.information(sums, columns), u[:, :, None])[:, :, 0]
        gains = np.sum(u * sizes, axis=1)
        at = int(np.argmax(gains))
        gain, dof = float(gains[at]), u.shape[1]
        freedom, misfit = self.freedom - dof, self.misfit - gain
        # This is twice the log likelihood ratio for a noise of unknown size. With Bartlett's
        # factor, the value is nearly chi-square distributed.
        ratio = (freedom + 0.5 * dof - 1.0) * math.log1p(gain / max(misfit, freedom))
        scale = max(1.0, misfit / self.freedom)
        return _JumpCandidate(columns, first + at, sizes[at], gain, ratio - THRESHOLDS[dof], scale)

    def parts(self, jump: _JumpCandidate) -> tuple[Floats, Floats]:
        # The gain of a jump is twice the increase of the log likelihood if the jump is assumed.
        # Return two arrays: the residuals (N, 6) of the N tested poses after the effect of the
        # jump is subtracted, and the contribution (N,) of each pose to the gain.
        jumped = self.A[:, :, jump.columns] @ jump.size
        jumped[: jump.begin] = 0.0
        x = jump.size @ self.sums[jump.begin, jump.columns, self.A.shape[2] : -1]
        return self.residuals - jumped + self.B @ x, np.sum(jumped * self.residuals, axis=1)

    def is_proven(self, jump: _JumpCandidate) -> bool:
        # Return whether a jump is proven. First raise the threshold if residuals are larger than
        # in the baseline, or correlated: least = threshold * max(jump.scale, noise). `jump.scale`
        # is 1 or more and grows with the residuals. `noise` is s * m, for positions or for
        # rotations, whichever is larger. s is the mean squared residual after the effect of the
        # jump is subtracted, and m measures the correlation of successive residuals
        # (`poses_of_one_error`). A proven jump satisfies three conditions:
        # 1. The test statistic is above `least`.
        # 2. The gain (twice the increase of the log likelihood) is at least `least`. The gain is a
        # sum with one contribution for each pose. Each contribution is clipped, so that MAX_FAILED
        # poses cannot prove a jump.
        # 3. At least MIN_POSES poses, and more than half of the poses after the jump, fit better
        # with the jump than without it. Outliers alone cannot meet this condition.
        residuals, (after, shares) = self.residuals, self.parts(jump)
        blocks = after.reshape(-1, 2, 3)
        residuals, after, shares = (part[jump.begin :] for part in (residuals, after, shares))
        improved = np.sum(residuals**2 - after**2, axis=1) > 0.0
        agree = np.sum(improved) >= max(MIN_POSES, np.sum(np.any(after != 0.0, axis=1)) // 2 + 1)
        count = np.maximum(np.count_nonzero(blocks, axis=(0, 2)), 1)
        noise = float(np.max(np.sum(blocks**2, axis=(0, 2)) / count * poses_of_one_error(blocks)))
        threshold = THRESHOLDS[len(jump.size)]
        least = threshold * max(jump.scale, noise)
        limit = least / (MAX_FAILED + 0.5)
        return bool(
            agree
            and jump.excess + threshold > least
            and np.sum(np.clip(shares, -limit, limit)) >= least
        )

    def outlier_gains(self) -> Floats:
        # Return the gain of each pose as an outlier, (N,): twice the increase of the log
        # likelihood if only this pose is assumed to be an outlier.
        V = (1.0 + MIN_RATIO) * np.eye(6) - self.B @ np.swapaxes(self.B, 1, 2)
        residuals = self.residuals[:, :, None]
        return np.asarray(np.sum(residuals * np.linalg.solve(V, residuals), axis=(1, 2)))


class JumpDetector:
    """
    Tests the poses of a second source for a jump of a parameter.

    The parameter is a joint zero, the base, the tool or the lag. The newest poses, the window, are
    tested for a jump. Earlier poses without a jump are the baseline of the test.

    Parameters
    ----------
    robot
        The arm, without closed loops.
    first
        Poses with which the baseline begins; outliers among them are left out.

    Attributes
    ----------
    begun_with
        The first poses without outliers.
    """

    def __init__(self, robot: Robot, first: CollectedPoses) -> None:
        self._jump: ZeroJump | None = None
        self._begun = self._count = 0  # first pose after the jump; count of poses so far
        self._robot, self._table = robot, _table_of(robot)
        self._jumping = LAGS.stop + robot.dof
        causes = self._jumping + np.arange(self._table.factor.shape[1])
        self._unknown = np.append(np.arange(LAGS.stop), causes)
        uncertainty = robot.description.uncertainty
        floor = (uncertainty.floor_xyz, uncertainty.floor_rpy) if uncertainty else (0.0, 0.0)
        self._floor = np.maximum(floor, MIN_NOISE)
        self._lowest, self._highest = np.min(first.q, axis=0), np.max(first.q, axis=0)
        while True:
            A = evaluate(robot, first.q).pose
            self._X, self._Y = fit_offsets(A[None], first.poses[None])[:2]
            self._window, self._learned = first, first.at(slice(0))
            self._rows, self._used = self._linearized(first), np.ones(len(first.q), dtype=bool)
            self._learn(first)
            gains = self._ratios_of_window().outlier_gains()
            # The gain of a pose is twice the increase of the log likelihood if the pose is taken
            # as an outlier. Outliers enlarge the estimated noise, and so reduce all gains. So
            # compare the largest gain with the median gain, not with a fixed threshold.
            worst = float(np.max(gains))
            if worst <= THRESHOLDS[6] / MEDIAN * float(np.median(gains)):
                break
            first = first.at(gains < worst)
        self.begun_with = first
        self._ratios = self._ratios_of_window()
        self._keep(len(first.q))

    def _learn(self, poses: CollectedPoses) -> None:
        # Add poses to the baseline. Then linearize the residuals and estimate the offsets of base
        # and tool again, until the offsets hardly change.
        self._learned = self._learned.followed_by(poses).at(slice(-MEMORY, None))
        for _ in range(ROUNDS):
            rows = self._linearized(self._learned)
            self._baseline = _Baseline(rows, self._unknown, self._floor)
            step = OFFSET * self._baseline.mean[None, : TOOL.stop]
            if np.max(np.abs(step)) < STEP:
                break
            self._X, self._Y = moved_offsets(self._X, self._Y, step, ONE)
            self._rows = self._linearized(self._window)

    def _keep(self, begin: int) -> None:
        # Remove the poses before index `begin` from the window.
        self._window = self._window.at(slice(begin, None))
        self._rows, self._used = self._rows[begin:], self._used[begin:]

    def _linearized(self, of: CollectedPoses) -> Floats:
        # Return the residuals of N poses, and their M derivatives by offsets, lag, joint zeros and
        # table errors, side by side, (N, 6, 1 + M), m and rad.
        state = evaluate(self._robot, of.q, of.rates, depth=kernel.ALL_FRAMES)
        A, count = state.pose, len(of.q)
        fit = fit_at(A[None], of.poses[None], self._X, self._Y, ONE)
        table = _table_columns(self._table, state.link_frames, A, of.q)
        moves = np.concatenate([LAG * state.twist[:, :, None], state.jacobian, table], axis=2)
        tool = A[:, :3, :3] @ self._Y[0, :3, 3]
        moves[:, :3] += np.cross(moves[:, 3:], tool[:, :, None], axis=1)
        moves = (self._X[0, :3, :3] @ moves.reshape(count, 2, 3, -1)).reshape(count, 6, -1)
        ends = OFFSET * jacobian(A[None], fit, ONE).reshape(count, 6, -1)
        return np.concatenate([residual(fit, ONE).reshape(count, 6, 1), ends, moves], axis=2)

    def observe(self, new: CollectedPoses) -> Watched:
        """Test new poses for a jump, and return the result of the tests of all poses so far."""
        for begin in range(0, len(new.q), BATCH):
            part = new.at(slice(begin, begin + BATCH))
            self._lowest = np.minimum(self._lowest, np.min(part.q, axis=0))
            self._highest = np.maximum(self._highest, np.max(part.q, axis=0))
            self._window = self._window.followed_by(part)
            self._rows = np.concatenate([self._rows, self._linearized(part)])
            self._count += len(part.q)
            is_calm = self._test()
            if (over := len(self._used) - WINDOW) >= BATCH:
                if is_calm:
                    self._learn(self._window.at(slice(over)).at(self._used[:over]))
                self._keep(over)
        outliers = int(np.sum(~self._used[-WINDOW:]))
        recent = self._window if outliers > MAX_OUTLIERS else self._window.at(self._used)
        newest = min(self._jump.count, RECENT) if self._jump else RECENT
        noise = float(self._baseline.noise[0]), float(self._baseline.noise[1])
        recent = recent.at(slice(-newest, None))
        return Watched(self._jump, self._count, outliers, recent, noise, self._smallest())

    def _ratios_of_window(self) -> _LikelihoodRatios:
        return _LikelihoodRatios(
            self._rows, self._used, self._unknown, self._jumping, self._baseline
        )

    def _test(self) -> bool:
        # Test the poses of the window for a jump, and report a proven jump. Return True if no jump
        # is suspected. Only then may poses be added to the baseline.
        count = len(self._rows)
        self._used = np.ones(count, dtype=bool)
        if count < MIN_POSES:
            return False
        begins = slice(0, count - MAX_FAILED)
        if self._jump:
            first = max(count - self._count + self._begun, 0)
            begins = slice(first, first + 1)
        while True:
            ratios = self._ratios_of_window()
            candidates = self._candidates(ratios, ratios.sums[begins], begins.start)
            best = max(candidates, key=lambda candidate: candidate.excess)
            gains, begin = ratios.outlier_gains(), 0
            if is_proven := ratios.is_proven(best):
                if self._jump:
                    break
                # A few wrong poses may look like this jump. So leave out suspicious poses, and
                # test again. A pose is suspicious if it does not fit the jump, or if it raises the
                # likelihood of the jump far more than the median pose does.
                (after, shares), begin = ratios.parts(best), best.begin
                usual = np.median(shares[begin:][self._used[begin:]])
                gains = np.maximum(np.sum(after**2, axis=1), MEDIAN * shares / max(usual, 1e-9))
            scale = max(1.0, float(np.median(gains[begin:][self._used[begin:]])) / MEDIAN)
            worst = float(np.max(gains))
            if worst <= scale * THRESHOLDS[6]:
                break
            # A pose with a large gain fits badly and is probably an outlier. Leave out only poses
            # with at least half of the largest gain. Other poses may fit once these worst poses
            # are left out.
            self._used &= gains < 0.5 * worst
        self._ratios = ratios
        if self._jump and (returned := self._returned(ratios, best)):
            self._keep(returned)
            self._jump = None
            return self._test()
        if is_proven:
            if self._jump is None:
                self._begun = self._count - count + best.begin
                self._stamp = self._window.stamps[best.begin]
            self._report(candidates, best)
        elif best.excess <= 0.0:
            self._jump = None
        return best.excess < -FREEZE_RATIO * THRESHOLDS[1] and self._jump is None

    @property
    def _moved(self) -> list[int]:
        # Return the indices of the joints that moved far enough to be named as the joint that
        # jumped.
        ranges = (self._highest - self._lowest) / self._robot.singularity.task.column_scales
        return [int(j) for j in np.flatnonzero(ranges > MIN_RANGE)]

    def _candidates(
        self, ratios: _LikelihoodRatios, sums: Floats, first: int
    ) -> list[_JumpCandidate]:
        joints = [slice(LAGS.stop + j, LAGS.stop + j + 1) for j in self._moved]
        return [ratios.likeliest(columns, sums, first) for columns in (BASE, TOOL, LAGS, *joints)]

    def _returned(self, ratios: _LikelihoodRatios, best: _JumpCandidate) -> int:
        # Return the index of the first pose after a temporary jump has ended; 0 if the jump still
        # lasts.
        first, end = best.begin + MIN_POSES, len(self._rows) - MAX_FAILED
        if first >= end:
            return 0
        passed = ratios.sums[best.begin] - ratios.sums[first:end]
        ended = max(self._candidates(ratios, passed, first), key=lambda candidate: candidate.gain)
        return ended.begin if ended.gain - best.gain > THRESHOLDS[6] * ended.scale else 0

    def _report(self, candidates: list[_JumpCandidate], best: _JumpCandidate) -> None:
        joints = [joint for joint in candidates if joint.columns.start >= LAGS.stop]
        joints.sort(key=lambda joint: -joint.gain)
        if best.columns in (BASE, TOOL) and joints:
            # Compare base or tool with the likeliest joint by the gain: twice the increase of the
            # log likelihood if the jump is assumed. First add two numbers to the joint's gain:
            # 1. `bent`: the model is linear in the jump. So if a joint jumps by an angle, the gain
            # of the joint is too small by about angle^2 * gain.
            # 2. `fewer`: a jump of base or tool has 6 numbers, a jump of a joint has one. So base
            # and tool have a higher threshold. `fewer` is the difference of the two thresholds.
            bent = joints[0].gain * float(joints[0].size[0]) ** 2
            fewer = best.scale * (THRESHOLDS[6] - THRESHOLDS[1])
            best = joints[0] if best.gain - joints[0].gain < bent + fewer else best
        rows = self._rows[best.begin :, :, 1:][:, :, best.columns] @ best.size
        position, angle = np.sqrt(np.mean(np.sum(rows.reshape(-1, 2, 3) ** 2, axis=2), axis=0))
        key = KEYS.get(best.columns.start, 'joint_offset')
        names, sizes = [key], [LAG * float(best.size[0]) if best.columns == LAGS else float(angle)]
        if key == 'joint_offset':
            near = best.gain * (1.0 - float(best.size[0]) ** 2) - RIVAL_GAIN * best.scale
            named = [joint for joint in joints if joint.gain >= near][:2]
            names = [self._robot.joint_names[joint.columns.start - LAGS.stop] for joint in named]
            sizes = [float(joint.size[0]) for joint in named]
        far, since = (float(position), float(angle)), self._count - self._begun
        jump = ZeroJump(key, tuple(names), tuple(sizes), *far, self._stamp, since, '')
        self._jump = replace(jump, sentence=_sentence(jump, self._robot))

    def _smallest(self) -> tuple[tuple[str, float, str], ...]:
        sums, robot, smallest = self._ratios.sums, self._robot, []
        for j in self._moved:
            columns = slice(LAGS.stop + j, LAGS.stop + j + 1)
            known = float(self._ratios.information(sums[-FORECAST:][:1], columns)[0, 0, 0])
            if known > 0.0:
                size = (math.sqrt(THRESHOLDS[1]) + POWER_Z) / math.sqrt(known)
                smallest.append((robot.joint_names[j], size, robot.units[j]))
        return tuple(smallest)


def _table_of(robot: Robot) -> TableErrors:
    # Return the uncertainty of the table. The robot file gives it; if not, take the usual errors
    # of a nominal table.
    uncertainty = robot.description.uncertainty
    if uncertainty is None or not (uncertainty.parameters or uncertainty.factor):
        usual = tuple((entry.name, entry.scale) for entry in parameters_of(robot).table)
        uncertainty = Uncertainty((), (), (), None, usual, (), 0.0, 0.0)
    return table_errors_of(robot, uncertainty)


def _table_columns(table: TableErrors, frames: Floats, A: Floats, q: Floats) -> Floats:
    # Return the derivatives (N, 6, c) of N tool poses by c numbers u. The errors of the table are
    # L u with L = `table.factor`. The numbers u are independent with variance 1, so the covariance
    # of the errors is L L^T.
    F = frames[:, table.frames]
    parts = np.split(table.screws, 2, axis=1)
    linear, angular = (np.einsum('npij,pj->npi', F[..., :3, :3], part) for part in parts)
    linear = linear + np.cross(angular, A[:, None, :3, 3] - F[..., :3, 3])
    by_gear = np.where(table.gears >= 0, q[:, table.gears], 1.0)
    moves = np.concatenate([linear, angular], axis=2) * by_gear[:, :, None]
    return np.asarray(np.swapaxes(moves, 1, 2) @ table.factor)


def _in_words(name: str, size: float, unit: str, sign: str = '') -> str:
    far = (length_in_words if unit == 'm' else angle_in_words)(abs(size))
    return f'{name} {sign if size > 0.0 else "-"}{far}'


def _sentence(jump: ZeroJump, robot: Robot) -> str:
    since = f'since {jump.count} poses (stamp {jump.stamp * 1e-9:.3f} s)'
    if jump.key == 'time_lag':
        (size,) = jump.sizes
        side = 'later' if size < 0.0 else 'earlier'
        return f'the poses come {time_in_words(abs(size))} {side} {since}: compare the clocks'
    if jump.key != 'joint_offset':
        far = f'{length_in_words(jump.position)}, {angle_in_words(jump.angle)}'
        return (
            f'the {jump.key} has moved against the second source, by {far} (rms) {since}: '
            f'look at its mounting and at that of the second source'
        )
    units = dict(zip(robot.joint_names, robot.units))
    shown = [_in_words(name, size, units[name], '+') for name, size in zip(jump.names, jump.sizes)]
    text = f'the zero of joint {" or ".join(shown)} has moved {since}'
    if len(shown) > 1:
        text += '; these poses do not decide which'
    for name, end in ((robot.joint_names[0], 'base'), (robot.joint_names[-1], 'tool')):
        if name in jump.names:
            text += f'; the {end} turned about the axis of {name} would look the same'
    return f'{text}: its positions need that much; look for a slip, and set the zero again'
