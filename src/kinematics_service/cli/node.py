"""
The command without a name: the node.

Its few options are read here as well as by typer, which with all commands takes longer to load
than the rest of the node: what is plainly a start of the node does not wait for it.
"""

import gc
import os
from collections.abc import Sequence
from typing import NamedTuple

from .missing_ros import ros_module

ROBOT, MANAGED = '--robot', '--managed'
UNSECURED, MIXED_ROS = '--allow-unsecured', '--allow-mixed-ros'
# numpy's library for large matrices starts a thread, which after each call waits at full speed for
# the next one: 50 ms of processor time at a start. Those of an arm are small.
ONE_THREAD = ('OPENBLAS_NUM_THREADS', '1')


class NodeOptions(NamedTuple):
    """What is asked of the node; `robots` as `--robot` has them."""

    robots: list[str]
    allow_unsecured: bool
    allow_mixed_ros: bool
    managed: bool


def plain_options(arguments: Sequence[str]) -> NodeOptions | None:
    """
    Return the options where the arguments start the node and nothing else.

    None where typer is to read them: a command, help, the version, and what is wrong.
    """
    robots = []
    flags = set()
    words = iter(arguments)
    for word in words:
        name, equals, robot = word.partition('=')
        if name == ROBOT:
            robot = robot if equals else next(words, '-')
            if robot.startswith('-'):
                return None
            robots.append(robot)
        elif word in (UNSECURED, MIXED_ROS, MANAGED):
            flags.add(word)
        else:
            return None
    return NodeOptions(robots, UNSECURED in flags, MIXED_ROS in flags, MANAGED in flags)


def start_node(options: NodeOptions, ros_arguments: Sequence[str]) -> int:
    """
    Run the node until it is told to stop, and return its exit code.

    Raises
    ------
    RosMissingError
        rclpy or a message package cannot be imported.
    RosVariableError
        ROS cannot start with its environment variables.
    """
    os.environ.setdefault(*ONE_THREAD)
    # Nothing is garbage before the node is there: to look for it takes 25 ms.
    gc.disable()
    try:
        code: int = ros_module('node.process.runner').run_node(
            options.robots,
            ros_arguments,
            options.allow_unsecured,
            options.allow_mixed_ros,
            options.managed,
        )
        return code
    finally:
        gc.enable()
