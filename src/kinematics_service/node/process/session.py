"""What talks to ROS, from the start of the process to its end: its context, signals, exit code."""

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

FINE, FAULT, WRONG_USAGE = 0, 1, 2
# Names of nodes, for a user who gave one that is none.
NODE_NAMES = '/kinematics or /arm/kinematics'
# Time for the clean-up after a signal (s): where a publisher was killed inside Fast DDS's shared
# memory, the end of its subscription may never come back. `ros2 launch` insists after 5 s.
TIME_OUT = 3.0
Result = TypeVar('Result')


def tell(sentence: str) -> None:
    """Print a message to standard error."""
    print(f'kinematics_service: {sentence}', file=sys.stderr, flush=True)


def run_session(
    ros_args: Sequence[str],
    work: Callable[[Context, StopSignal], Result],
    allow_unsecured: bool = False,
    allow_mixed_ros: bool = False,
    time_out: float | None = TIME_OUT,
) -> Result | int:
    """
    Return what is done with a context of ROS, or the exit code where that cannot be.

    If it is an exit code and a signal asked for the end, the process ends.

    Parameters
    ----------
    ros_args
        ROS arguments, `--ros-args` included.
    work
        What is done.
    allow_unsecured, allow_mixed_ros
        Start although security is requested and missing, or two ROS installations are mixed.
    time_out
        Time from a signal to the end of `work`, s; None: as long as it takes.
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
    Return a context initialised with ROS arguments, without rclpy's signal handlers.

    None, after one line to standard error, if the arguments are wrong.
    """
    take_profiles()
    context = Context()
    unlogged = log_refusal()
    if unlogged is not None:
        tell(f'messages are not written to a log file: {unlogged}')
        ros_args = [*ros_args, '--ros-args', '--disable-external-lib-logs', '--']
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it repeats the message below
    try:
        rclpy.init(
            args=['kinematics_service', *ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except Exception as error:  # RCLError and UnknownROSArgsError share no base
        tell(f'wrong ROS arguments: {first_clause(error)}')
        return None
    finally:
        set_logger_level('rcl', LoggingSeverity.UNSET)
    return context


def first_clause(error: Exception) -> str:
    """Return what rcl says, without the positions in its source that it appends."""
    # Each stands after ', at '.
    return str(error).split(', at ')[0].replace('\n', ' ')


def leave(code: int, stop: StopSignal) -> int:
    """
    End the process if a signal asked for it; else return the code. Everything must be closed
    before.

    The end of the interpreter takes seconds on a busy machine and ignores signals.
    """
    if stop.came:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):  # closed, or its reader has gone
                stream.flush()
        os._exit(code)
    return code


def destroy(*nodes: Node) -> None:
    """
    Destroy nodes; end the process, with code 1, if the middleware does not come back.

    Fast DDS may wait for ever if a participant of another process goes at the same moment. It
    keeps the interpreter's lock then: the timer of the signal ends the process, or, if there was
    no signal, a thread in C does.
    """
    with open(os.devnull, 'w') as nowhere:
        faulthandler.dump_traceback_later(TIME_OUT + 2.0 * GRACE, exit=True, file=nowhere)
        try:
            for node in nodes:
                node.destroy_node()
        finally:
            faulthandler.cancel_dump_traceback_later()


def helper_node(name: str, context: Context, **options: Any) -> Node:
    """Return a node that is not to be seen: without parameters and without a log on a topic."""
    return Node(
        name, context=context, start_parameter_services=False, enable_rosout=False, **options
    )


def is_name(option: str, name: str, example: str) -> bool:
    """Return whether a node or a topic can have a full name; say that it cannot."""
    try:
        validate_full_topic_name(f'/{name.strip("/")}/pose')
    except InvalidTopicNameException:
        tell(f'{option} {name}: not a name of ROS, such as {example}')
        return False
    return True
