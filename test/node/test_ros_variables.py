"""
Environment variables with which ROS cannot start are named by every command that needs it.

Those that ROS reads when it is imported are told by started processes, the others by this one.
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


def run(command, **variables):
    """Return exit code and standard error of a command with these environment variables."""
    done = subprocess.run(
        [sys.executable, '-m', 'kinematics_service', *command],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    return done.returncode, done.stderr


@pytest.fixture
def told(capfd, monkeypatch):
    """Return a function for what `run` returns, in this process."""

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
    assert told(command, ROS_DOMAIN_ID=domain) == (
        2,
        f"kinematics_service: ROS_DOMAIN_ID is '{domain}': it must be a whole number from 0 to "
        '232, or not be set\n',
    )


@pytest.mark.parametrize('domain', ['', '101', '232'])
def test_a_domain_of_dds_is_taken(told, domain):
    code, text = told(('echo', '--once', '--timeout', '0.1'), ROS_DOMAIN_ID=domain)
    assert code == 1
    assert 'gave up after 0.1 s without a message' in text


def test_a_middleware_that_is_not_installed_is_refused_with_those_that_are(command):
    from rclpy import get_rmw_implementation_identifier

    code, text = run(command, RMW_IMPLEMENTATION='rmw_none')
    assert code == 2
    begin = "kinematics_service: RMW_IMPLEMENTATION is 'rmw_none', which is not installed here: "
    assert text.startswith(f'{begin}it must be ')
    assert text.endswith(', or not be set\n')
    assert get_rmw_implementation_identifier() in text
    assert len(text.splitlines()) == 1


def test_the_middleware_in_use_may_be_named():
    from rclpy import get_rmw_implementation_identifier

    name = get_rmw_implementation_identifier()
    code, text = run(('echo', '--once', '--timeout', '0.1'), RMW_IMPLEMENTATION=name)
    assert (code, 'gave up' in text) == (1, True)


def test_what_needs_no_ros_takes_any_domain(told):
    assert told(('robots',), ROS_DOMAIN_ID='999') == (0, '')
