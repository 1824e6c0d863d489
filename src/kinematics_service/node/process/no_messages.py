# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Explain why no messages arrive on a topic, from the ROS graph and the environment."""

import os

from rclpy.node import Node

from ...typography import counted
from ..messages.graph import kinematics_nodes

JOINT_STATES_ANSWERED = 'joint states'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def why_no_messages(
    node: Node, topic: str, answered: str = JOINT_STATES_ANSWERED, report: str = ''
) -> str:
    """
    Return a text with the silent topic, its publishers, and what the user should check.

    Parameters
    ----------
    node
        The node that subscribes.
    topic
        Resolved name of the silent topic.
    answered
        Kind of messages that the node answers on the topic.
    report
        The status of the node's input on /diagnostics; empty if it is unknown.
    """
    publishers = node.count_publishers(topic)
    if publishers > 0:
        words = f'{counted(publishers, "publisher")}, which {"has" if publishers == 1 else "have"}'
        look = f'it reports: {report}' if report else 'look whether any arrive (/diagnostics)'
        return (
            f'waiting for {topic}: it has {words} sent nothing; '
            f'the node answers {answered}; {look}'
        )
    if report:
        return f'waiting for {topic}: it has no publisher; its node reports: {report}'
    running = kinematics_nodes(node)
    nodes, hint = 'no kinematics node runs here', f'is one running, {_environment()}?'
    if running:
        nodes, hint = f'kinematics nodes here: {", ".join(running)}', f'try --node {running[0]}'
    return f'waiting for {topic}: it has no publisher; {nodes}; {hint}'


def _environment() -> str:
    domain = os.environ.get('ROS_DOMAIN_ID', '') or '0, the default'
    reach = os.environ.get(RANGE, '') or 'SUBNET, the default'
    return f'with the same ROS_DOMAIN_ID (here {domain}) and a {RANGE} that fits (here {reach})'
