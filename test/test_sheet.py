"""
The sheet says what the built messages say, for every arm, topic, stamp and setting.

"""

import itertools
import struct
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimator import Answer, Estimator
from kinematics_service.ros.messages import Report
from kinematics_service.ros.parameter_table import PARAMETERS
from kinematics_service.ros.settings import settings_from
from kinematics_service.ros.sheet import sheet_of, sources_of
from kinematics_service.ros.topics import TOPICS, sample_report
from kinematics_service.ros.wire_reader import JointStateReader
from kinematics_service.ros.wire_template import Template
from kinematics_service.singularities import singularity_of

SECOND = 1_000_000_000
# The first, the last, one before the epoch, and nanoseconds of more than a second.
STAMPS = ((0, 1), (2**31 - 1, SECOND - 1), (-5, 7), (2**31 - 1, 2**32 - 1), (-(2**31), 0))
ARMS = ['planar_2r', 'spherical_rrp', 'parallelogram_left', 'scara_hsr065', 'panda', 'puma560']
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


def templates_of(settings):
    # Each topic with its template, as the node learns it.
    sample = sample_report(settings)
    pairs = []
    for topic in TOPICS:
        numbers = topic.numbers and topic.numbers(sample)
        template = None
        if numbers is not None and topic.make is not None:

            def make(stamp, values, topic=topic):
                return topic.make(stamp, values, settings)

            template = Template.learn(make, len(numbers))
        pairs.append((topic, template))
    return pairs


def bits(value):
    if hasattr(value, 'get_fields_and_field_types'):
        return [bits(getattr(value, name)) for name in value.get_fields_and_field_types()]
    if isinstance(value, float):
        return struct.pack('=d', value)
    if hasattr(value, '__len__') and not isinstance(value, (str, bytes)):
        return [bits(item) for item in value]
    return value


def answers(settings, sheet, depth, joint_states):
    # What a node takes from serialized joint states, and the sheet after each.
    reader, estimator = JointStateReader(), Estimator(settings.robot, settings.estimator)
    for k, message in enumerate(joint_states):
        data = serialize_message(message)
        reader.read(data)
        (form,) = reader.forms(len(data))
        answer = estimator.take_bytes(form, data, k, depth, sheet.numbers)
        assert isinstance(answer, Answer), answer
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
def test_every_part_says_what_the_built_message_says(name, moving):
    robot = ks.load_robot(name)
    settings = replace(
        settings_of(robot),
        estimator=replace(settings_of(robot).estimator, velocity_source='message'),
    )
    topics = templates_of(settings)
    sheet = sheet_of(topics, settings, kernel.ALL_FRAMES)
    heard = 0
    for answer in answers(settings, sheet, kernel.ALL_FRAMES, joint_states(robot, moving)):
        report = Report(answer, singularity_of(answer.state), settings)
        for (topic, _), part in zip(topics, sheet.parts):
            if part is None:
                continue
            built = topic.build(report)
            if built is None:
                assert part.of_motion
                assert not moving
                continue
            said = deserialize_message(part.data.tobytes(), topic.type)
            assert bits(said) == bits(built), topic.name
            heard += 1
    assert heard >= len(STAMPS) * (5 + 2 * moving)


@pytest.mark.parametrize(('jacobian_frame', 'twist_frame', 'row_order'), FRAMES)
def test_what_is_computed_is_not_copied(jacobian_frame, twist_frame, row_order):
    robot = ks.load_robot('puma560')
    settings = settings_of(robot, jacobian_frame, twist_frame, row_order)
    topics = templates_of(settings)
    sheet = sheet_of(topics, settings, kernel.ALL_FRAMES)
    there = {topic.name: part is not None for (topic, _), part in zip(topics, sheet.parts)}
    assert there['~/pose']
    assert there['~/jacobian'] == (jacobian_frame == 'base')
    assert there['~/twist'] == there['~/velocity'] == (twist_frame == 'base')
    assert not there['~/link_frames']
    assert not there['~/markers']
    assert all(there[f'~/singularity/{name}'] for name in ('distance', 'manipulability'))
    message = next(joint_states(robot, True))
    (answer,) = answers(settings, sheet, kernel.ALL_FRAMES, [message])
    report = Report(answer, singularity_of(answer.state), settings)
    for (topic, _), part in zip(topics, sheet.parts):
        if part is not None:
            said = deserialize_message(part.data.tobytes(), topic.type)
            assert bits(said) == bits(topic.build(report)), topic.name


def test_an_arm_without_a_determinant_has_no_part_for_it():
    for name, square in (('panda', False), ('puma560', True)):
        settings = settings_of(ks.load_robot(name))
        topic = next(topic for topic in TOPICS if topic.name.endswith('determinant'))
        found = sources_of(topic, settings, kernel.JACOBIAN, True)
        assert (found is not None) == square


def test_a_refused_message_leaves_the_sheet_as_it_was():
    robot = ks.load_robot('craig_3r')
    settings = settings_of(robot)
    sheet = sheet_of(templates_of(settings), settings, kernel.ALL_FRAMES)
    message = JointState(name=robot.joint_names, position=[0.1, 0.2, 0.3])
    message.header.stamp.sec = 5
    (_,) = answers(settings, sheet, kernel.ALL_FRAMES, [message])
    before = sheet.numbers.tobytes()
    reader, estimator = JointStateReader(), Estimator(robot, settings.estimator)
    for stamp, q, taken in ((6, 0.1, True), (5, 0.4, False), (7, float('nan'), False)):
        message.header.stamp.sec, message.position[0] = stamp, q
        data = serialize_message(message)
        reader.read(data)
        (form,) = reader.forms(len(data))
        filled = sheet.numbers.tobytes()
        answer = estimator.take_bytes(form, data, stamp, kernel.ALL_FRAMES, sheet.numbers)
        assert isinstance(answer, Answer) == taken
        assert (sheet.numbers.tobytes() == filled) == (not taken)
    assert sheet.numbers.tobytes() != before


def test_nothing_heard_is_an_empty_sheet():
    settings = settings_of(ks.load_robot('craig_3r'))
    sheet = sheet_of([], settings, kernel.JACOBIAN)
    assert sheet.parts == ()
    assert sheet.numbers.size == 0
    message = JointState(name=settings.robot.joint_names, position=[0.1, 0.2, 0.3])
    message.header.stamp.sec = 5
    (answer,) = answers(settings, sheet, kernel.JACOBIAN, [message])
    np.testing.assert_array_equal(answer.state.q, [0.1, 0.2, 0.3])
