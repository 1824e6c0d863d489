"""From the command line to a running node and back to an exit code."""

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
from .session import FAULT, FINE, destroy, first_clause, run_session, tell
from .spin import Spinner

# rclpy's message about QoS overrides; its constructor only says that it refuses them.
QOS_PROFILE = 'rmw_qos_profile_t'
# The executor of the node runs so long without a look at the end (s): what ends it interrupts it.
UNDISTURBED = 60.0
# Longest time for which a thread keeps the interpreter while another one waits (s): threads read
# robots and answer target poses beside the executor. With Python's 5 ms one wait in ten took more
# than 5.2 ms, with this 0.35 ms.
SWITCH_INTERVAL = 1e-4
# Of the node that answers about the motion of one arm of a cell against another.
RELATIVE = 'relative'
# A namespace as ROS accepts it, without the leading slash.
NAMESPACE = re.compile(r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*')


class ArmChoice(NamedTuple):
    """
    A node: its robot (file, bundled name, topic, or None for the parameter), namespace, name, and
    the topic of its joint states.
    """

    robot: str | None
    namespace: str | None
    name: str = NODE_NAME
    topic: str = JOINT_STATES


def arms_from(choices: Sequence[str]) -> tuple[ArmChoice, ...]:
    """
    Return the arms that values of `--robot` name: `ROBOT`, or `NAMESPACE=ROBOT`.

    Of several arms each one without a namespace gets the name of its robot. Of a cell each arm is
    one, in the namespace of its name; the motion of the second against the first is the node
    `kinematics/relative`. All of them hear the topic `joint_states` of the cell's namespace.

    Raises
    ------
    ArmsError
        A namespace is none, or two arms have the same.
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
                f'two arms in the namespace {arm.namespace}: '
                f'write --robot NAMESPACE={arm.robot}, each with its own'
            )
    return tuple(arms)


def _of_cell(arm: ArmChoice) -> list[ArmChoice]:
    cell = None if arm.robot is None else cell_of(arm.robot)
    if cell is None:
        return [arm]
    space = arm.namespace or ''
    topic = f'{space}/{JOINT_STATES}'  # one for all: the motion of two arms needs both
    nodes = [
        ArmChoice(f'{arm.robot}:{cell.frame}:{name}', f'{space}/{name}', topic=topic)
        for name in cell.arms
    ]
    if len(nodes) > 1:
        nodes.append(ArmChoice(arm.robot, f'{space}/{NODE_NAME}', RELATIVE, topic))
    return nodes


def _arm(choice: str) -> ArmChoice:
    space, equals, robot = choice.partition('=')
    if not equals or '/' in space.lstrip('/') and not NAMESPACE.fullmatch(space):
        return ArmChoice(choice, None)
    if not NAMESPACE.fullmatch(space):
        raise ArmsError(
            f'--robot {choice}: {space!r} is not a namespace (letters, digits, _ and /)'
        )
    if not robot:
        raise ArmsError(f'--robot {choice}: no robot after the namespace')
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
        Files or bundled names, each with `NAMESPACE=` before it or not: one node for each, all in
        this process; none for the parameter `robot`.
    ros_args, allow_unsecured, allow_mixed_ros
        As of `run_session`.
    managed
        With a life cycle: nothing is answered before the node is configured and activated.

    Returns
    -------
    0 after a signal, 1 for a bad robot file or parameter, 2 for wrong usage.
    """
    if managed and any(TOPIC in robot for robot in robots):
        raise ArmsError(
            '--managed: a robot from a topic is waited for, and cannot be managed: give a file'
        )

    def work(context: Context, stop: StopSignal) -> int:
        nodes: list[KinematicsNode] = []
        know_callers()
        try:
            return _run(arms_from(robots), _kind(managed), context, stop, nodes)
        finally:
            destroy(*nodes)

    return run_session(ros_args, work, allow_unsecured, allow_mixed_ros)


def know_callers() -> None:
    """
    Tell `inspect` which file each loaded module came from.

    rclpy asks it for the caller of every line of the log. At the first line `inspect` resolves the
    paths of all modules, some 600: 40 ms of processor time, where this takes less than one.
    """
    # Not documented: where it is not there, the first line costs what it costs.
    known: dict[str, str] = getattr(inspect, 'modulesbyfile', {})
    for name, module in sys.modules.copy().items():
        if file := getattr(module, '__file__', None):
            known.setdefault(file, name)


def _kind(managed: bool) -> type[KinematicsNode]:
    if not managed:
        return KinematicsNode
    from ..managed import ManagedNode  # its messages take time to load

    return ManagedNode


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
        return FINE
    except (ParameterException, RuntimeError) as error:
        # Settings that rclpy itself reads: use_sim_time, QoS overrides, the names of the node.
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
    # All present objects stay. The garbage collector takes some 80 ms to look through them, which
    # would fall between two messages, and more at the end.
    gc.freeze()
    gc.enable()
    sys.setswitchinterval(SWITCH_INTERVAL)
    spinner.obey(stop)
    fine = spinner.spin(lambda: stop.came or not context.ok(), UNDISTURBED)
    for node in nodes:
        if context.ok():
            node.end_motion()
    spinner.close()
    return FINE if fine else FAULT


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
        # A remapping of names holds for every node of the process.
        node.destroy_node()
        raise ArmsError(
            f'two arms are named /{name}: give the namespaces as '
            '--robot NAMESPACE=ROBOT, not by -r __ns:= or -r __node:='
        )
    return node
