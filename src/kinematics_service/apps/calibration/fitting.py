"""
Fit the numbers of an arm to measured poses, with normal priors, and estimate the deviations.

Gauss-Newton steps of the maximum a posteriori estimate: first with Huber's weights from the
median of the remainders (Huber 1964), then without the rows that a chi-square test rejects. The
noise follows from the remainder and from how many numbers the rows determine (MacKay 1992). The
degrees of freedom f of the noise are the numbers of the rows that no parameter takes up. If f is
small, the test and the deviations are those of Student's distribution; if the noise is that of the
instrument, f is infinite, and they are those of the normal distribution.
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

# Noise (m and rad) below this is round-off.
NOISE_FLOOR = 1e-10
# An estimate of the noise has a relative deviation of 1 / sqrt(2 f). It is above an eighth if f is
# below 30; then the estimate is at least the usual noise.
NOISE_FREEDOM = 30.0
# The noise of encoders and trackers (m and rad).
USUAL_NOISE = 2e-5
# Rows beyond this quantile of chi-square weigh less in the robust start.
HUBER_QUANTILE = 0.95
# Level of the chi-square test of a row: beyond it the row is an outlier.
OUTLIER_CHANCE = 3e-6
# Largest number of rounds of each phase.
MAX_ROUNDS = 25
# The rounds end if step and change of the noise are less, in deviations.
STEP_TOLERANCE = 1e-3
# The variance f / (f - 2) of Student's distribution is infinite at f = 2: a smaller f is taken as
# this one.
LEAST_STUDENT_FREEDOM = 3.0
# With at most 1 degree of freedom the rows do not determine the noise.
UNKNOWN_NOISE_FREEDOM = 1.0
# Standard deviation (m) of a distance between points that is known.
DISTANCE_DEVIATION = 1e-5
# Difference (rad, m) of joints: the cube root of the round-off has the least error (Nocedal and
# Wright, section 8.1).
STEP = float(np.cbrt(np.finfo(np.float64).eps))


# Residuals (N, 2, 3) and the Jacobian of the poses (N, 2, 3, P), of `FitProblem.equations`.
Equations: TypeAlias = tuple[Floats, Floats]
# Which rows are of a chain, this, all its corrections, and the joint positions in these rows.
_ChainRows: TypeAlias = tuple[Flags, CorrectedChain, Floats, Floats]


class KnownDistance(NamedTuple):
    """
    A distance (m) that is known between two points, each moved by three corrections.

    `first` and `second` are where these begin among all corrections; `between` (3,) is from the
    first point to the second one, without corrections.
    """

    first: int
    second: int
    between: Floats
    distance: float


@dataclass(frozen=True, eq=False)
class FitProblem:
    """
    Measured poses and the numbers that may be off.

    Attributes
    ----------
    parameters, prior : P
        Those that are fitted; their standard deviations before, rad or m.
    columns : shape (P,)
        The place of each among all corrections of the chains, `count` of them.
    chains
        Chains from the frame of the poses to the tool, one for each set.
    given
        The rows; `sets` are those of the chains, and `rates` those of the last K parameters.
    known_distances
        Distances between corrected points.
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
        """Return 2 for positions and rotations, or 1 for positions alone."""
        return 1 if self.given.positions else 2

    def every(self, values: Floats) -> Floats:
        """Return all corrections, those that are not fitted being zero."""
        found = np.zeros(self.count)
        found[self.columns] = values
        return found

    def _by_chain(self, values: Floats) -> Iterator[_ChainRows]:
        driving = values[len(values) - self.given.rates.shape[2] :]
        for k, chain in enumerate(self.chains):
            own = self.given.sets == k
            yield (
                own,
                chain,
                self.every(values),
                self.given.q[own] + self.given.rates[own] @ driving,
            )

    def predicted(self, values: Floats) -> Floats:
        """Return the poses (N, 4, 4) with corrections (P,)."""
        poses = np.empty_like(self.given.poses)
        for own, chain, every, q in self._by_chain(values):
            poses[own] = poses_of(chain, every, q)
        return poses

    def remainders(self, values: Floats) -> Floats:
        """Return position (m) and rotation (rad) that remain, shape (N, 2, 3)."""
        return self._between(self.predicted(values))

    def weighed(self, values: Floats) -> Floats:
        """Return what remains (N, 2, 3) with a noise that is alike in all rows."""
        return self.whitened(self.remainders(values))

    def whitened(self, rows: Floats) -> Floats:
        """Return remainders, or how they move, (N, 2, 3, ...) as they are weighed."""
        if self.given.whitening is not None:
            six = np.array(rows).reshape(len(rows), 6, *rows.shape[3:])
            own = six[:, : self.given.whitening.shape[1]]
            own[:] = np.einsum('nij,nj...->ni...', self.given.whitening, own)
            rows = six.reshape(rows.shape)
        return rows

    def _between(self, poses: Floats) -> Floats:
        if self.given.from_tool:
            return remainders_between(
                inverses(self.given.poses), inverses(poses), self.given.positions
            )
        return remainders_between(self.given.poses, poses, self.given.positions)

    def equations(self, values: Floats) -> Equations:
        """Return what remains (N, 2, 3), and how the poses move (N, 2, 3, P), as weighed."""
        poses = np.empty_like(self.given.poses)
        jacobian = np.empty((len(self.given.q), 6, len(self.columns)))
        driving = self.given.rates.shape[2]
        for own, chain, every, q in self._by_chain(values):
            change = pose_change(chain, every, q)
            poses[own], jacobian[own] = change.pose, change.jacobian[:, :, self.columns]
            if driving:
                jacobian[own, :, -driving:] = (
                    _moved_by_joints(chain, every, q) @ self.given.rates[own]
                )
        return self.whitened(self._between(poses)), self._as_weighed(poses, jacobian)

    def moves_with_joints(self, values: Floats) -> Floats:
        """Return how the poses move with each joint (N, 2, 3, n), as weighed."""
        jacobian = np.empty((len(self.given.q), 6, self.given.q.shape[1]))
        for own, chain, every, q in self._by_chain(values):
            jacobian[own] = _moved_by_joints(chain, every, q)
        return self._as_weighed(self.predicted(values), jacobian)

    def _as_weighed(self, poses: Floats, jacobian: Floats) -> Floats:
        if self.given.from_tool:
            jacobian = of_inverses(poses, jacobian)
        return self.whitened(jacobian.reshape(len(poses), 2, 3, -1))

    def distance_equations(self, values: Floats) -> tuple[Floats, Floats]:
        """Return how known distances move (D, P) and what remains (D,), in their deviations."""
        every, count = self.every(values), len(self.known_distances)
        rows, remainders = np.zeros((count, self.count)), np.zeros(count)
        for k, one in enumerate(self.known_distances):
            first, second = (slice(at, at + 3) for at in (one.first, one.second))
            between = one.between + every[second] - every[first]
            length = float(np.linalg.norm(between))
            rows[k, second], rows[k, first] = between / length, -between / length
            remainders[k] = one.distance - length
        return rows[:, self.columns] / DISTANCE_DEVIATION, remainders / DISTANCE_DEVIATION

    def only(self, groups: tuple[str, ...]) -> 'FitProblem':
        """Return the problem of these groups alone, none of which moves joints."""
        kept = [k for k, one in enumerate(self.parameters) if one.group in groups]
        return replace(
            self,
            given=self.given._replace(rates=self.given.rates[:, :, :0]),
            parameters=tuple(self.parameters[k] for k in kept),
            prior=self.prior[kept],
            columns=self.columns[kept],
        )


def _moved_by_joints(chain: CorrectedChain, every: Floats, q: Floats) -> Floats:
    # How poses move with joints, (rows, 6, n), by central differences.
    n = q.shape[1]
    at = np.concatenate([q + way * STEP * one for way in (1.0, -1.0) for one in np.eye(n)])
    later, sooner = poses_of(chain, every, at).reshape(2, n, -1, 4, 4)
    R = later[..., :3, :3] @ np.swapaxes(sooner[..., :3, :3], -1, -2)
    moved = np.concatenate([(later - sooner)[..., :3, 3], rotation_vector(R)], axis=-1)
    return np.asarray(np.moveaxis(moved / (2.0 * STEP), 0, -1))


def of_inverses(poses: Floats, jacobian: Floats) -> Floats:
    """Return how the inverses of poses (N, 4, 4) move, (N, 6, P), from how these do."""
    # With T = (R, p) that moves by v and w, T^-1 does by -R^T (v - w x p) and -R^T w.
    linear, angular = jacobian[:, :3], jacobian[:, 3:]
    turned = np.cross(angular, poses[:, :3, 3, None], axisb=1, axisa=1, axisc=1)
    R = np.swapaxes(poses[:, :3, :3], 1, 2)
    return np.concatenate([-R @ (linear - turned), -R @ angular], axis=1)


def remainders_between(measured: Floats, poses: Floats, positions: bool) -> Floats:
    """Return position (m) and rotation (rad) from poses (N, 4, 4) to measured ones, (N, 2, 3)."""
    position = measured[:, :3, 3] - poses[:, :3, 3]
    rotation = np.zeros_like(position)
    if not positions:
        R = measured[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
        rotation = rotation_vector(R)
    return np.stack([position, rotation], axis=1)


class Noise(NamedTuple):
    """Standard deviations of one number of a position (m) and of a rotation vector (rad)."""

    position: float
    rotation: float


@dataclass(frozen=True, eq=False)
class Identified:
    """
    Corrections and how well they are known, the noise and the outliers.

    Attributes
    ----------
    values : shape (P,), rad or m
    noise
        The noise of the poses.
    used : shape (N,)
        Rows that are not outliers.
    distances : shape (N,)
        The remainder of each row in standard deviations.
    freedom
        Degrees of freedom of the noise of positions, and of rotations: numbers of the rows beyond
        those that the parameters take up. Infinite if the noise is that of the instrument.
    covariance : shape (P, P)
        After the measurement, by the noise with Student's factor; it contains the priors.
    """

    values: Floats
    noise: Noise
    used: Flags
    distances: Floats
    freedom: Noise
    covariance: Floats


class _Step(NamedTuple):
    # A Gauss-Newton step by priors; the triangle R of the equations; these, and what remains.
    step: Floats
    triangle: Floats
    rows: Floats
    right: Floats


@dataclass(frozen=True, eq=False)
class _Equations:
    # The equations of a problem in units of the deviations; each row has a weight (N,) or a flag.
    problem: FitProblem
    noise: Noise
    weights: Floats | Flags

    @property
    def scale(self) -> Floats:
        # The factors of the residuals of the rows, (N, 1, 1), or (N, 2, 1) for whole poses.
        each = np.asarray(self.noise, dtype=np.float64)[: self.problem.kinds]
        return np.asarray(np.sqrt(self.weights, dtype=np.float64)[:, None, None] / each[:, None])

    def right(self, values: Floats, remainders: Floats) -> Floats:
        # Residuals of rows, known distances and priors.
        problem = self.problem
        rows = (remainders[:, : problem.kinds] * self.scale).reshape(-1)
        return np.concatenate(
            [rows, problem.distance_equations(values)[1], -values / problem.prior]
        )

    def solved(self, values: Floats) -> _Step:
        # Rows, known distances and priors move so with numbers in their deviations.
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
    """Return the corrections (P,) of Huber's estimate; arguments are as of `find_values`."""
    values = np.zeros(len(problem.parameters))
    remainders = problem.weighed(values)
    for k in range(MAX_ROUNDS):
        progress(k)
        found = _robust_noise(noise, remainders)
        weights = huber_weights(distances_of(problem, remainders, found), problem.kinds)
        step, remainders = _stepped(_Equations(problem, found, weights), values, remainders)
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
    Solve a fit: return the corrections with their standard deviations, the noise and the outliers.

    Parameters
    ----------
    noise
        The noise of the instrument, a lower bound of the estimate.
    progress
        Is called with the number of each round.
    """
    noise, limit = noise or Noise(0.0, 0.0), outlier_limit(problem.kinds)
    values = robust_values(problem, noise, progress)
    remainders = problem.weighed(values)
    found = _robust_noise(noise, remainders)
    used = distances_of(problem, remainders, found) < limit
    for k in range(MAX_ROUNDS):
        progress(MAX_ROUNDS + k)
        solved = _Equations(problem, found, used).solved(values)
        values = values + problem.prior * solved.step
        inverse = np.asarray(np.linalg.inv(solved.triangle), dtype=np.float64)
        remainders = problem.weighed(values)
        before = found
        evident, freedom = _evident_noise(problem, remainders, solved.rows, inverse, used)
        found = Noise(*map(max, zip(noise, evident)))
        distances = distances_of(problem, remainders, found)
        moved = np.max(np.abs(solved.step) / np.linalg.norm(inverse, axis=1), initial=0.0)
        accepted = normal_scores(distances, freedom) < limit
        # A row near the limit may be left out in every other round: in the second half of the
        # rounds the choice is kept.
        same = bool(np.array_equal(accepted, used)) or k > MAX_ROUNDS // 2
        used = used if same else accepted
        changed = max(abs(b / a - 1.0) if a else 0.0 for a, b in zip(before, found))
        if same and max(moved, changed) < STEP_TOLERANCE:
            break
    freedom = Noise(*(f if own <= e else np.inf for own, e, f in zip(found, evident, freedom)))
    wide = _Equations(problem, widened(found, freedom), used).solved(values)
    factor = problem.prior[:, None] * np.linalg.inv(wide.triangle)
    return Identified(values, found, used, distances, freedom, factor @ factor.T)


def normal_scores(distances: Floats, freedom: Noise) -> Floats:
    """
    Return distances in deviations of a noise with f degrees of freedom as if it were known.

    A ratio to an estimated noise has a Student distribution: its density is that of a normal one
    with f log(1 + d^2 / f) instead of d^2, a factor in f apart (Wallace, Bounds on normal
    approximations to Student's distribution, 1959). With the noise of the instrument f is
    infinite, and the distance remains.
    """
    f = min(freedom)
    return np.sqrt(f * np.log1p(distances**2 / f)) if np.isfinite(f) else distances


def _robust_noise(least: Noise, remainders: Floats) -> Noise:
    lengths = np.linalg.norm(remainders, axis=2).T
    return Noise(*np.maximum(least, median_noise(lengths)).tolist())


def widened(noise: Noise, freedom: Noise) -> Noise:
    """
    Return the standard deviations of errors whose noise is known by few numbers.

    They have a Student distribution: its variance is f / (f - 2) of the estimate (Gelman et al.,
    Bayesian Data Analysis, section 3.2), which is 1 if f is infinite.
    """
    f = np.maximum(freedom, LEAST_STUDENT_FREEDOM)
    return Noise(*(np.array(noise) * np.sqrt(1.0 + 2.0 / (f - 2.0))).tolist())


def refined(problem: FitProblem, values: Floats, noise: Noise, used: Flags) -> Floats:
    """Return the corrections by some of the rows alone, the noise being known."""
    for _ in range(MAX_ROUNDS if len(values) else 0):
        solved = _Equations(problem, noise, used).solved(values)
        values = values + problem.prior * solved.step
        # Compare the step with the deviations after the fit, which are tiny for exact poses, or
        # with those before.
        moved = np.linalg.norm(solved.triangle @ solved.step)
        if moved < STEP_TOLERANCE or np.all(np.abs(solved.step) < STEP_TOLERANCE**2):
            break
    return values


def held_out_remainders(
    problem: FitProblem, values: Floats, found: Identified, blocks: Integers
) -> Floats:
    """
    Return what remains (N, 2, 3) of each block of rows, by corrections fitted to the others.

    The errors of a block are independent of the corrections if its rows are independent of all
    others: repeats of a joint position belong in one block. Noise and outliers are those of all
    rows. The steps begin with the corrections of all rows, and end within a thousandth of a
    deviation of those of the other blocks.

    Parameters
    ----------
    values : shape (P,)
        Initial corrections.
    found
        Whose noise and outliers hold.
    blocks : shape (N,)
        The block of each row.
    """
    result = np.zeros((len(problem.given.q), 2, 3))
    for k in np.unique(blocks):
        block = blocks == k
        without = refined(problem, values, found.noise, found.used & ~block)
        result[block] = problem.remainders(without)[block]
    return result


def weighted_jacobian(problem: FitProblem, values: Floats, noise: Noise, used: Flags) -> Floats:
    """
    Return how the poses move with the parameters: in deviations of the noise, by those of priors.

    Returns the triangle (P, P) of the equations, which has the same normal equations.
    """
    rows = _Equations(problem, noise, used).solved(values).rows
    return triangle_of(rows[: len(rows) - len(values)])


def one_more(
    problem: FitProblem, found: Identified, moves: Floats
) -> tuple[list[float], list[float]]:
    """
    Return each of K corrections beside the fitted ones, and its standard deviation.

    It is an added variable of the regression (Cook and Weisberg, Residuals and Influence in
    Regression, 1982, section 2.3.2). Each is added alone; nothing was known of it before.

    Parameters
    ----------
    moves : shape (N, 2, 3, K)
        How the predicted poses move with each, as `FitProblem.weighed` has what remains.
    """
    equations = _Equations(problem, found.noise, found.used)
    solved = equations.solved(found.values)
    columns = np.zeros((len(solved.rows), moves.shape[3]))
    own = moves[:, : problem.kinds] * equations.scale[..., None]
    columns[: own[..., 0].size] = own.reshape(-1, moves.shape[3])
    triangle = triangle_of(np.column_stack([solved.rows, columns, solved.right]))
    at = len(found.values)
    # The part of each column, and of what remains, that no fitted parameter explains.
    left, right = triangle[at:, at:-1], triangle[at:, -1]
    squares = np.maximum(np.sum(left**2, axis=0), np.finfo(np.float64).tiny)
    return (right @ left / squares).tolist(), (1.0 / np.sqrt(squares)).tolist()


def _stepped(equations: _Equations, values: Floats, remainders: Floats) -> tuple[Floats, Floats]:
    # A step that is halved until it brings the poses nearer, and what remains then; `remainders`
    # are those before.
    step = equations.problem.prior * equations.solved(values).step
    before = equations.squares(values, remainders)
    for _ in range(MAX_ROUNDS):
        after = equations.problem.weighed(values + step)
        if equations.squares(values + step, after) <= before:
            return step, after
        step = 0.5 * step
    return np.asarray(step), equations.problem.weighed(values + step)


def length_quantile(share: float, kinds: int) -> float:
    """Return a quantile of the length of 3 or 6 normal numbers (Wilson and Hilferty 1931)."""
    spread = 2 / (9 * 3 * kinds)
    cube = 1.0 - spread + NormalDist().inv_cdf(share) * float(np.sqrt(spread))
    return float(np.sqrt(3 * kinds * cube**3))


def outlier_limit(kinds: int) -> float:
    """Return the distance, in deviations of the noise, beyond which a row is an outlier."""
    return length_quantile(1.0 - OUTLIER_CHANCE, kinds)


def distances_of(problem: FitProblem, remainders: Floats, noise: Noise) -> Floats:
    """Return weighed remainders (N, 2, 3) in deviations of the noise, shape (N,)."""
    each = np.asarray(noise, dtype=np.float64)[: problem.kinds]
    squares = np.sum(remainders**2, axis=2)[:, : problem.kinds] / each**2
    return np.asarray(np.sqrt(np.sum(squares, axis=1)))


def huber_weights(distances: Floats, kinds: int) -> Floats:
    """Return the weights (..., N) of Huber's estimate, of distances in deviations."""
    huber = length_quantile(HUBER_QUANTILE, kinds)
    return np.asarray(huber / np.maximum(distances, huber))


def median_noise(lengths: Floats) -> Floats:
    """Return the deviation (...,) of a number of three, by the median of lengths (..., N)."""
    return np.asarray(
        np.maximum(np.median(lengths, axis=-1) / length_quantile(0.5, 1), NOISE_FLOOR)
    )


def _evident_noise(
    problem: FitProblem, remainders: Floats, rows: Floats, inverse: Floats, used: Flags
) -> tuple[Noise, Noise]:
    # The remainder over the number of rows that no parameter was fitted to, and that number.
    kinds, count = problem.kinds, len(problem.given.q)
    basis = rows[: 3 * kinds * count] @ inverse
    leverage = np.sum(basis.reshape(count, kinds, -1) ** 2, axis=(0, 2))
    free = 3 * np.sum(used) - leverage
    squares = np.sum(remainders[used, :kinds] ** 2, axis=(0, 2))
    least = np.where(free < NOISE_FREEDOM, USUAL_NOISE, NOISE_FLOOR)
    found = np.maximum(np.sqrt(squares / np.maximum(free, 1.0)), least).tolist()
    freedom = np.maximum(free, UNKNOWN_NOISE_FREEDOM).tolist()
    return Noise(found[0], found[-1]), Noise(freedom[0], freedom[-1])
