"""The node: JointState in; pose, Jacobian, twist and singularity warning out."""

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
from ..estimation.estimator import (
    RESETS,
    UNREADABLE,
    Estimator,
    EstimatorOutput,
    JointMessage,
    RefusedMessage,
)
from ..estimation.joint_efforts import JointEfforts
from ..estimation.joint_state_form import SerializedSample
from ..estimation.status_text import StatusText, singularity_status, stale_status
from ..kinematics.singularity import Singularity, singularity_of
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

# Period of the watchdog as a share of the timeout, and its shortest and longest value (s).
WATCHDOG_SHARE, WATCHDOG_SHORTEST, WATCHDOG_LONGEST = 0.25, 0.02, 0.25


class KinematicsNode(Node):
    """
    Answers JointState messages about one arm; all decisions are the estimator's.

    Parameters
    ----------
    robot
        File, bundled name or topic, as given on the command line; None to take the parameter
        `robot`.
    stopped
        Whether to wait no longer for a description on a topic.
    node_name
        Of the node, unless it is remapped.
    topic
        Of the joint states, likewise.
    **options
        As rclpy.node.Node takes them: `context`, `namespace`, `parameter_overrides`, ...

    Raises
    ------
    KinematicsError
        The robot or a parameter is bad; one sentence, to be shown to the user.
    StoppedWaiting
        No description came on a topic before `stopped()` was true.

    Attributes
    ----------
    is_started
        Whether its topics are there.
    silent
        Why it answers nothing; empty where it answers.
    """

    def __init__(
        self,
        robot: str | None = None,
        stopped: Callable[[], bool] = lambda: False,
        node_name: str = NODE_NAME,
        topic: str = JOINT_STATES,
        **options: Any,
    ) -> None:
        self._throttle = Throttle(5.0)  # rclpy subscribes to /clock at once
        super().__init__(node_name, **options)
        self.is_started = False
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

        self._own = NodeParameters(self, robot, stopped, report)
        settings = self._settings = self._own.settings
        self._estimator = Estimator(settings.robot, settings.estimator)
        self._latest: EstimatorOutput | None = None
        self._resets = 0  # the estimator's resets that are handled here
        self._grid = StampGrid()
        self._open_topics(topic)
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
        self._wrench = WrenchBias(self, self._estimator, self._hears_efforts)
        self._own.listen(self._take_settings)
        self._reload = Reload(self, self._own, self._take_settings)
        if self._own.description is not None:
            self._own.description.then = self._reload.read
        self._jump = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1)),
            post_callback=self._on_clock_jump,
        )
        self._started = time.monotonic_ns()
        self.is_started = True
        introduce(self, self._own, self._input.topic_name)

    def _open_topics(self, topic: str) -> None:
        transport = self._own.transport
        self._outputs = Outputs(self, self.settings, transport)
        self._description = DescriptionPublisher(self, self.settings)
        self._targets = Targets(self, self.settings, self._present)
        self._scaling = Scaling(self, self.settings, self._present)
        self._input = Input(self, topic, transport, self._take, self._refuse)
        self.create_service(Trigger, DESCRIBE, self._describe, qos_profile=SERVICE_QOS)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[..., None], *args: Any, **options: Any
    ) -> Any:
        """As of rclpy; of /clock a negative time is ignored, which rclpy raises an error for."""

        def set_clock(message: Any) -> None:
            if message.clock.sec >= 0:
                callback(message)
            elif self._throttle.passes(CLOCK_TOPIC):
                self.get_logger().warning(
                    f'the time {message.clock.sec} s on {CLOCK_TOPIC} is negative: it is ignored'
                )

        heard = set_clock if topic == CLOCK_TOPIC else callback
        return super().create_subscription(msg_type, topic, heard, *args, **options)

    def set_parameters_atomically(self, parameter_list: Any) -> Any:
        """As of rclpy; the reason of a success is what is doubtful in it, which clients print."""
        result = super().set_parameters_atomically(parameter_list)
        if result.successful and self.is_started:
            own = tuple(f'parameter {parameter.name}:' for parameter in parameter_list)
            result.reason = '; '.join(one for one in self.settings.doubts if one.startswith(own))
        return result

    def trust_the_order_of_events(self) -> None:
        """Note that the executor handles events in the order of their arrival."""
        self._outputs.events_in_order = True

    def events_were_left_out(self, messages: int) -> None:
        """Note that messages were passed over, of which the process had received this many."""
        self._estimator.counts[LEFT_OUT] += messages
        if self._throttle.passes(LEFT_OUT):
            self.get_logger().warning(
                'messages come faster than they can be answered: the oldest are left out'
            )

    def end_motion(self) -> None:
        """Stop the motion of the last target twist; called before the node ends."""
        self._targets.stop()

    def destroy_node(self) -> None:
        """Release what the node has; its targets get no more answers."""
        if self.is_started:
            self._targets.close()
        super().destroy_node()

    def fall_silent(self, reason: str) -> None:
        """Answer nothing from now on, and say why."""
        self.silent = reason
        if self.is_started:
            self.end_motion()
            self._say(stale_status(self.settings.robot, reason))

    def forget_joints(self) -> None:
        """Forget the state of the joints, as if no message had come."""
        self._estimator.reset()
        self._latest = None
        self._follow_reset()

    def read_robot_again(self) -> None:
        """
        Read the robot of the file again and put it into force.

        Raises
        ------
        KinematicsError
            It has faults; the one before stays in force.
        """
        self._take_settings(self._own.take(self._own.reading_again()()))

    @property
    def settings(self) -> NodeSettings:
        """Return the settings in force."""
        return self._settings

    # Messages

    def _refuse(self, sentence: str) -> None:
        self._estimator.counts[UNREADABLE] += 1
        self._reject(RefusedMessage(UNREADABLE, sentence))

    def _take(self, message: JointMessage) -> bool:
        # Answers a message; returns whether it was taken, which bytes are not by every reader.
        if self.silent:
            return True
        try:
            active = self._outputs.active()
            outcome = self._estimator.take(
                message, active.depth, active.messages, active.quantities
            )
            if outcome is None:
                return False
            if self._estimator.counts.get(RESETS, 0) != self._resets:
                self._start_anew()
            if isinstance(outcome, RefusedMessage):
                self._reject(outcome)
            else:
                self._follow(outcome, message, active)
        except Exception as error:  # no message of a robot may stop the node
            self._internal_error(error)
        self._health.work.add(time.monotonic_ns() - message.arrival)
        return True

    def _reject(self, refused: RefusedMessage) -> None:
        if refused.sentence and self._throttle.passes(refused.reason):
            self.get_logger().warning(f'joint state rejected: {refused.sentence}')

    def _internal_error(self, error: Exception) -> None:
        self._estimator.counts[INTERNAL_ERROR] += 1
        self._throttle.internal_error(self, 'a message', error)

    def _follow(
        self, outcome: EstimatorOutput, message: JointMessage, active: ActiveTopics
    ) -> None:
        # Publishes the consequences of a message.
        arrival = message.arrival
        self._latest = outcome
        self._reference.note(outcome)
        # Publishing wakes subscribers, who take this core: other work is cheaper before it. A
        # warning comes after the pose it is about.
        warned = None
        if not self._estimator.is_settled(outcome.state, arrival):
            singularity = singularity_of(outcome.state)
            level, say = self._estimator.judge(singularity, arrival)
            warned = (singularity, level) if say else None
            if self._watchdog.is_canceled():  # the state was stale
                self._watchdog.reset()
        wanted = active.channels or self._settings.publish_tf
        try:
            if wanted and self._grid.passes(outcome.stamp, self._settings.period):
                self._outputs.publish(outcome, active, isinstance(message, SerializedSample))
        finally:
            if warned is not None:  # the alarm counts it as published
                self._warn(*warned)

    def _follow_reset(self) -> None:
        self._resets = self._estimator.counts.get(RESETS, 0)
        self._grid.forget()
        self._reference.forget()

    def _start_anew(self) -> None:
        # The estimator has started again: a stamp stepped back.
        self._follow_reset()
        if self._throttle.passes(RESETS):
            self.get_logger().info(
                'stamps stepped back by more than joint_state_timeout: the state starts again'
            )

    def _present(self) -> EstimatorOutput:
        # Returns the arm's present state, which a target needs.
        missing, latest = self._estimator.missing(time.monotonic_ns()), self._latest
        if self.silent or missing or latest is None:
            names = missing or self._settings.joint_names
            reason = self.silent or self._missing_text(names)
            raise RefusedTargetError(f'the joint positions are not known: {reason}')
        return latest

    def _warn(self, singularity: Singularity, level: Level) -> None:
        settings = self._settings
        self._say(singularity_status(settings.robot, singularity, level, settings.base_frame))

    def _say(self, status_text: StatusText) -> None:
        self._warning.publish(status_message(f'{full_name(self)}: singularity', status_text))

    # Clocks and watches

    def _watchdog_period(self) -> float:
        period = self.settings.estimator.timeout * 1e-9 * WATCHDOG_SHARE
        return min(max(period, WATCHDOG_SHORTEST), WATCHDOG_LONGEST)

    def _missing_text(self, missing: tuple[str, ...]) -> str:
        return f'no joint state of {", ".join(missing)} on {self._input.topic_name}'

    def _watch(self) -> None:
        now = time.monotonic_ns()
        if self.silent or now - self._started <= self.settings.estimator.timeout:
            return
        missing = self._estimator.missing(now)
        if not missing:
            return
        if self._estimator.go_stale(now):
            sentence = '; '.join([self._missing_text(missing), *self._health.warnings])
            self._say(stale_status(self.settings.robot, sentence))
        self._watchdog.cancel()  # stale it stays until the next state, which sets the timer again

    def _on_clock_jump(self, jump: TimeJump) -> None:
        back = -jump.delta.nanoseconds
        if back > 0 and self._estimator.clock_stepped_back(
            self.get_clock().now().nanoseconds, back
        ):
            self._follow_reset()
            self.get_logger().info('the ROS clock jumped back: the state starts again')

    # Diagnostics

    def _statuses(self) -> dict[str, StatusText]:
        # Those beside the state of the input.
        found, frames = dict[str, StatusText](), self._reference.status_text()
        if frames is not None:
            found['frames'] = frames
        if doubts := self._settings.doubts:
            found['parameters'] = StatusText(Level.WARN, '; '.join(doubts), ())
        if self._hears_efforts() and self._latest is not None:
            found['wrench'] = self._wrench.status(StateReport(self._latest, self._settings))
        return found

    def _hears_efforts(self) -> bool:
        return JointEfforts in self._outputs.active().quantities

    # Parameters

    def _take_settings(self, settings: NodeSettings) -> None:
        with self._targets.in_force:
            self._put_into_force(settings)

    def _put_into_force(self, settings: NodeSettings) -> None:
        before = self._settings.robot
        moves_alike = settings.robot.chain is before.chain
        for doubt in settings.doubts:
            if doubt not in self._settings.doubts:
                self.get_logger().warning(doubt)
        self._settings = settings
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
            self._watchdog.reset()  # what is stale may be other joints now
            if settings.robot.description.tool.motion != before.description.tool.motion:
                self.get_logger().info(tool_in_words(settings.robot))

    # Services

    def _describe(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        topics, resolve = self._outputs.names, self.resolve_topic_name
        described = description_of(self.settings, self._input.topic_name, topics, resolve)
        response.message = json.dumps(described)
        return response
