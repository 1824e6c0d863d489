# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the kinematics nodes in the ROS graph."""

from rclpy.node import Node

from .topics import WARNING

STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'


def kinematics_nodes(node: Node) -> list[str]:
    """Return the full names of the nodes with a topic `~/singularity/warning`."""
    mark = WARNING.removeprefix('~')
    return sorted(
        topic.removesuffix(mark)
        for topic, types in node.get_topic_names_and_types()
        if topic.endswith(mark) and STATUS in types and node.count_publishers(topic) > 0
    )
