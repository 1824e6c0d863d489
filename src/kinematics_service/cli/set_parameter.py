# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `set`: set a parameter of a running node."""

from typing import Annotated

import typer

from .missing_ros import ros_module
from .options import NODE, WrongUsage


def set_parameter(
    context: typer.Context,
    words: Annotated[
        list[str],
        typer.Argument(
            metavar='[NODE] PARAMETER VALUE',
            help=f'The full name of the node (default: {NODE}), the name of a parameter, and its '
            'value in YAML.',
        ),
    ],
) -> None:
    """
    Set a parameter of a running node, without any other ROS tool installed.

    The exit code is 1 if the node refuses the value, or if no node answers.

    \b
    Examples:
      kinematics_service set tool.xyz '[0, 0, 0.15]'
      kinematics_service set /left_arm/kinematics singularity.warn 0.2
      kinematics_service set tool.xyz '[]'
    """
    if len(words) not in (2, 3):
        raise WrongUsage('expected PARAMETER VALUE, or NODE PARAMETER VALUE; put a list in quotes')
    node, name, value = [NODE, *words][-3:]
    run_set = ros_module('node.process.node_requests').run_set
    raise typer.Exit(run_set(node, name, value, context.obj))
