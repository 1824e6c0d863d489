"""
The profiles for Fast DDS: read by it, found after an installation, and never before the user's.
"""

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from kinematics_service.ros.process.middleware import (
    LOCAL,
    MEMORY_BY_PROFILE,
    VARIABLES,
    fast_dds,
    profiles,
    take_profiles,
)

# Makes a participant with a publisher; what the middleware has to say goes to standard error.
PUBLISHER = """
import rclpy
from kinematics_service.ros.process.session import open_context
from rclpy.node import Node
from std_msgs.msg import Float64
context = open_context([])
Node('one', context=context).create_publisher(Float64, 'x', 10)
context.try_shutdown()
"""


def test_they_are_taken_where_the_user_has_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    environment = {}
    assert take_profiles(environment)
    file = {VARIABLES[fast_dds()]: str(profiles(fast_dds()))}
    memory = {MEMORY_BY_PROFILE: '1'} if fast_dds() == 2 else {}
    assert environment == {**file, **memory}


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
    environment = {k: v for k, v in os.environ.items() if k not in VARIABLES.values()}
    if file is not None:
        environment[VARIABLES[fast_dds()]] = str(file)
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
    # That a wrong element would be complained about shows that they are read.
    wrong = tmp_path / 'wrong.xml'
    right = profiles(fast_dds()).read_text()
    wrong.write_text(right.replace(f'{DURATION[fast_dds()]}>', 'noSuchElement>'))
    assert said(None, ros_domain) == ''
    if os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') == 'rmw_fastrtps_cpp':
        assert 'noSuchElement' in said(wrong, ros_domain)
