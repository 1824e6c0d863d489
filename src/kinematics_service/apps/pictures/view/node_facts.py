# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the description of a kinematics node: its robot, its topics, the axes of its outputs."""

import json
import time
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.executors import Executor
from rclpy.node import Node
from std_srvs.srv import Trigger

from ....errors import KinematicsError
from ....kernel import Floats
from ....node.messages.topics import DESCRIBE, WARNING
from ....node.process.service_calls import CALL_TIMEOUT, MAX_CALLS, call_service
from ....rigid_motion import exact_rpy, pose_of
from ....robot.measures import Thresholds
from ....robot.robot import Robot, with_singularity, with_tool

# The tool frames of node and robot file are taken as equal if they differ by less than this (m,
# rad). They may differ, because the description of the node has rounded numbers.
TOOL_TOLERANCE = 1e-9


class NodeFacts(NamedTuple):
    """
    The description of a node.

    Attributes
    ----------
    source
        Full name of the node.
    text
        The received description.
    robot
        The node's parameter `robot`: a bundled name or a file.
    name
        The name of the robot in its file.
    joints
        The joint names on the topics.
    joint_states
        The topic of the joint states that the node receives.
    axes
        Axes of the Jacobian and of the twist, `base` or `tool` each.
    thresholds, length
        The thresholds of WARN and ERROR, and the characteristic length, m.
    sha256
        Checksum of the robot file when the node read it.
    tool : shape (4, 4)
        The pose of the tool in the frame after the last row of the DH table.
    """

    source: str
    text: str
    robot: str
    name: str
    joints: tuple[str, ...]
    joint_states: str
    axes: tuple[str, str]
    thresholds: Thresholds
    length: float
    sha256: str
    tool: Floats

    def mismatch(self, robot: Robot) -> str:
        """Return a sentence if the node runs another arm than `robot`, or an empty text."""
        if len(self.joints) == robot.dof and self.name == robot.name:
            return ''
        return (
            f'{self.source} runs {self.robot}, this is {robot.name}: '
            f'start the view with --robot {self.robot}'
        )

    def with_tool(self, robot: Robot) -> Robot:
        """Return `robot` with the tool frame that the node uses."""
        pose = robot.description.tool.motion.matrix
        if np.allclose(pose, self.tool, rtol=0.0, atol=TOOL_TOLERANCE):
            return robot
        return with_tool(robot, tuple(self.tool[:3, 3].tolist()), exact_rpy(self.tool[:3, :3]))

    def edited(self, robot: Robot) -> str:
        """
        Return a sentence if the robot file has changed since the node read it, else an empty text.
        """
        read = robot.description.sha256
        if not read or read == self.sha256 or self.name != robot.name:
            return ''
        return f'the robot file here is not as {self.source} has read it; ~/reload reads it again'

    def judged(self, robot: Robot) -> Robot:
        """
        Return `robot` with the joint names, the singularity thresholds and the characteristic
        length of the node.
        """
        named = replace(robot, joint_names=self.joints)
        try:
            return with_singularity(named, self.length, self.thresholds)
        except KinematicsError:
            return named


def ask_node(node: Node, executor: Executor, source: str, timeout: float) -> NodeFacts | None:
    """
    Return the description of a node, or None if no node answers within `timeout` (s).

    Parameters
    ----------
    node, executor
        The ROS node that sends the request, and its executor.
    source
        Full name of the described node.
    """
    deadline = time.monotonic() + timeout
    while not node.count_publishers(WARNING.replace('~', source)):
        if time.monotonic() > deadline:
            return None
        executor.spin_once(timeout_sec=0.05)
    deadline = max(deadline, time.monotonic() + MAX_CALLS * CALL_TIMEOUT)
    call = partial(call_service, node, executor)
    answer = call(Trigger, DESCRIBE.replace('~', source), Trigger.Request(), deadline)
    if answer is None:
        return None
    request = GetParameters.Request(names=['robot'])
    values = call(GetParameters, f'{source}/get_parameters', request, deadline)
    try:
        facts = json.loads(answer.message)
        judged = facts['singularity']
        limits = float(judged['warn']), float(judged['stop'])
        return NodeFacts(
            source=source,
            text=answer.message,
            robot=(values.values[0].string_value if values else '') or str(facts['robot']),
            name=str(facts['robot']),
            joints=tuple(str(joint['name']) for joint in facts['joints']),
            joint_states=str(facts['subscribes']),
            axes=(str(facts['jacobian']['axes']), str(facts['twist']['axes'])),
            thresholds=Thresholds(str(judged['measure']), *limits),
            length=float(judged['length']),
            sha256=str(facts['file']['sha256']),
            tool=pose_of(facts['tool']['xyz'], facts['tool']['rpy']),
        )
    except (ValueError, KeyError, TypeError):  # the service is that of another program
        return None
