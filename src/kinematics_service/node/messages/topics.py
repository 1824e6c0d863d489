# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the names of the node's topics and services, and their quality of service."""

import copy
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

# The subscription is reliable if every publisher offers reliability. The queue holds the messages
# of 1 s at 1 kHz, so that no message is lost during a short stall of the process.
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
# Queue up to ten target poses. Queue only one twist and one command, because only the newest twist
# and command are valid.
TARGET_POSE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
TARGET_TWIST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
COMMAND_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# Queue up to 1000 requests while the node is busy, as the parameter services of a node do. By
# default, ROS queues ten requests.
SERVICE_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


def overridable(qos: QoSProfile) -> dict[str, Any]:
    """
    Return arguments that give a publisher or a subscription the quality of service `qos`.

    Parameters of the node can override this quality of service. Each topic gets a copy of `qos`,
    because rclpy writes overrides into the copy.
    """
    overrides = QoSOverridingOptions.with_default_policies()
    return {'qos_profile': copy.copy(qos), 'qos_overriding_options': overrides}


def output_publisher(node: Node, kind: type, name: str) -> Publisher:
    """
    Return a publisher for results of the node. Parameters can override its quality of service.
    """
    return node.create_publisher(kind, name, **overridable(OUTPUT_QOS))


def raw_subscription(
    node: Node, kind: type, name: str, take: Callable[[bytes], None], qos: QoSProfile
) -> Subscription:
    """
    Return a subscription that passes the bytes of messages. Parameters can override its quality of
    service.

    The node decodes the bytes itself, because the middleware does not report why it refuses bytes.
    """
    return node.create_subscription(kind, name, take, raw=True, **overridable(qos))


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
# Topics on which the node receives targets and commands; the node answers on other topics.
TARGETS = TARGET_POSE, TARGET_TWIST, COMMAND
ANSWERS = (
    *(IK_JOINT_STATES, IK_SOLUTIONS, IK_JOINT_VELOCITY, IK_STATUS),
    *(SCALE, SCALE_REASON, SERVO_STATUS),
)
