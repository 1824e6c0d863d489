"""
The topics a node publishes for each accepted message: one row each, in the order they go out.

"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped, VelocityStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Float64MultiArray

from .. import kernel
from ..estimator import Answer
from ..inverse.servo import joint_velocity
from ..inverse.solve import inverse_kinematics
from ..kernel import Floats
from ..singularities import singularity_of
from ..task import seeded_poses
from ..tool_state import evaluate
from .messages import Report
from .output_messages import (
    jacobian_message,
    jacobian_numbers,
    link_frames_message,
    link_frames_numbers,
    pose_message,
    pose_numbers,
    scalar_message,
    twist_message,
    twist_numbers,
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
# Each pose is a question and gets its answer; of twists only the newest is still meant.
TARGET_POSE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
TARGET_TWIST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

JOINT_STATES = 'joint_states'
WARNING = '~/singularity/warning'
DIAGNOSTICS = '/diagnostics'
DESCRIBE = '~/describe'
TARGET_POSE, TARGET_TWIST = '~/target_pose', '~/target_twist'
IK_JOINT_STATES, IK_SOLUTIONS = '~/ik/joint_states', '~/ik/solutions'
IK_JOINT_VELOCITY, IK_STATUS = '~/ik/joint_velocity', '~/ik/status'


@dataclass(frozen=True)
class Topic:
    """
    A topic: its name, message type, and how its messages come about.

    Attributes
    ----------
    numbers
        Returns the numbers a report puts into a message, None for nothing to say.
    make
        Returns the message of a stamp (ns), numbers and settings.
    depth
        What the kernel must have computed.

    """

    name: str
    type: Any
    numbers: Callable[[Report], Floats | None]
    make: Callable[[int, Floats, Settings], Any]
    depth: int = kernel.JACOBIAN

    def build(self, report: Report) -> Any:
        """
        Return the message of a report, None for nothing to say.

        """
        numbers = self.numbers(report)
        if numbers is None:
            return None
        return self.make(report.answer.stamp, numbers, report.settings)


def _measure(name: str) -> Topic:
    def numbers(report: Report) -> Floats | None:
        value = getattr(report.singularity, name)
        return None if value is None else np.array([value])

    return Topic(f'~/singularity/{name}', Float64, numbers, scalar_message)


TOPICS = (
    Topic('~/pose', PoseStamped, pose_numbers, pose_message),
    Topic('~/jacobian', Float64MultiArray, jacobian_numbers, jacobian_message),
    Topic('~/twist', TwistStamped, twist_numbers, twist_message),
    Topic('~/velocity', VelocityStamped, twist_numbers, velocity_message),
    _measure('determinant'),
    _measure('manipulability'),
    _measure('condition_number'),
    _measure('smallest_singular_value'),
    _measure('distance'),
    Topic('~/link_frames', PoseArray, link_frames_numbers, link_frames_message, kernel.ALL_FRAMES),
)


def sample_report(settings: Settings) -> Report:
    """
    Return the report of some pose of the arm, moving.

    """
    robot = settings.robot
    prismatic = [kind == 'prismatic' for kind in robot.joint_types]
    q = seeded_poses(robot.limits, prismatic)[0]
    state = evaluate(robot, q, q, depth=kernel.ALL_FRAMES)
    answer = Answer(state, state.quaternion_xyzw, 0, 'message')
    return Report(answer, singularity_of(state), settings)


def warm_up(settings: Settings) -> None:
    """
    Build every answer once: the kernel is compiled, or read from its cache, before the first one.

    """
    robot, sample = settings.robot, sample_report(settings)
    for topic in TOPICS:
        topic.build(sample)
    state = sample.answer.state
    inverse_kinematics(robot, state.pose, near=state.q, rows=settings.target_rows)
    joint_velocity(robot, state, state.twist, settings.servo)
