"""
Causes of what remains between two sources of poses: each is undone, and what is left compared.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from .errors import Errors, angle_in_words, errors_of, length_in_words, time_in_words
from .hypotheses import (
    ComparedData,
    ComparedData,
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
    lifted,
    parameter_columns,
    parameter_step,
    scale_of,
    span_of,
)

# A cause is named where the remainder falls to less than one part in DECISIVE, and mentioned where
# it explains most of it.
DECISIVE, MOST_OF_IT = 3.0, 2.0
# Causes that explain about as much: within this factor of the best.
AS_WELL, MENTIONED_AS_WELL = 2.0, 1.25
# Poses hypotheses are sifted with, steps for each, and how many are then fitted fully.
SIFTED, SIFT_STEPS, KEPT = 40, 4, 4
# What a few poses, or the first order, promise may be so many times too little.
SIFT_MARGIN, FIRST_ORDER_MARGIN = 2.0, 1.5
# Rounds in which a number is fitted and the poses are computed anew with it.
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
        joint_sign, joint_signs, joint_order, degrees, millimetres, convention, tool_axes,
        quaternion_order, joint_offset, link_length or time_lag.
    sentence
        What is wrong.
    value
        The number found, in rad, m, s or samples; None where there is none.
    ratio
        By how much the remainder falls once it is undone.
    errors
        What remains then.
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
        Those that explain most of it, but not two thirds; empty where some are named.
    """

    named: tuple[TestedCause, ...] = ()
    likely: tuple[TestedCause, ...] = ()


def causes_of(given: ComparedData, A: Floats, fit: Fit) -> Causes:
    """Return the causes that explain what `fit` leaves between A (N, 4, 4) and the poses."""
    tried = [*_whole(given, fit), *_numbers(given, A, fit), *_lag(given, A, fit)]
    best = max((cause.ratio for cause in tried), default=0.0)

    def about(factor: float) -> tuple[TestedCause, ...]:
        # Of what explains as much, a whole thing is likelier than a number that happens to fit.
        kept = [cause for cause in tried if cause.ratio * factor >= best]
        return tuple(sorted(kept, key=lambda cause: (cause.value is not None, -cause.ratio)))

    if best >= DECISIVE:
        return Causes(named=tuple(one for one in about(AS_WELL) if one.ratio >= DECISIVE))
    if best >= MOST_OF_IT:
        likely = (one for one in about(MENTIONED_AS_WELL) if one.ratio >= MOST_OF_IT)
        return Causes(likely=tuple(likely))
    return Causes()


def _whole(given: ComparedData, fit: Fit) -> list[TestedCause]:
    # All are sifted with a few poses; the best are fitted with all of them.
    every = np.unique(np.linspace(0, len(given.q) - 1, SIFTED).astype(int))
    few = given._replace(q=given.q[every], poses=given.poses[every])
    changes = list(hypotheses_of(few))
    sifted = fit_offsets(*_undone(few, changes), steps=SIFT_STEPS)
    wanted = [
        k
        for k in np.argsort(sifted.score, kind='stable')[:KEPT].tolist()
        if sifted.score[k] * MOST_OF_IT < SIFT_MARGIN * fit.score
    ]
    if not wanted:
        return []
    changes = [change for k, change in enumerate(hypotheses_of(given)) if k in wanted]
    wanted.sort()
    begin = Fit(*(values[wanted] for values in sifted))
    fits = fit_offsets(*_undone(given, changes), begin=begin)
    return [
        _cause(change.key, change.sentence, None, fit, fits.one(k))
        for k, change in enumerate(changes)
    ]


def _undone(given: ComparedData, changes: list[ComparedData]) -> tuple[Floats, Floats]:
    # Poses of both sources with each change undone, shape (H, N, 4, 4).
    q = np.stack([given.q if change.q is None else change.q for change in changes])
    A = evaluate(given.robot, q, depth=kernel.POSE).pose
    for k, change in enumerate(changes):
        if change.robot is not None:
            A[k] = evaluate(change.robot, q[k], depth=kernel.POSE).pose
    B = np.stack([given.poses if change.poses is None else change.poses for change in changes])
    return A, B


def _numbers(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    # By first order: what each takes away beyond what the offsets can; the best are fitted.
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
    return [
        _fitted(given, A, fit, slides[k])
        for k in np.argsort(left, kind='stable')[:KEPT].tolist()
        if left[k] * MOST_OF_IT < FIRST_ORDER_MARGIN * fit.score
    ]


def _fitted(
    given: ComparedData, A: Floats, before: Fit, hypothesis: NumberHypothesis
) -> TestedCause:
    # Steps of the offsets and the number together; the poses are computed anew with it.
    scale, value, fit = scale_of(given.poses), 0.0, before
    for _ in range(ROUNDS):
        value += parameter_step(A, fit, hypothesis.columns, scale)
        A = hypothesis.model(value)
        fit = fit_offsets(A[None], given.poses[None], begin=lifted(fit), steps=2).one(0)
    shown = length_in_words(value) if hypothesis.unit == 'm' else angle_in_words(value)
    shown = shown if value < 0.0 else f'+{shown}'
    if hypothesis.key == 'joint_offset':
        sentence = f'the zero of joint {slide.name} is off: its positions need {shown}'
    else:
        sentence = f'a length of the table is off: {slide.name} needs {shown}'
    return _cause(hypothesis.key, sentence, value, before, fit)


def _lag(given: ComparedData, A: Floats, fit: Fit) -> list[TestedCause]:
    if given.later is None:
        return []
    found = lagged(given.robot, given.later, given.poses, A, fit)
    if found is None:
        return []
    size, unit = abs(found.value), given.later.unit
    shown = time_in_words(size) if unit == 's' else f'{size:.3g} {unit}'
    side = 'behind' if found.value < 0.0 else 'ahead of'
    sentence = f'the poses are {shown} {side} the joint states'
    return [_cause('time_lag', sentence, found.value, found.before, found.fit)]


def _cause(key: str, sentence: str, value: float | None, before: Fit, fit: Fit) -> TestedCause:
    ratio = float(before.score) / max(float(fit.score), ROUND_OFF)
    errors = errors_of(fit.position, fit.rotation)
    return TestedCause(key, sentence, value, ratio, errors, fit.X, fit.Y)
