"""
Causes of the remainder between two sources of poses: each is undone, and the remainders compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import LoopError
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...robot.closed_poses import closes_at
from .angle_orders import few_of, likely_orders
from .errors import (
    EXPLAINED,
    MOST,
    NOMINAL,
    Errors,
    PoseLimit,
    angle_in_words,
    errors_of,
    length_in_words,
    time_in_words,
)
from .hypotheses import (
    ComparedData,
    Hypothesis,
    NumberHypothesis,
    hypotheses_of,
    number_hypotheses_of,
)
from .lag import lagged
from .offsets import (
    LEFT_ALONE,
    Fit,
    equations_of,
    fit_offsets,
    least_angles,
    lifted,
    parameter_columns,
    parameter_step,
    scale_of,
    span_of,
)

# A cause is named if the remainder falls to less than one part in DECISIVE, and mentioned if it
# explains most of it.
DECISIVE, MOST_OF_IT = 3.0, 2.0
# Causes that explain about as much: within this factor of the best.
AS_WELL, MENTIONED_AS_WELL = 2.0, 1.25
# Number of poses for a first selection of hypotheses, steps for each, number of those that are
# tried at once, the likeliest first, and of those then fitted fully.
SIFTED, SIFT_STEPS, AT_ONCE, KEPT = 40, 4, 16, 4
# Factor by which an estimate from a few poses, or of first order, may be too small.
SIFT_MARGIN, FIRST_ORDER_MARGIN = 2.0, 1.5
# Rounds in which a number is fitted and the poses are computed again with it.
ROUNDS = 4
# A score (rad) below this is round-off.
ROUND_OFF = 1e-15


@dataclass(frozen=True, eq=False)
class TestedCause:
    """
    A tested cause.

    Attributes
    ----------
    key
        joint_sign, joint_signs, joint_order, joint_coupling, degrees, millimetres, convention,
        tool_axes, quaternion_order, angle_order, joint_offset, link_length or time_lag.
    sentence
        What is wrong.
    value
        The number found, in rad, m, s or samples; None if there is none.
    ratio
        Remainder before over remainder after it is undone.
    errors
        The remainder then.
    base_offset, tool_offset : shape (4, 4)
        The offsets then; see `FrameDiagnosis`.
    """

    key: str
    sentence: str
    value: float | None
    ratio: float
    errors: Errors
    base_offset: Floats
    tool_offset: Floats


class Causes(NamedTuple):
    """
    Causes that explain about as much, the likely one first.

    Attributes
    ----------
    named
        Those that explain at least two thirds.
    likely
        Those that explain most of it, but not two thirds; empty if some are named.
    decisive
        Whether the only one that is named leaves what instrument and nominal table can leave.
    """

    named: tuple[TestedCause, ...] = ()
    likely: tuple[TestedCause, ...] = ()
    decisive: bool = False


def causes_of(given: ComparedData, A: Floats, fit: Fit, limit: PoseLimit = EXPLAINED) -> Causes:
    """
    Return the causes that explain the remainder of `fit` between A (N, 4, 4) and the poses.

    Parameters
    ----------
    limit
        What instrument and nominal table can leave.
    """
    tried = _whole(given, fit)
    tried += _orders(given, A, fit, tried)
    tried += [*_numbers(given, A, fit), *_lag(given, A, fit)]
    best = max((cause.ratio for cause in tried), default=0.0)

    def about(factor: float) -> tuple[TestedCause, ...]:
        # If two causes explain as much, a discrete mistake is likelier than a number that happens
        # to fit.
        kept = [cause for cause in tried if cause.ratio * factor >= best]
        return tuple(sorted(kept, key=lambda cause: (cause.value is not None, -cause.ratio)))

    if best >= DECISIVE:
        named = tuple(one for one in about(AS_WELL) if one.ratio >= DECISIVE)
        return Causes(named, decisive=len(named) == 1 and _explained(named[0], limit))
    if best >= MOST_OF_IT:
        likely = (one for one in about(MENTIONED_AS_WELL) if one.ratio >= MOST_OF_IT)
        return Causes(likely=tuple(likely))
    return Causes()


def _explained(cause: TestedCause, limit: PoseLimit) -> bool:
    # Between few samples, and by stamps that are not those of the measurement, a moving arm
    # leaves more where its lag is undone.
    most = MOST if cause.key == 'time_lag' else limit
    return cause.errors.within(PoseLimit(*map(max, zip(most, limit))))


def _whole(given: ComparedData, fit: Fit) -> list[TestedCause]:
    # All are tried with a few poses; the best are fitted with all of them.
    every = np.unique(np.linspace(0, len(given.q) - 1, SIFTED).astype(int))
    few = given._replace(q=given.q[every], poses=given.poses[every])
    places = possible(given)
    changes = [change for k, change in enumerate(hypotheses_of(few)) if k in places]
    sifted = _sifted(*undone(few, changes), _most(fit))
    kept = {places[k] for k in sifted}
    changes = [change for k, change in enumerate(hypotheses_of(given)) if k in kept]
    return _undoing(given, changes, fit, sifted)


def _orders(
    given: ComparedData, A: Floats, fit: Fit, tried: Sequence[TestedCause]
) -> list[TestedCause]:
    if errors_of(fit.position, fit.rotation).rotation_rms < NOMINAL.angle:
        return []  # angles so small hardly depend on their order
    likely = likely_orders(given.poses, A, given.read)
    few = few_of(len(A))
    # The joints are where they were.
    others = np.tile(given.poses[few], (len(likely), 1, 1, 1))
    others[..., :3, :3] = np.reshape([one.chosen for one in likely], (len(likely), -1, 3, 3))
    sifted = _sifted(np.broadcast_to(A[few], others.shape), others, _most(fit, tried))
    return _undoing(given, [likely[k].undone(given.poses, A) for k in sifted], fit, sifted)


def _most(fit: Fit, tried: Sequence[TestedCause] = ()) -> float:
    # The score of few poses from which on a cause explains too little, or by far less than others.
    ratio = max([MOST_OF_IT, *(one.ratio / AS_WELL for one in tried)])
    return SIFT_MARGIN * float(fit.score) / ratio


def _sifted(A: Floats, B: Floats, most: float) -> dict[int, Fit]:
    # The places, rising, of those of H problems that leave least, and less than `most`; and their
    # fits. Those are not fitted that leave far more than others whatever the offsets are.
    bounds, found = least_angles(A, B), dict[int, Fit]()
    order = np.argsort(bounds, kind='stable')
    for some in np.split(order, range(AT_ONCE, len(order), AT_ONCE)):
        best = min((float(one.score) for one in found.values()), default=np.inf)
        near = some[bounds[some] < min(most, SIFT_MARGIN * AS_WELL * best)].tolist()
        if near:
            fits = fit_offsets(A[near], B[near], steps=SIFT_STEPS)
            found |= {k: one for i, k in enumerate(near) if (one := fits.one(i)).score < most}
    return {k: found[k] for k in sorted(sorted(found, key=lambda k: found[k].score)[:KEPT])}


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


def possible(given: ComparedData) -> list[int]:
    """Return the places of the hypotheses whose joint positions close the loops of the arm."""
    chain = given.robot.chain
    return [
        k
        for k, change in enumerate(hypotheses_of(given))
        if change.q is None or bool(np.all(closes_at(chain, change.q)))
    ]


def undone(given: ComparedData, changes: Sequence[Hypothesis]) -> tuple[Floats, Floats]:
    """Return the poses of both sources with each change undone, shape (H, N, 4, 4)."""
    q = np.stack([change.joints(given.q) for change in changes])
    A = evaluate(given.robot, q, depth=kernel.POSE).pose
    for k, change in enumerate(changes):
        if change.robot is not None:
            A[k] = evaluate(change.robot, q[k], depth=kernel.POSE).pose
    B = np.stack([change.seen(given.poses) for change in changes])
    return A, B


def _numbers(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    # To first order: the reduction by each beyond that of the offsets; the best are fitted.
    scale = scale_of(given.poses)
    J, r = equations_of(A, fit, scale)
    slides = list(number_hypotheses_of(given))
    columns = np.stack(
        [parameter_columns(A, fit, hypothesis.columns, scale) for hypothesis in slides], 1
    )
    basis = span_of(J)
    columns -= basis @ (basis.T @ columns)
    rest = r - basis @ (basis.T @ r)
    squares = np.sum(columns**2, axis=0)
    strong = squares > (LEFT_ALONE**2 * len(r))
    taken = np.divide((rest @ columns) ** 2, squares, out=np.zeros_like(squares), where=strong)
    left = np.sqrt(np.maximum(np.sum(rest**2) - taken, 0.0) / len(A))
    fitted = (
        _fitted(given, A, fit, slides[k])
        for k in np.argsort(left, kind='stable')[:KEPT].tolist()
        if left[k] * MOST_OF_IT < FIRST_ORDER_MARGIN * fit.score
    )
    return [cause for cause in fitted if cause is not None]


def _fitted(
    given: ComparedData, A: Floats, before: Fit, hypothesis: NumberHypothesis
) -> TestedCause | None:
    # Steps of the offsets and the number together; the poses are computed again with it. None
    # where a closed loop does not close with it.
    scale, value, fit = scale_of(given.poses), 0.0, before
    for _ in range(ROUNDS):
        value += parameter_step(A, fit, hypothesis.columns, scale)
        try:
            A = hypothesis.model(value)
        except LoopError:
            return None
        fit = fit_offsets(A[None], given.poses[None], begin=lifted(fit), steps=2).one(0)
    return _cause(hypothesis.key, number_in_words(hypothesis, value), value, before, fit)


def number_in_words(hypothesis: NumberHypothesis, value: float) -> str:
    """Return the sentence that a number of the robot needs a correction."""
    shown = length_in_words(value) if hypothesis.unit == 'm' else angle_in_words(value)
    shown = shown if value < 0.0 else f'+{shown}'
    if hypothesis.key == 'joint_offset':
        return f'the zero of joint {hypothesis.name} is off: its positions need {shown}'
    return f'a length of the table is off: {hypothesis.name} needs {shown}'


def _lag(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    if given.later is None:
        return []
    try:
        found = lagged(given.robot, given.later, given.poses, A, fit)
    except LoopError:
        return []  # at another time a closed loop does not close
    if found is None:
        return []
    size, unit = abs(found.value), given.later.unit
    shown = time_in_words(size) if unit == 's' else f'{size:.3g} {unit}'
    side = 'behind' if found.value < 0.0 else 'ahead of'
    sentence = f'the poses are {shown} {side} the joint states'
    return [_cause('time_lag', sentence, found.value, found.before, found.fit)]


def _cause(
    key: str, sentence: str, value: float | None, before: Fit, fit: Fit, unit: float = 1.0
) -> TestedCause:
    ratio = float(before.score) / max(float(fit.score), ROUND_OFF)
    errors = errors_of(unit * fit.position, fit.rotation)
    return TestedCause(key, sentence, value, ratio, errors, fit.X, fit.Y)
