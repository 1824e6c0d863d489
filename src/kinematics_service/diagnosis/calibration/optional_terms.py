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
from ...formats.recordings.block import Flags
from ...kernel import Floats, Integers
from ...kinematics.statics import joint_torques
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, CorrectingMotion
from ...robot.file.parts.parameters import ANGLE, LENGTH, SIX, ArmParameter
from ...robot.robot import Robot
from ..frame_check.errors import Errors, angle_in_words, errors_of, length_in_words
from .checking import ALIKE, Measured, in_words
from .fitting import (
    USUAL_NOISE,
    FitProblem,
    Identified,
    Noise,
    distances_of,
    held_out_remainders,
    identify,
)
from .identified_table import IDENTIFIABLE

PLACEMENT, ZEROS, ELASTICITY = 'placement', 'zeros', 'elasticity'
# Standard deviations before: of where the instrument stands in a session (m, rad), of the zeros of
# joints (rad, m), and of compliances (rad/Nm, m/N), beyond those of soft gears.
PLACED = (LENGTH, float(ANGLE))
DRIFT = (float(ANGLE) / 4.0, LENGTH / 4.0)
COMPLIANCE = (1e-4, 1e-5)
# Below this (rad/Nm, m/N) no joint of an arm is: it would be stiffer than the largest are.
STIFFEST = (2e-8, 1e-10)
# Blocks of joint positions that are held out in turn, drawn with this seed.
BLOCKS, SEED = 5, 0
# A gain is more than so many of its standard errors, and more than a number's worth of noise.
SURE, LEAST_GAIN = 2.0, 1.0
# Joint positions of a session, or with a load, at least.
LEAST_POSITIONS = 6
# Rows mostly have their nearest among their own where more than this share do of those that would
# not by chance: then what differs may be the place in the workspace.
MIXED = 2.0 / 3.0
STANDARD_GRAVITY = 9.80665
# The most (kg) that an arm whose tool is 1 m from its base, RMS, carries; by the square of that.
CARRIED = 500.0
# A torque below this share of the load's force times 1 m is round-off.
NOTHING = 1e-9
# A number beyond so many of its deviations is not 0.
TOLD = 3.0


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


class OptionalTerm(NamedTuple):
    """
    Parameters that may be added to a problem.

    Attributes
    ----------
    parameters, prior : K
        Their group is the kind of the term; their standard deviations before, rad or m.
    rates : shape (N, n, K)
        How the joints of each row move with them; zero where they move the base.
    doubt
        As in `TriedTerm`.
    units
        What one of each is in the units of its value.
    sessions
        Names of the sessions, in whose order the parameters repeat; one name without sessions.
    """

    kind: str
    parameters: tuple[ArmParameter, ...]
    prior: Floats
    rates: Floats
    doubt: str
    units: Floats
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
        _doubt(robot, q, larger, ('the smaller loads', 'the larger loads')),
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
    limit = CARRIED * robot.task.length**2
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
    doubt = _doubt(robot, q, number, tuple(f'session {name}' for name in names))
    own = np.eye(len(names))[number]
    count, n = len(names), robot.dof
    # Those of a session are side by side.
    rates = (own[:, None, :, None] * np.eye(n)[:, None]).reshape(len(q), n, count * n)
    zeros = OptionalTerm(
        ZEROS,
        count * _of_joints(robot, ZEROS),
        np.tile(_by_kind(robot, DRIFT), count),
        rates,
        doubt,
        np.ones(count * n),
        names,
    )
    if not placed:
        return (zeros,)
    placement = OptionalTerm(
        PLACEMENT,
        count * tuple(ArmParameter(name, PLACEMENT, k > 2) for k, name in enumerate(SIX)),
        np.tile(np.repeat(PLACED, 3), count),
        np.zeros((len(q), n, count * len(SIX))),
        doubt,
        np.ones(count * len(SIX)),
        names,
    )
    return (placement, zeros)


def _doubt(robot: Robot, q: Floats, marks: Integers, names: Sequence[str]) -> str:
    # Why rows marked so tell nothing of what differs between the marks.
    positions = _positions(q)
    nearer = _nearer_to_own(q / robot.task.column_scales, marks)
    for k, name in enumerate(names):
        own = marks == k
        count = len(np.unique(positions[own]))
        if count < LEAST_POSITIONS:
            return f'{name}: {count} joint positions, where {LEAST_POSITIONS} or more are needed'
        chance = (np.sum(own) - 1.0) / (len(q) - 1.0)
        if np.mean(nearer[own]) > chance + MIXED * (1.0 - chance):
            return (
                f'{name}: the joint positions are apart from those of all other rows, so that '
                'errors of the arm there would be taken for it; measure the same ones'
            )
    return ''


def _positions(q: Floats) -> Integers:
    # Of each row the number of its joint positions: rows that are alike are of the same.
    numbers = np.full(len(q), -1)
    while np.any(numbers < 0):
        first = int(np.argmax(numbers < 0))
        near = np.max(np.abs(q - q[first]), axis=1) < ALIKE
        numbers[near & (numbers < 0)] = np.max(numbers) + 1
    return numbers


def _nearer_to_own(q: Floats, marks: Integers) -> Flags:
    # Whether the nearest other row of each is one with its mark.
    nearer = np.zeros(len(q), dtype=bool)
    for k, one in enumerate(q):
        distances = np.linalg.norm(q - one, axis=1)
        distances[k] = np.inf
        own = marks == marks[k]
        nearer[k] = np.min(distances[own]) + ALIKE < np.min(distances[~own], initial=np.inf)
    return nearer


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
    best, found = problem, identify(problem, instrument, lambda k: progress(f'round {k + 1}'))
    terms = asked.terms
    if not terms:
        return FittedTerms(best, found, ())
    progress('optional terms')
    full = _with_terms(problem, asked)
    kinds = tuple({one.group for one in problem.parameters})
    positions = _positions(problem.q)
    blocks = _drawn_blocks(positions)
    tried = [TriedTerm(one.kind, one.doubt) for one in terms if one.doubt]
    left = [one.kind for one in terms if not one.doubt]
    while left:
        trials = []
        for kind in left:
            larger = full.only((*kinds, kind))
            own = identify(larger, instrument)
            trials.append((_tried(kind, full.only(kinds), larger, own, blocks, positions), own))
        trial, own = max(trials, key=lambda one: (one[0].kept, one[0].gain))
        if not trial.kept:
            tried += [one for one, _ in trials]
            break
        kinds, found = (*kinds, trial.kind), own
        best = full.only(kinds)
        left.remove(trial.kind)
        tried.append(trial)
    values = {one.kind: tuple(_values(one, best, found)) for one in terms if one.kind in kinds}
    return FittedTerms(
        best, found, tuple(one._replace(values=values.get(one.kind, ())) for one in tried)
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


def _moved(chain: CorrectedChain, first: int) -> CorrectedChain:
    # Behind the corrections of the base those of where it is in a session.
    begin = chain.still[0]
    six = [CorrectingMotion(k > 2, k % 3, first + k) for k in range(len(SIX))]
    at = 1 + len(SIX)
    return chain._replace(still=((*begin[:at], *six, *begin[at:]), *chain.still[1:]))


def _drawn_blocks(positions: Integers) -> Integers:
    # Of each row the block of its joint positions.
    count = int(np.max(positions)) + 1
    blocks = np.empty(count, dtype=np.int64)
    order = np.random.default_rng(SEED).permutation(count)
    for number, part in enumerate(np.array_split(order, BLOCKS)):
        blocks[part] = number
    return np.asarray(blocks[positions])


def _tried(
    kind: str,
    smaller: FitProblem,
    larger: FitProblem,
    found: Identified,
    blocks: Integers,
    positions: Integers,
) -> TriedTerm:
    # Both problems with the noise and the outliers of the larger one, which explains more.
    used = found.used
    noise = Noise(*(max(one, USUAL_NOISE) for one in found.noise))
    values = dict(zip(larger.columns.tolist(), found.values.tolist()))
    errors, squares = [], []
    for problem in (smaller, larger):
        begin = np.array([values[k] for k in problem.columns.tolist()])
        left = held_out_remainders(problem, begin, found, blocks)
        errors.append(errors_of(left[used, 0], left[used, 1]))
        squares.append(distances_of(problem, problem.whitened(left), noise) ** 2)
    gains = np.bincount(positions[used], (squares[0] - squares[1])[used])
    gain, error = float(np.sum(gains)), float(np.sqrt(len(gains)) * np.std(gains, ddof=1))
    helps = gain > max(SURE * error, LEAST_GAIN)
    return TriedTerm(kind, '', helps, errors[0], errors[1], gain, error)


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
    for k, one in enumerate(term.parameters):
        unit = 'rad' if one.angle else 'm'
        if term.kind == ELASTICITY:
            unit = 'rad/Nm' if one.angle else 'm/N'
        yield TermValue(
            one.name,
            term.sessions[k // each],
            float(values[k] * term.units[k]),
            float(deviations[k] * term.units[k]),
            unit,
            bool(deviations[k] < IDENTIFIABLE * before[k]),
        )


WORDS = {
    PLACEMENT: 'a drift of where the instrument stands, from session to session',
    ZEROS: 'a drift of the zeros of the joints, from session to session',
    ELASTICITY: 'elasticity of the joints',
}


def term_sentences(tried: Sequence[TriedTerm], positions: bool) -> Iterator[str]:
    """Yield what was found of optional terms, in words; `positions` is of `Calibration`."""
    for one in tried:
        words = WORDS[one.kind]
        if one.without is None or one.with_term is None:
            yield f'{_capital(words)} cannot be told and is left out: {one.doubt}'
            continue
        with_term, without = (
            in_words(errors.position_rms, errors.rotation_rms, positions)
            for errors in (one.with_term, one.without)
        )
        verdict = 'helps and is kept' if one.kept else 'does not help and is left out'
        yield (
            f'{_capital(words)} {verdict}: rows at joint positions that are held out are '
            f'{with_term} off with it, {without} without it (rms)'
        )
        if one.kept:
            yield from _value_sentences(one)


def _capital(words: str) -> str:
    return words[0].upper() + words[1:]


def _value_sentences(term: TriedTerm) -> Iterator[str]:
    known = [one for one in term.values if one.identifiable]
    others = ', '.join(dict.fromkeys(one.name for one in term.values if not one.identifiable))
    rest = f'; not known: {others}' if others else ''
    what = 'The compliances' if term.kind == ELASTICITY else 'From the mean of the sessions'
    listed = ', '.join(map(_value_in_words, known))
    yield f'{what}, which no robot file has: {listed or "none is known"}{rest}'
    if term.kind != ELASTICITY:
        return
    yield 'They are those of the torque of the load; what the arm itself weighs bends it always'
    told = [one for one in known if abs(one.value) > TOLD * one.deviation]
    for one in told:
        if one.value < 0.0:
            yield (
                f'The compliance of {one.name} is negative, and no joint yields against its '
                'torque: look at the masses, where they are, and the direction of gravity'
            )
    if told and all(abs(one.value) < STIFFEST[one.unit == 'm/N'] for one in told):
        yield 'No arm is as stiff: are the masses in g? They are taken as kg'


def _value_in_words(one: TermValue) -> str:
    begin = f'{one.name} of session {one.session}' if one.session else one.name
    if one.unit in ('rad', 'm'):
        words = angle_in_words if one.unit == 'rad' else length_in_words
        return f'{begin} {words(one.value)} (standard deviation {words(one.deviation)})'
    return f'{begin} {one.value:.3g} {one.unit} (standard deviation {one.deviation:.2g})'
