# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The messages that the kernel fills say what the built ones say, for every arm and setting."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from arms import robot_of

pytest.importorskip('rclpy', reason='needs ROS 2')

from built_messages import bits, built
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput
from kinematics_service.estimation.joint_state_form import SerializedSample
from kinematics_service.node.messages.content import SILENT, Built
from kinematics_service.node.messages.joint_state_reader import JointStateReader
from kinematics_service.node.messages.message_layout import MessageLayout
from kinematics_service.node.messages.messages import StateReport
from kinematics_service.node.messages.output_topics import TOPICS
from kinematics_service.node.outputs import Channel, filled_by_the_kernel
from kinematics_service.node.parameters.settings import settings_from
from kinematics_service.node.parameters.table import PARAMETERS
from kinematics_service.robot.file.parts.description import Uncertainty
from kinematics_service.robot.robot import build_robot

SECOND = 1_000_000_000
# The first, the last, one before the epoch, and nanoseconds of more than a second.
STAMPS = ((0, 1), (2**31 - 1, SECOND - 1), (-5, 7), (2**31 - 1, 2**32 - 1), (-(2**31), 0))
ARMS = ['planar_2r', 'parallelogram_left', 'scara_hsr065', 'panda']
VELOCITIES = {'known': True, 'unknown': False}
FRAMES = list(
    itertools.product(('base', 'tool'), ('base', 'tool'), ('linear_first', 'angular_first'))
)


def settings_of(robot, jacobian_frame='base', twist_frame='base', row_order='linear_first'):
    values = {parameter.name: parameter.default for parameter in PARAMETERS}
    return replace(
        settings_from(values, robot),
        jacobian_frame=jacobian_frame,
        twist_frame=twist_frame,
        row_order=row_order,
    )


def uncertain(name):
    """Return an arm with noise in joints and velocities, and deviations of its table."""
    robot = ks.load_robot(name)
    many = tuple(1e-3 * (1.0 + k) for k in range(robot.dof))
    zeros = (0.0,) * robot.dof
    numbers = (('lengths', 1e-3), ('base.x', 2e-3), ('tool.rz', 1e-3))
    said = Uncertainty(many, zeros, zeros, many, numbers, (), 1e-4, 1e-3)
    return build_robot(replace(robot.description, uncertainty=said))


def channels_of(settings):
    # One for each topic, without a publisher.
    channels = []
    for topic in TOPICS:
        content = topic.content(settings) or SILENT
        there = not isinstance(content, Built)
        layout = MessageLayout(topic.blank(settings)) if there else None
        channels.append(
            Channel(
                *(None, None, None, topic, None),
                content=content,
                layout=layout,
                as_bytes=there and layout.is_official(),
            )
        )
    return channels


def answers(settings, messages, depth, joint_states):
    # What a node takes from serialized joint states, the messages filled with each.
    reader, estimator = JointStateReader(), Estimator(settings.robot, settings.estimator)
    for k, message in enumerate(joint_states):
        data = serialize_message(message)
        reader.read(data)
        (form,) = reader.forms(len(data))
        answer = estimator.take(SerializedSample(form, data, k), depth, messages)
        assert isinstance(answer, EstimatorOutput), answer
        yield answer


def joint_states(robot, moving, seed=5):
    rng = np.random.default_rng(seed)
    poses = [np.zeros(robot.dof), *rng.uniform(-2.0, 2.0, (4, robot.dof))]
    for (seconds, nanoseconds), q in zip(sorted(STAMPS), poses):
        message = JointState(name=robot.joint_names, position=q)
        if moving:
            message.velocity = rng.normal(size=robot.dof)
        message.header.stamp.sec, message.header.stamp.nanosec = seconds, nanoseconds
        yield message


@pytest.mark.parametrize('moving', VELOCITIES.values(), ids=VELOCITIES)
@pytest.mark.parametrize('name', ARMS)
def test_every_message_says_what_the_built_message_says(name, moving):
    robot = uncertain(name)
    settings = replace(
        settings_of(robot),
        estimator=replace(settings_of(robot).estimator, velocity_source='message'),
    )
    channels = channels_of(settings)
    messages, filled = filled_by_the_kernel(channels, settings, kernel.ALL_FRAMES)
    heard = 0
    for answer in answers(settings, messages, kernel.ALL_FRAMES, joint_states(robot, moving)):
        report = StateReport(answer, settings)
        for channel, message in zip(channels, filled):
            if message is None:
                continue
            topic = channel.topic
            expected = built(topic, report)
            if expected is None:
                assert channel.content.of_motion
                assert not moving
                continue
            said = deserialize_message(message.tobytes(), topic.type)
            assert bits(said) == bits(expected), topic.name
            heard += 1
    assert heard >= len(STAMPS) * (6 + 3 * moving)


def test_covariances_are_computed_where_somebody_hears_them_alone():
    settings = settings_of(uncertain('puma560'))
    channels = {channel.topic.name: channel for channel in channels_of(settings)}
    pose, twist = '~/pose_with_covariance', '~/twist_with_covariance'
    for heard, of_pose, of_twist in (
        (['~/pose', '~/twist'], False, False),
        ([pose], True, False),
        ([twist], False, True),
        ([pose, '~/pose', twist], True, True),
    ):
        messages, _ = filled_by_the_kernel(
            [channels[name] for name in heard], settings, kernel.ALL_FRAMES
        )
        assert (messages.of_pose, messages.of_twist) == (of_pose, of_twist)
        assert (messages.errors is not None) == (of_pose or of_twist)


def test_covariances_of_another_arm_or_without_frames_are_refused():
    settings = settings_of(uncertain('puma560'))
    (channel,) = (
        one for one in channels_of(settings) if one.topic.name == '~/pose_with_covariance'
    )
    messages, _ = filled_by_the_kernel([channel], settings, kernel.ALL_FRAMES)
    elsewhere = settings_of(ks.load_robot('ur5e'))
    for other, depth in ((settings, kernel.JACOBIAN), (elsewhere, kernel.ALL_FRAMES)):
        states = joint_states(other.robot, True)
        with pytest.raises(TypeError, match='another arm, or need the frames'):
            next(answers(other, messages, depth, states))


@pytest.mark.parametrize(('jacobian_frame', 'twist_frame', 'row_order'), FRAMES)
def test_what_is_computed_is_not_copied(jacobian_frame, twist_frame, row_order):
    robot = uncertain('puma560')
    settings = settings_of(robot, jacobian_frame, twist_frame, row_order)
    channels = channels_of(settings)
    messages, filled = filled_by_the_kernel(channels, settings, kernel.ALL_FRAMES)
    there = {channel.topic.name: message is not None for channel, message in zip(channels, filled)}
    assert there['~/pose']
    assert there['~/jacobian'] == (jacobian_frame == 'base')
    assert there['~/twist'] == there['~/velocity'] == (twist_frame == 'base')
    assert there['~/pose_with_covariance']
    assert there['~/twist_with_covariance'] == (twist_frame == 'base')
    assert not there['~/link_frames']
    assert not there['~/markers']
    assert all(there[f'~/singularity/{name}'] for name in ('distance', 'manipulability'))
    message = next(joint_states(robot, True))
    (answer,) = answers(settings, messages, kernel.ALL_FRAMES, [message])
    report = StateReport(answer, settings)
    for channel, message in zip(channels, filled):
        if message is not None:
            said = deserialize_message(message.tobytes(), channel.topic.type)
            assert bits(said) == bits(built(channel.topic, report)), channel.topic.name


def test_an_arm_without_a_determinant_has_no_message_of_it():
    for name, square in (('panda', False), ('puma560', True)):
        settings = settings_of(robot_of(name))
        topic = next(topic for topic in TOPICS if topic.name.endswith('determinant'))
        assert (topic.content(settings) is not SILENT) == square


def test_a_refused_message_leaves_the_answers_as_they_were():
    robot = ks.load_robot('craig_3r')
    settings = settings_of(robot)
    messages, _ = filled_by_the_kernel(channels_of(settings), settings, kernel.ALL_FRAMES)
    data_of = messages.table.data.tobytes
    message = JointState(name=robot.joint_names, position=[0.1, 0.2, 0.3])
    message.header.stamp.sec = 5
    (_,) = answers(settings, messages, kernel.ALL_FRAMES, [message])
    before = data_of()
    reader, estimator = JointStateReader(), Estimator(robot, settings.estimator)
    for stamp, q, taken in ((6, 0.1, True), (5, 0.4, False), (7, float('nan'), False)):
        message.header.stamp.sec, message.position[0] = stamp, q
        data = serialize_message(message)
        reader.read(data)
        (form,) = reader.forms(len(data))
        filled = data_of()
        answer = estimator.take(SerializedSample(form, data, stamp), kernel.ALL_FRAMES, messages)
        assert isinstance(answer, EstimatorOutput) == taken
        assert (data_of() == filled) == (not taken)
    assert data_of() != before


def test_where_nobody_listens_no_message_is_filled():
    settings = settings_of(ks.load_robot('craig_3r'))
    assert filled_by_the_kernel([], settings, kernel.JACOBIAN) == (None, ())
    message = JointState(name=settings.robot.joint_names, position=[0.1, 0.2, 0.3])
    message.header.stamp.sec = 5
    (answer,) = answers(settings, None, kernel.JACOBIAN, [message])
    np.testing.assert_array_equal(answer.state.q, [0.1, 0.2, 0.3])


ONE = np.zeros(1, np.int64)


@pytest.mark.parametrize('place', [-1, 9, 2**40])
def test_places_outside_of_the_messages_are_refused(place):
    data = np.zeros(16, np.uint8)
    with pytest.raises(ValueError, match='outside of the messages'):
        kernel.OutgoingMessages(kernel.OutgoingTable(data, ONE[:0], ONE + place, ONE))
    with pytest.raises(ValueError, match='outside of the messages'):
        kernel.OutgoingMessages(kernel.OutgoingTable(data, ONE + place, ONE[:0], ONE[:0]))


def test_numbers_beyond_a_state_are_refused():
    data = np.zeros(16, np.uint8)
    with pytest.raises(ValueError, match='before the row'):
        kernel.OutgoingMessages(kernel.OutgoingTable(data, ONE, ONE, ONE - 1))
    messages = kernel.OutgoingMessages(kernel.OutgoingTable(data, ONE[:0], ONE, ONE + 3))
    kernel.fill_messages(messages, 0, np.arange(2.0), np.arange(5.0, 7.0))
    assert data[:8].view(np.float64) == 6.0
    with pytest.raises(TypeError, match='fewer numbers'):
        kernel.fill_messages(messages, 0, np.arange(2.0), np.arange(1.0))
    with pytest.raises(TypeError):
        kernel.fill_messages(None, 0, np.arange(2.0), np.arange(5.0))
