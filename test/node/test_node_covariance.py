# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Topics with covariances: what they say, and where they are offered."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import (
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistStamped,
    TwistWithCovarianceStamped,
)
from rclpy.serialization import serialize_message
from ros_harness import BOTH_TRANSPORTS, nanoseconds
from std_srvs.srv import Trigger

import kinematics_service as ks

Q, QDOT = (0.3, -0.4, 1.2), (0.5, -0.2, 0.7)
OF_POSE, OF_TWIST = 'pose_with_covariance', 'twist_with_covariance'
SAID = """\
uncertainty:
  encoder_noise: [1e-3, 2e-3, 3e-3]
  velocity_noise: 0.01
  parameters: {lengths: 1e-3, alpha2: 2e-3}
  floor: {xyz: 1e-4}
"""


@pytest.fixture(scope='module')
def file_with(tmp_path_factory):
    def write(said):
        path = tmp_path_factory.mktemp('uncertain') / 'arm.yaml'
        text = ks.bundled_robots()['craig_3r'].read_text(encoding='utf-8')
        path.write_text(text + said)
        return str(path)

    return write


def offered(one):
    """Return the topics with covariances that the node publishes and describes."""
    found = dict(
        one.node.get_publisher_names_and_types_by_node('kinematics', one.node.get_namespace())
    )
    described = json.loads(one.call(Trigger, '/kinematics/describe', Trigger.Request()).message)[
        'publishes'
    ]
    names = {name for name in found if name.endswith('covariance')}
    assert names == {name for name in described if name.endswith('covariance')}
    return {name.removeprefix('/kinematics/') for name in names}


@BOTH_TRANSPORTS
@pytest.mark.parametrize('axes', ['base', 'tool'])
def test_messages_say_what_the_library_says(arm, file_with, axes):
    path = file_with(SAID)
    robot = ks.load_robot(path)
    one = arm(path, ros_args=('-p', f'twist_frame:={axes}'))
    heard = {
        name: one.hear(name, kind)
        for name, kind in (
            ('pose', PoseStamped),
            ('twist', TwistStamped),
            (OF_POSE, PoseWithCovarianceStamped),
            (OF_TWIST, TwistWithCovarianceStamped),
        )
    }
    one.send(Q, QDOT)
    one.spin_until(lambda: all(heard.values()), 'a message on each topic')
    pose, twist, of_pose, of_twist = (messages[0] for messages in heard.values())
    assert of_pose.header == pose.header
    assert of_twist.header == twist.header
    assert nanoseconds(of_pose.header.stamp) == one.stamp
    assert serialize_message(of_pose.pose.pose) == serialize_message(pose.pose)
    assert serialize_message(of_twist.twist.twist) == serialize_message(twist.twist)
    found = of_pose.pose.covariance.reshape(6, 6)
    assert np.array_equal(found, ks.pose_covariance(robot, Q))
    assert np.all(np.diag(found)[:3] > 1e-8)
    expected = ks.twist_covariance(robot, Q, QDOT, axes)
    assert np.array_equal(of_twist.twist.covariance.reshape(6, 6), expected)


@pytest.mark.parametrize(
    ('said', 'names'),
    [
        ('', set()),
        (SAID, {OF_POSE, OF_TWIST}),
        ('uncertainty: {backlash: 1e-3}\n', {OF_POSE}),
        ('uncertainty: {velocity_noise: 1e-3}\n', {OF_TWIST}),
    ],
)
def test_they_are_offered_where_the_file_has_their_numbers(arm, file_with, said, names):
    assert offered(arm(file_with(said))) == names


def test_a_twist_with_covariance_is_sent_where_velocities_are_known(arm, file_with):
    one = arm(file_with(SAID), ros_args=('-p', 'velocity_source:=message'))
    poses = one.hear(OF_POSE, PoseWithCovarianceStamped)
    twists = one.hear(OF_TWIST, TwistWithCovarianceStamped)
    one.send(Q)
    one.send(Q, QDOT)
    one.spin_until(lambda: len(poses) == 2 and twists, 'two poses and a twist')
    assert len(twists) == 1
    assert twists[0].header.stamp == poses[1].header.stamp


def test_another_robot_file_offers_what_it_has(arm, file_with):
    one = arm(file_with(''))
    silent = one.node.settings
    said = replace(silent, robot=ks.load_robot(file_with(SAID)))
    for settings, names in ((said, {OF_POSE, OF_TWIST}), (silent, set()), (said, None)):
        one.node._take_settings(settings)
        assert names is None or offered(one) == names
    poses = one.hear(OF_POSE, PoseWithCovarianceStamped)
    one.answer(Q, QDOT)
    one.spin_until(lambda: poses, 'a pose with covariance')
    found = poses[0].pose.covariance.reshape(6, 6)
    assert np.array_equal(found, ks.pose_covariance(said.robot, Q))
