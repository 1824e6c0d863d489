# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""List the topics that `echo` can show, with functions that write messages as text or JSON."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64, Float64MultiArray

from ...node.messages.readings import TWIST, jacobian_of, scale_of, warned_of
from ...node.messages.topics import (
    DIAGNOSTICS,
    DIAGNOSTICS_QOS,
    OUTPUT_QOS,
    SCALE,
    SCALE_REASON,
    WARNING,
    WARNING_QOS,
)
from ...node.process.latest_message import LatestMessage
from ...node.process.no_messages import JOINT_STATES_ANSWERED
from .live_table import (
    matrix_lines,
    pose_lines,
    scale_lines,
    statuses_lines,
    vector_lines,
    warned_lines,
)
from .readings import ACCELERATION, WRENCH, pose_of, statuses_of

COMMANDS_ANSWERED = 'commands of joint velocities on ~/command'


class EchoTopic(NamedTuple):
    """
    A topic of the node, and functions that show its messages.

    Attributes
    ----------
    name
        The name of the topic, where `~` means the name of the node.
    reading
        A function that returns the content of a message; raises LayoutError if the message's
        arrays do not have the layout that the node publishes.
    shown
        A function that turns the result of `reading` into lines of text of a given width
        (characters).
    answers
        Text for the user: the input on which the node publishes this topic, such as `joint
        states`. `echo` writes it after "the node answers" while no message arrives.
    accepts
        If several nodes publish on the topic: a function that returns whether a message comes from
        the node that `echo` shows. Otherwise None.
    awaited
        Name of a topic that only the node publishes. If this topic has a publisher, the node runs.
        If `awaited` is empty, the topic `name` is used instead.
    """

    name: str
    type: Any
    qos: QoSProfile
    reading: Callable[[Any], Any]
    shown: Callable[[Any, int], list[str]]
    answers: str = JOINT_STATES_ANSWERED
    accepts: Callable[[Any], bool] | None = None
    awaited: str = ''

    @property
    def is_rare(self) -> bool:
        """
        Return whether the node publishes on this topic only at changes, so that long pauses
        between messages are normal.
        """
        return self.qos is WARNING_QOS

    def subscribed_by(
        self, node: Node, source: str, then: Callable[[bytes], None] | None = None
    ) -> LatestMessage:
        """
        Subscribe `node` to this topic. The node that publishes the topic is named `source`. The
        function `then` is called with each message.
        """
        topic = self.name.replace('~', source)
        return LatestMessage(node, topic, self.type, self.qos, then, self.accepts)

    def lines(self, message: Any, width: int) -> list[str]:
        """
        Return a message as lines of text; raise LayoutError if its arrays have another layout than
        the node's.
        """
        return self.shown(self.reading(message), width)

    def document(self, message: Any) -> dict[str, Any]:
        """
        Return a message as a dict for `--json`; raise LayoutError if its arrays have another
        layout than the node's.
        """
        content: dict[str, Any] = self.reading(message)._asdict()
        content |= content.pop('vectors', {})
        return content


def diagnostics_of(node: str) -> EchoTopic:
    """
    Return the topic `/diagnostics`, limited to the statuses of one node. `node` is its full name.
    """
    reading = partial(statuses_of, node.removeprefix('/'))
    return EchoTopic(
        DIAGNOSTICS,
        DiagnosticArray,
        DIAGNOSTICS_QOS,
        reading,
        statuses_lines,
        answers='itself, once a second',
        accepts=lambda message: bool(reading(message).statuses),
        awaited=WARNING.replace('~', node),
    )


ECHO_TOPICS = {
    'jacobian': EchoTopic('~/jacobian', Float64MultiArray, OUTPUT_QOS, jacobian_of, matrix_lines),
    'pose': EchoTopic('~/pose', PoseStamped, OUTPUT_QOS, pose_of, pose_lines),
    **{
        name: EchoTopic(f'~/{name}', kind, OUTPUT_QOS, pair.of, partial(vector_lines, pair))
        for name, kind, pair in (
            ('twist', TwistStamped, TWIST),
            ('acceleration', AccelStamped, ACCELERATION),
            ('wrench', WrenchStamped, WRENCH),
        )
    },
    'warning': EchoTopic(WARNING, DiagnosticStatus, WARNING_QOS, warned_of, warned_lines),
    'scale': EchoTopic(SCALE, Float64, OUTPUT_QOS, scale_of, scale_lines, COMMANDS_ANSWERED),
    'scale_reason': EchoTopic(
        SCALE_REASON, DiagnosticStatus, WARNING_QOS, warned_of, warned_lines, COMMANDS_ANSWERED
    ),
}
