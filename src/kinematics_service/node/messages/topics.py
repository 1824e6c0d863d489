"""
The topics a node publishes for each accepted message: one row each, in the order they go out.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    AccelStamped,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistStamped,
    TwistWithCovarianceStamped,
    VelocityStamped,
    WrenchStamped,
)
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import Float64, Float64MultiArray
from visualization_msgs.msg import MarkerArray

from ... import kernel
from ...estimation.estimator import Estimator, EstimatorOutput
from ...robot.measures import MEASURES
from ..parameters.settings import NodeSettings
from .messages import StateReport
from .output_messages import (
    NO_NUMBERS,
    Numbers,
    acceleration,
    acceleration_template,
    computed,
    jacobian_numbers,
    jacobian_template,
    link_frames,
    link_frames_template,
    measure_numbers,
    null_space_numbers,
    null_space_template,
    pose_numbers,
    pose_template,
    pose_with_covariance_numbers,
    pose_with_covariance_template,
    scalar_template,
    self_motion_numbers,
    self_motion_template,
    twist_numbers,
    twist_template,
    twist_with_covariance_numbers,
    twist_with_covariance_template,
    velocity_template,
    wrench,
    wrench_template,
)

# Reliable where every publisher offers that; room for a second at 1 kHz in which the process does
# not run.
JOINT_STATES_QOS = QoSProfile(
    depth=1000,
    reliability=ReliabilityPolicy.BEST_AVAILABLE,
    durability=DurabilityPolicy.VOLATILE,
)
OUTPUT_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
WARNING_QOS = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
DIAGNOSTICS_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# Each pose is a request that gets its answer; only the newest twist, and command, is still valid.
TARGET_POSE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
TARGET_TWIST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
COMMAND_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# As of a node's parameter services: a busy node keeps more requests than ROS's ten.
SERVICE_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


def overridable(qos: QoSProfile) -> dict[str, Any]:
    """
    Return the arguments of a topic whose quality of service a user may override by parameters.

    Overrides are written into the profile that is given: each topic needs its own.
    """
    overrides = QoSOverridingOptions.with_default_policies()
    return {'qos_profile': copy.copy(qos), 'qos_overriding_options': overrides}


JOINT_STATES = 'joint_states'
POSE = '~/pose'
WARNING = '~/singularity/warning'
DIAGNOSTICS = '/diagnostics'
DESCRIBE = '~/describe'
WRENCH_ZERO = '~/wrench/zero'
RELOAD = '~/reload'
TARGET_POSE, TARGET_TWIST = '~/target_pose', '~/target_twist'
REFERENCE_POSE = '~/reference_pose'
COMMAND, SCALE = '~/command', '~/scale'
SCALE_REASON, SERVO_STATUS = '~/scale_reason', '~/servo_status'
ROBOT_DESCRIPTION = 'robot_description'
IK_JOINT_STATES, IK_SOLUTIONS = '~/ik/joint_states', '~/ik/solutions'
IK_JOINT_VELOCITY, IK_STATUS = '~/ik/joint_velocity', '~/ik/status'
# Topics of requests, and topics of the answers to them.
TARGETS = TARGET_POSE, TARGET_TWIST, COMMAND
ANSWERS = (
    *(IK_JOINT_STATES, IK_SOLUTIONS, IK_JOINT_VELOCITY, IK_STATUS),
    *(SCALE, SCALE_REASON, SERVO_STATUS),
)


@dataclass(frozen=True)
class OutputTopic:
    """
    A topic: its name, message type, and how its messages come about.

    Attributes
    ----------
    template, numbers
        Functions of the settings that return the message without stamp and numbers, and the
        numbers of a state that go into it; None if an arm has none.
    build
        Instead of both: returns the message of a report, or None.
    of_motion
        Whether there is a message only if the velocities are known.
    depth
        What the kernel must have computed.
    period : ns
        Least difference of stamps between two messages; 0: every report.
    of
        The point it is about; empty for the tool.
    by_file
        Whether it is offered only where the robot file gives its numbers.
    of_effort
        Whether the efforts of the joint states have to be read for it.
    completed
        Adds to every answer what the topic needs besides, while somebody listens.
    """

    name: str
    type: Any
    template: Callable[[NodeSettings], Any] | None = None
    numbers: Callable[[NodeSettings], Numbers | None] = lambda settings: None
    build: Callable[[StateReport], Any] | None = None
    of_motion: bool = False
    depth: int = kernel.JACOBIAN
    period: int = 0
    of: str = ''
    by_file: bool = False
    of_effort: bool = False
    completed: Callable[[Estimator, EstimatorOutput], EstimatorOutput] | None = None


def _markers(report: StateReport) -> Any:
    # Imported when somebody subscribes: the node itself needs no scene.
    from .markers import markers_message

    return markers_message(report)


def _clearance(report: StateReport) -> Any:
    # Not among the numbers of a state: it takes ten times as long as all of them.
    return Float64(data=float(report.singularity.clearance))


TOPICS = (
    OutputTopic(POSE, PoseStamped, pose_template, pose_numbers),
    OutputTopic('~/jacobian', Float64MultiArray, jacobian_template, jacobian_numbers),
    OutputTopic('~/jacobian/stamp', Time, lambda settings: Time(), lambda settings: NO_NUMBERS),
    OutputTopic('~/twist', TwistStamped, twist_template, twist_numbers, of_motion=True),
    OutputTopic('~/velocity', VelocityStamped, velocity_template, twist_numbers, of_motion=True),
    OutputTopic(
        '~/acceleration',
        AccelStamped,
        acceleration_template,
        computed(acceleration),
        of_motion=True,
        completed=Estimator.with_accelerations,
    ),
    OutputTopic(
        '~/wrench',
        WrenchStamped,
        wrench_template,
        computed(wrench),
        of_effort=True,
        completed=Estimator.with_torques,
    ),
    OutputTopic(
        '~/pose_with_covariance',
        PoseWithCovarianceStamped,
        pose_with_covariance_template,
        pose_with_covariance_numbers,
        depth=kernel.ALL_FRAMES,
        by_file=True,
    ),
    OutputTopic(
        '~/twist_with_covariance',
        TwistWithCovarianceStamped,
        twist_with_covariance_template,
        twist_with_covariance_numbers,
        of_motion=True,
        depth=kernel.ALL_FRAMES,
        by_file=True,
    ),
    *(
        OutputTopic(
            f'~/singularity/{measure.name}', Float64, scalar_template, measure_numbers(measure)
        )
        for measure in reversed(MEASURES.values())  # the distance last
    ),
    OutputTopic(
        '~/null_space',
        Float64MultiArray,
        null_space_template,
        null_space_numbers,
        by_file=True,
        completed=Estimator.with_null_space,
    ),
    OutputTopic(
        '~/null_space/away',
        Float64MultiArray,
        self_motion_template,
        self_motion_numbers,
        by_file=True,
        completed=Estimator.with_null_space,
    ),
    OutputTopic('~/singularity/clearance', Float64, build=_clearance),
    OutputTopic(
        '~/link_frames',
        PoseArray,
        link_frames_template,
        computed(link_frames),
        depth=kernel.ALL_FRAMES,
    ),
    # Markers are for viewers: some fifty of them are a hundred times the work of a pose.
    OutputTopic(
        '~/markers',
        MarkerArray,
        build=_markers,
        depth=kernel.ALL_FRAMES,
        period=33_000_000,
    ),
)


# What there is of a point besides the tool.
OF_POINTS = tuple(
    topic
    for topic in TOPICS
    if topic.name
    in (POSE, '~/jacobian', '~/jacobian/stamp', '~/twist', '~/acceleration', '~/wrench')
)


def topics_of(settings: NodeSettings) -> tuple[OutputTopic, ...]:
    """Return the topics of a node: those of the tool, then those of each point."""
    of_tool = (
        topic for topic in TOPICS if not topic.by_file or topic.numbers(settings) is not None
    )
    return (
        *of_tool,
        *(
            replace(topic, name=topic.name.replace('~', f'~/{point}'), of=point)
            for point in settings.points
            for topic in OF_POINTS
        ),
    )
