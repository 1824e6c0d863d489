# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Receive the outputs of a node for the live view.

The Jacobian and the twist are converted to base axes, in the order vx vy vz wx wy wz.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Float64MultiArray

from ....errors import LayoutError
from ....kernel import Floats
from ....node.drawing.observation import CommandScale, Observation
from ....node.messages import readings
from ....node.messages.topics import SCALE, SCALE_REASON, WARNING, WARNING_QOS
from ....node.process.latest_message import LatestMessage
from ....robot.measures import Level
from ....robot.task import TWIST_ROWS

# If a message is older than this (s), the view does not show it as live.
MAX_AGE = 1.0
# The queue is short, because the view shows only the last message of a topic.
LAST_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)


class ViewOutputs:
    """
    The last messages of a kinematics node.

    Parameters
    ----------
    node
        The ROS node that subscribes to the topics.
    source
        Full name of the kinematics node.
    """

    def __init__(self, node: Node, source: str) -> None:
        def subscribe(topic: str, kind: type, qos: QoSProfile = LAST_QOS) -> LatestMessage:
            return LatestMessage(node, topic.replace('~', source), kind, qos)

        self.pose = subscribe('~/pose', PoseStamped)
        self.jacobian = subscribe('~/jacobian', Float64MultiArray)
        self.frames = subscribe('~/link_frames', PoseArray)
        self.twist = subscribe('~/twist', TwistStamped)
        self.distance = subscribe('~/singularity/distance', Float64)
        self.scale = subscribe(SCALE, Float64)
        self.warning = subscribe(WARNING, DiagnosticStatus, WARNING_QOS)
        self.reason = subscribe(SCALE_REASON, DiagnosticStatus, WARNING_QOS)

    @property
    def count(self) -> int:
        """Return the number of received messages."""
        outputs = (self.pose, self.jacobian, self.frames, self.twist, self.distance, self.warning)
        return sum(output.count for output in outputs)

    @property
    def live(self) -> bool:
        """
        Return whether a pose of the kinematics node has arrived within the last MAX_AGE seconds.
        """
        return _fresh(self.pose)

    def shown(self, seen: Observation, axes: tuple[str, str]) -> Observation:
        """
        Return an observation with the values that the kinematics node publishes.

        Parameters
        ----------
        seen
            The observation computed from the joint states alone.
        axes
            Axes of the node's Jacobian and of its twist, `base` or `tool` each.
        """
        values: dict[str, Any] = {}
        pose = values['pose'] = readings.matrix_of(self.pose.message.pose)
        if _fresh(self.frames):
            frames = np.array([readings.matrix_of(frame) for frame in self.frames.message.poses])
            if frames.shape == seen.frames.shape:
                values['frames'] = frames
        if _fresh(self.jacobian):
            J = _six_rows(self.jacobian.message)
            if J is not None and J.shape == seen.jacobian.shape:
                values['jacobian'] = readings.in_base_axes(J, pose) if axes[0] == 'tool' else J
        if _fresh(self.twist):
            twist = np.concatenate([*readings.TWIST.of(self.twist.message).vectors.values()])
            values['twist'] = readings.in_base_axes(twist, pose) if axes[1] == 'tool' else twist
        if _fresh(self.distance):
            distance = float(self.distance.message.data)
            values['singularity'] = replace(seen.singularity, distance=distance)
        if self.warning.count:
            level = readings.warned_of(self.warning.message).level
            if level in Level.__members__ and level != Level.STALE.name:
                values['level'] = Level[level]
        if _fresh(self.scale) and self.reason.count:
            reason = readings.warned_of(self.reason.message)
            if reason.level in Level.__members__:
                value = readings.scale_of(self.scale.message).scale
                values['scale'] = CommandScale(value, reason.cause, Level[reason.level])
        return replace(seen, **values)


def _fresh(latest: LatestMessage) -> bool:
    return latest.count > 0 and latest.age < MAX_AGE


def _six_rows(message: Any) -> Floats | None:
    # Return the Jacobian with linear rows first, or None if a row is missing.
    try:
        matrix = readings.jacobian_of(message)
    except LayoutError:
        return None
    if set(matrix.rows) != set(TWIST_ROWS):
        return None
    return matrix.jacobian[[matrix.rows.index(name) for name in TWIST_ROWS]]
