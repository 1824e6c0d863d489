"""After an overload: requests are answered, a joint state brings a pose, memory is given back."""

import subprocess
import sys
import time

import pytest
from folders import BENCH

rclpy = pytest.importorskip('rclpy', reason='needs ROS 2')

from node_process import NodeProcess  # noqa: E402

sys.path.insert(0, str(BENCH))
from flood import FAST, ROBOT, Client, memory  # noqa: E402

# A second of messages of 240 kB has 240 MB; what is left of a flood is far less (MiB).
LEFT_BEHIND = 40
SECONDS = 3.0


@pytest.fixture
def node(ros_domain):
    process = NodeProcess('--robot', ROBOT)
    yield process.popen
    process.kill()


@pytest.fixture
def client(node):
    yield Client()
    rclpy.try_shutdown()


def flooded(node, client, kind, publishers):
    """Flood the node, with requests in the meantime; return the answers to them."""
    floods = [subprocess.Popen([sys.executable, '-c', FAST, kind]) for _ in range(publishers)]
    asked = []
    try:
        client.until(lambda: client.node.count_publishers('/joint_states') > publishers, 20.0)
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            asked.append(client.ask())
            client.rest(0.5)
    finally:
        for flood in floods:
            flood.kill()
            flood.wait()
    return asked


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'publishers'), [('joints', 1), ('name', 2)])
def test_after_a_flood_all_is_as_before(node, client, kind, publishers):
    client.send(10)
    before = memory(node)
    asked = flooded(node, client, kind, publishers)
    assert client.until(lambda: all(future.done() for future in asked), 10.0)
    waits = [client.answered(5.0) for _ in range(10)]
    assert None not in waits  # none is one call late
    assert client.answers(30) == (30, 0)
    client.diagnostics.clear()
    client.rest(4.5)
    assert 3 <= len(client.diagnostics) <= 6
    assert client.warnings[-1].level == b'\x03'  # the watchdog: no joint state came
    assert memory(node) - before < LEFT_BEHIND
