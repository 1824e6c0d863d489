"""The topics that `echo` can show, each as lines for people and as an object for programs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, WrenchStamped
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64, Float64MultiArray

from ..messages.readings import (
    Stamp,
    acceleration_of,
    jacobian_of,
    pose_of,
    scale_of,
    velocity_of,
    warned_of,
    wrench_of,
)
from ..messages.topics import OUTPUT_QOS, SCALE, SCALE_REASON, WARNING, WARNING_QOS
from ..process.no_messages import JOINT_STATES_ANSWERED
from .live_table import (
    acceleration_lines,
    matrix_lines,
    pose_lines,
    scale_lines,
    velocity_lines,
    warned_lines,
    wrench_lines,
)

COMMANDS_ANSWERED = 'commands of joint velocities on ~/command, so look whether any arrive'


@dataclass(frozen=True)
class EchoTopic:
    """
    A topic of the node, and how its messages are shown.

    Attributes
    ----------
    name
        Its name as in `topics`, where `~` stands for the node.
    reading
        From a message to its content; LayoutError if it cannot be read.
    shown
        From that and a width to lines.
    rare
        Whether messages are rare, so that none after the first is normal.
    answers
        What the node answers with them.
    """

    name: str
    type: Any
    qos: QoSProfile
    reading: Callable[[Any], Any]
    shown: Callable[[Any, int], list[str]]
    rare: bool = False
    answers: str = JOINT_STATES_ANSWERED

    def lines(self, message: Any, width: int) -> list[str]:
        """Return a message as lines; LayoutError if it cannot be read."""
        return self.shown(self.reading(message), width)

    def document(self, message: Any) -> dict[str, Any]:
        """Return what `--json` prints of a message; LayoutError if it cannot be read."""
        content = self.reading(message)._asdict().items()
        return {key: x._asdict() if isinstance(x, Stamp) else x for key, x in content}


ECHO_TOPICS = {
    'jacobian': EchoTopic('~/jacobian', Float64MultiArray, OUTPUT_QOS, jacobian_of, matrix_lines),
    'pose': EchoTopic(
        '~/pose', PoseStamped, OUTPUT_QOS, pose_of, lambda pose, width: pose_lines(pose)
    ),
    'twist': EchoTopic(
        '~/twist',
        TwistStamped,
        OUTPUT_QOS,
        velocity_of,
        lambda twist, width: velocity_lines(twist),
    ),
    'acceleration': EchoTopic(
        '~/acceleration',
        AccelStamped,
        OUTPUT_QOS,
        acceleration_of,
        lambda acceleration, width: acceleration_lines(acceleration),
    ),
    'wrench': EchoTopic(
        '~/wrench',
        WrenchStamped,
        OUTPUT_QOS,
        wrench_of,
        lambda wrench, width: wrench_lines(wrench),
    ),
    'warning': EchoTopic(
        WARNING, DiagnosticStatus, WARNING_QOS, warned_of, warned_lines, rare=True
    ),
    'scale': EchoTopic(
        SCALE,
        Float64,
        OUTPUT_QOS,
        scale_of,
        lambda reading, width: scale_lines(reading),
        answers=COMMANDS_ANSWERED,
    ),
    'scale_reason': EchoTopic(
        SCALE_REASON,
        DiagnosticStatus,
        WARNING_QOS,
        warned_of,
        warned_lines,
        rare=True,
        answers=COMMANDS_ANSWERED,
    ),
}
