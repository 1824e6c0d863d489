# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A node and a peer that talks to it, in one context.

Everything waits for what it waits for, with a deadline; nothing sleeps in the hope that it came.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy', reason='needs ROS 2: ros-jazzy-rclpy or a sourced Jazzy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from kinematics_service.node.node import KinematicsNode  # noqa: E402

# For what is read or written, and for what sets up anew how that is done.
BOTH_TRANSPORTS = pytest.mark.parametrize('transport', ['bytes', 'messages'])
# Nothing that is waited for takes longer than this on a machine that much else keeps busy (s).
DEADLINE = 30.0
# A request without a response is sent again after this time (s).
REPEAT_AFTER = 5.0
# What is no message is looked for after pauses that grow (s): a look takes a third of a ms.
SHORTEST_PAUSE, LONGEST_PAUSE = 0.005, 0.1
RELIABLE = QoSProfile(depth=1000)
BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SECOND = 1_000_000_000
# Stamps of tests begin here (ns): any number but 0 that is not the time of day.
START = 1_000 * SECOND + 123_456_789
STEP = 10_000_000


def joint_state(
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float] = (),
    stamp: int = 0,
) -> JointState:
    """Return a message; its stamp in ns, 0 for none."""
    message = JointState(name=names, position=position, velocity=velocity)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
    return message


def nanoseconds(stamp: Any) -> int:
    """Return a builtin_interfaces Time in ns."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def values_of(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-values of a status."""
    return {pair.key: pair.value for pair in status.values}


def level_of(status: DiagnosticStatus) -> int:
    """Return the level of a status as a number: 0 OK, 1 WARN, 2 ERROR, 3 STALE."""
    return status.level[0]


class Peer:
    """
    A node of the tests with its executor, in a context of its own unless one is given.

    Where thousands of messages are waited for, `EventsExecutor` takes a tenth of the time of the
    default executor for each; it handles events in the order of their arrival only.
    """

    def __init__(
        self,
        context: Context | None = None,
        args: Sequence[str] = (),
        executor: Callable[..., Any] = SingleThreadedExecutor,
    ) -> None:
        self._owns = context is None
        self.context = context or Context()
        if context is None:
            rclpy.init(
                args=['test', *args],
                context=self.context,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        self.executor = executor(context=self.context)
        self.peer = self._node('peer')
        self.executor.add_node(self.peer)
        self._others: list[Node] = []

    def spin_until(self, true: Callable[[], bool], what: str, seconds: float = DEADLINE) -> None:
        """Turn the executor until `true()`; fail after `seconds`."""
        deadline, pause = time.monotonic() + seconds, SHORTEST_PAUSE
        while not true():
            if time.monotonic() > deadline:
                pytest.fail(f'after {seconds} s still no {what}')
            self.executor.spin_once(timeout_sec=pause)
            pause = min(1.5 * pause, LONGEST_PAUSE)

    def add(self, node: Node) -> Node:
        """Spin and close another node together with the peer."""
        self.executor.add_node(node)
        self._others.append(node)
        return node

    def other(self, name: str) -> Node:
        """Return one more node of the tests."""
        return self.add(self._node(name))

    def _node(self, name: str) -> Node:
        return Node(
            name,
            context=self.context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )

    def listen(self, topic: str, kind: Any, qos: QoSProfile = RELIABLE) -> list[Any]:
        """Return a list that fills with the messages of a topic, once its publisher is matched."""
        heard: list[Any] = []
        subscription = self.peer.create_subscription(kind, topic, heard.append, qos)
        self.spin_until(lambda: subscription.get_publisher_count() > 0, f'publisher of {topic}')
        return heard

    def speaker(
        self,
        topic: str,
        qos: QoSProfile = RELIABLE,
        node: Node | None = None,
        listeners: int = 1,
        kind: Any = JointState,
    ) -> Any:
        """Return a publisher, of joint states by default, once it knows its listeners."""
        publisher = (node or self.peer).create_publisher(kind, topic, qos)
        self.spin_until(lambda: self._heard_by(publisher, listeners), f'listeners to {topic}')
        return publisher

    def _heard_by(self, publisher: Any, listeners: int) -> bool:
        # Not more: a process of an earlier test may be there for another twenty seconds.
        return bool(publisher.get_subscription_count() == listeners)

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """Return the response of a service to a request that may be handled twice."""
        return self.ask(self.peer.create_client(kind, service), request)

    def ask(self, client: Any, request: Any) -> Any:
        """
        Return the response to a client's request that may be handled twice.

        The response to a new client is lost if the server has not discovered it yet, so the
        request is repeated.
        """
        self.spin_until(client.service_is_ready, f'service {client.srv_name}')
        futures = [client.call_async(request)]
        repeat = time.monotonic() + REPEAT_AFTER

        def is_answered() -> bool:
            nonlocal repeat
            if time.monotonic() > repeat:
                futures.append(client.call_async(request))
                repeat = time.monotonic() + REPEAT_AFTER
            return any(future.done() for future in futures)

        self.spin_until(is_answered, f'response of {client.srv_name}')
        return next(future.result() for future in futures if future.done())

    def close(self) -> None:
        """Destroy the nodes, and the context where it is the peer's own."""
        for node in (*self._others, self.peer):
            self.executor.remove_node(node)
            node.destroy_node()
        self.executor.shutdown()
        if self._owns:
            self.context.try_shutdown()


# Of joint states, where a test has no time-out of its own: a busy machine makes none stale (s).
UNHURRIED = 30.0


class Arm(Peer):
    """
    A node under test with a peer that sends joint states to it and hears its answers.

    Parameters
    ----------
    robot
        As `KinematicsNode` takes it.
    ros_args
        Arguments after `--ros-args`.
    transport
        The parameter of that name.
    executor
        As `Peer` takes it.
    **options
        As rclpy.node.Node takes them.
    """

    def __init__(
        self,
        robot: str = 'craig_3r',
        ros_args: Sequence[str] = (),
        transport: str = 'bytes',
        executor: Callable[..., Any] = SingleThreadedExecutor,
        **options: Any,
    ):
        parameters = (f'transport:={transport}', f'joint_state_timeout:={UNHURRIED}')
        defaults = [word for one in parameters for word in ('-p', one)]
        super().__init__(None, ('--ros-args', *defaults, *ros_args), executor)
        try:
            self.node = KinematicsNode(robot, context=self.context, **options)
        except BaseException:
            self.close()
            raise
        self.add(self.node)
        self.robot = self.node.settings.robot
        self.names = [
            self.node.settings.estimator.joint_prefix + name for name in self.robot.joint_names
        ]
        self.stamp = START
        self._topic = self.node._input.subscription.topic_name
        self._publisher: Any = None
        self._poses: list[Any] | None = None
        self._diagnostics: list[DiagnosticArray] | None = None

    def topic(self, name: str) -> str:
        """Return the full name of a topic of the node, given without its `~/`."""
        return f'{self.node.get_fully_qualified_name()}/{name}'

    def hear(self, name: str, kind: Any, qos: QoSProfile = RELIABLE) -> list[Any]:
        """Return a list that fills with the messages of one of the node's topics."""
        return self.listen(self.topic(name), kind, qos)

    def speaker(self, topic: str, *args: Any, **options: Any) -> Any:
        """Return what `Peer.speaker` does; of joint states once the node knows the publisher."""
        listener = self.node._input.subscription
        known = listener.publisher_count
        publisher = super().speaker(topic, *args, **options)
        if publisher.topic_name == self._topic:
            self.spin_until(lambda: listener.publisher_count > known, 'publisher in the node')
        return publisher

    def _heard_by(self, publisher: Any, listeners: int) -> bool:
        # The node is in this process: listeners of others change nothing.
        return bool(publisher.get_subscription_count() >= listeners)

    def attach(self, listeners: int = 1) -> None:
        """Make the publisher that `publish` uses, for so many listeners."""
        self._publisher = self.speaker(self._topic, listeners=listeners)

    def await_publishers(self, number: int) -> None:
        """
        Return when the node knows so many publishers of joint states.

        That a publisher knows the node is not enough: what a best-effort one sends before the node
        knows it is lost.
        """
        listener = self.node._input.subscription
        self.spin_until(lambda: listener.publisher_count == number, f'{number} publishers')

    def publish(self, message: JointState) -> None:
        """Publish a message as it is."""
        if self._publisher is None:
            self.attach()
        self._publisher.publish(message)

    def send(
        self, position: Sequence[float], velocity: Sequence[float] = (), stamp: int | None = None
    ) -> int:
        """Publish positions of all joints; return the stamp, STEP after the last if not given."""
        if stamp is None:
            self.stamp += STEP
            stamp = self.stamp
        self.publish(joint_state(self.names, position, velocity, stamp))
        return stamp

    @property
    def poses(self) -> list[Any]:
        """Return the poses heard so far, since it was first asked for."""
        if self._poses is None:
            from geometry_msgs.msg import PoseStamped

            self._poses = self.hear('pose', PoseStamped)
        return self._poses

    def answer(self, position: Sequence[float], *args: Any, **options: Any) -> Any:
        """Send positions and return the pose that answers them."""
        poses = self.poses
        stamp = self.send(position, *args, **options)
        self.spin_until(
            lambda: bool(poses) and nanoseconds(poses[-1].header.stamp) == stamp,
            f'pose of {list(position)}',
        )
        return poses[-1]

    def stamps(self) -> list[int]:
        """Return the stamps of the poses heard so far."""
        return [nanoseconds(pose.header.stamp) for pose in self.poses]

    def diagnose(self) -> DiagnosticStatus:
        """Return the diagnostics of now, without waiting for the second."""
        if self._diagnostics is None:
            self._diagnostics = self.listen('/diagnostics', DiagnosticArray)
        heard = len(self._diagnostics)
        self.node._health.say()
        self.spin_until(lambda: len(self._diagnostics or ()) > heard, 'diagnostics')
        return self._diagnostics[-1].status[0]

    def counts(self) -> dict[str, str]:
        """Return the values of the diagnostics of now."""
        return values_of(self.diagnose())


def change(one: Arm, **values: Any) -> Any:
    """Set parameters of the node at once, given with `__` for the dot; return the result."""
    return one.node.set_parameters_atomically(
        [Parameter(name.replace('__', '.'), value=value) for name, value in values.items()]
    )
