"""
Compare poses of a second source with those of the node: a frame check, then a test for jumps.

Once poses fit the robot file, each new one is tested for a jump of a joint's zero, of base, tool
or lag (`diagnosis/calibration/zero_jump.py`). While they do not fit, the newest are diagnosed.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from ...errors import KinematicsError, RefusedTargetError, WireError
from ...estimation.estimator import EstimatorOutput
from ...estimation.status_text import StatusText
from ...kernel import Floats
from ...rigid_motion import roll_pitch_yaw
from ...robot.measures import Level
from ...robot.robot import Robot
from ..messages.message_check import read_message
from ..messages.messages import stamp_of
from ..messages.target_messages import pose_of
from ..messages.topics import REFERENCE_POSE, TARGET_POSE_QOS, overridable
from ..parameters.settings import ReferenceLimits

if TYPE_CHECKING:
    from ...diagnosis.calibration.collecting import CollectedPoses, PoseCollector
    from ...diagnosis.calibration.zero_jump import JumpDetector, Watched
    from ...diagnosis.frame_check.diagnosis import FrameDiagnosis
    from ...diagnosis.frame_check.judgement import FrameLimits
    from ...diagnosis.frame_check.other_robots import FirstLook

# Poses kept in step with the joints, at most.
MOST = 256
# The joints' path is kept in steps of this (ns), and this number of them, to find a lag.
WAY_STEP, WAY = 10_000_000, 6_000
# Poses of the first diagnosis, and new ones before the next while something is wrong.
FIRST = 20
# The newest poses, which a diagnosis is made of.
NEWEST = 64
# So many tell whether this is the robot of the file.
FIRST_LOOK = 10
# A jump makes poses look wrong in one of these ways, too: then the jump is reported.
LOOKS_OF_A_JUMP = ('joint_offset', 'link_length', 'link_twist', 'time_lag')

# What helps where poses remain far off and no mistake explains it.
ADVICE = 'calibrate --live collects poses for a robot file of this very arm'


class Reference:
    """
    Collects poses of a second source with the joint positions at their stamps, and compares them.

    Both must have the same clock. The work has a thread of its own: it takes 20 ms for a diagnosis
    and 0.5 ms for a new pose.
    The first few poses are compared as they are, and the log says whether they are of this robot.

    Parameters
    ----------
    node
        The node it belongs to.
    robot, limits
        Return the arm and the limits in force.

    Attributes
    ----------
    is_there
        Whether poses have arrived, so that states must be noted.
    """

    def __init__(
        self,
        node: Node,
        robot: Callable[[], Robot],
        limits: Callable[[], ReferenceLimits],
    ) -> None:
        self.is_there = False
        self._node, self._robot, self._limits = node, robot, limits
        self._poses: PoseCollector | None = None
        self._way: deque[tuple[int, Floats]] = deque(maxlen=WAY)
        self._is_looked_at = False
        self._refused = ''
        self._thread: threading.Thread | None = None
        self._examined: Examined | None = None
        self._first_look: FirstLook | None = None
        self._subscription = node.create_subscription(
            PoseStamped,
            REFERENCE_POSE,
            self._on_pose,
            raw=True,
            **overridable(TARGET_POSE_QOS),
        )

    @property
    def topic_name(self) -> str:
        """Return the full name of the topic."""
        return str(self._subscription.topic_name)

    def forget(self) -> None:
        """Start again: the stamps or the arm have changed."""
        self._examined = self._first_look = None
        self.is_there = False
        self._way.clear()
        self._poses, self._is_looked_at = None, False
        self._thread = None  # what it finds is about the time before

    def _on_pose(self, data: bytes) -> None:
        try:
            message = read_message(data, PoseStamped)
            stamp, pose = stamp_of(message), pose_of(message)
        except (RefusedTargetError, WireError) as error:
            self._refused = str(error)
            return
        self.is_there = True
        if self._poses is None:
            # Imported if there is a second source: most nodes have none.
            from ...diagnosis.calibration.collecting import PoseCollector

            self._poses = PoseCollector(self._robot(), MOST)
        self._poses.note_pose(stamp, pose)

    def note(self, answer: EstimatorOutput) -> None:
        """Take a new state of the arm; a pose is compared once states around it are known."""
        if self._poses is None:
            return
        self._poses.note_state(answer.stamp, answer.state.q)
        if not self._way or answer.stamp - self._way[-1][0] >= WAY_STEP:
            self._way.append((answer.stamp, answer.state.q))
        if self._poses.different >= FIRST_LOOK and not self._is_looked_at:
            self._is_looked_at = True
            self._begin(self._look, self._robot(), self._limits(), self._poses.collected())
        if self._first_look is not None:
            level, sentence = self._first_look
            self._first_look = None
            log = self._node.get_logger()
            say = log.info if level == Level.OK else log.warning
            say(f'poses of {self.topic_name}: {sentence}')

    def _begin(self, work: Callable[..., None], *arguments: object) -> None:
        self._thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._thread.start()

    def status_text(self) -> StatusText | None:
        """Return the status of the frames, None if there is no second source."""
        busy = self._thread is not None and self._thread.is_alive()
        count = 0 if self._poses is None else self._poses.different
        if self._poses is not None and count > FIRST and not busy:
            new = self._poses.taken()
            if new.stamps:
                before, way = self._examined, list(self._way)
                self._begin(self._examine, self._robot(), self._limits(), before, new, way)
        if self._examined is not None:
            # Judged each time: the limits may have changed.
            return frames_status(self._examined, self._limits())
        if self._refused:
            return StatusText(
                Level.WARN, f'pose of {self.topic_name} refused: {self._refused}', ()
            )
        if self.is_there:
            return StatusText(Level.OK, f'{count} of {FIRST} different poses collected', ())
        return None

    def _look(self, robot: Robot, limits: ReferenceLimits, poses: 'CollectedPoses') -> None:
        # Imported if there is a second source: most nodes have none.
        from ...diagnosis.frame_check.errors import PoseLimit
        from ...diagnosis.frame_check.other_robots import first_look

        limit = PoseLimit(limits.position_warn, limits.angle_warn)
        found = first_look(robot, poses.q, poses.poses, limit)
        if threading.current_thread() is self._thread:
            self._first_look = found

    def _examine(
        self,
        robot: Robot,
        limits: ReferenceLimits,
        before: 'Examined | None',
        new: 'CollectedPoses',
        way: list[tuple[int, Floats]],
    ) -> None:
        found = examined(robot, limits, before, new, way)
        if threading.current_thread() is self._thread:
            self._examined = found


@dataclass(frozen=True)
class Examined:
    """
    The diagnosis of a second source and its test for jumps.

    Attributes
    ----------
    unseen
        Number of poses since the last diagnosis.
    newest
        The newest poses.
    diagnosis
        The last one while nothing had jumped; a sentence if there is none.
    since_jump
        The last one of the poses since a jump.
    detector, watched
        The test for jumps and its result; None as long as a cause is named.
    """

    unseen: int
    newest: 'CollectedPoses'
    diagnosis: 'FrameDiagnosis | str'
    since_jump: 'FrameDiagnosis | str' = ''
    detector: 'JumpDetector | None' = None
    watched: 'Watched | None' = None


def examined(
    robot: Robot,
    limits: ReferenceLimits,
    before: Examined | None,
    new: 'CollectedPoses',
    way: list[tuple[int, Floats]],
) -> Examined:
    """Return what new poses add to what was known before."""
    if before is None:
        return restarted(robot, limits, None, new, way)
    watched = before.detector.observe(new) if before.detector else None
    newest = watched.recent if watched else before.newest.followed_by(new).at(slice(-NEWEST, None))
    now = replace(before, newest=newest, unseen=before.unseen + len(new.stamps), watched=watched)
    if watched and not watched.jump:
        now = replace(now, since_jump='')
    if min(now.unseen, len(newest.stamps)) < FIRST:
        return now
    if watched and watched.jump:
        return replace(now, unseen=0, since_jump=diagnosed(robot, newest, way))
    # Imported if there is a second source: most nodes have none.
    from ...diagnosis.frame_check.other_robots import left_by

    left = left_by(robot, newest.q, newest.poses)
    fits = left is not None and judge_of(limits).of(left) == Level.OK
    if fits and frames_status(now, limits).level == Level.OK:
        return now
    return restarted(robot, limits, now, newest, way)


def restarted(
    robot: Robot,
    limits: ReferenceLimits,
    before: Examined | None,
    newest: 'CollectedPoses',
    way: list[tuple[int, Floats]],
) -> Examined:
    """Return what the newest poses say alone; a test goes on if it has the same level before."""
    # Imported if there is a second source: most nodes have none.
    from ...diagnosis.calibration.zero_jump import JumpDetector

    found = diagnosed(robot, newest.at(slice(-NEWEST, None)), way)
    if isinstance(found, str) or found.cause is not None or robot.chain.loops:
        return Examined(0, newest.at(slice(-NEWEST, None)), found)
    if before and before.detector and not isinstance(before.diagnosis, str):
        one, other = (judge_of(limits).level(x) for x in (before.diagnosis, found))
        if one == other != Level.ERROR:
            return replace(before, unseen=0, diagnosis=found)
    detector = JumpDetector(robot, newest.at(slice(FIRST)))
    watched = detector.observe(newest.at(slice(FIRST, None)))
    return Examined(0, newest, found, detector=detector, watched=watched)


def diagnosed(
    robot: Robot, poses: 'CollectedPoses', way: list[tuple[int, Floats]]
) -> 'FrameDiagnosis | str':
    """Return the diagnosis of poses, or why there is none; `way` are joint positions at stamps."""
    # Imported if there is a second source: most nodes have none.
    from ...diagnosis.frame_check.diagnosis import diagnose_frames

    stamps = np.array(poses.stamps)
    rising = np.argsort(stamps, kind='stable')
    stamps = stamps[rising]
    times = np.array([state[0] for state in way])
    motion = (times - stamps[0]) * 1e-9, np.array([state[1] for state in way])
    try:
        return diagnose_frames(
            robot,
            poses.q[rising],
            poses.poses[rising],
            (stamps - stamps[0]) * 1e-9,
            motion=motion if len(way) > 1 else None,
        )
    except KinematicsError as error:
        return str(error)


def judge_of(limits: ReferenceLimits) -> 'FrameLimits':
    """Return the limits as the frame check has them."""
    from ...diagnosis.frame_check.errors import PoseLimit
    from ...diagnosis.frame_check.judgement import FrameLimits

    return FrameLimits(
        PoseLimit(limits.position_warn, limits.angle_warn),
        PoseLimit(limits.position_stop, limits.angle_stop),
    )


def frames_status(known: Examined, limits: ReferenceLimits) -> StatusText:
    """Return how far the robot file is from what was heard, and what has jumped since."""
    judge, watched, found = judge_of(limits), known.watched, known.diagnosis
    jump = watched.jump if watched else None
    cause = None if isinstance(known.since_jump, str) else known.since_jump.cause
    if jump and cause and cause.key not in LOOKS_OF_A_JUMP:
        jump, found = None, known.since_jump
    if isinstance(found, str):
        return StatusText(Level.WARN, found, ())
    level, sentence = judge.level(found), judge.sentence(found)
    if level != Level.OK and found.cause is None:
        sentence = f'{sentence}: {ADVICE}'
    values = [
        ('poses', str(found.count)),
        ('position error as given, rms (m)', f'{found.as_given.position_rms:.6g}'),
        ('position error, rms (m)', f'{found.errors.position_rms:.6g}'),
        ('position error, worst (m)', f'{found.errors.position_max:.6g}'),
        ('rotation error, rms (rad)', f'{found.errors.rotation_rms:.6g}'),
        ('rotation error, worst (rad)', f'{found.errors.rotation_max:.6g}'),
        *_offset('base', found.base_offset),
        *_offset('tool', found.tool_offset),
        ('undetermined', '; '.join(found.undetermined)),
        ('cause', found.cause.key if found.cause else ''),
        ('warning from (rms)', judge.warn.in_words()),
        ('error from (rms)', judge.bad.in_words()),
        ('likely, not decisive', found.likely[0].sentence if found.likely else ''),
    ]
    if watched:
        values += watched.values()
        if jump:
            far = jump.position > limits.position_stop or jump.angle > limits.angle_stop
            level, sentence = Level.ERROR if far else Level.WARN, jump.sentence
        elif found.cause is None and (watched.fails or level == Level.OK):
            sentence += f'; {watched.sentence()}'
            level = max(level, Level.WARN if watched.fails else Level.OK)
    return StatusText(level, sentence, tuple(values))


def _offset(name: str, T: Floats) -> tuple[tuple[str, str], tuple[str, str]]:
    xyz, rpy = T[:3, 3], roll_pitch_yaw(T[:3, :3])
    return (
        (f'{name} offset xyz (m)', ' '.join(f'{value:.6g}' for value in xyz)),
        (f'{name} offset rpy (rad)', ' '.join(f'{value:.6g}' for value in rpy)),
    )
