# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the nodes that a command line asks for, and return an exit code."""

import gc
import inspect
import re
import sys
from collections.abc import Sequence
from pathlib import PurePath
from typing import NamedTuple

from rclpy.context import Context
from rclpy.exceptions import ParameterException

from ...errors import ArmsError
from ...robot.bundled import TOPIC
from ...robot.cell import cell_of
from ...stop_signals import StopSignal
from ..messages.messages import full_name
from ..messages.topics import JOINT_STATES
from ..node import NODE_NAME, KinematicsNode
from ..parameters.description_topic import StoppedWaiting
from .session import FAULT, SUCCESS, destroy, first_clause, run_session, tell
from .spin import Spinner

# Part of the text by which rclpy's error about a wrong QoS override is recognized.
QOS_PROFILE = 'rmw_qos_profile_t'
# Period (s) of the check for a stop. The period may be long, because a signal interrupts the
# executor at once.
STOP_CHECK_PERIOD = 60.0
# Longest time (s) for which a thread keeps the Python interpreter while another thread waits for
# it. The executor's thread must wait if another thread is reading a robot or answering a target
# pose. With this value, the 90th percentile of the executor's wait is 0.35 ms. With Python's
# default, 5 ms, it is 5.2 ms.
SWITCH_INTERVAL = 1e-4
# Name of the node that publishes the motion of a cell's second arm relative to its first arm.
RELATIVE = 'relative'
# Matches a namespace that ROS accepts, with or without the leading slash.
NAMESPACE = re.compile(r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*')


class ArmChoice(NamedTuple):
    """
    A node that will be started: its robot, namespace, name, and topic of joint states.

    The robot is a file, a bundled name, a topic, or None for the parameter `robot`.
    """

    robot: str | None
    namespace: str | None
    name: str = NODE_NAME
    topic: str = JOINT_STATES


def arms_from(choices: Sequence[str]) -> tuple[ArmChoice, ...]:
    """
    Return the nodes to start for the values of `--robot`, each `ROBOT` or `NAMESPACE=ROBOT`.

    If there are several arms, the default namespace of an arm is the name of its robot. A cell (a
    file with several arms) gets a node for each arm; the arm's name is the namespace of the node.
    The node `kinematics/relative` publishes the motion of the second arm relative to the first
    arm, unless one of the two arms has closed loops. All nodes of a cell subscribe to
    `joint_states` in the namespace of the cell.

    Raises
    ------
    ArmsError
        A namespace is not valid, or two arms have the same namespace.
    RobotFileError
        The file of a cell has faults.
    """
    if not choices:
        return (ArmChoice(None, None),)
    arms = [arm for choice in choices for arm in _of_cell(_arm(choice))]
    if len(arms) == 1:
        return tuple(arms)
    arms = [
        arm if arm.namespace else arm._replace(namespace=_named_after(str(arm.robot)))
        for arm in arms
    ]
    spaces = [(arm.namespace, arm.name) for arm in arms]
    for arm in arms:
        if spaces.count((arm.namespace, arm.name)) > 1:
            raise ArmsError(
                f'--robot: two arms have the namespace {arm.namespace}; '
                f'write --robot NAMESPACE={arm.robot}, a different one for each',
                code='duplicate-name',
            )
    return tuple(arms)


def _of_cell(arm: ArmChoice) -> list[ArmChoice]:
    cell = None if arm.robot is None else cell_of(arm.robot)
    if cell is None:
        return [arm]
    space = arm.namespace or ''
    # Let all nodes of the cell read one topic, because the relative motion needs the joints of
    # both arms.
    topic = f'{space}/{JOINT_STATES}'
    nodes = [
        ArmChoice(f'{arm.robot}:{cell.frame}:{name}', f'{space}/{name}', topic=topic)
        for name in cell.arms
    ]
    closed = any(robot.loops for robot in list(cell.arms.values())[:2])
    if len(nodes) > 1 and not closed:
        nodes.append(ArmChoice(arm.robot, f'{space}/{NODE_NAME}', RELATIVE, topic))
    return nodes


def _arm(choice: str) -> ArmChoice:
    space, equals, robot = choice.partition('=')
    if not equals or '/' in space.lstrip('/') and not NAMESPACE.fullmatch(space):
        return ArmChoice(choice, None)
    if not NAMESPACE.fullmatch(space):
        raise ArmsError(
            f'--robot {choice}: {space!r} is not a namespace; use letters, digits, _ and /',
            code='syntax',
        )
    if not robot:
        raise ArmsError(
            f'--robot {choice}: no robot after the namespace; write --robot {space}=ROBOT',
            code='empty',
        )
    return ArmChoice(robot, '/' + space.lstrip('/'))


def _named_after(robot: str) -> str:
    return '/' + re.sub(r'[^A-Za-z0-9_]|^(?=[0-9])', '_', PurePath(robot).stem)


def run_node(
    robots: Sequence[str],
    ros_args: Sequence[str],
    allow_unsecured: bool = False,
    allow_mixed_ros: bool = False,
    managed: bool = False,
) -> int:
    """
    Run the node until SIGINT or SIGTERM; return the exit code.

    Parameters
    ----------
    robots
        Robot files or bundled names, each with or without `NAMESPACE=`. Each robot gets a node in
        this process. If `robots` is empty, one node is started, and the parameter `robot` names
        its robot.
    ros_args, allow_unsecured, allow_mixed_ros
        As in `run_session`.
    managed
        Whether the nodes have a life cycle: they answer after they are configured and activated.

    Returns
    -------
    0 after a signal, 1 for a wrong robot file or parameter, 2 for wrong usage.
    """
    if managed and any(TOPIC in robot for robot in robots):
        raise ArmsError(
            '--managed: a robot from a topic cannot be managed; give a robot file or a name',
            code='unsupported',
        )

    def work(context: Context, stop: StopSignal) -> int:
        nodes: list[KinematicsNode] = []
        kind = KinematicsNode
        if managed:
            # import only if needed, because messages of life cycles load slowly
            from ..managed import ManagedNode

            kind = ManagedNode
        fill_caller_table()
        try:
            return _run(arms_from(robots), kind, context, stop, nodes)
        finally:
            destroy(*nodes)

    return run_session(ros_args, work, allow_unsecured, allow_mixed_ros)


def fill_caller_table() -> None:
    """
    Fill the table of `inspect` with the files of all loaded modules.

    rclpy looks up the caller of every log line in this table. If the table were empty, `inspect`
    would resolve the paths of 600 modules at the first log line, which takes 40 ms of processor
    time. Filling the table takes less than 1 ms.
    """
    # Use a default, because the table `inspect.modulesbyfile` is not documented and may be
    # missing.
    module_of_file: dict[str, str] = getattr(inspect, 'modulesbyfile', {})
    for name, module in sys.modules.copy().items():
        if file := getattr(module, '__file__', None):
            module_of_file.setdefault(file, name)


def _run(
    arms: Sequence[ArmChoice],
    kind: type[KinematicsNode],
    context: Context,
    stop: StopSignal,
    nodes: list[KinematicsNode],
) -> int:
    try:
        for arm in arms:
            nodes.append(_node(arm, kind, context, stop, nodes))
    except StoppedWaiting:
        return SUCCESS
    except (ParameterException, RuntimeError) as error:
        # Report errors in settings that rclpy reads itself: use_sim_time, QoS overrides, names of
        # the node.
        tell(f'rclpy cannot start the node: {first_clause(error)}')
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
    # Exempt all present objects from garbage collection. A collection would traverse the objects
    # in 80 ms. Such a pause would delay a message, and the end of the process.
    gc.freeze()
    gc.enable()
    sys.setswitchinterval(SWITCH_INTERVAL)
    spinner.obey(stop)
    is_intact = spinner.spin(lambda: stop.came or not context.ok(), STOP_CHECK_PERIOD)
    for node in nodes:
        if context.ok():
            node.end_motion()
    spinner.close()
    return SUCCESS if is_intact else FAULT


def _node(
    arm: ArmChoice,
    kind: type[KinematicsNode],
    context: Context,
    stop: StopSignal,
    others: Sequence[KinematicsNode],
) -> KinematicsNode:
    options = {} if arm.namespace is None else {'namespace': arm.namespace}
    node = kind(arm.robot, lambda: stop.came, arm.name, arm.topic, context=context, **options)
    name = full_name(node)
    if name in [full_name(other) for other in others]:
        # Destroy the second node of the same name. The cause is a remapping, which gives every
        # node of the process the same name.
        node.destroy_node()
        raise ArmsError(
            f'--robot: two nodes have the name /{name}; give namespaces as '
            '--robot NAMESPACE=ROBOT, not by -r __ns:= or -r __node:=',
            code='duplicate-name',
        )
    return node
