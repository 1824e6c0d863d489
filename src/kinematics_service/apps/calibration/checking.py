# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Check measured poses against the arm before the fit, and raise an error that names a mistake."""

import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError, FramesError, KinematicsError
from ...kernel import Floats, Integers
from ...kinematics.arguments import numbers_of
from ...kinematics.forward import forward_kinematics
from ...robot.file.parts.description import RobotDescription
from ...robot.file.parts.parameters import ArmParameter
from ...robot.robot import Robot
from ...typography import counted
from ..checking import hypotheses
from ..checking.diagnosis import (
    CAUSE_POSES,
    MIN_POSES,
    FrameDiagnosis,
    check_rotations,
    diagnose_frames,
)
from ..checking.errors import angle_in_words, length_in_words
from ..recordings.readers.source import MAX_POSES
from .placing import Free, Offsets, offsets_of, shared_offsets

# Two joint positions, tool positions or rotations are taken as equal if they differ by less than
# this (rad, m).
MIN_CHANGE = 1e-3
# Largest median position residual (m) of the nominal table after base and tool are fitted. If it
# is larger, a mistake of the input is assumed.
MAX_ERROR = 0.02
# The frame check leaves out poses whose residual is above 5 times the median residual.
OUTLIER_MEDIANS = 5.0
# A calibration has a remark if the correction of a parameter is above 4 times the prior standard
# deviation of the parameter, or if the error of the board's size is above 4 times the standard
# deviation of this error.
REMARKED_DEVIATIONS = 4.0
# An error message names a mistake of the input if correcting it makes the median residual 3 times
# smaller, or more.
NAMED_RATIO = 3.0
# Two mistakes are rivals if the median residuals after their correction differ by less than a
# factor of 2. If mistakes are rivals, none of them is reported as certain.
RIVAL_RATIO = 2.0
# Largest number of poses that are computed at once. H hypotheses on N measurements need H * N
# computed poses. 20,000 poses take about 20 MB of memory.
ROWS_AT_ONCE = 20_000
# A sentence in a report or an error message lists at most this number of names.
NAMES_IN_SENTENCE = 8
# Two poses, or two screws, are taken as equal if all differences between their entries are below
# this value (m, rad). A number of an array is taken as zero if its absolute value is below
# ROUND_OFF times the largest number of the array.
ROUND_OFF = 1e-9
# The sentence of an error: the file has positions in metres, but the positions were read as
# millimetres and therefore divided by 1000.
IN_METRES = 'the poses are in metres, not millimetres'
# Maps a mistake of the input to advice: which option or command corrects the mistake. The key is
# the sentence by which an error message names the mistake. The advice ends the error message.
OPTIONS = {
    hypotheses.INVERSE: '. Poses of a board take calibrate-camera, with the right --camera',
    hypotheses.DEGREES: '; add --joint-format deg',
    IN_METRES: '; leave mm out of --pose-format',
    'the poses are in millimetres, not metres': '; add --pose-format mm',
    'the positions are in millimetres, not metres': '; add --pose-format mm,position',
}
# Names that points and sessions may not have. Parameter names such as `base2.x` or `compliance.j1`
# begin with these words, so a point or session of this name would make parameter names ambiguous.
TAKEN = re.compile(r'(base|tool)\d*|compliance')
# Names of three groups of parameters: drifts of the instrument's pose between sessions, drifts of
# the joint zeros between sessions, and compliance of the joints under load.
PLACEMENT, ZEROS, COMPLIANCE = 'placement', 'zeros', 'compliance'
# Parameters that are not in a table: the delay of the joint states, and the backlash of the
# joints. Each joint stops half the backlash before its measured position.
LAG = ArmParameter('lag', 'lag', False)
BACKLASH = ArmParameter('backlash', 'backlash', True)
# If the frame check finds one of these causes, the calibration goes on. Each cause is a wrong
# number of the robot file, and the fit corrects this number.
FOUND_HERE = ('joint_offset', 'link_length', 'link_twist')
# Keys of mistakes in which numbers have a wrong unit: angles in degrees instead of radians, or
# lengths in millimetres instead of metres. Their errors have the code `wrong-unit`.
UNIT_KEYS = ('degrees', 'millimetres')


class Measured(NamedTuple):
    """
    N measurements of a calibration. Each has joint positions, a pose, a set and a session.

    All measurements of one set have the same instrument frame and the same point on the tool, so
    each set may have offsets of its own. Sessions are times of measurement, between which the
    instrument and the joint zeros may have drifted.

    Attributes
    ----------
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4)
        Measured poses; the rotation is the identity if only positions were measured.
    positions
        Whether only positions were measured.
    sets : shape (N,)
        The set of each measurement, as a number from 0.
    rates : shape (N, n, K)
        Derivatives of the joint positions by the K parameters in `moving`. For example, the
        derivative by a lag is the joint velocity.
    moving
        Parameters that correct the joint positions, for example a lag. With the values x (K,) of
        the parameters, the corrected joint positions are q + rates @ x.
    sessions : shape (N,)
        The session of each measurement, as a number from 0.
    placements
        Parameters of the pose of the instrument, six for each session but the first.
    priors
        Prior standard deviations of `placements` and `moving`, by name.
    remarks
        Remarks on the measurements, as sentences.
    from_tool
        Whether the inverses of `poses` were measured, for example by a camera on the tool that
        sees a fixed board. If so, residuals and noise belong to the inverse poses.
    whitening : shape (N, 3, 3) or (N, 6, 6)
        Matrices by which the fit multiplies the residuals of positions, or of positions and
        rotations. The products have equal noise along all axes and in all measurements. None: the
        residuals already have equal noise.
    """

    q: Floats
    poses: Floats
    positions: bool
    sets: Integers
    rates: Floats
    moving: tuple[ArmParameter, ...]
    sessions: Integers
    placements: tuple[ArmParameter, ...] = ()
    priors: Mapping[str, float] = MappingProxyType({})
    remarks: tuple[str, ...] = ()
    from_tool: bool = False
    whitening: Floats | None = None

    @classmethod
    def of(
        cls, q: Floats, poses: Floats, positions: bool, sets: Integers, qdot: Floats | None = None
    ) -> 'Measured':
        """
        Return measurements that are all of one session.

        If the joint velocities `qdot` (N, n) are given, a parameter `lag` is added: the delay (s)
        between joint positions and poses. It changes the joint positions by `lag * qdot`.
        """
        rates = np.zeros((*q.shape, 0)) if qdot is None else qdot[:, :, None]
        moving = () if qdot is None else (LAG,)
        return cls(q, poses, positions, sets, rates, moving, 0 * sets)

    @property
    def set_count(self) -> int:
        """
        Return the number of sets of measured poses.

        All poses of a set were measured in the same frame and at the same point of the tool.
        """
        return int(np.max(self.sets)) + 1

    def of_set(self, k: int) -> 'Measured':
        """
        Return a copy whose `q` and `poses` have only the measurements of set k. Use only these two
        fields: the other fields still have the measurements of all sets.
        """
        rows = self.sets == k
        return self._replace(q=self.q[rows], poses=self.poses[rows])


def refuse_loops(description: RobotDescription) -> None:
    """
    Raise an error for an arm with closed loops, which cannot be calibrated.

    Raises
    ------
    KinematicsError
        The arm has closed loops.
    """
    if description.loops:
        names = ', '.join(repr(loop.name) for loop in description.loops)
        message = f'{description.name} has closed loops ({names}); calibration needs an open arm'
        raise KinematicsError(message, code='closed-loop')


def measured(
    robot: Robot,
    q: npt.ArrayLike,
    poses: npt.ArrayLike,
    sets: npt.ArrayLike | None,
    qdot: npt.ArrayLike | None = None,
) -> Measured:
    """
    Check joint positions and measured poses, and return them as the input of a calibration.

    Parameters
    ----------
    q, poses, sets
        Joint positions (N, n), rad or m; measured poses (N, 4, 4), or positions (N, 3), m; and the
        set of each pose, as a number from 0 (None: one set).
    qdot : shape (N, n), rad/s or m/s
        Joint velocities. If they are given, a lag is fitted.

    Raises
    ------
    CalibrationError
        Shapes do not fit, a number is not finite, there are too few poses, all poses are alike, or
        an orientation is not a rotation.
    """
    at, given = finite_rows('q', q, robot.dof), numbers_of('poses', poses)
    count = len(at)
    if given.shape not in ((count, 4, 4), (count, 3)):
        message = f'poses must have the shape ({count}, 4, 4) or ({count}, 3), not {given.shape}'
        raise CalibrationError(message, code='wrong-shape')
    positions = given.ndim == 2
    T = rigid_positions(given if positions else given[:, :3, 3])
    if not positions:
        T[:, :3, :3] = given[:, :3, :3]
    if not np.all(np.isfinite(T)):
        raise CalibrationError('poses: must be finite numbers', code='not-finite')
    rates = None if qdot is None else finite_rows('qdot', qdot, robot.dof, count)
    marks = np.zeros(count) if sets is None else numbers_of('sets', sets)
    if marks.shape != (count,) or np.any(np.unique(marks, return_inverse=True)[1] != marks):
        message = f'sets must be {count} whole numbers from 0 on, none left out'
        raise CalibrationError(message, code='out-of-range')
    result = Measured.of(at, T, positions, marks.astype(np.int64), rates)
    for k in range(result.set_count if count else 1):
        rows = result.of_set(k)
        check_enough(rows.q, f'{robot.dof + 4} or more')
        try:
            check_rotations(rows.poses[:, :3, :3])
        except FramesError as error:
            raise CalibrationError(str(error), code=error.code) from None
    return result


def finite_rows(name: str, given: npt.ArrayLike, columns: int, count: int | None = None) -> Floats:
    """
    Return an argument as an array of finite numbers, shape (count, columns).

    Raises
    ------
    CalibrationError
        The argument has another shape, or a number is not finite.
    """
    array = numbers_of(name, given)
    if array.ndim != 2 or array.shape != (len(array) if count is None else count, columns):
        message = f'{name} must have the shape ({count or "N"}, {columns}), not {array.shape}'
        raise CalibrationError(message, code='wrong-shape')
    if not np.all(np.isfinite(array)):
        raise CalibrationError(f'{name}: must be finite numbers', code='not-finite')
    return array


def rigid_positions(points: Floats) -> Floats:
    """Return poses (N, 4, 4) with the positions `points` (N, 3) and no rotation."""
    T = np.tile(np.eye(4), (len(points), 1, 1))
    T[:, :3, 3] = points
    return T


def check_mark(kind: str, name: str) -> None:
    """
    Raise an error if the name of a point or session cannot be the first part of parameter names.

    Raises
    ------
    CalibrationError
        The name is empty or not printable, or it is a word with which the names of other
        parameters begin, such as `base` or `compliance`.
    """
    if TAKEN.fullmatch(name) or not name or not name.isprintable():
        raise CalibrationError(
            f'{kind} {name!r}: names of parameters begin with this, or it is not printable; '
            'write another name',
            code='reserved-name',
        )


def position_numbers(q: Floats) -> Integers:
    """
    Number the different joint positions in q (N, n) from 0; return the number of each row, (N,).

    Rows with equal joint positions have the same number. Joint positions are taken as equal if
    they differ by less than MIN_CHANGE.
    """
    numbers, different = np.full(len(q), -1), 0
    while np.any(unnumbered := numbers < 0):
        first = q[int(np.argmax(unnumbered))]
        numbers[unnumbered & (np.max(np.abs(q - first), axis=1) < MIN_CHANGE)] = different
        different += 1
    return numbers


def check_known(argument: str, name: str, known: Sequence[str]) -> None:
    """Raise a CalibrationError if `name` is not one of the known values of an argument."""
    if not isinstance(name, str) or name not in known:
        message = f'{argument}: {name!r} is not one of {", ".join(known)}'
        raise CalibrationError(message, code='unknown-name')


def check_enough(q: Floats, usual: str, where: str = '', least: int = MIN_POSES) -> None:
    """
    Raise an error if there are too few joint positions q (N, n), rad or m, or too few different
    ones.

    Parameters
    ----------
    usual, where
        `usual` is a text with the usual number of poses; `where` is the beginning of the error
        message.
    least
        Least number of different joint positions.

    Raises
    ------
    CalibrationError
        There are fewer than three, all are equal, or fewer than `least` are different.
    """
    poses = f'{where}{counted(len(q), "pose")}'
    if len(q) < MIN_POSES:
        raise CalibrationError(
            f'{poses}: at least {MIN_POSES} are needed, and some {usual} identify most of an arm',
            code='too-few',
        )
    different = int(np.max(position_numbers(q))) + 1
    if different == 1:
        moved = float(np.max(np.ptp(q, axis=0)))
        raise CalibrationError(
            f'{poses} are all alike (no joint moves by more than {moved:.2g} rad or m): '
            'nothing of the arm is identifiable from them; take poses far apart',
            code='no-variation',
        )
    if different < least:
        raise CalibrationError(
            f'{poses} are {different} different ones, repeated; take at least {least} different '
            'ones, far apart',
            code='too-few',
        )


def checked_offsets(
    robot: Robot, given: Measured, free: Free, per_set: Free, check: bool, read: str = ''
) -> tuple[list[Offsets], FrameDiagnosis | None]:
    """
    Return the offsets of base and tool from which the fit of each set starts, and the result of
    the frame check. The result is that of the first set with enough poses for a frame check; None
    if no set was checked.

    Parameters
    ----------
    free
        Whether base and tool may differ from the file.
    per_set
        Two flags: whether each set has its own base, and whether each set has its own tool.
    check
        Whether to run the frame check.
    read
        How the orientations were read: a kind of `--pose-format`, such as `rpy`; empty if unknown.

    Raises
    ------
    CalibrationError
        The poses have a mistake that a calibration cannot correct; the message names the mistake.
    """
    sets = [given.of_set(k) for k in range(given.set_count)]
    A, B = [forward_kinematics(robot, rows.q) for rows in sets], [rows.poses for rows in sets]
    offsets = [offsets_of(a, b, given.positions, free) for a, b in zip(A, B)]
    diagnoses = [_checked(robot, rows, at, free, read) for rows, at in zip(sets, offsets) if check]
    diagnosis = next((result for result in diagnoses if result is not None), None)
    return shared_offsets(A, B, offsets, given.positions, free, per_set), diagnosis


def _checked(
    robot: Robot, given: Measured, offsets: Offsets, free: Free, read: str
) -> FrameDiagnosis | None:
    q, poses, positions = given.q, given.poses, given.positions
    middle = float(np.median(offsets.remainder))
    if positions and len(q) >= CAUSE_POSES:
        # Test for mistakes only if at least CAUSE_POSES positions were measured. Offsets of the
        # base and of the measured point alone can fit any three positions.
        _check_positions(robot, q, poses, middle, free)
    near = np.flatnonzero(offsets.remainder <= OUTLIER_MEDIANS * middle + MIN_CHANGE)
    near = near[np.unique(np.linspace(0, len(near) - 1, MAX_POSES).astype(int))]
    diagnosis = None
    if not positions and len(near) >= CAUSE_POSES:
        diagnosis = diagnose_frames(robot, q[near], poses[near], read=read)
        cause = diagnosis.cause
        residual = middle if cause is None else cause.errors.position_rms
        if min(residual, middle) > MAX_ERROR:
            # With orientations, the frame check finds no mistake that explains the errors. So
            # leave out the orientations, and test the mistakes that positions alone can show.
            alone = offsets_of(forward_kinematics(robot, q), poses, True, free)
            _check_positions(robot, q, poses, float(np.median(alone.remainder)), free)
        if cause is not None and cause.key not in FOUND_HERE:
            sentence, option = diagnosis.sentence, OPTIONS.get(cause.sentence, '')
            if cause.sentence == hypotheses.LENGTHS_IN_MM and _is_in_metres(robot):
                sentence = sentence.replace(sentence.partition(':')[0], IN_METRES.capitalize())
                option = OPTIONS[IN_METRES]
            raise CalibrationError(
                f'the frame check finds a mistake: {sentence}{option}',
                code='wrong-unit' if cause.key in UNIT_KEYS else cause.key.replace('_', '-'),
            )
    if middle <= MAX_ERROR:
        return diagnosis

    def lengths_of(joints: Floats) -> Floats:
        A = forward_kinematics(robot, joints)
        return offsets_of(A, np.broadcast_to(poses, A.shape), True, free).remainder

    explained = explained_by_joints(robot, q, middle, lengths_of) if positions else ''
    kept = ' and '.join(end for end, fitted in free._asdict().items() if not fitted)
    ends = f'{kept} as in the robot file' if kept else 'base and tool fitted'
    hint = f'no robot {robot.name} is off by that much; it is another robot, or the poses do not '
    hint += 'belong to these joint positions'
    if kept:
        hint = f'fit {kept} too, unless the poses are in the very frames of that file; then it is '
        hint += 'another robot'
    raise CalibrationError(
        f'half of the positions are more than {length_in_words(middle)} off, with {ends}: {hint}'
        f'{explained}',
        code='another-robot',
    )


def explained_by_joints(
    robot: Robot, q: Floats, middle: float, lengths_of: Callable[[Floats], Floats]
) -> str:
    """
    Return a text that names the mistakes of joint positions (N, n) that would explain large
    position residuals; empty if no mistake does.

    Parameters
    ----------
    middle
        The median length of the position residuals, m.
    lengths_of
        A function that takes H corrected arrays of joint positions (H, N, n), and returns the
        lengths (H, N) of the position residuals, m.
    """
    changes, at_once = (
        list(hypotheses.joint_hypotheses_of(robot, q)),
        max(1, ROWS_AT_ONCE // len(q)),
    )
    blocks = (changes[k : k + at_once] for k in range(0, len(changes), at_once))
    remains = [lengths_of(np.stack([change.joints(q) for change in block])) for block in blocks]
    sizes = np.median(np.concatenate(remains), axis=1).tolist()
    tried = sorted(zip(sizes, (change.sentence for change in changes)))
    best = tried[0][0]
    if best * NAMED_RATIO > middle or best > MAX_ERROR:
        return ''
    near = [trial for trial in tried if trial[0] <= RIVAL_RATIO * best]
    words = '; '.join(
        f'{sentence}: with that undone {length_in_words(size)} remain' for size, sentence in near
    )
    return f'. What explains it: {words}' if len(near) == 1 else f'. Tried, not decided: {words}'


def _is_in_metres(robot: Robot) -> bool:
    # Return whether the lengths of the table are in metres, not millimetres. The length of an arm
    # is about 1 in metres, and about 1000 in millimetres. The limit between metres and millimetres
    # is the geometric mean of 1 and 1000: sqrt(1000) = 32.
    return robot.singularity.task.length**2 < 1000


def _check_positions(robot: Robot, q: Floats, poses: Floats, middle: float, free: Free) -> None:
    axes = 'mirrored axes: one axis of the positions points the wrong way'
    mirrored, large = np.diag([1.0, 1.0, -1.0]), 1000 if _is_in_metres(robot) else 1
    for sentence, code, joints, scale in (
        ('the positions are in millimetres, not metres', 'wrong-unit', q, np.eye(3) / 1000),
        (IN_METRES, 'wrong-unit', q, large * np.eye(3)),
        (axes, 'mirrored', q, mirrored),
        (hypotheses.DEGREES, 'wrong-unit', hypotheses.from_degrees(robot, q), np.eye(3)),
    ):
        others = np.array(poses)
        others[:, :3, 3] = poses[:, :3, 3] @ scale
        offsets = offsets_of(forward_kinematics(robot, joints), others, True, free)
        corrected = float(np.median(offsets.remainder))
        if middle > MIN_CHANGE and corrected < MAX_ERROR:
            refuse_mistake(sentence, code, corrected, middle)


def refuse_mistake(sentence: str, code: str, corrected: float, middle: float) -> None:
    """
    Raise an error if correcting a mistake makes the median residual more than 3 times smaller.

    Parameters
    ----------
    sentence, code
        The mistake of the input as a sentence, and the code of the error.
    corrected
        Median length of the position residuals with the mistake corrected, m.
    middle
        Median length of the position residuals with the input as given, m.

    Raises
    ------
    CalibrationError
        3 * corrected < middle, so the mistake explains the residuals.
    """
    if corrected * NAMED_RATIO < middle:
        raise CalibrationError(
            f'{sentence}: with that undone {length_in_words(corrected)} remain of '
            f'{length_in_words(middle)} (medians){OPTIONS.get(sentence, "")}',
            code=code,
        )


def in_words(position: float, rotation: float, positions: bool) -> str:
    """
    Return a length (m) and an angle (rad) as text. If `positions` is set, return the text of the
    length alone.
    """
    length, angle = map(not_nothing, (length_in_words(position), angle_in_words(rotation)))
    return length if positions else f'{length}, {angle}'


def not_nothing(words: str) -> str:
    """Return the text of a standard deviation or error, with `below 1e-6 mm` instead of `0 mm`."""
    return f'below 1e-6 {words[2:]}' if words.startswith('0 ') else words
