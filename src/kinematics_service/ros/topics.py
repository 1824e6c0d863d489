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
from visualization_msgs.msg import MarkerArray

from .. import kernel
from ..estimator import Answer
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
# Each pose is a question and gets its answer; of twists only the newest is still meant.
TARGET_POSE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
TARGET_TWIST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

JOINT_STATES = 'joint_states'
WARNING = '~/singularity/warning'
DIAGNOSTICS = '/diagnostics'
DESCRIBE = '~/describe'
TARGET_POSE, TARGET_TWIST = '~/target_pose', '~/target_twist'
REFERENCE_POSE = '~/reference_pose'
ROBOT_DESCRIPTION = 'robot_description'
IK_JOINT_STATES, IK_SOLUTIONS = '~/ik/joint_states', '~/ik/solutions'
IK_JOINT_VELOCITY, IK_STATUS = '~/ik/joint_velocity', '~/ik/status'


@dataclass(frozen=True)
class Topic:
    """
    A topic: its name, message type, and how its messages come about.

    Attributes
    ----------
    build
        Returns the message of a report, None for nothing to say.
    numbers, make
        The same in two steps, where a message is a stamp and always as many numbers: the numbers
        of a report, and the message of a stamp (ns), numbers and settings.
    depth
        What the kernel must have computed.
    period : ns
        Least difference of stamps between two messages; 0: every report.

    """

    name: str
    type: Any
    build: Callable[[Report], Any]
    numbers: Callable[[Report], Floats | None] | None = None
    make: Callable[[int, Floats, Settings], Any] | None = None
    depth: int = kernel.JACOBIAN
    period: int = 0


def _of_numbers(
    name: str,
    kind: Any,
    numbers: Callable[[Report], Floats | None],
    make: Callable[[int, Floats, Settings], Any],
    depth: int = kernel.JACOBIAN,
) -> Topic:
    def build(report: Report) -> Any:
        values = numbers(report)
        return None if values is None else make(report.answer.stamp, values, report.settings)

    return Topic(name, kind, build, numbers, make, depth)


def _measure(name: str) -> Topic:
    def numbers(report: Report) -> Floats | None:
        value = getattr(report.singularity, name)
        return None if value is None else np.array([value])

    return _of_numbers(f'~/singularity/{name}', Float64, numbers, scalar_message)


def _markers(report: Report) -> Any:
    # Imported when somebody looks: the node itself needs no scene.
    from .markers import markers_message

    return markers_message(report)


TOPICS = (
    _of_numbers('~/pose', PoseStamped, pose_numbers, pose_message),
    _of_numbers('~/jacobian', Float64MultiArray, jacobian_numbers, jacobian_message),
    _of_numbers('~/twist', TwistStamped, twist_numbers, twist_message),
    _of_numbers('~/velocity', VelocityStamped, twist_numbers, velocity_message),
    _measure('determinant'),
    _measure('manipulability'),
    _measure('condition_number'),
    _measure('smallest_singular_value'),
    _measure('distance'),
    _of_numbers(
        '~/link_frames', PoseArray, link_frames_numbers, link_frames_message, kernel.ALL_FRAMES
    ),
    # For eyes: some fifty markers are a hundred times the work of a pose.
    Topic('~/markers', MarkerArray, _markers, depth=kernel.ALL_FRAMES, period=33_000_000),
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
    Build every answer once, so that the first one takes no longer than the next.

    """
    sample = sample_report(settings)
    for topic in TOPICS:
        topic.build(sample)
