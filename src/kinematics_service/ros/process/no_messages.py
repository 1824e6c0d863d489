"""Why nothing is heard on a topic: what the ROS graph shows, and what keeps nodes apart."""

import os

from rclpy.node import Node

from ..messages.topics import WARNING

# A node of this kind is known by this topic, whatever it is called.
MARK = WARNING.replace('~', '')
STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def kinematics_nodes(node: Node) -> list[str]:
    """Return the full names of the kinematics nodes in the graph."""
    return sorted(
        topic.removesuffix(MARK)
        for topic, types in node.get_topic_names_and_types()
        if topic.endswith(MARK) and STATUS in types and node.count_publishers(topic) > 0
    )


def why_no_messages(node: Node, topic: str) -> str:
    """
    Return what is waited for, who publishes it, and what to look at.

    Parameters
    ----------
    node
        The node that listens.
    topic
        Resolved name of the silent topic.
    """
    publishers = node.count_publishers(topic)
    if publishers > 0:
        who = (
            '1 publisher, which says' if publishers == 1 else f'{publishers} publishers, which say'
        )
        return (
            f'waiting for {topic}: it has {who} nothing; the node answers joint states, so look '
            'whether any arrive (/diagnostics says which are missing)'
        )
    found = kinematics_nodes(node)
    nodes = f'kinematics nodes here: {", ".join(found)}' if found else 'no kinematics node is here'
    hint = f'try --node {found[0]}' if found else f'is one running, {_environment()}?'
    return f'waiting for {topic}: nobody publishes it; {nodes}; {hint}'


def _environment() -> str:
    domain = os.environ.get('ROS_DOMAIN_ID', '') or '0, the default'
    reach = os.environ.get(RANGE, '') or 'SUBNET, the default'
    return f'with the same ROS_DOMAIN_ID (here {domain}) and a {RANGE} that fits (here {reach})'
