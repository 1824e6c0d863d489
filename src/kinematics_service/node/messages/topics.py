"""The names of the node's topics and services, and their quality of service."""

import copy
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

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
