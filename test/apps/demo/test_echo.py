# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Echo: what it prints of a node, and as a process how it ends.

What it prints is told in this process, while a thread turns the node: to start a process for each
takes a second of the processor.
"""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus
from refusal import refused
from rich.console import Console
from ros_harness import LATCHED, Peer, joint_state
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.demo import echo as tool
from kinematics_service.apps.demo.live_table import (
    bars,
    matrix_lines,
    number,
    scale_lines,
    warned_lines,
)
from kinematics_service.errors import LayoutError
from kinematics_service.node.messages.readings import ScaleReading, WarningReading, jacobian_of

Q, QDOT = (0.3, -0.4, 1.2), (0.5, -0.25, 1.0)
DEADLINE = 60.0
COMMAND = 'kinematics_service.apps.demo.commands.echo'
ROWS = ['vx', 'vy', 'vz', 'wx', 'wy', 'wz']


class Echo:
    """`python -m kinematics_service echo` as a process."""

    def __init__(self, *arguments):
        self.popen = subprocess.Popen(
            [sys.executable, '-m', 'kinematics_service', 'echo', *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    @property
    def ended(self):
        return self.popen.poll() is not None

    def end(self):
        """Return exit code, standard output and standard error."""
        output, errors = self.popen.communicate(timeout=DEADLINE)
        return self.popen.returncode, output, errors


@pytest.fixture
def echo(ros_domain):
    """Return a function that starts an echo."""
    started = []

    def start(*arguments):
        started.append(Echo(*arguments))
        return started[-1]

    yield start
    for one in started:
        one.popen.kill()
        one.popen.communicate()


def move_until(arm, true, what):
    """Send the same joint state fifty times a second until `true()`."""
    sent = 0.0

    def moved():
        nonlocal sent
        if time.monotonic() - sent > 0.02:
            sent = time.monotonic()
            arm.send(Q, QDOT)
        return true()

    arm.spin_until(moved, what, DEADLINE)


@contextmanager
def turned(one, moving):
    """Turn an arm or a peer in a thread within the block; an arm also moves if asked for."""
    over = threading.Event()

    def turn():
        sent = 0.0
        while not over.is_set():
            if moving and time.monotonic() - sent > 0.02:
                sent = time.monotonic()
                one.send(Q, QDOT)
            one.executor.spin_once(timeout_sec=0.02 if moving else 0.1)

    if moving:
        one.attach()
    thread = threading.Thread(target=turn)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.fixture
def told(capfd):
    """Return a function for exit code, output and errors of an echo in this process."""

    def run(*arguments):
        capfd.readouterr()
        code = main(['echo', *arguments])
        return code, *capfd.readouterr()

    return run


@pytest.fixture
def explained(told):
    """
    Return a function for errors of an echo in vain, with longer times until words are in them.

    A busy machine discovers nodes and topics late.
    """

    def run(words, *arguments):
        for seconds in (2, 6, 20):
            code, output, errors = told(*arguments, '--timeout', f'{seconds}')
            assert (code, output) == (1, '')
            if words in errors:
                break
        first, last = lines_of_echo(errors)
        assert words in first
        assert f'gave up after {seconds} s' in last
        return first

    return run


@pytest.fixture
def once(told):
    """Return a function for those of an `echo --once` beside an arm that moves."""

    def run(arm, *arguments):
        with turned(arm, moving=True):
            return told(*arguments, '--once')

    return run


def test_one_jacobian_as_json(arm, once):
    code, output, _ = once(arm('craig_3r'), 'jacobian', '--json')
    assert code == 0
    document = json.loads(output)
    assert document['rows'] == ROWS
    assert document['columns'] == ['q1', 'q2', 'q3']
    # Full precision: what is printed is what was computed.
    J = ks.jacobian(ks.load_robot('craig_3r'), Q)
    assert np.array(document['jacobian']) == pytest.approx(J, abs=1e-15)


def test_one_pose_and_one_twist_as_json(arm, once):
    one, robot = arm('craig_3r'), ks.load_robot('craig_3r')
    code, output, _ = once(one, 'pose', '--json')
    pose = json.loads(output)
    T = ks.forward_kinematics(robot, Q)
    assert code == 0
    assert pose['frame'] == robot.base_frame
    assert pose['position'] == pytest.approx(T[:3, 3], abs=1e-15)
    assert pose['quaternion_xyzw'] == pytest.approx(ks.evaluate(robot, Q).quaternion_xyzw)
    roll, pitch, yaw = pose['roll_pitch_yaw']
    assert T[2, 0] == pytest.approx(-np.sin(pitch))
    assert T[2, 1] == pytest.approx(np.cos(pitch) * np.sin(roll))
    assert T[1, 0] == pytest.approx(np.cos(pitch) * np.sin(yaw))
    assert set(pose['stamp']) == {'sec', 'nanosec'}

    code, output, _ = once(one, 'twist', '--json')
    twist = json.loads(output)
    assert code == 0
    assert twist['linear'] + twist['angular'] == pytest.approx(ks.twist(robot, Q, QDOT))


def test_a_scale_and_its_reason(arm, told, explained):
    one = arm('planar_2r')
    with turned(one, moving=False):
        assert 'velocities on ~/command' in explained('sent nothing', 'scale', '--once')
    one.answer((0.3, 0.02))  # nearly stretched
    commands = one.speaker(one.topic('command'), kind=JointState)
    commands.publish(joint_state(one.names, (), (0.0, -1.0)))
    reasons = one.hear('scale_reason', DiagnosticStatus, LATCHED)
    one.spin_until(lambda: reasons, 'reason')
    code, output, _ = told('scale_reason', '--once', '--json')
    document = json.loads(output)
    assert (code, document['level']) == (0, 'ERROR')
    assert document['sentence'].startswith('stopped: singularity, -0.01 rad left')
    assert document['values']['note'].startswith('no safety function')
    reading = ScaleReading(0.35)
    assert scale_lines(reading) == ['scale 0.350  ' + '█' * 7 + '░' * 13]


EFFORTS = (1.0, -2.0, 0.5)


def test_one_acceleration_and_one_wrench_as_json_and_as_lines(arm, once, monkeypatch):
    one, robot = arm('craig_3r'), ks.load_robot('craig_3r')
    send = one.publish

    def with_efforts(message):
        message.effort = list(EFFORTS)
        send(message)

    monkeypatch.setattr(one, 'publish', with_efforts)
    code, output, _ = once(one, 'acceleration', '--json')
    found = json.loads(output)
    assert code == 0
    assert found['frame'] == robot.base_frame
    # The velocities stay as they are: what is left is dJ/dt qdot.
    expected = ks.acceleration(robot, Q, QDOT, (0.0, 0.0, 0.0))
    assert found['linear'] + found['angular'] == pytest.approx(expected, abs=1e-9)

    code, output, _ = once(one, 'wrench', '--json')
    found = json.loads(output)
    assert code == 0
    assert found['frame'] == robot.tool_frame
    damping = one.node.settings.servo.damping
    expected = ks.wrench_from_torques(robot, Q, EFFORTS, axes='tool', damping=damping).wrench
    assert found['force'] + found['torque'] == pytest.approx(expected, abs=1e-9)

    for what, words in (('acceleration', 'rad/s^2'), ('wrench', 'N m')):
        code, output, _ = once(one, what)
        assert (code, output.rstrip().endswith(words)) == (0, True)


def test_a_late_echo_still_gets_the_last_warning(arm, told):
    # Long enough for an echo to start: silence would be the last thing said.
    one = arm('craig_3r', ['-p', 'joint_state_timeout:=60.0'])
    one.answer((0.3, -0.4, 0.0), QDOT)
    with turned(one, moving=False):
        code, output, errors = told('warning', '--once', '--json')
    assert (code, errors) == (0, '')
    warned = json.loads(output)
    assert warned['level'] == 'ERROR'
    assert warned['sentence'].startswith('at a singularity: elbow: ')
    assert warned['values']['robot'] == 'craig_3r'
    assert len(output.splitlines()) == 1


def test_labels_are_those_of_the_message(arm, once):
    one = arm('craig_3r', ['-p', 'row_order:=angular_first', '-p', 'joint_prefix:=left/'])
    code, output, _ = once(one, 'jacobian')
    assert code == 0
    header, *rows = output.splitlines()
    assert header.split() == ['left/q1', 'left/q2', 'left/q3']
    assert [row.split()[0] for row in rows] == [*ROWS[3:], *ROWS[:3]]
    J = ks.jacobian(ks.load_robot('craig_3r'), Q)
    shown = np.array([[float(entry) for entry in row.split()[1:]] for row in rows])
    assert shown == pytest.approx(np.concatenate([J[3:], J[:3]]), abs=5e-5)


def test_a_node_is_found_with_and_without_slashes(arm, told):
    with turned(arm('craig_3r', namespace='/left'), moving=True):
        for name in ('/left/kinematics', 'left/kinematics', 'left/kinematics/'):
            code, output, errors = told('pose', '--once', '--node', name)
            assert (code, lines_of_echo(errors)) == (0, [])
            assert output.startswith('position x y z')


def test_a_pipe_gets_plain_blocks_until_a_signal(arm, echo):
    one, piped = arm('craig_3r'), echo('twist')
    lines = []
    os.set_blocking(piped.popen.stdout.fileno(), False)
    move_until(
        one,
        lambda: lines.append(piped.popen.stdout.readline()) or lines.count('---\n') > 5,
        'five blocks',
    )
    os.set_blocking(piped.popen.stdout.fileno(), True)
    piped.popen.send_signal(signal.SIGTERM)
    code, rest, errors = piped.end()
    output = ''.join(lines) + rest
    assert (code, errors) == (0, '')
    assert '\x1b' not in output
    blocks = output.split('---\n')
    assert len(blocks) > 5
    assert blocks.pop() == ''
    for block in blocks:
        assert re.fullmatch(r'linear vx vy vz +.*m/s, axes of .*\nangular wx wy wz +.*\n', block)


def test_a_reader_that_goes_ends_it_without_a_word(arm, echo):
    one, piped = arm('craig_3r'), echo('pose', '--json')
    os.set_blocking(piped.popen.stdout.fileno(), False)
    move_until(one, lambda: piped.popen.stdout.readline() != '', 'first line')
    piped.popen.stdout.close()
    move_until(one, lambda: piped.ended, 'end of the echo')
    assert piped.popen.returncode == 0
    assert piped.popen.stderr.read() == ''


def lines_of_echo(errors):
    """Return what echo wrote: the node in this process has a log of its own."""
    return [line for line in errors.splitlines() if line.startswith('kinematics_service: ')]


def test_the_diagnostics_are_those_of_the_node_alone(arm, told, explained):
    other = arm('planar_2r', namespace='/left')
    with turned(other, moving=False):
        line = explained('nodes here: /left/kinematics', 'diagnostics', '--once')
    assert '/kinematics/singularity/warning: it has no publisher' in line
    with turned(arm('craig_3r'), moving=True), turned(other, moving=False):
        code, output, _ = told('diagnostics', '--once', '--json')
        (status,) = json.loads(output)['statuses']
        assert (code, status['name'], status['values']['robot']) == (
            0,
            'kinematics: input',
            'craig_3r',
        )
        code, output, _ = told('diagnostics', '--once', '--node', '/left/kinematics')
    first, second, *_ = output.splitlines()
    assert first.startswith('ERROR  left/kinematics: input: ')
    assert second.split() == ['robot', 'planar_2r']


def test_nobody_there_is_explained_and_given_up(arm, told, monkeypatch):
    begin = time.monotonic()
    with turned(arm('craig_3r', namespace='/left'), moving=False):
        for seconds in (3, 9, 27):  # by how busy the machine is
            monkeypatch.setattr(tool, 'SILENCE_TIMEOUT', seconds - 1.0)
            monkeypatch.setattr(f'{COMMAND}.ONCE_TIMEOUT', float(seconds))
            code, output, errors = told('pose', '--once')
            if '/left' in errors:
                break
    assert (code, output) == (1, '')
    explained, gave_up = lines_of_echo(errors)
    assert explained == (
        'kinematics_service: waiting for /kinematics/pose: it has no publisher; kinematics nodes '
        'here: /left/kinematics; try --node /left/kinematics'
    )
    assert f'gave up after {seconds} s ' in gave_up
    assert time.monotonic() - begin > seconds


def test_a_node_that_waits_for_its_robot_is_explained(process, told, explained):
    running = process('--robot-description', ready=False)
    code, output, _ = told('diagnostics', '--once', '--timeout', f'{DEADLINE}')
    assert code == 0, running.stderr
    waits = 'description on /robot_description: no publisher'
    assert output.startswith('WARN  kinematics: input: ')
    assert waits in output
    assert '; its node reports: ' in explained(waits, 'pose', '--once')
    # Not killed: the tests that follow would hear of its topics for another twenty seconds.
    running.popen.send_signal(signal.SIGTERM)
    assert running.wait() == 0


def test_a_timeout_ends_the_wait_for_a_silent_node(arm, explained):
    with turned(arm('craig_3r', namespace='/right'), moving=False):
        line = explained('it has 1 publisher, ', 'twist', '--node', '/right/kinematics')
    assert 'waiting for /right/kinematics/twist' in line


def test_a_timeout_is_for_the_first_message_only(arm, monkeypatch):
    one, ended = arm('craig_3r'), []
    give_up = tool._Echo._give_up
    monkeypatch.setattr(tool._Echo, '_give_up', lambda echo: ended.append(give_up(echo)))
    echo = tool._Echo(one.peer, '/kinematics', 'pose', False, True, 0.1)
    one.answer(Q)
    one.spin_until(lambda: echo._latest.count, 'message')
    with echo.shown():
        one.spin_until(lambda: ended, 'time-out')
    assert not echo.over


@pytest.mark.parametrize(
    ('is_rare', 'count', 'age', 'is_silent'),
    [
        (False, 0, np.inf, True),
        (False, 3, tool.SILENCE_TIMEOUT, True),
        (False, 3, 0.1, False),
        (True, 0, np.inf, True),
        # A warning is published when it changes.
        (True, 1, 60.0, False),
    ],
)
def test_a_topic_is_silent_unless_it_is_rare_and_has_a_message(is_rare, count, age, is_silent):
    one = SimpleNamespace(
        _echoed=SimpleNamespace(is_rare=is_rare), _latest=SimpleNamespace(count=count, age=age)
    )
    assert tool._Echo._silent.fget(one) == is_silent


def test_the_level_of_a_warning_is_coloured_on_a_terminal():
    one = SimpleNamespace(
        _echoed=SimpleNamespace(lines=lambda message, width: ['WARN near elbow', 'distance 0.1']),
        _latest=SimpleNamespace(topic='/warning', message=object(), rate=lambda: 0.5, age=2.0),
        _silent=False,
    )
    title, warned, detail = tool._Echo._screen(one, Console(width=80)).renderables
    assert title.plain == '/warning   0.5 Hz   2.0 s ago   Ctrl-C ends it'
    assert (warned.plain, detail.plain) == ('WARN near elbow', 'distance 0.1')
    assert [(span.start, span.end) for span in warned.spans] == [(0, len('WARN'))]
    assert not detail.spans


@pytest.mark.parametrize('seconds', ['0', '-1', 'nan', '1e9'])
def test_a_timeout_that_is_none_is_wrong_usage(told, seconds):
    code, output, errors = told('pose', '--timeout', seconds)
    assert (code, output) == (2, '')
    assert '--timeout: ' in errors
    assert 'Traceback' not in errors


def test_a_silent_node_is_explained_and_waited_for(arm, told, monkeypatch):
    one, said = arm('craig_3r'), []
    monkeypatch.setattr(tool, 'SILENCE_TIMEOUT', 4.0)
    monkeypatch.setattr(tool.session, 'tell', said.append)
    one.attach()
    one.peer.create_timer(0.02, lambda: said and one.send(Q, QDOT))
    with turned(one, moving=False):
        code, output, _ = told('pose', '--once')
    assert (code, output.startswith('position x y z')) == (0, True)
    (explained,) = said
    assert '/kinematics/pose: it has 1 publisher, ' in explained


@pytest.mark.parametrize('name', ['a b', '', '/', '1st', 'a//b'])
def test_a_name_that_is_none_is_wrong_usage(told, name):
    code, output, errors = told('pose', '--node', name)
    assert (code, output) == (2, '')
    assert 'Traceback' not in errors
    assert errors.startswith('kinematics_service: --node ')


def array(rows, columns, data, offset=0, stride=None):
    message = Float64MultiArray(data=data)
    n = columns.count(',') + 1
    message.layout.data_offset = offset
    message.layout.dim = [
        MultiArrayDimension(label=rows, size=rows.count(',') + 1, stride=len(data)),
        MultiArrayDimension(label=columns, size=n, stride=stride or n),
    ]
    return message


def test_a_matrix_is_read_by_its_layout():
    matrix = jacobian_of(array('a,b', 'x,y', [0.0, 1, 2, 9, 3, 4, 9], offset=1, stride=3))
    assert matrix.rows == ('a', 'b')
    assert matrix.columns == ('x', 'y')
    assert matrix.jacobian.tolist() == [[1, 2], [3, 4]]


def wrong_labels():
    message = array('a,b', 'x', [1.0, 2.0])
    message.layout.dim[0].size = 3
    return message


@pytest.mark.parametrize(
    ('message', 'code', 'words'),
    [
        (Float64MultiArray(data=[1.0, 2.0]), 'wrong-shape', '0 dimensions'),
        (wrong_labels(), 'wrong-length', '2 labels for 3'),
        (array('a,b', 'x,y', [1.0, 2.0, 3.0]), 'wrong-length', '3 numbers'),
        (array('a', 'x,y', [1.0, 2.0], stride=1), 'wrong-length', '1 x 2'),
        (array('a,b', 'x', [1.0, 2.0], offset=1), 'wrong-length', '2 x 1'),
    ],
)
def test_a_layout_that_does_not_fit_is_refused(message, code, words):
    with refused(LayoutError, code, words):
        jacobian_of(message)


def test_a_foreign_layout_is_one_line_not_an_end(ros_domain, told):
    peer = Peer()
    try:
        publisher = peer.peer.create_publisher(Float64MultiArray, '/kinematics/jacobian', 10)
        peer.peer.create_timer(0.1, lambda: publisher.publish(Float64MultiArray(data=[1.0])))
        with turned(peer, moving=False):
            ended = told('jacobian', '--once')
    finally:
        peer.close()
    assert ended[:2] == (1, '')
    (line,) = lines_of_echo(ended[2])
    assert '/kinematics/jacobian: layout: 0 dimensions' in line


@pytest.mark.parametrize('width', [20, 40, 80, 200])
def test_a_matrix_fits_the_terminal(width):
    robot = ks.load_robot('panda')
    matrix = jacobian_of(
        array(','.join(ROWS), ','.join(robot.joint_names), np.arange(42.0).tolist())
    )
    lines = matrix_lines(matrix, width)
    assert max(map(len, lines)) <= width
    entries = [word for line in lines for word in line.split() if word.startswith('+')]
    assert sorted(map(float, entries)) == list(range(42))


def test_numbers_have_no_negative_zero_and_never_outgrow_their_cell():
    assert number(-1e-9) == '+0.0000'
    for value in (
        0.0,
        -999.99994,
        999.99996,
        99.99996,
        1e3,
        -1e300,
        1e-300,
        np.inf,
        -np.inf,
        np.nan,
    ):
        assert len(number(value)) <= 9 - (abs(value) < 1e99)


def test_what_a_terminal_would_obey_is_not_printed():
    warned = WarningReading('WARN', 'near \x1b[31m red', 'name', {'key\x07': 'a\x1b]0;b'})
    lines = warned_lines(warned, 80)
    assert not any('\x1b' in line or '\x07' in line for line in lines)


def test_bars_grow_with_the_values():
    assert bars([0.0, 0.25, 0.5, 7.0, np.inf], 0.5) == '▁▅███'
