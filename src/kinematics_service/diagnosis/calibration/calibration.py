"""The calibration of an arm: its numbers identified from measured poses, with what is known."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...formats.recordings.block import Flags
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import rotation_vector
from ...robot.chain import FrozenArrays
from ...robot.robot import Robot
from ..frame_check.diagnosis import FrameDiagnosis
from ..frame_check.errors import Errors, errors_of
from .checking import Measured, checked_offsets, measured
from .corrected_chain import CorrectedChain, small_motion
from .corrections import corrected_robot
from .fitting import FitProblem, Identified, Noise, identify, refined, weighted_jacobian
from .knowledge import KNOWN, ParameterCombination, combinations_of
from .parameters import (
    ENDS,
    GROUPS,
    LAG,
    ArmParameter,
    end_parameters,
    parameters_of,
    placement,
    scaled_jacobian,
    structural_rank,
)
from .placing import Free, Offsets

# Standard deviations of base and tool before, m and rad: nothing is known of them; of a lag, s.
ANYWHERE, ANY_LAG = 1.0, 0.1
# Blocks of time for the cross-validation.
BLOCKS = 5
# Below this share of its prior a parameter's deviation says that the poses tell it.
TOLD = 1.0 / 3.0
# A larger share of outliers is remarked on.
MANY_OUTLIERS = 0.15
# Decimals (m, rad) of the corrections of the calibrated robot: far below what any noise leaves.
DECIMALS = 13


@dataclass(frozen=True)
class CalibratedParameter:
    """
    A parameter after the calibration.

    Attributes
    ----------
    name, group, angle
        As `ArmParameter` has them; angles are in rad, lengths in m, a lag in s.
    correction
        What is added to the nominal number.
    deviation
        Standard deviation of the correction.
    prior
        Standard deviation before.
    """

    name: str
    group: str
    angle: bool
    correction: float
    deviation: float
    prior: float

    @property
    def told(self) -> bool:
        """Return whether the poses tell it; otherwise it mostly stays where its prior has it."""
        usual = min(self.prior, ArmParameter(self.name, self.group, self.angle).scale)
        return self.deviation < TOLD * usual


@dataclass(frozen=True, eq=False)
class Calibration(FrozenArrays):
    """
    A robot identified from measured poses.

    Attributes
    ----------
    robot, calibrated
        The nominal robot; the same with the corrections of its table, its base and tool unchanged.
    parameters : P
        Those fitted.
    covariance : shape (P, P), rad and m
        Of their corrections.
    noise
        Standard deviation of one number of a measured position (m), and rotation vector (rad).
    count, positions
        Number of poses, and whether they are positions alone.
    outliers
        Rows that were left out, the farthest first.
    distances : shape (N,)
        What remains of each row, in standard deviations of the noise.
    as_given
        What was between the poses of the file and the measured ones.
    before, after
        What remains with base and tool fitted alone, and with the corrections. Without outliers.
    held_out_before, held_out
        The same of poses that nothing was fitted to: by cross-validation over blocks of rows.
    known, possible
        Number of directions of the parameters that these poses tell better than the priors; and
        that any poses of this kind could tell.
    singular_values : shape (P,)
        How well, in units of the priors; descending.
    combinations
        Parameters that no pose tells apart, or not these.
    base_offsets, tool_offsets : shape (sets, 4, 4)
        X and Y of measured = X calibrated Y.
    frames
        What the frame check said; None of positions.
    remarks
        Sentences on the data.
    """

    READ_ONLY = ('covariance', 'distances', 'singular_values', 'base_offsets', 'tool_offsets')

    robot: Robot
    calibrated: Robot
    parameters: tuple[CalibratedParameter, ...]
    covariance: Floats
    noise: Noise
    count: int
    positions: bool
    outliers: tuple[int, ...]
    distances: Floats
    as_given: Errors
    before: Errors
    after: Errors
    held_out_before: Errors
    held_out: Errors
    known: int
    possible: int
    singular_values: Floats
    combinations: tuple[ParameterCombination, ...]
    base_offsets: Floats
    tool_offsets: Floats
    frames: FrameDiagnosis | None
    remarks: tuple[str, ...]

    @cached_property
    def corrections(self) -> dict[str, float]:
        """Return the corrections by name, rad and m."""
        return {one.name: one.correction for one in self.parameters}

    @property
    def untold(self) -> tuple[str, ...]:
        """Return the parameters of the table that mostly stay where their prior has them."""
        return tuple(
            one.name for one in self.parameters if one.group in GROUPS[:3] and not one.told
        )


def calibrate(
    robot: Robot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike,
    *,
    sets: npt.ArrayLike | None = None,
    rates: npt.ArrayLike | None = None,
    own: Sequence[str] = ('base',),
    fit: Sequence[str] = (),
    fix: Sequence[str] = (),
    tolerances: Mapping[str, float] | None = None,
    noise: tuple[float, float] | None = None,
    check: bool = True,
    progress: Callable[[str], None] = lambda phase: None,
) -> Calibration:
    """
    Return the numbers of an arm that bring its poses nearest to measured ones.

    Parameters
    ----------
    robot
        The nominal arm.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4), or (N, 3) in m
        Of the tool at the same times, from elsewhere; or the positions of one point of it. In a
        frame that stands still, and of a tool frame or point that need not be that of the file.
    sets : shape (N,)
        Where the poses were measured in several sets: the set of each, from 0.
    rates : shape (N, n), rad/s or m/s
        Joint velocities where the arm moved: then a small lag is fitted, too. The joints are where
        the poses have them `lag` seconds later.
    own
        What each set has of its own: `base`, `tool`, or both.
    fit, fix
        Groups (offsets, lengths, angles, base, tool, lag) or names of parameters that are fitted,
        and that are not; default: all are fitted. What is not fitted stays as in the robot file.
    tolerances
        Standard deviations of nominal numbers, m and rad, by group or name; default: 1 mm and
        0.2 degrees.
    noise
        Standard deviations of one number of a position (m) and of a rotation vector (rad);
        default: found along with the corrections.
    check
        Whether the frame check comes first, and refuses what is no matter of calibration.
    progress
        Is called with words as the work goes on.

    Raises
    ------
    CalibrationError
        Shapes do not fit, there are too few poses, they are all alike, or they are wrong in a way
        that the frame check names.

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
    given = measured(robot, q, poses, sets, rates)
    for end in own:
        if end not in ENDS:
            raise CalibrationError(f'own: {end!r} is not one of {", ".join(ENDS)}')
    arm = parameters_of(robot)
    names = _ChosenParameters(robot, given, tuple(own), arm.table)
    fitted = names.fitted(fit, fix)
    free = Free('base' in names.groups(fitted), 'tool' in names.groups(fitted))
    progress('frame check')
    each = Free('base' in own, 'tool' in own)
    offsets, frames = checked_offsets(robot, given, free, each, check)
    problem = names.problem(arm.chain, offsets, fitted, tolerances)
    known_noise = None if noise is None else Noise(*noise)
    found = identify(problem, known_noise, lambda k: progress(f'round {k + 1}'))
    progress('cross-validation')
    return _result(robot, given, names, problem, found, frames)


class _ChosenParameters:
    # All parameters of an arm measured in sets, and what a user's words among them mean.
    def __init__(
        self, robot: Robot, given: Measured, own: tuple[str, ...], table: Sequence[ArmParameter]
    ) -> None:
        self.robot, self.given, self.own, self.table = robot, given, own, tuple(table)
        count = given.set_count
        self.ends = {end: count if end in own else 1 for end in ENDS}
        self.every = (
            *table,
            *(
                one
                for end in ENDS
                for k in range(self.ends[end])
                for one in end_parameters(end, k)
            ),
            *([] if given.rates is None else [LAG]),
        )

    def first(self, end: str, k: int) -> int:
        """Return where the corrections of the base or tool of set k begin."""
        number = k if end in self.own else 0
        before = self.ends['base'] if end == 'tool' else 0
        return len(self.table) + 6 * (before + number)

    def fitted(self, fit: Sequence[str], fix: Sequence[str]) -> list[int]:
        """Return which parameters are fitted."""
        for word in (*fit, *fix):
            self._check(word)
        chosen = [
            k
            for k, one in enumerate(self.every)
            if (not fit or {one.name, one.group} & set(fit))
            and not {one.name, one.group} & set(fix)
        ]
        if self.given.positions:
            # A point has no orientation.
            chosen = [
                k for k in chosen if self.every[k].group != 'tool' or not self.every[k].angle
            ]
        if not chosen:
            raise CalibrationError('fit, fix: nothing is left to be fitted')
        return chosen

    def _check(self, word: str) -> None:
        if word not in GROUPS and word not in [one.name for one in self.every]:
            raise CalibrationError(
                f'{word!r} is no parameter of {self.robot.name}; accepted are the groups '
                f'{", ".join(GROUPS)}, and {", ".join(one.name for one in self.every)}'
            )

    def groups(self, chosen: Sequence[int]) -> set[str]:
        """Return the groups of parameters."""
        return {self.every[k].group for k in chosen}

    def problem(
        self,
        chain: CorrectedChain,
        offsets: Sequence[Offsets],
        chosen: Sequence[int],
        tolerances: Mapping[str, float] | None,
    ) -> FitProblem:
        """Return the problem; base and tool begin at offsets."""
        for word in tolerances or {}:
            self._check(word)
        parameters = tuple(self.every[k] for k in chosen)
        base, tool = self.placed(offsets)
        chains = tuple(
            placement(chain, base[k], tool[k], (self.first('base', k), self.first('tool', k)))
            for k in range(self.given.set_count)
        )
        return FitProblem(
            parameters,
            np.array([_prior(one, tolerances or {}) for one in parameters]),
            np.array(chosen),
            len(self.every),
            chains,
            self.given.sets,
            self.given.q,
            self.given.poses,
            self.given.positions,
            self.given.rates,
        )

    def placed(self, offsets: Sequence[Offsets]) -> tuple[list[Floats], list[Floats]]:
        """Return bases and tools of the sets, with those of the file."""
        description = self.robot.description
        base, tool = description.base.motion.matrix, description.tool.motion.matrix
        return [one.base @ base for one in offsets], [tool @ one.tool for one in offsets]


def _prior(one: ArmParameter, tolerances: Mapping[str, float]) -> float:
    if one.group in (*ENDS, LAG.group):
        return tolerances.get(one.name, ANYWHERE if one.group in ENDS else ANY_LAG)
    found = tolerances.get(one.name, tolerances.get(one.group, one.scale))
    if not found > 0.0:
        raise CalibrationError(f'the tolerance of {one.name} is not above 0; use fix instead')
    return float(found)


def _result(
    robot: Robot,
    given: Measured,
    names: _ChosenParameters,
    problem: FitProblem,
    found: Identified,
    frames: FrameDiagnosis | None,
) -> Calibration:
    used = found.used
    zero = np.zeros(len(problem.parameters))
    ends = problem.only(ENDS)
    own = np.array([one.group in ENDS for one in problem.parameters])
    begin = refined(ends, zero[own], found.noise, used)
    deviations = np.sqrt(np.diag(found.covariance))
    told = weighted_jacobian(problem, found.values, found.noise, used)
    values = np.linalg.svd(told, compute_uv=False)
    # What can be told apart is so of the nominal arm and by usual errors, whatever the priors:
    # corrections bring axes out of parallel by nothing that could be measured.
    scales = np.array([one.scale for one in problem.parameters]) / problem.prior
    apart = weighted_jacobian(problem, zero, found.noise, used) * scales
    base, tool = _ends(robot, names, problem, found.values)
    return Calibration(
        robot=robot,
        calibrated=corrected_robot(robot, problem.parameters, np.round(found.values, DECIMALS)),
        parameters=tuple(
            CalibratedParameter(
                one.name, one.group, one.angle, float(value), float(deviation), float(prior)
            )
            for one, value, deviation, prior in zip(
                problem.parameters, found.values, deviations, problem.prior
            )
        ),
        covariance=found.covariance,
        noise=found.noise,
        count=len(given.q),
        positions=given.positions,
        outliers=_outliers(found),
        distances=found.distances,
        as_given=_errors(_as_given(robot, given), used),
        before=_errors(ends.remainders(begin), used),
        after=_errors(problem.remainders(found.values), used),
        held_out_before=_errors(_held_out(ends, begin, found), used),
        held_out=_errors(_held_out(problem, found.values, found), used),
        known=int(np.sum(values > KNOWN)),
        possible=_possible(robot, names, problem),
        singular_values=np.asarray(values, dtype=np.float64),
        combinations=combinations_of(apart, problem.parameters),
        base_offsets=base,
        tool_offsets=tool,
        frames=frames,
        remarks=_remarks(given, found),
    )


def _errors(remainders: Floats, used: Flags) -> Errors:
    return errors_of(remainders[used, 0], remainders[used, 1])


def _as_given(robot: Robot, given: Measured) -> Floats:
    poses = forward_kinematics(robot, given.q)
    rotation = np.zeros((len(poses), 3))
    if not given.positions:
        R = given.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
        rotation = rotation_vector(R)
    return np.stack([given.poses[:, :3, 3] - poses[:, :3, 3], rotation], axis=1)


def _held_out(problem: FitProblem, values: Floats, found: Identified) -> Floats:
    # What remains of each block of rows where the corrections are fitted to the other blocks.
    result = np.zeros((len(problem.q), 2, 3))
    for block in np.array_split(np.arange(len(problem.q)), BLOCKS):
        others = found.used.copy()
        others[block] = False
        without = refined(problem, values, found.noise, others)
        result[block] = problem.remainders(without)[block]
    return result


def _outliers(found: Identified) -> tuple[int, ...]:
    order = np.argsort(-found.distances, kind='stable')
    return tuple(int(k) for k in order if not found.used[k])


def _possible(robot: Robot, names: _ChosenParameters, problem: FitProblem) -> int:
    # Sets beyond the first add a base or a tool of their own, which they tell.
    J = scaled_jacobian(robot, problem.chains[0], names.every, problem.positions)[
        :, problem.columns
    ]
    elsewhere = sum(not np.any(column) for column in J.T)
    return structural_rank(J) + elsewhere


def _ends(
    robot: Robot, names: _ChosenParameters, problem: FitProblem, values: Floats
) -> tuple[Floats, Floats]:
    # X and Y of measured = X calibrated Y, for each set.
    description = robot.description
    B, T = description.base.motion.matrix, description.tool.motion.matrix
    every = problem.every(values)
    base, tool = [], []
    for k, chain in enumerate(problem.chains):
        first, last = chain.still[0][0], chain.still[-1][-1]
        assert isinstance(first, np.ndarray)
        assert isinstance(last, np.ndarray)
        moved = [_motion(every[names.first(end, k) :][:6]) for end in ENDS]
        base.append(first @ moved[0] @ np.linalg.inv(B))
        tool.append(np.linalg.inv(T) @ moved[1] @ last)
    return np.array(base), np.array(tool)


def _motion(six: Floats) -> Floats:
    T = np.eye(4)
    for k, value in enumerate(six.tolist()):
        T = T @ small_motion(k > 2, k % 3, value)
    return T


def _remarks(given: Measured, found: Identified) -> tuple[str, ...]:
    remarks = []
    rows = (3 if given.positions else 6) * int(np.sum(found.used))
    if rows < 2 * len(found.values):
        remarks.append(
            f'{int(np.sum(found.used))} poses give {rows} numbers for {len(found.values)} '
            'parameters: the priors decide much of the result; measure more poses'
        )
    left = int(np.sum(~found.used))
    if left > MANY_OUTLIERS * len(found.used):
        remarks.append(
            f'{left} of {len(found.used)} rows are outliers: the poses are not those of this arm '
            'within one noise; look at their times and at loads'
        )
    return tuple(remarks)
