"""
The topics a node publishes for each accepted message: one row each, in the order they go out.
"""

import copy
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
from ...estimation.joint_accelerations import JointAccelerations
from ...estimation.joint_efforts import JointEfforts
from ...kinematics.null_space import self_motion_of
from ...robot.measures import MEASURES
from ..parameters.settings import NodeSettings
from .messages import StateReport
from .output_messages import (
    NO_NUMBERS,
    Built,
    ContentOf,
    Template,
    acceleration,
    computed,
    in_base_frame,
    in_tool_frame,
    in_twist_frame,
    jacobian_numbers,
    jacobian_template,
    link_frames,
    link_frames_template,
    measure_numbers,
    null_space_template,
    of_null_space,
    pose_numbers,
    pose_with_covariance_numbers,
    self_motion_template,
    twist_numbers,
    twist_with_covariance_numbers,
    velocity_template,
    wrench,
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
    A topic that answers every joint state.

    Attributes
    ----------
    name, type
        Its name and message type.
    content
        A function of the settings that says what a message is made of; None if the robot file has
        not what it needs, and there is no such topic.
    template
        A function of the settings that returns the message without stamp and numbers.
    of
        The point it is about; empty for the tool.
    """

    name: str
    type: Any
    content: ContentOf
    template: Template | None = None
    of: str = ''

    def blank(self, settings: NodeSettings) -> Any:
        """Return the message without stamp and numbers."""
        return self.type() if self.template is None else self.template(settings)


def _markers(report: StateReport) -> Any:
    # Imported when somebody subscribes: the node itself needs no scene.
    from .markers import markers_message

    return markers_message(report)


TOPICS = (
    OutputTopic(POSE, PoseStamped, pose_numbers, in_base_frame(PoseStamped)),
    OutputTopic('~/jacobian', Float64MultiArray, jacobian_numbers, jacobian_template),
    OutputTopic('~/jacobian/stamp', Time, lambda settings: NO_NUMBERS),
    OutputTopic('~/twist', TwistStamped, twist_numbers, in_twist_frame(TwistStamped)),
    OutputTopic('~/velocity', VelocityStamped, twist_numbers, velocity_template),
    OutputTopic(
        '~/acceleration',
        AccelStamped,
        computed(acceleration, JointAccelerations),
        in_twist_frame(AccelStamped),
    ),
    OutputTopic(
        '~/wrench', WrenchStamped, computed(wrench, JointEfforts), in_tool_frame(WrenchStamped)
    ),
    OutputTopic(
        '~/pose_with_covariance',
        PoseWithCovarianceStamped,
        pose_with_covariance_numbers,
        in_base_frame(PoseWithCovarianceStamped),
    ),
    OutputTopic(
        '~/twist_with_covariance',
        TwistWithCovarianceStamped,
        twist_with_covariance_numbers,
        in_twist_frame(TwistWithCovarianceStamped),
    ),
    *(
        OutputTopic(f'~/singularity/{measure.name}', Float64, measure_numbers(measure))
        for measure in reversed(MEASURES.values())  # the distance last
    ),
    OutputTopic(
        '~/null_space',
        Float64MultiArray,
        of_null_space(lambda state, basis: basis),
        null_space_template,
    ),
    OutputTopic(
        '~/null_space/away',
        Float64MultiArray,
        of_null_space(self_motion_of),
        self_motion_template,
    ),
    # Not among the numbers of a state: it takes ten times as long as all of them.
    OutputTopic(
        '~/singularity/clearance', Float64, computed(lambda report: report.singularity.clearance)
    ),
    OutputTopic(
        '~/link_frames',
        PoseArray,
        computed(link_frames, depth=kernel.ALL_FRAMES),
        link_frames_template,
    ),
    # Markers are for viewers: some fifty of them are a hundred times the work of a pose.
    OutputTopic(
        '~/markers',
        MarkerArray,
        lambda settings: Built(_markers, kernel.ALL_FRAMES, period=33_000_000),
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
    return (
        *(topic for topic in TOPICS if topic.content(settings) is not None),
        *(
            replace(topic, name=topic.name.replace('~', f'~/{point}'), of=point)
            for point in settings.points
            for topic in OF_POINTS
        ),
    )
