"""
The topics a node publishes for each accepted message: one row each, in the order they go out.

"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped, VelocityStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Float64MultiArray

from ..estimator import Answer
from ..kernel import ALL_FRAMES
from ..singularities import singularity_of
from ..task import seeded_poses
from ..tool_state import evaluate
from .messages import (
    Report,
    jacobian_message,
    link_frames_message,
    pose_message,
    scalar_message,
    twist_message,
    velocity_message,
)
from .settings import Settings

# A best-effort subscription hears reliable and best-effort publishers alike.
JOINT_STATES_QOS = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
OUTPUT_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
WARNING_QOS = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
DIAGNOSTICS_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)

JOINT_STATES = 'joint_states'
WARNING = '~/singularity/warning'
DIAGNOSTICS = '/diagnostics'
DESCRIBE = '~/describe'


@dataclass(frozen=True)
class Topic:
    """
    A topic: its name, message type, and the builder, which returns None for nothing to say.

    """

    name: str
    type: Any
    build: Callable[[Report], Any]


def _measure(name: str) -> Topic:
    def build(report: Report) -> Float64 | None:
        return scalar_message(getattr(report.singularity, name))

    return Topic(f'~/singularity/{name}', Float64, build)


TOPICS = (
    Topic('~/pose', PoseStamped, pose_message),
    Topic('~/jacobian', Float64MultiArray, jacobian_message),
    Topic('~/twist', TwistStamped, twist_message),
    Topic('~/velocity', VelocityStamped, velocity_message),
    _measure('determinant'),
    _measure('manipulability'),
    _measure('condition_number'),
    _measure('smallest_singular_value'),
    _measure('distance'),
    Topic('~/link_frames', PoseArray, link_frames_message),
)


def warm_up(settings: Settings) -> None:
    """
    Build every message once: the kernel is compiled, or read from its cache, before the first one.

    """
    robot = settings.robot
    prismatic = [kind == 'prismatic' for kind in robot.joint_types]
    q = seeded_poses(robot.limits, prismatic)[0]
    state = evaluate(robot, q, q, depth=ALL_FRAMES)
    answer = Answer(state, state.quaternion_xyzw, 0, 'message')
    report = Report(answer, singularity_of(state), settings)
    for topic in TOPICS:
        topic.build(report)
