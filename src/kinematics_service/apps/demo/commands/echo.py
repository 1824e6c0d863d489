# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the command `echo`, which prints the messages of a running node."""

from typing import Annotated, Optional

import typer

from ....cli.missing_ros import ros_module
from ....cli.options import NODE, WrongUsage, flag, option

# Default of `--timeout` if `--once` is given, s.
ONCE_TIMEOUT = 10.0
# Smallest and largest accepted `--timeout`.
MIN_TIMEOUT = 0.1  # s
MAX_TIMEOUT = 86_400.0  # s, which is a day
# The topics that `echo` can print.
TOPICS = (
    *('jacobian', 'pose', 'twist', 'acceleration', 'wrench', 'warning', 'diagnostics'),
    *('scale', 'scale_reason'),
)


def echo(
    context: typer.Context,
    what: Annotated[
        str,
        typer.Argument(
            metavar='TOPIC',
            help=f'Topic to print: {", ".join(TOPICS)}.',
            autocompletion=lambda incomplete: [
                topic for topic in TOPICS if topic.startswith(incomplete)
            ],
        ),
    ] = TOPICS[0],
    once: bool = flag('--once', 'Stop after the first message.'),
    json: bool = flag('--json', 'Print one JSON object per line.'),
    node: str = option('The full name of the node.', 'NAME', default=NODE),
    timeout: Optional[float] = option(
        'Exit with code 1 if no message has come after this time.',
        'SECONDS',
        shown=f'{ONCE_TIMEOUT:g} with --once, else never',
    ),
) -> None:
    """
    Print the messages of a running node. No other ROS tool needs to be installed.

    \b
    Examples:
      kinematics_service echo
      kinematics_service echo pose --once
      kinematics_service echo warning --json
      kinematics_service echo diagnostics --once
      kinematics_service echo twist --node /left_arm/kinematics
      kinematics_service echo pose --once --timeout 30
    """
    if what not in TOPICS:
        raise WrongUsage(f'TOPIC: {what!r} is not one of {", ".join(map(repr, TOPICS))}')
    if timeout is not None and not timeout >= MIN_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} s is too short; give {MIN_TIMEOUT:g} or more')
    if timeout is not None and timeout > MAX_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} s is longer than a day; leave it out')
    if timeout is None and once:
        timeout = ONCE_TIMEOUT
    run_echo = ros_module('apps.demo.echo').run_echo
    raise typer.Exit(run_echo(what, node, once, json, timeout, context.obj))
