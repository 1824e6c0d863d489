# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the mistake that explains why the table of a robot file misses its known poses.

A mistake is named only if its correction makes the table agree with all known poses. A pose agrees
if the error is within the tolerance of the pose, or within the rounding of its digits. No offset
is fitted. If a file has two mistakes at once, or noise, no mistake is named.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import LoopError
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...kinematics.uncertainty.corrected_chain import PoseChange
from ...rigid_motion import exact_rpy, inverse, rotation_of_roll_pitch_yaw, rotation_vector
from ...robot.file.parts.description import KnownPose
from ...robot.robot import Robot
from . import hypotheses
from .angle_orders import order_hypotheses_of
from .causes import number_in_words, possible, undone
from .hypotheses import ComparedData, Hypothesis
from .known_poses import errors_between, pose_errors, within_digits

# Statements of wrong units. Each key is the statement for a file in rad and m; the value replaces
# it if the file is in degrees or millimetres.
IN_DEGREES = {hypotheses.RADIANS_TWICE: 'q of the poses is in radians, not degrees'}
IN_MILLIMETRES = {hypotheses.LENGTHS_IN_MM: 'xyz of the poses is in metres, not millimetres'}
# Keys of mistakes that are tried only if the known poses have orientations.
OF_ORIENTATIONS = ('tool_axes', 'quaternion_order')
# Start values (rad) of the Gauss-Newton method for the correction of an angle in the robot file.
START_ANGLES = (0.0, 0.5 * math.pi, -0.5 * math.pi, math.pi)
# Number of Gauss-Newton steps that fit one number of the robot file (a joint zero, a length or an
# angle) to the known poses.
NEWTON_STEPS = 12
# Two poses of the tool are taken as equal if the entries of their 4 x 4 matrices differ by at most
# this.
TOOL_TOLERANCE = 1e-9
# Mistakes are sought only if the arm misses a known pose by more than 10 times the rounding error.
# The rounding error is the error that the rounded digits of the known pose allow. Smaller errors
# are not explained, because many wrong numbers could cause them.
ERROR_RATIO = 10.0


class PoseCauses(NamedTuple):
    """
    Mistakes that explain why the table of a file misses its known poses.

    The mistakes are alternatives: if any one of them is corrected, the table agrees with all known
    poses.

    Attributes
    ----------
    sentences
        Statements of what is wrong.
    tried
        Number of mistakes that were tried.
    """

    sentences: tuple[str, ...]
    tried: int

    def __str__(self) -> str:
        """Return the mistakes as a sentence; empty if no mistake explains the poses."""
        if not self.sentences:
            return ''
        if len(self.sentences) == 1:
            return (
                f'one mistake of {self.tried} that were tried explains them: {self.sentences[0]}'
            )
        return (
            f'{len(self.sentences)} mistakes of {self.tried} that were tried explain them, each '
            f'alone; another pose may decide which: {"; ".join(self.sentences)}'
        )


class _Undone(NamedTuple):
    # `sentence` states a mistake. `poses` and `expected`, (N, 4, 4) each, are the poses of the arm
    # and the expected poses after the mistake is corrected.
    sentence: str
    poses: Floats
    expected: Floats


def pose_causes(robot: Robot) -> PoseCauses:
    """
    Return each mistake that alone explains all known poses of a robot file; none if the poses fit
    up to their written digits.
    """
    known = within_digits(robot)
    if known != robot.description.known_poses:
        errors = [replace(error, known=known[error.index]) for error in pose_errors(robot)]
        if max(error.share for error in errors) < ERROR_RATIO:
            return PoseCauses((), 0)
    expected = np.array([pose.motion.matrix for pose in known])
    given = ComparedData(robot, np.array([pose.q for pose in known]), expected)
    count = 0
    # Try wrong numbers only if no discrete mistake explains all known poses. Otherwise a wrong
    # sign, for example, would be found again as a wrong number.
    for mistakes in (_whole(given), itertools.chain(_ends(given), _numbers(given))):
        tried = list(mistakes)
        count += len(tried)
        sentences = [
            fix.sentence
            for fix in tried
            if all(error.share <= 1.0 for error in errors_between(known, fix.poses, fix.expected))
        ]
        if sentences:
            return PoseCauses(tuple(dict.fromkeys(sentences)), count)
    return PoseCauses((), count)


def _has_orientations(robot: Robot) -> bool:
    return not any(math.isinf(pose.tolerance_rpy) for pose in robot.description.known_poses)


def _whole(given: ComparedData) -> Iterator[_Undone]:
    robot = given.robot
    changes = possible(given)
    if not robot.chain.loops:
        changes += [
            *hypotheses.number_signs_of(robot),
            *hypotheses.exchanges_of(robot),
            *hypotheses.ends_left_out_of(robot),
        ]
    if _has_orientations(robot):
        A = evaluate(robot, given.q, depth=kernel.POSE).pose
        changes += [*_angle_units(given), *order_hypotheses_of(given.poses, A, 'rpy')]
    else:
        changes = [change for change in changes if change.key not in OF_ORIENTATIONS]
    words = dict[str, str]()
    if robot.description.angle_unit == 'deg':
        words |= IN_DEGREES
    if robot.description.length_unit == 'mm':
        words |= IN_MILLIMETRES
    for change, poses, expected in zip(changes, *undone(given, changes)):
        # leave out the option in brackets at the end of the sentence
        sentence = change.sentence.partition(' (--')[0]
        yield _Undone(words.get(sentence, sentence), poses, expected)


def _angle_units(given: ComparedData) -> Iterator[Hypothesis]:
    # Yield wrong units of angles: the angles of the poses, or of poses and joints, are in rad
    # instead of deg or in deg instead of rad.
    description = given.robot.description
    try:
        angles = [_written_rpy(pose) for pose in description.known_poses]
    except ValueError:
        return  # the angles are expressions, in which a wrong unit is unlikely
    in_degrees = description.angle_unit == 'deg'
    unit, factor = (
        ('radians, not degrees', 1.0) if in_degrees else ('degrees, not radians', math.pi / 180.0)
    )
    poses = np.array(given.poses)
    poses[:, :3, :3] = [rotation_of_roll_pitch_yaw(factor * three) for three in angles]
    turning = np.array([kind != 'prismatic' for kind in given.robot.joint_types])
    q = np.where(turning, given.q * (180.0 / math.pi if in_degrees else factor), given.q)
    yield Hypothesis('degrees', f'rpy of the poses is in {unit}', poses=poses)
    yield Hypothesis('degrees', f'q and rpy of the poses are in {unit}', q, poses=poses)


def _written_rpy(pose: KnownPose) -> Floats:
    if len(pose.motion.texts) != 6:
        raise ValueError('a matrix')
    return np.array([float(text) for text in pose.motion.texts[3:]])


def _ends(given: ComparedData) -> Iterator[_Undone]:
    # Yield two mistakes: a wrong base and a wrong tool. The correct base, or tool, is computed
    # from the first known pose, so at least two different poses are needed to test it.
    A, B = evaluate(given.robot, given.q, depth=kernel.POSE).pose, given.poses
    if not _has_orientations(given.robot) or np.abs(A - A[0]).max() <= TOOL_TOLERANCE:
        return
    X, Y = B[0] @ inverse(A[0]), inverse(A[0]) @ B[0]
    description = given.robot.description
    for end, offset, poses in (
        ('base', X @ description.base.motion.matrix, X @ A),
        ('tool', description.tool.motion.matrix @ Y, A @ Y),
    ):
        numbers = (offset[:3, 3], exact_rpy(offset[:3, :3]))
        xyz, rpy = (', '.join(f'{x + 0.0:.6g}' for x in np.round(three, 9)) for three in numbers)
        yield _Undone(f'the {end} is at xyz [{xyz}] m, rpy [{rpy}] rad', poses, B)


def _numbers(given: ComparedData) -> Iterator[_Undone]:
    # Require two different joint positions, because many wrong numbers can explain a single pose.
    if len(np.unique(given.q, axis=0)) < 2:
        return
    oriented = _has_orientations(given.robot)
    for hypothesis in hypotheses.number_hypotheses_of(given):
        starts = START_ANGLES if hypothesis.unit == 'rad' else START_ANGLES[:1]
        fitted = (_fit_correction(hypothesis.at, given.poses, start, oriented) for start in starts)
        off, value = min(fitted)
        if math.isfinite(off):
            poses = hypothesis.at(np.array([[value]])).pose[0]
            yield _Undone(number_in_words(hypothesis, value), poses, given.poses)


def _fit_correction(
    at: Callable[[Floats], PoseChange], expected: Floats, value: float, oriented: bool
) -> tuple[float, float]:
    # Fit the correction of one number to the expected poses, starting with the correction `value`.
    # Return the norm of the residuals, and the fitted correction. The norm is infinite if a loop
    # does not close.
    off, count = math.inf, 6 if oriented else 3
    try:
        for _ in range(NEWTON_STEPS + 1):
            change = at(np.array([[value]]))
            poses, J = change.pose[0], change.jacobian[0, :, :count, 0]
            turns = rotation_vector(expected[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2))
            residuals = np.concatenate([(expected - poses)[:, :3, 3], turns], axis=1)[:, :count]
            off, best, squares = float(np.linalg.norm(residuals)), value, float(np.sum(J**2))
            if not squares:
                break
            value += float(np.sum(J * residuals)) / squares
        return off, best
    except LoopError:
        return math.inf, value
