# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the live view with ROS, and choose the arm that the view shows."""

from collections.abc import Sequence

from rclpy.context import Context

from ....errors import KinematicsError
from ....kernel import Floats
from ....node.drawing.observation import Observation
from ....node.process.session import NODE_NAMES, SUCCESS, WRONG_USAGE, is_name, run_session, tell
from ....robot.robot import Robot, load_robot
from ....stop_signals import StopSignal
from .address import Address
from .node_facts import NodeFacts
from .run import ArmSource, run_page
from .view_listener import ViewListener

# Time limit for the description of a node, s.
ANSWER_TIMEOUT = 2.0
# Number of passes of the view's loop (30 per second) between two searches for nodes.
SEARCH_TURNS = 30
# Full name of the node if none was found.
DEFAULT_NODE = '/kinematics'


class ViewSession(ArmSource):
    """
    The arms that the view can show: a given arm, or the arms of ROS nodes.

    Nodes may start, end or change their arm while the view runs.

    Parameters
    ----------
    context
        The ROS context of the view; `close` does not shut it down.
    robot
        The arm to show, or None for the arm of the node.
    otherwise
        Name of the bundled arm that the view shows if the arm of the node is unknown.
    node
        Full name of the node to show first; empty for the first one found.

    Attributes
    ----------
    robot
        The shown arm.
    nodes
        Full names of the running nodes.
    """

    def __init__(self, context: Context, robot: Robot | None, otherwise: str, node: str) -> None:
        self._context, self._given, self._otherwise = context, robot, otherwise
        self._listener = ViewListener(context, node or DEFAULT_NODE)
        self._found = bool(node)
        self._turns = 0
        facts = self._listener.ask(ANSWER_TIMEOUT)
        self._found |= facts is not None
        self.nodes = self._listener.sources()
        super().__init__(robot or self._robot_of(facts))
        self._listener.show(self.robot)
        if not self._found and self.nodes:
            self._go_to(self.nodes[0])

    def close(self) -> None:
        """End all subscriptions."""
        self._listener.close()

    @property
    def node(self) -> str:
        """Return the full name of the shown arm's node, even if the node has ended."""
        return self._listener.source

    @property
    def title(self) -> str:
        """Return the names of the shown arm and its node."""
        if self._listener.facts is not None:
            return f'{self.robot.name} of {self.node}'
        if self._found:
            return f'{self.robot.name}; no node {self.node} runs'
        default = '' if self._given else ' (no --robot FILE|NAME is given)'
        return f'{self.robot.name}{default}; no node runs'

    def choose(self, node: str) -> None:
        """Show the arm of another node."""
        self._given = None
        self._go_to(node)

    def listen(self, seconds: float) -> None:
        """Receive messages for `seconds`, and follow nodes that start, restart or change."""
        self._listener.listen(seconds)
        if self._listener.changed():
            self._found = True
            self._take(self._listener.facts)
        self._turns += 1
        if self._turns % SEARCH_TURNS == 0:
            self.nodes = self._listener.sources()
            if not self._found and self.nodes:
                self._go_to(self.nodes[0])

    def observation(self) -> Observation | None:
        """Return the newest observation, or None while joint states are missing."""
        return self._listener.observation()

    @property
    def status(self) -> str:
        """Return one line of text: whether sliders, joint states or a node move the shown arm."""
        return self._listener.status

    def publish(self, q: Floats) -> str:
        """
        Publish joint positions. If another node publishes joint states, publish nothing and return
        the reason.
        """
        return self._listener.publish(q)

    def _go_to(self, node: str) -> None:
        self._listener.close()
        self._listener = ViewListener(self._context, node)
        self._found = True
        self._take(self._listener.ask(ANSWER_TIMEOUT))

    def _take(self, facts: NodeFacts | None) -> None:
        self.robot = self._given or self._robot_of(facts)
        self._listener.show(self.robot)

    def _robot_of(self, facts: NodeFacts | None) -> Robot:
        if facts is not None:
            try:
                return facts.with_tool(load_robot(facts.robot))
            except (KinematicsError, OSError) as error:
                tell(
                    f'the file of the node cannot be read here, showing {self._otherwise}: {error}'
                )
        return load_robot(self._otherwise)


def run_view(
    robot: Robot | None,
    otherwise: str,
    node: str,
    address: Address,
    publishable: bool,
    ros_args: Sequence[str],
) -> int:
    """
    Show the arm of a node until SIGINT or SIGTERM; return the exit code.

    Parameters
    ----------
    robot
        The arm, or None for the arm of the node.
    otherwise
        Name of the bundled arm that the view shows if the arm of the node is unknown.
    node
        Full name of the node, with or without the leading slash; empty for any node.
    address, publishable
        See `run_page`.
    ros_args
        ROS arguments, `--ros-args` included.
    """
    if not is_name('--node', node or DEFAULT_NODE, NODE_NAMES):
        return WRONG_USAGE

    def work(context: Context, stop: StopSignal) -> int:
        session = ViewSession(context, robot, otherwise, node)
        try:
            run_page(session, address, publishable, lambda: stop.came)
        finally:
            session.close()
        return SUCCESS

    return run_session(ros_args, work)
