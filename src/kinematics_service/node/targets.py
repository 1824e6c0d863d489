"""
Targets for the tool: poses in, joint positions out; twists in, joint velocities out.

An answer to a pose takes up to some 50 ms, so poses have a thread of their own: no joint state
waits for one. An answer to a twist takes some 0.1 ms, in the thread of the executor.
"""

import contextlib
import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from queue import SimpleQueue
from typing import Any

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
from ..kinematics.inverse.way_out import way_out_for
from ..robot.measures import Level
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
from .messages.topics import (
    IK_JOINT_STATES,
    IK_JOINT_VELOCITY,
    IK_SOLUTIONS,
    IK_STATUS,
    OUTPUT_QOS,
    TARGET_POSE,
    TARGET_POSE_QOS,
    TARGET_TWIST,
    TARGET_TWIST_QOS,
    overridable,
)
from .parameters.settings import NodeSettings
from .steady_time import Throttle, steady_timer
from .target_status import pose_status, twist_status

# Period of the check that twists still arrive, as a share of their timeout.
WATCH_SHARE = 0.25
# Longest time that the end of the node waits for the last message to go out, s.
LAST_WORD = Duration(seconds=0.2)
# Longest time that it waits for the answer to a pose, s.
LAST_ANSWER = 0.5


class Targets:
    """
    Answers targets, each with a status; a target that is refused moves nothing.

    A twist is a command for now: if the next one is refused or does not arrive within
    `ik.target_timeout`, one message of zero velocities stops the motion that the last one began.

    Parameters
    ----------
    node
        The node they belong to; topics and statuses carry its name.
    settings
        The settings in force.
    present
        Returns the arm's present state; RefusedTargetError if it is not known.

    Attributes
    ----------
    in_force
        Held while an answer to a pose goes out, and to be held while settings change: so an answer
        and the settings and the state that it is of go together.
    """

    def __init__(
        self,
        node: Node,
        settings: NodeSettings,
        present: Callable[[], EstimatorOutput],
    ) -> None:
        self._node, self.in_force = node, threading.Lock()
        self._poses: SimpleQueue[bytes | None] = SimpleQueue()  # None ends the thread
        self._thread: threading.Thread | None = None  # that of the poses, from the first one on
        self._throttle, self._once = Throttle(5.0), Throttle(math.inf)
        self._settings = self._planned(settings)
        self._present = present
        self._moving_since: float | None = None  # time of the last twist that is in force

        def publisher(kind: Any, name: str) -> Any:
            return node.create_publisher(kind, name, **overridable(OUTPUT_QOS))

        self._joint_states = publisher(JointState, IK_JOINT_STATES)
        self._solutions = publisher(Float64MultiArray, IK_SOLUTIONS)
        self._joint_velocity = publisher(JointState, IK_JOINT_VELOCITY)
        self._status = publisher(DiagnosticStatus, IK_STATUS)
        for kind, name, take, qos in (
            (PoseStamped, TARGET_POSE, self._on_pose, TARGET_POSE_QOS),
            (TwistStamped, TARGET_TWIST, self._on_twist, TARGET_TWIST_QOS),
        ):
            # Raw: refused here with a reason.
            node.create_subscription(kind, name, take, raw=True, **overridable(qos))
        # Runs only while a twist is in force: its thread would wake for nothing otherwise.
        self._timer = steady_timer(node, self._watch_period(), self._watch, autostart=False)

    def configure(self, settings: NodeSettings) -> None:
        """Apply other settings; a motion in force is stopped."""
        self._stop()
        self._settings = self._planned(settings)
        self._timer.timer_period_ns = round(self._watch_period() * 1e9)

    def stop(self) -> None:
        """End a motion in force; no answer goes out after it unless the state is known again."""
        with self.in_force:
            pass  # an answer that is going out
        if self._moving_since is not None:
            self._stop()
            self._joint_velocity.wait_for_all_acked(LAST_WORD)

    def close(self) -> None:
        """End the thread of the poses, before the node goes."""
        self._poses.put(None)
        if self._thread is not None:
            self._thread.join(LAST_ANSWER)

    def _watch_period(self) -> float:
        return self._settings.target_timeout * 1e-9 * WATCH_SHARE

    # Poses

    def _on_pose(self, data: bytes) -> None:
        self._poses.put(data)
        if self._thread is None:
            self._thread = threading.Thread(target=self._take_poses, daemon=True)
            self._thread.start()

    def _take_poses(self) -> None:
        # Answers the newest pose; it replaces those that came while the last one was answered.
        waiting = self._poses.get()
        while waiting is not None:
            self._wait_for_executor()
            replaced = 0
            while waiting is not None and not self._poses.empty():
                waiting, replaced = self._poses.get(), replaced + 1
            if waiting is not None:
                with contextlib.suppress(InvalidHandle):  # the node ends
                    self._take_pose(waiting, replaced)
                waiting = self._poses.get()

    def _wait_for_executor(self) -> None:
        # An answer shares the interpreter with the executor, which works its queue off first.
        executor, done = self._node.executor, threading.Event()
        if executor is not None:
            executor.create_task(done.set)
            done.wait(LAST_ANSWER)

    def _take_pose(self, data: bytes, replaced: int) -> None:
        try:
            status_text = self._answer_pose(read_message(data, PoseStamped))
        except Exception as error:  # no message may stop the thread
            status_text = self._refused(error)
        values = (*status_text.values, ('replaced', str(replaced)))
        self._say('target_pose', replace(status_text, values=values))

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
                tolerance=settings.target_tolerance,
                curves=False,
            )
            choice = best_choice(choice_of(result, settings.robot, present.q), T, settings)
            with self.in_force:
                self._present()  # refuses where the node has fallen silent
                if settings is not self._settings:
                    continue
                if self._solutions.get_subscription_count() > 0:
                    self._solutions.publish(solutions_message(choice, settings))
                if choice.q is not None:
                    answer = joint_message(stamp_of(message), settings, position=choice.q)
                    self._joint_states.publish(answer)
                return pose_status(result, choice, present.q, settings.redundancy)

    # Twists

    def _on_twist(self, data: bytes) -> None:
        stamp = None
        try:
            message = read_message(data, TwistStamped)
            stamp = stamp_of(message)
            status_text = self._answer_twist(message)
        except Exception as error:  # no message may stop the node
            self._stop(stamp)
            status_text = self._refused(error)
        self._say('target_twist', status_text)

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
        way_out = None
        if step.lost and self._status.get_subscription_count() > 0:
            way_out = way_out_for(settings.robot, present.q, twist, settings.servo)
        return twist_status(step, way_out)

    def _watch(self) -> None:
        since = self._moving_since
        timeout = self._settings.target_timeout * 1e-9
        if since is not None and time.monotonic() - since > timeout:
            self._stop()
            sentence = f'no target_twist for {timeout:g} s: the joints are stopped'
            self._say('target_twist', StatusText(Level.STALE, sentence, ()))

    def _stop(self, stamp: int | None = None) -> None:
        # Velocity controllers hold the last command: a motion that was begun must be stopped,
        # once.
        if self._moving_since is None:
            return
        self._moving_since = None
        self._timer.cancel()
        if stamp is None:
            stamp = self._node.get_clock().now().nanoseconds
        zero = np.zeros(self._settings.robot.dof)
        self._joint_velocity.publish(joint_message(stamp, self._settings, velocity=zero))

    # Statuses

    def _refused(self, error: Exception) -> StatusText:
        reason = self._throttle.reason_of(self._node, 'a target', error)
        return StatusText(Level.ERROR, f'refused: {reason}', ())

    def _say(self, topic: str, status_text: StatusText) -> None:
        if self._status.get_subscription_count() > 0:
            name = full_name(self._node)
            robot = ('robot', self._settings.robot.name)
            status_text = replace(status_text, values=(robot, *status_text.values))
            self._status.publish(status_message(f'{name}: {topic}', status_text))

    def _planned(self, settings: NodeSettings) -> NodeSettings:
        # What the arm's inverse needs is found now, in some milliseconds, so that no joint state
        # waits for it later.
        robot, rows, axis = settings.robot, settings.target_rows, settings.target_axis or ''
        plan_for(robot, rows, axis)
        has_effect = settings.redundancy == 'near' or has_arcs(robot, rows, axis)
        if not has_effect and self._once.passes(f'{robot.name} {rows} {axis}'):
            self._node.get_logger().warning(
                f'the parameter ik.redundancy, {settings.redundancy}, has no effect: it is for '
                'arms with one joint more than a pose, a position, or a position and an axis of '
                f'the tool ask for, and {robot.name} is none with these targets'
            )
        return settings
