"""
Causes of what remains between two sources of poses: each is undone, and what is left compared.

"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..tool_state import evaluate
from .errors import Errors, errors_of
from .hypotheses import Change, Given, Slide, changes_of, degrees_or_mm, slides_of
from .offsets import (
    LEFT_ALONE,
    Fit,
    fit_offsets,
    jacobian,
    parameter_columns,
    residual,
    scale_of,
    solved,
    span_of,
)

# A cause is named where the remainder falls to less than one part in DECISIVE.
DECISIVE = 3.0
# Causes that explain about as much: within this factor of the best.
AS_WELL = 2.0
# Poses hypotheses are sifted with, steps for each, and how many are then fitted fully.
SIFTED, SIFT_STEPS, KEPT = 40, 4, 4
# What a few poses, or the first order, promise may be so many times too little.
SIFT_MARGIN, FIRST_ORDER_MARGIN = 2.0, 1.5
# Rounds in which a number is fitted and the poses are computed anew with it.
ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Cause:
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


class _Tried(NamedTuple):
    change: Change | Slide
    value: float | None
    fit: Fit


def causes_of(given: Given, A: Floats, fit: Fit) -> tuple[Cause, ...]:
    """
    Return the causes that explain what `fit` leaves between A (N, 4, 4) and the poses.

    The likely one first, then others that explain about as much; none where none is decisive.

    """
    tried = [*_whole(given, fit), *_numbers(given, A, fit)]
    ratios = [float(fit.score) / max(float(one.fit.score), 1e-15) for one in tried]
    best = max(ratios, default=0.0)
    kept = [
        (ratio, one)
        for ratio, one in zip(ratios, tried)
        if ratio >= DECISIVE and ratio * AS_WELL >= best
    ]
    # Of what explains as much, a whole thing is likelier than a number that happens to fit.
    kept.sort(key=lambda pair: (isinstance(pair[1].change, Slide), -pair[0]))
    return tuple(_cause(ratio, one) for ratio, one in kept)


def _whole(given: Given, fit: Fit) -> list[_Tried]:
    # All are sifted with a few poses; the best are fitted with all of them.
    every = np.unique(np.linspace(0, len(given.q) - 1, SIFTED).astype(int))
    few = given._replace(q=given.q[every], poses=given.poses[every])
    changes = list(changes_of(few))
    sifted = fit_offsets(*_undone(few, changes), steps=SIFT_STEPS)
    wanted = [
        k
        for k in np.argsort(sifted.score, kind='stable')[:KEPT].tolist()
        if sifted.score[k] * DECISIVE < SIFT_MARGIN * fit.score
    ]
    if not wanted:
        return []
    changes = [change for k, change in enumerate(changes_of(given)) if k in wanted]
    wanted.sort()
    begin = Fit(*(values[wanted] for values in sifted))
    fits = fit_offsets(*_undone(given, changes), begin=begin)
    return [_Tried(change, None, fits.one(k)) for k, change in enumerate(changes)]


def _undone(given: Given, changes: list[Change]) -> tuple[Floats, Floats]:
    # Poses of both sources with each change undone, shape (H, N, 4, 4).
    q = np.stack([given.q if change.q is None else change.q for change in changes])
    A = evaluate(given.robot, q, depth=kernel.POSE).pose
    for k, change in enumerate(changes):
        if change.robot is not None:
            A[k] = evaluate(change.robot, q[k], depth=kernel.POSE).pose
    B = np.stack([given.poses if change.poses is None else change.poses for change in changes])
    return A, B


def _numbers(given: Given, A: Floats, fit: Fit) -> list[_Tried]:
    # By first order: what each takes away beyond what the offsets can; the best are fitted.
    scale = scale_of(given.poses)
    J, r = equations_of(A, fit, scale)
    slides = list(slides_of(given))
    columns = np.stack([parameter_columns(A, fit, slide.columns, scale) for slide in slides], 1)
    basis = span_of(J)
    columns -= basis @ (basis.T @ columns)
    rest = r - basis @ (basis.T @ r)
    squares = np.sum(columns**2, axis=0)
    strong = squares > (LEFT_ALONE**2 * len(r))
    taken = np.divide((rest @ columns) ** 2, squares, out=np.zeros_like(squares), where=strong)
    left = np.sqrt(np.maximum(np.sum(rest**2) - taken, 0.0) / len(A))
    tried = []
    for k in np.argsort(left, kind='stable')[:KEPT].tolist():
        if left[k] * DECISIVE < FIRST_ORDER_MARGIN * fit.score:
            tried.append(_fitted(given, A, fit, slides[k]))
    return tried


def equations_of(A: Floats, fit: Fit, scale: Floats) -> tuple[Floats, Floats]:
    """
    Return Jacobian (6 N, 12) and remainder (6 N,) of one problem; see `offsets`.

    """
    whole = Fit(*(np.asarray(values)[None] for values in fit))
    scales = np.reshape(scale, (1, 1, 1))
    return jacobian(A[None], whole, scales)[0], residual(whole, scales)[0]


def _fitted(given: Given, A: Floats, fit: Fit, slide: Slide) -> _Tried:
    # Steps of the offsets and the number together; the poses are computed anew with it.
    scale, value = scale_of(given.poses), 0.0
    for _ in range(ROUNDS):
        J, r = equations_of(A, fit, scale)
        column = parameter_columns(A, fit, slide.columns, scale)
        step = solved(np.column_stack([J, column])[None], r[None])[0]
        value += float(step[12])
        A = slide.model(value)
        whole = Fit(*(np.asarray(values)[None] for values in fit))
        fit = fit_offsets(A[None], given.poses[None], begin=whole, steps=2).one(0)
    return _Tried(slide, value, fit)


def _cause(ratio: float, one: _Tried) -> Cause:
    errors = errors_of(one.fit.position, one.fit.rotation)
    if isinstance(one.change, Change):
        return Cause(
            one.change.key, one.change.sentence, None, ratio, errors, one.fit.X, one.fit.Y
        )
    slide, value = one.change, one.value or 0.0
    shown = degrees_or_mm(value, slide.unit)
    if slide.key == 'joint_offset':
        sentence = f'the zero of joint {slide.name} is off: its positions need {shown}'
    elif slide.key == 'link_length':
        sentence = f'a length of the table is off: {slide.name} needs {shown}'
    else:
        late = 'behind' if value < 0.0 else 'ahead of'
        sentence = f'the poses are {shown.lstrip("+-")} {late} the joint states'
    return Cause(slide.key, sentence, value, ratio, errors, one.fit.X, one.fit.Y)
