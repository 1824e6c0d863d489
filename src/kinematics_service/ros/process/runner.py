"""From the command line to a running node and back to an exit code."""

import contextlib
import gc
import os
import sys
from collections.abc import Sequence

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.signals import SignalHandlerOptions

from ...errors import ArmsError, KinematicsError, RobotConflictError
from ...stop_signals import StopSignal, stop_signals
from ..messages.messages import full_name
from ..node.node import KinematicsNode
from .arms import ArmChoice, arms_from
from .environment import log_refusal, mixture_refusal, security_refusal
from .log_callers import know_callers
from .middleware import take_profiles
from .spin import Spinner

FINE, FAULT, WRONG_USAGE = 0, 1, 2
# rclpy's message about QoS overrides; its constructor only says that it refuses them.
QOS_PROFILE = 'rmw_qos_profile_t'
# The executor of the node runs so long without a look at the end (s): what ends it interrupts it.
UNDISTURBED = 60.0


def tell(sentence: str) -> None:
    """Write one line to standard error."""
    print(f'kinematics_service: {sentence}', file=sys.stderr, flush=True)


def start_refusal(allow_unsecured: bool, allow_mixed_ros: bool) -> str | None:
    """Return why the node must not start in this environment, None if it may."""
    return (None if allow_unsecured else security_refusal()) or (
        None if allow_mixed_ros else mixture_refusal()
    )


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
        tell(f'wrong ROS arguments: {_first_clause(error)}')
        return None
    finally:
        set_logger_level('rcl', LoggingSeverity.UNSET)
    return context


def _first_clause(error: Exception) -> str:
    # rcl appends positions in its source, each after ', at '.
    return str(error).split(', at ')[0].replace('\n', ' ')


def run_node(
    robots: Sequence[str],
    ros_args: Sequence[str],
    allow_unsecured: bool = False,
    allow_mixed_ros: bool = False,
) -> int:
    """
    Run the node until SIGINT or SIGTERM; return the exit code.

    Parameters
    ----------
    robots
        Files or bundled names, each with `NAMESPACE=` before it or not: one node for each, all in
        this process; none for the parameter `robot`.
    ros_args
        ROS arguments, `--ros-args` included.
    allow_unsecured, allow_mixed_ros
        Start although security is requested and missing, or two ROS installations are mixed.

    Returns
    -------
    0 after a signal, 1 for a bad robot file or parameter, 2 for wrong usage.
    """
    refusal = start_refusal(allow_unsecured, allow_mixed_ros)
    if refusal is not None:
        tell(refusal)
        return FAULT
    try:
        arms = arms_from(robots)
    except ArmsError as error:
        tell(str(error))
        return WRONG_USAGE
    with stop_signals() as stop:
        context = open_context(ros_args)
        if context is None:
            return WRONG_USAGE
        nodes: list[KinematicsNode] = []
        know_callers()
        try:
            code = _run(arms, context, stop, nodes)
        finally:
            for node in nodes:
                node.destroy_node()
            context.try_shutdown()
        return leave(code, stop)


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


def _run(
    arms: Sequence[ArmChoice], context: Context, stop: StopSignal, nodes: list[KinematicsNode]
) -> int:
    try:
        for arm in arms:
            nodes.append(_node(arm, context, nodes))
    except (RobotConflictError, ArmsError) as error:
        tell(str(error))
        return WRONG_USAGE
    except KinematicsError as error:
        tell(str(error))
        return FAULT
    except (ParameterException, RuntimeError) as error:
        # Settings that rclpy itself reads: use_sim_time, QoS overrides, the names of the node.
        tell(f'rclpy cannot start the node: {_first_clause(error)}')
        return FAULT
    except TypeError as error:
        if QOS_PROFILE not in str(error):
            raise
        tell('rclpy cannot start the node: a value of qos_overrides is out of its range')
        return FAULT

    def left_out(count: int) -> None:
        for node in nodes:
            node.events_were_left_out(count)

    spinner = Spinner(context, nodes, left_out)
    if spinner.in_order:
        for node in nodes:
            node.trust_the_order_of_events()
    # All present objects stay. The garbage collector takes some 80 ms to look through them, which
    # would fall between two messages, and more at the end.
    gc.freeze()
    gc.enable()
    stop.then = spinner.interrupt
    stop.meanwhile = spinner.watch
    fine = spinner.spin(lambda: stop.came or not context.ok(), UNDISTURBED)
    for node in nodes:
        if context.ok():
            node.end_motion()
    spinner.close()
    return FINE if fine else FAULT


def _node(arm: ArmChoice, context: Context, others: Sequence[KinematicsNode]) -> KinematicsNode:
    options = {} if arm.namespace is None else {'namespace': arm.namespace}
    node = KinematicsNode(arm.robot, context=context, **options)
    name = full_name(node)
    if name in [full_name(other) for other in others]:
        # A remapping of names holds for every node of the process.
        node.destroy_node()
        raise ArmsError(
            f'two arms are named /{name}: give the namespaces as '
            '--robot NAMESPACE=ROBOT, not by -r __ns:= or -r __node:='
        )
    return node
