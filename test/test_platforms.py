# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The library and the commands without what only POSIX has, as on Windows, in a process each."""

import subprocess
import sys

import pytest

# Taken away before the package is imported. The names are those that Python on Windows lacks. But
# O_NONBLOCK stays, because Python 3.14 needs it to delete folders on POSIX.
LIKE_WINDOWS = """
import os, select, signal, sys, time
for name in ('fcntl', 'grp', 'pty', 'pwd', 'readline', 'resource', 'syslog', 'termios', 'tty'):
    sys.modules[name] = None
for module, names in (
    (signal, 'SIGALRM alarm pthread_kill pthread_sigmask setitimer sigwait siginterrupt'),
    (os, 'O_NOCTTY chown fchmod fork getuid posix_fallocate sched_getaffinity sysconf'),
    (time, 'pthread_getcpuclockid clock_gettime'),
):
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)


def select_sockets_only(*arguments):
    raise OSError('select of a pipe')


select.select = select_sockets_only
"""
COMMANDS = """
from kinematics_service.__main__ import main
for line in (
    'fk --robot ur5e --q 0.1,-1.2,1.4,-1.6,0.02,0.2',
    'ik --robot puma560 --xyz=-0.3,0.4,0.9 --quaternion 0,0,0,1',
    'check ur5e',
    'new mine --dof 3',
    'check mine.yaml',
    'export mine.yaml --urdf mine.urdf',
    'export mine.yaml --urdf mine.urdf',
    'derive --robot planar_2r',
):
    code = main(line.split())
    assert code == 0, (line, code)
"""
SIGNALS = """
from kinematics_service.stop_signals import interruptible, stop_signals
with interruptible():
    try:
        signal.raise_signal(signal.SIGINT)
        raise SystemExit('no interrupt')
    except KeyboardInterrupt:
        pass
with stop_signals() as stop:
    calls = []
    stop.then = lambda: calls.append(1)
    signal.raise_signal(signal.SIGTERM)
    assert stop.came and calls == [1]
    print('first', flush=True)
    signal.raise_signal(signal.SIGINT)
raise SystemExit('the second signal did not end the process')
"""


def run(program, folder):
    return subprocess.run(
        [sys.executable, '-c', LIKE_WINDOWS + program],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.slow
def test_the_commands_need_nothing_that_only_posix_has(tmp_path):
    done = run(COMMANDS, tmp_path)
    assert done.returncode == 0, done.stderr + done.stdout
    assert (tmp_path / 'mine.urdf').read_bytes().startswith(b'<?xml')


def test_signals_stop_a_process_without_alarms(tmp_path):
    done = run(SIGNALS, tmp_path)
    assert (done.returncode, done.stdout) == (0, 'first\n'), done.stderr
