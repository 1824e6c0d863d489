"""
The live view with ROS, from its options to an exit code.

"""

from collections.abc import Callable, Sequence

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_full_topic_name import validate_full_topic_name

from ..errors import KinematicsError
from ..robot import Robot, load_robot
from ..view.run import run_page
from .runner import FAULT, FINE, WRONG_USAGE, open_context, start_refusal, tell
from .view_listener import ViewListener

# A node that runs answers within this (s).
PATIENCE = 2.0


def run_view(
    robot: Robot | None,
    otherwise: str,
    node: str,
    host: str,
    port: int,
    publishable: bool,
    ros_args: Sequence[str],
    stopped: Callable[[], bool],
) -> int:
    """
    Show the arm of a node until `stopped()`; return the exit code.

    Parameters
    ----------
    robot
        The arm; None for that of the node, or `otherwise` where there is no node.
    node
        Full name of the node; the leading slash may be missing.
    host, port, publishable
        As `run_page` takes them.
    ros_args
        ROS arguments, `--ros-args` included.

    Raises
    ------
    KinematicsError
        The page cannot be served there.

    """
    refusal = start_refusal(False, False)
    if refusal is not None:
        tell(refusal)
        return FAULT
    try:
        validate_full_topic_name('/' + node.strip('/') + '/pose')
    except InvalidTopicNameException:
        tell(f'--node {node}: not the name of a node, such as /kinematics or /arm/kinematics')
        return WRONG_USAGE
    context = open_context(ros_args)
    if context is None:
        return WRONG_USAGE
    try:
        listener = ViewListener(context, node)
        try:
            _show(listener, robot, otherwise, host, port, publishable, stopped)
        finally:
            listener.close()
    finally:
        context.try_shutdown()
    return FINE


def _show(
    listener: ViewListener,
    robot: Robot | None,
    otherwise: str,
    host: str,
    port: int,
    publishable: bool,
    stopped: Callable[[], bool],
) -> None:
    facts = listener.ask(PATIENCE)
    shown = robot or _robot_of(facts.robot if facts else '', otherwise)
    # Where nobody has chosen the arm, and the node comes later, the page changes to the node's.
    if robot is None and facts is None:
        listener.show(shown)
        port = run_page(
            shown,
            listener,
            host,
            port,
            publishable,
            lambda: stopped() or listener.other_robot != '',
        )
        if not stopped():
            shown = _robot_of(listener.other_robot, otherwise)
    if not stopped():
        listener.show(shown)
        run_page(shown, listener, host, port, publishable, stopped)


def _robot_of(name: str, otherwise: str) -> Robot:
    if name:
        try:
            return load_robot(name)
        except (KinematicsError, OSError) as error:
            tell(f'the file of the node cannot be read here, showing {otherwise}: {error}')
    return load_robot(otherwise)
