# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Publish the arm as a URDF on `robot_description`, for programs that draw robots."""

from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String

from ..errors import KinematicsError
from .messages.topics import ROBOT_DESCRIPTION, WARNING_QOS
from .parameters.settings import NodeSettings


class DescriptionPublisher:
    """
    Publishes the arm's URDF after each change of the settings; late subscribers get the last URDF.

    The topic is off by default, because a robot with a URDF already has this topic.
    """

    def __init__(self, node: Node, settings: NodeSettings) -> None:
        self._node = node
        self._publisher: Publisher | None = None
        self.configure(settings)

    def configure(self, settings: NodeSettings) -> None:
        """Apply new settings, which may have other names of frames and joints."""
        if not settings.values['publish_robot_description']:
            self._withdraw()
            return
        from ..robot.urdf.elements import FrameNames
        from ..robot.urdf.writer import export_urdf  # import the writer only if needed

        robot, prefix = settings.robot, settings.frame_prefix
        names = FrameNames(
            base=settings.base_frame.removeprefix(prefix),
            tool=settings.tool_frame.removeprefix(prefix),
            frame_prefix=prefix,
        )
        try:
            text = export_urdf(robot, names)
        except KinematicsError as error:
            self._node.get_logger().warning(f'robot_description is not published: {error}')
            self._withdraw()  # withdraw the URDF of the former arm
            return
        if self._publisher is None:
            self._publisher = self._node.create_publisher(String, ROBOT_DESCRIPTION, WARNING_QOS)
        self._publisher.publish(String(data=text))

    def _withdraw(self) -> None:
        if self._publisher is not None:
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
