"""
The diagnosis: constant offsets, what remains, and the cause that was tested to explain it.

"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import KinematicsError
from ..kernel import Floats
from ..notice import direction_in_words
from ..robot import Robot
from ..tool_state import evaluate
from .hypotheses import Change, Given, Slide, changes_of, degrees_or_mm, slides_of
from .offsets import (
    LEFT_ALONE,
    Fit,
    fit_offsets,
    free_directions,
    jacobian,
    parameter_columns,
    residual,
    scale_of,
    solved,
    span_of,
)
from .rotations import rotation_vectors

# A cause is named where the remainder falls to less than one part in DECISIVE.
DECISIVE = 3.0
# Causes that explain about as much: within this factor of the best.
AS_WELL = 2.0
# A remainder below both (m, rad) needs no cause: encoders and factory calibrations are coarser.
FINE, FINE_ANGLE = 2e-5, 2e-5
# Poses hypotheses are sifted with, steps for each, and how many are then fitted fully.
SIFTED, SIFT_STEPS, KEPT = 40, 4, 4
# What a few poses, or the first order, promise may be so many times too little.
SIFT_MARGIN, FIRST_ORDER_MARGIN = 2.0, 1.5
# Poses needed for offsets at all, and to name a cause.
LEAST, LEAST_FOR_CAUSE = 3, 8
# Rounds in which a number is fitted and the poses are computed anew with it.
ROUNDS = 4


class FramesError(KinematicsError, ValueError):
    """
    Poses or joint positions that cannot be compared.

    """


class Errors(NamedTuple):
    """
    How far poses are apart: RMS and largest, position in m, orientation in rad.

    """

    position_rms: float
    position_max: float
    rotation_rms: float
    rotation_max: float

    def in_words(self) -> str:
        """
        Return both RMS values, in mm and deg.

        """
        return f'{1e3 * self.position_rms:.3g} mm, {math.degrees(self.rotation_rms):.3g} deg'


@dataclass(frozen=True)
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

    """

    key: str
    sentence: str
    value: float | None
    ratio: float
    errors: Errors


@dataclass(frozen=True, eq=False)
class FrameDiagnosis:
    """
    How the poses of a robot file and those of a second source hang together.

    Attributes
    ----------
    sentence
        All of it for a person.
    count
        Number of poses compared.
    as_given
        How far the poses are apart as they are.
    base_offset, tool_offset : shape (4, 4)
        X and Y of B = X A Y: the file's base frame in that of the second source, and the second
        source's tool in that of the file.
    errors
        What remains with them.
    undetermined
        Directions of the offsets these poses do not determine, in words.
    cause
        The likely cause of what remains; None where none is decisive.
    causes
        All that explain about as much, the likely one first.

    """

    sentence: str
    count: int
    as_given: Errors
    base_offset: Floats
    tool_offset: Floats
    errors: Errors
    undetermined: tuple[str, ...]
    cause: Cause | None
    causes: tuple[Cause, ...]


def diagnose_frames(
    robot: Robot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike,
    stamps: npt.ArrayLike | None = None,
    rates: npt.ArrayLike | None = None,
) -> FrameDiagnosis:
    """
    Return how poses of a second source differ from those of the robot file, and the likely cause.

    Parameters
    ----------
    robot
        The arm.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4)
        The tool by the second source, at the same times.
    stamps : shape (N,), s
        When; needed only to find a lag in seconds.
    rates : shape (N, n), rad/s or m/s
        Joint velocities, for the lag; default: differences of q.

    Raises
    ------
    FramesError
        Shapes do not fit, a number is not finite, or there are fewer than three poses.

    """
    given = _given(robot, q, poses, stamps, rates)
    A = evaluate(robot, given.q).pose
    as_given = _errors(
        given.poses[:, :3, 3] - A[:, :3, 3],
        rotation_vectors(given.poses[:, :3, :3] @ np.swapaxes(A[:, :3, :3], 1, 2)),
    )
    fit = fit_offsets(A[None], given.poses[None]).one(0)
    errors = _errors(fit.position, fit.rotation)
    causes: tuple[Cause, ...] = ()
    small = errors.position_rms < FINE and errors.rotation_rms < FINE_ANGLE
    if not small and len(A) >= LEAST_FOR_CAUSE:
        causes = _causes(given, A, fit)
    free = free_directions(_equations(A, fit, scale_of(given.poses))[0])
    undetermined = tuple(_in_words(direction) for direction in free)
    return FrameDiagnosis(
        sentence=_sentence(len(A), as_given, errors, undetermined, causes),
        count=len(A),
        as_given=as_given,
        base_offset=fit.X,
        tool_offset=fit.Y,
        errors=errors,
        undetermined=undetermined,
        cause=causes[0] if causes else None,
        causes=causes,
    )


def _given(
    robot: Robot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike,
    stamps: npt.ArrayLike | None,
    rates: npt.ArrayLike | None,
) -> Given:
    q, B = np.array(q, dtype=np.float64), np.array(poses, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != robot.dof or B.shape != (len(q), 4, 4):
        raise FramesError(
            f'q must have the shape (N, {robot.dof}) and poses (N, 4, 4), '
            f'not {q.shape} and {B.shape}'
        )
    if not (np.all(np.isfinite(q)) and np.all(np.isfinite(B))):
        raise FramesError('joint positions and poses must be finite')
    if len(q) < LEAST:
        raise FramesError(f'{len(q)} poses are too few: at least {LEAST} are needed')
    if rates is not None:
        changes = np.nan_to_num(np.array(rates, dtype=np.float64))
    elif stamps is not None:
        t = np.array(stamps, dtype=np.float64)
        forwards = len(t) == len(q) and bool(np.all(np.diff(t) > 0.0))
        changes = np.gradient(q, t, axis=0) if forwards else np.zeros_like(q)
    else:
        changes = np.gradient(q, axis=0)
    if changes.shape != q.shape:
        raise FramesError(f'rates must have the shape {q.shape}, not {changes.shape}')
    seconds = rates is not None or stamps is not None
    return Given(robot, q, B, np.ascontiguousarray(changes), seconds)


def _errors(position: Floats, rotation: Floats) -> Errors:
    p, r = np.linalg.norm(position, axis=1), np.linalg.norm(rotation, axis=1)
    return Errors(
        float(np.sqrt(np.mean(p**2))),
        float(np.max(p)),
        float(np.sqrt(np.mean(r**2))),
        float(np.max(r)),
    )


class _Tried(NamedTuple):
    change: Change | Slide
    value: float | None
    fit: Fit


def _causes(given: Given, A: Floats, fit: Fit) -> tuple[Cause, ...]:
    tried = [*_whole(given, fit), *_numbers(given, A, fit)]
    ratios = [float(fit.score / max(one.fit.score, 1e-15)) for one in tried]
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
    J, r = _equations(A, fit, scale)
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


def _equations(A: Floats, fit: Fit, scale: Floats) -> tuple[Floats, Floats]:
    whole = Fit(*(np.asarray(values)[None] for values in fit))
    scales = np.reshape(scale, (1, 1, 1))
    return jacobian(A[None], whole, scales)[0], residual(whole, scales)[0]


def _fitted(given: Given, A: Floats, fit: Fit, slide: Slide) -> _Tried:
    # Steps of the offsets and the number together; the poses are computed anew with it.
    scale, value = scale_of(given.poses), 0.0
    for _ in range(ROUNDS):
        J, r = _equations(A, fit, scale)
        column = parameter_columns(A, fit, slide.columns, scale)
        step = solved(np.column_stack([J, column])[None], r[None])[0]
        value += float(step[12])
        A = slide.model(value)
        whole = Fit(*(np.asarray(values)[None] for values in fit))
        fit = fit_offsets(A[None], given.poses[None], begin=whole, steps=2).one(0)
    return _Tried(slide, value, fit)


def _cause(ratio: float, one: _Tried) -> Cause:
    errors = _errors(one.fit.position, one.fit.rotation)
    if isinstance(one.change, Change):
        return Cause(one.change.key, one.change.sentence, None, ratio, errors)
    slide, value = one.change, one.value or 0.0
    shown = degrees_or_mm(value, slide.unit)
    if slide.key == 'joint_offset':
        sentence = f'the zero of joint {slide.name} is off: its positions need {shown}'
    elif slide.key == 'link_length':
        sentence = f'a length of the table is off: {slide.name} needs {shown}'
    else:
        late = 'behind' if value < 0.0 else 'ahead of'
        sentence = f'the poses are {shown.lstrip("+-")} {late} the joint states'
    return Cause(slide.key, sentence, value, ratio, errors)


def _in_words(direction: Floats) -> str:
    base, tool = direction[:6], direction[6:]
    parts = [
        f'{direction_in_words(half)} of the {name}'
        for half, name in ((base, 'base'), (tool, 'tool'))
        if np.linalg.norm(half) > 0.1
    ]
    return ' against '.join(parts)


def _sentence(
    count: int,
    as_given: Errors,
    errors: Errors,
    undetermined: tuple[str, ...],
    causes: tuple[Cause, ...],
) -> str:
    if causes:
        cause = causes[0]
        others = [other.sentence for other in causes[1:]]
        as_well = f' (as well possible: {"; ".join(others)})' if others else ''
        text = (
            f'{cause.sentence}{as_well}: with that undone the remainder falls from '
            f'{errors.in_words()} to {cause.errors.in_words()} (rms, {cause.ratio:.3g} times less)'
        )
        return text[0].upper() + text[1:]
    text = (
        f'Over {count} poses the sources are {as_given.in_words()} apart (rms); with a constant '
        f'offset of base and tool {errors.in_words()} remain'
    )
    if errors.position_rms > FINE or errors.rotation_rms > FINE_ANGLE:
        text += (
            ', and no single cause explains them'
            if count >= LEAST_FOR_CAUSE
            else f'; fewer than {LEAST_FOR_CAUSE} poses name no cause'
        )
    if len(undetermined):
        text += f'. These poses do not determine {len(undetermined)} of the 12 numbers of the offsets'
    return text
