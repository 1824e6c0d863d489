"""
What all tests share: a ROS domain of their own, and nothing of the user's ROS environment.

Library tests need no ROS: nothing here imports rclpy unless a test asks for an arm.
"""

import os
import random
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

ROS_SETTINGS = (
    'AMENT_PREFIX_PATH',
    'ROS_DOMAIN_ID',
    'ROS_NAMESPACE',
    'ROS_SECURITY_ENABLE',
    'ROS_STATIC_PEERS',
)
ONE_THREAD = 'OPENBLAS_NUM_THREADS'


ROS_TESTS = Path(__file__).parent / 'ros'


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs ROS: the tests in its folder, and those that ask for a domain."""
    for item in items:
        if ROS_TESTS in item.path.parents or 'ros_domain' in getattr(item, 'fixturenames', ()):
            item.add_marker(pytest.mark.ros)


@pytest.fixture(autouse=True)
def as_it_was() -> Iterator[None]:
    """
    Put back what commands that are called within this process leave behind at their end.

    They go on ignoring signals, and the node asks for one thread of numpy's; processes started
    later would inherit both.
    """
    # Set by runners of tests; what is printed would be cut to it.
    os.environ.pop('COLUMNS', None)
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    threads = os.environ.get(ONE_THREAD)
    yield
    for number, handler in zip(numbers, before):
        signal.signal(number, handler)
    if threads is None:
        os.environ.pop(ONE_THREAD, None)


@pytest.fixture(scope='session')
def ros_domain() -> Iterator[int]:
    """Return a domain no other test process uses, set for this process and its children."""
    coordinator = pytest.importorskip('domain_coordinator', reason='needs ros-domain-coordinator')
    start = random.SystemRandom().randrange(100)
    candidates = iter(range(start, start + 100))
    before = dict(os.environ)
    with coordinator.domain_id(lambda: next(candidates) % 100 + 1) as domain:
        for name in ROS_SETTINGS:
            os.environ.pop(name, None)
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        yield domain
        os.environ.clear()
        os.environ.update(before)


@pytest.fixture(params=['bytes', 'messages'])
def transport(request: pytest.FixtureRequest) -> str:
    """Return each of the ways messages are read and written: what uses it runs through both."""
    return str(request.param)


@pytest.fixture
def arm(ros_domain: int, transport: str) -> Iterator[Callable[..., Any]]:
    """Return a function that starts a node and a peer of it, see `ros_harness.Arm`."""
    from ros_harness import Arm

    arms: list[Arm] = []

    def start(*args: Any, **options: Any) -> Arm:
        arms.append(Arm(*args, transport=transport, **options))
        return arms[-1]

    yield start
    for one in arms:
        one.close()


@pytest.fixture
def process(ros_domain: int) -> Iterator[Callable[..., Any]]:
    """
    Return a function that starts a node as a process of its own, see `node_process.NodeProcess`.
    """
    from node_process import NodeProcess

    processes: list[NodeProcess] = []

    def start(*args: Any, **options: Any) -> NodeProcess:
        processes.append(NodeProcess(*args, **options))
        return processes[-1]

    yield start
    for one in processes:
        one.kill()
