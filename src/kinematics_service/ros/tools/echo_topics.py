"""The topics that `echo` can show, each as lines for people and as an object for programs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64MultiArray

from ..messages.readings import matrix_of, pose_of, velocity_of, warned_of
from ..messages.topics import OUTPUT_QOS, WARNING, WARNING_QOS
from .live_table import matrix_lines, pose_lines, velocity_lines, warned_lines


@dataclass(frozen=True)
class EchoTopic:
    """
    A topic of the node, and how its messages are shown.

    Attributes
    ----------
    name
        Its name as in `topics`, where `~` stands for the node.
    lines
        From a message and a width to lines; LayoutError if it cannot be read.
    document
        From a message to what `--json` prints.
    rare
        Whether messages are rare, so that none after the first is normal.
    """

    name: str
    type: Any
    qos: QoSProfile
    lines: Callable[[Any, int], list[str]]
    document: Callable[[Any], dict[str, Any]]
    rare: bool = False


def _stamp(stamp: tuple[int, int]) -> dict[str, int]:
    # Two integers: a double cannot hold the nanoseconds of a present time.
    return {'sec': stamp[0], 'nanosec': stamp[1]}


def _jacobian(message: Any) -> dict[str, Any]:
    matrix = matrix_of(message)
    return {'rows': matrix.rows, 'columns': matrix.columns, 'jacobian': matrix.values}


def _pose(message: Any) -> dict[str, Any]:
    pose = pose_of(message)
    return {
        'stamp': _stamp(pose.stamp),
        'frame': pose.frame,
        'position': pose.position,
        'quaternion_xyzw': pose.quaternion_xyzw,
        'roll_pitch_yaw': pose.roll_pitch_yaw,
    }


def _twist(message: Any) -> dict[str, Any]:
    velocity = velocity_of(message)
    return {
        'stamp': _stamp(velocity.stamp),
        'frame': velocity.frame,
        'linear': velocity.linear,
        'angular': velocity.angular,
    }


def _warning(message: Any) -> dict[str, Any]:
    warned = warned_of(message)
    return {
        'level': warned.level,
        'sentence': warned.sentence,
        'name': warned.name,
        'values': warned.values,
    }


ECHO_TOPICS = {
    'jacobian': EchoTopic(
        '~/jacobian',
        Float64MultiArray,
        OUTPUT_QOS,
        lambda message, width: matrix_lines(matrix_of(message), width),
        _jacobian,
    ),
    'pose': EchoTopic(
        '~/pose',
        PoseStamped,
        OUTPUT_QOS,
        lambda message, width: pose_lines(pose_of(message)),
        _pose,
    ),
    'twist': EchoTopic(
        '~/twist',
        TwistStamped,
        OUTPUT_QOS,
        lambda message, width: velocity_lines(velocity_of(message)),
        _twist,
    ),
    'warning': EchoTopic(
        WARNING,
        DiagnosticStatus,
        WARNING_QOS,
        lambda message, width: warned_lines(warned_of(message), width),
        _warning,
        rare=True,
    ),
}
