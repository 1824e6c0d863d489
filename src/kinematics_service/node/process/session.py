# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Manage the ROS context of a process: start, signals, end and exit code."""

import contextlib
import faulthandler
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidTopicNameException
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_full_topic_name import validate_full_topic_name

from ...stop_signals import GRACE, StopSignal, stop_signals
from .environment import log_refusal, mixture_refusal, security_refusal
from .middleware import take_profiles

# Exit codes of the process.
SUCCESS = 0
FAULT = 1
WRONG_USAGE = 2
# Examples of node names for an error message.
NODE_NAMES = '/kinematics or /arm/kinematics'
# Longest clean-up after a signal (s). If the process of a publisher is killed while that process
# accesses the shared memory of Fast DDS, the destruction of a subscription to the publisher may
# never return. So the clean-up has a time limit. The limit is below 5 s, after which `ros2 launch`
# sends the next signal.
CLEAN_UP_TIMEOUT = 3.0
Result = TypeVar('Result')


def tell(sentence: str) -> None:
    """Print a message to standard error."""
    print(f'kinematics_service: {sentence}', file=sys.stderr, flush=True)


def run_session(
    ros_args: Sequence[str],
    work: Callable[[Context, StopSignal], Result],
    allow_unsecured: bool = False,
    allow_mixed_ros: bool = False,
    time_out: float | None = CLEAN_UP_TIMEOUT,
) -> Result | int:
    """
    Call `work` with a ROS context and return the result; if no context can start, return an exit
    code.

    If `work` returns an exit code and a signal requested the end, the process ends with this code.

    Parameters
    ----------
    ros_args
        ROS arguments, `--ros-args` included.
    work
        A function of context and stop signal that does the work of the process.
    allow_unsecured, allow_mixed_ros
        Whether to start if security is requested but missing, or if two ROS installations are
        mixed.
    time_out
        Longest time from a signal to the end of `work`, s; None: unlimited.
    """
    refusal = (None if allow_unsecured else security_refusal()) or (
        None if allow_mixed_ros else mixture_refusal()
    )
    if refusal is not None:
        tell(refusal)
        return FAULT
    with stop_signals() as stop:
        stop.time_out = time_out
        context = open_context(ros_args)
        if context is None:
            return WRONG_USAGE
        try:
            result = work(context, stop)
        finally:
            context.try_shutdown()
        return leave(result, stop) if isinstance(result, int) else result


def open_context(ros_args: Sequence[str]) -> Context | None:
    """
    Return a context initialized with ROS arguments, without the signal handlers of rclpy.

    If the arguments are wrong, print one line to standard error and return None.
    """
    take_profiles()
    context = Context()
    unlogged = log_refusal()
    if unlogged is not None:
        tell(
            f'messages are not written to a log file: {unlogged}; set ROS_LOG_DIR to a writable '
            'folder'
        )
        ros_args = [*ros_args, '--ros-args', '--disable-external-lib-logs', '--']
    # rcl must not print its error message, because `tell` prints this message below
    set_logger_level('rcl', LoggingSeverity.FATAL)
    try:
        rclpy.init(
            args=['kinematics_service', *ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except Exception as error:  # RCLError and UnknownROSArgsError have no common base class
        tell(f'wrong ROS arguments: {first_clause(error)}')
        return None
    finally:
        set_logger_level('rcl', LoggingSeverity.UNSET)
    return context


def first_clause(error: Exception) -> str:
    """Return the message of an error of rcl, without positions in source code."""
    # In messages of rcl, the text ', at ' is before a position in source code.
    return str(error).split(', at ')[0].replace('\n', ' ')


def leave(code: int, stop: StopSignal) -> int:
    """
    End the process with the exit code `code` if a signal requested the end; otherwise return
    `code`.

    The caller must have closed all nodes and contexts. The process does not end regularly, because
    the regular end of the interpreter takes seconds on a busy machine and ignores signals.
    """
    if stop.came:
        for stream in (sys.stdout, sys.stderr):
            # ignore the error of a stream that is closed or whose reader has exited
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    return code


def destroy(*nodes: Node) -> None:
    """
    Destroy nodes; if the middleware hangs, end the process with exit code 1.

    Fast DDS may wait forever, holding the interpreter's lock, if a participant of another process
    ends at that time. Then one of two things ends the process: the alarm that `StopSignal` sets at
    a signal, or the thread of `faulthandler`, which needs no interpreter lock.
    """
    with open(os.devnull, 'w') as nowhere:
        faulthandler.dump_traceback_later(CLEAN_UP_TIMEOUT + 2.0 * GRACE, exit=True, file=nowhere)
        try:
            for node in nodes:
                node.destroy_node()
        finally:
            faulthandler.cancel_dump_traceback_later()


def helper_node(name: str, context: Context, **options: Any) -> Node:
    """Return a node for short tasks, without parameter services and without a log on a topic."""
    return Node(
        name, context=context, start_parameter_services=False, enable_rosout=False, **options
    )


def is_name(option: str, name: str, example: str) -> bool:
    """Return whether a full name is valid for a node or a topic; if not, print an error."""
    try:
        validate_full_topic_name(f'/{name.strip("/")}/pose')
    except InvalidTopicNameException:
        tell(f'{option} {name}: not a name of ROS, such as {example}')
        return False
    return True
