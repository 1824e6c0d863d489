"""The commands that need ROS: the node itself, `demo` and `echo`."""

import math
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import typer

from .options import WrongUsage, refuse_unknown_robot
from .ros_variables import refuse_ros_variables

WITHOUT_ROS = (
    'this needs ROS 2 and its rclpy, which cannot be imported here ({reason}): pip install '
    "'.[ros]' in its checkout, or source a ROS 2 Jazzy installation"
)

DEMO_HELP = """
Show the node at work without a robot: an arm that is not there moves, and what the node says of
it is printed. All of it stays on this computer, in the namespace /demo.

\b
Examples:
  kinematics_service demo
  kinematics_service demo --robot ur5e --duration 10 --trajectory sine
  kinematics_service demo --robot ur5e --replay recorded.csv

A recording has a line for each moment and these columns, in s, rad and m: stamp, position.JOINT
for each joint of the robot, and, if known, velocity.JOINT.
"""

ECHO_HELP = """
Print what a running node says, without any other ROS tool installed.

\b
Examples:
  kinematics_service echo
  kinematics_service echo pose --once
  kinematics_service echo warning --json
  kinematics_service echo twist --node /left_arm/kinematics
  kinematics_service echo pose --once --timeout 30
"""


# Of `echo`, in s.
ONCE_TIMEOUT, SHORTEST_TIMEOUT, LONGEST_TIMEOUT = 10.0, 0.1, 86_400.0


class DemoTrajectory(str, Enum):
    """How the demo moves the joints."""

    sine = 'sine'
    smooth = 'smooth'


class EchoedTopic(str, Enum):
    """What `echo` can print."""

    jacobian = 'jacobian'
    pose = 'pose'
    twist = 'twist'
    warning = 'warning'


class RosMissingError(Exception):
    """ROS cannot be imported; its text says how to get it."""


def _without_ros(error: ImportError) -> Exception:
    # An import of our own that fails is a mistake of ours, and stays what it is.
    ours = (error.name or '').startswith(__package__.partition('.')[0])
    return error if ours else RosMissingError(WITHOUT_ROS.format(reason=error))


def node(
    robots: list[str], ros_arguments: list[str], allow_unsecured: bool, allow_mixed_ros: bool
) -> None:
    """
    Run the node until it is told to stop.

    Raises
    ------
    RosMissingError
        rclpy or a message package cannot be imported.
    """
    refuse_ros_variables()
    try:
        from ..ros.process.runner import run_node
    except ImportError as error:
        raise _without_ros(error) from error
    raise typer.Exit(run_node(robots, ros_arguments, allow_unsecured, allow_mixed_ros))


def demo(
    context: typer.Context,
    robot: Annotated[
        Optional[str],
        typer.Option(
            metavar='FILE|NAME',
            help='A robot file, or a bundled robot.',
            show_default='puma560',
        ),
    ] = None,
    duration: Annotated[
        Optional[float],
        typer.Option(
            min=0.0, metavar='SECONDS', help='Stop after this time.', show_default='never'
        ),
    ] = None,
    trajectory: Annotated[
        DemoTrajectory,
        typer.Option(
            help='smooth: to and fro through a singular pose; sine: sines within the limits.'
        ),
    ] = DemoTrajectory.smooth,
    replay: Annotated[
        Optional[Path],
        typer.Option(
            exists=True,
            dir_okay=False,
            metavar='FILE.csv',
            help='Publish recorded joint positions instead.',
        ),
    ] = None,
) -> None:
    """Run the command; `DEMO_HELP` is what its user reads."""
    if robot is not None:
        refuse_unknown_robot(robot)
    if duration is not None and not math.isfinite(duration):
        raise WrongUsage(f'--duration: {duration} is not a time')
    refuse_ros_variables()
    try:
        from ..ros.tools.demo import run_demo
    except ImportError as error:
        raise _without_ros(error) from error
    raise typer.Exit(run_demo(robot, duration, trajectory.value, replay, context.obj))


def echo(
    context: typer.Context,
    what: Annotated[
        EchoedTopic, typer.Argument(help='Which of its topics.')
    ] = EchoedTopic.jacobian,
    once: Annotated[bool, typer.Option('--once', help='Stop after the first message.')] = False,
    json: Annotated[bool, typer.Option('--json', help='One JSON object a line.')] = False,
    node: Annotated[
        str, typer.Option(metavar='NAME', help='The full name of the node.')
    ] = '/kinematics',
    timeout: Annotated[
        Optional[float],
        typer.Option(
            metavar='SECONDS',
            help='Give up, with exit code 1, if nothing has come by then.',
            show_default=f'{ONCE_TIMEOUT:g} with --once, else never',
        ),
    ] = None,
) -> None:
    """Run the command; `ECHO_HELP` is what its user reads."""
    if timeout is not None and not timeout >= SHORTEST_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} is not at least {SHORTEST_TIMEOUT:g} s')
    if timeout is not None and timeout > LONGEST_TIMEOUT:
        raise WrongUsage(f'--timeout: {timeout:g} s is longer than a day: leave it out')
    refuse_ros_variables()
    try:
        from ..ros.tools.echo import run_echo
    except ImportError as error:
        raise _without_ros(error) from error
    if timeout is None and once:
        timeout = ONCE_TIMEOUT
    raise typer.Exit(run_echo(what.value, node, once, json, timeout, context.obj))
