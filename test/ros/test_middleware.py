"""
The profiles for Fast DDS: read by it, found after an installation, and never before the user's.
"""

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from kinematics_service.ros.process.middleware import LOCAL, PROFILES, VARIABLE, take_profiles

# Makes a participant with a publisher; what the middleware has to say goes to standard error.
PUBLISHER = """
import rclpy
from kinematics_service.ros.process.runner import open_context
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
    assert environment == {VARIABLE: str(PROFILES)}


def test_the_users_stand(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    environment = {VARIABLE: '/etc/mine.xml'}
    assert not take_profiles(environment)
    assert environment == {VARIABLE: '/etc/mine.xml'}
    (tmp_path / LOCAL).write_text('<dds/>')
    environment = {}
    assert not take_profiles(environment)
    assert environment == {}


def test_the_time_is_written_as_the_comment_says():
    name = '{http://www.eprosima.com}'
    (duration,) = ElementTree.parse(PROFILES).iter(f'{name}nackSupressionDuration')
    assert [(part.tag, part.text) for part in duration] == [
        (f'{name}sec', '0'),
        (f'{name}nanosec', '20000000'),
    ]


def said(profiles, ros_domain):
    environment = {k: v for k, v in os.environ.items() if k != VARIABLE}
    if profiles is not None:
        environment[VARIABLE] = str(profiles)
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
    wrong.write_text(PROFILES.read_text().replace('nackSupressionDuration>', 'noSuchElement>'))
    assert said(None, ros_domain) == ''
    if os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') == 'rmw_fastrtps_cpp':
        assert 'noSuchElement' in said(wrong, ros_domain)
