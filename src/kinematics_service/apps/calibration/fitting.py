# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Fit the parameters of an arm to measured poses, with normal priors, and estimate the covariance.

Gauss-Newton steps find the maximum a posteriori estimate. In the first phase, a measured pose has
a smaller weight if its residual is large compared with the median residual (Huber 1964). In the
second phase, a pose is left out if a chi-square test rejects it.

The noise is estimated from the residuals. The estimate has f degrees of freedom: the count of
measured numbers minus the number of parameters that the measured numbers determine (MacKay 1992).
Because the noise is only estimated, the chi-square test and the standard deviations are adapted to
Student's distribution with f degrees of freedom. If the given noise of the instrument is larger
than the estimate, the given noise is used. A given noise is known, so f is infinite, and Student's
distribution becomes the normal distribution.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple, TypeAlias

import numpy as np

from ...kernel import Floats, Integers
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, pose_change, poses_of
from ...kinematics.uncertainty.triangle import triangle_of
from ...rigid_motion import inverses, rotation_vector
from ...robot.file.parts.parameters import ArmParameter
from ..recordings.readers.block import Flags
from .checking import Measured

# Least noise of measured poses (m and rad). A smaller estimate is round-off and is replaced by
# this value.
NOISE_FLOOR = 1e-10
# If the estimate of the noise has fewer degrees of freedom f than this, the noise is at least
# USUAL_NOISE. The relative standard deviation of such an estimate, 1 / sqrt(2 f), is above an
# eighth.
NOISE_FREEDOM = 30.0
# Usual noise of encoders and trackers: the standard deviation of each coordinate of a position (m)
# and of each coordinate of a rotation vector (rad).
USUAL_NOISE = 2e-5
# In Huber's estimate, poses with a residual beyond this quantile of the noise (chi-square
# distribution) have smaller weights.
HUBER_QUANTILE = 0.95
# Significance level of the chi-square test that declares a measured pose an outlier.
OUTLIER_CHANCE = 3e-6
# Largest number of Gauss-Newton steps in each phase of the fit (Huber's estimate, then least
# squares without outliers).
MAX_ROUNDS = 25
# A phase of the fit ends if two numbers are below this value. They are the length of the step, in
# standard deviations of the parameters, and the relative change of the noise.
STEP_TOLERANCE = 1e-3
# Lower bound of the degrees of freedom f in Student's distribution. Because of this bound, the
# variance f / (f - 2) stays finite; it would be infinite at f = 2.
LEAST_STUDENT_FREEDOM = 3.0
# Lower bound of the degrees of freedom of the noise: the count of measured numbers minus the
# number of parameters that these numbers determine. If the degrees of freedom are at this bound,
# the measured numbers are too few to estimate the noise.
UNKNOWN_NOISE_FREEDOM = 1.0
# Standard deviation (m) with which the distance between two touched points is known.
DISTANCE_DEVIATION = 1e-5
# Step (rad, m) of central differences by joint positions. The step is the cube root of the machine
# epsilon, because this step has the least error (Nocedal and Wright, section 8.1).
STEP = float(np.cbrt(np.finfo(np.float64).eps))


# A chain with the measured poses that it predicts: flags of these poses, the chain, the values of
# all corrections of the chain, and the joint positions at these poses.
_ChainRows: TypeAlias = tuple[Flags, CorrectedChain, Floats, Floats]


class KnownDistance(NamedTuple):
    """
    A known distance (m) between two touched points A and B.

    Each point has three corrections x y z. In the list of all corrections, those of A begin at the
    index `first`, and those of B at the index `second`. `between` (3,) is the vector from A to B
    before the points are corrected, m.
    """

    first: int
    second: int
    between: Floats
    distance: float


@dataclass(frozen=True, eq=False)
class FitProblem:
    """
    Measured poses, and the parameters to be fitted to them.

    Attributes
    ----------
    parameters, prior : P
        The fitted parameters, and their prior standard deviations, rad or m.
    columns : shape (P,)
        Index of each fitted parameter in the list of all parameters, fitted or not.
    count
        Number of all parameters, fitted or not. A chain computes poses from joint positions and an
        array (count,) with one correction for each parameter.
    chains
        Kinematic chains from the frame in which the poses were measured to the tool.
    given
        The measured poses with their joint positions. `sets` has the index of the chain for each
        pose. `rates` has the derivatives of the joint positions by those fitted parameters that
        correct joint positions, for example a lag. These parameters come last in
        `parameters`.
    known_distances
        Known distances between touched points.
    """

    parameters: tuple[ArmParameter, ...]
    prior: Floats
    columns: Integers
    count: int
    chains: tuple[CorrectedChain, ...]
    given: Measured
    known_distances: tuple[KnownDistance, ...] = ()

    @property
    def kinds(self) -> int:
        """
        Return the number of kinds of residuals: 2 if positions and rotations were measured, 1 if
        only positions were measured.
        """
        return 1 if self.given.positions else 2

    def every(self, values: Floats) -> Floats:
        """
        Return all `count` corrections of the chains, from the P fitted ones; the corrections that
        are not fitted are zero.
        """
        corrections = np.zeros(self.count)
        corrections[self.columns] = values
        return corrections

    def _by_chain(self, values: Floats) -> Iterator[_ChainRows]:
        driving = values[len(values) - self.given.rates.shape[2] :]
        for k, chain in enumerate(self.chains):
            rows = self.given.sets == k
            q = self.given.q[rows] + self.given.rates[rows] @ driving
            yield rows, chain, self.every(values), q

    def predicted(self, values: Floats) -> Floats:
        """
        Return the tool poses (N, 4, 4) that the chains predict at the joint positions of the N
        measured poses. `values` (P,) has the corrections of the fitted parameters.
        """
        poses = np.empty_like(self.given.poses)
        for rows, chain, corrections, q in self._by_chain(values):
            poses[rows] = poses_of(chain, corrections, q)
        return poses

    def remainders(self, values: Floats) -> Floats:
        """
        Return the residuals of all measured poses, shape (N, 2, 3): position (m) and rotation
        (rad).
        """
        return self._between(self.predicted(values))

    def weighed(self, values: Floats) -> Floats:
        """
        Return the residuals (N, 2, 3) of all measured poses, whitened so that all poses have equal
        noise.
        """
        return self.whitened(self.remainders(values))

    def whitened(self, rows: Floats) -> Floats:
        """
        Return residuals or their derivatives, (N, 2, 3, ...), multiplied by the whitening
        matrices.
        """
        if self.given.whitening is not None:
            six = np.array(rows).reshape(len(rows), 6, *rows.shape[3:])
            part = six[:, : self.given.whitening.shape[1]]
            part[:] = np.einsum('nij,nj...->ni...', self.given.whitening, part)
            rows = six.reshape(rows.shape)
        return rows

    def _between(self, poses: Floats) -> Floats:
        measured = self.given.poses
        if self.given.from_tool:
            measured, poses = inverses(measured), inverses(poses)
        return remainders_between(measured, poses, self.given.positions)

    def equations(self, values: Floats) -> tuple[Floats, Floats]:
        """
        Return the whitened residuals (N, 2, 3), and the whitened Jacobian (N, 2, 3, P) of the
        predicted poses by the parameters.
        """
        poses = np.empty_like(self.given.poses)
        jacobian = np.empty((len(self.given.q), 6, len(self.columns)))
        driving = self.given.rates.shape[2]
        for rows, chain, corrections, q in self._by_chain(values):
            change = pose_change(chain, corrections, q)
            poses[rows], jacobian[rows] = change.pose, change.jacobian[:, :, self.columns]
            if driving:
                by_joints = _moved_by_joints(chain, corrections, q)
                jacobian[rows, :, -driving:] = by_joints @ self.given.rates[rows]
        return self.whitened(self._between(poses)), self._as_weighed(poses, jacobian)

    def moves_with_joints(self, values: Floats) -> Floats:
        """
        Return the whitened derivatives (N, 2, 3, n) of the predicted poses by each joint position.
        """
        jacobian = np.empty((len(self.given.q), 6, self.given.q.shape[1]))
        for rows, chain, corrections, q in self._by_chain(values):
            jacobian[rows] = _moved_by_joints(chain, corrections, q)
        return self._as_weighed(self.predicted(values), jacobian)

    def _as_weighed(self, poses: Floats, jacobian: Floats) -> Floats:
        if self.given.from_tool:
            jacobian = of_inverses(poses, jacobian)
        return self.whitened(jacobian.reshape(len(poses), 2, 3, -1))

    def distance_equations(self, values: Floats) -> tuple[Floats, Floats]:
        """
        Return the derivatives (D, P) of the D known distances by the parameters, and their
        residuals (D,), both divided by the standard deviation of a known distance.
        """
        corrections, count = self.every(values), len(self.known_distances)
        rows, remainders = np.zeros((count, self.count)), np.zeros(count)
        for k, known in enumerate(self.known_distances):
            first, second = (slice(at, at + 3) for at in (known.first, known.second))
            between = known.between + corrections[second] - corrections[first]
            length = float(np.linalg.norm(between))
            rows[k, second], rows[k, first] = between / length, -between / length
            remainders[k] = known.distance - length
        return rows[:, self.columns] / DISTANCE_DEVIATION, remainders / DISTANCE_DEVIATION

    def only(self, groups: tuple[str, ...]) -> 'FitProblem':
        """
        Return the problem that fits only the parameters in `groups`.

        `groups` must not have parameters that correct joint positions, such as a lag.
        """
        kept = [k for k, parameter in enumerate(self.parameters) if parameter.group in groups]
        return replace(
            self,
            given=self.given._replace(rates=self.given.rates[:, :, :0]),
            parameters=tuple(self.parameters[k] for k in kept),
            prior=self.prior[kept],
            columns=self.columns[kept],
        )


def _moved_by_joints(chain: CorrectedChain, corrections: Floats, q: Floats) -> Floats:
    # Return the derivatives of the poses of a chain by the joint positions, (rows, 6, n), by
    # central differences.
    n = q.shape[1]
    at = np.concatenate([q + sign * STEP * unit for sign in (1.0, -1.0) for unit in np.eye(n)])
    later, sooner = poses_of(chain, corrections, at).reshape(2, n, -1, 4, 4)
    R = later[..., :3, :3] @ np.swapaxes(sooner[..., :3, :3], -1, -2)
    moved = np.concatenate([(later - sooner)[..., :3, 3], rotation_vector(R)], axis=-1)
    return np.asarray(np.moveaxis(moved / (2.0 * STEP), 0, -1))


def of_inverses(poses: Floats, jacobian: Floats) -> Floats:
    """
    Return the Jacobian (N, 6, P) of the inverses of poses, from the poses (N, 4, 4) and their
    Jacobian.
    """
    # If T = (R, p) moves by v (linear) and w (angular), T^-1 moves by -R^T (v - w x p) and -R^T w.
    linear, angular = jacobian[:, :3], jacobian[:, 3:]
    turned = np.cross(angular, poses[:, :3, 3, None], axisb=1, axisa=1, axisc=1)
    R = np.swapaxes(poses[:, :3, :3], 1, 2)
    return np.concatenate([-R @ (linear - turned), -R @ angular], axis=1)


def remainders_between(measured: Floats, poses: Floats, positions: bool) -> Floats:
    """
    Return the residuals (N, 2, 3) of position (m) and rotation (rad) from computed to measured
    poses, (N, 4, 4) each; rotations are zero if `positions` is set.
    """
    position = measured[:, :3, 3] - poses[:, :3, 3]
    rotation = np.zeros_like(position)
    if not positions:
        rotation = rotation_vector(measured[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2))
    return np.stack([position, rotation], axis=1)


class Noise(NamedTuple):
    """
    Standard deviations of the noise: of each coordinate of a measured position (m), and of each
    coordinate of a measured rotation vector (rad).
    """

    position: float
    rotation: float


@dataclass(frozen=True, eq=False)
class Identified:
    """
    The result of a fit: corrections with their covariance, the noise and the outliers.

    Attributes
    ----------
    values : shape (P,), rad or m
        Corrections of the parameters.
    noise
        Standard deviations of the noise of the poses.
    used : shape (N,)
        Flags of the measured poses that are not outliers.
    distances : shape (N,)
        Length of each pose's residual in standard deviations of the noise.
    freedom
        Degrees of freedom of the noise, for positions and for rotations: the count of measured
        numbers minus the number of parameters that the measured numbers determine. Infinite if
        `noise` is the given noise of the instrument, which is not estimated.
    covariance : shape (P, P), rad and m
        Covariance of `values` after the fit; it includes the priors. If the noise is estimated,
        the covariance is computed with a larger noise (see `widened`), because the estimate may be
        too small.
    """

    values: Floats
    noise: Noise
    used: Flags
    distances: Floats
    freedom: Noise
    covariance: Floats


class _Step(NamedTuple):
    # A Gauss-Newton step and the linear equations that the step solves. The step is divided by the
    # prior standard deviations. `rows` is the Jacobian of the equations, `right` their right-hand
    # side, and `triangle` the QR factor R of `rows`.
    step: Floats
    triangle: Floats
    rows: Floats
    right: Floats


@dataclass(frozen=True, eq=False)
class _Equations:
    # The linear least-squares equations of one Gauss-Newton step, scaled by standard deviations.
    # Each measured pose has a weight, or a flag that is True if the pose is used.
    problem: FitProblem
    noise: Noise
    weights: Floats | Flags

    @property
    def scale(self) -> Floats:
        # Return the factors by which residuals are multiplied: sqrt(weight) / noise. The shape is
        # (N, 1, 1) for positions, (N, 2, 1) for poses.
        noise = np.asarray(self.noise, dtype=np.float64)[: self.problem.kinds]
        return np.asarray(np.sqrt(self.weights, dtype=np.float64)[:, None, None] / noise[:, None])

    def right(self, values: Floats, remainders: Floats) -> Floats:
        # Return the right-hand side: scaled residuals of the measured poses, of the known
        # distances and of the priors, in this order.
        problem = self.problem
        rows = (remainders[:, : problem.kinds] * self.scale).reshape(-1)
        distances = problem.distance_equations(values)[1]
        return np.concatenate([rows, distances, -values / problem.prior])

    def solved(self, values: Floats) -> _Step:
        # Stack three blocks of derivatives by the parameters: the derivatives of the poses, of the
        # known distances, and of the parameters themselves (for the priors). Each parameter is in
        # units of its prior standard deviation, so the last block is the identity.
        problem, count = self.problem, len(values)
        remainders, J = problem.equations(values)
        moves = J[:, : problem.kinds] * self.scale[:, :, :, None] * problem.prior
        known = problem.distance_equations(values)[0] * problem.prior
        rows = np.concatenate([moves.reshape(-1, count), known, np.eye(count)])
        right = self.right(values, remainders)
        triangle = triangle_of(np.column_stack([rows, right]))
        R = triangle[:count, :count]
        step = np.linalg.solve(R, triangle[:count, count])
        return _Step(np.asarray(step, dtype=np.float64), R, rows, right)

    def squares(self, values: Floats, remainders: Floats) -> float:
        return float(np.sum(self.right(values, remainders) ** 2))


def robust_values(problem: FitProblem, noise: Noise, progress: Callable[[int], None]) -> Floats:
    """Return the corrections (P,) by Huber's estimate; arguments are as in `find_values`."""
    values = np.zeros(len(problem.parameters))
    remainders = problem.weighed(values)
    for k in range(MAX_ROUNDS):
        progress(k)
        estimate = _robust_noise(noise, remainders)
        weights = huber_weights(distances_of(problem, remainders, estimate), problem.kinds)
        step, remainders = _stepped(_Equations(problem, estimate, weights), values, remainders)
        values = values + step
        if np.all(np.abs(step) < STEP_TOLERANCE * problem.prior):
            break
    return values


def find_values(
    problem: FitProblem,
    noise: Noise | None = None,
    progress: Callable[[int], None] = lambda round_: None,
) -> Identified:
    """
    Fit the parameters of a problem: return the corrections with their covariance, the noise and
    the outliers.

    Parameters
    ----------
    noise
        The noise of the instrument: a lower bound of the estimated noise.
    progress
        Called with the number of each Gauss-Newton round.
    """
    noise, limit = noise or Noise(0.0, 0.0), outlier_limit(problem.kinds)
    values = robust_values(problem, noise, progress)
    remainders = problem.weighed(values)
    estimate = _robust_noise(noise, remainders)
    used = distances_of(problem, remainders, estimate) < limit
    for k in range(MAX_ROUNDS):
        progress(MAX_ROUNDS + k)
        solved = _Equations(problem, estimate, used).solved(values)
        values = values + problem.prior * solved.step
        inverse = np.asarray(np.linalg.inv(solved.triangle), dtype=np.float64)
        remainders = problem.weighed(values)
        before = estimate
        evident, freedom = _evident_noise(problem, remainders, solved.rows, inverse, used)
        estimate = Noise(*map(max, zip(noise, evident)))
        distances = distances_of(problem, remainders, estimate)
        moved = np.max(np.abs(solved.step) / np.linalg.norm(inverse, axis=1), initial=0.0)
        accepted = normal_scores(distances, freedom) < limit
        # A pose near the outlier limit may be left out in one round and used in the next, again
        # and again. So do not change the selection of used poses in the second half of the rounds.
        # Then the rounds converge.
        same = bool(np.array_equal(accepted, used)) or k > MAX_ROUNDS // 2
        used = used if same else accepted
        changed = max(abs(b / a - 1.0) if a else 0.0 for a, b in zip(before, estimate))
        if same and max(moved, changed) < STEP_TOLERANCE:
            break
    freedom = Noise(*(f if s <= e else np.inf for s, e, f in zip(estimate, evident, freedom)))
    wide = _Equations(problem, widened(estimate, freedom), used).solved(values)
    factor = problem.prior[:, None] * np.linalg.inv(wide.triangle)
    return Identified(values, estimate, used, distances, freedom, factor @ factor.T)


def normal_scores(distances: Floats, freedom: Noise) -> Floats:
    """
    Convert the lengths of the poses' residuals to normal scores.

    `distances` has the lengths divided by the noise. The noise is an estimate with f degrees of
    freedom (`freedom`), so a divided length d has a Student distribution. The score of d is
    sqrt(f log(1 + d^2 / f)), which has nearly a normal distribution (Wallace, Bounds on normal
    approximations to Student's distribution, 1959). If the noise is given and not estimated, f is
    infinite, and the score is d.
    """
    f = min(freedom)
    return np.sqrt(f * np.log1p(distances**2 / f)) if np.isfinite(f) else distances


def _robust_noise(least: Noise, remainders: Floats) -> Noise:
    lengths = np.linalg.norm(remainders, axis=2).T
    return Noise(*np.maximum(least, median_noise(lengths)).tolist())


def widened(noise: Noise, freedom: Noise) -> Noise:
    """
    Return the noise multiplied by a factor above 1, because the noise is only estimated.

    The estimate of the noise has f degrees of freedom (`freedom`). So a residual divided by the
    noise has a Student distribution with the variance f / (f - 2). The factor is the square root
    of this variance (Gelman et al., Bayesian Data Analysis, section 3.2). If f is infinite, the
    factor is 1.
    """
    f = np.maximum(freedom, LEAST_STUDENT_FREEDOM)
    return Noise(*(np.array(noise) * np.sqrt(1.0 + 2.0 / (f - 2.0))).tolist())


def refined(problem: FitProblem, values: Floats, noise: Noise, used: Flags) -> Floats:
    """
    Return the corrections fitted to the `used` poses with a given noise; the fit starts from
    `values`.
    """
    for _ in range(MAX_ROUNDS if len(values) else 0):
        solved = _Equations(problem, noise, used).solved(values)
        values = values + problem.prior * solved.step
        # Stop if the step is small compared with the standard deviations after the fit. For exact
        # poses these standard deviations are tiny. So stop also if the step is far below the prior
        # standard deviations.
        moved = np.linalg.norm(solved.triangle @ solved.step)
        if moved < STEP_TOLERANCE or np.all(np.abs(solved.step) < STEP_TOLERANCE**2):
            break
    return values


def held_out_remainders(
    problem: FitProblem, values: Floats, identified: Identified, blocks: Integers
) -> Floats:
    """
    Return the residuals (N, 2, 3) of a cross-validation.

    The poses are divided into blocks. The poses of each block are predicted with corrections that
    are fitted to all other blocks. All poses with equal joint positions must be in one block.
    Otherwise the residuals would not test the corrections, because a fitted pose predicts other
    poses with equal joint positions. Noise and outliers are taken from the fit of all poses. Each
    fit starts from `values`.

    Parameters
    ----------
    values : shape (P,)
        Initial corrections.
    identified
        The fit of all poses, which gives the noise and the outliers.
    blocks : shape (N,)
        The number of the block of each pose.
    """
    result = np.zeros((len(problem.given.q), 2, 3))
    for k in np.unique(blocks):
        block = blocks == k
        without = refined(problem, values, identified.noise, identified.used & ~block)
        result[block] = problem.remainders(without)[block]
    return result


def weighted_jacobian(problem: FitProblem, values: Floats, noise: Noise, used: Flags) -> Floats:
    """
    Return the QR factor R (P, P) of the scaled Jacobian of the poses by the parameters.

    Row i of the scaled Jacobian J is divided by the noise of the measured number, and column k is
    multiplied by the prior standard deviation of parameter k. R replaces J in normal equations,
    because R^T R = J^T J.
    """
    rows = _Equations(problem, noise, used).solved(values).rows
    return triangle_of(rows[: len(rows) - len(values)])


def one_more(
    problem: FitProblem, identified: Identified, moves: Floats
) -> tuple[list[float], list[float]]:
    """
    Return the estimates and the standard deviations of K further corrections. For each estimate,
    one of the K corrections is added to the fit, and the other K - 1 stay zero.

    Each further correction is an added variable of the regression (Cook and Weisberg, Residuals
    and Influence in Regression, 1982, section 2.3.2) and has no prior.

    Parameters
    ----------
    moves : shape (N, 2, 3, K)
        Derivatives of the predicted poses by each further correction, multiplied by the whitening
        matrices (`FitProblem.whitened`).
    """
    equations = _Equations(problem, identified.noise, identified.used)
    solved = equations.solved(identified.values)
    columns = np.zeros((len(solved.rows), moves.shape[3]))
    scaled = moves[:, : problem.kinds] * equations.scale[..., None]
    columns[: scaled[..., 0].size] = scaled.reshape(-1, moves.shape[3])
    triangle = triangle_of(np.column_stack([solved.rows, columns, solved.right]))
    at = len(identified.values)
    # `left` has the K columns of further corrections, and `right` the residuals. The QR
    # factorization has removed all components along the columns of the fitted parameters.
    left, right = triangle[at:, at:-1], triangle[at:, -1]
    squares = np.maximum(np.sum(left**2, axis=0), np.finfo(np.float64).tiny)
    return (right @ left / squares).tolist(), (1.0 / np.sqrt(squares)).tolist()


def _stepped(equations: _Equations, values: Floats, remainders: Floats) -> tuple[Floats, Floats]:
    # Halve the Gauss-Newton step until the sum of squared residuals does not grow. Return the
    # step, and the residuals after it. `remainders` are the residuals before the step.
    step = equations.problem.prior * equations.solved(values).step
    before = equations.squares(values, remainders)
    for _ in range(MAX_ROUNDS):
        after = equations.problem.weighed(values + step)
        if equations.squares(values + step, after) <= before:
            return step, after
        step = 0.5 * step
    return np.asarray(step), equations.problem.weighed(values + step)


def length_quantile(probability: float, kinds: int) -> float:
    """
    Return the length that a vector of `3 * kinds` standard normal numbers exceeds with probability
    1 - `probability` (Wilson and Hilferty 1931).
    """
    spread = 2 / (9 * 3 * kinds)
    cube = 1.0 - spread + NormalDist().inv_cdf(probability) * float(np.sqrt(spread))
    return float(np.sqrt(3 * kinds * cube**3))


def outlier_limit(kinds: int) -> float:
    """
    Return the length of a whitened residual, in standard deviations of the noise, beyond which a
    pose is an outlier.
    """
    return length_quantile(1.0 - OUTLIER_CHANCE, kinds)


def distances_of(problem: FitProblem, remainders: Floats, noise: Noise) -> Floats:
    """
    Return the lengths (N,) of the residuals of N poses, in standard deviations of the noise.

    `remainders` (N, 2, 3) has the whitened residuals of position and rotation. A length is the
    norm of all six numbers of a pose, each divided by its noise. If only positions were measured,
    the length is the norm of the three position numbers.
    """
    deviations = np.asarray(noise, dtype=np.float64)[: problem.kinds]
    squares = np.sum(remainders**2, axis=2)[:, : problem.kinds] / deviations**2
    return np.asarray(np.sqrt(np.sum(squares, axis=1)))


def huber_weights(distances: Floats, kinds: int) -> Floats:
    """
    Return Huber's weights (..., N) of N poses. `distances` (..., N) has the length of each pose's
    residual, in standard deviations of the noise.
    """
    huber = length_quantile(HUBER_QUANTILE, kinds)
    return np.asarray(huber / np.maximum(distances, huber))


def median_noise(lengths: Floats) -> Floats:
    """
    Return the standard deviation (...,) of one coordinate of random 3-vectors, estimated from the
    median of the vectors' lengths (..., N).
    """
    return np.asarray(
        np.maximum(np.median(lengths, axis=-1) / length_quantile(0.5, 1), NOISE_FLOOR)
    )


def _evident_noise(
    problem: FitProblem, remainders: Floats, rows: Floats, inverse: Floats, used: Flags
) -> tuple[Noise, Noise]:
    # Estimate the noise from the residuals of the used poses, and return it with its degrees of
    # freedom. The degrees of freedom are the count of measured numbers minus the number of
    # parameters that these numbers determine. The squared noise is the sum of squared residuals
    # divided by the degrees of freedom.
    kinds, count = problem.kinds, len(problem.given.q)
    basis = rows[: 3 * kinds * count] @ inverse
    leverage = np.sum(basis.reshape(count, kinds, -1) ** 2, axis=(0, 2))
    free = 3 * np.sum(used) - leverage
    squares = np.sum(remainders[used, :kinds] ** 2, axis=(0, 2))
    least = np.where(free < NOISE_FREEDOM, USUAL_NOISE, NOISE_FLOOR)
    noise = np.maximum(np.sqrt(squares / np.maximum(free, 1.0)), least).tolist()
    freedom = np.maximum(free, UNKNOWN_NOISE_FREEDOM).tolist()
    return Noise(noise[0], noise[-1]), Noise(freedom[0], freedom[-1])
