# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnose tool poses that a second source measures (for example a tracker), and test them for jumps
of a joint zero.

The jump test starts once the poses fit the robot file. Until then, the newest poses are diagnosed
again and again.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...errors import KinematicsError
from ...estimation.status_text import StatusText
from ...kernel import Floats
from ...node.parameters.settings import ReferenceLimits
from ...rigid_motion import roll_pitch_yaw
from ...robot.measures import Level
from ...robot.robot import Robot
from ..checking.diagnosis import FrameDiagnosis, diagnose_frames
from ..checking.errors import PoseLimit
from ..checking.judgement import FrameLimits
from ..checking.other_robots import OtherRobot, left_by, other_robot
from .collecting import CollectedPoses
from .zero_jump import RECENT, JumpDetector, Watched

# Number of poses with which the first diagnosis is made, and number of new poses after which the
# poses are diagnosed again.
MIN_NEW = 20
# If a joint zero jumped, a diagnosis over poses before and after the jump may wrongly name one of
# the causes in this list. If a jump is detected, the status reports the jump instead.
LOOKS_OF_A_JUMP = ('joint_offset', 'link_length', 'link_twist', 'time_lag')
# Advice to the user if the measured poses are far from the poses of the robot file, and no mistake
# explains the difference.
ADVICE = 'calibrate-live collects poses for a robot file of this very arm'
# Recorded motion of the joints: a list of stamps (ns) with the joint positions (n,) at each stamp.
Path = list[tuple[int, Floats]]


@dataclass(frozen=True)
class Examined:
    """
    The diagnosis of the poses of a second source, and the result of the test whether a joint zero,
    base, tool or lag jumped.

    Attributes
    ----------
    unseen
        Number of poses that arrived since the last diagnosis.
    newest
        The newest poses of the second source.
    diagnosis
        The last diagnosis of poses without a jump; or a sentence that says why no diagnosis was
        possible.
    since_jump
        The last diagnosis of poses after a jump; or a sentence that says why no diagnosis was
        possible. Empty without a jump.
    detector, watched
        The test for jumps and its result; None if the first poses do not fit the robot file.
    other
        The bundled robot that explains the poses, if the configured robot does not; else None.
    """

    unseen: int
    newest: CollectedPoses
    diagnosis: FrameDiagnosis | str
    since_jump: FrameDiagnosis | str = ''
    detector: JumpDetector | None = None
    watched: Watched | None = None
    other: OtherRobot | None = None


def examined(
    robot: Robot, limits: ReferenceLimits, before: Examined | None, new: CollectedPoses, path: Path
) -> Examined:
    """
    Update the diagnosis and the jump test with new poses, and return both. `path` is the recorded
    motion of the joints.
    """
    if before is None:
        return restarted(robot, limits, None, new, path)
    watched = before.detector.observe(new) if before.detector else None
    newest = watched.recent if watched else before.newest.followed_by(new).at(slice(-RECENT, None))
    now = replace(before, newest=newest, unseen=before.unseen + len(new.stamps), watched=watched)
    if watched and not watched.jump:
        now = replace(now, since_jump='')
    if min(now.unseen, len(newest.stamps)) < MIN_NEW:
        return now
    if watched and watched.jump:
        return replace(now, unseen=0, since_jump=diagnosed(robot, newest, path))
    errors = left_by(robot, newest.q, newest.poses)
    fits = errors is not None and judge_of(limits).of(errors) == Level.OK
    if fits and frames_status(now, limits).level == Level.OK:
        return now
    return restarted(robot, limits, now, newest, path)


def restarted(
    robot: Robot,
    limits: ReferenceLimits,
    before: Examined | None,
    newest: CollectedPoses,
    path: Path,
) -> Examined:
    """
    Diagnose the newest poses alone, and continue or start a jump test. A running jump test goes on
    if the new diagnosis has the same status level (OK or WARN) as the previous one. Otherwise a
    new jump test starts, if the poses fit the robot file.
    """
    recent, judge = newest.at(slice(-RECENT, None)), judge_of(limits)
    diagnosis = diagnosed(robot, recent, path)
    if isinstance(diagnosis, str) or robot.chain.loops:
        return Examined(0, recent, diagnosis)
    level = judge.level(diagnosis)
    given = robot, diagnosis.errors, recent.q, recent.poses, judge.warn
    other = None if level == Level.OK else other_robot(*given)
    if diagnosis.cause is not None or other:
        return Examined(0, recent, diagnosis, other=other)
    last = before.diagnosis if before and before.detector else ''
    if before and not isinstance(last, str) and judge.level(last) == level != Level.ERROR:
        return replace(before, unseen=0, diagnosis=diagnosis)
    detector = JumpDetector(robot, newest.at(slice(MIN_NEW)))
    errors = left_by(robot, detector.begun_with.q, detector.begun_with.poses)
    if errors is None or not errors.within(judge.explained):
        return Examined(0, recent, diagnosis)
    watched = detector.observe(newest.at(slice(MIN_NEW, None)))
    return Examined(0, newest, diagnosis, detector=detector, watched=watched)


def diagnosed(robot: Robot, poses: CollectedPoses, path: Path) -> FrameDiagnosis | str:
    """
    Return the diagnosis of poses, or a sentence that says why no diagnosis is possible; `path` is
    the recorded motion of the joints.
    """
    stamps = np.array(poses.stamps)
    rising = np.argsort(stamps, kind='stable')
    stamps = stamps[rising]
    times = np.array([state[0] for state in path])
    motion = (times - stamps[0]) * 1e-9, np.array([state[1] for state in path])
    seconds, known = (stamps - stamps[0]) * 1e-9, motion if len(path) > 1 else None
    q, T = poses.q[rising], poses.poses[rising]
    try:
        return diagnose_frames(robot, q, T, seconds, motion=known)
    except KinematicsError as error:
        return str(error)


def judge_of(limits: ReferenceLimits) -> FrameLimits:
    """
    Convert the limits of position and angle in the node's settings to limits of the frame check.
    """
    return FrameLimits(
        PoseLimit(limits.position_warn, limits.angle_warn),
        PoseLimit(limits.position_stop, limits.angle_stop),
    )


def frames_status(known: Examined, limits: ReferenceLimits) -> StatusText:
    """
    Return the status of the second source, an instrument that measures tool poses.

    The status has the errors between measured poses and poses computed from the robot file. It
    also says if a jump was detected.
    """
    judge, watched, diagnosis = judge_of(limits), known.watched, known.diagnosis
    jump = watched.jump if watched else None
    cause = None if isinstance(known.since_jump, str) else known.since_jump.cause
    if jump and cause and cause.key not in LOOKS_OF_A_JUMP:
        jump, diagnosis = None, known.since_jump
    if isinstance(diagnosis, str):
        return StatusText(Level.WARN, diagnosis, ())
    level, sentence = judge.level(diagnosis), judge.sentence(diagnosis)
    if known.other and diagnosis is known.diagnosis:
        level, sentence = Level.ERROR, f'{sentence}; {known.other.in_words()}'
    elif level != Level.OK and diagnosis.cause is None:
        sentence = f'{sentence}: {ADVICE}'
    values = [
        ('poses', str(diagnosis.count)),
        ('position error as given, rms (m)', f'{diagnosis.as_given.position_rms:.6g}'),
        ('position error, rms (m)', f'{diagnosis.errors.position_rms:.6g}'),
        ('position error, worst (m)', f'{diagnosis.errors.position_max:.6g}'),
        ('rotation error, rms (rad)', f'{diagnosis.errors.rotation_rms:.6g}'),
        ('rotation error, worst (rad)', f'{diagnosis.errors.rotation_max:.6g}'),
        *_offset('base', diagnosis.base_offset),
        *_offset('tool', diagnosis.tool_offset),
        ('undetermined', '; '.join(diagnosis.undetermined)),
        ('cause', diagnosis.cause.key if diagnosis.cause else ''),
        ('warning from (rms)', judge.warn.in_words()),
        ('error from (rms)', judge.bad.in_words()),
        ('likely, not decisive', diagnosis.likely[0].sentence if diagnosis.likely else ''),
    ]
    if watched:
        values += watched.values()
        if jump:
            far = jump.position > limits.position_stop or jump.angle > limits.angle_stop
            level, sentence = Level.ERROR if far else Level.WARN, jump.sentence
        elif diagnosis.cause is None and (watched.fails or level == Level.OK):
            sentence += f'; {watched.sentence()}'
            level = max(level, Level.WARN if watched.fails else Level.OK)
    return StatusText(level, sentence, tuple(values))


def _offset(name: str, T: Floats) -> tuple[tuple[str, str], tuple[str, str]]:
    xyz, rpy = T[:3, 3], roll_pitch_yaw(T[:3, :3])
    return (
        (f'{name} offset xyz (m)', ' '.join(f'{value:.6g}' for value in xyz)),
        (f'{name} offset rpy (rad)', ' '.join(f'{value:.6g}' for value in rpy)),
    )
