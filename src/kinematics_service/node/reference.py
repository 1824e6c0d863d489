# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Receive poses of the tool from a second source. Report in the status `frames` how they differ from
the node's poses.

The app calibration compares the received poses with poses of the node
(`apps/calibration/second_source_watch.py`). The app is loaded at the first received pose, because
most nodes have no second source.
"""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from ..app_modules import app_module
from ..errors import RefusedTargetError, WireError
from ..estimation.estimator import EstimatorOutput
from ..estimation.status_text import StatusText
from ..robot.measures import Level
from ..robot.robot import Robot
from .messages.message_check import read_message
from .messages.messages import stamp_of
from .messages.target_messages import pose_of
from .messages.topics import REFERENCE_POSE, TARGET_POSE_QOS, raw_subscription
from .parameters.settings import ReferenceLimits
from .steady_time import Throttle

WITHOUT_APP = (
    'the app calibration, which compares poses, was removed; record both, and run '
    '`kinematics_service audit`'
)
# Shortest time (s) between two log lines. A line is logged when the level of the status `frames`
# (OK, WARN, ERROR) becomes worse.
LOG_PERIOD = 5.0


class Reference:
    """
    Passes tool poses of a second source, and states of the arm, to the app that compares the two.

    The first result of the comparison is logged. A later result is logged if its level (OK, WARN,
    ERROR) is worse than that of the result before.

    Parameters
    ----------
    node
        The node that subscribes.
    robot, limits
        Functions that return the present arm, and the present thresholds of the difference.

    Attributes
    ----------
    watch
        The app's object that compares poses; None before the first pose of the second source.
    """

    def __init__(
        self, node: Node, robot: Callable[[], Robot], limits: Callable[[], ReferenceLimits]
    ) -> None:
        self.watch: Any = None
        self._node, self._robot, self._limits = node, robot, limits
        self._refused = ''
        self._level, self._throttle = -1, Throttle(LOG_PERIOD)
        qos, take = TARGET_POSE_QOS, self._on_pose
        subscription = raw_subscription(node, PoseStamped, REFERENCE_POSE, take, qos)
        self._topic = str(subscription.topic_name)

    def forget(self) -> None:
        """
        Forget all received tool poses, which come from a second source such as a tracker.

        Call this method after the arm has changed, or after the stamps of the joint states have
        stepped back.
        """
        self.watch, self._level = None, -1

    def _on_pose(self, data: bytes) -> None:
        try:
            message = read_message(data, PoseStamped)
            stamp, pose = stamp_of(message), pose_of(message)
        except (RefusedTargetError, WireError) as error:
            self._refused = str(error)
            return
        if self.watch is None:
            app = app_module('second source')
            if app is None:
                self._refused = WITHOUT_APP
                return
            self.watch = app.SecondSourceWatch(self._robot, self._topic)
        self.watch.note_pose(stamp, pose)

    def note(self, answer: EstimatorOutput) -> None:
        """
        Take a new state of the arm. To compare a received pose, the app needs a state with a later
        stamp than the pose.
        """
        if self.watch is not None:
            self.watch.note_state(answer.stamp, answer.state.q)

    def status_text(self) -> StatusText | None:
        """
        Return the status `frames`: how well the node's poses agree with those of the second
        source. Without a second source, return None. Log the status if its level becomes worse.
        """
        if self.watch is None:
            text = f'pose of {self._topic} refused: {self._refused}'
            return StatusText(Level.WARN, text, ()) if self._refused else None
        status: StatusText = self.watch.status(self._limits(), self._refused)
        is_collecting = not self.watch.is_examined and status.level == Level.OK
        rises, text = status.level > self._level, f'poses of {self._topic}: {status.sentence}'
        if is_collecting or rises and not self._throttle.passes('frames'):
            return status
        self._level = status.level
        if rises and status.level == Level.OK:
            self._node.get_logger().info(text)
        elif rises:
            self._node.get_logger().warning(text)
        return status
