# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What all tests share: a ROS domain of their own, and nothing of the user's ROS environment.

Library tests need no ROS: nothing here imports rclpy unless a test asks for an arm.
"""

import gc
import itertools
import os
import random
import signal
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

# Before numpy is imported. A process of tests has a core of its own: more threads of OpenBLAS wait
# for their next small matrix at full speed, a fifth of the processor's time.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

# Until all tests are collected: a quarter of that time went into looking through what stays.
gc.disable()

ROS_SETTINGS = (
    'AMENT_PREFIX_PATH',
    'ROS_DOMAIN_ID',
    'ROS_NAMESPACE',
    'ROS_SECURITY_ENABLE',
    'ROS_STATIC_PEERS',
)
# Set by commands for numpy and for the middleware.
SET_BY_COMMANDS = (
    'OPENBLAS_NUM_THREADS',
    'FASTRTPS_DEFAULT_PROFILES_FILE',
    'FASTDDS_DEFAULT_PROFILES_FILE',
)
TESTS = Path(__file__).parent
ROS_TESTS = {TESTS / 'node', TESTS / 'apps' / 'demo', TESTS / 'apps' / 'calibration' / 'live'}
# Started for the tests of a file, which takes seconds: a cluster, a program that serves a page, a
# browser. Whatever asks for them is slow.
STARTED = {'cluster', 'view', 'open_view', 'page'}
# The folders of the files that take longest: compilers, formulas, and pages and packages.
LONGEST = ('export', 'formulas', 'test')
# After which share of the slow files none of the node is left: several of them are long.
END_OF_WAITING = 0.8
# Without one of these the tests of the node are skipped.
OF_THE_NODE = {'rclpy': 'rclpy', 'domain_coordinator': 'ros-domain-coordinator'}


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Spread the files over processes where there is pytest-xdist and no `-n` says otherwise."""
    option = config.option
    watched = option.usepdb or option.capture == 'no'
    # xdist's own processes start none.
    if watched or hasattr(config, 'workerinput') or getattr(option, 'numprocesses', 0) is not None:
        return
    if number := processes(config.args):
        option.numprocesses, option.dist = number, 'loadfile'


def processes(arguments: list[str]) -> int:
    """Return one for each core and two more, since node tests wait; 0 for a single file."""
    files = {argument.partition('::')[0] for argument in arguments}
    most = len(os.sched_getaffinity(0)) + 2
    if all(file.endswith('.py') for file in files):
        most = min(most, len(files))
    return most if most > 1 else 0


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say that the node was not tested, which is one line among the skipped tests otherwise."""
    lacking = [name for module, name in OF_THE_NODE.items() if find_spec(module) is None]
    if lacking:
        terminalreporter.write_line(f'the node was not tested: it needs {" and ".join(lacking)}')


def pytest_configure(config: pytest.Config) -> None:
    """
    Let xdist keep to our order of files: it would begin with those of the most tests.

    A job in the background of a script ignores SIGINT, and so would every process that a test
    starts and interrupts.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(config.option, 'loadscopereorder'):
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """
    Mark what needs ROS, tests in its folders and those that ask for a domain; and what is slow.

    Files with slow tests come first: a long one that came last would be waited for. Those of the
    node, which wait for messages and processes, come between those that compute, so that no core
    is idle.
    """
    for item in items:
        fixtures = getattr(item, 'fixturenames', ())
        if item.path.parent in ROS_TESTS or 'ros_domain' in fixtures:
            item.add_marker(pytest.mark.ros)
        if STARTED & set(fixtures):
            item.add_marker(pytest.mark.slow)
    files = list(dict.fromkeys(item.path for item in items))
    slow = {item.path for item in items if item.get_closest_marker('slow')}
    waiting = [file for file in files if file.parent in ROS_TESTS]
    computing = [file for file in files if file in slow and file not in waiting]
    computing.sort(key=lambda file: file.parent.name not in LONGEST)
    order = dict.fromkeys([*evenly_mixed(waiting, computing), *files])
    places = {file: k for k, file in enumerate(order)}
    items.sort(key=lambda item: places[item.path])


def pytest_collection_finish() -> None:
    """Leave what is there by now out of every later collection of garbage."""
    gc.freeze()
    gc.enable()


def evenly_mixed(waiting: list[Path], computing: list[Path]) -> list[Path]:
    """Return files in their order, those that wait ending before those that compute."""
    places = [(END_OF_WAITING * (k + 0.5) / len(waiting), file) for k, file in enumerate(waiting)]
    places += [(k / len(computing), file) for k, file in enumerate(computing)]
    return [file for _, file in sorted(places)]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep the derivations in one process: there every arm is derived once."""
    if config.getvalue('dist') != 'loadfile':
        return None
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return 'test_symbols' if '/test_symbols_' in file else file

    return Scheduling(config, log)


@pytest.fixture(autouse=True)
def as_it_was() -> Iterator[None]:
    """
    Put back what commands that are called within this process leave behind at their end.

    They go on ignoring signals, and the node sets variables; processes started later would inherit
    both.
    """
    # Set by runners of tests and by developers: what is printed would be cut, or another thing.
    os.environ.pop('COLUMNS', None)
    os.environ.pop('KINEMATICS_TRACEBACK', None)
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    variables = [os.environ.get(name) for name in SET_BY_COMMANDS]
    yield
    for number, handler in zip(numbers, before):
        signal.signal(number, handler)
    for name, value in zip(SET_BY_COMMANDS, variables):
        if value is None:
            os.environ.pop(name, None)


@pytest.fixture
def store() -> Any:
    """Return the message types of rosbags."""
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    return typesys.get_typestore(typesys.Stores.ROS2_JAZZY)


@pytest.fixture(scope='session')
def domain_candidates() -> Iterator[int]:
    """Return the domains of this process: those of xdist's other processes are other ones."""
    first = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw'))
    step = int(os.environ.get('PYTEST_XDIST_WORKER_COUNT', '1'))
    domains = range(1 + first, 101, step)
    start = random.SystemRandom().randrange(len(domains))
    return itertools.cycle([*domains[start:], *domains[:start]])


@pytest.fixture(scope='module')
def ros_domain(domain_candidates: Iterator[int]) -> Iterator[int]:
    """
    Return a domain no other test file uses, set for this process and its children.

    A process that a test killed is listed by others for 20 s more, so each file has its own.
    """
    pytest.importorskip('rclpy')
    coordinator = pytest.importorskip('domain_coordinator', reason='needs ros-domain-coordinator')
    before = dict(os.environ)
    from kinematics_service.node.process import middleware

    with (
        coordinator.domain_id(lambda: next(domain_candidates)) as domain,
        pytest.MonkeyPatch.context() as patch,
    ):
        # A command that is called within this process would give each node that is made here later
        # ports for its requests, which Fast DDS never gives back.
        patch.setattr(middleware, 'ports_are_free', lambda: False)
        for name in ROS_SETTINGS:
            os.environ.pop(name, None)
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        yield domain
        os.environ.clear()
        os.environ.update(before)


@pytest.fixture
def transport() -> str:
    """Return how messages are read and written; see `BOTH_TRANSPORTS` of the harness."""
    return 'bytes'


@pytest.fixture
def without_rclpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make `import rclpy` fail, also for modules that other tests have imported already."""
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    for name in list(sys.modules):
        # Only these modules import rclpy; what was imported once would not be imported again.
        if name.startswith('kinematics_service.node.') or (
            name.startswith('kinematics_service.apps.') and name.endswith('_session')
        ):
            monkeypatch.delitem(sys.modules, name)


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
