# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Send requests to a running node: set a parameter, or read the robot again."""

import difflib
import os
import re
import time
from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import ListParameters, SetParameters
from rclpy.context import Context
from rclpy.parameter import get_parameter_value
from std_srvs.srv import Trigger

from ...errors import SettingsError
from ...stop_signals import StopSignal
from ..messages.graph import kinematics_nodes
from ..messages.topics import RELOAD
from ..parameters.settled_file import SETTLING_TIMEOUT
from . import session
from .service_calls import CALL_TIMEOUT, call_service
from .spin import Spinner

# Longest wait until a service is discovered, s.
DISCOVERY_TIMEOUT = 5.0
# Largest number of similar names in the error about an unknown parameter.
SUGGESTED_NAMES = 5
# Descriptions of rclpy's parameter types; all other types are lists.
TYPES = {'BOOL': 'true or false', 'INTEGER': 'a number', 'DOUBLE': 'a number', 'STRING': 'a text'}

Ask = Callable[..., Any]


def run_set(node: str, name: str, text: str, ros_args: Sequence[str]) -> int:
    """
    Set a parameter of a running node; print the new value, or why the node refuses it.

    Parameters
    ----------
    node
        Full name of the node; the leading slash may be missing.
    name, text
        The parameter, and its value in YAML.
    ros_args
        ROS arguments, `--ros-args` included.

    Returns
    -------
    0 if the parameter is set; 1 if the node refuses the value or does not answer; 2 for wrong
    usage.
    """

    def request(ask: Ask) -> str:
        names = ask('list_parameters', ListParameters, ListParameters.Request()).result.names
        if name not in names:
            near = ', '.join(difflib.get_close_matches(name, names, SUGGESTED_NAMES, cutoff=0.0))
            raise SettingsError(f'no parameter {name!r}; similar: {near}', code='unknown-name')
        change = Parameter(name=name, value=value_from(text))
        done = ask('set_parameters', SetParameters, SetParameters.Request(parameters=[change]))
        result = done.results[0]
        reason = re.sub(r"'Type\.(\w+)'", lambda of: TYPES.get(of[1], 'a list'), result.reason)
        if not result.successful:
            raise SettingsError(f'{name} is refused: {reason}', code='refused')
        return f'{name} is now {text}' + (f'; {reason}' if reason else '')

    return _run(node, ros_args, request)


def run_reload(node: str, ros_args: Sequence[str]) -> int:
    """
    Ask a node to read its robot again, and print the answer of the node. Return an exit code as
    `run_set` does.
    """

    def request(ask: Ask) -> str:
        done = ask(
            RELOAD.removeprefix('~/'), Trigger, Trigger.Request(), CALL_TIMEOUT + SETTLING_TIMEOUT
        )
        if not done.success:
            raise SettingsError(f'the robot is refused: {done.message}', code='refused')
        return str(done.message)

    return _run(node, ros_args, request)


def value_from(text: str) -> ParameterValue:
    """
    Return the value of a YAML text as a parameter value. The text 1 gives 1.0, because no
    parameter is an integer.
    """
    wrong = SettingsError(
        f"{text!r} is not a value; give a number, true, a text, or a list such as '[0, 0, 0.15]'",
        code='syntax',
    )
    if text.startswith('{') or text.startswith('[') != text.endswith(']'):
        raise wrong
    try:
        if text.startswith('['):
            numbers = [float(number) for number in text[1:-1].split(',')]
            kind = ParameterType.PARAMETER_DOUBLE_ARRAY
            return ParameterValue(type=kind, double_array_value=numbers)
        return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=float(text))
    except ValueError:
        pass  # the text is not a number
    try:
        return get_parameter_value(text)
    except Exception:  # an error of PyYAML, or of a field of a message
        raise wrong from None


def _run(node: str, ros_args: Sequence[str], request: Callable[[Ask], str]) -> int:
    if not session.is_name('NODE', node, session.NODE_NAMES):
        return session.WRONG_USAGE
    node = f'/{node.strip("/")}'

    def work(context: Context, stop: StopSignal) -> int:
        client = session.helper_node(f'kinematics_request_{os.getpid()}', context)
        spinner = Spinner(context, [client])

        def ask(service: str, kind: Any, content: Any, longest: float = CALL_TIMEOUT) -> Any:
            end, name = time.monotonic() + DISCOVERY_TIMEOUT, f'{node}/{service}'
            answer = call_service(client, spinner, kind, name, content, end, longest)
            if answer is None:
                nodes = ', '.join(kinematics_nodes(client)) or 'none'
                reason, code = 'there is no node of this name', 'unknown-name'
                if client.count_services(name):
                    reason, code = f'{service} does not answer', 'no-answer'
                raise SettingsError(f'{reason}; kinematics nodes here: {nodes}', code=code)
            return answer

        try:
            print(f'{node}: {request(ask)}', flush=True)
            return session.SUCCESS
        except SettingsError as error:
            session.tell(f'{node}: {error}')
            return session.FAULT
        finally:
            spinner.close()
            session.destroy(client)

    return session.run_session(ros_args, work)
