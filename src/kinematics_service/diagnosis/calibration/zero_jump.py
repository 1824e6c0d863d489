"""
Detect a jump of a joint zero by the windowed generalized likelihood ratio test.

Willsky and Jones 1976; Basseville and Nikiforov 1993, chapter 7; Lai 1995. The residual of pose k
is e = H x + A delta + noise: x are base, tool, lag and the errors of the table, which have priors;
delta is what jumps, from a pose of the window on. The gain of a jump is twice the increase of the
log likelihood, with x and the scale of the noise maximized. A wrong table is part of x, so a new
working region raises no alarm.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...formats.recordings.block import Flags
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.arm_errors import TableErrors, table_errors_of
from ...kinematics.uncertainty.parameters import parameters_of
from ...robot.file.parts.description import Uncertainty
from ...robot.robot import Robot
from ..frame_check.errors import angle_in_words, length_in_words, time_in_words
from ..frame_check.offsets import equations_of, fit_at, fit_offsets, moved_offsets
from .collecting import CollectedPoses

# Quantiles of chi-square with 1 and 6 degrees of freedom at 1e-10: with some 100 tests a pose, a
# healthy arm raises one false alarm in 1e8 poses.
THRESHOLDS = {1: 41.8, 6: 58.4}
# The baseline is frozen if a gain is nearer to its threshold than half of the smaller threshold.
SUSPICION = 0.5
# Poses of the window: a slip must be detected within 100 poses of a camera.
WINDOW = 128
# Ages (poses) at which a jump may have begun: a factor of 1.4 loses at most 1/6 of the gain.
AGES = {6, 8, 11, 16, 24, 35, 50, 70, 95, WINDOW}
# A second source may fail for this number of poses without an alarm.
UNPROVEN = 5
# Largest number of poses added before a test; no pose enters the baseline untested.
BATCH = 16
# Smallest standard deviations of one number of a pose, m and rad: those of a tracker.
LEAST_NOISE = 1e-4, np.radians(0.02)
# Prior standard deviation (m and rad) of the offsets about their fit: hardly any knowledge.
OFFSET = 0.3
# Prior standard deviation (s) of the lag: two periods of joint states at 200 Hz.
LAG = 0.01
# Largest weight (poses) of the baseline: old poses fade, so an arm that warms up is followed.
MEMORY = 2000.0
# Linearize the offsets anew after a step of this size (m, rad): its square is negligible.
STEP = 2e-3
# A pose fits with a jump that explains 95 % of its square, as a turn by 20 degrees does.
UNEXPLAINED = 0.05
# Share of the poses since a jump that must fit with it: an age may be 1.4 times too long.
FITTING = 0.6
# The median of chi-square with 6 degrees of freedom.
MEDIAN = 5.35
# Joints that moved less (rad, prismatic joints by length) are never named.
MOVED = 0.02
# An eigenvalue of an information below 1e-9 of the largest is round-off.
ROUND_OFF = 1e-9
# A correlation of successive poses counts beyond three standard deviations.
CORRELATION_DEVIATIONS = 3.0
# Largest correlation (AR(1)) of successive poses: the noise counts as 6 times larger at most.
CORRELATION_LIMIT = 0.95
# Twice the logarithm of 100: a candidate that is less likely by more is not named.
RIVAL = 9.2
# Quantile of the normal distribution: nine of ten jumps are detected that exceed the threshold by
# 1.28 standard deviations.
NINE_OF_TEN = 1.28
# Number of the newest poses that are given to a diagnosis.
NEWEST = 64
# A source fails if more poses of the window are outliers: an eighth.
FAILING = 16
# Number of poses that the smallest jump is given for.
FORECAST = 50
# Largest number of linearizations of the offsets in a row.
ROUNDS = 8
# Number of poses that are kept to linearize the baseline anew: few poses leave the offsets loose.
RELEARNED = 256

BASE, TOOL, LAGS = slice(0, 6), slice(6, 12), slice(12, 13)
BOUNDS = np.minimum, np.maximum
# Positions are in m.
ONE = np.ones((1, 1, 1))


@dataclass(frozen=True)
class ZeroJump:
    """
    A jump that was detected.

    Attributes
    ----------
    key
        joint_offset, base, tool or time_lag.
    names
        The joints that may have jumped, the likeliest first, or `base`, `tool` or `lag`.
    sizes
        The jump of each, rad, m or s; the rotation (rad) of base and tool.
    position, angle
        How far the poses have jumped (rms), m and rad.
    stamp, count
        The stamp (ns) of the first pose after the jump; the number of poses since.
    sentence
        The whole in words.
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
    The result of all tests so far.

    Attributes
    ----------
    jump
        The jump that was detected, or None.
    tested
        Number of poses so far.
    outliers
        Number of poses of the window that fit neither the baseline nor a jump.
    recent
        The newest poses, since the jump if there is one, without outliers if these are few.
    noise
        Standard deviations of one number of a position (m) and of a rotation vector (rad).
    smallest
        Each joint with the smallest jump that is found in nine of ten cases, and its unit.
    """

    jump: ZeroJump | None
    tested: int
    outliers: int
    recent: CollectedPoses
    noise: tuple[float, float]
    smallest: tuple[tuple[str, float, str], ...]

    @property
    def fails(self) -> bool:
        """Return whether more poses than a few are outliers."""
        return self.outliers > FAILING

    def sentence(self) -> str:
        """Return that nothing has jumped, and how large a jump is found."""
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
        least, most = (bound(self.smallest, key=lambda one: one[1]) for bound in (min, max))
        return (
            f'{text}; {FORECAST} such poses would show {_in_words(*least)} to {_in_words(*most)}'
        )

    def values(self) -> list[tuple[str, str]]:
        """Return keys and values."""
        jump = self.jump
        return [
            ('poses tested', str(self.tested)),
            ('outliers', str(self.outliers)),
            ('noise, position (m)', f'{self.noise[0]:.3g}'),
            ('noise, rotation (rad)', f'{self.noise[1]:.3g}'),
            ('smallest jumps found', ', '.join(_in_words(*one) for one in self.smallest)),
            ('jump', ', '.join(jump.names) if jump else ''),
            ('jump (rad, m or s)', ', '.join(f'{x:.6g}' for x in jump.sizes) if jump else ''),
            ('jump, poses ago', str(jump.count) if jump else ''),
        ]


class _JumpCandidate(NamedTuple):
    # A parameter that may jump: its columns, gain and size, and the age (an index of `ages`).
    columns: slice
    excess: float
    gain: float
    size: Floats
    at: int


class _JumpEvidence(NamedTuple):
    # One test: ages of jumps, rows (6 N, M) and what remains (6 N,) in units of the noise, the
    # covariance of x, and per age the sums of the rows' products since.
    ages: tuple[int, ...]
    rows: Floats
    left: Floats
    covariance: Floats
    sums: Floats
    misfit: float
    freedom: float


class _Baseline:
    # Sums over healthy poses, of positions and of rotations; x in units of its prior.
    def __init__(self, size: int, floor: Floats) -> None:
        self.gram, self.right = np.zeros((2, size, size)), np.zeros((2, size))
        self.squares, self.count = np.zeros(2), 0.0
        self.noise = self.floor = floor
        self.pairs, self.last = np.zeros(2), np.zeros((0, 6))

    def admit(self, e: Floats, H: Floats) -> None:
        fade = min(1.0, max(MEMORY - len(e), 0.0) / max(self.count, 1.0))
        J, r = H.reshape(len(e), 2, 3, -1), e.reshape(len(e), 2, 3)
        self.gram = fade * self.gram + np.einsum('nkim,nkil->kml', J, J, optimize=True)
        self.right = fade * self.right + np.einsum('nkim,nki->km', J, r)
        self.squares = fade * self.squares + np.sum(r**2, axis=(0, 2))
        self.count = fade * self.count + len(e)
        self.settle()
        # Successive poses share errors that are none of x: an elastic arm, a distorted image.
        left = np.concatenate([self.last, (e - H @ self.mean) / np.repeat(self.noise, 3)])
        pairs = np.sum(left[1:] * left[:-1]), 0.5 * np.sum(left[1:] ** 2 + left[:-1] ** 2)
        self.pairs, self.last = fade * self.pairs + pairs, left[-1:]

    def settle(self) -> None:
        # The noise follows from the remainder and from how many numbers of x the poses determine
        # (MacKay 1992).
        for _ in range(3):
            weights = self.noise**-2
            self.information = np.tensordot(weights, self.gram, 1) + np.eye(self.gram.shape[1])
            self.covariance = np.asarray(np.linalg.inv(self.information), dtype=np.float64)
            self.mean = self.covariance @ (weights @ self.right)
            told = weights * np.einsum('ij,kji->k', self.covariance, self.gram)
            self.freedom = np.maximum(3.0 * self.count - told, 1.0)
            left = self.squares + (self.gram @ self.mean - 2.0 * self.right) @ self.mean
            noise = np.sqrt(np.maximum(left, 0.0) / self.freedom * self._longer())
            self.noise = np.maximum(noise, self.floor)

    def _longer(self) -> float:
        # How many times more poses of correlated errors (AR(1)) tell as much as independent ones.
        sure = CORRELATION_DEVIATIONS / math.sqrt(6.0 * max(self.count, 1.0))
        share = float(self.pairs[0]) / max(float(self.pairs[1]), ROUND_OFF) - sure
        share = min(max(share, 0.0), CORRELATION_LIMIT)
        return (1.0 + share) / (1.0 - share)

    def shift(self, by: Floats) -> None:
        # Count x from another point.
        moved = self.gram @ by
        self.squares = self.squares + (moved - 2.0 * self.right) @ by
        self.right = self.right - moved
        self.settle()


class JumpDetector:
    """
    Tests each new pose of a second source for a jump since a baseline of healthy poses.

    Parameters
    ----------
    robot
        The arm, without closed loops.
    first
        Poses with which the baseline begins; outliers among them are left out.
    """

    def __init__(self, robot: Robot, first: CollectedPoses) -> None:
        self._jump: ZeroJump | None = None
        self._count = 0
        self._robot, self._table = robot, _table_of(robot)
        self._scales = robot.task.column_scales
        self._begun = 0  # number of the first pose after the jump
        self._calm = True
        self._evidence: _JumpEvidence | None = None
        many = LAGS.stop + robot.dof
        causes = range(many, many + self._table.factor.shape[1])
        self._jumping, self._unknown = slice(0, many), np.array([*range(LAGS.stop), *causes])
        said = robot.description.uncertainty
        floor = (said.floor_xyz, said.floor_rpy) if said else (0.0, 0.0)
        self._floor = np.maximum(floor, LEAST_NOISE)
        self._spans = np.min(first.q, axis=0), np.max(first.q, axis=0)
        self._window, self._used = first, np.ones(len(first.q), dtype=bool)
        self._begin()

    def _begin(self) -> None:
        # The offsets and the baseline, again and again without the worst outlier.
        while True:
            used = self._window.at(self._used)
            A = evaluate(self._robot, used.q).pose
            fit = fit_offsets(A[None], used.poses[None]).one(0)
            self._X, self._Y, self._learned = fit.X, fit.Y, used
            self._learn_again()
            self._recentre()
            weights = np.repeat(1.0 / self._baseline.noise, 3)
            rows = self._linearized(self._window) * weights[:, None]
            H = rows[:, :, 1:][:, :, self._unknown]
            r = rows[:, :, 0] - H @ self._baseline.mean
            gains = _outlier_gains(H, r, self._baseline.covariance) * self._used
            # The noise is that of the worst, too: compare with the median.
            worst = float(np.max(gains))
            if worst <= THRESHOLDS[6] / MEDIAN * float(np.median(gains[self._used])):
                break
            self._used &= gains < worst
        self._window, self._used = self._window.at(slice(0, 0)), np.zeros(0, dtype=bool)
        self._rows = rows[:0]

    def _learn(self, rows: Floats) -> None:
        self._baseline.admit(rows[:, :, 0], rows[:, :, 1:][:, :, self._unknown])

    def _learn_again(self) -> None:
        self._baseline = _Baseline(len(self._unknown), self._floor)
        self._learn(self._linearized(self._learned))

    def _admit(self, chosen: Flags) -> None:
        self._learn(self._rows[chosen])
        if self._baseline.count <= RELEARNED:
            self._learned = self._learned.followed_by(self._window.at(chosen))
        if self._recentre():
            self._rows = self._linearized(self._window)

    def _recentre(self) -> bool:
        # Take the offsets where the baseline has them: exactly while its poses are kept.
        for k in range(ROUNDS):
            step = OFFSET * self._baseline.mean[: TOOL.stop]
            if np.max(np.abs(step)) < STEP:
                return k > 0
            offsets = moved_offsets(self._X[None], self._Y[None], step[None], ONE)
            self._X, self._Y = (one[0] for one in offsets)
            if self._baseline.count <= RELEARNED:
                self._learn_again()
            else:
                self._baseline.shift(np.pad(step / OFFSET, (0, len(self._unknown) - TOOL.stop)))
        return True

    def _keep(self, begin: int) -> None:
        # Leave out the poses before this one.
        self._window = self._window.at(slice(begin, None))
        self._rows, self._used = self._rows[begin:], self._used[begin:]

    def _linearized(self, of: CollectedPoses) -> Floats:
        # Return residuals and their derivatives, (N, 6, 1 + M), m and rad.
        state = evaluate(self._robot, of.q, of.rates, depth=kernel.ALL_FRAMES)
        A, count = state.pose, len(of.q)
        fit = fit_at(A[None], of.poses[None], self._X[None], self._Y[None], ONE).one(0)
        ends, left = equations_of(A, fit, ONE)
        table = _table_columns(self._table, state.link_frames, A, of.q)
        lag = LAG * state.twist[:, :, None]
        moves = np.concatenate([lag, state.jacobian, table], axis=2)
        tool = A[:, :3, :3] @ self._Y[:3, 3]
        moves[:, :3] += np.cross(moves[:, 3:], tool[:, :, None], axis=1)
        moves = (self._X[:3, :3] @ moves.reshape(count, 2, 3, -1)).reshape(count, 6, -1)
        e, ends = left.reshape(count, 6, 1), OFFSET * ends.reshape(count, 6, -1)
        return np.concatenate([e, ends, moves], axis=2)

    def observe(self, new: CollectedPoses) -> Watched:
        """Test new poses and return the result of all."""
        for begin in range(0, len(new.q), BATCH):
            part = new.at(slice(begin, begin + BATCH))
            self._spans = tuple(
                bound(self._spans[k], bound.reduce(part.q)) for k, bound in enumerate(BOUNDS)
            )
            self._window = self._window.followed_by(part)
            self._rows = np.concatenate([self._rows, self._linearized(part)])
            self._count += len(part.q)
            self._test()
            over = len(self._used) - WINDOW
            if over > 0:
                old = self._used & (np.arange(len(self._used)) < over)
                if self._calm and np.any(old):
                    self._admit(old)
                self._keep(over)
        return self._watched()

    def _watched(self) -> Watched:
        outliers = len(self._used) - int(np.sum(self._used))
        recent = self._window
        if outliers <= FAILING:
            recent = recent.at(self._used)
        newest = min(self._jump.count, NEWEST) if self._jump else NEWEST
        recent = recent.at(slice(-newest, None))
        noise = float(self._baseline.noise[0]), float(self._baseline.noise[1])
        return Watched(self._jump, self._count, outliers, recent, noise, self._smallest())

    def _test(self) -> None:
        count = len(self._rows)
        self._used = np.ones(count, dtype=bool)
        if count < min(AGES):
            return
        while True:
            evidence = self._evidence_of(self._used)
            candidates = self._candidates(evidence, evidence.sums)
            best = max(candidates, key=lambda one: one.excess)
            proven = self._proven(evidence, best) if best.excess > 0.0 else 0
            H = evidence.rows[:, self._unknown].reshape(count, 6, -1)
            gains = _outlier_gains(H, evidence.left.reshape(count, 6), evidence.covariance)
            scale = max(1.0, float(np.median(gains[self._used])) / MEDIAN)
            worst = float(np.max(gains))
            if proven or worst <= scale * THRESHOLDS[6]:
                break
            # The worst pose may disturb smaller outliers: they are tested again.
            self._used &= gains < 0.5 * worst
        self._evidence = evidence
        self._calm = best.excess < -SUSPICION * THRESHOLDS[1] and self._jump is None
        returned = self._returned(evidence, best) if self._jump else 0
        if returned:
            self._keep(count - returned)
            self._jump = None
            self._test()
        elif proven and self._jump is None:
            self._begun, self._stamp = self._count - proven, self._window.stamps[-proven]
            self._report(evidence, candidates, best)
            self._test()  # with that age
        elif proven:
            self._report(evidence, candidates, best)
        elif best.excess <= 0.0:
            self._jump = None

    def _evidence_of(self, used: Flags) -> _JumpEvidence:
        count, base = len(used), self._baseline
        known = {self._count - self._begun} if self._jump else set()
        ages = tuple(sorted((age for age in known | AGES if age <= count), reverse=True))
        weights = used[:, None] * np.repeat(1.0 / base.noise, 3)
        Z = (self._rows * weights[:, :, None]).reshape(6 * count, -1)
        e, rows = Z[:, 0], Z[:, 1:]
        H = rows[:, self._unknown]
        P = np.asarray(np.linalg.inv(base.information + H.T @ H), dtype=np.float64)
        right = base.information @ base.mean + H.T @ e
        x = P @ right
        left = e - H @ x
        misfit = e @ e + base.mean @ base.information @ base.mean - right @ x
        A = rows[:, self._jumping]
        products = np.concatenate([A, H, left[:, None]], axis=1)
        parts = np.split(np.arange(6 * count), [6 * (count - age) for age in ages])[1:]
        sums = np.cumsum([A[part].T @ products[part] for part in reversed(parts)], axis=0)[::-1]
        told, freedom = float(np.sum(base.freedom)), 6.0 * np.sum(used)
        return _JumpEvidence(
            ages, rows, left, P, sums, told + float(misfit), told + float(freedom)
        )

    def _information(self, evidence: _JumpEvidence, sums: Floats) -> Floats:
        # That of a jump (K, a, a), with x unknown.
        many = self._jumping.stop
        C = sums[:, :, many:-1]
        return np.asarray(sums[:, :, :many] - C @ evidence.covariance @ np.swapaxes(C, 1, 2))

    def _candidates(self, evidence: _JumpEvidence, sums: Floats) -> list[_JumpCandidate]:
        information = self._information(evidence, sums)
        moved = np.ptp(self._spans, axis=0) > MOVED * self._scales
        joints = [slice(LAGS.stop + j, LAGS.stop + j + 1) for j in np.flatnonzero(moved).tolist()]
        found = []
        for own in (BASE, TOOL, LAGS, *joints):
            whole = np.max(np.einsum('kii->ki', sums[:, own, own]), axis=1)
            values, vectors = np.linalg.eigh(information[:, own, own])
            known = values > ROUND_OFF * whole[:, None]
            u = np.einsum('kij,ki->kj', vectors, sums[:, own, -1])
            inverse = np.divide(1.0, values, out=np.zeros_like(values), where=known)
            gains = np.sum(u**2 * inverse, axis=1)
            at = int(np.argmax(gains))
            gain, size = float(gains[at]), vectors[at] @ (inverse[at] * u[at])
            excess = _excess(gain, len(size), evidence)
            found.append(_JumpCandidate(own, excess, gain, size, at))
        return found

    def _proven(self, evidence: _JumpEvidence, best: _JumpCandidate) -> int:
        # Return the age of the first pose that fits with the jump, or 0: it is not proven. The sum
        # of the shares is the gain; each is clipped so that UNPROVEN poses do not suffice.
        begin, own = 6 * (len(self._used) - evidence.ages[best.at]), best.columns
        jumped = evidence.rows[begin:, own] @ best.size
        before = evidence.left[begin:]
        C = evidence.sums[best.at, own, self._jumping.stop : -1]
        x = evidence.covariance @ (C.T @ best.size)
        after = before - jumped + evidence.rows[begin:, self._unknown] @ x
        shares, was, left = (
            np.sum(part.reshape(-1, 6), axis=1) for part in (jumped * before, before**2, after**2)
        )
        scale = _scale(best.gain, evidence)
        fit = left < np.maximum(THRESHOLDS[6], UNEXPLAINED * was)
        least = THRESHOLDS[len(best.size)] * scale
        share = least / (UNPROVEN + 0.5)
        if np.sum(np.clip(shares, -share, share)) < least or np.mean(fit) < FITTING:
            return 0
        return int(len(fit) - np.argmax(fit))

    def _returned(self, evidence: _JumpEvidence, best: _JumpCandidate) -> int:
        # The age of the end of a jump that was only for a while, 0: it lasts.
        for k, age in enumerate(evidence.ages[1:], 1):
            passed = evidence.sums[:k] - evidence.sums[k]
            gain = max(one.gain for one in self._candidates(evidence, passed))
            if gain - best.gain > THRESHOLDS[6] * _scale(gain, evidence):
                return age
        return 0

    def _report(
        self, evidence: _JumpEvidence, candidates: list[_JumpCandidate], best: _JumpCandidate
    ) -> None:
        age = evidence.ages[best.at]
        joints = [one for one in candidates if one.columns.start >= LAGS.stop]
        joints.sort(key=lambda one: -one.gain)
        scale = _scale(best.gain, evidence)
        if best.columns in (BASE, TOOL) and joints:
            # A linear model of a turn by this angle leaves its square, as a share.
            bent = joints[0].gain * float(joints[0].size[0]) ** 2
            fewer = scale * (THRESHOLDS[6] - THRESHOLDS[1])
            best = joints[0] if best.gain - joints[0].gain < bent + fewer else best
        named, key = [best], 'joint_offset'
        if best.columns in (BASE, TOOL):
            key = 'base' if best.columns == BASE else 'tool'
        elif best.columns == LAGS:
            key = 'time_lag'
        else:
            near = best.gain * (1.0 - float(best.size[0]) ** 2) - RIVAL * scale
            named = [one for one in joints if one.gain >= near][:2]
        rows = self._rows[-age:, :, 1:][:, :, best.columns] @ best.size
        position, angle = np.sqrt(np.mean(np.sum(rows.reshape(-1, 2, 3) ** 2, axis=2), axis=0))
        names: tuple[str, ...] = (key,)
        sizes: tuple[float, ...] = (float(angle),)
        if key == 'time_lag':
            sizes = (LAG * float(best.size[0]),)
        elif key == 'joint_offset':
            own = [one.columns.start - LAGS.stop for one in named]
            names = tuple(self._robot.joint_names[j] for j in own)
            sizes = tuple(float(one.size[0]) for one in named)
        since = self._count - self._begun
        jump = ZeroJump(key, names, sizes, float(position), float(angle), self._stamp, since, '')
        self._jump = replace(jump, sentence=_sentence(jump, self._robot))

    def _smallest(self) -> tuple[tuple[str, float, str], ...]:
        if self._evidence is None:
            return ()
        ages = self._evidence.ages
        at = min(range(len(ages)), key=lambda k: abs(ages[k] - FORECAST))
        information = self._information(self._evidence, self._evidence.sums[at : at + 1])[0]
        moved = np.ptp(self._spans, axis=0) > MOVED * self._scales
        found = []
        for j in np.flatnonzero(moved).tolist():
            known = float(information[LAGS.stop + j, LAGS.stop + j])
            if known > 0.0:
                size = (math.sqrt(THRESHOLDS[1]) + NINE_OF_TEN) / math.sqrt(known)
                found.append((self._robot.joint_names[j], size, self._robot.units[j]))
        return tuple(found)


def _table_of(robot: Robot) -> TableErrors:
    # Return the errors that the file gives, or those of a nominal table.
    said = robot.description.uncertainty
    if said is None or not (said.parameters or said.factor):
        usual = tuple((one.name, one.scale) for one in parameters_of(robot).table)
        said = Uncertainty((), (), (), None, usual, (), 0.0, 0.0)
    return table_errors_of(robot, said)


def _table_columns(table: TableErrors, frames: Floats, A: Floats, q: Floats) -> Floats:
    # How the causes of a table's errors move the tool, (N, 6, causes).
    F = frames[:, table.frames]
    linear, angular = (
        np.einsum('npij,pj->npi', F[..., :3, :3], part)
        for part in (table.screws[:, :3], table.screws[:, 3:])
    )
    linear = linear + np.cross(angular, A[:, None, :3, 3] - F[..., :3, 3])
    by_gear = np.where(table.gears >= 0, q[:, table.gears], 1.0)
    moves = np.concatenate([linear, angular], axis=2) * by_gear[:, :, None]
    return np.asarray(np.swapaxes(moves, 1, 2) @ table.factor)


def _outlier_gains(H: Floats, r: Floats, covariance: Floats) -> Floats:
    # The gain if a pose alone is off, (N,).
    V = (1.0 + ROUND_OFF) * np.eye(6) - H @ covariance @ np.swapaxes(H, 1, 2)
    return np.asarray(np.sum(r * np.linalg.solve(V, r[:, :, None])[:, :, 0], axis=1))


def _excess(gain: float, dof: int, evidence: _JumpEvidence) -> float:
    # The likelihood ratio with the scale of the noise unknown, but not below 1, over its quantile;
    # Bartlett's factor makes it chi-square.
    rest = evidence.freedom - dof
    ratio = math.log1p(gain / max(evidence.misfit - gain, rest))
    return (rest + 0.5 * dof - 1.0) * ratio - THRESHOLDS[dof]


def _scale(gain: float, evidence: _JumpEvidence) -> float:
    # Return the variance of the window over that of the baseline, at least 1.
    return max(1.0, (evidence.misfit - gain) / evidence.freedom)


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
