"""Requests to a running node: set one of its parameters, or let it read its robot again."""

import difflib
import json
import os
import time
from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameterTypes, ListParameters, SetParameters
from rclpy.context import Context
from rclpy.parameter import get_parameter_value
from std_srvs.srv import Trigger

from ...errors import KinematicsError, SettingsError
from ...stop_signals import StopSignal
from ..messages.topics import RELOAD
from ..parameters.settled_file import PATIENCE
from ..process import session
from ..process.no_messages import kinematics_nodes
from ..process.node_facts import TRY, call_service
from ..process.spin import Spinner

# Longest wait for the discovery of a node, and of a service, s.
DEADLINE = 5.0
# Other nodes are awaited for this time after the first, s, if none is named.
OTHERS = 1.0

Ask = Callable[..., Any]


def run_set(source: str, name: str, text: str, ros_args: Sequence[str]) -> int:
    """
    Set a parameter of a node; print its value, or why the node refuses it.

    Parameters
    ----------
    source
        Full name of the node; empty for the only kinematics node here.
    name, text
        The parameter, and its value in YAML.
    ros_args
        ROS arguments, `--ros-args` included.

    Returns
    -------
    0 if it is set; 1 if it is refused or no node answers; 2 for wrong usage.
    """

    def request(node: str, ask: Ask) -> str:
        names = ask('list_parameters', ListParameters, ListParameters.Request()).result.names
        if name not in names:
            near = ', '.join(difflib.get_close_matches(name, names)) or ', '.join(sorted(names))
            raise SettingsError(f'{node} has no parameter {name!r}; the nearest: {near}')
        asked = GetParameterTypes.Request(names=[name])
        kind = ask('get_parameter_types', GetParameterTypes, asked).types[0]
        change = Parameter(name=name, value=value_from(text, kind))
        done = ask('set_parameters', SetParameters, SetParameters.Request(parameters=[change]))
        if not done.results[0].successful:
            raise SettingsError(f'{node} refuses {name}: {done.results[0].reason}')
        described = json.loads(ask('describe', Trigger, Trigger.Request()).message)
        for doubt in described['doubts']:
            if name in doubt:
                session.tell(doubt)
        return f'{node}: {name} is now {text}'

    return _run(source, ros_args, request)


def run_reload(source: str, ros_args: Sequence[str]) -> int:
    """Let a node read its robot again, and print its sentence; as `run_set`."""

    def request(node: str, ask: Ask) -> str:
        done = ask(RELOAD.removeprefix('~/'), Trigger, Trigger.Request(), TRY + PATIENCE)
        if not done.success:
            raise SettingsError(f'{node} refuses it: {done.message}')
        return f'{node}: {done.message}'

    return _run(source, ros_args, request)


def value_from(text: str, kind: int) -> ParameterValue:
    """Return the value that a text in YAML means for a parameter of a type; `1` is also 1.0."""
    if kind == ParameterType.PARAMETER_STRING and text[:1] not in ('"', "'"):
        return ParameterValue(type=kind, string_value=text)
    try:
        if kind == ParameterType.PARAMETER_DOUBLE:
            return ParameterValue(type=kind, double_value=float(text))
        if text.startswith('[') and text.strip('[] '):
            numbers = [float(number) for number in text.strip('[] ').split(',')]
            kind = ParameterType.PARAMETER_DOUBLE_ARRAY
            return ParameterValue(type=kind, double_array_value=numbers)
    except ValueError:
        pass  # the node refuses it, or it is a list of names
    try:
        return get_parameter_value(text)
    except Exception:  # of PyYAML, and of fields of messages
        raise SettingsError(f'{text!r} is no value in YAML') from None


def _run(source: str, ros_args: Sequence[str], request: Callable[[str, Ask], str]) -> int:
    if source and not session.is_name('NODE', source, session.NODE_NAMES):
        return session.WRONG_USAGE

    def work(context: Context, stop: StopSignal) -> int:
        client = session.helper_node(f'kinematics_request_{os.getpid()}', context)
        spinner = Spinner(context, [client])
        spinner.obey(stop)
        try:
            node = _found(client, spinner, f'/{source.strip("/")}' if source else '')

            def ask(service: str, kind: Any, content: Any, longest: float = TRY) -> Any:
                end, name = time.monotonic() + DEADLINE, f'{node}/{service}'
                answer = call_service(client, spinner, kind, name, content, end, longest)
                if answer is None:
                    raise SettingsError(f'{name} does not answer')
                return answer

            print(request(node, ask), flush=True)
            return session.FINE
        except KinematicsError as error:
            session.tell(str(error))
            return session.FAULT
        finally:
            spinner.close()
            session.destroy(client)

    return session.run_session(ros_args, work)


def _found(client: Any, spinner: Spinner, source: str) -> str:
    # The full name of the node that is meant: the one named, or the only one.
    end = time.monotonic() + DEADLINE
    found: list[str] = []
    while time.monotonic() < end and source not in found:
        spinner.spin_once(timeout_sec=0.05)
        if not found and (found := kinematics_nodes(client)) and not source:
            end = time.monotonic() + OTHERS
        found = kinematics_nodes(client)
    if source in found:
        return source
    if not source and len(found) == 1:
        return found[0]
    what = f'there is no node {source}' if source else 'name the node'
    raise SettingsError(f'{what}; kinematics nodes here: {", ".join(found) or "none"}')
