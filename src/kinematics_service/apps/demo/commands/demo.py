# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the command `demo`, which runs the node with a simulated arm."""

import math
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import typer

from ....cli.missing_ros import ros_module
from ....cli.options import ROBOT, ROBOT_WORDS, WrongUsage, option, refuse_unknown_robot


class DemoTrajectory(str, Enum):
    """
    The motions of the simulated arm: a path through a singular pose (smooth), or sines within the
    joint limits (sine).
    """

    sine = 'sine'
    smooth = 'smooth'


def demo(
    context: typer.Context,
    robot: Optional[str] = option(ROBOT_WORDS, ROBOT, shown='puma560'),
    duration: Optional[float] = option(
        'Stop after this time.', 'SECONDS', shown='never', least=0.0
    ),
    trajectory: DemoTrajectory = option(
        'smooth: back and forth through a singular pose; sine: sines within the limits.',
        default=DemoTrajectory.smooth,
    ),
    replay: Annotated[
        Optional[Path],
        typer.Option(
            exists=True,
            dir_okay=False,
            metavar='FILE.csv',
            help='Publish the joint positions of this recording instead of the motion.',
        ),
    ] = None,
) -> None:
    """
    Show the node at work without a robot: a simulated arm moves, and the node's outputs are
    printed. All of it stays on this computer, in the namespace /demo.

    \b
    Examples:
      kinematics_service demo
      kinematics_service demo --robot ur5e --duration 10 --trajectory sine
      kinematics_service demo --robot ur5e --replay recorded.csv

    A recording has a line for each moment and these columns, in s, rad and m: stamp,
    position.JOINT for each joint of the robot, and, if known, velocity.JOINT.
    """
    if robot is not None:
        refuse_unknown_robot(robot)
    if duration is not None and not math.isfinite(duration):
        raise WrongUsage(f'--duration: {duration} is not finite; give seconds')
    run_demo = ros_module('apps.demo.demo').run_demo
    raise typer.Exit(run_demo(robot, duration, trajectory.value, replay, context.obj))
