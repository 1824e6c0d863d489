"""
What may differ between rows of one arm: joints that yield to a load, sessions that drift.

None of it is in a robot file: the table is that of the arm without a load, in the middle of the
sessions. A term is kept where cross-validation says that it helps. Held out are joint positions,
with all rows that were measured there; the squared errors of these, in deviations of the noise,
have to be less with the term than without it by more than twice the standard error of that.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats, Integers
from ...kinematics.forward import forward_kinematics
from ...kinematics.statics import joint_torques
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, CorrectingMotion
from ...robot.file.parts.parameters import ANGLE, LENGTH, SIX, ArmParameter
from ...robot.robot import Robot
from ..frame_check.errors import Errors, errors_of
from .checking import ALIKE, Measured
from .fitting import (
    LEAST_NOISE,
    USUAL_NOISE,
    FitProblem,
    FoundValues,
    Identified,
    Noise,
    SharedErrors,
    distances_of,
    find_values,
    held_out_remainders,
    with_covariance,
)
from .identified_table import IDENTIFIABLE

PLACEMENT, ZEROS, ELASTICITY = 'placement', 'zeros', 'elasticity'
# Standard deviations before: of where the instrument stands in a session (m, rad), of the zeros of
# joints (rad, m), and of compliances (rad/Nm, m/N), beyond those of soft gears.
PLACED = (LENGTH, float(ANGLE))
DRIFT = (float(ANGLE) / 4.0, LENGTH / 4.0)
COMPLIANCE = (1e-4, 1e-5)
# Blocks of joint positions that are held out in turn, drawn with this seed.
BLOCKS, SEED = 5, 0
# Rounds in which what rows have in common is estimated beside the corrections.
ROUNDS = 3
# A gain is more than so many of its standard errors, and more than a number's worth of noise.
SURE, LEAST_GAIN = 2.0, 1.0
# Joint positions of a session, or with a load, at least.
LEAST_POSITIONS = 6
# Rows are compared at the same joint positions if no more than this share of those of a session,
# or with a load, are its own; of one session all may be.
ALONE = 0.2
# Rows of a session are in a place of their own if fewer than this share of permutations of all
# rows has them as near to each other: then what differs may be an error of the arm there.
APART, PERMUTATIONS = 0.004, 500
STANDARD_GRAVITY = 9.80665
# No arm whose tool is 1 m from its base (RMS) carries as much (kg); others do by the cube of that.
CARRIED = 300.0
# A torque below this share of the load's force times 1 m is round-off.
NOTHING = 1e-9


class ToolLoads(NamedTuple):
    """
    The load on the tool at each row.

    Attributes
    ----------
    masses : shape (N,), kg
    at : m
        Its centre of mass in the tool frame.
    gravity
        Where it is pulled to in the base frame of the robot file; only the direction counts.
    """

    masses: npt.ArrayLike
    at: Sequence[float] = (0.0, 0.0, 0.0)
    gravity: Sequence[float] = (0.0, 0.0, -1.0)


class TermValue(NamedTuple):
    """
    A number of a term, and its standard deviation.

    Attributes
    ----------
    name
        Of a joint; or x to rz of the base.
    session
        That of a drift, which is one from the mean of all sessions.
    unit
        rad/Nm, m/N, rad or m.
    identifiable
        Whether the rows tell it; else it mostly stays at 0.
    """

    name: str
    session: str
    value: float
    deviation: float
    unit: str
    identifiable: bool


class TriedTerm(NamedTuple):
    """
    A term, and what it does to errors of joint positions that nothing was fitted to.

    Attributes
    ----------
    kind
        placement, zeros or elasticity.
    doubt
        Why the rows cannot tell it, in words; empty if they can.
    kept
        Whether it is part of the fit.
    without, with_term
        Errors of held-out rows; None where it was not tried.
    gain, gain_deviation
        By how much their squares, in deviations of the noise, are less in all, and the standard
        error of that.
    values
        Of a term that is kept.
    """

    kind: str
    doubt: str = ''
    kept: bool = False
    without: Errors | None = None
    with_term: Errors | None = None
    gain: float = 0.0
    gain_deviation: float = 0.0
    values: tuple[TermValue, ...] = ()


class Evidence(NamedTuple):
    """
    How rows tell a term.

    Attributes
    ----------
    doubt
        Why they cannot; empty if they can.
    paired
        Whether by what differs at the same joint positions. Otherwise these are mixed.
    """

    doubt: str
    paired: bool


class OptionalTerm(NamedTuple):
    """
    Parameters that may be added to a problem.

    Attributes
    ----------
    parameters, prior : K
        Their group is the kind of the term; their standard deviations before, rad or m.
    rates : shape (N, n, K)
        How the joints of each row move with them; zero where they move the base.
    evidence
        How the rows tell them.
    units
        What one of each is in the units of its value.
    sessions
        Names of the sessions, in whose order the parameters repeat; one name without sessions.
    """

    kind: str
    parameters: tuple[ArmParameter, ...]
    prior: Floats
    rates: Floats
    evidence: Evidence
    units: Floats | float = 1.0
    sessions: tuple[str, ...] = ('',)


class AskedTerms(NamedTuple):
    """Terms, those that move bases first, and the number (N,) of the session of each row."""

    terms: tuple[OptionalTerm, ...]
    sessions: Integers


NOTHING_ASKED = AskedTerms((), np.zeros(0, dtype=np.int64))


class FittedTerms(NamedTuple):
    """A problem with the terms that are kept, its corrections, and all terms that were tried."""

    problem: FitProblem
    found: Identified
    tried: tuple[TriedTerm, ...]


def _elasticity_of(robot: Robot, q: Floats, loads: ToolLoads) -> OptionalTerm:
    # A parameter is what a joint yields to the largest torque of all rows, rad or m.
    masses, force = _checked_loads(robot, len(q), loads)
    wrench = np.concatenate([masses[:, None] * force, np.zeros((len(q), 3))], axis=1)
    # The load pulls the tool by this, and the joints with it.
    torques = joint_torques(robot, q, wrench, at=np.asarray(loads.at))
    torques[np.abs(torques) < NOTHING * np.max(masses) * STANDARD_GRAVITY] = 0.0
    most = np.max(np.abs(torques), axis=0)
    most[most == 0.0] = 1.0
    larger = (masses > np.mean(masses)).astype(np.int64)
    return OptionalTerm(
        ELASTICITY,
        _of_joints(robot, ELASTICITY),
        most * _by_kind(robot, COMPLIANCE),
        torques[:, :, None] / most * np.eye(robot.dof),
        _evidence(robot, q, larger, ('the smaller loads', 'the larger loads'), mixed=False),
        1.0 / most,
    )


def _of_joints(robot: Robot, kind: str) -> tuple[ArmParameter, ...]:
    turns = [not slides for slides in robot.prismatic]
    return tuple(ArmParameter(name, kind, own) for name, own in zip(robot.joint_names, turns))


def _by_kind(robot: Robot, numbers: tuple[float, float]) -> Floats:
    # The first number for each joint that turns, the second one for others.
    return np.where(robot.prismatic, numbers[1], numbers[0])


def _checked_loads(robot: Robot, count: int, loads: ToolLoads) -> tuple[Floats, Floats]:
    # The masses, and the force on 1 kg in the base frame.
    masses = np.array(loads.masses, dtype=np.float64)
    at, down = (np.array(one, dtype=np.float64) for one in (loads.at, loads.gravity))
    if masses.shape != (count,) or not np.all(np.isfinite(masses)) or np.min(masses) < 0.0:
        raise CalibrationError(f'loads must be {count} masses in kg, finite and not below 0')
    if not (at.shape == down.shape == (3,) and np.all(np.isfinite([at, down])) and np.any(down)):
        raise CalibrationError(
            'the centre of mass and the direction of gravity of loads must be three finite '
            'numbers, those of gravity not all 0'
        )
    if np.ptp(masses) == 0.0:
        raise CalibrationError(
            f'the load is {masses[0]:g} kg in all rows, which tells no elasticity: measure the '
            'same joint positions with another load too'
        )
    limit = CARRIED * robot.task.length**3
    if np.max(masses) > limit:
        raise CalibrationError(
            f'a load of {np.max(masses):,.0f} kg? No arm of this size carries more than '
            f'{limit:,.0f} kg: masses are in kg, not g'
        )
    return masses, STANDARD_GRAVITY * down / np.linalg.norm(down)


def _session_names(sessions: Sequence[object], count: int) -> tuple[str, ...]:
    if len(sessions) != count:
        raise CalibrationError(f'sessions must name the session of each of {count} rows')
    names = tuple(dict.fromkeys(map(str, sessions)))
    if len(names) == 1:
        raise CalibrationError(
            f'all rows are of one session, {names[0]!r}: there is no other to compare with'
        )
    return names


def _drifts_of(
    robot: Robot, q: Floats, names: tuple[str, ...], number: Integers, placed: bool
) -> tuple[OptionalTerm, ...]:
    # Of sessions, and the number of that of each row; `placed` asks for the drift of bases too.
    marks = tuple(f'session {name}' for name in names)
    evidence = _evidence(robot, q, number, marks, mixed=True)
    own = np.eye(len(names))[number]
    count, n = len(names), robot.dof
    # Those of a session are side by side.
    rates = (own[:, None, :, None] * np.eye(n)[:, None]).reshape(len(q), n, count * n)

    def drift(
        kind: str, parameters: tuple[ArmParameter, ...], prior: Floats, moved: Floats
    ) -> OptionalTerm:
        prior = np.tile(prior, count)
        return OptionalTerm(kind, count * parameters, prior, moved, evidence, sessions=names)

    zeros = drift(ZEROS, _of_joints(robot, ZEROS), _by_kind(robot, DRIFT), rates)
    if not placed:
        return (zeros,)
    six = tuple(ArmParameter(name, PLACEMENT, k > 2) for k, name in enumerate(SIX))
    still = np.zeros((len(q), n, count * len(SIX)))
    return drift(PLACEMENT, six, np.repeat(PLACED, 3), still), zeros


def _evidence(
    robot: Robot, q: Floats, marks: Integers, names: Sequence[str], mixed: bool
) -> Evidence:
    # Whether rows marked so can tell what differs between the marks: at the same joint positions,
    # or, of what is alike everywhere, `mixed` over the workspace.
    positions = _positions(q)
    own = [set(positions[marks == k].tolist()) for k in range(len(names))]
    for these, name in zip(own, names):
        if len(these) < LEAST_POSITIONS:
            few = '1 joint position is' if len(these) == 1 else f'{len(these)} joint positions are'
            return Evidence(
                f'{few} too few for {name}: {LEAST_POSITIONS} or more are needed', False
            )
    alone = []
    for k, name in enumerate(names):
        others = set().union(*(one for j, one in enumerate(own) if j != k))
        if len(own[k] - others) > ALONE * len(own[k]):
            alone.append(name)
    if len(alone) > 1 and not (mixed and not _apart(robot, q, marks)):
        where = 'in other places' if mixed else 'not the same'
        return Evidence(
            f'the joint positions of {", ".join(alone)} are {where}, so that an error of the arm '
            'there would be taken for it; measure the same joint positions',
            False,
        )
    return Evidence('', len(alone) <= 1)


def _apart(robot: Robot, q: Floats, marks: Integers) -> bool:
    # Whether rows with one mark are nearer to each other, in joints and tool, than by chance: the
    # sum of distances within marks by permutations (Rizzo and Szekely 2010, DISCO analysis).
    slides, tool = np.array(robot.prismatic), forward_kinematics(robot, q)[:, :3, 3]
    lengths = np.concatenate([q[:, slides], tool], axis=1) / robot.task.length
    turns = q[:, ~slides]
    places = np.concatenate([np.cos(turns), np.sin(turns), lengths], axis=1)
    squares = np.sum(places**2, axis=1)
    products = places @ places.T
    D = np.sqrt(np.maximum(squares[:, None] + squares - 2.0 * products, 0.0))
    own = np.eye(int(np.max(marks)) + 1)[marks]
    counts = np.sum(own, axis=0)

    def within(rows: Floats) -> float:
        return float(np.sum(rows * (D @ rows) / counts))

    random = np.random.default_rng(SEED)
    nearest = sum(
        within(own[random.permutation(len(own))]) <= within(own) for _ in range(PERMUTATIONS)
    )
    return nearest < APART * PERMUTATIONS


def _positions(q: Floats) -> Integers:
    # Of each row the number of its joint positions: rows that are alike are of the same.
    numbers = np.full(len(q), -1)
    while np.any(numbers < 0):
        first = int(np.argmax(numbers < 0))
        near = np.max(np.abs(q - q[first]), axis=1) < ALIKE
        numbers[near & (numbers < 0)] = np.max(numbers) + 1
    return numbers


def asked_terms(
    robot: Robot,
    given: Measured,
    own_base: bool,
    free_base: bool,
    sessions: Sequence[object] | None,
    loads: ToolLoads | None,
) -> AskedTerms:
    """
    Return the terms that sessions and loads of measured poses ask for, as `calibrate` takes them.

    Parameters
    ----------
    own_base, free_base
        Whether each set has a base of its own, and whether bases are fitted at all.

    Raises
    ------
    CalibrationError
        There are not as many names or masses as rows, they are all alike, or numbers of the loads
        are none.
    """
    drifts: tuple[OptionalTerm, ...] = ()
    number = np.zeros(len(given.q), dtype=np.int64)
    if sessions is not None:
        names = _session_names(sessions, len(given.q))
        number = np.array([names.index(str(one)) for one in sessions])
        pairs = np.unique(np.stack([given.sets, number]), axis=1).shape[1]
        # Where each set is of one session, its base is that of the session already.
        placed = free_base and not (own_base and pairs == given.set_count)
        drifts = _drifts_of(robot, given.q, names, number, placed)
    yields = () if loads is None else (_elasticity_of(robot, given.q, loads),)
    return AskedTerms((*drifts, *yields), number)


def fitted_terms(
    problem: FitProblem,
    asked: AskedTerms,
    instrument: Noise | None,
    progress: Callable[[str], None],
) -> FittedTerms:
    """Return the problem with those of the terms that help, the best one first."""
    best = problem
    found = find_values(problem, instrument, lambda k: progress(f'round {k + 1}'))
    terms = asked.terms
    if not terms:
        return FittedTerms(best, with_covariance(best, found), ())
    progress('optional terms')
    full = _with_terms(problem, asked)
    kinds = tuple({one.group for one in problem.parameters})
    positions = _positions(problem.q)
    tried = [TriedTerm(one.kind, doubt) for one in terms if (doubt := one.evidence.doubt)]
    left = {one.kind: one for one in terms if not one.evidence.doubt}
    if left:
        full = _weighed(full.only((*kinds, *left)), len(problem.parameters), positions)
    while left:
        trials = []
        for kind, term in left.items():
            larger = full.only((*kinds, kind))
            own = find_values(larger, instrument)
            trials.append((_tried(term, full.only(kinds), larger, own, positions), own))
        trial, own = max(trials, key=lambda one: (one[0].kept, one[0].gain))
        if not trial.kept:
            tried += [one for one, _ in trials]
            break
        kinds, found = (*kinds, trial.kind), own
        best = full.only(kinds)
        del left[trial.kind]
        tried.append(trial)
    known = with_covariance(best, found)
    values = {one.kind: tuple(_values(one, best, known)) for one in terms if one.kind in kinds}
    return FittedTerms(
        best, known, tuple(one._replace(values=values.get(one.kind, ())) for one in tried)
    )


def _with_terms(problem: FitProblem, asked: AskedTerms) -> FitProblem:
    # The parameters of the terms follow all others; those that move bases are the first of them.
    terms = asked.terms
    parameters = [one for term in terms for one in term.parameters]
    count = problem.count + len(parameters)
    before = () if problem.rates is None else (problem.rates,)
    chains, sets = problem.chains, problem.sets
    if terms[0].kind == PLACEMENT:
        pairs, sets = np.unique(np.stack([sets, asked.sessions]), axis=1, return_inverse=True)
        chains = tuple(
            _moved(chains[k], problem.count + session * len(SIX)) for k, session in pairs.T
        )
    return replace(
        problem,
        parameters=(*problem.parameters, *parameters),
        prior=np.concatenate([problem.prior, *(term.prior for term in terms)]),
        columns=np.concatenate([problem.columns, np.arange(problem.count, count)]),
        count=count,
        chains=chains,
        sets=sets.reshape(-1),
        rates=np.concatenate([*before, *(term.rates for term in terms)], axis=2),
    )


def _weighed(full: FitProblem, plain: int, positions: Integers) -> FitProblem:
    # With what rows at the same joint positions have in common, where the arm is off by more than
    # its parameters say; `plain` is the number of those that are no terms.
    counts = np.bincount(positions)[positions]
    weighed = full
    for _ in range(ROUNDS if np.any(counts > 1) else 0):
        common = _common(full, find_values(weighed), plain, positions)
        share = 1.0 - 1.0 / np.sqrt(1.0 + counts[:, None] * common)
        weighed = replace(full, shared=SharedErrors(positions, share))
    return weighed


def _common(full: FitProblem, found: FoundValues, plain: int, positions: Integers) -> Floats:
    # Its variance, of positions and of rotations, by that of the noise, if it is evident: by an
    # analysis of variance between joint positions and within them.
    groups = positions[found.used]
    rows = full.weighed(found.values)[found.used]
    within = SharedErrors(groups, np.ones((len(groups), 2))).apart(rows)
    count, terms = len(np.unique(groups)), len(full.parameters) - plain
    free = 3.0 * np.array([len(groups) - count, count]) - np.array([terms, plain]) / full.kinds
    free = np.maximum(free, 1.0)
    noise, between = (np.sum(one**2, axis=(0, 2)) for one in (within, rows - within))
    ratio = between / free[1] / np.maximum(noise / free[0], LEAST_NOISE**2)
    evident = ratio > 1.0 + SURE * np.sqrt(np.sum(2.0 / free))
    return np.where(evident, ratio - 1.0, 0.0) * count / len(groups)


def _moved(chain: CorrectedChain, first: int) -> CorrectedChain:
    # Behind the corrections of the base those of where it is in a session.
    begin = chain.still[0]
    six = [CorrectingMotion(k > 2, k % 3, first + k) for k in range(len(SIX))]
    at = 1 + len(SIX)
    return replace(chain, still=((*begin[:at], *six, *begin[at:]), *chain.still[1:]))


def _drawn_blocks(positions: Integers) -> Integers:
    # Of each row the block of its joint positions.
    count = int(np.max(positions)) + 1
    blocks = np.empty(count, dtype=np.int64)
    order = np.random.default_rng(SEED).permutation(count)
    for number, part in enumerate(np.array_split(order, BLOCKS)):
        blocks[part] = number
    return np.asarray(blocks[positions])


def _tried(
    term: OptionalTerm,
    smaller: FitProblem,
    larger: FitProblem,
    found: FoundValues,
    positions: Integers,
) -> TriedTerm:
    # Both problems with the noise and the outliers of the larger one, which explains more.
    used, paired, blocks = found.used, term.evidence.paired, _drawn_blocks(positions)
    groups = positions[used]
    pairs = SharedErrors(groups, np.ones((len(groups), 2)))
    noise = Noise(*(max(one, USUAL_NOISE) for one in found.noise))
    values = dict(zip(larger.columns.tolist(), found.values.tolist()))
    errors, squares = [], []
    for problem in (smaller, larger):
        begin = np.array([values[k] for k in problem.columns.tolist()])
        left = held_out_remainders(problem, begin, found, blocks)
        errors.append(errors_of(left[used, 0], left[used, 1]))
        rows = problem.whitened(left)[used]
        squares.append(distances_of(problem, pairs.apart(rows) if paired else rows, noise) ** 2)
    gains = np.bincount(groups, squares[0] - squares[1])
    gains = gains[np.bincount(groups) > int(paired)]
    gain, error = float(np.sum(gains)), float(np.sqrt(len(gains)) * np.std(gains, ddof=1))
    helps = gain > max(SURE * error, LEAST_GAIN)
    return TriedTerm(term.kind, '', helps, errors[0], errors[1], gain, error)


def _values(term: OptionalTerm, problem: FitProblem, found: Identified) -> Iterator[TermValue]:
    own = [k for k, one in enumerate(problem.parameters) if one.group == term.kind]
    covariance, prior = found.covariance[np.ix_(own, own)], np.diag(term.prior**2)
    # A drift counts from the mean of the sessions.
    count = len(term.sessions)
    each = len(own) // count
    from_mean = np.eye(len(own))
    if count > 1:
        from_mean -= np.kron(np.full((count, count), 1.0 / count), np.eye(each))
    values = from_mean @ found.values[own]
    deviations, before = (
        np.sqrt(np.diag(from_mean @ one @ from_mean.T)) for one in (covariance, prior)
    )
    identifiable = (deviations < IDENTIFIABLE * before).tolist()
    numbers = zip((values * term.units).tolist(), (deviations * term.units).tolist(), identifiable)
    units = ('m/N', 'rad/Nm') if term.kind == ELASTICITY else ('m', 'rad')
    for k, (one, (value, deviation, known)) in enumerate(zip(term.parameters, numbers)):
        session = term.sessions[k // each]
        yield TermValue(one.name, session, value, deviation, units[one.angle], known)
