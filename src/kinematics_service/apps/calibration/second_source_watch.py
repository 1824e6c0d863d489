# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Watch a second source of poses in a running node: a frame check, then a test for jumps.

Once the poses fit the robot file, each new pose is tested for a jump (`zero_jump.py`). A joint
zero, the base, the tool or the lag may jump. While the poses do not fit, the newest poses are
diagnosed.
"""

import threading
import time
from collections import deque
from collections.abc import Callable

from ...estimation.status_text import StatusText
from ...kernel import Floats
from ...node.parameters.settings import ReferenceLimits
from ...robot.measures import Level
from ...robot.robot import Robot
from .collecting import PoseCollector
from .second_source import MIN_NEW, Examined, examined, frames_status

# Largest number of stored poses of the second source that were matched with joint states.
MAX_POSES = 256
# Least time between two stored samples of the joints' path, ns. So the path is stored at 100 Hz at
# most.
PATH_STEP = 10_000_000
# Number of stored samples of the joints' path, from which a lag is found. At 100 Hz they cover the
# last minute.
PATH_SAMPLES = 6_000
# The status is WARN if no pose of the second source arrived for this time (s), or if no pose was
# used for this time.
PATIENCE = 5.0
# Largest difference (s) between the stamps of poses and joint states that a delay of the poses can
# cause. If the difference is larger, the stamps come from two different clocks.
CLOCK_DIFFERENCE = 1.0


class SecondSourceWatch:
    """
    Collects poses of a second source, and compares them with poses computed from the robot file.

    Poses and joint states must have the same clock. The comparison runs in a separate thread: a
    diagnosis takes 20 ms, and the jump test of a new pose 1 ms.

    Parameters
    ----------
    robot
        A function that returns the robot that the node uses at present.
    topic
        The name of the topic that the poses come from.

    Attributes
    ----------
    is_examined
        Whether poses have been compared.
    thread
        The thread of the last comparison; None before the first.
    """

    def __init__(self, robot: Callable[[], Robot], topic: str) -> None:
        self._robot, self._topic = robot, topic
        self._poses = PoseCollector(robot(), MAX_POSES)
        self._path: deque[tuple[int, Floats]] = deque(maxlen=PATH_SAMPLES)
        self._noted_at, self._used_at = 0.0, time.monotonic()
        self._arrived = self._unmatched = 0
        self._ahead = 0.0
        self.thread: threading.Thread | None = None
        self._examined: Examined | None = None

    @property
    def is_examined(self) -> bool:
        """Return whether poses have been compared."""
        return self._examined is not None

    def note_pose(self, stamp: int, pose: Floats) -> None:
        """Take a pose (4, 4) of the second source with its stamp (ns)."""
        now, poses = time.monotonic(), self._poses
        poses.note_pose(stamp, pose)
        self._arrived += 1
        is_stale = not self._path or now - self._noted_at > CLOCK_DIFFERENCE
        self._ahead = 0.0 if is_stale else 1e-9 * (stamp - self._path[-1][0])
        is_matched = poses.different > 0 and poses.unmatched == self._unmatched
        if is_stale or is_matched and self._ahead < CLOCK_DIFFERENCE:
            # `_used_at` is the time at which a pose was last used. Set it to the present time if
            # this pose was used. Do so as well if joint states are missing, because the status
            # `input` already reports missing joint states.
            self._used_at, self._arrived = now, 0
        self._unmatched = poses.unmatched

    def note_state(self, stamp: int, q: Floats) -> None:
        """
        Take joint positions (n,) at a stamp (ns). A pose of the second source is compared once the
        joint states before and after it have arrived.
        """
        self._noted_at = time.monotonic()
        self._poses.note_state(stamp, q)
        if not self._path or stamp - self._path[-1][0] >= PATH_STEP:
            self._path.append((stamp, q))

    def status(self, limits: ReferenceLimits, refused: str) -> StatusText:
        """
        Return the status of the second source; `refused` is the reason for which a pose was
        refused, or empty.
        """
        status = self._compared(limits, refused)
        if reason := self._why_unused(refused):
            last = f'{reason}; the last result is: {status.sentence}'
            return StatusText(max(Level.WARN, status.level), last, status.values)
        return status

    def _why_unused(self, refused: str) -> str:
        # Return the reason why no pose of the second source was used within the last PATIENCE
        # seconds; empty if a pose was used.
        if (silence := time.monotonic() - self._used_at) < PATIENCE:
            return ''
        if not self._arrived:
            reason = f'no pose of the second source for {silence:.0f} s'
            return f'{reason}; one was refused: {refused}' if refused else reason
        arrived = f'{self._arrived} poses arrived, none was used'
        if abs(self._ahead) < CLOCK_DIFFERENCE:
            return f'{arrived}: no joint states are within 0.1 s of their stamps'
        side = f'{abs(self._ahead):.0f} s {"after" if self._ahead > 0.0 else "before"}'
        return (
            f'{arrived}: their stamps are {side} those of the joint states: synchronize the clocks'
        )

    def _compared(self, limits: ReferenceLimits, refused: str) -> StatusText:
        # Start a comparison in a thread if enough new poses were collected. Return the status of
        # the last finished comparison.
        count = self._poses.different
        busy = self.thread is not None and self.thread.is_alive()
        if count > MIN_NEW and not busy and (new := self._poses.taken()).stamps:
            known = self._robot(), limits, self._examined, new, list(self._path)

            def examine() -> None:
                self._examined = examined(*known)

            self.thread = threading.Thread(target=examine, daemon=True)
            self.thread.start()
        if self._examined is not None:
            # Compute the status again at each call, because the limits may have changed.
            return frames_status(self._examined, limits)
        if refused:
            return StatusText(Level.WARN, f'pose of {self._topic} refused: {refused}', ())
        text = f'{min(count, MIN_NEW)} of {MIN_NEW} different poses collected'
        return StatusText(Level.OK, text, ())
