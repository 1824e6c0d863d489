# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The process always ends: floods of messages and of timers, signals at any moment, bad clean-ups.
"""

import contextlib
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from joint_state_mcap import write_motion
from node_process import NodeProcess

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.node.process.session import CLEAN_UP_TIMEOUT
from kinematics_service.stop_signals import SHOW_CURSOR

STARTS = 4
# A queue is full long before (s).
FILLS = 0.3
UNKNOWN = 5_000
HIDE_CURSOR = b'\x1b[?25l'
PACKAGE = str(Path(ks.__file__).parent)


def program_ends(program, *signals, ready='ready', pause=0.0, environment=None, limit=20.0):
    """
    Run a program until it says it is ready, send it signals; return code, seconds and output.

    It fails if the program does not end by itself: what hangs here hangs for longer than `limit`.
    """
    with subprocess.Popen(
        [sys.executable, '-X', 'faulthandler', '-c', program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **(environment or {})},
    ) as process:
        try:
            assert ready in process.stdout.readline(), process.stderr.read()
            begin = time.monotonic()
            for number in signals:
                time.sleep(pause)
                process.send_signal(number)
            code = process.wait(limit)
            seconds = time.monotonic() - begin
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGABRT)  # it says where each of its threads is
            output = ''.join(process.communicate())
            raise AssertionError(f'it does not end in {limit} s: {output}') from None
        finally:
            process.kill()
        return code, seconds, process.stdout.read() + process.stderr.read()


# A queue that is never empty


SPIN = """
import sys, threading, time
import rclpy
from rclpy.clock import Clock, ClockType
from std_msgs.msg import Empty
from kinematics_service.node.process.spin import Spinner
from kinematics_service.stop_signals import stop_signals

with stop_signals() as stop:
    context = rclpy.context.Context()
    rclpy.init(context=context, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node = rclpy.create_node('flooded', context=context)
    left_out, handled = [], [0]
    spinner = Spinner(context, [node], left_out.append)
    stop.then = spinner.interrupt
    stop.meanwhile = spinner.watch
{body}
    print('ready', flush=True)
    fine = spinner.spin(lambda: stop.came)
    print(f'fine={{fine}} handled={{handled[0]}} left_out={{len(left_out)}}', flush=True)
    print(f'threads={{threading.active_count()}}', flush=True)
    spinner.close()
    node.destroy_node()
    context.try_shutdown()
"""

# Ten thousand events wait for a callback that takes a millisecond, again and again.
MESSAGES = """
    def slow(message):
        handled[0] += 1
        time.sleep(0.001)

    node.create_subscription(Empty, 'flood', slow, 50)
    publisher = node.create_publisher(Empty, 'flood', 50)
    message = Empty()

    def flood():
        while not stop.came:
            try:
                publisher.publish(message)
            except Exception:
                return  # the node has gone

    threading.Thread(target=flood, daemon=True).start()
"""

# The same from another process: within one a thread that computes takes the interpreter's lock for
# 5 ms at each event. Fifty times as many as are answered: that more are does not fill it sooner.
FLOOD = """
import faulthandler, os, time
import rclpy
from std_msgs.msg import Empty
parent = os.getppid()
rclpy.init()
publisher = rclpy.create_node('flood').create_publisher(Empty, 'flood', 50)
while os.getppid() == parent and rclpy.ok():
    try:
        publisher.publish(Empty())
    except Exception:
        break  # it was told to end
    time.sleep(0.001)
# Where a participant of another process goes at the same moment, Fast DDS may never come back.
faulthandler.dump_traceback_later(10.0, exit=True)
"""
MESSAGES_OF_ANOTHER = f"""
    import os, signal, subprocess

    def slow(message):
        handled[0] += 1
        time.sleep(0.05)  # on a very busy machine 76 messages came a second

    def end():
        # After a time it ends all the same, and says below how far it came.
        latest = time.monotonic() + 50.0
        while not left_out and time.monotonic() < latest:
            time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=end, daemon=True).start()
    node.create_subscription(Empty, 'flood', slow, 50)
    # Not killed: one that dies inside the middleware's shared memory can stop those that share it.
    stop.then = lambda: (flood.terminate(), flood.wait(), spinner.interrupt())
    flood = subprocess.Popen([sys.executable, '-c', {FLOOD!r}])
"""

# Its callback takes longer than its period, and it is set anew in it.
TIMER = """
    def slow():
        handled[0] += 1
        time.sleep(0.004)
        timer.reset()
        timer.reset()

    timer = node.create_timer(0.001, slow, clock=Clock(clock_type=ClockType.STEADY_TIME))
"""


@pytest.mark.parametrize('flood', [MESSAGES, TIMER], ids=['messages', 'timer'])
def test_one_signal_ends_a_process_whose_queue_is_never_empty(ros_domain, flood):
    program = SPIN.format(body=flood)
    code, _, output = program_ends(program, signal.SIGINT, pause=FILLS)
    assert code == 0, output
    assert 'fine=True' in output
    assert 'Traceback' not in output


def test_a_queue_that_grows_is_given_up_and_what_was_left_out_is_told(ros_domain):
    program = SPIN.format(body=MESSAGES_OF_ANOTHER) + "print(f'total={sum(left_out)}')\n"
    # It ends itself, when it is behind: on a busy machine the flood comes slowly, too.
    code, _, output = program_ends(program, limit=60.0)
    assert code == 0, output
    assert 'left_out=0' not in output, output
    # Of fifty that the middleware keeps all but the newest ten are thrown away each time.
    assert int(output.split('total=')[1].split()[0]) >= 10


def test_a_process_that_spins_has_one_thread_beside_the_main_one(ros_domain):
    code, _, output = program_ends(SPIN.format(body=''), signal.SIGINT)
    assert code == 0, output
    assert 'threads=2' in output  # it follows the signals


# Signals


HANGING = """
import time
from kinematics_service.stop_signals import stop_signals
with stop_signals() as stop:
    print('ready', flush=True)
    try:
        while not stop.came:
            time.sleep(0.05)
    finally:
        {hang}
"""


@pytest.mark.parametrize(
    'hang',
    ['time.sleep(60.0)', 'import threading; threading.Event().wait()'],
    ids=['sleep', 'wait'],
)
def test_a_second_signal_ends_a_clean_up_that_hangs(hang):
    program = HANGING.format(hang=hang)
    code, seconds, output = program_ends(program, signal.SIGINT, signal.SIGTERM, pause=0.1)
    assert (code, output) == (0, '')
    assert seconds >= 1.0


# No signal interrupts the second wait, and no handler in Python runs in it.
STUCK = """
import ctypes
from kinematics_service.stop_signals import stop_signals
mutex, wait = ctypes.create_string_buffer(64), ctypes.CDLL(None).pthread_mutex_lock
with stop_signals() as stop:
    wait(mutex)
    print('ready', flush=True)
    {before}
    wait(mutex)
"""


# As where a publisher was killed inside the middleware's shared memory.
HANGING_SESSION = """
import ctypes, time
from kinematics_service.node.process import session
mutex, wait = ctypes.create_string_buffer(64), ctypes.CDLL(None).pthread_mutex_lock

def work(context, stop):
    wait(mutex)
    print('ready', flush=True)
    while not stop.came:
        time.sleep(0.01)
    wait(mutex)

session.run_session([], work)
"""


def test_time_ends_a_session_whose_clean_up_is_stuck_at_one_signal(ros_domain):
    code, seconds, output = program_ends(HANGING_SESSION, signal.SIGINT)
    assert (code, output) == (0, '')
    assert seconds >= CLEAN_UP_TIMEOUT


# As where a participant of another process goes while this one does: the middleware waits, with
# the interpreter's lock.
HANGING_NODE = """
import ctypes, time
from kinematics_service.node.process import session
mutex = ctypes.create_string_buffer(64)

class Node:
    def destroy_node(self):
        for _ in range(2):
            ctypes.PyDLL(None).pthread_mutex_lock(mutex)

def work(context, stop):
    print('ready', flush=True)
    while not stop.came:
        time.sleep(0.01)
    session.destroy(Node())

session.run_session([], work)
"""


def test_time_ends_a_node_that_hangs_with_the_lock_of_the_interpreter(ros_domain):
    code, seconds, output = program_ends(HANGING_NODE, signal.SIGINT)
    assert (code, output) == (128 + signal.SIGINT, '')
    assert seconds >= CLEAN_UP_TIMEOUT


# A call of C that never returns, and keeps the interpreter's lock.
DEAF = """
import ctypes
from kinematics_service.stop_signals import {block}
mutex, wait = ctypes.create_string_buffer(64), ctypes.PyDLL(None).pthread_mutex_lock
with {block}():
    wait(mutex)
    print('ready', flush=True)
    wait(mutex)
"""


@pytest.mark.skipif(not kernel.is_compiled(), reason='the timer is in C')
@pytest.mark.parametrize(
    ('block', 'number'),
    [('stop_signals', signal.SIGTERM), ('interruptible', signal.SIGINT)],
)
def test_time_ends_a_process_whose_python_does_not_run(block, number):
    code, seconds, output = program_ends(DEAF.format(block=block), number)
    assert (code, output) == (128 + number, '')
    assert seconds >= CLEAN_UP_TIMEOUT


def test_a_clean_up_that_may_take_its_time_is_not_cut_off():
    hang = f"time.sleep({CLEAN_UP_TIMEOUT + 1.0}); print('done')"
    code, _, output = program_ends(HANGING.format(hang=hang), signal.SIGINT)
    assert (code, output) == (0, 'done\n')


@pytest.mark.parametrize(
    'before', ['', 'while not stop.came: pass'], ids=['before the first', 'after it']
)
def test_a_second_signal_ends_a_process_that_is_stuck_inside_a_library(before):
    code, _, output = program_ends(
        STUCK.format(before=before), signal.SIGTERM, signal.SIGINT, pause=0.1
    )
    assert (code, output) == (0, '')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_start_that_is_stopped_at_any_moment_ends_without_a_traceback(ros_domain, number):
    dice = random.Random(number)
    for k in range(STARTS):
        node = NodeProcess('--robot', 'planar_2r', ready=False)
        try:
            time.sleep(dice.uniform(0.0, 0.5) * k)
            node.popen.send_signal(number)
            code = node.wait()
        finally:
            node.kill()
        # What the interpreter says before it has read a line of this package is its own.
        assert PACKAGE not in node.stderr, node.stderr
        codes = (0, -number, *([130] if number == signal.SIGINT else []))
        assert code in codes or 'Traceback' in node.stderr, node.stderr


def test_ctrl_c_ends_a_command_that_computes_inside_a_library():
    program = """
import sys, threading, time
import kinematics_service.__main__ as entry
import kinematics_service.cli.commands as commands
import ctypes

def group(arguments, obj, prog_name):
    print('ready', flush=True)
    ctypes.CDLL(None).sleep(60)

commands.command_group = lambda: group
sys.argv.append('robots')
sys.exit(entry.main())
"""
    code, _, output = program_ends(program, signal.SIGINT, pause=0.1)
    assert (code, output) == (130, '')


def children_of(pid):
    """Return the processes that a process has started."""
    return [int(child) for child in Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]


@pytest.fixture(scope='module')
def long_bags(tmp_path_factory):
    """Return two recordings that an audit is busy with for seconds."""
    folder, robot = tmp_path_factory.mktemp('bags'), ks.load_robot('ur5e')

    def motion(t):
        q = np.sin(t[:, None] + np.arange(robot.dof))
        return q, np.cos(t[:, None] + np.arange(robot.dof))

    bags = [folder / 'a.mcap', folder / 'b.mcap']
    write_motion(bags[0], robot.joint_names, 20_000, motion)
    shutil.copy(*bags)
    return bags


@pytest.mark.skipif(not Path('/proc/self/task').exists(), reason='needs /proc')
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL], ids=lambda s: s.name)
def test_an_audit_by_several_processes_leaves_none_of_them_behind(long_bags, number):
    command = [sys.executable, '-m', 'kinematics_service', 'audit', *long_bags, '--robot', 'ur5e']
    with subprocess.Popen([*command, '--jobs', '2'], stderr=subprocess.PIPE, text=True) as audit:
        deadline = time.monotonic() + 60.0
        # Two that work, and the one that keeps account of what they share.
        while len(children := children_of(audit.pid)) < 3:
            assert time.monotonic() < deadline, 'no processes'
            time.sleep(0.05)
        time.sleep(0.1)
        audit.send_signal(number)
        assert audit.wait(60.0) in (130, -signal.SIGKILL)
        # They are left for good, or gone as soon as they have a processor.
        deadline = time.monotonic() + 60.0
        while any(Path(f'/proc/{child}').exists() for child in children):
            assert time.monotonic() < deadline, 'a process is left behind'
            time.sleep(0.05)
        assert 'Traceback' not in audit.stderr.read()


def test_ctrl_c_gives_the_cursor_back():
    master, slave = pty.openpty()
    command = [sys.executable, '-m', 'kinematics_service', 'derive', 'panda']
    with subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave) as derive:
        os.close(slave)
        shown = b''
        while HIDE_CURSOR not in shown:
            shown += os.read(master, 65536)
        time.sleep(0.2)
        derive.send_signal(signal.SIGINT)
        # A terminal that nobody reads is full after some seconds, and then holds up who writes.
        with contextlib.suppress(OSError):  # no more to come
            while piece := os.read(master, 65536):
                shown += piece
        os.close(master)
        assert derive.wait(60.0) == 130
    assert shown.rindex(SHOW_CURSOR) > shown.rindex(HIDE_CURSOR)
    assert b'Traceback' not in shown


# What is written when it starts


def test_unknown_parameters_are_counted_in_one_line(arm, tmp_path, capfd):
    names = ''.join(f'    nonsense_{k:05}: {k}\n' for k in range(UNKNOWN))
    file = tmp_path / 'params.yaml'
    file.write_text(f'/**:\n  ros__parameters:\n{names}')
    arm('planar_2r', ['--params-file', str(file)])
    (told,) = (line for line in capfd.readouterr().err.splitlines() if 'nonsense_' in line)
    assert 'no effect: nonsense_00000,' in told
    assert f'and {UNKNOWN - 5} more' in told


def test_one_unknown_parameter_is_named(arm, capfd):
    arm('planar_2r', ['-p', 'nonsense:=1'])
    assert 'no effect: nonsense' in capfd.readouterr().err
