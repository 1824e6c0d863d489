"""
Compare poses of a second source with those of the node: a frame check, then a test for jumps.

Once poses fit the robot file, each new one is tested for a jump of a joint's zero, of base, tool
or lag (`apps/calibration/zero_jump.py`). While they do not fit, the newest are diagnosed.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from ..app_modules import app_module
from ..errors import RefusedTargetError, WireError
from ..estimation.estimator import EstimatorOutput
from ..estimation.status_text import StatusText
from ..kernel import Floats
from ..robot.measures import Level
from ..robot.robot import Robot
from .messages.message_check import read_message
from .messages.messages import stamp_of
from .messages.target_messages import pose_of
from .messages.topics import REFERENCE_POSE, TARGET_POSE_QOS, overridable
from .parameters.settings import ReferenceLimits
from .steady_time import Throttle

WITHOUT_APP = (
    'the app calibration, which compares poses, was removed; record both, and run '
    '`kinematics_service audit`'
)
# Poses kept in step with the joints, at most.
MOST = 256
# The joints' path is kept in steps of this (ns), and this number of them, to find a lag.
WAY_STEP, WAY = 10_000_000, 6_000
# The status is WARN if no pose arrived, or none was used, for this time, s.
PATIENCE = 5.0
# Stamps that differ by more (s) are of two clocks: no source of poses is as late.
CLOCK_DIFFERENCE = 1.0
# The log repeats that the level rises after this time, s.
AGAIN = 5.0


class Reference:
    """
    Collects poses of a second source with the joint positions at their stamps, and compares them.

    Both must have the same clock. The work has a thread of its own: it takes 20 ms for a diagnosis
    and 1 ms for a new pose.
    The log has the first result, and each that is worse.

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
        # Of the app that compares poses, since the first pose.
        self._app: Any = None
        self._poses: Any = None
        self._way: deque[tuple[int, Floats]] = deque(maxlen=WAY)
        self._refused = ''
        self._noted_at = 0.0
        self._level, self._throttle = -1, Throttle(AGAIN)
        self._thread: threading.Thread | None = None
        self._examined: Any = None
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
        self._examined = None
        self.is_there = False
        self._way.clear()
        self._poses, self._level = None, -1
        self._thread = None  # what it finds is about the time before

    def _on_pose(self, data: bytes) -> None:
        try:
            message = read_message(data, PoseStamped)
            stamp, pose = stamp_of(message), pose_of(message)
        except (RefusedTargetError, WireError) as error:
            self._refused = str(error)
            return
        now = time.monotonic()
        if self._poses is None:
            # Loaded if there is a second source: most nodes have none.
            self._app = app_module('second source')
            if self._app is None:
                self._refused = WITHOUT_APP
                return
            self._poses = self._app.PoseCollector(self._robot(), MOST)
            self._used_at, self._arrived, self._unmatched = now, 0, 0
        self.is_there = True
        poses = self._poses
        poses.note_pose(stamp, pose)
        self._arrived += 1
        is_stale = not self._way or now - self._noted_at > CLOCK_DIFFERENCE
        self._ahead = 0.0 if is_stale else 1e-9 * (stamp - self._way[-1][0])
        is_matched = poses.different > 0 and poses.unmatched == self._unmatched
        if is_stale or is_matched and self._ahead < CLOCK_DIFFERENCE:
            # Without joint states, no pose can be used: the status `input` says so.
            self._used_at, self._arrived = now, 0
        self._unmatched = poses.unmatched

    def note(self, answer: EstimatorOutput) -> None:
        """Take a new state of the arm; a pose is compared once states around it are known."""
        if self._poses is None:
            return
        self._noted_at = time.monotonic()
        self._poses.note_state(answer.stamp, answer.state.q)
        if not self._way or answer.stamp - self._way[-1][0] >= WAY_STEP:
            self._way.append((answer.stamp, answer.state.q))

    def status_text(self) -> StatusText | None:
        """Return the status, None without a source; log the first level and each that is worse."""
        found = self._compared()
        if found is None or self._poses is None:
            return found
        if why := self._why_unused():
            last = f'{why}; the last result is: {found.sentence}'
            found = StatusText(max(Level.WARN, found.level), last, found.values)
        is_collecting = self._examined is None and found.level == Level.OK
        rises, text = found.level > self._level, f'poses of {self.topic_name}: {found.sentence}'
        if is_collecting or rises and not self._throttle.passes('frames'):
            return found
        self._level = found.level
        if rises and found.level == Level.OK:
            self._node.get_logger().info(text)
        elif rises:
            self._node.get_logger().warning(text)
        return found

    def _why_unused(self) -> str:
        # Why no pose was used of late; empty if one was.
        if (silence := time.monotonic() - self._used_at) < PATIENCE:
            return ''
        if not self._arrived:
            why = f'no pose of the second source for {silence:.0f} s'
            return f'{why}; one was refused: {self._refused}' if self._refused else why
        arrived = f'{self._arrived} poses arrived, none was used'
        if abs(self._ahead) < CLOCK_DIFFERENCE:
            return f'{arrived}: no joint states are within 0.1 s of their stamps'
        side = f'{abs(self._ahead):.0f} s {"after" if self._ahead > 0.0 else "before"}'
        return (
            f'{arrived}: their stamps are {side} those of the joint states: synchronize the clocks'
        )

    def _compared(self) -> StatusText | None:
        # The last result.
        if self._poses is not None:
            app, first = self._app, self._app.FIRST
            count, limits = self._poses.different, self._limits()
            busy = self._thread is not None and self._thread.is_alive()
            if count > first and not busy and (new := self._poses.taken()).stamps:
                known = self._robot(), limits, self._examined, new, list(self._way)

                def examine() -> None:
                    found = app.examined(*known)
                    if threading.current_thread() is self._thread:
                        self._examined = found

                self._thread = threading.Thread(target=examine, daemon=True)
                self._thread.start()
            if self._examined is not None:
                # Judged each time: the limits may have changed.
                status: StatusText = app.frames_status(self._examined, limits)
                return status
            if not self._refused:
                text = f'{min(count, first)} of {first} different poses collected'
                return StatusText(Level.OK, text, ())
        if not self._refused:
            return None
        return StatusText(Level.WARN, f'pose of {self.topic_name} refused: {self._refused}', ())
