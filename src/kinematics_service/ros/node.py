"""
The node: JointState in; pose, Jacobian, twist and singularity warning out.

"""

import copy
import json
import time
from collections import Counter
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ..estimator import RESETS, Estimator, Refusal
from ..notice import Notice, notice_of, stale_notice, structure_in_words
from ..singularities import Singularity, singularity_of
from .describe import description_of
from .diagnostics import INTERNAL_ERROR, InputState, Work, input_notice
from .messages import Report, sample_of, stamp_of, status_message, transform_message
from .parameters import NodeParameters
from .settings import Settings
from .stamp_grid import StampGrid
from .throttle import Throttle
from .topics import (
    DESCRIBE,
    DIAGNOSTICS,
    DIAGNOSTICS_QOS,
    JOINT_STATES,
    JOINT_STATES_QOS,
    OUTPUT_QOS,
    TOPICS,
    WARNING,
    WARNING_QOS,
    warm_up,
)

NODE_NAME = 'kinematics'

# The watchdog looks so often, as a share of the timeout, and at most and at least so often (s).
WATCHDOG_SHARE, WATCHDOG_SHORTEST, WATCHDOG_LONGEST = 0.25, 0.02, 0.25


class KinematicsNode(Node):
    """
    Answers JointState messages about one arm; all decisions are the estimator's.

    Parameters
    ----------
    robot
        File or bundled name, as given on the command line; None to take the parameter `robot`.
    **options
        As rclpy.node.Node takes them: `context`, `namespace`, `parameter_overrides`, ...

    Raises
    ------
    KinematicsError
        The robot or a parameter is bad; one sentence, to be shown to the user.

    """

    def __init__(self, robot: str | None = None, **options: Any) -> None:
        super().__init__(NODE_NAME, **options)
        try:
            self._start(robot)
        except BaseException:
            self.destroy_node()
            raise

    def _start(self, robot: str | None) -> None:
        self._own = NodeParameters(self, robot)
        settings = self._own.settings
        warm_up(settings)
        self._estimator = Estimator(settings.robot, settings.estimator)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._work = Work()
        self._counts_said: Counter[str] = Counter()
        self._diagnosed = time.monotonic()
        self._velocity_source = 'none'
        self._grid = StampGrid()
        self._throttle = Throttle(5.0)
        self._open_topics()
        self._watchdog = self.create_timer(
            self._watchdog_period(), self._watch, clock=self._steady
        )
        self.create_timer(1.0, self._diagnose, clock=self._steady)
        self._own.listen(self._take_settings)
        self._jump = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1)),
            post_callback=self._on_clock_jump,
        )
        self._started = time.monotonic_ns()
        self._introduce()

    def _open_topics(self) -> None:
        # Overrides are written into the profile that is given: each topic needs its own.
        overridable = QoSOverridingOptions.with_default_policies()
        self._outputs: list[tuple[Publisher, Any]] = [
            (
                self.create_publisher(
                    topic.type,
                    topic.name,
                    copy.copy(OUTPUT_QOS),
                    qos_overriding_options=overridable,
                ),
                topic.build,
            )
            for topic in TOPICS
        ]
        self._warning = self.create_publisher(DiagnosticStatus, WARNING, WARNING_QOS)
        self._diagnostics = self.create_publisher(DiagnosticArray, DIAGNOSTICS, DIAGNOSTICS_QOS)
        self._tf: Publisher | None = None
        self._open_tf()
        self._subscription = self.create_subscription(
            JointState,
            JOINT_STATES,
            self._on_joint_state,
            copy.copy(JOINT_STATES_QOS),
            qos_overriding_options=overridable,
        )
        self.create_service(Trigger, DESCRIBE, self._describe)

    def _open_tf(self) -> None:
        if self.settings.publish_tf and self._tf is None:
            from tf2_msgs.msg import TFMessage  # not among the wheels: only where it is asked for

            self._tf = self.create_publisher(TFMessage, '/tf', OUTPUT_QOS)

    @property
    def _full_name(self) -> str:
        # With the namespace: two arms share /diagnostics.
        return str(self.get_fully_qualified_name()).lstrip('/')

    @property
    def settings(self) -> Settings:
        """
        Return the settings in force.

        """
        return self._own.settings

    # Start

    def _introduce(self) -> None:
        robot = self.settings.robot
        by_default = ' (the default; choose with --robot)' if self._own.by_default else ''
        which = robot.name + by_default
        self.get_logger().info(
            f'robot {which}: {robot.dof} joints, {robot.convention}, '
            f'{self.settings.base_frame} to {self.settings.tool_frame}; '
            f'listening to {self._subscription.topic_name}'
        )
        for name in self._own.unknown():
            self.get_logger().warning(f'parameter {name} is unknown and has no effect')
        if robot.task.structurally_deficient:
            self.get_logger().warning(
                f'{structure_in_words(robot)}; measures are taken over '
                f'{robot.task.generic_rank} singular values'
            )

    # Messages

    def _on_joint_state(self, message: JointState) -> None:
        begin = time.perf_counter()
        try:
            self._answer(message)
        except Exception as error:  # nothing a robot sends may stop the node
            self._estimator.counts[INTERNAL_ERROR] += 1
            if self._throttle.passes('internal'):
                self.get_logger().error(
                    f'internal error at a message, please report it: {error!a}'
                )
        self._work.add(time.perf_counter() - begin)

    def _answer(self, message: JointState) -> None:
        arrival = time.monotonic_ns()
        stamp = stamp_of(message)
        received = stamp or self.get_clock().now().nanoseconds
        resets = self._estimator.counts[RESETS]
        outcome = self._estimator.take(sample_of(message, received, arrival))
        if self._estimator.counts[RESETS] != resets:
            self._grid.forget()
            if self._throttle.passes(RESETS):
                self.get_logger().info(
                    'stamps stepped back by more than joint_state_timeout: starting anew'
                )
        if isinstance(outcome, Refusal):
            if outcome.sentence and self._throttle.passes(outcome.reason):
                self.get_logger().warning(f'joint state rejected: {outcome.sentence}')
            return
        self._velocity_source = outcome.velocity_source
        report = Report(outcome, singularity_of(outcome.state), self.settings)
        if self._grid.passes(outcome.stamp, self.settings.period):
            for publisher, build in self._outputs:
                if publisher.get_subscription_count() > 0:
                    built = build(report)
                    if built is not None:
                        publisher.publish(built)
            if self.settings.publish_tf:
                self._publish_tf(report)
        self._warn(report.singularity, arrival)

    def _publish_tf(self, report: Report) -> None:
        from tf2_msgs.msg import TFMessage

        assert self._tf is not None
        self._tf.publish(TFMessage(transforms=[transform_message(report)]))

    def _warn(self, singularity: Singularity, arrival: int) -> None:
        level, say = self._estimator.judge(singularity, arrival)
        if not say:
            return
        settings = self.settings
        notice = notice_of(
            settings.robot,
            singularity,
            level,
            settings.base_frame,
            settings.estimator.joint_prefix,
        )
        self._say(notice)

    def _say(self, notice: Notice) -> None:
        self._warning.publish(status_message(f'{self._full_name}: singularity', notice))

    # Clocks and watches

    def _watchdog_period(self) -> float:
        period = self.settings.estimator.timeout * 1e-9 * WATCHDOG_SHARE
        return min(max(period, WATCHDOG_SHORTEST), WATCHDOG_LONGEST)

    def _watch(self) -> None:
        now = time.monotonic_ns()
        if now - self._started <= self.settings.estimator.timeout:
            return
        missing = self._estimator.missing(now)
        if missing and self._estimator.go_stale(now):
            sentence = f'no joint state of {", ".join(missing)} on {self._subscription.topic_name}'
            self._say(stale_notice(self.settings.robot, sentence))

    def _on_clock_jump(self, jump: TimeJump) -> None:
        back = -jump.delta.nanoseconds
        if back > 0 and self._estimator.clock_stepped_back(
            self.get_clock().now().nanoseconds, back
        ):
            self._grid.forget()
            self.get_logger().info('the ROS clock jumped back: starting anew')

    def _diagnose(self) -> None:
        now, arrival = time.monotonic(), time.monotonic_ns()
        counts = Counter(self._estimator.counts)
        publishers = self.get_publishers_info_by_topic(self._subscription.topic_name)
        state = InputState(
            counts=counts,
            news=counts - self._counts_said,
            interval=now - self._diagnosed,
            age=self._estimator.age(arrival),
            missing=self._estimator.missing(arrival),
            beyond=self._estimator.beyond_limits(),
            disputed=self._estimator.disputed(arrival) if len(publishers) > 1 else (),
            publishers=sorted(
                f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in publishers
            ),
            velocity_source=self._velocity_source,
            topic=self._subscription.topic_name,
            robot=self.settings.robot.name,
            work=self._work,
        )
        self._work, self._counts_said, self._diagnosed = Work(), counts, now
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        message.status = [status_message(f'{self._full_name}: input', input_notice(state))]
        self._diagnostics.publish(message)

    # Parameters

    def _take_settings(self, settings: Settings) -> None:
        self._estimator.configure(settings.robot, settings.estimator)
        self._grid.forget()
        self._watchdog.timer_period_ns = round(self._watchdog_period() * 1e9)
        self._open_tf()

    # Service

    def _describe(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        outputs = [publisher for publisher, _ in self._outputs]
        topics = [
            publisher.topic_name for publisher in (*outputs, self._warning, self._diagnostics)
        ]
        response.success = True
        response.message = json.dumps(
            description_of(self.settings, self._subscription.topic_name, topics)
        )
        return response
