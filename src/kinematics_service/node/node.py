# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the node: for each JointState it publishes pose, Jacobian, twist and warning."""

import json
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time_source import CLOCK_TOPIC
from std_srvs.srv import Trigger

from ..errors import RefusedTargetError
from ..estimation import outcomes
from ..estimation.estimator import Estimator, EstimatorOutput, JointMessage, RefusedMessage
from ..estimation.joint_efforts import JointEfforts
from ..estimation.joint_state_form import SerializedSample
from ..estimation.status_text import StatusText, singularity_status, stale_status
from ..kinematics.singularity import singularity_of
from ..robot.measures import Level
from .describe import description_of
from .diagnostics import INTERNAL_ERROR, LEFT_OUT
from .health import Health, diagnostics_publisher, publish_statuses
from .input import Input
from .introduction import introduce, tool_in_words
from .messages.messages import StateReport, full_name, status_message
from .messages.topics import DESCRIBE, JOINT_STATES, SERVICE_QOS, WARNING, WARNING_QOS
from .outputs import ActiveTopics, Outputs
from .parameters.node_parameters import NodeParameters
from .parameters.settings import NodeSettings
from .reference import Reference
from .reload import Reload
from .robot_description import DescriptionPublisher
from .scaling import Scaling
from .stamp_grid import StampGrid
from .steady_time import Throttle, steady_timer
from .targets import Targets
from .wrench import WrenchBias

NODE_NAME = 'kinematics'

# The node checks for stale joint states with a period of WATCHDOG_TIMEOUT_RATIO times
# `joint_state_timeout`, between MIN_WATCHDOG_PERIOD and MAX_WATCHDOG_PERIOD. So it reports stale
# joint states at most a quarter of the time-out late.
WATCHDOG_TIMEOUT_RATIO = 0.25
MIN_WATCHDOG_PERIOD = 0.02  # s
MAX_WATCHDOG_PERIOD = 0.25  # s


class KinematicsNode(Node):
    """
    The ROS node of one arm: it answers each JointState message with pose, Jacobian, twist and
    singularity measures.

    Parameters
    ----------
    robot
        The robot as given on the command line: file, bundled name or topic; None: the parameter
        `robot` names it.
    stopped
        A function that returns whether to end the wait for a description on a topic.
    node_name
        The name of the node, unless it is remapped.
    topic
        The topic of the joint states, unless it is remapped.
    **options
        Options of rclpy.node.Node: `context`, `namespace`, `parameter_overrides`, ...

    Raises
    ------
    KinematicsError
        The robot or a parameter is wrong; the text of the error is one sentence for the user.
    StoppedWaiting
        No description came on a topic before `stopped()` was true.

    Attributes
    ----------
    is_started
        Whether the topics of the node exist.
    silent
        The reason why the node answers no message; empty if it answers.
    settings
        The settings in force.
    """

    def __init__(
        self,
        robot: str | None = None,
        stopped: Callable[[], bool] = lambda: False,
        node_name: str = NODE_NAME,
        topic: str = JOINT_STATES,
        **options: Any,
    ) -> None:
        # Create the throttle before `super().__init__`, which subscribes to /clock. The callback
        # of this subscription needs the throttle.
        self._throttle = Throttle(5.0)
        super().__init__(node_name, **options)
        self.is_started = self._in_order = False
        self.silent = ''
        try:
            self._begin(lambda: self._start(robot, stopped, topic))
        except BaseException:
            self.destroy_node()
            raise

    def _begin(self, start: Callable[[], None]) -> None:
        start()

    def _start(self, robot: str | None, stopped: Callable[[], bool], topic: str) -> None:
        self._warning = self.create_publisher(DiagnosticStatus, WARNING, WARNING_QOS)
        statuses = diagnostics_publisher(self)

        def report(sentence: str) -> None:
            publish_statuses(self, statuses, {'input': StatusText(Level.WARN, sentence, ())})

        self._own_parameters = NodeParameters(self, robot, stopped, report)
        settings = self.settings = self._own_parameters.settings
        self._estimator = Estimator(settings.robot, settings.estimator)
        self._latest: EstimatorOutput | None = None
        self._resets = 0  # the number of resets of the estimator that the node has handled
        self._grid = StampGrid()
        transport = self._own_parameters.transport
        self._outputs = Outputs(self, settings, transport)
        self._outputs.events_in_order = self._in_order
        self._description = DescriptionPublisher(self, settings)
        self._targets = Targets(self, settings, self._present)
        self._scaling = Scaling(self, settings, self._present)
        self._input = Input(self, topic, transport, self._take, self._refuse)
        self.create_service(Trigger, DESCRIBE, self._describe, qos_profile=SERVICE_QOS)
        self._watchdog = steady_timer(self, self._watchdog_period(), self._watch)
        self._reference = Reference(
            self, lambda: self.settings.robot, lambda: self.settings.reference
        )
        self._health = Health(
            self,
            statuses,
            self._estimator,
            self._input,
            self._statuses,
            lambda: self._latest.velocity_source if self._latest else 'none',
            lambda: self.silent,
        )
        self._wrench = WrenchBias(self, self._estimator, self._needs_efforts)
        self._own_parameters.listen(self._take_settings)
        self._reload = Reload(self, self._own_parameters, self._take_settings)
        if self._own_parameters.description is not None:
            self._own_parameters.description.then = self._reload.read
        self._jump = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1)),
            post_callback=self._on_clock_jump,
        )
        self._started = time.monotonic_ns()
        self.is_started = True
        introduce(self, self._own_parameters, self._input.subscription.topic_name)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[..., None], *args: Any, **options: Any
    ) -> Any:
        """
        Create a subscription as rclpy does, but ignore negative times on /clock, for which rclpy
        raises an error.
        """

        def set_clock(message: Any) -> None:
            if message.clock.sec >= 0:
                callback(message)
            elif self._throttle.passes(CLOCK_TOPIC):
                self.get_logger().warning(
                    f'the time {message.clock.sec} s on {CLOCK_TOPIC} is negative: it is ignored'
                )

        checked = set_clock if topic == CLOCK_TOPIC else callback
        return super().create_subscription(msg_type, topic, checked, *args, **options)

    def set_parameters_atomically(self, parameter_list: Any) -> Any:
        """
        Set parameters as rclpy does. If accepted values are probably in a wrong unit, for example
        lengths in mm, the result's `reason` says so.
        """
        result = super().set_parameters_atomically(parameter_list)
        if result.successful and self.is_started:
            prefixes = tuple(f'parameter {parameter.name}:' for parameter in parameter_list)
            result.reason = '; '.join(
                doubt for doubt in self.settings.doubts if doubt.startswith(prefixes)
            )
        return result

    def trust_the_order_of_events(self) -> None:
        """Remember that the executor handles events in the order of their arrival."""
        self._in_order = True
        if self.is_started:
            self._outputs.events_in_order = True

    def events_were_left_out(self, messages: int) -> None:
        """Add `messages` to the number of messages that the executor threw away unanswered."""
        if not self.is_started:
            return
        self._estimator.counts[LEFT_OUT] += messages
        if self._throttle.passes(LEFT_OUT):
            self.get_logger().warning(
                'messages come faster than they can be answered: the oldest are left out'
            )

    def end_motion(self) -> None:
        """
        Stop the motion of the last target twist; the process calls this method before the node
        ends.
        """
        if self.is_started:
            self._targets.stop()

    def destroy_node(self) -> None:
        """Destroy the node; targets get no more answers."""
        if self.is_started:
            self._targets.close()
        super().destroy_node()

    def fall_silent(self, reason: str) -> None:
        """
        Let the node answer no message from now on, and publish the reason as a STALE warning.
        """
        self.silent = reason
        self.end_motion()
        if self.is_started:
            self._publish_warning(stale_status(self.settings.robot, reason))

    def forget_joints(self) -> None:
        """Forget all joint positions, as if no joint state had arrived."""
        self._estimator.reset()
        self._latest = None
        self._follow_reset()

    def read_robot_again(self) -> None:
        """
        Read the robot file again, and answer with the arm that it describes now.

        Raises
        ------
        KinematicsError
            The file has faults; the former robot stays in force.
        """
        self._take_settings(self._own_parameters.take(self._own_parameters.reading_again()()))

    # Methods that answer messages

    def _refuse(self, sentence: str) -> None:
        self._estimator.counts[outcomes.UNREADABLE] += 1
        self._reject(RefusedMessage(outcomes.UNREADABLE, sentence))

    def _take(self, message: JointMessage) -> bool:
        # Answer a message. Return False if the message is not decoded and does not have the
        # expected form (joint names and lengths of lists). The caller must then call this method
        # with another form, or with the decoded message.
        if self.silent:
            return True
        try:
            active = self._outputs.active()
            outcome = self._estimator.take(
                message, active.depth, active.messages, active.quantities
            )
            if outcome is None:
                return False
            if self._estimator.counts.get(outcomes.RESETS, 0) != self._resets:
                self._follow_reset()
                if self._throttle.passes(outcomes.RESETS):
                    self.get_logger().info(
                        'stamps stepped back by more than joint_state_timeout: the state starts '
                        'again'
                    )
            if isinstance(outcome, RefusedMessage):
                self._reject(outcome)
            else:
                self._follow(outcome, message, active)
        except Exception as error:  # no message of a robot may stop the node
            self._estimator.counts[INTERNAL_ERROR] += 1
            self._throttle.internal_error(self, 'a message', error)
        self._health.work.append(time.monotonic_ns() - message.arrival)
        return True

    def _reject(self, refused: RefusedMessage) -> None:
        if refused.sentence and self._throttle.passes(refused.reason):
            self.get_logger().warning(f'joint state rejected: {refused.sentence}')

    def _follow(
        self, outcome: EstimatorOutput, message: JointMessage, active: ActiveTopics
    ) -> None:
        # Publish the answer to an accepted message.
        arrival = message.arrival
        self._latest = outcome
        self._reference.note(outcome)
        # Compare the state with the thresholds before the results of this message are published.
        # Publishing wakes the subscribers, which then take processor time from this process. The
        # warning itself is published after the pose.
        warned = None
        if not self._estimator.is_settled(outcome.state, arrival):
            singularity = singularity_of(outcome.state)
            level, is_due = self._estimator.judge(singularity, arrival)
            warned = (singularity, level) if is_due else None
            if self._watchdog.is_canceled():  # the state was stale until this message
                self._watchdog.reset()
        is_needed = active.channels or self.settings.values['publish_tf']
        try:
            if is_needed and self._grid.passes(outcome.stamp, self.settings.period):
                self._outputs.publish(outcome, active, isinstance(message, SerializedSample))
        finally:
            # Publish the warning even after an error, because the estimator has counted it as
            # published and does not repeat it at once.
            if warned is not None:
                robot, base = self.settings.robot, self.settings.base_frame
                self._publish_warning(singularity_status(robot, *warned, base))

    def _follow_reset(self) -> None:
        self._resets = self._estimator.counts.get(outcomes.RESETS, 0)
        self._grid.forget()
        self._reference.forget()

    def _present(self) -> EstimatorOutput:
        # Return the newest state of the arm, which the answer to a target needs. Raise
        # RefusedTargetError if a joint position is unknown or stale.
        missing, latest = self._estimator.joints.missing(time.monotonic_ns()), self._latest
        if self.silent or missing or latest is None:
            names = missing or self.settings.joint_names
            reason = self.silent or self._missing_text(names)
            raise RefusedTargetError(
                f'the joint positions are not known: {reason}', code='no-positions'
            )
        return latest

    def _publish_warning(self, status_text: StatusText) -> None:
        self._warning.publish(status_message(f'{full_name(self)}: singularity', status_text))

    # Methods for stale joint states and for jumps of the ROS clock

    def _watchdog_period(self) -> float:
        period = self.settings.estimator.timeout * 1e-9 * WATCHDOG_TIMEOUT_RATIO
        return min(max(period, MIN_WATCHDOG_PERIOD), MAX_WATCHDOG_PERIOD)

    def _missing_text(self, missing: tuple[str, ...]) -> str:
        return f'no joint state of {", ".join(missing)} on {self._input.subscription.topic_name}'

    def _watch(self) -> None:
        now = time.monotonic_ns()
        if self.silent or now - self._started <= self.settings.estimator.timeout:
            return
        missing = self._estimator.joints.missing(now)
        if not missing:
            return
        if self._estimator.go_stale(now):
            sentence = '; '.join([self._missing_text(missing), *self._health.warnings])
            self._publish_warning(stale_status(self.settings.robot, sentence))
        self._watchdog.cancel()  # the next joint state starts the watchdog again

    def _on_clock_jump(self, jump: TimeJump) -> None:
        back = -jump.delta.nanoseconds
        if back > 0 and self._estimator.clock_stepped_back(
            self.get_clock().now().nanoseconds, back
        ):
            self._follow_reset()
            self.get_logger().info('the ROS clock jumped back: the state starts again')

    # Methods for statuses on /diagnostics

    def _statuses(self) -> dict[str, StatusText]:
        # Return the statuses for /diagnostics, except the status of the input.
        statuses, frames = dict[str, StatusText](), self._reference.status_text()
        if frames is not None:
            statuses['frames'] = frames
        if doubts := self.settings.doubts:
            statuses['parameters'] = StatusText(Level.WARN, '; '.join(doubts), ())
        if self._needs_efforts() and self._latest is not None:
            statuses['wrench'] = self._wrench.status(StateReport(self._latest, self.settings))
        return statuses

    def _needs_efforts(self) -> bool:
        return JointEfforts in self._outputs.active().quantities

    # Methods that apply changes of parameters

    def _take_settings(self, settings: NodeSettings) -> None:
        with self._targets.in_force:
            self._put_into_force(settings)

    def _put_into_force(self, settings: NodeSettings) -> None:
        before = self.settings.robot
        moves_alike = settings.robot.chain is before.chain
        for doubt in settings.doubts:
            if doubt not in self.settings.doubts:
                self.get_logger().warning(doubt)
        self.settings = settings
        self._estimator.configure(settings.robot, settings.estimator)
        self._grid.forget()
        self._watchdog.timer_period_ns = round(self._watchdog_period() * 1e9)
        self._outputs.configure(settings)
        self._description.configure(settings)
        self._targets.configure(settings)
        self._scaling.configure(settings)
        if not moves_alike:
            self._reference.forget()
            self._latest = self._latest and self._estimator.anew(self._latest)
            self._watchdog.reset()  # check for stale joints: some of the new arm may be stale
            if settings.robot.description.tool.motion != before.description.tool.motion:
                self.get_logger().info(tool_in_words(settings.robot))

    # Methods that answer services

    def _describe(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        topics, resolve = self._outputs.names, self.resolve_topic_name
        described = description_of(
            self.settings, self._input.subscription.topic_name, topics, resolve
        )
        response.message = json.dumps(described)
        return response
