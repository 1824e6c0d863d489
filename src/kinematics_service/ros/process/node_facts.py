"""What a kinematics node says of itself: its robot, its topics, the axes of its numbers."""

import json
import time
from typing import Any, NamedTuple

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from std_srvs.srv import Trigger

from ...errors import KinematicsError
from ...robot.measures import Thresholds
from ...robot.robot import Robot, with_singularity
from ..messages.topics import DESCRIBE, WARNING

# A service that is there is asked so often, and waited for so long each time (s).
TRIES, TRY = 5, 1.0


class NodeFacts(NamedTuple):
    """
    A node's description of itself.

    Attributes
    ----------
    source
        Its full name.
    text
        Its description as it came.
    robot
        Its parameter `robot`: a bundled name or a file.
    name
        The name in its robot file.
    joints
        Names of the joints, prefix included.
    joint_states
        The topic it hears.
    axes
        Axes of the Jacobian and of the twist, `base` or `tool` each.
    thresholds, length
        What singularities are judged by.
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

    def prefix(self, robot: Robot) -> str:
        """Return what stands before the joint names of the robot file."""
        return self.joints[0].removesuffix(robot.joint_names[0]) if self.joints else ''

    def mismatch(self, robot: Robot) -> str:
        """Return why the node's numbers are not those of this arm; empty where they are."""
        prefix = self.prefix(robot)
        names = tuple(prefix + name for name in robot.joint_names)
        if self.joints == names and self.name == robot.name:
            return ''
        return (
            f'{self.source} runs {self.robot}, this is {robot.name}: '
            f'start the view with --robot {self.robot}'
        )

    def judged(self, robot: Robot) -> Robot:
        """Return the arm with the thresholds and the length that are in force in the node."""
        try:
            return with_singularity(robot, self.length, self.thresholds)
        except KinematicsError:
            return robot


def ask_node(node: Node, executor: Any, source: str, timeout: float) -> NodeFacts | None:
    """
    Return what a node says of itself; None where none is found in `patience` (s).

    Parameters
    ----------
    node, executor
        Who asks, and what turns it.
    source
        Full name of the node that is asked.
    """
    deadline = time.monotonic() + timeout
    while not node.count_publishers(WARNING.replace('~', source)):
        if time.monotonic() > deadline:
            return None
        executor.spin_once(timeout_sec=0.05)
    deadline = max(deadline, time.monotonic() + TRIES * TRY)
    told = _call(
        node, executor, Trigger, DESCRIBE.replace('~', source), Trigger.Request(), deadline
    )
    if told is None:
        return None
    request = GetParameters.Request(names=['robot'])
    values = _call(node, executor, GetParameters, f'{source}/get_parameters', request, deadline)
    try:
        facts = json.loads(told.message)
        judged = facts['singularity']
        return NodeFacts(
            source=source,
            text=told.message,
            robot=(values.values[0].string_value if values else '') or str(facts['robot']),
            name=str(facts['robot']),
            joints=tuple(str(joint['name']) for joint in facts['joints']),
            joint_states=str(facts['subscribes']),
            axes=(str(facts['jacobian']['axes']), str(facts['twist']['axes'])),
            thresholds=Thresholds(
                str(judged['measure']), float(judged['warn']), float(judged['stop'])
            ),
            length=float(judged['length']),
        )
    except (ValueError, KeyError, TypeError):  # a service of that name that is not ours
        return None


def _call(
    node: Node, executor: Any, kind: Any, service: str, request: Any, deadline: float
) -> Any:
    # Whoever is there is given time: a response is lost while the node has not yet discovered
    # where to send it, so it is asked for again.
    client = node.create_client(kind, service)
    try:
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                return None
            executor.spin_once(timeout_sec=0.05)
        for _ in range(TRIES):
            future = client.call_async(request)
            end = time.monotonic() + TRY
            while not future.done() and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.05)
            if future.done():
                return future.result()
            client.remove_pending_request(future)
        return None
    finally:
        node.destroy_client(client)
