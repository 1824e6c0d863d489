# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes: types, numbers, frames, stamps and order."""

import itertools
import json
import math
import sys
import time
from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import (
    AccelStamped,
    PoseArray,
    PoseStamped,
    TwistStamped,
    VelocityStamped,
    WrenchStamped,
)
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from ros_harness import (
    BEST_EFFORT,
    BOTH_TRANSPORTS,
    LATCHED,
    SECOND,
    STEP,
    Peer,
    change,
    level_of,
    nanoseconds,
    values_of,
)
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, Int8
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation import alarm
from kinematics_service.node.messages.content import Built
from kinematics_service.node.messages.message_layout import MessageLayout

# Sums of a few dozen products in double precision.
ROUND_OFF = 1e-12
Q, QDOT = (0.3, -0.4, 1.2), (0.5, -0.2, 0.7)
OK, WARN, ERROR, STALE = range(4)
SCALARS = (
    *('determinant', 'manipulability', 'condition_number', 'smallest_singular_value'),
    'distance',
)

PER_MESSAGE = {
    'pose': PoseStamped,
    'jacobian': Float64MultiArray,
    'jacobian/stamp': Time,
    'twist': TwistStamped,
    'velocity': VelocityStamped,
    'acceleration': AccelStamped,
    'wrench': WrenchStamped,
    'singularity/determinant': Float64,
    'singularity/manipulability': Float64,
    'singularity/condition_number': Float64,
    'singularity/smallest_singular_value': Float64,
    'singularity/distance': Float64,
    'singularity/clearance': Float64,
    'link_frames': PoseArray,
    'markers': MarkerArray,
}


@pytest.fixture(scope='module', autouse=True)
def checked_fields():
    """Have each field of a message checked: one of another type arrives as garbage otherwise."""
    with pytest.MonkeyPatch.context() as patch:
        for module in list(sys.modules.values()):
            if 'ros_python_check_fields' in vars(module):
                patch.setattr(module, 'ros_python_check_fields', '1')
        yield


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def matrix(pose):
    """Return a Pose as (4, 4), from its quaternion by the textbook formula."""
    q = pose.orientation
    x, y, z, w = q.x, q.y, q.z, q.w
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = xyz(pose.position)
    return T


def six(twist):
    return np.concatenate([xyz(twist.linear), xyz(twist.angular)])


def heard_once(one, name, kind, q=Q, qdot=QDOT):
    """Send one pose and return what a topic says about it."""
    messages = one.hear(name, kind)
    one.send(q, qdot)
    one.spin_until(lambda: messages, f'message on {name}')
    return messages[0]


# Types and names


def test_topics_and_services_are_those_of_the_contract(arm):
    one = arm()
    topics = dict(
        one.node.get_publisher_names_and_types_by_node('kinematics', one.node.get_namespace())
    )
    expected = {f'/kinematics/{name}': kind for name, kind in PER_MESSAGE.items()}
    expected['/kinematics/singularity/warning'] = DiagnosticStatus
    expected['/diagnostics'] = DiagnosticArray
    expected['/kinematics/ik/joint_states'] = JointState
    expected['/kinematics/ik/solutions'] = Float64MultiArray
    expected['/kinematics/ik/joint_velocity'] = JointState
    expected['/kinematics/ik/status'] = DiagnosticStatus
    expected['/kinematics/scale'] = Float64
    expected['/kinematics/scale_reason'] = DiagnosticStatus
    expected['/kinematics/servo_status'] = Int8
    for name, kind in expected.items():
        package, _, _ = kind.__module__.partition('.')
        assert topics.pop(name) == [f'{package}/msg/{kind.__name__}']
    assert set(topics) == {'/parameter_events', '/rosout'}
    listens = dict(one.node.get_subscriber_names_and_types_by_node('kinematics', '/'))
    assert listens['/joint_states'] == ['sensor_msgs/msg/JointState']
    assert listens['/kinematics/target_pose'] == ['geometry_msgs/msg/PoseStamped']
    assert listens['/kinematics/target_twist'] == ['geometry_msgs/msg/TwistStamped']
    assert listens['/kinematics/command'] == ['sensor_msgs/msg/JointState']
    services = dict(one.node.get_service_names_and_types_by_node('kinematics', '/'))
    for name in ('describe', 'reload', 'wrench/zero'):
        assert services[f'/kinematics/{name}'] == ['std_srvs/srv/Trigger']
    told = json.loads(one.call(Trigger, '/kinematics/describe', Trigger.Request()).message)
    published = dict(one.node.get_publisher_names_and_types_by_node('kinematics', '/'))
    assert set(told['publishes']) == set(published) - {'/parameter_events', '/rosout'}


@BOTH_TRANSPORTS
def test_the_stamp_of_each_jacobian_is_that_of_its_joint_state(arm):
    one = arm('craig_3r')
    heard = {name: one.hear(name, PER_MESSAGE[name]) for name in ('jacobian', 'jacobian/stamp')}
    sent = [one.send((0.1 * k, -0.4, 1.2)) for k in range(8)]
    one.spin_until(lambda: all(len(some) == 8 for some in heard.values()), 'answers')
    assert [nanoseconds(stamp) for stamp in heard['jacobian/stamp']] == sent


# Numbers


def assert_closed_form(position):
    """Compare a position of the tool of craig_3r at Q with trigonometry."""
    q1, q2, q3 = Q
    r = 0.12 + 0.4 * math.cos(q2) + 0.3 * math.cos(q2 + q3)
    tip = [
        math.cos(q1) * r,
        math.sin(q1) * r,
        -0.4 * math.sin(q2) - 0.3 * math.sin(q2 + q3),
    ]
    np.testing.assert_allclose(position, tip, atol=ROUND_OFF)


def test_twist_determinant_and_distance_of_planar_2r_are_closed_forms(arm):
    q1, q2, v1, v2 = 0.4, 0.9, 0.3, -0.8
    one = arm('planar_2r')
    determinants = one.hear('singularity/determinant', Float64)
    distances = one.hear('singularity/distance', Float64)
    message = heard_once(one, 'twist', TwistStamped, (q1, q2), (v1, v2))
    a, b = v1, v1 + v2
    expected = [
        -a * math.sin(q1) - b * math.sin(q1 + q2),
        a * math.cos(q1) + b * math.cos(q1 + q2),
        *(0, 0, 0),
        b,
    ]
    np.testing.assert_allclose(six(message.twist), expected, atol=ROUND_OFF)
    one.send((0.4, 0.01))
    one.spin_until(lambda: len(determinants) == len(distances) == 2, 'scalars')
    assert determinants[0].data == pytest.approx(math.sin(0.9), abs=ROUND_OFF)
    assert distances[1].data == pytest.approx(0.01, rel=1e-3)


@pytest.mark.parametrize(
    ('name', 'transport'),
    [
        *(('craig_3r', 'bytes'), ('rrp_elementary', 'bytes'), ('scara_hsr065', 'messages')),
    ],
)
def test_pose_jacobian_twist_and_frames_are_the_librarys(arm, name):
    robot = ks.load_robot(name)
    random = np.random.default_rng(5)
    q, qdot = random.uniform(-1, 1, robot.dof), random.uniform(-1, 1, robot.dof)
    one = arm(name)
    jacobians = one.hear('jacobian', Float64MultiArray)
    twists = one.hear('twist', TwistStamped)
    frames = one.hear('link_frames', PoseArray)
    pose = one.answer(q.tolist(), qdot.tolist())
    one.spin_until(lambda: jacobians and twists and frames, 'all topics')
    np.testing.assert_allclose(matrix(pose.pose), ks.forward_kinematics(robot, q), atol=ROUND_OFF)
    np.testing.assert_array_equal(
        np.array(jacobians[0].data).reshape(6, -1), ks.jacobian(robot, q)
    )
    np.testing.assert_allclose(
        six(twists[0].twist), ks.twist(robot, q, qdot), rtol=ROUND_OFF, atol=ROUND_OFF
    )
    assert len(frames[0].poses) == robot.rows + 1
    np.testing.assert_allclose(
        [matrix(p) for p in frames[0].poses], ks.link_frames(robot, q), atol=ROUND_OFF
    )


def test_twist_is_the_derivative_of_the_pose(arm):
    one = arm('craig_3r')
    twists = one.hear('twist', TwistStamped)
    positions = []
    for k in range(5):
        t = k * STEP * 1e-9
        q = [angle + t * rate for angle, rate in zip(Q, QDOT)]
        positions.append(xyz(one.answer(q, QDOT).pose.position))
    one.spin_until(lambda: len(twists) == 5, 'twists')
    assert_closed_form(positions[0])
    central = (positions[3] - positions[1]) / (2 * STEP * 1e-9)
    np.testing.assert_allclose(xyz(twists[2].twist.linear), central, atol=1e-4)


@BOTH_TRANSPORTS
def test_scalars_are_the_librarys(arm):
    one, expected = arm('craig_3r'), ks.singularity(ks.load_robot('craig_3r'), Q)
    heard = {name: one.hear(f'singularity/{name}', Float64) for name in SCALARS}
    one.send(Q, QDOT)
    one.spin_until(lambda: all(heard.values()), 'scalars')
    for name, messages in heard.items():
        assert messages[0].data == pytest.approx(getattr(expected, name), rel=1e-12), name


def test_there_is_no_determinant_where_the_jacobian_is_not_square(arm):
    one = arm('kuka_iiwa14')
    determinants = one.hear('singularity/determinant', Float64)
    distances = one.hear('singularity/distance', Float64)
    for k in range(3):
        one.answer([0.1 * k + 0.1 * j for j in range(7)])
    one.spin_until(lambda: len(distances) == 3, 'distances')
    assert determinants == []


# Frames, stamps, order


@BOTH_TRANSPORTS
def test_every_stamped_topic_carries_exactly_the_stamp_of_its_message(arm):
    one = arm()
    stamped = [
        one.hear(name, PER_MESSAGE[name]) for name in ('pose', 'twist', 'velocity', 'link_frames')
    ]
    sent = [one.send(Q, QDOT, stamp) for stamp in (1, 999_999_999, 1_700_000_000_123_456_789)]
    one.spin_until(lambda: all(len(messages) == 3 for messages in stamped), 'answers')
    for messages in stamped:
        assert [nanoseconds(message.header.stamp) for message in messages] == sent


def test_frames_are_named_by_the_robot_file(arm):
    one = arm('ur3e')
    frames = one.hear('link_frames', PoseArray)
    twists = one.hear('twist', TwistStamped)
    velocities = one.hear('velocity', VelocityStamped)
    q = [0.1, -1.0, 1.0, 0.2, 0.3, 0.4]
    assert one.answer(q, q).header.frame_id == 'base'
    one.spin_until(lambda: frames and twists and velocities, 'answers')
    assert frames[0].header.frame_id == 'base'
    assert twists[0].header.frame_id == 'base'
    assert velocities[0].header.frame_id == 'base'
    assert velocities[0].reference_frame_id == 'base'
    assert velocities[0].body_frame_id == 'tool0'


@BOTH_TRANSPORTS
def test_twist_and_velocity_are_the_same_in_the_axes_they_name(arm):
    one = arm('craig_3r')
    twists = one.hear('twist', TwistStamped)
    velocities = one.hear('velocity', VelocityStamped)
    for count, (axes, frame) in enumerate((('base', 'base_link'), ('tool', 'tool0')), 1):
        assert change(one, twist_frame=axes).successful
        one.send(Q, QDOT)
        one.spin_until(lambda n=count: len(twists) == len(velocities) == n, 'both')
        expected = ks.twist(ks.load_robot('craig_3r'), Q, QDOT, axes=axes)
        for message, twist in (
            (twists[-1], twists[-1].twist),
            (velocities[-1], velocities[-1].velocity),
        ):
            assert message.header.frame_id == frame
            np.testing.assert_allclose(six(twist), expected, atol=ROUND_OFF)
        assert velocities[-1].body_frame_id == 'tool0'
        assert velocities[-1].reference_frame_id == 'base_link'


@BOTH_TRANSPORTS
def test_the_layout_of_the_jacobian_says_what_its_numbers_are(arm):
    one, q = arm('puma560'), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    messages = one.hear('jacobian', Float64MultiArray)
    labels = {'linear_first': 'vx,vy,vz,wx,wy,wz', 'angular_first': 'wx,wy,wz,vx,vy,vz'}
    place = {label: i for i, label in enumerate(['vx', 'vy', 'vz', 'wx', 'wy', 'wz'])}
    for order, axes in itertools.product(labels, ('base', 'tool')):
        assert change(one, row_order=order, jacobian_frame=axes).successful
        del messages[:]
        one.send(q)
        one.spin_until(lambda: messages, 'Jacobian')
        (message,) = messages
        rows, columns = message.layout.dim
        assert (rows.label, rows.size, rows.stride) == (labels[order], 6, 36)
        assert (columns.label, columns.size, columns.stride) == (','.join(one.names), 6, 6)
        assert message.layout.data_offset == 0
        assert len(message.data) == 36
        J = ks.jacobian(ks.load_robot('puma560'), q, axes=axes)
        for i, label in enumerate(rows.label.split(',')):
            for j in range(columns.size):
                number = message.data[message.layout.data_offset + columns.stride * i + j]
                assert number == pytest.approx(J[place[label], j], abs=ROUND_OFF)


@BOTH_TRANSPORTS
def test_the_quaternion_is_of_unit_length_and_its_sign_continuous_over_a_full_turn(arm):
    one = arm('craig_3r', executor=EventsExecutor)
    turns = [one.answer((2 * math.pi * k / 50, 0.2, 0.3)).pose.orientation for k in range(51)]
    quaternions = np.array([[q.x, q.y, q.z, q.w] for q in turns])
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=ROUND_OFF)
    assert np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.99)
    np.testing.assert_allclose(quaternions[-1], -quaternions[0], atol=ROUND_OFF)


@BOTH_TRANSPORTS
def test_pose_goes_out_before_the_jacobian_and_message_k_belongs_to_pose_k(arm):
    one = arm()
    poses, jacobians = [], []
    for name, kind, heard in (
        ('pose', PoseStamped, poses),
        ('jacobian', Float64MultiArray, jacobians),
    ):
        subscription = one.peer.create_subscription(
            kind, one.topic(name), lambda m, info, heard=heard: heard.append((m, info)), 100
        )
        one.spin_until(subscription.get_publisher_count, name)
    for k in range(8):
        one.send((0.1 * k, 0.2, 0.3))
    one.spin_until(lambda: len(poses) == len(jacobians) == 8, 'answers')
    robot = ks.load_robot('craig_3r')
    for k, ((_, earlier), (jacobian, later)) in enumerate(zip(poses, jacobians)):
        assert earlier['source_timestamp'] < later['source_timestamp']
        np.testing.assert_array_equal(
            np.array(jacobian.data).reshape(6, 3), ks.jacobian(robot, (0.1 * k, 0.2, 0.3))
        )
        if k:
            assert jacobians[k - 1][1]['source_timestamp'] < earlier['source_timestamp']


class Counting(NamedTuple):
    """Content of a topic that notes when its numbers are asked for."""

    content: Any
    name: str
    asked: list[str]

    depth = kernel.ALL_FRAMES
    quantities = ()

    def of(self, report):
        self.asked.append(self.name)
        return self.content.of(report)


@BOTH_TRANSPORTS
def test_a_topic_nobody_listens_to_is_not_built(arm):
    one = arm()
    asked = []
    outputs = one.node._outputs
    outputs.channels = [
        c._replace(content=Counting(c.content, c.topic.name, asked)) for c in outputs.channels
    ]
    for _ in range(3):
        one.answer(Q)
    assert asked == ['~/pose'] * 3


@BOTH_TRANSPORTS
def test_a_layout_that_is_not_the_official_one_is_not_used_and_said_once(
    arm, monkeypatch, capfd, transport
):
    official = MessageLayout.is_official
    # That of the pose alone has seven numbers.
    monkeypatch.setattr(
        MessageLayout, 'is_official', lambda self: self.count != 7 and official(self)
    )
    one = arm()
    others = one.hear('singularity/manipulability', Float64)
    pose = one.answer(Q).pose.position
    expected = ks.forward_kinematics(one.robot, Q)[:3, 3]
    np.testing.assert_array_equal([pose.x, pose.y, pose.z], expected)
    one.node.set_parameters([Parameter('twist_frame', value='tool')])
    one.answer(Q)
    one.spin_until(lambda: bool(others), 'another topic')
    said = capfd.readouterr().err.count('/kinematics/pose: the serializer')
    assert said == (transport == 'bytes')
    as_bytes = {c.topic.name: c.as_bytes for c in one.node._outputs.channels}
    assert not as_bytes['~/pose']
    assert as_bytes['~/singularity/manipulability'] == (transport == 'bytes')


def test_each_layout_of_a_type_is_checked(arm, monkeypatch):
    # Of one type: the Jacobian with 42 numbers, the self-motion with 7.
    monkeypatch.setattr(MessageLayout, 'is_official', lambda self: self.count != 7)
    as_bytes = {c.topic.name: c.as_bytes for c in arm('panda').node._outputs.channels}
    assert as_bytes['~/jacobian']
    assert not as_bytes['~/null_space']


def test_topics_without_a_layout_are_serialized_one_by_one(arm):
    channels = arm().node._outputs.channels
    without = [one for one in channels if isinstance(one.content, Built)]
    assert without
    assert {(one.layout, one.as_bytes) for one in without} == {(None, False)}


def test_a_late_or_best_effort_listener_is_served_from_then_on(arm):
    one = arm()
    one.answer(Q)
    jacobians = one.hear('jacobian', Float64MultiArray)
    frames = one.hear('link_frames', PoseArray, BEST_EFFORT)
    one.answer(Q)
    one.spin_until(lambda: jacobians and frames, 'answers')
    assert len(jacobians) == len(frames) == 1


# Service and diagnostics


def test_describe_says_in_json_what_a_program_needs(arm):
    one = arm('ur3e', ['-p', 'joint_prefix:=left_', '-p', 'row_order:=angular_first'])
    response = one.call(Trigger, '/kinematics/describe', Trigger.Request())
    assert response.success
    told = json.loads(response.message, parse_constant=lambda name: pytest.fail(name))
    assert told['robot'] == 'ur3e'
    assert told['convention'] == 'standard'
    assert [joint['name'] for joint in told['joints']] == one.names
    assert told['joints'][0]['lower'] == pytest.approx(-2 * math.pi)
    assert told['joints'][0]['velocity'] == pytest.approx(math.pi)
    assert told['joints'][5]['lower'] is None
    assert told['frames'] == {'base': 'base', 'tool': 'tool0'}
    assert told['jacobian']['rows'] == ['wx', 'wy', 'wz', 'vx', 'vy', 'vz']
    assert told['jacobian']['columns'] == one.names
    assert told['singularity']['task'] == ['x', 'y', 'z', 'rx', 'ry', 'rz']
    assert told['subscribes'] == '/joint_states'
    assert '/kinematics/pose' in told['publishes']


def test_diagnostics_come_once_a_second_with_all_their_keys(arm):
    one = arm()
    arrays = one.listen('/diagnostics', DiagnosticArray)
    one.answer(Q, QDOT)
    one.spin_until(lambda: len(arrays) >= 2, 'diagnostics')
    assert SECOND in [timer.timer_period_ns for timer in one.node.timers]
    status = arrays[0].status[0]
    assert status.name == 'kinematics: input'
    assert status.hardware_id == 'craig_3r'
    assert level_of(status) == OK
    values = values_of(status)
    for key, value in {
        'robot': 'craig_3r',
        'topic': '/joint_states',
        'publishers': '1',
        'publisher names': '/peer',
        'missing joints': '',
        'joints beyond their limits': '',
        'joints that publishers disagree about': '',
        'velocity source': 'message',
        'accepted': '1',
        'ignored: none of our joints': '0',
        'ignored: no position': '0',
        'dropped: stamp not newer': '0',
        'rejected': '0',
        'rejected: position not finite': '0',
        'not stamped': '0',
        'resets': '0',
        'left out: came faster than answered': '0',
        'internal errors': '0',
    }.items():
        assert values[key] == value, key
    assert values['input rate'].endswith(' Hz')
    assert float(values['age'].removesuffix(' s')) >= 0.0
    assert 0.0 < float(values['processing time, mean'].removesuffix(' us')) < 1e6


def test_the_log_says_once_where_joint_states_are_if_none_comes(arm, capfd):
    one = arm(ros_args=['-r', 'joint_states:=/wrong/joint_states'])
    one.speaker('/robot/joint_states', listeners=0)
    one.spin_until(
        lambda: one.peer.count_publishers('/robot/joint_states') == 1, 'publisher elsewhere'
    )
    written = ''

    def said():
        nonlocal written
        written += capfd.readouterr().err
        return 'no joint state has come' in written

    one.node._health.say()
    assert not said()
    one.node._health._answered -= 5.0
    one.node._health._published_at -= 2.1  # it was not turned: nothing could come
    one.node._health.say()
    assert not said()
    one.node._health._answered -= 5.0
    one.spin_until(said, 'line of the log')
    wanted = (
        'no joint state has come on /wrong/joint_states: it has no publisher; joint states are '
        'published on /robot/joint_states: try -r joint_states:=/robot/joint_states'
    )
    assert wanted in written  # docs/how_to/troubleshooting.md shows this line
    arrays = one.listen('/diagnostics', DiagnosticArray)
    one.spin_until(lambda: len(arrays) >= 2, 'diagnostics')
    said()
    assert written.count('no joint state has come') == 1


def test_diagnostics_say_who_is_missing_before_the_first_message(arm):
    one = arm()
    status = one.diagnose()
    assert level_of(status) == ERROR
    assert values_of(status)['missing joints'] == 'q1, q2, q3'
    assert values_of(status)['age'] == 'never heard'
    assert 'no publisher' in status.message


# Warning


def warnings_of(one):
    return one.hear('singularity/warning', DiagnosticStatus, LATCHED)


def test_the_first_message_is_said_with_the_determinant(arm):
    one = arm('planar_2r')
    warnings = warnings_of(one)
    one.answer((0.4, 0.9))
    one.spin_until(lambda: warnings, 'warning')
    assert level_of(warnings[0]) == OK
    assert f'det(J) = {math.sin(0.9):.3g}' in warnings[0].message
    assert warnings[0].name == 'kinematics: singularity'
    values = values_of(warnings[0])
    assert float(values['determinant']) == pytest.approx(math.sin(0.9), rel=1e-8)
    assert values['measure'] == 'distance'


def test_every_change_of_level_is_said_with_hysteresis(arm):
    one = arm('planar_2r')
    warnings = warnings_of(one)
    for elbow in (0.5, 0.09, 0.02, 0.04, 0.05, 0.14, 0.16):
        one.answer((0.4, elbow))
    one.spin_until(lambda: len(warnings) >= 5, 'warnings')
    assert [level_of(warning) for warning in warnings] == [OK, WARN, ERROR, WARN, OK]


def test_noise_at_the_threshold_gives_one_warning(arm):
    one = arm('planar_2r', executor=EventsExecutor)
    warnings = warnings_of(one)
    one.answer((0.4, 0.3))
    for noise in np.random.default_rng(3).normal(0.0, 0.003, 200):
        one.answer((0.4, 0.1 + noise))
    levels = [level_of(warning) for warning in warnings]
    assert levels[:2] == [OK, WARN]
    assert set(levels[1:]) == {WARN}  # repeated once a second, never left


def test_a_bad_pose_is_said_again_once_a_second(arm):
    one = arm('planar_2r')
    warnings = warnings_of(one)
    begin, answers = time.monotonic(), 0

    def three():
        nonlocal answers
        one.answer((0.4, 0.01))
        answers += 1
        return len(warnings) >= 3

    one.spin_until(three, 'repeated warning')
    # However busy the machine is: two repetitions take two seconds, and no message is one.
    assert time.monotonic() - begin >= 2.0
    assert answers > 3


def test_a_lost_direction_that_turned_is_said_again(arm, monkeypatch):
    monkeypatch.setattr(alarm, 'REPEAT_PERIOD', 3600 * SECOND)
    one = arm('planar_2r')
    warnings = warnings_of(one)
    one.answer((0.0, 0.01))
    one.spin_until(lambda: warnings, 'warning')
    lost = np.array(values_of(warnings[0])['lost_direction'].split(), float)
    np.testing.assert_allclose(abs(lost), [1, 0, 0, 0, 0, 0], atol=0.02)
    begin = len(warnings)

    def again():
        one.answer((0.6, 0.01))
        return len(warnings) > begin

    one.spin_until(again, 'warning of the new direction')
    lost = np.array(values_of(warnings[-1])['lost_direction'].split(), float)
    assert abs(lost[:2] @ [math.cos(0.6), math.sin(0.6)]) > 0.999


def test_a_warning_says_what_is_lost_who_fights_and_which_way_leads_out(arm):
    one = arm('planar_2r')
    warnings = warnings_of(one)
    one.answer((0.0, 0.2), (0.0, -1.0))
    one.answer((0.0, 0.05), (0.0, -1.0))
    one.spin_until(lambda: len(warnings) == 2, 'warning')
    assert level_of(warnings[1]) == WARN
    assert warnings[1].message.startswith('near a singularity: elbow: ')
    assert 'along x in base_link' in warnings[1].message
    assert 'moving towards it' in warnings[1].message
    values = values_of(warnings[1])
    assert values['tendency'] == 'towards'
    assert values['time_to_warning'] == '0 s'
    assert 'q2=+' in values['way_out']
    assert float(values_of(warnings[0])['time_to_warning'].removesuffix(' s')) == pytest.approx(
        0.1, rel=0.05
    )


def test_a_late_listener_gets_the_last_warning(arm):
    one = arm('planar_2r')
    one.answer((0.4, 0.01))
    warnings = warnings_of(one)
    one.spin_until(lambda: warnings, 'latched warning')
    assert level_of(warnings[0]) == ERROR


def test_a_structurally_deficient_arm_says_so(arm):
    one = arm('six_joint_dh')
    assert one.robot.singularity.task.structurally_deficient
    warnings = warnings_of(one)
    one.send([0.1] * 6)
    one.spin_until(lambda: warnings, 'warning')
    assert 'at every pose' in values_of(warnings[0])['structural']
    assert float(values_of(warnings[0])['determinant']) == 0.0


def test_a_warning_is_said_though_a_topic_cannot_be(arm):
    one = arm()
    warnings = warnings_of(one)

    def broken(*arguments):
        raise RuntimeError('cannot publish')

    one.hear('pose', PoseStamped)
    one.node._outputs.publish = broken
    one.send((0.1, 0.2, 0.0))
    one.spin_until(lambda: warnings, 'warning')
    assert level_of(warnings[0]) == ERROR


def test_a_listener_of_another_process_does_not_hold_up_a_test(arm):
    one, other = arm('planar_2r'), Peer()
    other.peer.create_subscription(JointState, '/joint_states', lambda _: None, 10)
    one.spin_until(lambda: one.peer.count_subscribers('/joint_states') > 1, 'the other listener')
    one.answer((0.3, 0.4))
    other.close()
