# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Parameters: each takes effect at start and at run time, or is refused with the reason."""

import json
import math
import sys
import time
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from closed_forms import craig_jacobian_in_tool_axes
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, VelocityStamped
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter
from rclpy.qos import ReliabilityPolicy
from refusal import refused
from ros_harness import (
    LATCHED,
    SECOND,
    STEP,
    Arm,
    change,
    joint_state,
    level_of,
    nanoseconds,
    values_of,
)
from std_msgs.msg import Float64, Float64MultiArray, String
from std_srvs.srv import Trigger
from target_harness import Targets, pose_target, twist_target

import kinematics_service as ks
from kinematics_service.errors import RobotConflictError, RobotNotFoundError, SettingsError
from kinematics_service.kinematics.inverse.servo import ServoSettings, joint_velocity
from kinematics_service.node.parameters.settings import defaults, settings_from
from kinematics_service.node.parameters.table import PARAMETERS, ROBOT
from kinematics_service.rigid_motion import rotation_of_quaternion

ROUND_OFF = 1e-12
Q, QDOT = (0.3, -0.4, 1.2), (0.5, -0.2, 0.7)
CRAIG = ks.load_robot('craig_3r')
OK, WARN, ERROR, STALE = range(4)


# What each parameter does: a value, and a function that shows that it is in force.


def last(one, name, kind, qdot=QDOT):
    messages = one.hear(name, kind)
    one.send(Q, qdot)
    one.spin_until(lambda: messages, name)
    return messages[-1]


def shows_names(*names):
    def shows(one):
        jacobians = one.hear('jacobian', Float64MultiArray)
        one.stamp += STEP
        one.publish(joint_state(names, Q, (), one.stamp))
        one.spin_until(lambda: jacobians, 'Jacobian')
        assert jacobians[0].layout.dim[1].label == ','.join(names)
        described = one.call(Trigger, one.topic('describe'), Trigger.Request())
        assert [joint['name'] for joint in json.loads(described.message)['joints']] == [*names]

    return shows


def shows_frame_prefix(one):
    message = last(one, 'velocity', VelocityStamped)
    assert message.header.frame_id == message.reference_frame_id == 'left/base_link'
    assert message.body_frame_id == 'left/tool0'


def shows_base_frame(one):
    assert last(one, 'pose', PoseStamped).header.frame_id == 'table'


def shows_tool_frame(one):
    assert last(one, 'velocity', VelocityStamped).body_frame_id == 'gripper'


def shows_tool_place(one):
    position = last(one, 'pose', PoseStamped).pose.position
    T = ks.link_frames(CRAIG, Q)[-1]
    np.testing.assert_allclose(
        [position.x, position.y, position.z], T[:3] @ [0.1, -0.2, 0.05, 1.0], atol=ROUND_OFF
    )


def shows_tool_turn(one):
    # Half a turn about x: y and z of the tool are the other way round, and J in base axes stays.
    J = np.reshape(last(one, 'jacobian', Float64MultiArray).data, (6, 3))
    np.testing.assert_allclose(J, ks.jacobian(CRAIG, Q), atol=ROUND_OFF)
    orientation = last(one, 'pose', PoseStamped).pose.orientation
    T = ks.forward_kinematics(CRAIG, Q)
    R = rotation_of_quaternion((orientation.x, orientation.y, orientation.z, orientation.w))
    np.testing.assert_allclose(R, T[:3, :3] @ np.diag([1.0, -1.0, -1.0]), atol=1e-5)


def shows_jacobian_frame(one):
    J = np.array(last(one, 'jacobian', Float64MultiArray).data).reshape(6, 3)
    np.testing.assert_allclose(J, craig_jacobian_in_tool_axes(Q), atol=ROUND_OFF)


def shows_twist_frame(one):
    message = last(one, 'twist', TwistStamped)
    assert message.header.frame_id == 'tool0'
    linear = message.twist.linear
    np.testing.assert_allclose(
        [linear.x, linear.y, linear.z],
        (craig_jacobian_in_tool_axes(Q) @ QDOT)[:3],
        atol=ROUND_OFF,
    )


def shows_row_order(one):
    message = last(one, 'jacobian', Float64MultiArray)
    assert message.layout.dim[0].label == 'wx,wy,wz,vx,vy,vz'
    J = ks.jacobian(CRAIG, Q)
    np.testing.assert_array_equal(np.array(message.data).reshape(6, 3), [*J[3:], *J[:3]])


def shows_velocity_source(one):
    twists = one.hear('twist', TwistStamped)
    one.answer(Q, QDOT)
    one.answer(Q, QDOT)
    one.spin_until(
        lambda: twists and nanoseconds(twists[-1].header.stamp) == one.stamp, 'last twist'
    )
    linear = twists[-1].twist.linear
    assert (linear.x, linear.y, linear.z) == (0.0, 0.0, 0.0)


def shows_publish_rate(one):
    poses, begin = one.hear('pose', PoseStamped), one.stamp + SECOND
    for k in range(100):  # ten a second of a hundred a second
        one.send(Q, stamp=begin + k * STEP)
    one.stamp = begin + 10 * SECOND
    one.answer(Q, stamp=one.stamp)
    one.spin_until(lambda: nanoseconds(poses[-1].header.stamp) == one.stamp, 'last pose')
    stamps = [nanoseconds(pose.header.stamp) for pose in poses]
    assert len(stamps) - 1 in (10, 11)
    assert len(set(stamps)) == len(stamps)
    assert max(np.diff(stamps[1:-1])) == 10 * STEP


def shows_joint_state_timeout(one):
    one.answer(Q)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.spin_until(lambda: warnings and level_of(warnings[-1]) == STALE, 'STALE', 20.0)


def warning_at(one, elbow):
    warnings = one.hear('singularity/warning', DiagnosticStatus)
    one.node._estimator._alarm = type(one.node._estimator._alarm)()
    one.send((0.3, 0.0, elbow))
    one.spin_until(lambda: warnings, 'warning')
    return warnings[-1]


def shows_measure(one):
    assert values_of(warning_at(one, 1.2))['measure'] == 'condition_number'


def shows_warn(one):
    assert level_of(warning_at(one, 0.25)) == WARN


def shows_stop(one):
    assert level_of(warning_at(one, 0.07)) == ERROR


def shows_length(one):
    # Craig's 3R is judged by x y z: no angular row, so only the settings show the length.
    assert one.node.settings.robot.singularity.task.length == 0.25


def shows_rows(one):
    # Only x counts: y and z are out of reach.
    T = np.eye(4)
    T[:3, 3] = (0.1, 50.0, 60.0)
    targets = Targets(one)
    one.answer(Q)
    status = targets.ask(pose_target(T))
    assert level_of(status) == OK, status.message


def shows_axis(one):
    # A position that the arm reaches, but not with its tool's z axis upright.
    T = np.eye(4)
    T[:3, 3] = ks.forward_kinematics(CRAIG, Q)[:3, 3]
    targets = Targets(one)
    one.answer(Q)
    status = targets.ask(pose_target(T))
    assert level_of(status) == ERROR
    assert 'direction of tool axis z' in status.message


def shows_tolerance(one):
    # Beyond the reach of 0.82 m by less than the tolerance.
    T = np.eye(4)
    T[:3, 3] = (0.9, 0.0, 0.0)
    targets = Targets(one)
    one.answer(Q)
    status = targets.ask(pose_target(T))
    assert level_of(status) == OK
    assert float(values_of(status)['residual']) == pytest.approx(0.08)


def shows_target_timeout(one):
    targets = Targets(one)
    one.answer(Q)
    asked = time.monotonic()
    targets.ask(twist_target([0.01, 0.0, 0.0, 0.0, 0.0, 0.0]))
    one.spin_until(lambda: len(targets.velocities) == 2, 'end of the motion')
    # Later than by default, which a busy machine cannot make earlier.
    assert time.monotonic() - asked >= 0.6


# Where a setting of the servo makes a difference: joint positions and a twist.
ELBOW = (0.3, 0.2, 0.01), (0.05, 0.02, 0.03, 0.0, 0.0, 0.0)
FAST = (0.3, -0.4, 1.2), (3.0, 3.0, -3.0, 0.0, 0.0, 0.0)


def shows_servo(key, value, where):
    q, twist = where

    def shows(one):
        targets = Targets(one)
        one.answer(q)
        targets.ask(twist_target(twist))
        one.spin_until(lambda: targets.velocities, 'velocities')
        ours = joint_velocity(CRAIG, q, twist, ServoSettings(**{key: value})).qdot
        default = joint_velocity(CRAIG, q, twist).qdot
        assert np.max(np.abs(ours - default)) > 1e-3
        np.testing.assert_allclose(targets.velocities[-1].velocity, ours, atol=ROUND_OFF)

    return shows


def shows_limit(name, value):
    def shows(one):
        # A warning by them has a test of its own.
        assert getattr(one.node.settings.reference, name) == value

    return shows


def shows_robot_description(one):
    heard = one.listen(one.node.resolve_topic_name('robot_description'), String, LATCHED)
    one.spin_until(lambda: heard, 'URDF')
    (urdf,) = heard
    assert urdf.data.startswith('<?xml')
    assert 'name="craig_3r"' in urdf.data


def shows_acceleration_window(one):
    heard = one.hear('acceleration', AccelStamped)
    for rate in (0.0, 0.1, 0.1):
        one.send((0.0, 0.3, 0.4), (rate, 0.0, 0.0))
    one.spin_until(lambda: len(heard) == 2, 'accelerations')
    assert [message.accel.angular.z for message in heard] == pytest.approx([10.0, 0.0])


def shows_integration(one):
    poses = one.hear('pose', PoseStamped)
    one.send((0.1, 0.2, 0.3), (0.5, 0.0, 0.0))
    one.send((), (0.5, 0.0, 0.0))
    one.spin_until(lambda: len(poses) == 2, 'pose')
    expected = ks.forward_kinematics('craig_3r', (0.1 + 0.5 * STEP * 1e-9, 0.2, 0.3))[:3, 3]
    p = poses[-1].pose.position
    np.testing.assert_allclose((p.x, p.y, p.z), expected, atol=1e-12)
    told = one.diagnose().message
    assert 'from velocities for 0.0 s' in told
    assert 'velocity_noise' in told


TAKES_EFFECT = {
    'publish_robot_description': (True, shows_robot_description),
    'joint_prefix': ('left_', shows_names('left_q1', 'left_q2', 'left_q3')),
    'joint_names': (['tn__1_', 'tn 2', '/3'], shows_names('tn__1_', 'tn 2', '/3')),
    'frame_prefix': ('left/', shows_frame_prefix),
    'base_frame': ('table', shows_base_frame),
    'tool_frame': ('gripper', shows_tool_frame),
    'tool.xyz': ([0.1, -0.2, 0.05], shows_tool_place),
    'tool.rpy': ([3.14159265, 0.0, 0.0], shows_tool_turn),
    'jacobian_frame': ('tool', shows_jacobian_frame),
    'twist_frame': ('tool', shows_twist_frame),
    'row_order': ('angular_first', shows_row_order),
    'velocity_source': ('difference', shows_velocity_source),
    'integrate_velocities': (True, shows_integration),
    'acceleration_window': (0.0, shows_acceleration_window),
    'publish_rate': (10.0, shows_publish_rate),
    'joint_state_timeout': (0.2, shows_joint_state_timeout),
    'singularity.measure': ('condition_number', shows_measure),
    'singularity.warn': (0.4, shows_warn),
    'singularity.stop': (0.09, shows_stop),
    'singularity.length': (0.25, shows_length),
    'ik.rows': ('x', shows_rows),
    'ik.axis': ('z', shows_axis),
    'ik.tolerance': (0.1, shows_tolerance),
    'ik.target_timeout': (0.6, shows_target_timeout),
    'ik.damping': (0.2, shows_servo('damping', 0.2, ELBOW)),
    'ik.damped_below': (0.5, shows_servo('damped_below', 0.5, ELBOW)),
    'ik.default_rate': (0.2, shows_servo('default_rate', 0.2, FAST)),
    'reference.position_warn': (0.001, shows_limit('position_warn', 0.001)),
    'reference.position_stop': (0.01, shows_limit('position_stop', 0.01)),
    'reference.angle_warn': (0.002, shows_limit('angle_warn', 0.002)),
    'reference.angle_stop': (0.02, shows_limit('angle_stop', 0.02)),
}


# Parameters that one node can start with: none of a group hides the effect of another.
TOGETHER = [
    [
        *('publish_robot_description', 'joint_prefix', 'frame_prefix', 'row_order'),
        'acceleration_window',
    ],
    ['base_frame', 'tool_frame', 'tool.xyz', 'joint_state_timeout'],
    [
        *('jacobian_frame', 'twist_frame', 'ik.rows', 'singularity.measure'),
        *('singularity.length', 'integrate_velocities'),
    ],
    ['tool.rpy', 'velocity_source', 'joint_names', 'ik.damped_below'],
    ['singularity.warn', 'singularity.stop', 'ik.axis', 'ik.target_timeout', 'ik.damping'],
    [
        *('ik.tolerance', 'ik.default_rate', 'reference.position_warn'),
        *('reference.position_stop', 'reference.angle_warn', 'reference.angle_stop'),
    ],
    ['publish_rate'],
]


@pytest.mark.parametrize('names', TOGETHER)
def test_parameters_take_effect_at_start(arm, names):
    given = [word for name in names for word in ('-p', f'{name}:={TAKES_EFFECT[name][0]}')]
    one = arm('craig_3r', given)
    for name in names:
        TAKES_EFFECT[name][1](one)


@pytest.fixture(scope='module')
def node_of_all(ros_domain):
    # Beside the nodes of other tests. Those at start are read and written as bytes.
    one = Arm('craig_3r', ['-r', '__ns:=/shared'], transport='messages')
    # What it sends and hears on from test to test.
    one.answer(Q)
    one.diagnose()
    yield one
    one.close()


@pytest.fixture
def shared(node_of_all):
    """Return a node of all tests that ask for it; each leaves its parameters as they were."""
    peer, settings = node_of_all.peer, node_of_all.node.settings
    own = [*peer.subscriptions, *peer.publishers]
    yield node_of_all
    for one in [one for one in peer.subscriptions if one not in own]:
        peer.destroy_subscription(one)
    for one in [one for one in peer.publishers if one not in own]:
        peer.destroy_publisher(one)
    now = node_of_all.node.settings
    assert now.values == settings.values
    assert now.estimator == settings.estimator
    assert now.robot.singularity.thresholds == settings.robot.singularity.thresholds
    assert now.robot.singularity.task.length == settings.robot.singularity.task.length
    assert (now.base_frame, now.tool_frame) == (settings.base_frame, settings.tool_frame)
    assert now.period == settings.period


@pytest.mark.parametrize('name', TAKES_EFFECT)
def test_a_parameter_takes_effect_at_run_time_and_is_changed_back(shared, name):
    value, shows = TAKES_EFFECT[name]
    shared.answer(Q)
    key, default = name.replace('.', '__'), shared.node.get_parameter(name).value
    result = change(shared, **{key: value})
    assert result.successful, result.reason
    shows(shared)
    assert change(shared, **{key: default}).successful


def test_every_parameter_takes_effect_somewhere():
    names = {parameter.name for parameter in PARAMETERS}
    # Those have tests of their own, below, beside `~/scale` and of targets.
    own = {'publish_tf', 'ik.default_speed', 'ik.horizon'}
    own |= {'ik.redundancy', 'ik.redundancy_step'}
    own |= {name for name in names if name.startswith('scale.')}
    assert set(TAKES_EFFECT) == names - own
    assert sorted(TAKES_EFFECT) == sorted(name for some in TOGETHER for name in some)


def test_the_default_speed_limits_a_prismatic_joint(arm):
    q = (0.3, 0.9, 0.6)
    one = arm('spherical_rrp', ['-p', 'ik.default_speed:=0.01'])
    targets = Targets(one)
    one.answer(q)
    targets.ask(twist_target([0.3, 0.3, 0.3, 0.0, 0.0, 0.0]))
    one.spin_until(lambda: targets.velocities, 'velocities')
    assert abs(targets.velocities[-1].velocity[2]) <= 0.01


def test_the_horizon_limits_the_way_to_a_limit(arm):
    one = arm('puma560', ['-p', 'ik.horizon:=0.5'])
    limit = one.robot.limits[0, 1]
    targets = Targets(one)
    one.answer([limit - 0.01, -0.5, 0.3, 0.2, 0.6, 0.1])
    for horizon in (0.5, 2.0):
        assert change(one, ik__horizon=horizon).successful
        targets.velocities.clear()
        targets.ask(twist_target([-0.3, -0.3, 0.0, 0.0, 0.0, 0.5]))
        one.spin_until(lambda: targets.velocities, 'velocities')
        assert math.isclose(targets.velocities[-1].velocity[0], 0.01 / horizon, rel_tol=1e-6)


def test_of_several_parameters_set_at_once_one_wrong_one_spoils_all(shared):
    one = shared
    settings = one.node.settings
    result = change(one, jacobian_frame='tool', base_frame='table', twist_frame='world')
    assert not result.successful
    assert 'twist_frame' in result.reason
    assert one.node.settings is settings
    assert one.node.get_parameter('jacobian_frame').value == 'base'
    assert one.node.get_parameter('base_frame').value == ''


def test_parameters_that_only_go_together_are_taken_together(shared):
    one = shared
    assert not change(one, singularity__measure='determinant').successful
    result = change(
        one, singularity__measure='determinant', singularity__warn=0.02, singularity__stop=0.01
    )
    assert result.successful, result.reason
    thresholds = one.node.settings.robot.singularity.thresholds
    assert (thresholds.measure, thresholds.warn, thresholds.stop) == ('determinant', 0.02, 0.01)
    assert not change(one, singularity__stop=0.03).successful
    assert change(one, singularity__warn=0.2, singularity__stop=0.03).successful
    assert change(
        one, singularity__measure='distance', singularity__warn=0.0, singularity__stop=0.0
    ).successful


def test_of_parameters_set_one_by_one_the_good_ones_are_taken(shared):
    one = shared
    results = one.node.set_parameters(
        [Parameter('twist_frame', value='world'), Parameter('jacobian_frame', value='tool')]
    )
    assert [result.successful for result in results] == [False, True]
    assert one.node.settings.jacobian_frame == 'tool'
    assert one.node.settings.twist_frame == 'base'
    assert change(one, jacobian_frame='base').successful


def test_a_parameter_cannot_be_taken_away(shared):
    one = shared
    result = one.node.set_parameters([Parameter('twist_frame', Parameter.Type.NOT_SET)])[0]
    assert not result.successful
    assert one.node.get_parameter('twist_frame').value == 'base'
    # ROS itself refuses it for all parameters but those whose type may change.
    result = one.node.set_parameters([Parameter('tool.xyz', Parameter.Type.NOT_SET)])[0]
    assert not result.successful
    assert 'tool.xyz' in result.reason


def test_parameters_of_others_are_none_of_our_business(arm):
    one = arm('craig_3r')
    settings = one.node.settings
    one.node.declare_parameter('of_another', 1)
    assert change(one, of_another=2).successful
    assert change(one, use_sim_time=True).successful
    assert one.node.settings is settings


@pytest.mark.parametrize(
    ('name', 'values', 'words'),
    [
        ('kuka_iiwa14', {'measure': 'determinant', 'warn': 0.02, 'stop': 0.01}, 'square'),
        ('craig_3r', {'warn': 1.2}, '1 rad (57 deg)'),
    ],
)
def test_thresholds_that_cannot_be_are_refused_with_what_is_accepted(name, values, words):
    robot = ks.load_robot(name)
    given = defaults(robot) | {f'singularity.{key}': value for key, value in values.items()}
    with pytest.raises(SettingsError) as refusal:
        settings_from(given, robot)
    assert words in str(refusal.value)
    assert refusal.value.code != SettingsError.code


def test_parameters_are_set_from_afar(shared):
    one = shared

    def call(**values):
        request = SetParametersAtomically.Request(
            parameters=[
                Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
            ]
        )
        return one.call(
            SetParametersAtomically, one.topic('set_parameters_atomically'), request
        ).result

    result = call(row_order='angular_first', twist_frame='world')
    assert not result.successful
    assert (
        result.reason == "parameter twist_frame: 'world' is not accepted; give one of base, tool"
    )
    assert call(row_order='angular_first', twist_frame='tool').successful
    assert one.node.settings.row_order == 'angular_first'
    assert call(row_order='linear_first', twist_frame='base').successful


HOSTILE = (
    *(-0.0, 5e-324, 7e-301, 1e-19, 3e17, 1.7e308, -4.0, math.inf, math.nan),
    *('', '\n', '\x7f', 'x' * 20_000, '%s%n', 'é', 'x ' * 3_000),
    *(True, 2**63 - 1, [], [1.0, math.nan], ['a'], [True], [3]),
)


def test_whatever_a_parameter_is_set_to_has_an_answer(shared):
    one = shared
    before = one.node.settings.values
    for parameter in (ROBOT, *PARAMETERS):
        request = SetParameters.Request(
            parameters=[
                Parameter(parameter.name, value=value).to_parameter_msg() for value in HOSTILE
            ]
        )
        results = one.call(SetParameters, one.topic('set_parameters'), request).results
        assert len(results) == len(HOSTILE)
        assert all(result.successful or result.reason for result in results)
        if parameter is not ROBOT:
            back = Parameter(parameter.name, value=before[parameter.name])
            assert one.node.set_parameters([back])[0].successful
    one.answer(Q)


def test_an_error_of_our_own_at_a_parameter_is_a_refusal(shared, capfd, monkeypatch):
    one = shared

    def broken(*arguments):
        raise ZeroDivisionError('made for the test')

    # Of this very node: another one of its name would answer a request as well.
    monkeypatch.setitem(one.node._own_parameters._judge.__globals__, 'settings_from', broken)
    result = change(one, publish_rate=7.0)
    assert not result.successful
    assert 'made for the test' in result.reason
    assert capfd.readouterr().err.count('made for the test') == 1
    assert one.node.get_parameter('publish_rate').value == 0.0


def test_every_parameter_is_described_with_type_and_range(shared):
    one = shared
    names = [parameter.name for parameter in (ROBOT, *PARAMETERS)]
    listed = one.call(
        ListParameters, one.topic('list_parameters'), ListParameters.Request()
    ).result.names
    assert set(names) <= set(listed)
    request = DescribeParameters.Request(names=names)
    response = one.call(DescribeParameters, one.topic('describe_parameters'), request)
    kinds = {
        str: ParameterType.PARAMETER_STRING,
        bool: ParameterType.PARAMETER_BOOL,
        float: ParameterType.PARAMETER_DOUBLE,
    }
    for parameter, descriptor in zip((ROBOT, *PARAMETERS), response.descriptors):
        assert descriptor.description.endswith('.')
        if isinstance(parameter.default, list):  # whose type ROS does not tell where it is empty
            assert descriptor.dynamic_typing
            wanted = 'empty, or 3 numbers' if parameter.numbers else ''
            assert descriptor.additional_constraints == wanted
        else:
            assert descriptor.type == kinds[type(parameter.default)]
        assert descriptor.read_only == (parameter is ROBOT)
        if type(parameter.default) is float:
            assert descriptor.floating_point_range
        if parameter.name == 'publish_rate':
            assert descriptor.additional_constraints == '0, or at least 0.001'
        for choice in parameter.choices:
            assert choice in descriptor.additional_constraints


# The robot


def test_the_robot_cannot_be_changed_at_run_time(shared):
    one = shared
    result = change(one, robot='puma560')
    assert not result.successful
    assert one.node.get_parameter('robot').value == 'craig_3r'


def test_the_robot_may_be_a_parameter(arm):
    one = arm(None, ['-p', 'robot:=planar_2r'])
    assert one.robot.name == 'planar_2r'


def test_the_robot_is_puma560_where_none_is_named(arm):
    assert arm(None).robot.name == 'puma560'


def test_the_same_robot_may_be_named_twice(arm):
    assert arm('planar_2r', ['-p', 'robot:=planar_2r']).robot.name == 'planar_2r'


def test_two_different_robots_are_wrong_usage(arm):
    with refused(RobotConflictError, 'robot-conflict', 'craig_3r', 'planar_2r'):
        arm('craig_3r', ['-p', 'robot:=planar_2r'])


def test_an_unknown_robot_is_refused_with_the_choices(arm):
    with pytest.raises(RobotNotFoundError) as error:
        arm('craig_3')
    assert error.value.name == 'craig_3'
    assert 'craig_3r' in str(error.value)


def test_parameters_override_the_robot_file(arm, tmp_path):
    text = ks.bundled_robots()['planar_2r'].read_text()
    file = tmp_path / 'arm.yaml'
    file.write_text(
        text.replace('singularity:\n', 'singularity:\n  warn: 0.3\n  stop: 0.2\n  length: 2.5\n')
    )
    assert file.read_text() != text
    one = arm(str(file))
    thresholds = one.node.settings.robot.singularity.thresholds
    assert (thresholds.warn, thresholds.stop) == (0.3, 0.2)
    assert one.node.settings.robot.singularity.task.length == 2.5
    assert change(one, singularity__warn=0.4, singularity__length=1.5).successful
    thresholds = one.node.settings.robot.singularity.thresholds
    assert (thresholds.warn, thresholds.stop) == (0.4, 0.2)
    assert one.node.settings.robot.singularity.task.length == 1.5
    assert change(one, singularity__measure='condition_number', singularity__warn=0.0).successful
    thresholds = one.node.settings.robot.singularity.thresholds
    assert (thresholds.measure, thresholds.warn, thresholds.stop) == ('condition_number', 17, 30)


# Names, files, QoS


def test_joint_states_and_outputs_can_be_remapped(arm):
    one = arm('craig_3r', ['-r', 'joint_states:=/robot/states', '-r', '~/pose:=/tool_pose'])
    assert one.node._input.subscription.topic_name == '/robot/states'
    poses = one.listen('/tool_pose', PoseStamped)
    one.send(Q)
    one.spin_until(lambda: poses, 'pose')
    assert one.counts()['topic'] == '/robot/states'


def test_the_node_can_be_renamed_and_its_topics_follow(arm):
    one = arm('craig_3r', ['-r', '__node:=arm_1', '-r', '__ns:=/cell'])
    assert one.node.get_fully_qualified_name() == '/cell/arm_1'
    one.answer(Q)
    assert one.topic('pose') == '/cell/arm_1/pose'
    assert one.diagnose().name == 'cell/arm_1: input'
    assert one.counts()['topic'] == '/cell/joint_states'


def test_a_parameter_file_is_read(arm, tmp_path):
    file = tmp_path / 'parameters.yaml'
    file.write_text(
        '/**/kinematics:\n  ros__parameters:\n    twist_frame: tool\n'
        '    singularity: {warn: 0.2, stop: 0.1}\n'
    )
    one = arm('craig_3r', ['--params-file', str(file)])
    assert one.node.settings.twist_frame == 'tool'
    assert one.node.settings.robot.singularity.thresholds.warn == 0.2


def test_the_qos_of_an_output_can_be_overridden(arm):
    topic = 'qos_overrides./kinematics/pose.publisher'
    one = arm('craig_3r', ['-p', f'{topic}.reliability:=best_effort', '-p', f'{topic}.depth:=3'])
    profile = {p.topic_name: p.qos_profile for _, _, p, *_ in one.node._outputs.channels}[
        '/kinematics/pose'
    ]
    assert profile.reliability == ReliabilityPolicy.BEST_EFFORT
    assert profile.depth == 3
    others = {p.qos_profile.reliability for _, _, p, *_ in one.node._outputs.channels[1:]}
    assert others == {ReliabilityPolicy.RELIABLE}


@pytest.mark.parametrize('reliability', ['reliable', 'best_effort'])
def test_the_qos_of_the_input_can_be_overridden(arm, reliability):
    name = 'qos_overrides./joint_states.subscription.reliability'
    one = arm('craig_3r', ['-p', f'{name}:={reliability}'])
    one.answer(Q)
    for _ in range(3):  # what publishers offer changes nothing
        assert one.counts()['reliability'] == reliability.replace('_', ' ')
    assert one.node.get_parameter(name).value == reliability


def test_thinning_out_starts_anew_with_the_stamps(arm):
    one = arm('craig_3r', ['-p', 'publish_rate:=1.0'])
    one.answer(Q, stamp=100 * SECOND)
    one.answer(Q, stamp=STEP)
    one.send(Q, stamp=2 * STEP)
    one.answer(Q, stamp=SECOND)
    assert one.stamps() == [100 * SECOND, STEP, SECOND]


def test_the_warning_is_not_thinned_out(arm):
    one = arm('planar_2r', ['-p', 'publish_rate:=0.1'])
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.answer((0.1, 1.0))
    one.send((0.1, 0.01))
    one.spin_until(lambda: len(warnings) == 2, 'warning')
    assert len(one.poses) == 1


# /tf


@pytest.mark.skipif('tf2_msgs' in sys.modules, reason='tf2_msgs is installed here')
def test_publish_tf_is_refused_without_tf2_msgs(arm, shared):
    result = change(shared, publish_tf=True)
    assert not result.successful
    assert 'tf2_msgs' in result.reason
    with refused(SettingsError, 'missing-package', 'publish_tf', 'tf2_msgs'):
        arm('craig_3r', ['-p', 'publish_tf:=true'])


class FakeTfMessage:
    def __init__(self, transforms):
        self.transforms = transforms


@pytest.fixture
def tf2_msgs(monkeypatch):
    """Pretend that tf2_msgs can be imported."""
    for name in ('tf2_msgs', 'tf2_msgs.msg'):
        module = ModuleType(name)
        module.__spec__ = pytest.__spec__
        module.TFMessage = FakeTfMessage
        monkeypatch.setitem(sys.modules, name, module)


def test_tf_carries_the_pose_of_the_tool_while_it_is_asked_for(arm, tf2_msgs):
    one = arm('craig_3r')
    sent = []

    class Recorder:
        publish, msg_type = sent.append, FakeTfMessage

    create = one.node.create_publisher
    one.node.create_publisher = lambda kind, topic, *args, **options: (
        (Recorder if topic == '/tf' else create)
        if kind is FakeTfMessage
        else create(kind, topic, *args, **options)
    )
    one.answer(Q)
    assert sent == []
    assert change(one, publish_tf=True).successful
    pose = one.answer(Q).pose
    (transform,) = sent[0].transforms
    assert transform.header.frame_id == 'base_link'
    assert transform.child_frame_id == 'tool0'
    assert transform.transform.translation.x == pose.position.x
    assert transform.transform.rotation == pose.orientation
    assert change(one, publish_tf=False).successful
    one.answer(Q)
    assert len(sent) == 1


def test_a_scalar_follows_the_length(arm):
    one = arm('planar_3r', ['-p', 'singularity.length:=2.0'])
    values = one.hear('singularity/condition_number', Float64)
    one.send((0.1, 0.7, 0.3))
    one.spin_until(lambda: values, 'condition number')
    first = values[0].data
    assert change(one, singularity__length=0.5).successful
    one.send((0.1, 0.7, 0.3))
    one.spin_until(lambda: len(values) == 2, 'condition number')
    J = ks.jacobian(ks.load_robot('planar_3r'), (0.1, 0.7, 0.3))[[0, 1, 5]]
    for length, told in ((2.0, first), (0.5, values[1].data)):
        expected = np.linalg.cond(np.diag([1.0, 1.0, length]) @ J)
        assert told == pytest.approx(expected, rel=1e-9)
