# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The demo: what it says, and as a process how it ends, and that nothing of it leaves its namespace.
"""

import contextlib
import fcntl
import math
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, TwistStamped
from rich.console import Console
from ros_harness import Peer
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.demo.demo import RANGE, stay_on_this_host
from kinematics_service.apps.demo.demo_listener import INTERVAL, DemoListener, Nearest
from kinematics_service.apps.demo.demo_report import PlainReport, summary
from kinematics_service.apps.demo.demo_screen import screen
from kinematics_service.apps.demo.virtual_arm import RATE
from kinematics_service.node.messages.readings import WarningReading
from kinematics_service.robot.measure_units import measure_units

SLOWED = DiagnosticStatus(
    level=DiagnosticStatus.WARN,
    values=[KeyValue(key='cause', value='position limit'), KeyValue(key='of', value='elbow')],
)
DEADLINE = 60.0
SUMMARY = re.compile(
    r'^([\d.]+) s: (\d+) joint states sent; heard (\d+) poses, (\d+) Jacobians, (\d+) twists, '
    r'(\d+) warnings$',
    re.MULTILINE,
)
NEAREST = re.compile(r'^nearest to a singular pose at [\d.]+ s: distance ([\d.]+) rad', re.M)
ENTER_SCREEN, LEAVE_SCREEN, SHOW_CURSOR = b'\x1b[?1049h', b'\x1b[?1049l', b'\x1b[?25h'


def command(*arguments):
    return [sys.executable, '-m', 'kinematics_service', 'demo', *arguments]


@pytest.fixture
def told(ros_domain, capfd):
    """Return a function for exit code, output and errors of a demo in this process."""

    def run(*arguments):
        code = main(['demo', *arguments])
        output, errors = capfd.readouterr()
        # The first context of a process sets the level of the log, and a test may have one.
        lines = errors.splitlines(keepends=True)
        return code, output, ''.join(line for line in lines if not line.startswith('[INFO]'))

    return run


@pytest.fixture
def started(ros_domain):
    """Return a function that starts a demo whose standard output is read line by line."""
    with contextlib.ExitStack() as stack:

        def start(*arguments):
            process = subprocess.Popen(
                command(*arguments),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        yield start


def line_with(process, text):
    """Return the next line of a process that has a text in it."""
    for line in process.stdout:
        if text in line:
            return line
    pytest.fail(f'it ended without {text!r}: {process.stderr.read()}')


def test_five_seconds_lead_through_a_singular_pose(told, ros_domain):
    # The path is nearest to it at 3 s; a busy machine may stall for the rest.
    code, output, errors = told('--robot', 'craig_3r', '--duration', '5')
    assert (code, errors) == (0, '')
    assert '\x1b' not in output
    assert 'craig_3r moves through' in output
    assert 'echo jacobian --node /demo/kinematics' in output
    assert f'ROS_DOMAIN_ID={ros_domain} {RANGE}=LOCALHOST ros2 topic' in output
    for level in ('OK: not near a', 'WARN: near a', 'ERROR: at a'):
        assert f' s  {level} singularity: ' in output
    seconds, *counts = SUMMARY.search(output).groups()
    sent, poses, jacobians, twists, warnings = map(int, counts)
    assert float(seconds) >= 5.0
    # No more than were due: the end is noticed a turn of the executor late, or later still.
    assert 100 <= sent <= RATE * (float(seconds) + 0.05) + 1
    assert sent == poses == jacobians == twists
    assert warnings >= 3
    assert float(NEAREST.search(output)[1]) < 0.01
    assert 'OK > WARN > ERROR' in output
    assert '  OK  scale 1.00' in output


def test_the_default_arm_and_the_other_trajectory(told):
    code, output, errors = told('--trajectory', 'sine', '--duration', '1')
    assert code == 0
    assert 'Traceback' not in errors
    assert 'puma560 moves in sines ' in output
    sent, poses = map(int, SUMMARY.search(output).groups()[1:3])
    assert sent == poses > 10


# SIGINT ends the demo on a terminal below; other pairs are tested with the node.
def test_a_signal_in_the_middle_ends_it_with_a_summary(started):
    process = started('--robot', 'planar_2r', '--trajectory', 'sine')
    line_with(process, ' s  tool ')
    for _ in range(2):
        process.send_signal(signal.SIGTERM)
    rest, errors = process.communicate(timeout=DEADLINE)
    assert (process.returncode, errors) == (0, '')
    sent, poses = map(int, SUMMARY.search(rest).groups()[1:3])
    assert sent == poses > 0


def test_its_answers_are_the_librarys_in_its_namespace_until_its_reader_goes(started):
    renamed = ('--ros-args', '-r', '__ns:=/live', '-r', 'joint_states:=/joint_states')
    process = started('--robot', 'craig_3r', '--trajectory', 'sine', *renamed)
    line_with(process, ' s  tool ')
    peer = Peer()
    try:
        states = peer.listen('/demo/joint_states', JointState)
        poses = peer.listen('/demo/kinematics/pose', PoseStamped)
        peer.spin_until(lambda: len(states) > 20 and len(poses) > 20, 'messages of the demo')
        topics = {name for name, _ in peer.peer.get_topic_names_and_types()}
        assert {name for name in topics if not name.startswith('/demo/')} <= {
            '/rosout',
            '/parameter_events',
        }

        def nodes():
            return {one for one in peer.peer.get_node_names_and_namespaces() if one[0] != 'peer'}

        # Names of nodes come later than what they publish.
        peer.spin_until(lambda: len(nodes()) >= 3, 'nodes of the demo')
        assert nodes() == {('kinematics', '/demo'), ('arm', '/demo'), ('display', '/demo')}
    finally:
        peer.close()
    process.stdout.close()
    assert process.wait(DEADLINE) == 0
    assert process.stderr.read() == ''
    robot = ks.load_robot('craig_3r')
    positions = {str(state.header.stamp): list(state.position) for state in states}
    compared = 0
    for pose in poses:
        if str(pose.header.stamp) in positions:
            xyz = ks.forward_kinematics(robot, positions[str(pose.header.stamp)])[:3, 3]
            p = pose.pose.position
            assert np.array([p.x, p.y, p.z]) == pytest.approx(xyz, abs=1e-12)
            compared += 1
    assert compared > 10


def test_a_replay_keeps_the_stamps_and_ends_by_itself(told, tmp_path):
    rows = [f'{100 + 0.05 * k:.2f},{0.01 * k},{0.5 - 0.02 * k}' for k in range(31)]
    file = tmp_path / 'motion.csv'
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    peer = Peer()
    try:
        poses = []
        peer.peer.create_subscription(PoseStamped, '/demo/kinematics/pose', poses.append, 100)
        code, output, errors = told('--robot', 'planar_2r', '--replay', str(file))
        # What waits in the queue of the subscription.
        peer.spin_until(lambda: poses, 'pose')
        for _ in range(31):
            peer.executor.spin_once(timeout_sec=0.0)
    finally:
        peer.close()
    assert (code, errors) == (0, '')
    assert 'planar_2r replays 31 joint states ' in output
    seconds, sent, heard, _, twists, _ = map(float, SUMMARY.search(output).groups())
    assert (sent, heard, twists) == (31, 31, 30)
    assert seconds >= 1.5
    stamps = [pose.header.stamp.sec * 10**9 + pose.header.stamp.nanosec for pose in poses]
    assert set(stamps) <= {100 * 10**9 + 50_000_000 * k for k in range(31)}


def test_a_shorter_duration_ends_a_replay(told, tmp_path):
    file = tmp_path / 'motion.csv'
    file.write_text('stamp,position.q1,position.q2\n1,0,1\n2,0,1\n1000,0,1\n')
    code, output, errors = told('--robot', 'planar_2r', '--replay', str(file), '--duration', '1.5')
    assert (code, errors) == (0, '')
    assert SUMMARY.search(output)[2] == '2'


def test_a_bad_recording_is_one_sentence(told, tmp_path):
    file = tmp_path / 'motion.csv'
    file.write_text('stamp,position.q1,position.q2\n0,0,much\n')
    ended = told('--robot', 'planar_2r', '--replay', str(file))
    assert ended[:2] == (1, '')
    assert ended[2].startswith(f"{file}:2: column 'position.q2': 'much' ")
    assert ended[2].count('\n') == 1


@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        (['-p', 'jacobian_frame:=wrist'], 1, 'jacobian_frame'),
        (['-p', 'singularity.warn:=1'], 1, 'singularity.warn'),
        (['-r', 'nonsense'], 2, 'wrong ROS arguments'),
    ],
)
def test_a_bad_setting_is_one_sentence(told, arguments, code, words):
    ended, output, errors = told('--ros-args', *arguments)
    assert (ended, output) == (code, '')
    assert words in errors
    assert 'Traceback' not in errors


def test_a_parameter_of_the_user_holds(told):
    options = ('--robot', 'craig_3r', '--trajectory', 'sine', '--duration', '1')
    code, output, _ = told(*options, '--ros-args', '-p', 'joint_prefix:=left_')
    assert code == 0
    sent, poses = map(int, SUMMARY.search(output).groups()[1:3])
    assert sent == poses > 10


@pytest.mark.parametrize(
    ('before', 'after'),
    [
        ('', 'LOCALHOST'),
        ('SUBNET', 'LOCALHOST'),
        ('SYSTEM_DEFAULT', 'LOCALHOST'),
        ('LOCALHOST', 'LOCALHOST'),
        ('OFF', 'OFF'),
    ],
)
def test_discovery_stays_on_this_host(monkeypatch, before, after):
    monkeypatch.setenv(RANGE, before)
    monkeypatch.setenv('ROS_STATIC_PEERS', '192.0.2.1')
    monkeypatch.setenv('ROS_DISCOVERY_SERVER', '')
    assert stay_on_this_host() == ('ROS_STATIC_PEERS',)
    assert os.environ[RANGE] == after
    assert 'ROS_STATIC_PEERS' not in os.environ


def on_terminal(columns, lines, arguments, ends_by, seconds=DEADLINE):
    """
    Run a demo on a terminal; return its exit code and what it wrote.

    A signal `ends_by` is sent once the table shows a Jacobian.
    """
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack('HHHH', lines, columns, 0, 0))
    settings = termios.tcgetattr(slave)
    environment = {**os.environ, 'TERM': 'xterm-256color', 'PYTHONUTF8': '1'}
    environment.pop('COLUMNS', None)
    environment.pop('LINES', None)
    with subprocess.Popen(
        command(*arguments), stdin=slave, stdout=slave, stderr=slave, env=environment
    ) as process:
        written, deadline, told = b'', time.monotonic() + seconds, False
        while process.poll() is None or select.select([master], [], [], 0.1)[0]:
            if time.monotonic() > deadline:
                process.kill()
                pytest.fail(f'still running: {written[-2000:]!r}')
            if select.select([master], [], [], 0.05)[0]:
                written += os.read(master, 65536)
            if not told and b'wz ' in written:
                process.send_signal(ends_by)
                told = True
    assert termios.tcgetattr(slave) == settings
    os.close(master)
    os.close(slave)
    return process.returncode, written


def shown_on(columns, lines, level='ERROR', robot='panda', measure=0.0123):
    """Return the lines of the table on a terminal of a size, for seven joints."""
    names = [f'{robot}_joint{k}' for k in range(1, 8)]
    rows = ['vx', 'vy', 'vz', 'wx', 'wy', 'wz']
    matrix = Float64MultiArray(data=[0.1 * k for k in range(42)])
    matrix.layout.dim = [
        MultiArrayDimension(label=','.join(rows), size=6, stride=42),
        MultiArrayDimension(label=','.join(names), size=7, stride=7),
    ]
    values = {'robot': robot, 'factor': 'elbow', 'structural': 'never', 'lost_direction': 'x'}
    sentence = 'at a singularity: elbow = 0.0123, ' + 'distance 0.0123 rad (0.7 deg), ' * 4
    listener = SimpleNamespace(
        source='/demo/kinematics',
        time=12.5,
        warned=WarningReading(level, sentence, 'kinematics', values),
        pose=SimpleNamespace(message=PoseStamped()),
        twist=SimpleNamespace(message=TwistStamped()),
        jacobian=SimpleNamespace(message=matrix, rate=lambda: 50.0),
        measure=lambda name: measure,
        history=[0.01 * k for k in range(400)],
        speeds=[0.002 * k for k in range(400)],
        scale=SimpleNamespace(message=Float64(data=0.35)),
        reason=SimpleNamespace(message=SLOWED),
        joint_speeds=lambda: {name: -0.125 * k for k, name in enumerate(names)},
    )
    console = Console(width=columns, height=lines, markup=False, highlight=False)
    with console.capture() as capture:
        units = measure_units(ks.load_robot('puma560'))
        console.print(screen(listener, console.size, True, units))
    return capture.get().splitlines()


def test_what_just_fits_a_terminal_is_shown_whole():
    whole = shown_on(80, 100)
    assert shown_on(80, len(whole)) == whole
    assert len(shown_on(80, len(whole) - 1)) < len(whole)


def test_the_scale_has_its_bar_and_its_cause():
    (line,) = (line for line in shown_on(80, 24) if line.startswith('scale'))
    bar = '█' * 7 + '░' * 13
    assert line.rstrip() == f'scale             0.350  {bar}  position limit of elbow'


def test_the_history_has_the_least_distance_and_the_largest_speed_of_each_interval():
    one = SimpleNamespace(
        distance=SimpleNamespace(message=Float64()),
        pose=SimpleNamespace(message=PoseStamped()),
        nearest=Nearest(math.inf, 0.0, None),
        history=[],
        speeds=[],
        _intervals=0,
    )
    for one.time, one.distance.message.data, speed in (
        (0.1 * INTERVAL, 0.5, -0.2),
        (0.5 * INTERVAL, 0.3, 0.1),
        (0.9 * INTERVAL, 0.4, math.nan),
        (3.5 * INTERVAL, 0.3, 0.7),
    ):
        one.joint_speeds = lambda speed=speed: {'q1': speed, 'q2': 0.0}
        DemoListener._note(one, b'')
    assert one.history == [0.3, math.inf, math.inf, 0.3]
    assert one.speeds == [0.2, 0.0, 0.0, 0.7]
    # The first of two equal ones is the nearest.
    assert (one.nearest.distance, one.nearest.time) == (0.3, 0.5 * INTERVAL)


def test_the_speeds_are_those_of_the_last_joint_states():
    one = SimpleNamespace(joints=None)
    assert DemoListener.joint_speeds(one) == {}
    one.joints = SimpleNamespace(message=None)
    assert DemoListener.joint_speeds(one) == {}
    one.joints.message = JointState(name=['q1', 'q2'], velocity=[0.5, -0.25])
    assert DemoListener.joint_speeds(one) == {'q1': 0.5, 'q2': -0.25}


SIZES = [(40, 5), (60, 15), (80, 24), (100, 30), (120, 35), (200, 50), (250, 12)]


@pytest.mark.parametrize(('columns', 'lines'), SIZES)
@pytest.mark.parametrize('level', ['OK', 'ERROR'])
def test_the_level_is_the_first_line_on_every_terminal(columns, lines, level):
    shown = shown_on(columns, lines, level)
    assert shown[0].startswith(f'{level} ')
    assert len(shown) <= lines
    assert max(map(len, shown)) <= columns
    if lines >= 15:
        for words in ('Ctrl-C ends it', 'distance ', '0.5 rad', 'fastest joint', 'twist x y z'):
            assert any(words in line for line in shown), words


def test_a_distance_of_one_says_that_none_was_found():
    words = 'none found within 1 rad (57 deg)'
    shown = shown_on(80, 24, 'OK', measure=1.0)
    (line,) = (line for line in shown if line.startswith('distance  '))
    assert line.rstrip() == f'distance          {words}'
    (line,) = (line for line in shown_on(80, 24) if line.startswith('distance  '))
    assert line.rstrip() == 'distance          0.0123 rad = 0.7 deg'
    said = []
    listener = SimpleNamespace(
        time=2.0,
        pose=SimpleNamespace(message=PoseStamped(), count=3),
        jacobian=SimpleNamespace(count=3),
        twist=SimpleNamespace(count=3),
        warning=SimpleNamespace(count=1),
        scale=SimpleNamespace(message=Float64(data=0.35)),
        reason=SimpleNamespace(message=SLOWED),
        measure=lambda name: 1.0,
        nearest=Nearest(1.0, 1.5, None),
        levels=['OK'],
    )
    PlainReport(listener, SimpleNamespace(line=said.append)).tick()
    said += summary(listener, 3)
    assert said[0] == (
        f'   2.0 s  tool +0.0000 +0.0000 +0.0000 m  {words}  scale 0.35 position limit of elbow'
    )
    assert said[2] == f'nearest to a singular pose at 1.5 s: {words}'


@pytest.mark.parametrize(('columns', 'lines'), [(80, 24), (120, 35), (200, 50)])
def test_each_joint_has_its_speed_in_its_column(columns, lines):
    shown = shown_on(columns, lines)
    speeds = next(line for line in shown if 'qdot' in line).partition('qdot')[2].split()
    assert [float(word) for word in speeds[:7]] == [-0.125 * k for k in range(7)]


def test_the_measures_have_their_units():
    assert any('det(J)' in line and 'm^3' in line for line in shown_on(200, 50))


def test_on_a_terminal_the_table_comes_and_goes(ros_domain):
    # The smooth path begins far from singular poses: OK is shown before a signal ends it.
    code, written = on_terminal(80, 24, ['--robot', 'craig_3r'], signal.SIGINT)
    assert code == 0
    assert b'Traceback' not in written
    assert written.count(ENTER_SCREEN) == written.count(LEAVE_SCREEN) == 1
    assert written.rindex(SHOW_CURSOR) > written.index(ENTER_SCREEN)
    before, _, rest = written.partition(ENTER_SCREEN)
    table, _, after = rest.partition(LEAVE_SCREEN)
    assert b'ros2 topic echo' in before
    assert b'joint states sent' in after
    shown = re.sub(rb'\x1b\[[0-9;?]*[A-Za-z]', b'', table).decode()
    for words in ('craig_3r  /demo/kinematics', 'OK', 'q2', 'det(J)', 'condition number'):
        assert words in shown
