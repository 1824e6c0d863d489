# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process: signals, exit codes, what is refused at start, cost when idle."""

import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import PoseStamped, TwistStamped
from node_process import processor_seconds, slowdown
from rclpy.node import Node
from ros_harness import START, STEP, Peer, joint_state, nanoseconds
from sensor_msgs.msg import JointState
from std_msgs.msg import Int32

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.node.process.environment import log_refusal, mixture_refusal
from kinematics_service.node.process.spin import Spinner

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
while k < 300_000:
    message.header.stamp = node.get_clock().now().to_msg()
    message.position[0] = 1e-3 * (k % 1000)
    publisher.publish(message)
    k += 1
    time.sleep(max(0.0, begin + 2e-3 * k - time.monotonic()))  # five hundred a second
"""


@pytest.fixture
def peer(ros_domain):
    peer = Peer()
    yield peer
    peer.close()


@pytest.fixture
def load(ros_domain):
    """Run a publisher of five hundred joint states a second."""
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


def test_a_busy_node_ends_cleanly_at_a_signal(process, peer, load):
    poses = []
    peer.peer.create_subscription(PoseStamped, '/kinematics/pose', poses.append, QUEUE)
    node = process('--robot', 'craig_3r')
    peer.spin_until(lambda: len(poses) > QUEUE + 50, 'answers to the load')
    # The second signal comes in the middle of the clean-up (s). Idle nodes end at one in the tests
    # below.
    expect_a_clean_end(node, *tell(node, signal.SIGTERM, 2, 0.01))


# Its library, of version 2 and of version 3.
FAST_DDS = re.compile(b'libfast(rtps|dds)')


def test_a_node_that_is_still_starting_ends_cleanly_at_a_signal(process):
    node = process('--robot', 'puma560', ready=False)
    deadline = time.monotonic() + 20.0
    while not FAST_DDS.search(Path(f'/proc/{node.popen.pid}/maps').read_bytes()):
        assert time.monotonic() < deadline
    code, _ = tell(node, signal.SIGTERM, 1, 0.0)
    assert 'Traceback' not in node.stderr
    assert code in (0, -signal.SIGTERM)


@pytest.mark.skipif(not Path('/dev/shm').is_dir(), reason='no /dev/shm here')
def test_a_node_idles_answers_by_the_names_of_its_command_line_and_leaves_nothing(process, peer):
    # A process that was killed at any time before leaves its own, which others open, and keep.
    there = set(map(str, Path('/dev/shm').iterdir()))
    node = process(
        *('--robot', 'craig_3r', '--ros-args', '-r', '__ns:=/cell', '-r', '__node:=arm'),
        *('-r', 'joint_states:=/joint_states', '-p', 'base_frame:=table'),
    )
    assert share_when_idle(node.popen.pid) < 0.02
    pose = answered(peer, '/cell/arm/pose')
    assert pose.header.frame_id == 'table'
    assert pose.pose.position.z == pytest.approx(0.4 * 0.3894183423 - 0.3 * 0.7173560909, abs=1e-9)
    opened = shared_memory(node.popen.pid) - there
    assert opened
    expect_a_clean_end(node, *tell(node, signal.SIGTERM, 1, 0.0))
    # The peer, and tests that run beside this one, may use a segment together with the node.
    for pid in Path('/proc').glob('[0-9]*'):
        opened -= shared_memory(pid.name)
    assert [name for name in opened if Path(name).exists() or Path(f'{name}_el').exists()] == []


def share_when_idle(pid):
    """Return the share of a core that a node takes without messages."""
    settled = threading.Event()
    settled.wait(1.0)  # a cost a second takes seconds: nothing is waited for
    before, begin = processor_seconds(pid), time.monotonic()
    settled.wait(3.0)
    return (processor_seconds(pid) - before) / (time.monotonic() - begin)


def end_while_it_moves(peer, node, name):
    """End a node that answers a twist with joint velocities; they end, too."""
    velocities = peer.listen(f'{name}/ik/joint_velocity', JointState)
    targets = peer.peer.create_publisher(TwistStamped, f'{name}/target_twist', 10)
    twist = TwistStamped()
    twist.header.frame_id = 'base_link'
    twist.twist.linear.x = 0.05

    def moving():
        targets.publish(twist)
        return bool(velocities)

    peer.spin_until(moving, 'joint velocities')
    assert any(velocities[-1].velocity)
    code, seconds = tell(node, signal.SIGINT, 1, 0.0)
    expect_a_clean_end(node, code, seconds)
    peer.spin_until(lambda: not any(velocities[-1].velocity), 'the end of the motion')


def test_several_arms_run_in_one_process_each_in_its_namespace_and_end_in_rest(process, peer):
    node = process(
        *('--robot', 'left=craig_3r', '--robot', 'planar_2r', '--ros-args'),
        *('-p', 'ik.target_timeout:=100.0', '-p', 'joint_state_timeout:=100.0'),
    )
    while sum('listening to' in line for line in node.lines) < 2:
        assert node.popen.poll() is None, node.stderr
        peer.executor.spin_once(timeout_sec=0.01)
    for space, name, q in (('left', 'craig_3r', Q), ('planar_2r', 'planar_2r', (0.2, 0.4))):
        names, robot = NAMES[: len(q)], ks.load_robot(name)
        pose = answered(peer, f'/{space}/kinematics/pose', f'/{space}/joint_states', names, q)
        position = pose.pose.position
        expected = ks.forward_kinematics(robot, q)[:3, 3]
        assert [position.x, position.y, position.z] == pytest.approx(expected.tolist(), abs=1e-9)
    end_while_it_moves(peer, node, '/left/kinematics')


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
        (('--ros-args', '-p', 'twist_frame:=world'), 1, 'give one of base, tool'),
        (('--ros-args', '-p', 'publish_rate:=1'), 1, '1.0 instead of 1'),
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
            'qos_overrides is out of',
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


def test_a_process_that_cannot_start_ends_with_that_code(process):
    # Beside another node, which is destroyed.
    one = process('--robot', 'a=craig_3r', '--robot', 'b=craig_4r', ready=False)
    expect_a_sentence(one.wait(), one.stderr, 1, "no robot 'craig_4r'")


def expect_a_sentence(told, stderr, code, sentence):
    assert told == code, stderr
    assert sentence in stderr.splitlines()[-1]
    assert 'Traceback' not in stderr


def test_what_is_unsecured_or_mixed_does_not_start_unless_asked_for(
    process, peer, capfd, monkeypatch, tmp_path
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
    # It also says that it can write no log file.
    monkeypatch.setenv('ROS_LOG_DIR', '/proc/logs')
    node = process('--robot', 'craig_3r', '--allow-mixed-ros', '--allow-unsecured')
    answered(peer)
    told, *_ = node.stderr.splitlines()
    assert told.startswith('kinematics_service: messages are not ')
    assert log_refusal() in told
    assert 'ROS_LOG_DIR' in told


NO_LOGS = {'ROS_LOG_DIR': '', 'ROS_HOME': ''}


@pytest.mark.parametrize(
    ('folders', 'reason'),
    [
        ({'HOME': ''}, 'HOME is set'),
        ({'HOME': '/dev/null'}, '/dev/null/.ros/log: Not a directory'),
        ({'ROS_HOME': '/dev/null'}, '/dev/null/log: Not a directory'),
        ({'ROS_LOG_DIR': '/proc/logs'}, '/proc/logs: No such file'),
    ],
    ids=lambda given: ' '.join(given) if isinstance(given, dict) else '',
)
def test_a_folder_for_logs_that_cannot_be_is_named(monkeypatch, folders, reason):
    for name, value in {**NO_LOGS, **folders}.items():
        monkeypatch.setenv(name, value)
    assert reason in log_refusal()


# Other executors


class Deaf:
    """An events executor that handles nothing."""

    def __init__(self, context):
        pass

    def nothing(self, *arguments, **options):
        pass

    add_node = remove_node = shutdown = spin_once = spin_until_future_complete = nothing


@pytest.mark.parametrize('experimental', [None, SimpleNamespace(EventsExecutor=Deaf)])
def test_without_the_events_executor_the_default_one_does_the_work(
    peer, monkeypatch, capfd, experimental
):
    monkeypatch.setitem(sys.modules, 'rclpy.experimental', experimental)
    node, heard = Node('listening', context=peer.context), []
    node.create_subscription(Int32, 'numbers', heard.append, 10)
    spinner = Spinner(peer.context, [node])
    assert not spinner.in_order
    publisher = peer.speaker('numbers', kind=Int32)
    publisher.publish(Int32(data=5))
    assert spinner.spin(lambda: bool(heard))
    spinner.close()
    node.destroy_node()
    said = 'using SingleThreadedExecutor' in capfd.readouterr().err
    assert said == (experimental is not None)
