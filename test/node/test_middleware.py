# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The profiles for Fast DDS: read by it, found after an installation, and never before the user's.
"""

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from kinematics_service.node.process import middleware
from kinematics_service.node.process.middleware import (
    LOCAL,
    MEMORY_BY_PROFILE,
    OWN_PORTS,
    REQUESTS,
    SHARED_PORT,
    VARIABLES,
    fast_dds,
    ports_are_free,
    profiles,
    take_profiles,
)

# Makes a participant with a publisher; what the middleware has to say goes to standard error.
PUBLISHER = """
import rclpy
from kinematics_service.node.process.session import open_context
from rclpy.node import Node
from std_msgs.msg import Float64
context = open_context([])
Node('one', context=context).create_publisher(Float64, 'x', 10)
context.try_shutdown()
"""


@pytest.mark.parametrize(('are_free', 'requests'), [(True, OWN_PORTS), (False, SHARED_PORT)])
def test_they_are_taken_where_the_user_has_none(tmp_path, monkeypatch, are_free, requests):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(middleware, 'ports_are_free', lambda: are_free)
    environment = {}
    assert take_profiles(environment)
    file = {VARIABLES[fast_dds()]: str(profiles(fast_dds()))}
    memory = {MEMORY_BY_PROFILE: '1'} if fast_dds() == 2 else {}
    assert environment == {**file, **memory, REQUESTS: requests}


@pytest.mark.parametrize(('taken', 'are_free'), [(0, True), (299, True), (300, False)])
def test_ports_are_free_where_few_are_taken(tmp_path, taken, are_free):
    rows = [
        f' {k}: 0100007F:{port:04X} 00000000:0000 07'
        for k, port in enumerate(range(6900, 7000 + taken))
    ]
    table = tmp_path / 'udp'
    table.write_text('\n'.join(['  sl  local_address rem_address   st', *rows, '']))
    assert ports_are_free(table) == are_free
    assert not ports_are_free(tmp_path / 'none')


# Makes a participant with a service, and prints its ports for data of endpoints.
SERVICE = """
import rclpy
from kinematics_service.node.process.session import open_context
from rclpy.node import Node
from std_srvs.srv import Trigger
context = open_context([])
node = Node('one', context=context, start_parameter_services=False)
node.create_service(Trigger, 'x', lambda request, response: response)
for line in open('/proc/net/udp').read().splitlines()[1:]:
    print(int(line.split()[1].rsplit(':')[-1], 16))
context.try_shutdown()
"""


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='needs /proc')
@pytest.mark.skipif(
    os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') != 'rmw_fastrtps_cpp',
    reason='of Fast DDS',
)
def test_the_middleware_gives_them_such_ports(ros_domain, tmp_path):
    def ports(requests):
        environment = {k: v for k, v in os.environ.items() if k not in VARIABLES.values()}
        done = subprocess.run(
            [sys.executable, '-c', SERVICE],
            env={**environment, REQUESTS: requests},
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
            cwd=tmp_path,
        )
        assert done.stderr == ''
        return sum(7000 <= int(port) < 7400 for port in done.stdout.split())

    # Other tests have such ports, too, so it is said more than once.
    assert any(ports(OWN_PORTS) > ports(SHARED_PORT) for _ in range(10))


@pytest.mark.parametrize('variable', VARIABLES.values())
def test_those_named_by_the_user_stand(tmp_path, monkeypatch, variable):
    monkeypatch.chdir(tmp_path)
    environment = {variable: '/etc/mine.xml'}
    assert not take_profiles(environment)
    assert environment == {variable: '/etc/mine.xml'}


@pytest.mark.parametrize('local', LOCAL)
def test_those_in_the_working_directory_stand(tmp_path, monkeypatch, local):
    monkeypatch.chdir(tmp_path)
    (tmp_path / local).write_text('<dds/>')
    environment = {}
    assert not take_profiles(environment)
    assert environment == {}


# As each version of Fast DDS writes it.
DURATION = {2: 'nackSupressionDuration', 3: 'nack_supression_duration'}


@pytest.mark.parametrize('version', DURATION)
def test_the_time_is_written_as_the_comment_says(version):
    name = '{http://www.eprosima.com}'
    (duration,) = ElementTree.parse(profiles(version)).iter(f'{name}{DURATION[version]}')
    assert [(part.tag, part.text) for part in duration] == [
        (f'{name}sec', '0'),
        (f'{name}nanosec', '20000000'),
    ]


def said(file, ros_domain):
    environment = {**os.environ, VARIABLES[fast_dds()]: str(file)}
    done = subprocess.run(
        [sys.executable, '-c', PUBLISHER],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout + done.stderr


def test_the_middleware_reads_them_without_complaint(ros_domain, tmp_path):
    # That a wrong element is complained about shows that they are read; the right ones make no
    # line of the log above.
    wrong = tmp_path / 'wrong.xml'
    right = profiles(fast_dds()).read_text()
    wrong.write_text(right.replace(f'{DURATION[fast_dds()]}>', 'noSuchElement>'))
    if os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') == 'rmw_fastrtps_cpp':
        assert 'noSuchElement' in said(wrong, ros_domain)
