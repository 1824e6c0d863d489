# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Collect poses of a running robot for a calibration, and repeat the fit as more poses arrive."""

import os
import threading
import time
from collections.abc import Callable, Sequence

from geometry_msgs.msg import PoseStamped
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from ...errors import RefusedTargetError, WireError
from ...estimation.estimator import AcceptedMessage, Estimator, EstimatorSettings
from ...node.messages.message_check import read_message
from ...node.messages.messages import sample_of, stamp_of
from ...node.messages.target_messages import pose_of
from ...node.process.latest_message import LatestMessage
from ...node.process.no_messages import why_no_messages
from ...node.process.session import WRONG_USAGE, helper_node, is_name, run_session
from ...node.process.spin import Spinner
from ...node.steady_time import steady_timer
from ...robot.robot import Robot
from ...stop_signals import StopSignal
from .collecting import CollectedPoses, PoseCollector

# QoS of the subscriptions: best effort, because such a subscription receives from reliable and
# from best-effort publishers.
ANY_SENDER = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
# Period of the timer that starts fits and prints results, s.
PERIOD = 0.25
# If no pose was collected within this time, s, the command prints why.
SILENCE = 5.0
# Number of collected poses at which the first fit starts.
MIN_POSES = 8
# The next fit starts when the number of collected poses has reached this multiple of the number of
# poses in the last fit.
NEXT_FIT_RATIO = 1.25

# A function that fits the poses collected so far and prints the result. It returns True if more
# poses cannot determine further combinations of parameters.
Fit = Callable[[CollectedPoses], bool]
# A function that prints a line for the user.
Say = Callable[[str], None]


def collect_poses(
    robot: Robot,
    topic: str,
    pose_topic: str,
    joint_prefix: str,
    seconds: float,
    fit: Fit,
    say: Say,
    ros_args: Sequence[str],
) -> CollectedPoses | int:
    """
    Collect the poses that arrive within `seconds`, or until a stop signal, and return them. If the
    ROS session cannot start, return an exit code.

    Parameters
    ----------
    topic, pose_topic
        Topics with messages JointState and PoseStamped.
    fit
        Fits the poses collected so far. It is called in a thread of its own.
    say
        Prints a line for the user.
    ros_args
        ROS arguments, `--ros-args` included.
    """
    for option, name in (('--topic', topic), ('--pose-topic', pose_topic)):
        if not is_name(option, name, 'joint_states or /arm/joint_states'):
            return WRONG_USAGE

    def work(context: Context, stop: StopSignal) -> CollectedPoses | int:
        node = helper_node(f'kinematics_calibrate_{os.getpid()}', context)
        estimator = Estimator(robot, EstimatorSettings(joint_prefix))
        session = _Session(node, estimator, (topic, pose_topic), fit, say)
        spinner = Spinner(context, [node])
        end = time.monotonic() + seconds
        spinner.obey(stop)
        spinner.spin(lambda: stop.came or time.monotonic() >= end or not context.ok())
        spinner.close()
        session.finish()
        # Destroy the node without a time limit, because a time-out would lose the collected poses.
        node.destroy_node()
        return session.collector.collected()

    # No time-out: wait for a running fit, and keep the collected poses.
    return run_session(ros_args, work, time_out=None)


class _Session:
    # Subscribes to joint states and poses, matches them by their stamps, and runs fits in a
    # thread.

    def __init__(
        self, node: Node, estimator: Estimator, topics: tuple[str, str], fit: Fit, say: Say
    ) -> None:
        self.collector = PoseCollector(estimator.robot)
        self._node, self._estimator, self._fit, self._say = node, estimator, fit, say
        self._due = MIN_POSES
        self._thread: threading.Thread | None = None
        self._complete = self._refused = self._explained = False
        self._begin = time.monotonic()
        self._states = LatestMessage(node, topics[0], JointState, ANY_SENDER, self._on_state)
        self._poses = LatestMessage(node, topics[1], PoseStamped, ANY_SENDER, self._on_pose)
        steady_timer(node, PERIOD, self._look)
        say(f'collecting joint states of {self._states.topic} and poses of {self._poses.topic}')

    def _on_state(self, data: bytes) -> None:
        try:
            message = read_message(data, JointState)
        except WireError:
            return
        known = self._estimator.accept(sample_of(message, self._node.get_clock()))
        if isinstance(known, AcceptedMessage):
            self.collector.note_state(known.stamp, known.q)

    def _on_pose(self, data: bytes) -> None:
        try:
            message = read_message(data, PoseStamped)
            self.collector.note_pose(stamp_of(message), pose_of(message))
        except (RefusedTargetError, WireError) as error:
            if not self._refused:
                self._refused = True
                self._say(f'a pose of {self._poses.topic} is refused: {error}')

    def _look(self) -> None:
        busy = self._thread is not None and self._thread.is_alive()
        count = len(self.collector)
        if count >= self._due and not busy and not self._complete:
            self._due = int(NEXT_FIT_RATIO * count) + 1
            poses = self.collector.collected()
            self._thread = threading.Thread(target=self._fit_poses, args=(poses,), daemon=True)
            self._thread.start()
        if not count and not self._explained and time.monotonic() - self._begin > SILENCE:
            self._explained = True
            self._explain()

    def _explain(self) -> None:
        silent = [latest.topic for latest in (self._states, self._poses) if not latest.count]
        for topic in silent:
            self._say(why_no_messages(self._node, topic))
        if not silent:
            refused = ', '.join(f'{n} {reason}' for reason, n in self._estimator.counts.items())
            self._say(
                f'no pose has joint states around its stamp: {self.collector.unmatched} poses; '
                f'joint states: {refused}'
            )

    def _fit_poses(self, poses: CollectedPoses) -> None:
        self._complete = self._fit(poses)

    def finish(self) -> None:
        """Wait for a running fit, so that it does not compete with the final fit of all poses."""
        if self._thread is not None:
            self._thread.join()
