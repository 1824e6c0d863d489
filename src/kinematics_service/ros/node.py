"""
The node: JointState in; pose, Jacobian, twist and singularity warning out.

"""

import copy
import json
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ..errors import KinematicsError
from ..estimator import NOT_STAMPED, RESETS, Answer, Estimator, Refusal
from ..measures import Level
from ..notice import Notice, notice_of, stale_notice, structure_in_words
from ..robot import Robot, load_robot
from ..singularities import Singularity, singularity_of
from ..task import seeded_poses
from ..tool_state import evaluate
from .describe import description_of
from .diagnostics import INTERNAL_ERROR, InputState, Work, input_notice
from .messages import Report, sample_of, stamp_of, status_message, transform_message
from .settings import PARAMETERS, ROBOT, Settings, SettingsError, defaults, settings_from
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
)

NODE_NAME = 'kinematics'
DEFAULT_ROBOT = ROBOT.default

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
        name = self._declare(ROBOT.name, robot or ROBOT.default, ROBOT.descriptor())
        if robot is not None and name != robot:
            raise RobotConflictError(
                f'--robot {robot} and the parameter robot:={name} differ; give one of them'
            )
        self._file_robot: Robot = load_robot(name)
        for parameter in PARAMETERS:
            default = defaults(self._file_robot)[parameter.name]
            self._declare(parameter.name, default, parameter.descriptor())
        self._settings = settings_from(self._values(), self._file_robot)
        self._estimator = Estimator(self._settings.robot, self._settings.estimator)
        self._warm_up()

        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._work = Work()
        self._counts_said: Counter[str] = Counter()
        self._diagnosed = time.monotonic()
        self._velocity_source = 'none'
        self._last_published: int | None = None
        self._throttle = Throttle(5.0)
        self._open_topics()
        self._watchdog = self.create_timer(
            self._watchdog_period(), self._watch, clock=self._steady
        )
        self.create_timer(1.0, self._diagnose, clock=self._steady)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self._jump = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1)),
            post_callback=self._on_clock_jump,
        )
        self._started = time.monotonic_ns()
        self._introduce(default=robot is None and name == ROBOT.default)

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
        if self._settings.publish_tf and self._tf is None:
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
        return self._settings

    # Start

    def _declare(self, name: str, default: Any, descriptor: Any) -> Any:
        try:
            return self.declare_parameter(name, default, descriptor).value
        except InvalidParameterTypeException as error:
            hint = ' (write 1.0, not 1)' if isinstance(default, float) else ''
            kind = {str: 'a string', bool: 'true or false', float: 'a number with a point'}
            raise SettingsError(
                f'parameter {name} must be {kind[type(default)]}{hint}: {error}'
            ) from None
        except InvalidParameterValueException as error:
            raise SettingsError(f'parameter {name} is refused: {error}') from None

    def _values(self) -> dict[str, Any]:
        return {
            parameter.name: self.get_parameter(parameter.name).value for parameter in PARAMETERS
        }

    def _warm_up(self) -> None:
        # Compiles the kernel, or reads it from its cache, before the first message.
        robot = self._settings.robot
        prismatic = [kind == 'prismatic' for kind in robot.joint_types]
        q = seeded_poses(robot.limits, prismatic)[0]
        state = evaluate(robot, q, q, depth=2)
        report = Report(
            Answer(state, state.quaternion_xyzw, 0, 'message'),
            singularity_of(state),
            self._settings,
        )
        for topic in TOPICS:
            topic.build(report)

    def _introduce(self, default: bool) -> None:
        robot = self._settings.robot
        which = f'{robot.name} (the default; choose with --robot)' if default else robot.name
        self.get_logger().info(
            f'robot {which}: {robot.dof} joints, {robot.convention}, '
            f'{self._settings.base_frame} to {self._settings.tool_frame}; '
            f'listening to {self._subscription.topic_name}'
        )
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
            self._last_published = None
            if self._throttle.passes(RESETS):
                self.get_logger().info(
                    'stamps stepped back by more than joint_state_timeout: starting anew'
                )
        if isinstance(outcome, Refusal):
            if outcome.sentence and self._throttle.passes(outcome.reason):
                self.get_logger().warning(f'joint state rejected: {outcome.sentence}')
            return
        self._velocity_source = outcome.velocity_source
        due = self._is_due(outcome.stamp)
        report = Report(outcome, singularity_of(outcome.state), self._settings)
        if due:
            for publisher, build in self._outputs:
                if publisher.get_subscription_count() > 0:
                    built = build(report)
                    if built is not None:
                        publisher.publish(built)
            if self._settings.publish_tf:
                self._publish_tf(report)
        self._warn(report.singularity, arrival)

    def _is_due(self, stamp: int) -> bool:
        # Thins out by stamp on a fixed grid, so that the rate holds whatever the input's is.
        period = self._settings.period
        if period == 0:
            return True
        slot = stamp // period
        if slot == self._last_published:
            return False
        self._last_published = slot
        return True

    def _publish_tf(self, report: Report) -> None:
        from tf2_msgs.msg import TFMessage

        assert self._tf is not None
        self._tf.publish(TFMessage(transforms=[transform_message(report)]))

    def _warn(self, singularity: Singularity, arrival: int) -> None:
        level, say = self._estimator.judge(singularity, arrival)
        if not say:
            return
        settings = self._settings
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
        period = self._settings.estimator.timeout * 1e-9 * WATCHDOG_SHARE
        return min(max(period, WATCHDOG_SHORTEST), WATCHDOG_LONGEST)

    def _watch(self) -> None:
        now = time.monotonic_ns()
        if now - self._started <= self._settings.estimator.timeout:
            return
        missing = self._estimator.missing(now)
        if missing and self._estimator.go_stale(now):
            sentence = f'no joint state of {", ".join(missing)} on {self._subscription.topic_name}'
            self._say(stale_notice(self._settings.robot, sentence))

    def _on_clock_jump(self, jump: TimeJump) -> None:
        back = -jump.delta.nanoseconds
        if back > 0 and self._estimator.clock_stepped_back(
            self.get_clock().now().nanoseconds, back
        ):
            self._last_published = None
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
            robot=self._settings.robot.name,
            work=self._work,
        )
        self._work, self._counts_said, self._diagnosed = Work(), counts, now
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        message.status = [status_message(f'{self._full_name}: input', input_notice(state))]
        self._diagnostics.publish(message)

    # Parameters

    def _check_parameters(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        result = SetParametersResult(successful=True)
        known = {parameter.name for parameter in PARAMETERS}
        changes = {
            parameter.name: parameter.value for parameter in parameters if parameter.name in known
        }
        if changes:
            try:
                self._settings_with(changes)
            except KinematicsError as error:
                result.successful = False
                result.reason = str(error)
        return result

    def _settings_with(self, changes: Mapping[str, Any]) -> Settings:
        return settings_from({**self._values(), **changes}, self._file_robot)

    def _apply_parameters(self, parameters: Sequence[RosParameter]) -> None:
        known = {parameter.name for parameter in PARAMETERS}
        if not any(parameter.name in known for parameter in parameters):
            return
        self._settings = self._settings_with({})
        self._estimator.configure(self._settings.robot, self._settings.estimator)
        self._last_published = None
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
            description_of(self._settings, self._subscription.topic_name, topics)
        )
        return response


class RobotConflictError(KinematicsError, ValueError):
    """
    The command line and a parameter name different robots: wrong usage.

    """


__all__ = ['NODE_NAME', 'NOT_STAMPED', 'KinematicsNode', 'Level', 'RobotConflictError']
