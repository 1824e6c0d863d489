"""The node as a process: signals, exit codes, what is refused at start, cost when idle."""

import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import PoseStamped, TwistStamped
from node_process import processor_seconds, slowdown
from ros_harness import START, STEP, Peer, joint_state, nanoseconds
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.node.process.environment import log_refusal, mixture_refusal

Q = (0.3, -0.4, 1.2)
NAMES = ['q1', 'q2', 'q3']
# So many answers of a node that has ended may still wait to be heard.
QUEUE = 50
# The contract's second for the way out, of a node that has a core when it needs one.
WAY_OUT = 1.0

LOAD = """
import time, rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node('load')
publisher = node.create_publisher(JointState, 'joint_states', 100)
message = JointState(name=['q1', 'q2', 'q3'], position=[0.1, 0.2, 0.3], velocity=[0.1, 0.2, 0.3])
begin = time.monotonic()
k = 0
while k < 600_000:
    message.header.stamp = node.get_clock().now().to_msg()
    message.position[0] = 1e-3 * (k % 1000)
    publisher.publish(message)
    k += 1
    time.sleep(max(0.0, begin + 1e-3 * k - time.monotonic()))  # a thousand a second
"""


@pytest.fixture
def peer(ros_domain):
    peer = Peer()
    yield peer
    peer.close()


@pytest.fixture
def load(ros_domain):
    """Run a publisher of a thousand joint states a second."""
    with subprocess.Popen([sys.executable, '-c', LOAD]) as publisher:
        yield publisher
        publisher.kill()


def answered(peer, topic='/kinematics/pose', states='/joint_states', names=NAMES, q=Q):
    """Send joint states until a node answers; return its pose."""
    poses = []
    peer.peer.create_subscription(PoseStamped, topic, poses.append, 100)
    publisher = peer.speaker(states)
    stamp = START

    def heard():
        nonlocal stamp
        stamp += STEP
        publisher.publish(joint_state(names, q, (), stamp))
        return bool(poses)

    peer.spin_until(heard, f'answer on {topic}', 20.0)
    assert nanoseconds(poses[0].header.stamp) <= stamp
    return poses[0]


def tell(process, number, times, pause):
    """Send a signal once or twice; return exit code and the seconds it took."""
    begin = time.monotonic()
    process.popen.send_signal(number)
    if times == 2:
        # Not to wait for anything: the second signal has to come in the middle of the clean-up.
        time.sleep(pause)
        process.popen.send_signal(number)
    code = process.wait()
    return code, time.monotonic() - begin


def expect_a_clean_end(process, code, seconds):
    assert 'Traceback' not in process.stderr, process.stderr
    assert code == 0, process.stderr
    assert seconds < WAY_OUT or seconds < WAY_OUT * slowdown()


BOTH = [signal.SIGINT, signal.SIGTERM]
SIGNALS = pytest.mark.parametrize('number', BOTH, ids=lambda s: s.name)
# A second signal finds each moment of the clean-up (s), with each of both signals in turn: the
# handler of one is that of the other.
PAUSES = [0.005 + 0.02 * k for k in range(3)]
ENDS = [
    *((number, 1, 0.0) for number in BOTH),
    *((BOTH[k % 2], 2, pause) for k, pause in enumerate(PAUSES)),
]


def test_an_idle_node_ends_cleanly_at_a_signal(process):
    # The moments of its clean-up are those of a busy node, below.
    nodes = [process('--robot', 'craig_3r', ready=False) for _ in ENDS[:3]]
    for node in nodes:
        node.wait_until_ready()
    for node, end in zip(nodes, ENDS):
        expect_a_clean_end(node, *tell(node, *end))


def test_a_busy_node_ends_cleanly_at_a_signal(process, peer, load):
    poses = []
    peer.peer.create_subscription(PoseStamped, '/kinematics/pose', poses.append, QUEUE)
    following = process('--robot', 'craig_3r')
    for k, end in enumerate(ENDS):
        node = following
        peer.spin_until(lambda: len(poses) > QUEUE + 50, 'answers to the load', 20.0)
        if k + 1 < len(ENDS):
            # Its start takes a processor for a second: what is measured is the way out beside the
            # load, not beside that.
            following = process('--robot', 'craig_3r')
        expect_a_clean_end(node, *tell(node, *end))
        poses.clear()


# Its library, of version 2 and of version 3.
FAST_DDS = re.compile(b'libfast(rtps|dds)')


@SIGNALS
def test_a_node_that_is_still_starting_ends_cleanly_at_a_signal(process, number):
    node = process('--robot', 'puma560', ready=False)
    deadline = time.monotonic() + 20.0
    while not FAST_DDS.search(Path(f'/proc/{node.popen.pid}/maps').read_bytes()):
        assert time.monotonic() < deadline
    code, _ = tell(node, number, 1, 0.0)
    assert 'Traceback' not in node.stderr
    assert code in (0, 130, -number)


def test_a_node_answers_another_process_by_the_names_of_its_command_line(process, peer):
    process(
        *('--robot', 'craig_3r', '--ros-args', '-r', '__ns:=/cell', '-r', '__node:=arm'),
        *('-r', 'joint_states:=/joint_states', '-p', 'base_frame:=table'),
    )
    pose = answered(peer, '/cell/arm/pose')
    assert pose.header.frame_id == 'table'
    assert pose.pose.position.z == pytest.approx(0.4 * 0.3894183423 - 0.3 * 0.7173560909, abs=1e-9)


def test_a_node_that_ends_ends_the_motion_it_began(process, peer):
    node = process(
        *('--robot', 'craig_3r', '--ros-args', '-p', 'ik.target_timeout:=100.0'),
        *('-p', 'joint_state_timeout:=100.0'),
    )
    answered(peer)
    velocities = peer.listen('/kinematics/ik/joint_velocity', JointState)
    targets = peer.peer.create_publisher(TwistStamped, '/kinematics/target_twist', 10)
    twist = TwistStamped()
    twist.header.frame_id = 'base_link'
    twist.twist.linear.x = 0.05

    def moving():
        targets.publish(twist)
        return bool(velocities)

    peer.spin_until(moving, 'joint velocities', 300.0)
    assert any(velocities[-1].velocity)
    code, seconds = tell(node, signal.SIGINT, 1, 0.0)
    expect_a_clean_end(node, code, seconds)
    peer.spin_until(lambda: not any(velocities[-1].velocity), 'the end of the motion')


def test_several_arms_run_in_one_process_each_in_its_namespace(process, peer):
    node = process('--robot', 'left=craig_3r', '--robot', 'right=ur5e', '--robot', 'planar_2r')
    while sum('listening to' in line for line in node.lines) < 3:
        assert node.popen.poll() is None, node.stderr
        peer.executor.spin_once(timeout_sec=0.01)
    arms = {'left': (NAMES, Q), 'right': (ks.load_robot('ur5e').joint_names, (0.1,) * 6)}
    arms['planar_2r'] = (ks.load_robot('planar_2r').joint_names, (0.2, 0.4))
    for space, (names, q) in arms.items():
        pose = answered(peer, f'/{space}/kinematics/pose', f'/{space}/joint_states', names, q)
        robot = ks.load_robot({'left': 'craig_3r', 'right': 'ur5e'}.get(space, space))
        position = pose.pose.position
        expected = ks.forward_kinematics(robot, q)[:3, 3]
        assert [position.x, position.y, position.z] == pytest.approx(expected.tolist(), abs=1e-9)
    node.popen.send_signal(signal.SIGINT)
    assert node.wait() == 0
    assert 'Traceback' not in node.stderr


def test_an_idle_node_costs_next_to_nothing(process):
    node = process('--robot', 'craig_3r')
    settled = threading.Event()
    settled.wait(1.5)  # a cost a second takes seconds: nothing is waited for
    before, begin = processor_seconds(node.popen.pid), time.monotonic()
    settled.wait(3.0)
    used = processor_seconds(node.popen.pid) - before
    share = used / (time.monotonic() - begin)
    assert share < 0.02


@pytest.mark.skipif(not Path('/dev/shm').is_dir(), reason='no /dev/shm here')
def test_a_node_that_was_told_to_end_leaves_no_shared_memory_behind(process, peer):
    # A process that was killed at any time before leaves its own, which others open, and keep.
    there = set(map(str, Path('/dev/shm').iterdir()))
    node = process('--robot', 'craig_3r')
    answered(peer)
    opened = shared_memory(node.popen.pid) - there
    assert opened
    expect_a_clean_end(node, *tell(node, signal.SIGTERM, 1, 0.0))
    # The peer, and tests that run beside this one, may use a segment together with the node.
    for pid in Path('/proc').glob('[0-9]*'):
        opened -= shared_memory(pid.name)
    assert [name for name in opened if Path(name).exists() or Path(f'{name}_el').exists()] == []


def shared_memory(pid):
    """Return the files of Fast DDS in /dev/shm that a process has mapped."""
    try:
        lines = Path(f'/proc/{pid}/maps').read_text().splitlines()
    except OSError:
        return set()
    return {line.split()[-1] for line in lines if '/dev/shm/fast' in line}


# What is refused at start


@pytest.mark.parametrize(
    ('arguments', 'code', 'sentence'),
    [
        (('--robot', 'craig_4r'), 1, "no robot 'craig_4r'"),
        (('--robot', 'nowhere.yaml'), 1, 'nowhere.yaml'),
        (('--ros-args', '-p', 'robot:=craig_4r'), 1, "no robot 'craig_4r'"),
        (('--ros-args', '-p', 'twist_frame:=world'), 1, 'one of base, tool'),
        (('--ros-args', '-p', 'publish_rate:=1'), 1, 'write 1.0'),
        (('--ros-args', '-p', 'publish_rate:=-1.0'), 1, 'publish_rate'),
        (('--ros-args', '-p', 'joint_state_timeout:=.nan'), 1, 'joint_state_timeout'),
        (('--ros-args', '-p', 'singularity.stop:=0.5'), 1, 'below warn'),
        (('--ros-args', '-p', 'use_sim_time:=5'), 1, 'use_sim_time'),
        (
            ('--ros-args', '-p', 'qos_overrides./joint_states.subscription.reliability:=no'),
            1,
            'reliability',
        ),
        (('--robot', 'craig_3r', '--ros-args', '-p', 'robot:=puma560'), 2, 'differ'),
        (('--robot', 'craig_3r', '--robot', 'craig_3r'), 2, 'NAMESPACE=craig_3r'),
        (('--robot', 'a b=craig_3r'), 2, 'not a namespace'),
        (('--robot', 'left='), 2, 'no robot after'),
        (('--ros-args', '-p', 'nonsense'), 2, 'nonsense'),
        (('--ros-args', '--params-file', 'nowhere.yaml'), 2, 'nowhere.yaml'),
        (('--ros-args', '-r', '__node:=a/b'), 2, 'a/b'),
        (
            ('--ros-args', '-p', 'qos_overrides./joint_states.subscription.depth:=88888888888'),
            1,
            'qos_overrides is out of its range',
        ),
        (('--ros-args', '--nonsense'), 2, '--nonsense'),
    ],
    ids=lambda x: ' '.join(x) if isinstance(x, tuple) and isinstance(x[0], str) else '',
)
def test_a_wrong_start_is_one_sentence_and_an_exit_code(
    ros_domain, capfd, arguments, code, sentence
):
    # In this process: to start one for each takes a second of the processor.
    told, stderr = main(list(arguments)), capfd.readouterr().err
    expect_a_sentence(told, stderr, code, sentence)
    usage = [line for line in stderr.splitlines()[:-1] if line]
    assert all(line.startswith(('Usage:', 'Try ')) for line in usage), stderr


@pytest.mark.parametrize(
    ('arguments', 'code', 'sentence'),
    [
        (('--robot', 'a=craig_3r', '--robot', 'b=craig_4r'), 1, "no robot 'craig_4r'"),
        (
            ('--robot', 'a=ur5e', '--robot', 'b=ur5e', '--ros-args', '-r', '__ns:=/cell'),
            2,
            'have the name /cell/kinematics',
        ),
    ],
)
def test_one_arm_that_cannot_start_ends_the_start_of_all(
    ros_domain, capfd, arguments, code, sentence
):
    expect_a_sentence(main(list(arguments)), capfd.readouterr().err, code, sentence)


# Where a start can fail: in the context, and in a node beside another one.
@pytest.mark.parametrize(
    ('arguments', 'code', 'sentence'),
    [
        (('--ros-args', '-p', 'nonsense'), 2, 'nonsense'),
        (('--robot', 'a=craig_3r', '--robot', 'b=craig_4r'), 1, "no robot 'craig_4r'"),
    ],
    ids=['context', 'another node'],
)
def test_a_process_that_cannot_start_ends_with_that_code(process, arguments, code, sentence):
    one = process(*arguments, ready=False)
    expect_a_sentence(one.wait(), one.stderr, code, sentence)


def expect_a_sentence(told, stderr, code, sentence):
    assert told == code, stderr
    assert sentence in stderr.splitlines()[-1]
    assert 'Traceback' not in stderr


def test_what_is_unsecured_or_mixed_does_not_start_unless_asked_for(
    process, capfd, monkeypatch, tmp_path
):
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'true')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert mixture_refusal() is None  # a prefix without ROS
    (tmp_path / 'lib').mkdir()
    (tmp_path / 'lib' / 'librcl.so').touch()
    for allowed, words in (
        ('--allow-mixed-ros', ('--allow-unsecured',)),
        ('--allow-unsecured', ('--allow-mixed-ros', str(tmp_path))),
    ):
        assert main(['--robot', 'craig_3r', allowed]) == 1
        (line,) = capfd.readouterr().err.splitlines()
        assert all(word in line for word in words)
    process('--robot', 'craig_3r', '--allow-mixed-ros', '--allow-unsecured')


NO_LOGS = {'ROS_LOG_DIR': '', 'ROS_HOME': ''}


@pytest.mark.parametrize(
    ('folders', 'reason'),
    [
        ({'HOME': ''}, 'neither ROS_LOG_DIR, ROS_HOME nor HOME is set'),
        ({'HOME': '/dev/null'}, '/dev/null/.ros/log: Not a directory'),
        ({'ROS_HOME': '/dev/null'}, '/dev/null/log: Not a directory'),
        ({'ROS_LOG_DIR': '/proc/logs'}, '/proc/logs: No such file or directory'),
    ],
    ids=lambda given: ' '.join(given) if isinstance(given, dict) else '',
)
def test_a_folder_for_logs_that_cannot_be_is_named(monkeypatch, folders, reason):
    for name, value in {**NO_LOGS, **folders}.items():
        monkeypatch.setenv(name, value)
    assert log_refusal() == reason


def test_a_node_that_can_write_no_log_file_says_so_and_answers(process, peer, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', '/proc/logs')
    node = process('--robot', 'craig_3r')
    answered(peer)
    told, *_ = node.stderr.splitlines()
    reason = log_refusal()
    assert told == f'kinematics_service: messages are not written to a log file: {reason}'


# Other executors


WITHOUT_EVENTS_EXECUTOR = """
import sys
sys.modules['rclpy.experimental'] = None
from kinematics_service.node.process.runner import run_node
sys.exit(run_node(['craig_3r'], []))
"""

DEAF_EVENTS_EXECUTOR = """
import sys
import rclpy.experimental
class Deaf:
    def __init__(self, context):
        pass
    add_node = remove_node = lambda self, node: None
    shutdown = lambda self: None
    spin_once = lambda self, timeout_sec=None: None
rclpy.experimental.EventsExecutor = Deaf
from kinematics_service.node.process.runner import run_node
sys.exit(run_node(['craig_3r'], []))
"""


@pytest.mark.parametrize(
    'program', [WITHOUT_EVENTS_EXECUTOR, DEAF_EVENTS_EXECUTOR], ids=['missing', 'deaf']
)
def test_without_the_events_executor_the_default_one_does_the_work(process, peer, program):
    node = process(command=('-c', program))
    answered(peer)
    expect_a_clean_end(node, *tell(node, signal.SIGTERM, 1, 0.0))
    assert ('using SingleThreadedExecutor' in node.stderr) == (program is DEAF_EVENTS_EXECUTOR)
