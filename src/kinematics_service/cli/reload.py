# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `reload`: make a running node read its robot file again."""

from typing import Annotated

import typer

from .missing_ros import ros_module
from .options import NODE


def reload(
    context: typer.Context,
    node: Annotated[str, typer.Argument(help='The full name of the node.')] = NODE,
) -> None:
    """
    Let a running node read its robot file again, without any other ROS tool installed.

    The command prints the robot that the node now uses. The exit code is 1 if the file has faults:
    then the node keeps the robot that it used before.

    \b
    Examples:
      kinematics_service reload
      kinematics_service reload /left_arm/kinematics
    """
    run_reload = ros_module('node.process.node_requests').run_reload
    raise typer.Exit(run_reload(node, context.obj))
