# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Environment variables with which ROS cannot start are named by every command that needs it.

All commands check them before they import ROS, which a process shows for one of them.
"""

import os
import subprocess
import sys

import pytest

pytest.importorskip('rclpy', reason='needs ROS')

from kinematics_service.__main__ import main

COMMANDS = {
    'node': (),
    'demo': ('demo', '--duration', '1'),
    'echo': ('echo', '--once', '--timeout', '1'),
    'reload': ('reload',),
    'set': ('set', 'scale.rise', '1'),
    'view': ('view', '--port', '0'),
}


@pytest.fixture(params=COMMANDS)
def command(request):
    """Return the arguments of a command that is installed."""
    if request.param == 'view':
        pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")
    return COMMANDS[request.param]


@pytest.fixture
def told(capfd, monkeypatch):
    """Return a function for exit code and errors of a command with environment variables."""

    def here(command, **variables):
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        code = main(list(command))
        return code, capfd.readouterr().err

    return here


@pytest.mark.parametrize(
    ('command', 'domain'),
    [('node', '-1'), ('demo', 'abc'), ('echo', '5x'), ('echo', '233'), ('view', '999')],
    indirect=['command'],
)
def test_a_domain_that_is_none_is_refused_in_a_sentence(told, command, domain):
    code, text = told(command, ROS_DOMAIN_ID=domain)
    (line,) = text.splitlines()
    assert code == 2
    assert line.startswith(f"kinematics_service: ROS_DOMAIN_ID is '{domain}': ")
    assert '0 to 232' in line


@pytest.mark.parametrize('domain', ['', '101', '232'])
def test_a_domain_of_dds_is_taken(told, domain):
    code, text = told(('echo', '--once', '--timeout', '0.1'), ROS_DOMAIN_ID=domain)
    assert code == 1
    assert 'gave up after 0.1 s' in text


def assert_middleware_is_refused(code, text):
    from rclpy import get_rmw_implementation_identifier

    (line,) = text.splitlines()
    assert code == 2
    assert line.startswith("kinematics_service: RMW_IMPLEMENTATION is 'rmw_none', ")
    assert get_rmw_implementation_identifier() in line


def test_a_middleware_that_is_not_installed_is_refused_with_those_that_are(told, command):
    assert_middleware_is_refused(*told(command, RMW_IMPLEMENTATION='rmw_none'))


def test_a_process_refuses_a_middleware_before_it_imports_ros():
    done = subprocess.run(
        [sys.executable, '-m', 'kinematics_service'],
        env={**os.environ, 'RMW_IMPLEMENTATION': 'rmw_none'},
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    assert_middleware_is_refused(done.returncode, done.stderr)


def test_the_middleware_in_use_may_be_named(told):
    from rclpy import get_rmw_implementation_identifier

    name = get_rmw_implementation_identifier()
    code, text = told(('echo', '--once', '--timeout', '0.1'), RMW_IMPLEMENTATION=name)
    assert (code, 'gave up' in text) == (1, True)


def test_what_needs_no_ros_takes_any_domain(told):
    assert told(('robots',), ROS_DOMAIN_ID='999') == (0, '')
