# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""After an overload: requests are answered, a joint state brings a pose, memory is given back."""

import contextlib
import signal
import time

import pytest

rclpy = pytest.importorskip('rclpy', reason='needs ROS 2')

from floods import PATIENCE, ROBOT, Client, flooded  # noqa: E402
from node_process import NodeProcess, memory  # noqa: E402
from rclpy.duration import Duration  # noqa: E402
from rclpy.node import Node  # noqa: E402
from ros_harness import Peer  # noqa: E402
from std_msgs.msg import Int32  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from kinematics_service.node.process.passed_over import KEPT_OF_FULLEST  # noqa: E402
from kinematics_service.node.process.spin import Spinner  # noqa: E402

# A second of messages of 240 kB has 240 MB; what is left of a flood is far less (MiB).
LEFT_BEHIND = 40
# The floods: kind, publishers, time (s).
FLOODS = [('small', 2, 1.0), ('joints', 1, 0.7)]


@pytest.fixture
def node(ros_domain):
    process = NodeProcess('--robot', ROBOT)
    yield process.popen
    # Not killed: others would hear of its topics for another twenty seconds.
    process.popen.send_signal(signal.SIGINT)
    process.wait()
    process.kill()


@pytest.fixture
def client(node):
    one = Client()
    # The response to a new client is lost if the node has not discovered it yet.
    assert one.until(lambda: one.answered(5.0) is not None, PATIENCE)
    yield one
    one.close()


def test_messages_are_left_out_of_a_queue_and_nothing_else(ros_domain):
    with contextlib.closing(Peer()) as one:
        busy, numbers, calls = Node('busy', context=one.context), [], []
        busy.create_subscription(
            Int32, 'numbers', lambda message: numbers.append(message.data), 50
        )
        busy.create_service(Trigger, 'call', lambda request, response: calls.append(1) or response)
        left_out = []
        spinner = Spinner(one.context, [busy], left_out.append)
        assert spinner.in_order
        publisher = one.peer.create_publisher(Int32, 'numbers', 1000)
        client = one.peer.create_client(Trigger, 'call')
        one.spin_until(client.service_is_ready, 'service')
        one.spin_until(publisher.get_subscription_count, 'listener')
        sent = range(300)
        for number in sent[:200]:
            publisher.publish(Int32(data=number))
        futures = [client.call_async(Trigger.Request()) for _ in range(5)]
        for number in sent[200:]:
            publisher.publish(Int32(data=number))
        assert publisher.wait_for_all_acked(Duration(seconds=10))
        spinner.catch_up(10.0)
        assert numbers == list(sent[-KEPT_OF_FULLEST:])  # in the order in which they came
        assert left_out == [50 - KEPT_OF_FULLEST]  # others the middleware does not keep
        one.spin_until(lambda: all(future.done() for future in futures), 'answers')
        assert len(calls) == 5
        # Nothing is one message or one call late.
        for number in (1000, 1001):
            publisher.publish(Int32(data=number))
            end = time.monotonic() + 10.0
            while numbers[-1] != number and time.monotonic() < end:
                spinner.spin_once(0.1)
            assert numbers[-1] == number
        assert len(numbers) == KEPT_OF_FULLEST + 2
        spinner.close()
        busy.destroy_node()


def test_messages_are_left_out_of_the_subscription_that_is_behind_alone(ros_domain):
    with contextlib.closing(Peer()) as one:
        busy, heard = Node('busy', context=one.context), {'flood': [], 'quiet': []}
        for name, numbers in heard.items():
            busy.create_subscription(
                Int32, name, lambda message, to=numbers: to.append(message.data), 1000
            )
        left_out = []
        spinner = Spinner(one.context, [busy], left_out.append)
        publishers = {name: one.peer.create_publisher(Int32, name, 1000) for name in heard}
        for publisher in publishers.values():
            one.spin_until(publisher.get_subscription_count, 'listener')
        for number in range(400):
            publishers['flood'].publish(Int32(data=number))
            if number % 4 == 0:
                publishers['quiet'].publish(Int32(data=number))
        for publisher in publishers.values():
            assert publisher.wait_for_all_acked(Duration(seconds=10))
        spinner.catch_up(10.0)
        assert heard['quiet'] == list(range(0, 400, 4))
        assert heard['flood'] == list(range(400 - KEPT_OF_FULLEST, 400))
        assert left_out == [400 - KEPT_OF_FULLEST]
        spinner.close()
        busy.destroy_node()


@pytest.mark.slow
def test_after_a_flood_all_is_as_before(node, client):
    client.send(10)
    before = memory(node.pid)
    for kind, publishers, seconds in FLOODS:
        asked = flooded(client, kind, publishers, seconds)
        assert client.until(lambda asked=asked: all(one.done() for one in asked), PATIENCE)
        client.drain()
        waits = [client.answered(PATIENCE) for _ in range(10)]
        assert None not in waits  # none is one call late
        assert client.answers(20) == (20, 0)
    client.diagnostics.clear()
    # The timers go on, among them the watchdog: no joint state comes.
    assert client.until(lambda: len(client.diagnostics) >= 3, PATIENCE)
    assert client.until(lambda: client.warnings[-1].level == b'\x03', PATIENCE)
    assert client.until(lambda: memory(node.pid) - before < LEFT_BEHIND, PATIENCE)
