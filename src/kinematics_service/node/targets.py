# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Answer target poses of the tool by joint positions, and target twists by joint velocities.

An answer to a pose takes up to 50 ms. So a second thread computes answers to poses, and joint
states need not wait. An answer to a twist takes 0.1 ms and is computed in the thread of the
executor.
"""

import contextlib
import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from queue import SimpleQueue

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ..estimation.estimator import EstimatorOutput
from ..estimation.status_text import StatusText
from ..kinematics.inverse.problem.plan import plan_for
from ..kinematics.inverse.self_motion.best_posture import has_arcs
from ..kinematics.inverse.servo import joint_velocity
from ..kinematics.inverse.solve import inverse_kinematics
from ..robot.measures import Level
from .messages import topics
from .messages.message_check import read_message
from .messages.messages import full_name, stamp_of, status_message
from .messages.target_messages import (
    best_choice,
    choice_of,
    joint_message,
    pose_in_base,
    pose_of,
    solutions_message,
    twist_in_base,
    twist_of,
)
from .messages.topics import output_publisher, raw_subscription
from .parameters.settings import NodeSettings
from .steady_time import Throttle, steady_timer
from .target_status import pose_status, twist_status

# Period of the check that target twists still arrive, divided by `ik.target_timeout`. So the
# joints stop at most a quarter of the time-out too late.
WATCHDOG_TIMEOUT_RATIO = 0.25
# When the node ends, it waits at most this time until subscribers have acknowledged its last
# message.
ACKNOWLEDGEMENT_TIMEOUT = Duration(seconds=0.2)
# A thread computes the answers to target poses. When the node ends, it waits at most this time (s)
# for the thread. Before each answer, the thread waits at most this time until the executor has
# handled the events in the executor's queue.
ANSWER_TIMEOUT = 0.5


class Targets:
    """
    Answers targets, and publishes a status for each target; a refused target moves no joint.

    A twist is valid for `ik.target_timeout`. If the next twist is refused or late, one message of
    zero velocities stops the motion.

    Parameters
    ----------
    node
        The node with the topics; statuses carry its name.
    settings
        The settings in force.
    present
        A function that returns the arm's present state; it raises RefusedTargetError if no state
        is known.

    Attributes
    ----------
    in_force
        A lock that is held while the answer to a target pose is published. Hold it while settings
        change, so that an answer fits the settings in force when it is published.
    """

    def __init__(
        self, node: Node, settings: NodeSettings, present: Callable[[], EstimatorOutput]
    ) -> None:
        self._node, self.in_force = node, threading.Lock()
        self._poses: SimpleQueue[bytes | None] = SimpleQueue()  # the item None ends the thread
        self._thread: threading.Thread | None = None  # answers target poses
        self._throttle, self._first_time = Throttle(5.0), Throttle(math.inf)
        self._settings = self._prepared(settings)
        self._present = present
        # time (s) of the last valid twist that moves the joints; None while no twist moves the
        # joints
        self._moving_since: float | None = None

        self._joint_states = output_publisher(node, JointState, topics.IK_JOINT_STATES)
        self._solutions = output_publisher(node, Float64MultiArray, topics.IK_SOLUTIONS)
        self._joint_velocity = output_publisher(node, JointState, topics.IK_JOINT_VELOCITY)
        self._status = output_publisher(node, DiagnosticStatus, topics.IK_STATUS)
        raw_subscription(
            node, PoseStamped, topics.TARGET_POSE, self._on_pose, topics.TARGET_POSE_QOS
        )
        raw_subscription(
            node, TwistStamped, topics.TARGET_TWIST, self._on_twist, topics.TARGET_TWIST_QOS
        )
        # The timer runs only while a twist is valid.
        self._timer = steady_timer(node, self._watch_period(), self._watch, autostart=False)

    def configure(self, settings: NodeSettings) -> None:
        """Apply new settings; stop the motion of the last target twist."""
        self._stop()
        self._settings = self._prepared(settings)
        self._timer.timer_period_ns = round(self._watch_period() * 1e9)

    def stop(self) -> None:
        """
        Stop the motion of the last target twist. If the answer to a target pose is being
        published, wait until this is done.
        """
        with self.in_force:
            pass
        if self._moving_since is not None:
            self._stop()
            self._joint_velocity.wait_for_all_acked(ACKNOWLEDGEMENT_TIMEOUT)

    def close(self) -> None:
        """End the thread that answers poses; called before the node is destroyed."""
        self._poses.put(None)
        if self._thread is not None:
            self._thread.join(ANSWER_TIMEOUT)

    def _watch_period(self) -> float:
        return self._settings.target_timeout * 1e-9 * WATCHDOG_TIMEOUT_RATIO

    # Methods that answer target poses

    def _on_pose(self, data: bytes) -> None:
        self._poses.put(data)
        if self._thread is None:
            self._thread = threading.Thread(target=self._take_poses, daemon=True)
            self._thread.start()

    def _take_poses(self) -> None:
        # Answer only the newest pose, which replaces other poses that arrived during the last
        # answer.
        while (waiting := self._poses.get()) is not None:
            self._wait_for_executor()
            replaced = 0
            while waiting is not None and not self._poses.empty():
                waiting, replaced = self._poses.get(), replaced + 1
            if waiting is None:
                return
            with contextlib.suppress(InvalidHandle):  # the node may be destroyed already
                self._take_pose(waiting, replaced)

    def _wait_for_executor(self) -> None:
        # Let the executor empty its queue first, because the computation of an answer holds the
        # interpreter's lock.
        executor, done = self._node.executor, threading.Event()
        if executor is not None:
            executor.create_task(done.set)
            done.wait(ANSWER_TIMEOUT)

    def _take_pose(self, data: bytes, replaced: int) -> None:
        try:
            status_text = self._answer_pose(read_message(data, PoseStamped))
        except Exception as error:  # no message may stop the thread
            status_text = self._refused(error)
        values = (*status_text.values, ('replaced', str(replaced)))
        self._publish_status('target_pose', replace(status_text, values=values))

    def _answer_pose(self, message: PoseStamped) -> StatusText:
        given = pose_of(message)
        while True:
            with self.in_force:
                settings, present = self._settings, self._present().state
            T = pose_in_base(given, message.header.frame_id, present.pose, settings)
            result = inverse_kinematics(
                settings.robot,
                T,
                near=present.q,
                rows=settings.target_rows,
                axis=settings.target_axis,
                tolerance=settings.values['ik.tolerance'],
                curves=False,
            )
            choice = best_choice(choice_of(result, settings.robot, present.q), T, settings)
            with self.in_force:
                self._present()  # this call raises an error if the node no longer answers
                if settings is not self._settings:
                    continue
                if self._solutions.get_subscription_count() > 0:
                    self._solutions.publish(solutions_message(choice, settings))
                if choice.q is not None:
                    answer = joint_message(stamp_of(message), settings, position=choice.q)
                    self._joint_states.publish(answer)
                return pose_status(result, choice, present.q, settings.redundancy)

    # Methods that answer target twists

    def _on_twist(self, data: bytes) -> None:
        stamp = None
        try:
            message = read_message(data, TwistStamped)
            stamp = stamp_of(message)
            status_text = self._answer_twist(message)
        except Exception as error:  # no message may stop the node
            self._stop(stamp)
            status_text = self._refused(error)
        self._publish_status('target_twist', status_text)

    def _answer_twist(self, message: TwistStamped) -> StatusText:
        settings = self._settings
        given = twist_of(message)
        present = self._present().state
        twist = twist_in_base(given, message.header.frame_id, present.pose[:3, :3], settings)
        step = joint_velocity(settings.robot, present, twist, settings.servo)
        self._joint_velocity.publish(
            joint_message(stamp_of(message), settings, velocity=step.qdot)
        )
        moving = bool(np.any(step.qdot))
        if moving and self._moving_since is None:
            self._timer.reset()
        elif not moving:
            self._timer.cancel()
        self._moving_since = time.monotonic() if moving else None
        return twist_status(step)

    def _watch(self) -> None:
        since = self._moving_since
        timeout = self._settings.target_timeout * 1e-9
        if since is not None and time.monotonic() - since > timeout:
            self._stop()
            sentence = f'no target_twist for {timeout:g} s: the joints are stopped'
            self._publish_status('target_twist', StatusText(Level.STALE, sentence, ()))

    def _stop(self, stamp: int | None = None) -> None:
        # Publish zero velocities once, because velocity controllers hold the last command.
        if self._moving_since is None:
            return
        self._moving_since = None
        self._timer.cancel()
        if stamp is None:
            stamp = self._node.get_clock().now().nanoseconds
        zero = np.zeros(self._settings.robot.dof)
        self._joint_velocity.publish(joint_message(stamp, self._settings, velocity=zero))

    # Methods that publish statuses

    def _refused(self, error: Exception) -> StatusText:
        reason = self._throttle.reason_of(self._node, 'a target', error)
        return StatusText(Level.ERROR, f'refused: {reason}', ())

    def _publish_status(self, topic: str, status_text: StatusText) -> None:
        if self._status.get_subscription_count() > 0:
            name = full_name(self._node)
            robot = ('robot', self._settings.robot.name)
            status_text = replace(status_text, values=(robot, *status_text.values))
            self._status.publish(status_message(f'{name}: {topic}', status_text))

    def _prepared(self, settings: NodeSettings) -> NodeSettings:
        # Plan the inverse kinematics now, which takes some milliseconds, so that no joint state
        # waits for the plan later.
        robot, rows, axis = settings.robot, settings.target_rows, settings.target_axis or ''
        plan_for(robot, rows, axis)
        has_effect = settings.redundancy == 'near' or has_arcs(robot, rows, axis)
        if not has_effect and self._first_time.passes(f'{robot.name} {rows} {axis}'):
            self._node.get_logger().warning(
                f'parameter ik.redundancy: {settings.redundancy} has no effect, because '
                f'{robot.name} does not have one joint more than these targets need; set near'
            )
        return settings
