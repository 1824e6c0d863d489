"""The command `echo`: what a running node publishes."""

from enum import Enum
from typing import Annotated, Optional

import typer

from .missing_ros import ros_module
from .options import WrongUsage, flag, option

# Range of the time-out of `echo`, in s.
ONCE_TIMEOUT, SHORTEST_TIMEOUT, LONGEST_TIMEOUT = 10.0, 0.1, 86_400.0


class EchoedTopic(str, Enum):
    """The topics that `echo` can print."""

    jacobian = 'jacobian'
    pose = 'pose'
    twist = 'twist'
    acceleration = 'acceleration'
    wrench = 'wrench'
    warning = 'warning'
    diagnostics = 'diagnostics'
    scale = 'scale'
    scale_reason = 'scale_reason'


def echo(
    context: typer.Context,
    what: Annotated[EchoedTopic, typer.Argument(help='Topic to print.')] = EchoedTopic.jacobian,
    once: bool = flag('--once', 'Stop after the first message.'),
    json: bool = flag('--json', 'Print one JSON object per line.'),
    node: str = option('The full name of the node.', 'NAME', default='/kinematics'),
    timeout: Optional[float] = option(
        'Give up, with exit code 1, if nothing has come by then.',
        'SECONDS',
        shown=f'{ONCE_TIMEOUT:g} with --once, else never',
    ),
) -> None:
    """
    Print what a running node says, without any other ROS tool installed.

    \b
    Examples:
      kinematics_service echo
      kinematics_service echo pose --once
      kinematics_service echo warning --json
      kinematics_service echo diagnostics --once
      kinematics_service echo twist --node /left_arm/kinematics
      kinematics_service echo pose --once --timeout 30
    """
    if timeout is not None and not timeout >= SHORTEST_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} is not at least {SHORTEST_TIMEOUT:g} s')
    if timeout is not None and timeout > LONGEST_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} s is longer than a day: leave it out')
    if timeout is None and once:
        timeout = ONCE_TIMEOUT
    run_echo = ros_module('tools.echo').run_echo
    raise typer.Exit(run_echo(what.value, node, once, json, timeout, context.obj))
