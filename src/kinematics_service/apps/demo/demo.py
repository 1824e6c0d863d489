"""The demo: one process with a simulated arm, the node, and a live table of its outputs."""

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rclpy.context import Context
from rclpy.node import Node
from rich.console import Console, RenderableType

from ...app_modules import app_module
from ...errors import RecordingError
from ...node.messages.topics import COMMAND
from ...node.node import KinematicsNode
from ...node.process.session import FAULT, FINE, destroy, helper_node, run_session
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
# The demo's own remappings come before the user's, so that the demo stays in its namespace.
RULES = (
    f'__ns:={NAMESPACE}',
    '__node:=kinematics',
    f'joint_states:={NAMESPACE}/joint_states',
    f'/diagnostics:={NAMESPACE}/diagnostics',
    f'/tf:={NAMESPACE}/tf',
)
# The live table would tear the node's introduction apart.
QUIET = ('--ros-args', '--log-level', f'{NAMESPACE[1:]}.kinematics:=warn', '--')
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
# Variables that would lead discovery off this host all the same.
LEADS_ELSEWHERE = ('ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER')

# Period of the plain line, s.
SECOND = 1.0
# Longest waits for the parts to find each other, and for the last answers (after a signal, too),
# in s.
MEETING, FAREWELL = 5.0, 0.4
# Back to the terminal's own screen, with its cursor.
LEAVE_SCREEN = b'\x1b[?1049l\x1b[?25h'


def run_demo(
    robot: str | None,
    duration: float | None,
    trajectory: str,
    replay: str | os.PathLike[str] | None,
    ros_args: Sequence[str],
) -> int:
    """
    Move a simulated arm through a singular pose and show the node's outputs.

    Parameters
    ----------
    robot
        File or bundled name; None for the node's default.
    duration
        Seconds until the end; None: until a signal, or the end of the recording.
    trajectory
        `smooth` or `sine`.
    replay
        CSV file to replay instead.
    ros_args
        ROS arguments, `--ros-args` included.

    Returns
    -------
    0 after the duration or a signal, 1 for a bad robot file, recording or parameter, 2 for wrong
    usage.
    """
    set_aside = stay_on_this_host()

    def work(context: Context, stop: StopSignal) -> int:
        rules = [word for rule in RULES for word in ('-r', rule)]
        node = KinematicsNode(robot, context=context, cli_args=['--ros-args', *rules])
        arm, motion = _arm(node, trajectory, replay)
        lines = invitation(
            motion, node.get_fully_qualified_name(), f'{RANGE}={os.environ[RANGE]}', set_aside
        )
        return _play(node, arm, lines, duration, stop)

    return run_session([*QUIET, *ros_args], work)


def stay_on_this_host() -> tuple[str, ...]:
    """Limit ROS discovery to this host; return the variables that had to be set aside for that."""
    if os.environ.get(RANGE, '').upper() not in ('LOCALHOST', 'OFF'):
        os.environ[RANGE] = 'LOCALHOST'
    return tuple(name for name in LEADS_ELSEWHERE if os.environ.pop(name, ''))


def _arm(
    node: KinematicsNode, trajectory: str, replay: str | os.PathLike[str] | None
) -> tuple[VirtualArm, str]:
    # Returns the arm, and its motion in words.
    robot, names = node.settings.robot, node.settings.joint_names
    command = COMMAND.replace('~', node.get_fully_qualified_name())
    if replay is not None:
        recordings = app_module('recording')
        if recordings is None:
            raise RecordingError('--replay: the app recordings, which reads it, was removed')
        recording = recordings.read_recording(Path(replay), robot)
        rows, seconds = len(recording.stamps), recording.due[-1]
        words = f'{robot.name} replays {rows} joint states of {seconds:.1f} s from {replay}'
        moments, period = moments_of_recording(recording), period_of_recording(recording)
        return VirtualArm(_helper(node, 'arm'), names, moments, period, command), words
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

    fine = turn(lambda: arm.heard and listener.found(node), MEETING)
    if output.is_terminal:
        stop.last_words = LEAVE_SCREEN
    with _report(display, listener, output, measure_units(node.settings.robot)):
        listener.start()
        arm.start()
        fine = fine and turn(lambda: arm.finished, duration)
        arm.stop()
        farewell = time.monotonic() + FAREWELL
        fine = fine and spinner.spin(
            lambda: listener.answered >= arm.sent or time.monotonic() >= farewell
        )
    output.line(*summary(listener, arm.sent))
    spinner.close()
    destroy(display, arm.node, node)
    return FINE if fine else FAULT


def _helper(node: KinematicsNode, name: str) -> Node:
    return helper_node(name, node.context, namespace=NAMESPACE, use_global_arguments=False)


@contextmanager
def _report(
    display: Node, listener: DemoListener, output: StandardOutput, units: Mapping[str, str]
) -> Iterator[None]:
    # On a terminal the table has a screen of its own; the former one is restored in the end.
    if not output.is_terminal:
        report = PlainReport(listener, output)
        listener.then = report.warn
        steady_timer(display, SECOND, report.tick)
        yield
        return

    def drawn(console: Console) -> RenderableType:
        return screen(listener, console.size, output.shows_blocks, units)

    with live(display, drawn, whole=True):
        yield
