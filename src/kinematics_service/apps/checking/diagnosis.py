# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Diagnose differences between two sources of poses: fit offsets, and name the likely cause."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...errors import FramesError
from ...estimation.status_text import direction_in_words
from ...kernel import Floats
from ...kinematics.arguments import numbers_of
from ...kinematics.tool_state import evaluate
from ...rigid_motion import rotation_vector
from ...robot.robot import AnyRobot, Robot, as_robot
from .causes import Causes, TestedCause, causes_of
from .errors import EXPLAINED, NOMINAL, Errors, PoseLimit, errors_of
from .hypotheses import ComparedData
from .joint_motion import SampledMotion
from .lag import Later, looked_up
from .offsets import Fit, equations_of, fit_offsets, free_directions, scale_of

# No cause is sought if the residuals are below both limits (m, rad), because the best laser
# trackers have errors of this size: 0.02 mm, and 0.01 deg with a 6-DOF probe.
FINE = PoseLimit(2e-5, 2e-4)
# Base offset for which the diagnosis names a reason: the frame base_link of UR arms is the base
# frame of the controller, turned by 180 deg about z.
BASE_LINK = ('base', 'about z', 180)
# Larger ratios of residuals before and after a correction are round-off and are not printed.
MAX_SHOWN_RATIO = 1e6
# Largest entry of R^T R - I of a rotation matrix that was rounded to float32 or to printed digits.
ORTHOGONALITY_TOLERANCE = 0.01
# Smallest number of poses that determine the offsets of base and tool.
MIN_POSES = 3
# Smallest number of poses for which a cause is sought.
CAUSE_POSES = 8

# Text that is added to the diagnosis of an arm with closed loops. Other lengths and conventions of
# its table are not tried, because with another table the loops would not close at the given joint
# positions.
NOT_TRIED = (
    '. Lengths and conventions of the table are no causes that were tried: the closed loops would '
    'close elsewhere'
)


@dataclass(frozen=True, eq=False)
class FrameDiagnosis:
    """
    The comparison of the poses of a robot file (A) with those of a second source (B).

    Attributes
    ----------
    sentence
        The whole diagnosis as text.
    count
        Number of poses compared.
    as_given
        The differences of the poses without offsets.
    base_offset, tool_offset : shape (4, 4)
        X and Y of B = X A Y. X is the pose of the robot file's base frame in the base frame of the
        second source. Y is the pose of the second source's tool frame in the tool frame of the
        robot file.
    errors
        The residuals with these offsets.
    undetermined
        Directions in which the poses leave the offsets undetermined, as text.
    cause
        The decisive cause of the residuals, or None. No other cause explains nearly as much as the
        decisive cause. After the correction of the decisive cause, the residuals are so small that
        measurement errors and a nominal (uncalibrated) table can cause them.
    causes
        Causes whose correction divides the RMS residual by 3 or more: the best cause, and causes
        that explain nearly as much. The likeliest is first.
    likely
        If `causes` is empty: causes whose correction divides the RMS residual by 2 or more.
    """

    sentence: str
    count: int
    as_given: Errors
    base_offset: Floats
    tool_offset: Floats
    errors: Errors
    undetermined: tuple[str, ...]
    cause: TestedCause | None
    causes: tuple[TestedCause, ...]
    likely: tuple[TestedCause, ...] = ()


def diagnose_frames(
    robot: AnyRobot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike,
    stamps: npt.ArrayLike | None = None,
    motion: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    *,
    limit: PoseLimit = EXPLAINED,
    read: str = '',
    fine: PoseLimit = FINE,
) -> FrameDiagnosis:
    """
    Compare poses of a second source with those of the robot file, and return the likely cause.

    Parameters
    ----------
    robot
        The arm.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4)
        Poses of the tool by the second source, at the times of `q`.
    stamps : shape (N,), s
        Times of the poses; needed only to find a lag in seconds.
    motion : shapes (K,), s, and (K, n), rad or m
        Samples of the motion before, between and after the poses, to find a lag: K times in rising
        order, and the joint positions at these times. Default: `stamps` and `q`.
    limit
        Largest residuals (rms) that measurement errors and a nominal table can cause. If larger
        residuals remain after a cause is corrected, this cause is not decisive.
    read
        The convention by which the orientations were read: `rpy`, `ZYX` or another order of three
        angles, or `rotvec`. Any other text means unknown.
    fine
        If residuals (rms) are below this limit, no cause is sought.

    Raises
    ------
    LoopError
        A closed loop does not close at a position.
    FramesError
        Shapes do not fit, a number is not finite, an orientation is not a rotation, or there are
        fewer than three poses.
    """
    robot = as_robot(robot)
    given = _given(robot, q, poses)
    given = given._replace(later=_later(robot, given.q, stamps, motion), read=read)
    A = evaluate(robot, given.q).pose
    as_given = errors_of(
        given.poses[:, :3, 3] - A[:, :3, 3],
        rotation_vector(given.poses[:, :3, :3] @ np.swapaxes(A[:, :3, :3], 1, 2)),
    )
    fit = fit_offsets(A[None], given.poses[None]).one(0)
    errors = errors_of(fit.position, fit.rotation)
    causes = Causes()
    small = errors.within(fine)
    if not small and len(A) >= CAUSE_POSES:
        causes = causes_of(given, A, fit, limit)
    free = free_directions(equations_of(A, fit, scale_of(given.poses))[0])
    undetermined = tuple(_in_words(direction) for direction in free)
    return FrameDiagnosis(
        sentence=_sentence(
            len(A), as_given, errors, undetermined, None if small else causes, _known_offset(fit)
        )
        + (NOT_TRIED if robot.chain.loops and not small and not causes.named else ''),
        count=len(A),
        as_given=as_given,
        base_offset=fit.X,
        tool_offset=fit.Y,
        errors=errors,
        undetermined=undetermined,
        cause=causes.named[0] if causes.decisive else None,
        causes=causes.named,
        likely=causes.likely,
    )


def _given(robot: Robot, q: npt.ArrayLike, poses: npt.ArrayLike) -> ComparedData:
    q, B = numbers_of('q', q), numbers_of('poses', poses)
    if q.ndim != 2 or q.shape[1] != robot.dof or B.shape != (len(q), 4, 4):
        raise FramesError(
            f'q must have the shape (N, {robot.dof}) and poses (N, 4, 4), '
            f'not {q.shape} and {B.shape}',
            code='wrong-shape',
        )
    if not (np.all(np.isfinite(q)) and np.all(np.isfinite(B))):
        raise FramesError('q, poses: must be finite numbers', code='not-finite')
    if len(q) < MIN_POSES:
        message = f'{len(q)} poses are too few: at least {MIN_POSES} are needed'
        raise FramesError(message, code='too-few')
    check_rotations(B[:, :3, :3])
    return ComparedData(robot, q, B)


def check_rotations(R: Floats) -> None:
    """
    Refuse matrices (N, 3, 3) that are not rotations.

    Raises
    ------
    FramesError
        A matrix is mirrored, or far from a rotation.
    """
    mirrored = np.flatnonzero(np.linalg.det(R) < 0.0)
    if len(mirrored):
        raise FramesError(
            f'mirrored axes: the orientation of {len(mirrored)} of {len(R)} poses, the first of '
            f'them pose {mirrored[0]}, has determinant -1; one axis points the wrong way',
            code='mirrored',
        )
    far = np.max(np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)), axis=(1, 2))
    if np.any(far > ORTHOGONALITY_TOLERANCE):
        raise FramesError(
            f'the orientation of pose {int(np.argmax(far))} is not a rotation: its columns are '
            'not of unit length and at right angles',
            code='not-a-rotation',
        )


def _later(
    robot: Robot,
    q: Floats,
    stamps: npt.ArrayLike | None,
    motion: tuple[npt.ArrayLike, npt.ArrayLike] | None,
) -> Later | None:
    # Return the joint positions at the times of the poses plus a lag, as a function of the lag.
    # The function interpolates `motion`. If `motion` is None, it interpolates q at the times
    # `stamps`. If `stamps` is None, too, it interpolates q at the times 0, 1, 2, ... and the lag
    # is in samples. Return None if q is interpolated and `stamps` do not rise.
    t = None if stamps is None else numbers_of('stamps', stamps)
    if t is not None and t.shape != (len(q),):
        message = f'stamps must have the shape {(len(q),)}, not {t.shape}'
        raise FramesError(message, code='wrong-shape')
    if motion is not None:
        if t is None:
            message = 'motion: needs the stamps of the poses; give stamps too'
            raise FramesError(message, code='missing')
        times, positions = (numbers_of('motion', part) for part in motion)
        if times.ndim != 1 or positions.shape != (len(times), robot.dof):
            raise FramesError(
                f'the motion must have the shapes (K,) and (K, {robot.dof}), '
                f'not {times.shape} and {positions.shape}',
                code='wrong-shape',
            )
        if len(times) < 2 or not np.all(np.diff(times) > 0.0):
            raise FramesError('motion: needs two or more rising times', code='wrong-order')
        if not np.all(np.isfinite(positions)):
            raise FramesError('motion: joint positions must be finite', code='not-finite')
        return looked_up(SampledMotion(times, positions, robot.continuous), t)
    if t is None:
        samples = np.arange(len(q), dtype=np.float64)
        return looked_up(SampledMotion(samples, q, robot.continuous, 1.5), samples, 'samples')
    if np.all(np.diff(t) > 0.0):
        return looked_up(SampledMotion(t, q, robot.continuous), t)
    return None


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
    causes: Causes | None,
    known: str,
) -> str:
    # Return the whole diagnosis as text. `causes` is None if the residuals are too small to search
    # for a cause.
    if causes is not None and causes.decisive:
        (cause,) = causes.named
        less = f', {cause.ratio:.3g} times less' if cause.ratio < MAX_SHOWN_RATIO else ''
        text = (
            f'{cause.sentence}: with that undone the remainder falls from {errors.in_words()} to '
            f'{cause.errors.in_words()} (rms{less})'
        )
        return text[0].upper() + text[1:]
    text = (
        f'Over {count} poses the sources are {as_given.in_words()} apart (rms); with a constant '
        f'offset of base and tool {known if not undetermined else ""}{errors.in_words()} remain'
    )
    if causes is not None:
        text += (
            f', and no single cause explains them{_mention(causes)}'
            if count >= CAUSE_POSES
            else f'; fewer than {CAUSE_POSES} poses are too few to name a cause'
        )
    if len(undetermined):
        text += (
            f'. These poses do not determine {len(undetermined)} of the 12 numbers of the offsets'
        )
    return text


def _known_offset(fit: Fit) -> str:
    # Return a text on the fitted offsets if they only rotate the base about its origin, or only
    # rotate the tool about its origin. Return an empty text for any other offsets.
    for end, offset, other in (('base', fit.X, fit.Y), ('tool', fit.Y, fit.X)):
        turn, other_turn = rotation_vector(offset[:3, :3]), rotation_vector(other[:3, :3])
        shift = max(np.linalg.norm(offset[:3, 3]), np.linalg.norm(other[:3, 3]))
        size = np.linalg.norm(turn)
        if np.linalg.norm(other_turn) < NOMINAL.angle < size and shift < NOMINAL.position:
            angle = math.degrees(size)
            axis = direction_in_words(np.append(np.zeros(3), turn), ('', 'about'))
            link = ': base_link of UR arms' if (end, axis, round(angle)) == BASE_LINK else ''
            return f'(the {end} is turned by {angle:.3g} deg {axis}{link}) '
    return ''


def _mention(causes: Causes) -> str:
    if causes.named:
        tried = '; '.join(
            f'{cause.sentence}, which leaves {cause.errors.in_words()}' for cause in causes.named
        )
        return f' for certain; tried, not decided: {tried}'
    if causes.likely:
        first, *rivals = causes.likely
        sentences = '; '.join(cause.sentence for cause in rivals)
        others = f' (also possible: {sentences})' if rivals else ''
        return (
            f'; most likely, not decisive: {first.sentence}{others}, {first.ratio:.2g} times less'
        )
    return ''
