# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Start the node. The program does this if the command line names no command.

Loading typer with all commands takes longer than loading the rest of the node. So if a command
line only starts the node, this module reads the options itself and does not load typer.
"""

import gc
import os
from collections.abc import Sequence
from typing import NamedTuple

from .missing_ros import ros_module

ROBOT, MANAGED = '--robot', '--managed'
UNSECURED, MIXED_ROS = '--allow-unsecured', '--allow-mixed-ros'
# Environment variable, and its value, that limits OpenBLAS, the matrix library of numpy, to one
# thread. The matrices of an arm are too small for several threads. Additional threads would only
# cost 50 ms of processor time when the node starts, because they wait actively for work.
ONE_THREAD = ('OPENBLAS_NUM_THREADS', '1')


class NodeOptions(NamedTuple):
    """The options of the node on a command line; `robots` has the values of `--robot`."""

    robots: list[str]
    allow_unsecured: bool
    allow_mixed_ros: bool
    managed: bool


def plain_options(arguments: Sequence[str]) -> NodeOptions | None:
    """
    Return the options of the node if the command line has no other arguments, else None.

    If the result is None, typer reads the command line. It may have a command, wrong arguments, or
    an option for the help or the version.
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
    Run the node until a stop signal, and return the exit code.

    Raises
    ------
    RosMissingError
        rclpy or a message package cannot be imported.
    RosVariableError
        ROS cannot start with its environment variables.
    """
    os.environ.setdefault(*ONE_THREAD)
    # Disable garbage collection during the start, because it would take 25 ms and free no memory.
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
