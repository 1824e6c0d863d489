# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the demo in one process: a simulated arm, the node, and a table of the node's messages."""

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rclpy.context import Context
from rclpy.node import Node
from rich.console import Console, Group

from ...app_modules import app_module
from ...errors import RecordingError
from ...node.messages.topics import COMMAND
from ...node.node import KinematicsNode
from ...node.process.session import FAULT, SUCCESS, destroy, helper_node, run_session
from ...node.process.spin import Spinner
from ...node.steady_time import steady_timer
from ...robot.measure_units import measure_units
from ...stop_signals import StopSignal
from .demo_listener import DemoListener
from .demo_report import PlainReport, invitation, motion_in_words, summary
from .demo_screen import screen
from .live_table import live
from .motions.trajectory import TRAJECTORIES
from .standard_output import StandardOutput
from .virtual_arm import (
    VirtualArm,
    moments_of_recording,
    moments_of_trajectory,
    period_of_recording,
)

NAMESPACE = '/demo'
# Remappings that keep all topics in the namespace of the demo. They come before the user's
# remappings, because ROS uses the first remapping that matches.
RULES = (
    f'__ns:={NAMESPACE}',
    '__node:=kinematics',
    f'joint_states:={NAMESPACE}/joint_states',
    f'/diagnostics:={NAMESPACE}/diagnostics',
    f'/tf:={NAMESPACE}/tf',
)
# ROS arguments that hide the log lines at the start of the node, which would disturb the live
# table.
QUIET = ('--ros-args', '--log-level', f'{NAMESPACE[1:]}.kinematics:=warn', '--')
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
# Environment variables that extend ROS discovery beyond this host even if `RANGE` is `LOCALHOST`.
REMOTE_DISCOVERY = ('ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER')

# Time between two printed lines about the tool and the distance to singular poses, if the output
# is not a terminal, s.
LINE_PERIOD = 1.0
# Longest wait until node, arm and display have discovered each other, s.
DISCOVERY_TIMEOUT = 5.0
# Longest wait, at the end of the demo, for the node's answers to the last joint states, s.
LAST_ANSWER_TIMEOUT = 0.4
# Control sequences that restore the screen and the cursor that the terminal had before the demo.
LEAVE_SCREEN = b'\x1b[?1049l\x1b[?25h'


def run_demo(
    robot: str | None,
    duration: float | None,
    trajectory: str,
    replay: str | os.PathLike[str] | None,
    ros_args: Sequence[str],
) -> int:
    """
    Move a simulated arm through a singular pose, and show the outputs of the node.

    Parameters
    ----------
    robot
        Robot file or bundled name; None for the default robot of the node.
    duration
        Time until the demo ends, s; None: it ends at a signal, or at the end of the recording.
    trajectory
        Name of the motion, `smooth` or `sine`.
    replay
        CSV file of a recording that is replayed instead of a trajectory.
    ros_args
        ROS arguments, `--ros-args` included.

    Returns
    -------
    0 after the duration or a signal, 1 for a wrong robot file, recording or parameter, 2 for wrong
    usage.
    """
    set_aside = stay_on_this_host()

    def work(context: Context, stop: StopSignal) -> int:
        rules = [word for rule in RULES for word in ('-r', rule)]
        node = KinematicsNode(robot, context=context, cli_args=['--ros-args', *rules])
        arm, motion = _arm(node, trajectory, replay)
        if robot is None:
            motion += ' (choose another robot with --robot FILE|NAME)'
        lines = invitation(
            motion, node.get_fully_qualified_name(), f'{RANGE}={os.environ[RANGE]}', set_aside
        )
        return _play(node, arm, lines, duration, stop)

    return run_session([*QUIET, *ros_args], work)


def stay_on_this_host() -> tuple[str, ...]:
    """Limit ROS discovery to this host; return the environment variables that were removed."""
    if os.environ.get(RANGE, '').upper() not in ('LOCALHOST', 'OFF'):
        os.environ[RANGE] = 'LOCALHOST'
    return tuple(name for name in REMOTE_DISCOVERY if os.environ.pop(name, ''))


def _arm(
    node: KinematicsNode, trajectory: str, replay: str | os.PathLike[str] | None
) -> tuple[VirtualArm, str]:
    # Return the simulated arm, and a text that describes how it moves.
    robot, names = node.settings.robot, node.settings.joint_names
    command = COMMAND.replace('~', node.get_fully_qualified_name())
    if replay is not None:
        recordings = app_module('recording')
        if recordings is None:
            message = '--replay: the app recordings, which reads it, was removed; install it again'
            raise RecordingError(message, code='missing-package')
        recording = recordings.read_recording(Path(replay), robot)
        due = recording.due
        words = f'{robot.name} replays {len(due)} joint states of {due[-1]:.1f} s from {replay}'
        moments = moments_of_recording(due, *recording)
        arm = VirtualArm(_helper(node, 'arm'), names, moments, period_of_recording(due), command)
        return arm, words
    path = TRAJECTORIES[trajectory](robot)
    smooth = trajectory == 'smooth'
    words = motion_in_words(robot, path) if smooth else f'{robot.name} moves in sines'
    moments = moments_of_trajectory(path, time.time_ns())
    return VirtualArm(_helper(node, 'arm'), names, moments, command=command), words


def _play(
    node: KinematicsNode,
    arm: VirtualArm,
    lines: Sequence[str],
    duration: float | None,
    stop: StopSignal,
) -> int:
    display = _helper(node, 'display')
    listener = DemoListener(display, node.get_fully_qualified_name())
    output = StandardOutput()
    spinner = Spinner(node.context, [node, arm.node, display], node.events_were_left_out)
    spinner.obey(stop)
    output.line(*lines)

    def over() -> bool:
        return stop.came or not node.context.ok() or output.closed

    def turn(until: Callable[[], bool], longest: float | None = None) -> bool:
        end = None if longest is None else time.monotonic() + longest
        return spinner.spin(
            lambda: over() or until() or (end is not None and time.monotonic() >= end)
        )

    is_intact = turn(lambda: arm.heard and listener.is_discovered(node), DISCOVERY_TIMEOUT)
    if output.is_terminal:
        stop.last_words = LEAVE_SCREEN
    with _report(display, listener, output, measure_units(node.settings.robot)):
        listener.start()
        arm.start()
        is_intact = is_intact and turn(lambda: arm.finished, duration)
        arm.stop()
        deadline = time.monotonic() + LAST_ANSWER_TIMEOUT
        is_intact = is_intact and spinner.spin(
            lambda: listener.answered >= arm.sent or time.monotonic() >= deadline
        )
    output.line(*summary(listener, arm.sent))
    spinner.close()
    destroy(display, arm.node, node)
    return SUCCESS if is_intact else FAULT


def _helper(node: KinematicsNode, name: str) -> Node:
    return helper_node(name, node.context, namespace=NAMESPACE, use_global_arguments=False)


@contextmanager
def _report(
    display: Node, listener: DemoListener, output: StandardOutput, units: Mapping[str, str]
) -> Iterator[None]:
    # Show the messages while the `with` block runs. A terminal shows a table on a separate screen;
    # any other output gets lines. At the end, restore the former screen of the terminal.
    if not output.is_terminal:
        report = PlainReport(listener, output)
        listener.then = report.warn
        steady_timer(display, LINE_PERIOD, report.tick)
        yield
        return

    def drawn(console: Console) -> Group:
        return screen(listener, console.size, output.shows_blocks, units)

    with live(display, drawn, whole=True):
        yield
